/// mbtfm: starts the stages. It links none of them.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <map>
#include <optional>
#include <sstream>
#include <utility>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/results.h"
#include "pipeline/contract/version.h"
#include "pipeline/cost/accuracy.h"
#include "pipeline/cost/study.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/own_files.h"
#include "pipeline/numerics/parallel.h"
#include "pipeline/report/compare.h"
#include "pipeline/report/report.h"
#include "pipeline/runner/batch.h"
#include "pipeline/runner/batch_table.h"
#include "pipeline/runner/cell_stages.h"
#include "pipeline/runner/image_sets.h"
#include "pipeline/runner/images.h"
#include "pipeline/runner/lock.h"
#include "pipeline/runner/process.h"
#include "pipeline/runner/run_cell.h"
#include "pipeline/runner/stages.h"
#include "pipeline/runner/verify.h"
#include "pipeline/stage/console.h"
#include "pipeline/stage/help.h"
#include "pipeline/stage/manual.h"
#include "pipeline/stage/suggest.h"

namespace {

using namespace mbtfm;

using namespace exit_code;

struct CommandLine {
  fs::path folder;
  runner::RunOptions run;  ///< what of it flags say
  int jobs = 1;
  bool is_verbose = false, is_json = false, only_list = false, only_table = false, is_forced = false;
  std::vector<std::string> patterns, set;
  std::vector<fs::path> more_cells;
  fs::path template_toml, out, inputs, like;
  std::string accuracy;
  double budget_min = 10;  // a study that one waits for
  int repeats = 3;         // whose median one busy moment does not move
  bool is_whole = false;
};

bool is_terminal() { return isatty(STDERR_FILENO) != 0; }

/// Of `mbtfm run --json`: what a stage prints of its progress is an event; all else goes where messages go.
runner::Sink event_sink() {
  return [begun = std::string()](std::string_view text) mutable {
    begun += text;
    for (std::size_t end = begun.find('\n'); end != begun.npos; end = begun.find('\n')) {
      const std::string line = begun.substr(0, end + 1);
      begun.erase(0, end + 1);
      line.starts_with("{\"event\":") ? stage::print(line) : runner::print_on(line);
    }
  };
}

// What stands on the line of a terminal before gives way.
void say(const std::string& line) {
  std::fprintf(stderr, "%smbtfm: %s\n", is_terminal() ? "\r\033[K" : "", line.c_str());
}
void show(const std::string& line) { std::fprintf(stderr, "\r\033[K%s", line.c_str()); }

std::function<void(const runner::StageTold&)> teller(const CommandLine& line) {
  if (line.is_json) return [](const runner::StageTold& told) { stage::print(events_of(told)); };
  if (line.run.is_quiet) return nullptr;
  const auto detail = line.is_verbose ? runner::Detail::all : runner::Detail::brief;
  return [detail](const runner::StageTold& told) { say(text_of(told, detail)); };
}

runner::RunOptions run_options(const CommandLine& line) {
  runner::RunOptions options = line.run;
  if (!options.preset.empty()) {
    options.beneath = cost::preset_named(options.preset).settings;
    options.beneath_in_space = cost::preset_named(options.preset).in_space;
  }
  for (const std::string& text : line.set) options.set.push_back(runner::parse_setting(text));
  options.version = kVersion;
  options.say = teller(line);
  if (line.is_json) options.sink = event_sink;
  if (!line.is_json && !options.is_quiet) options.note = say;
  return options;
}

/// @throws UsageError where no error budget of tensions will tell what was reached
void expect_tensions(const fs::path& cell) {
  const runner::CellStages of = runner::stages_of(cell, runner::read_image_names(cell));
  if (of.kind == CellKind::plane) return;
  throw UsageError(std::string("--accuracy: is an error of fibre tensions, and this cell is ") +
                   (of.kind == CellKind::sheet ? "a sheet (" : "in space (") + of.why +
                   "): leave it out; its report states the errors" +
                   (of.kind == CellKind::space ? ", and --preset sets how much is computed" : ""));
}

/// Presets are tried without a report; the last of them is then found up to date, and told of with what it reached.
runner::CellOutcome run_to_accuracy(const CommandLine& line, runner::RunOptions options) {
  const double wanted = cost::parse_accuracy(line.accuracy);
  const std::function<void()> write_report = std::exchange(options.finish, nullptr);
  if (!line.run.only.empty()) throw UsageError("--accuracy: needs all stages: leave out --only");
  expect_tensions(line.folder);
  const cost::AccuracyOutcome reached = cost::reach_accuracy(wanted, [&](const std::string& preset) {
    options.preset = preset;
    options.beneath = cost::preset_named(preset).settings;
    runner::run_cell(line.folder, options);
    options.redo.clear();  // once is enough, whatever preset comes next
    const std::optional<ErrorBudget> budget = files::read_fit_summary(line.folder / "4_fit/fit.json").error_budget;
    if (budget) return *budget;
    throw InputError((line.folder / "4_fit/fit.json").string(), "an error budget", "none", "run with --redo fit");
  });
  options.say = nullptr;
  options.explain = false;
  options.finish = [&] {
    cost::record_accuracy(line.folder, wanted, reached);
    write_report();
  };
  say(reached.verdict);
  return runner::run_cell(line.folder, options);
}

/// The stages leave it to us to tell of them.
void speak_for_stages(const CommandLine& line) {
  setenv(stage::kRunnerVariable, line.is_json ? stage::kForProgram : stage::kForPerson, 1);
}

/// Of a time series: 4_fit/series.png, anew after each fit.
void animate(const CommandLine& line) {
  const fs::path frames = line.folder / "4_fit/frames.csv", picture = line.folder / "4_fit/series.png",
                 program = line.run.stage_folder / "mbtfm-animate";
  if (!files::is_own_file(frames) || !files::is_file(program)) return;
  if (files::is_own_file(picture) && fs::last_write_time(picture) > fs::last_write_time(frames)) return;
  runner::run_process({program.string(), "--cell", line.folder.string(), "--out", picture.string(), "--quiet"});
}

int run_one(const CommandLine& line) {
  runner::RunOptions options = run_options(line);
  options.finish = [&] {
    if (!report::has_results(line.folder)) return;
    animate(line);
    report::update_report(line.folder);
    const fs::path page = line.folder / "report.html";
    if (line.is_json) return stage::print(report::result_event(line.folder, page));
    if (!line.run.is_quiet) say(report::result_line(line.folder) + "; " + page.string());
  };
  runner::CellOutcome outcome;
  try {
    outcome = line.accuracy.empty() ? runner::run_cell(line.folder, options) : run_to_accuracy(line, options);
  } catch (const runner::StageFailed& error) {
    if (line.is_json) stage::print(runner::event_of_error(error.failure.message, error.failure.exit_code));
    throw;
  }
  if (outcome.converged()) return kDone;
  std::fprintf(stderr, "mbtfm: error: not converged: %s; the outputs are marked\n", outcome.not_converged().c_str());
  return kNotSolved;
}

/// All cells of a picture. One that fails does not stop the others; without the first nobody knows how many there are.
int run_all(const CommandLine& line) {
  int n = 1, code = kDone;
  for (int i = 1; i <= n; ++i) {
    CommandLine one = line;
    one.folder = runner::make_cell_of_picture(line.folder, i);
    if (!line.is_json && !line.run.is_quiet) say(one.folder.string());
    try {
      code = std::max(code, run_one(one));
    } catch (const runner::StageFailed& error) {
      if (i == 1 && !files::is_file(one.folder / "1_segment/adhesions.csv")) throw;
      say(one.folder.string() + ": " + error.what());
      code = std::max(code, error.failure.exit_code);
    }
    if (i == 1) n = runner::n_cells_in_picture(one.folder);
  }
  return code;
}

int run(const CommandLine& line) {
  speak_for_stages(line);
  return runner::asks_for_all_cells(line.folder) ? run_all(line) : run_one(line);
}

/// The cells below the folder, made from images first where patterns say so.
runner::FoundCells cells_of(const CommandLine& line) {
  std::vector<runner::ImagePattern> patterns;
  for (const std::string& text : line.patterns) patterns.push_back(runner::parse_pattern(text));
  if (!patterns.empty()) runner::make_cell_folders(line.folder, patterns, line.template_toml);
  runner::FoundCells found = runner::find_cells(line.folder);
  for (const runner::SkippedFolder& skipped : found.skipped)
    say("skipped: " + skipped.folder.string() + ": " + skipped.why);
  return found;
}

std::vector<std::string> arguments_of_cell(const CommandLine& line) {
  std::vector<std::string> arguments = {"--threads", std::to_string(std::max(1, line.run.threads / line.jobs)),
                                        "--stages-dir", line.run.stage_folder.string(), "--checked"};
  if (!line.run.preset.empty()) arguments.insert(arguments.end(), {"--preset", line.run.preset});
  if (!line.accuracy.empty()) arguments.insert(arguments.end(), {"--accuracy", line.accuracy});
  for (const std::string& stage : line.run.only) arguments.insert(arguments.end(), {"--only", stage});
  for (const std::string& stage : line.run.redo) arguments.insert(arguments.end(), {"--redo", stage});
  for (const std::string& text : line.set) arguments.insert(arguments.end(), {"--set", text});
  if (line.run.limits.seconds)
    arguments.insert(arguments.end(), {"--timeout", std::to_string(*line.run.limits.seconds)});
  if (line.run.limits.memory_bytes)
    arguments.insert(arguments.end(), {"--memory", std::to_string(*line.run.limits.memory_bytes)});
  return arguments;
}

int batch(const CommandLine& line) {
  speak_for_stages(line);
  const auto [cells, skipped] = cells_of(line);
  if (line.only_list) {
    stage::print(runner::list_cells(cells, run_options(line), line.run.threads));
    return kDone;
  }
  const auto outcomes =
      line.only_table
          ? runner::outcomes_so_far(cells, run_options(line), line.run.threads)
          : runner::run_batch(
                cells, {.program = fs::read_symlink("/proc/self/exe"),
                        .arguments = arguments_of_cell(line),
                        .jobs = line.jobs,
                        .threads = line.run.threads,
                        .run = run_options(line),
                        .say = line.run.is_quiet || line.is_json ? nullptr : say,
                        .ended = line.is_json ? [](const runner::BatchCell& cell) { stage::print(event_of(cell)); }
                                              : std::function<void(const runner::BatchCell&)>(),
                        .show = line.run.is_quiet || !is_terminal() ? nullptr : show});
  const auto n_failed = std::ranges::count_if(outcomes, [](const auto& cell) { return cell.exit_code != 0; });
  if (n_failed > 0) say("failed:" + runner::failure_table(line.folder, outcomes));
  const runner::BatchCounts told = runner::write_batch_tables(line.folder, outcomes, skipped, line.run.only);
  say(told.counts + "; " + (line.folder / "batch.csv").string() + told.not_to_count);
  return n_failed == 0 ? kDone : kFailed;
}

int tell(const runner::Verification& found, const std::string& what) {
  for (const std::string& difference : found.differences) stage::print(difference + "\n");
  if (found.differences.empty())
    stage::print(what + ": " + std::to_string(found.n_files) + " files, all as recorded in run.json\n");
  return found.differences.empty() ? kDone : kFailed;
}

int repeat(const CommandLine& line) {
  speak_for_stages(line);
  if (!files::is_file(line.folder)) runner::require_folder(line.folder, "a cell folder");
  const fs::path run_json = files::is_file(line.folder) ? line.folder : line.folder / "run.json";
  const fs::path inputs = line.inputs.empty() ? run_json.parent_path() : line.inputs;
  return tell(runner::repeat_run(run_json, inputs, line.out, run_options(line), say), line.out.string());
}

/// Become another program of ours.
[[noreturn]] void become(const std::string& name, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), (runner::executable_folder() / name).string());
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  execv(pointers[0], pointers.data());
  throw OutputError("cannot start " + arguments[0]);
}

