#include "pipeline/commands/commands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>

#include "pipeline/cost/accuracy.h"
#include "pipeline/runner/cell_stages.h"
#include "pipeline/stage/help.h"

namespace mbtfm::commands {

std::vector<std::string> preset_names() {
  std::vector<std::string> names;
  for (const cost::Preset& preset : cost::presets()) names.push_back(preset.name);
  return names;
}

namespace {

void add_stage_folder(CLI::App& app, CommandLine& line) {
  app.add_option("--stages-dir", line.run.stage_folder)->capture_default_str();
}
void add_verbose(CLI::App& app, CommandLine& line) { app.add_flag("--verbose", line.is_verbose); }
void add_json(CLI::App& app, CommandLine& line) { app.add_flag("--json", line.is_json); }

/// Of `run` and `batch`.
void add_stage_options(CLI::App& app, CommandLine& line) {
  // one value a flag: else the folder that follows would be taken for another
  const auto add_list = [&](const char* flag, std::vector<std::string>& list, const std::string& meaning = "") {
    return app.add_option(flag, list, meaning)->allow_extra_args(false);
  };
  CLI::Option* preset = app.add_option("--preset", line.run.preset);
  preset->check(CLI::IsMember(preset_names()));
  app.add_option("--accuracy", line.accuracy)->excludes(preset);
  add_list("--set", line.set);
  add_list("--only", line.run.only, stage::help_on("any command", "--only", {runner::stage_names()}))->delimiter(',');
  add_list("--redo", line.run.redo)->delimiter(',');
  add_stage_folder(app, line);
  const std::map<std::string, double> time_units = {{"s", 1}, {"min", 60}, {"h", 3600}};
  app.add_option("--timeout", line.run.limits.seconds)
      ->transform(CLI::AsNumberWithUnit(time_units, CLI::AsNumberWithUnit::CASE_INSENSITIVE, "TIME"))
      ->check(CLI::Range(1e-3, 1e15));
  app.add_option("--memory", line.run.limits.memory_bytes)
      ->transform(CLI::AsSizeValue(/*kb_is_1000=*/true))
      ->check(CLI::Range(1e-3, 1e15));
  add_json(app, line);
}

void add_flags_of_run(CLI::App& app, CommandLine& line) {
  add_stage_options(app, line);
  app.add_flag("--checked", line.run.is_checked)->group("");
  app.add_flag("--explain", line.run.explain);
  add_verbose(app, line);
}

void add_flags_of_batch(CLI::App& app, CommandLine& line) {
  add_stage_options(app, line);
  app.add_option("--jobs", line.jobs)->check(CLI::Range(1, 1024))->capture_default_str();
  app.add_option("--pattern", line.patterns)->allow_extra_args(false);
  app.add_option("--template", line.template_toml);
  app.add_flag("--list", line.only_list);
  app.add_flag("--table", line.only_table);
}

void add_flags_of_cost(CLI::App& app, CommandLine& line) {
  app.add_option("MORE", line.more_folders);
  app.add_option("--out", line.out);
  app.add_option("--budget", line.budget_min)->check(CLI::Range(1e-3, 1e6))->capture_default_str();
  app.add_option("--repeats", line.repeats)->check(CLI::Range(1, 100))->capture_default_str();
  app.add_flag("--all", line.is_whole);
  add_stage_folder(app, line);
}

enum class Takes { cell, folder, new_cell, arguments };  ///< arguments: of a program, which has the help, too

struct Command {
  const char* name;
  Takes takes;
  int (*run)(const CommandLine&);
  void (*add_flags)(CLI::App&, CommandLine&) = nullptr;  ///< besides those that all have
};
const Command kCommands[] = {
    {"demo", Takes::new_cell, demo,
     [](CLI::App& app, CommandLine& line) {
       app.add_flag("--force", line.is_forced);
       add_verbose(app, line);
     }},
    {"init", Takes::cell, init, [](CLI::App& app, CommandLine& line) { app.add_option("--like", line.like); }},
    {"check", Takes::folder, check,
     [](CLI::App& app, CommandLine& line) {
       app.add_option("MORE", line.more_folders);
       add_json(app, line);
     }},
    {"run", Takes::cell, run, add_flags_of_run},
    {"batch", Takes::folder, batch, add_flags_of_batch},
    {"verify", Takes::cell, verify},
    {"repeat", Takes::cell, repeat,
     [](CLI::App& app, CommandLine& line) {
       app.add_option("--out", line.out)->required();
       app.add_option("--inputs", line.inputs);
       add_stage_folder(app, line);
     }},
    {"stats", Takes::folder, stats,
     [](CLI::App& app, CommandLine&) {
       app.allow_extras()->footer("Further arguments go to mbtfm-stats: see mbtfm-stats --help.");
     }},
    {"cost", Takes::cell, cost, add_flags_of_cost},
    {"plan", Takes::arguments, plan},
    {"noise", Takes::arguments, noise},
    {"compare", Takes::cell, compare},
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
    CLI::App& sub = *app.add_subcommand(command.name);
    if (command.takes == Takes::arguments) {
      sub.set_help_flag();
      sub.allow_extras();
      continue;
    }
    const bool is_folder = command.takes == Takes::folder;
    sub.add_option(is_folder ? "FOLDER" : "CELL", line.folder)->required(command.takes != Takes::new_cell);
    sub.add_option(kThreads, line.run.threads)->check(CLI::Range(1, 1024))->capture_default_str();
    sub.add_flag("--quiet", line.run.is_quiet);
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
