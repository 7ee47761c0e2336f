/// What became of a stage, for people and for programs.
#pragma once

#include <optional>
#include <string>

#include "pipeline/contract/stage_report.h"
#include "pipeline/runner/record.h"

namespace mbtfm::runner {

struct StageResult {
  std::string stage;
  StageStatus status;  ///< before the run
  bool was_run = false;
  bool converged = true;
  double seconds = 0, peak_memory_MB = 0;
  std::optional<StageReport> report = {};  ///< of a stage that was run
};

enum class Detail {
  brief,  ///< effects by name alone, and only those that are on and nobody asked for
  all     ///< every effect with its number, memory, and why the stage was run
};

/// One line for the stage; below it, indented, its findings and effects.
std::string text_of(const StageResult& result, Detail detail);

/// JSON objects, one a line: the stage, its findings, its effects (docs/formats/json.md, "Events").
std::string events_of(const StageResult& result);
/// What a first look at a cell's images found, as `mbtfm check --json` prints it.
struct ImageLook {
  std::string cell, facts;
  std::vector<std::string> cautions;
  std::string error, hint;  ///< why it could not be looked at; empty: it was
};
std::string event_of_look(const ImageLook& look);
/// What ended a run.
std::string event_of_error(const std::string& message, int exit_code);

}  // namespace mbtfm::runner