bool has_flag(const std::vector<std::string>& arguments, const std::string& flag) {
  return std::ranges::any_of(arguments, [&](const auto& a) { return a == flag || a.starts_with(flag + "="); });
}

[[noreturn]] void stats(const CommandLine& line, const std::vector<std::string>& further) {
  if (!further.empty() && !further.front().starts_with("-"))
    throw UsageError("stats: one folder at a time: give the folder that both are in");
  std::vector<std::string> arguments = {"--cells", line.folder.string(), "--threads", std::to_string(line.run.threads)};
  if (!has_flag(further, "--out"))
    arguments.push_back("--out=" + files::inside(line.folder, "statistics", line.folder.string()).string());
  if (line.run.is_quiet) arguments.emplace_back("--quiet");
  if (const fs::path shared = line.folder / "study.toml"; files::is_file(shared) && !has_flag(further, "--config"))
    arguments.insert(arguments.end(), {"--config", shared.string()});
  for (std::string argument : further) {
    // flags are written with dashes, too: --condition-from
    const auto end = argument.begin() + static_cast<std::ptrdiff_t>(std::min(argument.find('='), argument.size()));
    if (argument.starts_with("--")) std::replace(argument.begin() + 2, end, '-', '_');
    arguments.push_back(std::move(argument));
  }
  become("mbtfm-stats", std::move(arguments));
}

