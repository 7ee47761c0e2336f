/// What accuracy costs in time: the stages again and again, each time with one knob turned, for one cell or several.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "pipeline/contract/cell_kind.h"
#include "pipeline/cost/ladder.h"

namespace mbtfm::cost {

struct StudyOptions {
  std::filesystem::path stage_folder;  ///< where the stages' executables are
  int threads = 1;
  double budget_s = 600;  ///< no run is begun after this
  int repeats = 3;        ///< of each rung, at most
  Extent extent = Extent::quick;
  std::function<void(const std::string&)> say;
};

struct Measurement {
  Rung rung;
  double seconds = 0;      ///< of all stages, one after the other, median of the repeats
  double cpu_seconds = 0;  ///< of all threads, likewise
  double peak_memory_MB = 0;
  int n_runs = 0;            ///< 0: there was no time for it
  std::string failure = {};  ///< how it ended, where not well
  int n_fibres = 0;          ///< that the reference knows, too; none in space
  double error = 0;  ///< |t − reference| / |reference|: over the tensions of these, or over the map of tractions
  double force_error = 0;   ///< of the total force, relative
  double stated_error = 0;  ///< what the error budget says of the tensions, or the standard errors of the tractions
};

struct Study {
  CellKind kind = CellKind::plane;
  std::string reference;    ///< what errors are against: "the truth", or the finest rung
  bool has_images = false;  ///< times are those of all stages; else of network and fit, and nothing is segmented anew
  std::vector<Measurement> measurements = {};
};

/// Runs the stages in a scratch folder below CELL/cost. Of a cell without images, or without all of them, segmentation
/// and displacements are taken as they are. Of a cell in space the stage `traction` alone is run.
/// @throws InputError where the cell was not run yet, or is a sheet
Study measure(const std::filesystem::path& cell, const StudyOptions& options);

/// The same rungs of several cells as one: root mean squares of the errors, means of the rest. One cell's best rung is
/// the luckiest, too; over several luck levels out. A rung counts where it was measured in all of them.
/// @throws UsageError where they are of two kinds
Study combined(const std::vector<Study>& studies);

}  // namespace mbtfm::cost
