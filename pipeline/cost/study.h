/// What accuracy costs in time, for one cell: the fit again and again, each time with one knob turned.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

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
  double seconds = 0;      ///< from start to end of network and fit, median of the repeats
  double cpu_seconds = 0;  ///< of all threads, likewise
  double peak_memory_MB = 0;
  int n_runs = 0;            ///< 0: there was no time for it
  std::string failure = {};  ///< how it ended, where not well
  double tension_error = 0;  ///< |t − reference| / |reference| over the fibres
  double force_error = 0;    ///< of the total force, relative
  double stated_error = 0;   ///< what the error budget says of the tensions
};

struct Study {
  std::string reference;  ///< what errors are against: "the truth", or the finest rung
  std::vector<Measurement> measurements;
};

/// Runs network and fit in a scratch folder below CELL/cost; segmentation and displacements are taken as they are.
/// @throws InputError where the cell was not run yet
Study measure(const std::filesystem::path& cell, const StudyOptions& options);

}  // namespace mbtfm::cost
