/// What run.json records of how a cell's results came about.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/cell_kind.h"
#include "pipeline/contract/findings.h"

namespace mbtfm::report {

struct StageLine {
  std::string name, state, why, version, summary;
  std::string seconds, peak_memory_MB;  ///< for people; empty where not known
  bool converged = true;
  /// name, value
  std::vector<std::pair<std::string, std::string>> parameters, figures = {};
  /// file, SHA-256
  std::vector<std::pair<std::string, std::string>> inputs;
};

struct EffectLine {
  std::string name, stage, why, seconds;
  bool is_on = false;
};

/// What came of a run that was asked for an accuracy.
struct WantedAccuracy {
  std::string verdict;
  bool is_met = false;
};

struct Provenance {
  std::string version;
  CellKind kind = {};
  std::string kind_because;
  std::string started, ended, processor;  ///< of the run; empty: not known
  std::string preset;                     ///< empty: none was asked for
  std::optional<WantedAccuracy> accuracy;
  std::vector<StageLine> stages = {};
  std::vector<EffectLine> effects = {};
  std::vector<Finding> findings;
};

/// "mbtfm 1.2"; "mbtfm" where no version is known.
std::string program_of(const Provenance& provenance);

/// Of run.json; empty where there is none. @throws InputError where it is malformed
Provenance read_provenance(const std::filesystem::path& run_file);

}  // namespace mbtfm::report
