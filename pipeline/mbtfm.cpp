/// mbtfm: starts the stages. It links none of them.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/files.h"
#include "pipeline/contract/parallel.h"
#include "pipeline/contract/version.h"
#include "pipeline/cost/accuracy.h"
#include "pipeline/cost/presets.h"
#include "pipeline/cost/study_report.h"
#include "pipeline/report/compare.h"
#include "pipeline/report/report.h"
#include "pipeline/runner/batch.h"
#include "pipeline/runner/batch_table.h"
#include "pipeline/runner/image_sets.h"
#include "pipeline/runner/process.h"
#include "pipeline/runner/run_cell.h"

namespace {

namespace fs = std::filesystem;
using namespace mbtfm;

using namespace exit_code;

struct CommandLine {
  fs::path folder;
  fs::path stage_folder = runner::executable_folder();
  int threads = available_threads();
  int jobs = 1;
  bool is_quiet = false;
  std::vector<std::string> only, redo, patterns;
  fs::path template_toml;
  std::string preset, accuracy;
  double budget_min = 10;  // a study that one waits for
  int repeats = 3;         // whose median one busy moment does not move
  bool is_whole = false;
};

void say(const std::string& line) { std::fprintf(stderr, "mbtfm: %s\n", line.c_str()); }

runner::CellOutcome run_with(const CommandLine& line, const std::string& preset) {
  runner::RunOptions options{.stage_folder = line.stage_folder,
                             .threads = line.threads,
                             .is_quiet = line.is_quiet,
                             .only = line.only,
                             .redo = line.redo,
                             .preset = preset,
                             .beneath = {},
                             .version = kVersion,
                             .say = line.is_quiet ? nullptr : say};
  if (!preset.empty()) options.beneath = cost::preset_named(preset).settings;
  return runner::run_cell(line.folder, options);
}

runner::CellOutcome run_to_accuracy(const CommandLine& line) {
  const double wanted = cost::parse_accuracy(line.accuracy);
  if (!line.only.empty()) throw UsageError("--accuracy: is reached by all stages together: leave out --only");
  runner::CellOutcome outcome;
  const cost::AccuracyOutcome reached = cost::reach_accuracy(wanted, [&](const std::string& preset) {
    outcome = run_with(line, preset);
    const std::optional<ErrorBudget> budget = read_fit_summary(line.folder / "4_fit/fit.json").error_budget;
    if (budget) return *budget;
    throw InputError((line.folder / "4_fit/fit.json").string(), "an error budget", "none", "run with --redo fit");
  });
  cost::record_accuracy(line.folder, wanted, reached);
  say(reached.verdict);
  return outcome;
}

int run(const CommandLine& line) {
  const runner::CellOutcome outcome = line.accuracy.empty() ? run_with(line, line.preset) : run_to_accuracy(line);
  if (fs::is_regular_file(line.folder / "4_fit/fit.json")) {
    report::update_report(line.folder);
    if (!line.is_quiet) say("report " + (line.folder / "report.html").string());
  }
  if (outcome.converged()) return kDone;
  std::string names;
  for (const auto& stage : outcome.stages) {
    if (!stage.converged) names += (names.empty() ? "" : ", ") + stage.stage;
  }
  std::fprintf(stderr, "mbtfm: error: not converged: %s; the outputs are marked\n", names.c_str());
  return kNotSolved;
}

int batch(const CommandLine& line) {
  std::vector<runner::ImagePattern> patterns;
  for (const std::string& text : line.patterns) patterns.push_back(runner::parse_pattern(text));
  if (!patterns.empty()) runner::make_cell_folders(line.folder, patterns, line.template_toml);
  const std::vector<fs::path> cells = runner::find_cells(line.folder);
  std::vector<std::string> arguments = {"--threads", std::to_string(std::max(1, line.threads / line.jobs)),
                                        "--stages-dir", line.stage_folder.string()};
  if (!line.preset.empty()) arguments.insert(arguments.end(), {"--preset", line.preset});
  if (!line.accuracy.empty()) arguments.insert(arguments.end(), {"--accuracy", line.accuracy});
  for (const std::string& stage : line.only) arguments.insert(arguments.end(), {"--only", stage});
  for (const std::string& stage : line.redo) arguments.insert(arguments.end(), {"--redo", stage});
  const auto outcomes = runner::run_batch(cells, {.program = fs::read_symlink("/proc/self/exe"),
                                                  .arguments = arguments,
                                                  .jobs = line.jobs,
                                                  .only = line.only,
                                                  .say = line.is_quiet ? nullptr : say});
  int n_failed = 0;
  for (const runner::BatchCell& cell : outcomes) {
    if (cell.exit_code == 0) continue;
    ++n_failed;
    std::fprintf(stderr, "mbtfm: %s: exit code %d: %s\n", cell.cell.c_str(), cell.exit_code, cell.message.c_str());
  }
  const fs::path table = line.folder / "batch.csv";
  runner::write_batch_table(table, line.folder, outcomes, line.only);
  std::fprintf(stderr, "mbtfm: %zu cells done, %d failed; %s\n", outcomes.size() - n_failed, n_failed, table.c_str());
  return n_failed == 0 ? kDone : kFailed;
}

/// Become mbtfm-stats.
int stats(const CommandLine& line, const std::vector<std::string>& further) {
  const std::string program = (runner::executable_folder() / "mbtfm-stats").string();
  std::vector<std::string> arguments = {program,
                                        "--cells",
                                        line.folder.string(),
                                        "--out",
                                        (line.folder / "statistics").string(),
                                        "--threads",
                                        std::to_string(line.threads)};
  if (line.is_quiet) arguments.emplace_back("--quiet");
  arguments.insert(arguments.end(), further.begin(), further.end());
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  execv(pointers[0], pointers.data());
  throw OutputError("cannot start " + program);
}

int cost_study(const CommandLine& line) {
  const cost::Study study =
      cost::measure(line.folder, {.stage_folder = line.stage_folder,
                                  .threads = line.threads,
                                  .budget_s = 60 * line.budget_min,
                                  .repeats = line.repeats,
                                  .extent = line.is_whole ? cost::Extent::whole : cost::Extent::quick,
                                  .say = line.is_quiet ? nullptr : say});
  const fs::path folder = line.folder / "cost";
  cost::write_study(folder, study, fs::weakly_canonical(line.folder).filename().string());
  if (!line.is_quiet) say("cost.csv, cost.svg and cost.md in " + folder.string());
  return kDone;
}

int compare(const CommandLine& line) {
  std::fputs(report::comparison_text(line.folder).c_str(), stdout);
  return kDone;
}

CLI::App* add_command(CLI::App& app, CommandLine& line, const std::string& name, const std::string& purpose,
                      const std::string& folder) {
  CLI::App* command = app.add_subcommand(name, purpose);
  command->add_option(folder, line.folder, folder == "CELL" ? "a cell folder" : "a folder of cell folders")->required();
  command->add_option("--threads", line.threads, "processors to use")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  command->add_flag("--quiet", line.is_quiet, "print errors only");
  return command;
}

void add_stage_options(CLI::App* command, CommandLine& line) {
  std::vector<std::string> names;
  std::string meaning = "parameters, where cell.toml sets none";
  for (const cost::Preset& preset : cost::presets()) {
    names.push_back(preset.name);
    meaning += (names.size() == 1 ? ": " : ", ") + preset.name + " (" + preset.purpose + ")";
  }
  CLI::Option* preset = command->add_option("--preset", line.preset, meaning)->check(CLI::IsMember(names));
  command->add_option("--accuracy", line.accuracy, "the cheapest preset that finds the tensions to this error, as 5%")
      ->excludes(preset);
  // one value a flag: else the folder that follows would be taken for another
  command->add_option("--only", line.only, "run this stage only, or these: segment, track, network, fit")
      ->allow_extra_args(false);
  command->add_option("--redo", line.redo, "run this stage, or these, even if up to date or changed by hand")
      ->allow_extra_args(false);
  command->add_option("--stages-dir", line.stage_folder, "where the stages' executables are")->capture_default_str();
}

int start(int argc, char** argv) {
  CommandLine line;
  CLI::App app("model-based traction force microscopy: from images to stress-fibre tensions", "mbtfm");
  app.set_version_flag("--version", std::string("mbtfm ") + kVersion);
  app.require_subcommand(1);
  CLI::App* run_command = add_command(app, line, "run", "run all stages of a cell that are not up to date", "CELL");
  add_stage_options(run_command, line);
  CLI::App* batch_command = add_command(app, line, "batch", "run every cell below a folder", "FOLDER");
  add_stage_options(batch_command, line);
  batch_command->add_option("--jobs", line.jobs, "cells at a time")->check(CLI::Range(1, 1024))->capture_default_str();
  batch_command
      ->add_option("--pattern", line.patterns,
                   "make cell folders for images that lie together: KEY=PATTERN with KEY of [images] and "
                   "{cell} for the cell's name, as in adhesion='{cell}_pax.tif'")
      ->allow_extra_args(false);
  batch_command->add_option("--template", line.template_toml, "settings for the cell.toml of these folders");
  CLI::App* stats_command = add_command(app, line, "stats", "statistics over all finished cells", "FOLDER");
  stats_command->allow_extras()->footer("Further arguments go to mbtfm-stats: see mbtfm-stats --help.");
  CLI::App* cost_command = add_command(app, line, "cost", "what accuracy costs in time, for this cell", "CELL");
  cost_command->add_option("--budget", line.budget_min, "no run is begun after this (minutes)")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  cost_command->add_option("--repeats", line.repeats, "runs of each choice, at most; the median counts")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  cost_command->add_flag("--all", line.is_whole, "the choices that take minutes, too");
  cost_command->add_option("--stages-dir", line.stage_folder, "where the stages' executables are")
      ->capture_default_str();
  add_command(app, line, "compare", "print the tensions of a simulated cell beside the truth", "CELL");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  }
  if (run_command->parsed()) return run(line);
  if (batch_command->parsed()) return batch(line);
  if (cost_command->parsed()) return cost_study(line);
  if (stats_command->parsed()) return stats(line, stats_command->remaining());
  return compare(line);
}

}  // namespace

int main(int argc, char** argv) {
  runner::watch_interrupts();
  try {
    return start(argc, argv);
  } catch (const runner::StageFailed& error) {
    std::fprintf(stderr, "mbtfm: error: %s\n", error.what());
    return error.exit_code;
  } catch (...) {
    return report_current_exception("mbtfm");
  }
}