std::vector<fs::path> all_folders(const CommandLine& line) {
  std::vector<fs::path> folders = line.more_cells;
  folders.insert(folders.begin(), line.folder);
  return folders;
}

/// Of several folders each has its page; the worst exit code counts.
int check(const CommandLine& line) {
  const auto arguments_for = [&](const fs::path& folder) {
    std::vector<std::string> arguments = {"--cells", folder.string(), "--threads", std::to_string(line.run.threads)};
    if (line.is_json) arguments.insert(arguments.end(), {"--json_lines", "--quiet"});
    if (files::is_folder(folder)) arguments.insert(arguments.end(), {"--page", (folder / "check.html").string()});
    return arguments;
  };
  if (line.more_cells.empty()) become("mbtfm-check", arguments_for(line.folder));
  int code = kDone;
  for (const fs::path& folder : all_folders(line)) {
    std::vector<std::string> command = arguments_for(folder);
    command.insert(command.begin(), (runner::executable_folder() / "mbtfm-check").string());
    code = std::max(code, runner::exit_code_of(runner::run_process(command, {}, stage::print)));
  }
  return code;
}

[[noreturn]] void init(const CommandLine& line) {
  const fs::path like =
      files::is_file(line.like) ? fs::absolute(line.like).parent_path() : line.like;  // of its cell.toml
  std::vector<std::string> arguments = {"--cell", line.folder.string(), "--out", (line.folder / "cell.toml").string()};
  if (!line.like.empty()) arguments.insert(arguments.end(), {"--like", like.string()});
  become("mbtfm-init", arguments);
}

