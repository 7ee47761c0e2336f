#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "pipeline/commands/commands.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/version.h"
#include "pipeline/cost/accuracy.h"
#include "pipeline/cost/study.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/own_files.h"
#include "pipeline/report/compare.h"
#include "pipeline/report/report.h"
#include "pipeline/runner/batch.h"
#include "pipeline/runner/batch_table.h"
#include "pipeline/runner/cell_stages.h"
#include "pipeline/runner/image_sets.h"
#include "pipeline/runner/verify.h"
#include "pipeline/stage/console.h"

namespace mbtfm::commands {
namespace {

using namespace exit_code;

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

void show(const std::string& line) { std::fprintf(stderr, "\r\033[K%s", line.c_str()); }

std::function<void(const runner::StageResult&)> reporter(const CommandLine& line) {
  if (line.is_json) return [](const runner::StageResult& result) { stage::print(events_of(result)); };
  if (line.run.is_quiet) return nullptr;
  const auto detail = line.is_verbose ? runner::Detail::all : runner::Detail::brief;
  return [detail](const runner::StageResult& result) { say(text_of(result, detail)); };
}

runner::RunOptions run_options(const CommandLine& line) {
  runner::RunOptions options = line.run;
  if (!options.preset.empty()) {
    options.beneath = cost::preset_named(options.preset).settings;
    options.beneath_in_space = cost::preset_named(options.preset).in_space;
  }
  for (const std::string& text : line.set) options.set.push_back(runner::parse_setting(text));
  options.version = kVersion;
  options.say = reporter(line);
  if (line.is_json) options.sink = event_sink;
  if (!line.is_json && !options.is_quiet) options.note = say;
  return options;
}

/// @throws UsageError if no error budget of tensions will show what was reached
void expect_tensions(const fs::path& cell) {
  const runner::CellStages of = runner::stages_of(cell, runner::read_image_names(cell));
  if (has_fibres(of.kind)) return;
  throw UsageError(std::string("--accuracy: is an error of fibre tensions, and this cell is ") +
                   (is_sheet(of.kind) ? "a sheet (" : "in space (") + of.why +
                   "): leave it out; its report states the errors" +
                   (is_in_space(of.kind) ? ", and --preset sets how much is computed" : ""));
}

/// Presets are tried without a report; the last one is then up to date, and reported with the accuracy it reached.
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

/// This program reports on the stages; they print nothing of their own.
void speak_for_stages(const CommandLine& line) {
  setenv(stage::kRunnerVariable, line.is_json ? stage::kForProgram : stage::kForPerson, 1);
}

/// Of a time series: 4_fit/series.png, made again after each fit.
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

int print_differences(const runner::Verification& found, const std::string& what) {
  for (const std::string& difference : found.differences) stage::print(difference + "\n");
  if (found.differences.empty())
    stage::print(what + ": " + std::to_string(found.n_files) + " files, all as recorded in run.json\n");
  return found.differences.empty() ? kDone : kFailed;
}

}  // namespace

void say(const std::string& line) {
  std::fprintf(stderr, "%smbtfm: %s\n", is_terminal() ? "\r\033[K" : "", line.c_str());
}

int run(const CommandLine& line) {
  speak_for_stages(line);
  return runner::asks_for_all_cells(line.folder) ? run_all(line) : run_one(line);
}

int batch(const CommandLine& line) {
  speak_for_stages(line);
  const auto [cells, skipped] = cells_of(line);
  if (line.only_list) {
    stage::print(runner::list_cells(cells, run_options(line), line.run.threads));
    return kDone;
  }
  std::vector<std::string> arguments = line.for_each_cell;
  arguments.insert(arguments.end(),
                   {"--threads", std::to_string(std::max(1, line.run.threads / line.jobs)), "--checked"});
  const auto outcomes =
      line.only_table
          ? runner::outcomes_so_far(cells, run_options(line), line.run.threads)
          : runner::run_batch(
                cells, {.program = fs::read_symlink("/proc/self/exe"),
                        .arguments = arguments,
                        .jobs = line.jobs,
                        .threads = line.run.threads,
                        .run = run_options(line),
                        .say = line.run.is_quiet || line.is_json ? nullptr : say,
                        .ended = line.is_json ? [](const runner::BatchCell& cell) { stage::print(event_of(cell)); }
                                              : std::function<void(const runner::BatchCell&)>(),
                        .show = line.run.is_quiet || !is_terminal() ? nullptr : show});
  const auto n_failed = std::ranges::count_if(outcomes, [](const auto& cell) { return cell.exit_code != 0; });
  if (n_failed > 0) say("failed:" + runner::failure_table(line.folder, outcomes));
  const runner::BatchCounts written = runner::write_batch_tables(line.folder, outcomes, skipped, line.run.only);
  say(written.counts + "; " + (line.folder / "batch.csv").string() + written.not_to_count);
  return n_failed == 0 ? kDone : kFailed;
}

int repeat(const CommandLine& line) {
  speak_for_stages(line);
  if (!files::is_file(line.folder)) runner::require_folder(line.folder, "a cell folder");
  const fs::path run_json = files::is_file(line.folder) ? line.folder : line.folder / "run.json";
  const fs::path inputs = line.inputs.empty() ? run_json.parent_path() : line.inputs;
  return print_differences(runner::repeat_run(run_json, inputs, line.out, run_options(line), say), line.out.string());
}

int verify(const CommandLine& line) {
  runner::require_folder(line.folder, "a cell folder");
  return print_differences(runner::verify_cell(line.folder), line.folder.string());
}

int compare(const CommandLine& line) {
  runner::require_folder(line.folder, "a cell folder");
  stage::print(report::comparison_text(line.folder));
  return kDone;
}

int demo(const CommandLine& given) {
  CommandLine line = given;
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
  return code == kDone ? compare(line) : code;
}

// Programs of their own.

namespace {

using Arguments = std::vector<std::string>;

std::string path_of(const std::string& program) { return (runner::executable_folder() / program).string(); }

/// Become another program of ours.
[[noreturn]] void become(const std::string& program, Arguments arguments) {
  arguments.insert(arguments.begin(), path_of(program));
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  execv(pointers[0], pointers.data());
  throw OutputError("cannot start " + arguments[0]);
}

bool has_flag(const Arguments& arguments, const std::string& flag) {
  return std::ranges::any_of(arguments, [&](const auto& a) { return a == flag || a.starts_with(flag + "="); });
}

std::vector<fs::path> all_folders(const CommandLine& line) {
  std::vector<fs::path> folders = line.more_folders;
  folders.insert(folders.begin(), line.folder);
  return folders;
}

}  // namespace

int stats(const CommandLine& line) {
  const Arguments& further = line.further;
  if (!further.empty() && !further.front().starts_with("-"))
    throw UsageError("stats: one folder at a time: give the folder that both are in");
  Arguments arguments = {"--cells", line.folder.string(), "--threads", std::to_string(line.run.threads)};
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

/// Of several folders each has its page; the worst exit code counts.
int check(const CommandLine& line) {
  const auto arguments_for = [&](const fs::path& folder) {
    Arguments arguments = {"--cells", folder.string(), "--threads", std::to_string(line.run.threads)};
    if (line.is_json) arguments.insert(arguments.end(), {"--json_lines", "--quiet"});
    if (files::is_folder(folder)) arguments.insert(arguments.end(), {"--page", (folder / "check.html").string()});
    return arguments;
  };
  if (line.more_folders.empty()) become("mbtfm-check", arguments_for(line.folder));
  int code = kDone;
  for (const fs::path& folder : all_folders(line)) {
    Arguments command = arguments_for(folder);
    command.insert(command.begin(), path_of("mbtfm-check"));
    code = std::max(code, runner::exit_code_of(runner::run_process(command, {}, stage::print)));
  }
  return code;
}

int init(const CommandLine& line) {
  const fs::path like =
      files::is_file(line.like) ? fs::absolute(line.like).parent_path() : line.like;  // of its cell.toml
  Arguments arguments = {"--cell", line.folder.string(), "--out", (line.folder / "cell.toml").string()};
  if (!line.like.empty()) arguments.insert(arguments.end(), {"--like", like.string()});
  become("mbtfm-init", arguments);
}

int plan(const CommandLine& line) {
  Arguments arguments = line.further;
  if (!has_flag(arguments, "--out")) arguments.insert(arguments.end(), {"--out", "plan"});
  become("mbtfm-plan", std::move(arguments));
}

/// Pictures, if any, then flags.
int noise(const CommandLine& line) {
  Arguments arguments = line.further;
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

int cost(const CommandLine& line) {
  if (!line.more_folders.empty() && line.out.empty())
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

}  // namespace mbtfm::commands
