#include "pipeline/commands/commands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>

#include "pipeline/cost/accuracy.h"
#include "pipeline/runner/cell_stages.h"

namespace mbtfm::commands {

std::vector<std::string> preset_names() {
  std::vector<std::string> names;
  for (const cost::Preset& preset : cost::presets()) names.push_back(preset.name);
  return names;
}

namespace {

void add_stage_folder(CLI::App& app, CommandLine& line) {
  app.add_option("--stages-dir", line.run.stage_folder, "folder of the stages' executables")->capture_default_str();
}
void add_verbose(CLI::App& app, CommandLine& line) {
  app.add_flag("--verbose", line.is_verbose, "print every effect, and why a stage runs");
}
void add_json(CLI::App& app, CommandLine& line) {
  app.add_flag("--json", line.is_json, "print events as JSON, one object a line (docs/formats/json.md)");
}

/// Of `run` and `batch`.
void add_stage_options(CLI::App& app, CommandLine& line) {
  std::string presets;
  for (const cost::Preset& preset : cost::presets())
    presets += (presets.empty() ? ": " : ", ") + preset.name + " (" + preset.purpose + ")";
  // one value a flag: else the folder that follows would be taken for another
  const auto add_list = [&](const char* flag, std::vector<std::string>& list, const std::string& meaning) {
    return app.add_option(flag, list, meaning)->allow_extra_args(false);
  };
  CLI::Option* preset = app.add_option("--preset", line.run.preset, "parameters that cell.toml does not set" + presets);
  preset->check(CLI::IsMember(preset_names()));
  app.add_option("--accuracy", line.accuracy, "cheapest preset that finds tensions to this error, as 5%")
      ->excludes(preset);
  add_list("--set", line.set,
           "a value in place of cell.toml's: TABLE.KEY=VALUE, as gel.youngs_modulus_kPa=4; may be repeated");
  add_list("--only", line.run.only,
           "run this stage only: " + runner::stage_names() + "; several with commas: segment,track")
      ->delimiter(',');
  add_list("--redo", line.run.redo, "run this stage even if up to date; several with commas")->delimiter(',');
  add_stage_folder(app, line);
  const std::map<std::string, double> time_units = {{"s", 1}, {"min", 60}, {"h", 3600}};
  app.add_option("--timeout", line.run.limits.seconds, "kill a stage after this time: 90, 10min, 2h")
      ->transform(CLI::AsNumberWithUnit(time_units, CLI::AsNumberWithUnit::CASE_INSENSITIVE, "TIME"))
      ->check(CLI::Range(1e-3, 1e15));
  app.add_option("--memory", line.run.limits.memory_bytes, "kill a stage above this memory: 500MB, 4GB")
      ->transform(CLI::AsSizeValue(/*kb_is_1000=*/true))
      ->check(CLI::Range(1e-3, 1e15));
  add_json(app, line);
}

void add_flags_of_run(CLI::App& app, CommandLine& line) {
  add_stage_options(app, line);
  app.add_flag("--checked", line.run.is_checked, "the parameters were checked before")->group("");
  app.add_flag("--explain", line.run.explain, "fit again and report what each effect that is off would change");
  add_verbose(app, line);
}

void add_flags_of_batch(CLI::App& app, CommandLine& line) {
  add_stage_options(app, line);
  app.add_option("--jobs", line.jobs, "cells at a time")->check(CLI::Range(1, 1024))->capture_default_str();
  app.add_option("--pattern", line.patterns,
                 "make cell folders for images that lie together: KEY=PATTERN, KEY of [images], {cell} the cell's "
                 "name, as in adhesion='{cell}_pax.tif'")
      ->allow_extra_args(false);
  app.add_option("--template", line.template_toml, "settings for the cell.toml of these folders");
  app.add_flag("--list", line.only_list, "run nothing; print each cell's stages and states (CSV)");
  app.add_flag("--table", line.only_table, "run nothing; write batch.csv of the cells as they are");
}

void add_flags_of_cost(CLI::App& app, CommandLine& line) {
  app.add_option("MORE", line.more_folders, "further cells to average the errors over");
  app.add_option("--out", line.out, "folder of cost.csv, cost.svg and cost.md; default: CELL/cost");
  app.add_option("--budget", line.budget_min, "begin no run after this (minutes)")
      ->check(CLI::Range(1e-3, 1e6))
      ->capture_default_str();
  app.add_option("--repeats", line.repeats, "most runs of each choice; the median counts")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  app.add_flag("--all", line.is_whole, "the choices that take minutes, too");
  add_stage_folder(app, line);
}

enum class Takes { cell, folder, new_cell, arguments };  ///< arguments: of a program, which has the help, too

struct Command {
  const char *name, *purpose;
  Takes takes;
  int (*run)(const CommandLine&);
  void (*add_flags)(CLI::App&, CommandLine&) = nullptr;  ///< beside those that all have
};
const Command kCommands[] = {
    {"demo", "simulate a cell, run every stage, compare its tensions with the truth", Takes::new_cell, demo,
     [](CLI::App& app, CommandLine& line) {
       app.add_flag("--force", line.is_forced, "overwrite a cell of an earlier demo or simulation");
       add_verbose(app, line);
     }},
    {"init", "write a cell.toml from what the images of a folder say", Takes::cell, init,
     [](CLI::App& app, CommandLine& line) {
       app.add_option("--like", line.like,
                      "a cell folder: write a cell.toml like its own for each folder below that has none");
     }},
    {"check", "judge the images below a folder, before a batch", Takes::folder, check,
     [](CLI::App& app, CommandLine& line) {
       app.add_option("MORE", line.more_folders, "further folders");
       add_json(app, line);
     }},
    {"run", "run all stages of a cell that are not up to date", Takes::cell, run, add_flags_of_run},
    {"batch", "run every cell below a folder", Takes::folder, batch, add_flags_of_batch},
    {"verify", "check inputs and outputs against the hashes in run.json", Takes::cell, verify},
    {"repeat", "repeat the run of a run.json in a new folder and compare", Takes::cell, repeat,
     [](CLI::App& app, CommandLine& line) {
       app.add_option("--out", line.out, "the new cell folder")->required();
       app.add_option("--inputs", line.inputs, "folder of the inputs; default: beside run.json");
       add_stage_folder(app, line);
     }},
    {"stats", "statistics over all finished cells", Takes::folder, stats,
     [](CLI::App& app, CommandLine&) {
       app.allow_extras()->footer("Further arguments go to mbtfm-stats: see mbtfm-stats --help.");
     }},
    {"cost", "what accuracy costs in time, for this cell", Takes::cell, cost, add_flags_of_cost},
    {"plan", "how many beads and cells, which gel and noise a question takes: mbtfm plan --help", Takes::arguments,
     plan},
    {"noise", "noise and density of beads from two pictures without a cell: mbtfm noise A.tif B.tif", Takes::arguments,
     noise},
    {"compare", "compare a simulated cell with its truth", Takes::cell, compare},
};

constexpr const char* kThreads = "--threads";

/// What was given to `batch` and is for each `run`. Of the threads each has its part.
std::vector<std::string> given_for_run(const CLI::App& batch, const CLI::App& run) {
  std::vector<std::string> arguments;
  for (const CLI::Option* option : batch.get_options()) {
    const std::string flag = option->get_name();
    if (option->get_items_expected_max() == 0 || flag == kThreads || !run.get_option_no_throw(flag)) continue;
    for (const std::string& value : option->results()) arguments.push_back(flag + "=" + value);
  }
  return arguments;
}

}  // namespace

void declare(CLI::App& app, CommandLine& line) {
  for (const Command& command : kCommands) {
    CLI::App& sub = *app.add_subcommand(command.name, command.purpose);
    if (command.takes == Takes::arguments) {
      sub.set_help_flag();
      sub.allow_extras();
      continue;
    }
    const bool is_new = command.takes == Takes::new_cell, is_folder = command.takes == Takes::folder;
    sub.add_option(is_folder ? "FOLDER" : "CELL", line.folder,
                   is_new      ? "the cell folder to make; default: mbtfm-demo"
                   : is_folder ? "a folder of cell folders"
                               : "a cell folder")
        ->required(!is_new);
    sub.add_option(kThreads, line.run.threads, "processors to use")->check(CLI::Range(1, 1024))->capture_default_str();
    sub.add_flag("--quiet", line.run.is_quiet, "print errors only");
    if (command.add_flags) command.add_flags(sub, line);
  }
}

std::optional<int> run_given(const CLI::App& app, CommandLine line) {
  const auto given = app.get_subcommands();
  if (given.empty()) return std::nullopt;
  line.further = given.front()->remaining();
  line.for_each_cell = given_for_run(*given.front(), *app.get_subcommand("run"));
  return std::ranges::find(kCommands, given.front()->get_name(), &Command::name)->run(line);
}

}  // namespace mbtfm::commands
