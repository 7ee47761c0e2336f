#include "pipeline/runner/batch.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iomanip>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <thread>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/stopwatch.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/json.h"
#include "pipeline/files/names.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/numerics/parallel.h"
#include "pipeline/runner/batch_table.h"
#include "pipeline/runner/cell_stages.h"
#include "pipeline/runner/image_sets.h"
#include "pipeline/runner/lock.h"
#include "pipeline/runner/run_record.h"
#include "pipeline/stage/console.h"

namespace mbtfm::runner {
namespace {

/// The note on a folder without cell.toml that seems to be a cell all the same. What we write is no TIFF.
std::optional<SkippedFolder> as_no_cell(const fs::path& folder, const std::vector<fs::path>& entries) {
  if (const std::string name = misnamed_settings(entries); !name.empty())
    return SkippedFolder{folder, "its settings are called " + name + ": rename the file cell.toml"};
  const auto n_pictures = std::ranges::count_if(entries, [](const fs::path& entry) {
    return files::lower_case(entry.extension().string()).starts_with(".tif") && files::is_file(entry);
  });
  if (n_pictures < 2) return std::nullopt;  // beads are seen twice; one picture may be an overview
  return SkippedFolder{
      folder,
      "pictures and no cell.toml: mbtfm init '" + folder.string() + "', or for all: mbtfm init STUDY --like CELL",
      true};
}

/// What cannot be read is skipped: a study may hold lost+found, or a folder of somebody else.
void collect_cells(const fs::path& folder, FoundCells& found) {
  std::error_code error;
  if (fs::is_regular_file(folder / "cell.toml", error)) {
    const std::vector<fs::path> of_picture = cells_of_picture(folder);
    if (of_picture.empty()) found.cells.push_back(folder);
    found.cells.insert(found.cells.end(), of_picture.begin(), of_picture.end());
    return;
  }
  // That there is none is no error. One that leads round in a circle is: the folder is meant to be a cell.
  const bool is_missing = !error || error == std::errc::no_such_file_or_directory;
  if (!is_missing) {
    found.skipped.push_back({folder, "its cell.toml cannot be read: " + error.message()});
    return;
  }
  const std::vector<fs::path> entries = files::visible_in(folder, error);
  FoundCells below;
  for (const fs::path& entry : entries) {
    std::error_code unseen;
    const fs::file_type type = fs::symlink_status(entry, unseen).type();
    // what is too deep to be looked at is reported as skipped
    if (type == fs::file_type::directory || type == fs::file_type::none) collect_cells(entry, below);
    if (type == fs::file_type::symlink && files::is_file(entry / "cell.toml"))
      found.skipped.push_back({entry, "a link, which is not followed: give the folder that it leads to"});
  }
  if (below.cells.empty())
    if (const auto as = as_no_cell(folder, entries)) below.skipped = {*as};  // what is in it is of it: frames, say
  std::ranges::move(below.cells, std::back_inserter(found.cells));
  std::ranges::move(below.skipped, std::back_inserter(found.skipped));
  if (error) found.skipped.push_back({folder, "cannot be read: " + error.message()});
}

constexpr const char* kRunRecord = "run.json";

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

/// When run.json was written last, to know whether this run wrote it.
std::optional<fs::file_time_type> time_of_record(const fs::path& cell) {
  std::error_code is_missing;
  const auto time = fs::last_write_time(cell / kRunRecord, is_missing);
  return is_missing ? std::nullopt : std::optional(time);
}

/// A run is killed where it takes longer than all of its stages may, and a minute to hash, to report and to end.
ProcessLimits limits_of_cell(const ProcessLimits& of_stage) {
  constexpr double kMargin_s = 60;
  if (!of_stage.seconds) return {};
  constexpr double kMostStages = 4;  // a cell has, of either kind
  return {.seconds = kMostStages * *of_stage.seconds + kMargin_s};
}

void mark_unreadable(const std::exception& error, BatchCell& cell) {
  cell.exit_code = exit_code::kInput;
  cell.how = "unreadable";
  cell.message = first_line(error.what());
}

/// The failure in run.json, if any.
void add_recorded_failure(BatchCell& cell) {
  try {
    const std::optional<RecordedFailure> failure = recorded_failure(cell.cell);
    if (!failure) return;
    cell.failed_stage = failure->stage;
    cell.how = failure->how;
    if (!failure->message.empty()) cell.message = first_line(failure->message);
  } catch (const InputError& error) {
    mark_unreadable(error, cell);
  }
}

BatchCell run_one(const fs::path& cell, const BatchOptions& options) {
  std::vector<std::string> command = {options.program.string(), "run", cell.string(), "--quiet"};
  command.insert(command.end(), options.arguments.begin(), options.arguments.end());
  BatchCell outcome{.cell = cell};
  try {
    const fs::path file = cell / "run.log";
    if (const std::string kind = files::is_own_file(file) ? files::kind_of_file(file) : "";
        !kind.empty() && !kind.starts_with("mbtfm"))
      throw OutputError(file.string() + " is there, and no batch made it: give it another name");
    files::write_text(file, "mbtfm run\n");
    const auto record_before = time_of_record(cell);
    std::ofstream log(file, std::ios::app);
    const ProcessResult result = run_process(command, limits_of_cell(options.run.limits),
                                             [&](std::string_view text) { log << text << std::flush; });
    outcome.seconds = result.seconds;
    outcome.exit_code = exit_code_of(result);
    if (outcome.exit_code == 0 || outcome.exit_code == exit_code::kBusy) return outcome;
    outcome.how = how_it_ended(result);
    outcome.message = first_line(error_in(result.last_output));
    if (time_of_record(cell) == record_before) return outcome;
    add_recorded_failure(outcome);
  } catch (const OutputError& error) {  // no log, no process: this cell's matter, not the batch's
    outcome.exit_code = exit_code::kOutput;
    outcome.how = "not started";
    outcome.message = error.what();
  }
  return outcome;
}

/// What a batch sees of a cell before it runs it.
struct Look {
  enum class Finding { done, to_run, busy };
  Finding finding = Finding::to_run;
  std::vector<std::string> stages = {};  ///< that may run
  BatchCell outcome;                     ///< of a cell that is done, or cannot be read
};

/// Is there anything to do for the cell? If it is not even readable, `mbtfm run` reports why.
Look look_at(const fs::path& cell, const RunOptions& options) {
  Look look;
  look.outcome.cell = cell;
  try {
    const CellLock lock(cell, options.only);
    const CellOutcome now = look_at_cell(cell, options);
    for (const StageOutcome& stage : now.stages) {
      const StageState state = stage.status.state;
      if (state == StageState::must_run || state == StageState::up_to_date) look.stages.push_back(stage.stage);
    }
    if (!is_done(cell, options, now)) return look;
    look.finding = Look::Finding::done;
    if (now.converged()) return look;
    look.outcome.exit_code = exit_code::kNotSolved;
    look.outcome.how = "exit code " + std::to_string(exit_code::kNotSolved);
    look.outcome.failed_stage = now.not_converged();
    look.outcome.message = "not converged; the outputs are marked";
  } catch (const CellBusy&) {
    look.finding = Look::Finding::busy;
  } catch (const InputError& error) {
    mark_unreadable(error, look.outcome);
  } catch (const fs::filesystem_error& error) {
    mark_unreadable(error, look.outcome);
  } catch (const OutputError&) {
    // to run
  }
  return look;
}

/// Wait until no other run is in the cell, do what it has left, and take the outcome.
BatchCell run_when_free(const fs::path& cell, const BatchOptions& options) {
  constexpr std::chrono::milliseconds kPause(200);  // a look costs about a millisecond
  for (;;) {
    const Look look = look_at(cell, options.run);
    if (look.finding == Look::Finding::done) return look.outcome;
    if (look.finding == Look::Finding::to_run) {
      const BatchCell outcome = run_one(cell, options);
      if (outcome.exit_code != exit_code::kBusy) return outcome;
    }
    throw_if_interrupted();
    std::this_thread::sleep_for(kPause);
  }
}

/// Once for all cells of the same parameters, which are most as a rule: do the stages accept them? Starting a stage to
/// ask costs up to half a second, and a wrong parameter should be named before an hour's work, not after it.
/// The outcomes of cells that are refused say so.
void check_parameters_once(std::vector<Look>& looks, const BatchOptions& options) {
  std::map<std::pair<std::string, std::string>, std::vector<Look*>> cells_by_settings;
  for (Look& look : looks) {
    if (look.finding == Look::Finding::done || look.stages.empty()) continue;
    const fs::path& cell = look.outcome.cell;
    const Settings settings = read_settings(cell / "cell.toml", stages_of(cell, read_image_names(cell)).stages);
    for (const std::string& stage : look.stages) cells_by_settings[{stage, settings.at(stage)}].push_back(&look);
  }
  for (const auto& [key, same] : cells_by_settings) {
    const auto stage = std::find_if(all_stages().begin(), all_stages().end(),
                                    [&, &key = key](const Stage& s) { return s.name == key.first; });
    try {
      check_parameters(*stage, same.front()->outcome.cell / "cell.toml", options.run, [](std::string_view) {});
    } catch (const StageFailed& error) {
      for (Look* look : same) {
        look->finding = Look::Finding::done;
        look->outcome.exit_code = error.failure.exit_code;
        look->outcome.failed_stage = stage->name;
        look->outcome.how = error.failure.how;
        look->outcome.message = first_line(error.failure.message);
      }
    }
  }
}

/// How far a batch is, and how long it will take. Threads may share one.
class BatchProgress {
 public:
  BatchProgress(int n_to_run, const BatchOptions& options) : n_to_run_(n_to_run), options_(options) {}