/// @param arguments  as given, in their order
[[noreturn]] void plan(std::vector<std::string> arguments) {
  if (!has_flag(arguments, "--out")) arguments.insert(arguments.end(), {"--out", "plan"});
  become("mbtfm-plan", std::move(arguments));
}

/// @param arguments  as given: pictures, if any, then flags
[[noreturn]] void noise(std::vector<std::string> arguments) {
  const auto n_pictures =
      std::ranges::find_if(arguments, [](const auto& a) { return a.starts_with("-"); }) - arguments.begin();
  if (n_pictures != 0 && n_pictures != 2)
    throw UsageError("noise: expected two pictures of a place: mbtfm noise A.tif B.tif");
  if (n_pictures == 2) {
    arguments.insert(arguments.begin() + 1, "--second");
    arguments.insert(arguments.begin(), "--first");
  }
  become("mbtfm-noise", std::move(arguments));
}

int cost_study(const CommandLine& line) {
  if (!line.more_cells.empty() && line.out.empty())
    throw UsageError("--out: is needed for the study of several cells: a folder of its own");
  const std::vector<fs::path> cells = all_folders(line);
  std::vector<cost::Study> studies;
  std::string names;
  for (const fs::path& cell : cells) {
    names += (names.empty() ? "" : ", ") + fs::weakly_canonical(cell).filename().string();
    studies.push_back(cost::measure(cell, {.stage_folder = line.run.stage_folder,
                                           .threads = line.run.threads,
                                           .budget_s = 60 * line.budget_min / static_cast<double>(cells.size()),
                                           .repeats = line.repeats,
                                           .extent = line.is_whole ? cost::Extent::whole : cost::Extent::quick,
                                           .say = line.run.is_quiet ? nullptr : say}));
  }
  const fs::path folder = line.out.empty() ? files::inside(line.folder, "cost", line.folder.string()) : line.out;
  cost::write_study(folder, cost::combined(studies), names);
  if (!line.run.is_quiet) say("cost.csv, cost.svg and cost.md in " + folder.string());
  return kDone;
}

CLI::App* add_command(CLI::App& app, CommandLine& line, const std::string& name, const std::string& folder) {
  CLI::App* command = app.add_subcommand(name);
  command->add_option(folder, line.folder)->required(name != "demo");
  command->add_option("--threads", line.run.threads)->check(CLI::Range(1, 1024))->capture_default_str();
  command->add_flag("--quiet", line.run.is_quiet);
  return command;
}

