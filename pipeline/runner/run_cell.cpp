#include "pipeline/runner/run_cell.h"

#include <algorithm>
#include <exception>
#include <mutex>

#include "pipeline/contract/errors.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/numerics/machine.h"
#include "pipeline/numerics/parallel.h"
#include "pipeline/runner/cell_stages.h"
#include "pipeline/runner/image_sets.h"
#include "pipeline/runner/lock.h"
#include "pipeline/runner/run_record.h"
#include "pipeline/stage/effects.h"
#include "pipeline/stage/suggest.h"

namespace mbtfm::runner {
namespace {

bool contains_name(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// The command as run.json states it: paths relative to the cell folder, the program by its name.
std::vector<std::string> recorded_command(std::vector<std::string> command, const fs::path& cell) {
  command.front() = fs::path(command.front()).filename().string();
  const std::string prefix = (cell / "").string();
  for (std::string& argument : command)
    if (argument.starts_with(prefix)) argument.erase(0, prefix.size());
  return command;
}

/// Files that a run which was killed had not finished.
void remove_partial_files(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> partial;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    if (entry->path().filename().string().starts_with(files::kPartialPrefix)) partial.push_back(entry->path());
  for (const fs::path& file : partial) fs::remove(file, error);  // a link, not what it points to; no full folder
}

StageFailure failure_of(const ProcessResult& result) {
  const int code = exit_code_of(result);
  // a stage that did not converge has written; this one has not
  return {.exit_code = code == exit_code::kNotSolved ? exit_code::kNoAnswer : code,
          .how = how_it_ended(result),
          .message = error_in(result.last_output)};
}

/// Do a part of a stage's work; if that throws, the outcome shows it, too.
void note_failure(StageOutcome& outcome, const std::function<void()>& work) {
  try {
    work();
  } catch (const Interrupted&) {
    throw;
  } catch (const StageFailed& error) {
    outcome.failure = error.failure;
    throw;
  } catch (const OutputError& error) {
    outcome.failure = {.exit_code = exit_code::kOutput, .how = "could not be written", .message = error.what()};
    throw;
  } catch (const std::exception& error) {
    outcome.failure = {.exit_code = exit_code::kInput, .how = "not started", .message = error.what()};
    throw;
  }
}

/// What the preset says to this kind of cell. @throws UsageError where it says nothing
const std::vector<Setting>& beneath(const RunOptions& options, const CellStages& of) {
  if (is_in_space(of.kind)) return options.beneath_in_space;
  if (has_fibres(of.kind) || options.beneath.empty()) return options.beneath;
  throw UsageError("--preset " + options.preset + ": presets are for cells with fibres and cells in space, and this " +
                   "one is a sheet (" + of.why +
                   "): leave it out, and set sheet.mesh_um for finer or coarser triangles");
}

fs::path checked(fs::path cell) {
  files::check_cell_folder(cell);
  return cell;
}

/// One cell's run: the parts that several steps need.
class CellRun {
 public:
  CellRun(fs::path cell, const RunOptions& options)
      : cell_(checked(std::move(cell))),
        options_(options),
        images_(read_image_names(cell_)),
        of_(stages_of(cell_, images_)),
        given_(with(unset_in(cell_ / "cell.toml", beneath(options, of_)), options.set)),
        settings_(read_settings(cell_ / "cell.toml", of_.stages, given_)),
        hashes_(cell_) {
    const bool is_made = !options.set.empty() && is_made_for_picture(cell_);
    for (const Setting& setting : options.set) {
      if (setting == Setting{"segment", "cell", is_made ? setting.value : "0"})
        throw UsageError("--set segment.cell=" + setting.value +
                         ": each cell of a picture gets a folder and a cell.toml of its own; write cell = " +
                         setting.value + " below [segment] in " +
                         (is_made ? cell_ / "../cell.toml" : cell_ / "cell.toml").lexically_normal().string());
      if (std::ranges::any_of(of_.stages, [&](const Stage& stage) { return !flags_of(stage, {setting}).empty(); }))
        continue;
      const std::string meant = stage::did_you_mean(stage::effect_keys(), setting.key);
      throw UsageError("--set " + setting.table + "." + setting.key + ": no stage of this cell reads it" +
                       (of_.why.empty() ? "" : " (" + of_.why + ")") + (meant.empty() ? "" : "; " + meant));
    }
  }

  CellOutcome look() {
    CellOutcome outcome;
    for (const Stage& stage : of_.stages) {
      const Present now = present(stage);
      outcome.stages.push_back(
          {.stage = stage.name,
           .status = now.status,
           .converged = now.status.state != StageState::up_to_date || !now.record || now.record->converged});
    }
    hashes_.save();
    return outcome;
  }

  CellOutcome run() {
    const bool is_whole = options_.only.empty();  // and no other run is in the cell
    if (is_whole) remove_partial_files(cell_);
    CellOutcome outcome = look();
    outcome.started = numerics::utc_now();
    if (is_in_space(of_.kind) && options_.note) options_.note("beads in space, as " + of_.why);
    if (is_sheet(of_.kind) && options_.note) options_.note("a contracting sheet, as " + of_.why);
    if (const std::string unused = unused_pictures(cell_, images_); !unused.empty() && options_.note)
      options_.note(unused);
    const bool has_work = std::ranges::any_of(
        outcome.stages, [](const StageOutcome& stage) { return stage.status.state == StageState::must_run; });
    try {
      files::expect_own_kind(cell_ / "report.html", files::kOwnPage);
      check_before_start(outcome);
      if (has_work) write_run_record(cell_, options_, outcome);  // unfinished: what a kill leaves
      run_chains(outcome);
    } catch (const std::exception&) {
      outcome.ended = numerics::utc_now();
      try {
        write_run_record(cell_, options_, outcome);
      } catch (const std::exception&) {
        // the disk is full, as a rule: the error that is on its way says so
      }
      throw;
    }
    // A report of what is no more must not outlive a kill between here and the next one.
    std::error_code is_folder;  // then writing the report fails
    if (has_work) fs::remove(cell_ / "report.html", is_folder);
    outcome.ended = numerics::utc_now();
    write_run_record(cell_, options_, outcome);
    hashes_.save();
    return outcome;
  }

 private:
  struct Present {
    std::optional<StageRecord> record;
    StageSurroundings surroundings;
    StageStatus status;
  };

  Present present(const Stage& stage) {
    Present now;
    now.record = read_record(cell_, stage);
    if (!is_asked(stage, options_.only)) {
      now.status = {StageState::not_asked, "left out by --only"};
      return now;
    }
    now.surroundings = surroundings_of(
        stage,
        {.cell = cell_, .images = images_, .settings = settings_, .hashes = hashes_, .version = options_.version},
        now.record);
    const bool is_explained = options_.explain && stage.explains;
    now.status = is_explained || contains_name(options_.redo, stage.name)
                     ? StageStatus{StageState::must_run, "asked for"}
                     : status_of(stage, now.record, now.surroundings);
    return now;
  }

  /// Before anything runs: the inputs are there, and every stage that will run accepts its parameters.
  void check_before_start(CellOutcome& now) const {
    std::vector<std::string> changed;  // folders whose stage will run
    for (std::size_t i = 0; i < of_.stages.size(); ++i) {
      const Stage& stage = of_.stages[i];
      const StageState state = now.stages[i].status.state;
      const auto is_changed = [&](const std::string& file) {
        return contains_name(changed, fs::path(file).begin()->string());
      };
      const bool follows =
          std::ranges::any_of(stage.reads, is_changed) || std::ranges::any_of(stage.reads_where_there, is_changed);
      if (state != StageState::must_run && !(follows && state == StageState::up_to_date)) continue;
      changed.push_back(stage.folder);
      note_failure(now.stages[i], [&] {
        for (const ImageInput& image : images_of(stage, images_)) resolve_image(cell_, images_, image);
        for (const ImageInput& image : stage.optional_images) resolve_optional_image(cell_, images_, image.key);
        const std::vector<std::string> inputs = to_look_at(stage, cell_, images_);
        if (!options_.is_checked || !inputs.empty())
          check_parameters(stage, cell_ / "cell.toml", options_, print_on, inputs);
      });
    }
  }

  void say(const StageResult& result) {
    if (!options_.say) return;
    const std::lock_guard guard(saying_);
    options_.say(result);
  }

  void bring_up_to_date(const Stage& stage, int threads, StageOutcome& outcome) {
    note_failure(outcome, [&] {
      const Present now = present(stage);
      outcome.status = now.status;
      if (now.status.state == StageState::must_run) return start(stage, now, threads, outcome);
      outcome.converged = now.status.state != StageState::up_to_date || !now.record || now.record->converged;
      say({.stage = stage.name, .status = now.status, .converged = outcome.converged});
    });
  }

  /// Of what the stage has just written. Files of a series that it does not write any more go.
  Hashes outputs_of(const Stage& stage, const Present& before) {
    std::vector<std::string> names = stage.writes;
    for (std::string& name : series_outputs(cell_, stage)) names.push_back(std::move(name));
    Hashes outputs = hashes_.hash(names);
    for (const std::string& file : stage.writes) {
      if (outputs.contains(file)) continue;
      throw StageFailed(stage.name, {.exit_code = exit_code::kBug, .how = "did not write " + file});
    }
    if (!before.record) return outputs;
    for (const auto& [name, hash] : before.record->outputs) {
      const auto found = before.surroundings.outputs.find(name);
      const bool is_by_hand = found != before.surroundings.outputs.end() && found->second != hash;
      if (!outputs.contains(name) && is_of_series(stage, name)) fs::remove(cell_ / name);
      if (before.status.keeps_frames && is_by_hand) outputs[name] = hash;  // still the user's
    }
    return outputs;
  }

  void start(const Stage& stage, const Present& before, int threads, StageOutcome& outcome) {
    const StageSurroundings& now = before.surroundings;
    for (const std::string& file : stage.reads) {
      if (!files::is_own_file(cell_ / file)) {
        throw InputError((cell_ / file).string(), "a file that an earlier stage makes", "none",
                         "run all stages: mbtfm run without --only");
      }
    }
    const fs::path record_file = record_file_of(cell_, stage);
    std::vector<std::string> command = command_of(stage, options_.stage_folder, cell_, cell_, images_, threads);
    command.insert(command.end(), {"--record", record_file.string()});
    if (options_.is_quiet) command.emplace_back("--quiet");
    if (options_.explain && stage.explains) command.emplace_back("--explain");
    for (const std::string& flag : flags_of(stage, given_)) command.push_back(flag);
    const bool had_record = files::is_own_file(record_file);
    const std::string record_before = had_record ? files::read_text(record_file) : std::string();
    remove_partial_files(record_file.parent_path());
    if (before.status.keeps_frames) {
      command.push_back("--kept");
      command.push_back((cell_ / stage.folder).string());
    }
    write_begun(record_file, stage, before.status.keeps_frames ? record_before : "");
    const ProcessResult result =
        run_process(command, options_.limits, options_.sink ? options_.sink() : Sink(print_on));
    // A stage that did not converge and yet wrote its outputs has written a record, too.
    outcome.converged = result.exit_code != exit_code::kNotSolved;
    outcome.seconds = result.seconds;
    const bool has_outputs =
        !result.signal && (result.exit_code == 0 || (!outcome.converged && !is_begun(record_file)));
    if (!has_outputs) {
      // A stage that ends by itself has left its outputs as they were: so must be the record.
      if (!result.signal && had_record) files::write_whole(record_file, record_before);
      if (!result.signal && !had_record) forget_begun(record_file);
      throw StageFailed(stage.name, failure_of(result));
    }
    const Hashes outputs = outputs_of(stage, before);
    complete_record(record_file,
                    {.finished = true,
                     .converged = outcome.converged,
                     .version = now.version,
                     .settings = now.settings,
                     .inputs = now.inputs,
                     .outputs = outputs},
                    {.command = recorded_command(command, cell_),
                     .seconds = result.seconds,
                     .peak_memory_MB = result.peak_memory_MB});
    outcome.was_run = true;
    say({.stage = stage.name,
         .status = outcome.status,
         .was_run = true,
         .converged = outcome.converged,
         .seconds = result.seconds,
         .peak_memory_MB = result.peak_memory_MB,
         .report = report_of(cell_, stage)});
  }

  /// Tracking runs beside the network, in space beside segmentation. The last stage needs both.
  void run_chains(CellOutcome& outcome) {
    const std::vector<Stage>& all = of_.stages;
    for (const int i : of_.first) bring_up_to_date(all[i], options_.threads, outcome.stages[i]);
    const std::vector<std::vector<int>>& chains = of_.chains;
    const auto is_wanted = [&](const std::vector<int>& chain) {
      return std::ranges::any_of(chain, [&](int i) { return is_asked(all[i], options_.only); });
    };
    const int workers = std::ranges::count_if(chains, is_wanted) > 1 ? std::min(options_.threads, 2) : 1;
    // Two at least: one chain ends before the other, which then has the processors to itself.
    const int threads = workers == 1 ? options_.threads : std::max(2, options_.threads / 2);
    // A chain that fails does not stop the other: what is done does not depend on the number of threads.
    std::vector<std::exception_ptr> errors(chains.size());
    numerics::parallel_for(static_cast<int>(chains.size()), workers, [&](int chain) {
      try {
        for (const int i : chains[chain]) bring_up_to_date(all[i], threads, outcome.stages[i]);
      } catch (...) {
        errors[chain] = std::current_exception();
      }
    });
    for (const std::exception_ptr& error : errors)
      if (error) std::rethrow_exception(error);
    bring_up_to_date(all.back(), options_.threads, outcome.stages.back());
  }

  fs::path cell_;
  const RunOptions& options_;
  ImageNames images_;
  CellStages of_;
  std::vector<Setting> given_;  // besides cell.toml
  Settings settings_;
  HashCache hashes_;
  std::mutex saying_;
};

void expect_known(const RunOptions& options) {
  for (const auto& names : {options.only, options.redo}) {
    for (const std::string& name : names) {
      const bool is_known = std::ranges::any_of(all_stages(), [&](const Stage& stage) { return stage.name == name; });
      if (!is_known) throw UsageError("unknown stage '" + name + "': expected " + stage_names());
    }
  }
}

}  // namespace

bool CellOutcome::converged() const {
  return std::ranges::all_of(stages, [](const StageOutcome& stage) { return stage.converged; });
}

std::string CellOutcome::not_converged() const {
  std::string names;
  for (const StageOutcome& stage : stages)
    if (!stage.converged) names += (names.empty() ? "" : ", ") + stage.stage;
  return names;
}

void check_parameters(const Stage& stage, const fs::path& toml_file, const RunOptions& options, const Sink& sink,
                      const std::vector<std::string>& inputs) {
  std::vector<std::string> command = {executable_of(stage, options.stage_folder), "--check", "--config",
                                      toml_file.string()};
  for (const std::string& flag : flags_of(stage, options.set)) command.push_back(flag);
  command.insert(command.end(), inputs.begin(), inputs.end());
  const ProcessResult check = run_process(command, options.limits, sink);
  if (check.exit_code == 0 && !check.signal) return;
  StageFailure failure = failure_of(check);
  const bool is_refusal =
      !check.signal && (check.exit_code == exit_code::kUsage || check.exit_code == exit_code::kInput);
  const std::string looked_at = inputs.empty() ? "cell.toml" : "cell.toml and the images";
  failure.how = is_refusal ? "does not accept " + looked_at : failure.how + " while it read " + looked_at;
  throw StageFailed(stage.name, std::move(failure));
}

CellOutcome run_cell(const fs::path& cell, const RunOptions& options) {
  expect_known(options);
  CellRun run(cell, options);
  const CellLock lock(cell, options.only);
  lock.share_with_programs();  // a stage that outlives us still holds its cell
  const CellOutcome outcome = run.run();
  if (options.finish) options.finish();
  return outcome;
}

CellOutcome look_at_cell(const fs::path& cell, const RunOptions& options) {
  expect_known(options);
  return CellRun(cell, options).look();
}

bool is_done(const fs::path& cell, const RunOptions& options, const CellOutcome& now) {
  for (const StageOutcome& stage : now.stages) {
    const StageState state = stage.status.state;
    if (state == StageState::must_run) return false;
    // What was changed by hand since then is neither checked nor reported.
    if (state == StageState::replaced && recorded_state(cell, stage.stage) != name_of(state)) return false;
  }
  const std::string& last = now.stages.back().stage;
  const bool is_last_asked = options.only.empty() || contains_name(options.only, last);
  if (is_last_asked && !files::is_own_file(cell / "report.html")) return false;
  return run_record_is_complete(cell, options);
}

}  // namespace mbtfm::runner
