/// All stages of one cell that are not up to date.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "pipeline/contract/path.h"
#include "pipeline/runner/process.h"
#include "pipeline/runner/record.h"
#include "pipeline/runner/stage_result.h"

namespace mbtfm::runner {

struct RunOptions {
  fs::path stage_folder;  ///< where the stages' executables are
  int threads = 1;
  bool is_quiet = false;
  bool is_checked = false;                     ///< every stage is known to accept its parameters
  std::vector<std::string> only;               ///< names of stages; empty: all
  std::vector<std::string> redo;               ///< stages to run even if up to date or changed by hand
  bool explain = false;                        ///< let the fit estimate what the effects that are off would change
  ProcessLimits limits;                        ///< of each stage
  std::string preset = {};                     ///< name of what `beneath` comes from; empty: none
  std::vector<Setting> beneath = {};           ///< in place of defaults, where cell.toml says nothing
  std::vector<Setting> beneath_in_space = {};  ///< the same of a cell in space
  std::vector<Setting> set = {};               ///< in place of what cell.toml says
  std::string version;
  std::function<void(const StageResult&)> say;        ///< what became of each stage
  std::function<Sink()> sink = {};                    ///< makes one for what a stage prints; empty: our standard error
  std::function<void(const std::string&)> note = {};  ///< takes why the cell has the stages that it has
  std::function<void()> finish;                       ///< called when the stages are done, the cell still being ours
};

/// How a stage that ended with an error did so.
struct StageFailure {
  int exit_code = 0;     ///< as the shell counts
  std::string how = {};  ///< "exit code 3", "timed out after 60 s"
  std::string message = {};
};

/// What became of a stage in this run.
struct StageOutcome {
  std::string stage;
  StageStatus status;  ///< before the run
  bool was_run = false;
  bool converged = true;
  double seconds = 0;  ///< of this run
  std::optional<StageFailure> failure = {};
};

struct CellOutcome {
  std::string started, ended;  ///< UTC, ISO 8601; empty: not run, or not ended yet
  std::vector<StageOutcome> stages = {};
  bool converged() const;
  /// "fit, network"; empty where all did
  std::string not_converged() const;
};

/// A stage ended with an error, which it has printed itself.
struct StageFailed : std::runtime_error {
  StageFailure failure = {};
  StageFailed(const std::string& stage, StageFailure what)
      : std::runtime_error("mbtfm-" + stage + ": " + what.how), failure(std::move(what)) {}
};

/// Bring the stages of a cell folder up to date and write run.json, also where a stage fails.
/// A stage that does not converge marks its outputs; the later ones still run.
/// @throws InputError where an input lacks, UsageError for an unknown stage, CellBusy, StageFailed
CellOutcome run_cell(const fs::path& cell, const RunOptions& options);

/// What run_cell would find, without starting anything: by stage, its status. @throws InputError, UsageError
CellOutcome look_at_cell(const fs::path& cell, const RunOptions& options);

/// Of look_at_cell: there is nothing left to do for the stages asked for, and run.json and the report show it.
bool is_done(const fs::path& cell, const RunOptions& options, const CellOutcome& now);

/// Does the stage accept this cell.toml? It prints why not. @throws StageFailed where it does not
/// @param inputs  flags and files that it looks at, too
void check_parameters(const Stage& stage, const fs::path& toml_file, const RunOptions& options,
                      const Sink& sink = print_on, const std::vector<std::string>& inputs = {});

}  // namespace mbtfm::runner