void add_stage_folder(CLI::App* command, CommandLine& line) {
  command->add_option("--stages-dir", line.run.stage_folder)->capture_default_str();
}

void add_stage_options(CLI::App* command, CommandLine& line) {
  std::vector<std::string> names;
  for (const cost::Preset& preset : cost::presets()) names.push_back(preset.name);
  CLI::Option* preset = command->add_option("--preset", line.run.preset)->check(CLI::IsMember(names));
  command->add_option("--accuracy", line.accuracy)->excludes(preset);
  command->add_option("--set", line.set)->allow_extra_args(false);
  // one value a flag: else the folder that follows would be taken for another
  command->add_option("--only", line.run.only, stage::help_on("any command", "--only", {runner::stage_names()}))
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option("--redo", line.run.redo)->delimiter(',')->allow_extra_args(false);
  add_stage_folder(command, line);
  const std::map<std::string, double> time_units = {{"s", 1}, {"min", 60}, {"h", 3600}};
  command->add_option("--timeout", line.run.limits.seconds)
      ->transform(CLI::AsNumberWithUnit(time_units, CLI::AsNumberWithUnit::CASE_INSENSITIVE, "TIME"))
      ->check(CLI::Range(1e-3, 1e15));
  command->add_option("--memory", line.run.limits.memory_bytes)
      ->transform(CLI::AsSizeValue(/*kb_is_1000=*/true))
      ->check(CLI::Range(1e-3, 1e15));
}

/// A simulated cell, images and all, every stage on it, and its tensions beside the truth.
int demo(CommandLine line) {
  if (line.folder.empty()) line.folder = "mbtfm-demo";
  if (!line.run.is_quiet) say("simulating a cell in " + line.folder.string());
  std::vector<std::string> command = {(line.run.stage_folder / "mbtfm-simulate").string()};
  command.insert(command.end(), {"--scenario", "u2os", "--seed", "8", "--noise_um", "0.03", "--beads_per_um2", "0.5"});
  command.insert(command.end(),
                 {"--images", "--out", line.folder.string(), "--threads", std::to_string(line.run.threads)});
  if (line.run.is_quiet) command.emplace_back("--quiet");
  if (line.is_forced) command.emplace_back("--force");
  const runner::ProcessResult simulated = runner::run_process(command);
  if (const int code = runner::exit_code_of(simulated); code != kDone) return code;
  const int code = run(line);
  if (code == kDone) stage::print(report::comparison_text(line.folder));
  return code;
}

stage::WordsOfFlags words_of_flags() {
  std::vector<std::string> presets, stages;
  for (const cost::Preset& preset : cost::presets()) presets.push_back(preset.name);
  for (const runner::Stage& stage : runner::all_stages()) stages.push_back(stage.name);
  return {{"--preset", presets}, {"--only", stages}, {"--redo", stages}};
}

