/// mbtfm: starts the stages. It links none of them.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <sstream>

#include "pipeline/commands/commands.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/version.h"
#include "pipeline/files/own_files.h"
#include "pipeline/numerics/parallel.h"
#include "pipeline/runner/cell_stages.h"
#include "pipeline/runner/lock.h"
#include "pipeline/stage/console.h"
#include "pipeline/stage/help.h"
#include "pipeline/stage/manual.h"
#include "pipeline/stage/suggest.h"

namespace {

using namespace mbtfm;
using namespace exit_code;

stage::WordsOfFlags words_of_flags() {
  std::vector<std::string> stages;
  for (const runner::Stage& stage : runner::all_stages()) stages.push_back(stage.name);
  return {{"--preset", commands::preset_names()}, {"--only", stages}, {"--redo", stages}};
}

/// As CLI11 takes them, the last first; `mbtfm help run` is `mbtfm run --help`.
std::vector<std::string> arguments_of(int argc, char** argv) {
  std::vector<std::string> arguments(argv + 1, argv + argc);
  for (const char* word : {"help", "version"}) {
    if (arguments.empty() || arguments.front() != word) continue;
    arguments.push_back("--" + arguments.front());
    arguments.erase(arguments.begin());
  }
  std::ranges::reverse(arguments);
  return arguments;
}

/// Help that was asked for, or what is wrong and was probably meant. @returns the exit code
int answer(const CLI::App& app, const CLI::ParseError& error, const std::string& word) {
  std::ostringstream help, message;
  const int code = app.exit(error, help, message);
  std::cerr << message.str();
  const std::string program = "mbtfm-" + word, meant = stage::suggestion(app, error.what());
  if (code != 0 && !meant.empty())
    std::cerr << "mbtfm: "
              << (files::is_file(runner::executable_folder() / program) && app.get_subcommands().empty()
                      ? "that is a program of its own: " + program + " --help; of a cell: mbtfm run CELL --only STAGE"
                      : meant.substr(2))
              << "\n";
  stage::print(help.str());
  return code == 0 ? kDone : kUsage;
}

int start(int argc, char** argv) {
  commands::CommandLine line;
  line.run.stage_folder = runner::executable_folder();
  line.run.threads = numerics::available_threads();
  CLI::App app("", "mbtfm");
  app.set_version_flag("--version", std::string("mbtfm ") + kVersion);
  app.footer("Exit codes: " + stage::help_on("exit status", ""));
  app.require_subcommand(0, 1);
  declare(app, line);
  fs::path manuals;
  app.add_option("--manuals", manuals)->group("");
  stage::describe(app, "mbtfm");
  try {
    app.parse(arguments_of(argc, argv));
  } catch (const CLI::ParseError& error) {
    return answer(app, error, argc > 1 ? argv[1] : "");
  }
  if (manuals.empty()) {
    if (const std::optional<int> code = run_given(app, line)) return *code;
    stage::print(app.help());
  } else {
    stage::write_manuals(app, words_of_flags(), manuals);
  }
  return kDone;
}

}  // namespace

int main(int argc, char** argv) {
  runner::watch_interrupts();
  if (isatty(STDERR_FILENO) != 0) setenv("MBTFM_TERMINAL", "1", 1);  // the stages' own progress is seen
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
