/// All stages of one cell that are not up to date.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "pipeline/runner/record.h"
#include "pipeline/runner/settings.h"

namespace mbtfm::runner {

struct RunOptions {
  std::filesystem::path stage_folder;  ///< where the stages' executables are
  int threads = 1;
  bool is_quiet = false;
  std::vector<std::string> only;  ///< names of stages; empty: all
  std::vector<std::string> redo;  ///< stages to run even if up to date or changed by hand
  std::string preset;             ///< name of what `beneath` comes from; empty: none
  std::vector<Setting> beneath;   ///< in place of defaults, where cell.toml says nothing
  std::string version;
  std::function<void(const std::string&)> say;  ///< one line for each stage
};

/// What became of a stage in this run.
struct StageOutcome {
  std::string stage;
  StageStatus status;  ///< before the run
  bool was_run = false;
  bool converged = true;
  double seconds = 0;  ///< of this run
};

struct CellOutcome {
  std::vector<StageOutcome> stages;
  bool converged() const;
};

/// A stage ended with an error, which it has printed itself.
struct StageFailed : std::runtime_error {
  int exit_code = 0;
  StageFailed(const std::string& message, int code) : std::runtime_error(message), exit_code(code) {}
};

/// Bring the stages of a cell folder up to date and write run.json.
/// A stage that does not converge marks its outputs; the later ones still run.
/// @throws InputError where an input lacks, UsageError for an unknown stage, StageFailed
CellOutcome run_cell(const std::filesystem::path& cell, const RunOptions& options);

/// Merge the records of all stages to run.json.
void write_run_record(const std::filesystem::path& cell, const RunOptions& options, const CellOutcome& outcome);

/// Names of [images] from cell.toml. @throws InputError where there is no cell.toml, or for an unknown table or key
ImageNames read_image_names(const std::filesystem::path& cell);

}  // namespace mbtfm::runner