  void starts(const fs::path& cell) {
    const std::lock_guard guard(mutex_);
    running_.insert(cell.filename().string());
    show();
  }

  /// It was not started after all.
  void put_off(const fs::path& cell) {
    const std::lock_guard guard(mutex_);
    running_.erase(cell.filename().string());
  }

  void ended(const BatchCell& cell) {
    const std::lock_guard guard(mutex_);
    running_.erase(cell.cell.filename().string());
    ++n_done_;
    n_failed_ += cell.exit_code != 0;
    if (options_.ended) options_.ended(cell);
    if (options_.say) {
      std::ostringstream line;
      line << '[' << n_done_ << '/' << n_to_run_ << "] " << cell.cell.string() << ": " << std::fixed
           << std::setprecision(1) << cell.seconds << " s: ";
      if (cell.exit_code == 0)
        line << verdict_on(cell.cell, options_.run.only) << ": " << last_summary(cell.cell, options_.run.only);
      else
        line << "FAILED" << (cell.failed_stage.empty() ? "" : " in " + cell.failed_stage) << ", " << cell.how;
      options_.say(line.str() + time_left());
    }
    show();
  }

 private:
  /// At the rate so far, jobs that run at the same time included.
  std::string time_left() const {
    if (n_done_ == 0 || n_done_ >= n_to_run_) return {};
    return "; about " + stage::readable_duration(watch_.seconds() / n_done_ * (n_to_run_ - n_done_)) + " left";
  }

