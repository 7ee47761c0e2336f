#include "pipeline/runner/run_cell.h"

#include <algorithm>
#include <iomanip>
#include <mutex>
#include <sstream>

#include "pipeline/contract/csv.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/parallel.h"
#include "pipeline/runner/lock.h"
#include "pipeline/runner/process.h"

namespace mbtfm::runner {
namespace fs = std::filesystem;
namespace {

bool contains_name(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string executable_of(const Stage& stage, const RunOptions& options) {
  return (options.stage_folder / ("mbtfm-" + stage.name)).string();
}

std::vector<std::string> command_of(const Stage& stage, const fs::path& cell, const ImageNames& images,
                                    const RunOptions& options, int threads) {
  std::vector<std::string> command = {executable_of(stage, options)};
  const auto add = [&](const std::string& flag, const std::string& value) {
    command.push_back("--" + flag);
    command.push_back(value);
  };
  for (const ImageInput& image : images_of(stage, images))
    add(image.flag, resolve_image(cell, images, image.key).string());
  for (const ImageInput& image : stage.optional_images) {
    if (const auto file = resolve_optional_image(cell, images, image.key)) add(image.flag, file->string());
  }
  for (const PathArgument& argument : stage.arguments) add(argument.flag, (cell / argument.path).string());
  add("config", (cell / "cell.toml").string());
  add(stage.output.flag, (cell / stage.output.path).string());
  add("threads", std::to_string(threads));
  add("record", (cell / stage.folder / "record.json").string());
  if (options.is_quiet) command.push_back("--quiet");
  return command;
}

/// One cell's run: the parts that several steps need.
class CellRun {
 public:
  CellRun(fs::path cell, const RunOptions& options)
      : cell_(std::move(cell)),
        options_(options),
        images_(read_image_names(cell_)),
        beneath_(unset_in(cell_ / "cell.toml", options.beneath)) {}

  CellOutcome run();

 private:
  StageStatus status(const Stage& stage) const;
  void check_before_start() const;
  StageOutcome bring_up_to_date(const Stage& stage, int threads) const;
  StageOutcome start(const Stage& stage, const StageStatus& status, int threads) const;
  void say(const Stage& stage, const std::string& what) const;

  fs::path cell_;
  const RunOptions& options_;
  ImageNames images_;
  std::vector<Setting> beneath_;
};

StageStatus CellRun::status(const Stage& stage) const {
  if (!is_asked(stage, options_.only)) {
    return {StageState::not_asked, "left out by --only"};
  }
  if (contains_name(options_.redo, stage.name)) return {StageState::must_run, "asked for"};
  return status_of(stage, read_record(cell_ / stage.folder / "record.json"),
                   surroundings_of(stage, cell_, images_, beneath_, options_.version));
}

/// Before anything runs: the inputs are there, and every stage that will run accepts its parameters.
void CellRun::check_before_start() const {
  std::vector<std::string> changed;  // folders whose stage will run
  for (const Stage& stage : stages()) {
    const StageStatus now = status(stage);
    const bool follows = std::any_of(stage.reads.begin(), stage.reads.end(), [&](const std::string& file) {
      return contains_name(changed, fs::path(file).begin()->string());
    });
    if (now.state != StageState::must_run && !(follows && now.state == StageState::up_to_date)) continue;
    changed.push_back(stage.folder);
    for (const ImageInput& image : images_of(stage, images_)) resolve_image(cell_, images_, image.key);
    for (const ImageInput& image : stage.optional_images) resolve_optional_image(cell_, images_, image.key);
    std::vector<std::string> command = {executable_of(stage, options_), "--check", "--config",
                                        (cell_ / "cell.toml").string()};
    for (const std::string& flag : flags_of(stage, beneath_)) command.push_back(flag);
    const ProcessResult check = run_process(command);
    if (check.exit_code != 0 || check.signal) {
      throw StageFailed("mbtfm-" + stage.name + " does not accept cell.toml",
                        check.signal ? exit_code::kBug : check.exit_code);
    }
  }
}

void CellRun::say(const Stage& stage, const std::string& what) const {
  if (!options_.say) return;
  std::ostringstream line;
  line << std::left << std::setw(9) << stage.name << what;
  options_.say(line.str());
}

StageOutcome CellRun::bring_up_to_date(const Stage& stage, int threads) const {
  const StageStatus now = status(stage);
  if (now.state == StageState::must_run) return start(stage, now, threads);
  const auto record = read_record(cell_ / stage.folder / "record.json");
  say(stage, name_of(now.state) + ": " + now.why);
  return {.stage = stage.name,
          .status = now,
          .was_run = false,
          .converged = now.state != StageState::up_to_date || !record || record->converged,
          .seconds = 0};
}

StageOutcome CellRun::start(const Stage& stage, const StageStatus& before, int threads) const {
  for (const std::string& file : stage.reads) {
    if (!fs::is_regular_file(cell_ / file)) {
      throw InputError((cell_ / file).string(), "a file that an earlier stage makes", "none",
                       "run all stages: mbtfm run without --only");
    }
  }
  const fs::path record_file = cell_ / stage.folder / "record.json";
  std::vector<std::string> command = command_of(stage, cell_, images_, options_, threads);
  for (const std::string& flag : flags_of(stage, beneath_)) command.push_back(flag);
  const StageSurroundings now = surroundings_of(stage, cell_, images_, beneath_, options_.version);
  const bool had_record = fs::is_regular_file(record_file);
  const std::string record_before = had_record ? read_text(record_file) : std::string();
  write_begun(record_file, stage);
  const ProcessResult result = run_process(command);
  // A stage that did not converge and yet wrote its outputs has written a record, too.
  const bool converged = result.exit_code != exit_code::kNotSolved;
  const bool has_outputs = !result.signal && (result.exit_code == 0 || (!converged && !is_begun(record_file)));
  if (!has_outputs) {
    // A stage that ends by itself has left its outputs as they were: so must be the record.
    if (!result.signal && had_record) write_whole(record_file, record_before);
    if (!result.signal && !had_record) forget_begun(record_file);
    throw StageFailed("mbtfm-" + stage.name + ": " + how_it_ended(result),
                      result.signal ? exit_code::kBug : result.exit_code);
  }
  const Hashes outputs = hash_files(cell_, stage.writes);
  for (const std::string& file : stage.writes) {
    if (!outputs.contains(file)) throw StageFailed("mbtfm-" + stage.name + " did not write " + file, 70);
  }
  complete_record(record_file,
                  {.finished = true,
                   .converged = converged,
                   .version = now.version,
                   .settings = now.settings,
                   .inputs = now.inputs,
                   .outputs = outputs},
                  result.seconds, result.peak_memory_MB);
  std::ostringstream line;
  line << std::fixed << std::setprecision(1) << result.seconds << " s, " << std::setprecision(0)
       << result.peak_memory_MB << " MB" << (converged ? "" : ", NOT CONVERGED") << " (" << before.why << ")";
  say(stage, line.str());
  return {.stage = stage.name, .status = before, .was_run = true, .converged = converged, .seconds = result.seconds};
}

CellOutcome CellRun::run() {
  for (const auto& names : {options_.only, options_.redo}) {
    for (const std::string& name : names) {
      const bool is_known =
          std::any_of(stages().begin(), stages().end(), [&](const Stage& stage) { return stage.name == name; });
      if (!is_known) throw UsageError("unknown stage '" + name + "': expected segment, track, network or fit");
    }
  }
  check_before_start();
  // Tracking needs nothing of the cell: it runs beside segmentation and network. The fit needs both.
  const std::vector<Stage>& all = stages();
  CellOutcome outcome;
  outcome.stages.resize(all.size());
  const std::vector<std::vector<int>> chains = {{0, 2}, {1}};
  const auto is_wanted = [&](const std::vector<int>& chain) {
    return std::any_of(chain.begin(), chain.end(), [&](int i) { return is_asked(all[i], options_.only); });
  };
  const int workers = is_wanted(chains[0]) && is_wanted(chains[1]) ? std::min(options_.threads, 2) : 1;
  const auto threads_of = [&](int chain) {
    return workers == 1 ? options_.threads
                        : (chain == 0 ? options_.threads - options_.threads / 2 : options_.threads / 2);
  };
  parallel_for(static_cast<int>(chains.size()), workers, [&](int chain) {
    for (const int i : chains[chain]) outcome.stages[i] = bring_up_to_date(all[i], threads_of(chain));
  });
  outcome.stages.back() = bring_up_to_date(all.back(), options_.threads);
  return outcome;
}

}  // namespace

bool CellOutcome::converged() const {
  return std::all_of(stages.begin(), stages.end(), [](const StageOutcome& stage) { return stage.converged; });
}

ImageNames read_image_names(const fs::path& cell) {
  if (!fs::is_directory(cell)) throw InputError(cell.string(), "a cell folder", "none");
  if (!fs::is_regular_file(cell / "cell.toml")) {
    throw InputError(cell.string(), "a cell folder with cell.toml", "no cell.toml",
                     "write one with pixel_size_um and, in [gel], youngs_modulus_kPa");
  }
  ImageNames names;
  ParameterList list;
  declare(list, names);
  read_toml(list, cell / "cell.toml");
  return names;
}

CellOutcome run_cell(const fs::path& cell, const RunOptions& options) {
  CellRun run(cell, options);
  const FolderLock lock(cell);
  const CellOutcome outcome = run.run();
  write_run_record(cell, options, outcome);
  return outcome;
}

}  // namespace mbtfm::runner