int start(int argc, char** argv) {
  CommandLine line;
  line.run.stage_folder = runner::executable_folder();
  line.run.threads = numerics::available_threads();
  CLI::App app("", "mbtfm");
  app.set_version_flag("--version", std::string("mbtfm ") + kVersion);
  app.footer("Exit codes: " + stage::exit_codes());
  CLI::App* demo_command = add_command(app, line, "demo", "CELL");
  demo_command->add_flag("--force", line.is_forced);
  CLI::App* init_command = add_command(app, line, "init", "CELL");
  init_command->add_option("--like", line.like);
  CLI::App* check_command = add_command(app, line, "check", "FOLDER");
  check_command->add_option("MORE", line.more_cells);
  CLI::App* run_command = add_command(app, line, "run", "CELL");
  add_stage_options(run_command, line);
  run_command->add_flag("--checked", line.run.is_checked)->group("");
  run_command->add_flag("--explain", line.run.explain);
  for (CLI::App* command : {run_command, demo_command}) command->add_flag("--verbose", line.is_verbose);
  CLI::App* batch_command = add_command(app, line, "batch", "FOLDER");
  for (CLI::App* command : {run_command, batch_command, check_command}) command->add_flag("--json", line.is_json);
  add_stage_options(batch_command, line);
  batch_command->add_option("--jobs", line.jobs)->check(CLI::Range(1, 1024))->capture_default_str();
  batch_command->add_option("--pattern", line.patterns)->allow_extra_args(false);
  batch_command->add_option("--template", line.template_toml);
  batch_command->add_flag("--list", line.only_list);
  batch_command->add_flag("--table", line.only_table);
  CLI::App* verify_command = add_command(app, line, "verify", "CELL");
  CLI::App* repeat_command = add_command(app, line, "repeat", "CELL");
  repeat_command->add_option("--out", line.out)->required();
  repeat_command->add_option("--inputs", line.inputs);
  add_stage_folder(repeat_command, line);
  CLI::App* stats_command = add_command(app, line, "stats", "FOLDER");
  stats_command->allow_extras()->footer("Further arguments go to mbtfm-stats: see mbtfm-stats --help.");
  CLI::App* cost_command = add_command(app, line, "cost", "CELL");
  cost_command->add_option("MORE", line.more_cells);
  cost_command->add_option("--out", line.out);
  cost_command->add_option("--budget", line.budget_min)->check(CLI::Range(1e-3, 1e6))->capture_default_str();
  cost_command->add_option("--repeats", line.repeats)->check(CLI::Range(1, 100))->capture_default_str();
  cost_command->add_flag("--all", line.is_whole);
  add_stage_folder(cost_command, line);
  // what follows is for the program that they become, --help included
  CLI::App* plan_command = app.add_subcommand("plan");
  plan_command->set_help_flag();
  plan_command->allow_extras();
  CLI::App* noise_command = app.add_subcommand("noise");
  noise_command->set_help_flag();
  noise_command->allow_extras();
  fs::path manuals;
  app.add_option("--manuals", manuals)->group("");
  app.require_subcommand(0, 1);
  CLI::App* compare_command = add_command(app, line, "compare", "CELL");
  stage::describe(app, "mbtfm");
  try {
    std::vector<std::string> arguments(argv + 1, argv + argc);
    for (const char* word : {"help", "version"}) {  // mbtfm help run
      if (arguments.empty() || arguments.front() != word) continue;
      arguments.push_back("--" + arguments.front());
      arguments.erase(arguments.begin());
    }
    std::ranges::reverse(arguments);  // as CLI11 takes them
    app.parse(std::move(arguments));
  } catch (const CLI::ParseError& error) {
    std::ostringstream help, message;
    const int code = app.exit(error, help, message);
    std::cerr << message.str();
    const std::string program = argc > 1 ? "mbtfm-" + std::string(argv[1]) : "";
    if (const std::string meant = stage::suggestion(app, error.what()); code != 0 && !meant.empty())
      std::cerr << "mbtfm: "
                << (files::is_file(runner::executable_folder() / program) && app.get_subcommands().empty()
                        ? "that is a program of its own: " + program + " --help; of a cell: mbtfm run CELL --only STAGE"
                        : meant.substr(2))
                << "\n";
    stage::print(help.str());
    return code == 0 ? kDone : kUsage;
  }
  if (!manuals.empty()) {
    stage::write_manuals(app, words_of_flags(), manuals);
    return kDone;
  }
  if (app.get_subcommands().empty()) {
    stage::print(app.help());
    return kDone;
  }
  if (demo_command->parsed()) return demo(line);
  if (run_command->parsed()) return run(line);
  if (batch_command->parsed()) return batch(line);
  if (cost_command->parsed()) return cost_study(line);
  if (verify_command->parsed() || compare_command->parsed()) runner::require_folder(line.folder, "a cell folder");
  if (verify_command->parsed()) return tell(runner::verify_cell(line.folder), line.folder.string());
  if (repeat_command->parsed()) return repeat(line);
  if (plan_command->parsed()) plan(plan_command->remaining());
  if (noise_command->parsed()) noise(noise_command->remaining());
  if (stats_command->parsed()) stats(line, stats_command->remaining());
  if (check_command->parsed()) return check(line);
  if (init_command->parsed()) init(line);
  stage::print(report::comparison_text(line.folder));
  return kDone;
}

}  // namespace

int main(int argc, char** argv) {
  runner::watch_interrupts();
  if (is_terminal()) setenv("MBTFM_TERMINAL", "1", 1);  // the stages' own progress is seen
  try {
    return start(argc, argv);
  } catch (const runner::StageFailed& error) {
    std::fprintf(stderr, "mbtfm: error: %s\n", error.what());
    return error.failure.exit_code;
  } catch (const runner::CellBusy& error) {
    std::fprintf(stderr, "mbtfm: error: %s\n", error.what());
    return kBusy;
  } catch (...) {
    return report_current_exception("mbtfm");
  }
}