  void show() const {
    if (!options_.show) return;
    std::string line = std::to_string(n_done_) + " of " + std::to_string(n_to_run_) + " done";
    if (n_failed_ > 0) line += ", " + std::to_string(n_failed_) + " failed";
    line += time_left();
    for (const std::string& name : running_) line += (name == *running_.begin() ? "; running " : ", ") + name;
    options_.show(n_done_ < n_to_run_ ? line : std::string());
  }

  int n_to_run_, n_done_ = 0, n_failed_ = 0;
  const BatchOptions& options_;
  std::set<std::string> running_;
  Stopwatch watch_;
  std::mutex mutex_;  ///< of all, and of the lines on the terminal
};

}  // namespace

std::string event_of(const BatchCell& cell) {
  const nlohmann::ordered_json event = {
      {"event", "cell"},         {"cell", cell.cell.string()},        {"exit_code", cell.exit_code},
      {"seconds", cell.seconds}, {"failed_stage", cell.failed_stage}, {"message", cell.message}};
  return files::json_text(event) + "\n";
}

std::string misnamed_settings(const std::vector<fs::path>& entries) {
  for (const fs::path& entry : entries)
    for (const char* ending : {".toml", ".toml.txt", ".tml"})
      if (const std::string name = files::lower_case(entry.filename().string());
          name.starts_with("cell") && name.ends_with(ending) && files::is_file(entry))
        return entry.filename().string();
  return "";
}

FoundCells search_cells(const fs::path& folder) {
  require_folder(folder, "a folder of cell folders");
  FoundCells found;
  collect_cells(folder, found);
  std::ranges::sort(found.cells, files::is_before);
  std::ranges::sort(found.skipped, files::is_before, &SkippedFolder::folder);
  return found;
}

FoundCells find_cells(const fs::path& folder) {
  FoundCells found = search_cells(folder);
  if (found.cells.empty()) {
    const std::string skipped =
        found.skipped.empty() ? ""
                              : "; skipped " + found.skipped.front().folder.string() + ": " + found.skipped.front().why;
    fs::path above = fs::weakly_canonical(folder);
    while (above.has_relative_path() && !files::is_file(above / "cell.toml")) above = above.parent_path();
    throw InputError(folder.string(), "cell folders (with a cell.toml) at or below it", "none" + skipped,
                     above.has_relative_path() ? "it is in the cell " + above.string() + ": give that"
                                               : "write a cell.toml beside each cell's images");
  }
  return found;
}

std::vector<BatchCell> run_batch(const std::vector<fs::path>& cells, const BatchOptions& options) {
  const int n = static_cast<int>(cells.size());
  std::vector<Look> looks(cells.size());
  numerics::parallel_for(n, options.threads, [&](int i) { looks[i] = look_at(cells[i], options.run); });
  check_parameters_once(looks, options);
  std::vector<BatchCell> outcomes;
  std::vector<int> to_run, busy;
  for (int i = 0; i < n; ++i) {
    outcomes.push_back(std::move(looks[i].outcome));
    if (looks[i].finding == Look::Finding::to_run) to_run.push_back(i);
    if (looks[i].finding == Look::Finding::busy) busy.push_back(i);
  }
  const int n_to_run = static_cast<int>(to_run.size() + busy.size());
  if (options.say) options.say(std::to_string(n) + " cells, " + std::to_string(n_to_run) + " of them to run");
  BatchProgress progress(n_to_run, options);
  std::mutex busy_mutex;
  numerics::parallel_for(static_cast<int>(to_run.size()), options.jobs, [&](int k) {
    const int i = to_run[k];
    progress.starts(cells[i]);
    outcomes[i] = run_one(cells[i], options);
    if (outcomes[i].exit_code != exit_code::kBusy) return progress.ended(outcomes[i]);
    progress.put_off(cells[i]);
    const std::lock_guard guard(busy_mutex);
    busy.push_back(i);
  });
  numerics::parallel_for(static_cast<int>(busy.size()), options.jobs, [&](int k) {
    outcomes[busy[k]] = run_when_free(cells[busy[k]], options);
    progress.ended(outcomes[busy[k]]);
  });
  return outcomes;
}

std::vector<BatchCell> outcomes_so_far(const std::vector<fs::path>& cells, const RunOptions& options, int threads) {
  std::vector<BatchCell> outcomes(cells.size());
  numerics::parallel_for(static_cast<int>(cells.size()), threads, [&](int i) {
    const Look look = look_at(cells[i], options);
    outcomes[i] = look.outcome;
    if (look.finding == Look::Finding::done || look.outcome.exit_code != 0) return;
    outcomes[i].exit_code = exit_code::kFailed;
    outcomes[i].how = look.finding == Look::Finding::busy ? "being run" : "not run";
    add_recorded_failure(outcomes[i]);
    outcomes[i].is_left_undone = outcomes[i].failed_stage.empty();
  });
  return outcomes;
}

std::string list_cells(const std::vector<fs::path>& cells, const RunOptions& options, int threads) {
  std::vector<std::optional<CellOutcome>> looks(cells.size());
  std::vector<std::string> errors(cells.size());
  numerics::parallel_for(static_cast<int>(cells.size()), threads, [&](int i) {
    try {
      looks[i] = look_at_cell(cells[i], options);
    } catch (const InputError& error) {
      errors[i] = error.what();
    } catch (const fs::filesystem_error& error) {
      errors[i] = error.what();
    }
  });
  files::CsvText csv({"cell", "stage", "state", "why"});
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (!looks[i]) {
      csv.add(cells[i].string()).add("").add("unreadable").add(errors[i]);
      csv.end_row();
      continue;
    }
    for (const StageOutcome& stage : looks[i]->stages) {
      csv.add(cells[i].string()).add(stage.stage).add(name_of(stage.status.state)).add(stage.status.why);
      csv.end_row();
    }
  }
  return csv.str();
}

}  // namespace mbtfm::runner
