/// The commands of `mbtfm`: their flags, and what each does.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/runner/run_cell.h"

namespace CLI {
class App;
}

namespace mbtfm::commands {

struct CommandLine {
  fs::path folder;
  runner::RunOptions run;  ///< what of it flags say
  int jobs = 1;
  bool is_verbose = false, is_json = false, only_list = false, only_table = false, is_forced = false;
  std::vector<std::string> patterns, set;
  std::vector<fs::path> more_folders;
  fs::path template_toml, out, inputs, like;
  std::string accuracy;
  double budget_min = 10;  ///< a study that one waits for
  int repeats = 3;         ///< whose median one busy moment does not move
  bool is_whole = false;
  std::vector<std::string> for_each_cell;  ///< flags given to `batch` that `run` has, too
  std::vector<std::string> further;        ///< arguments for the program that the command becomes
};

/// On standard error, as a line of mbtfm. On a terminal, what is on the line before gives way.
void say(const std::string& line);

/// All of them as subcommands that write into `line`, which must outlive the app.
void declare(CLI::App& app, CommandLine& line);
/// The one that was given. @returns its exit code; none: none was given
std::optional<int> run_given(const CLI::App& app, CommandLine line);
std::vector<std::string> preset_names();

int demo(const CommandLine& line);
int run(const CommandLine& line);
int batch(const CommandLine& line);
int repeat(const CommandLine& line);
int verify(const CommandLine& line);
int compare(const CommandLine& line);
int cost(const CommandLine& line);
int check(const CommandLine& line);
int init(const CommandLine& line);
int noise(const CommandLine& line);
int plan(const CommandLine& line);
int stats(const CommandLine& line);

}  // namespace mbtfm::commands
