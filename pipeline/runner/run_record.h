/// run.json: how all that is in a cell folder came about.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "pipeline/contract/path.h"

namespace mbtfm::runner {

struct CellOutcome;
struct RunOptions;

/// How a run ended.
enum class RunOutcome { done, failed, unfinished };
constexpr auto words(RunOutcome) { return std::array{"done", "failed", "unfinished"}; }

/// Merge the records of all stages, and what became of them in this run, to run.json. Of stages that this run was not
/// asked for, it keeps what an earlier one recorded.
/// @throws OutputError
void write_run_record(const fs::path& cell, const RunOptions& options, const CellOutcome& outcome);

/// run.json is there and states that every stage asked for is done.
bool run_record_is_complete(const fs::path& cell, const RunOptions& options);

/// The state of a stage in run.json; empty if it has none.
std::string recorded_state(const fs::path& cell, const std::string& stage);

/// "segment", "exit code 3", …: the failure in run.json; empty if it has none.
struct RecordedFailure {
  std::string stage, how = {}, message = {};
};
std::optional<RecordedFailure> recorded_failure(const fs::path& cell);

}  // namespace mbtfm::runner
