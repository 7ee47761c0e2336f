/// As accurate as asked for, at the least cost: presets are tried from the cheapest on, and each answer's error budget
/// says whether it is accurate enough, or what prevents it.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "pipeline/contract/results.h"
#include "pipeline/runner/stages.h"

namespace mbtfm::cost {

/// Parameters that trade accuracy for time together.
struct Preset {
  std::string name;
  std::vector<runner::Setting> settings;  ///< where they differ from the defaults, of cells with fibres
  std::vector<runner::Setting> in_space;  ///< the same of cells in space
};

/// The cheapest first.
const std::vector<Preset>& presets();

/// @throws UsageError for an unknown name
const Preset& preset_named(const std::string& name);

/// Root mean squares over a cell's fibres, relative to that of their tensions.
struct RelativeError {
  double total = 0;
  double beads = 0, segmentation = 0, model = 0;
  double unavoidable = 0;   ///< beads and segmentation together: no amount of computing lowers it
  bool is_complete = true;  ///< one mesh shows nothing of the mesh's part
};
/// @throws InvalidData where no fibre pulls
RelativeError relative_error(const ErrorBudget& budget);

/// "1%", "0.01". @throws UsageError
double parse_accuracy(const std::string& text);

struct AccuracyOutcome {
  std::string preset;  ///< that was used in the end
  RelativeError reached;
  bool is_met = false;
  std::string verdict;  ///< in words
};

/// @param run  brings the cell up to date with the preset of this name and returns its error budget
AccuracyOutcome reach_accuracy(double wanted, const std::function<ErrorBudget(const std::string& preset)>& run);

/// Add what was asked for and reached to run.json.
void record_accuracy(const std::filesystem::path& cell, double wanted, const AccuracyOutcome& outcome);

}  // namespace mbtfm::cost
