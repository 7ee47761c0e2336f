/// Other programs, started, watched and waited for.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mbtfm::runner {

/// From now on Ctrl-C, SIGTERM and a closed terminal are noted, not obeyed: running programs are asked to end; no
/// further one is started.
void watch_interrupts();
/// @throws Interrupted where Ctrl-C was pressed
void throw_if_interrupted();

/// Beyond them it is killed. Memory is what it holds, looked at ten times a second. A limit of the system's
/// (setrlimit) would refuse it more instead, which libraries do not survive: OpenBLAS asks again for ever.
struct ProcessLimits {
  std::optional<double> seconds;
  std::optional<std::uint64_t> memory_bytes = {};
};

struct ProcessResult {
  int exit_code = 0;          ///< of a program that ended by itself
  std::optional<int> signal;  ///< that ended it
  enum class Limit { none, seconds, memory };
  Limit exceeded = Limit::none;  ///< for which we killed it
  double seconds = 0;
  double cpu_seconds = 0;  ///< of all its threads
  double peak_memory_MB = 0;
  std::string last_output;  ///< the end of what it printed
};

/// Takes what a program prints, as it comes.
using Sink = std::function<void(std::string_view)>;
void print_on(std::string_view text);  ///< to our standard error

/// Start command[0] with its arguments, in a process group of its own, and wait for it. Whatever it started ends with
/// it, and it ends with us, even where we are killed.
/// @throws Interrupted where Ctrl-C was pressed before or while it ran, OutputError where it cannot be started
ProcessResult run_process(const std::vector<std::string>& command, const ProcessLimits& limits = {},
                          const Sink& sink = print_on);

/// One line that says how it ended: "exit code 3", "killed by signal 9 (Killed)", "timed out after 60 s", "took too
/// much memory (4100 MB)".
std::string how_it_ended(const ProcessResult& result);
/// As the shell counts: 128 + signal; for one that was killed for its limits, that of want of resources.
int exit_code_of(const ProcessResult& result);

/// What a program's output says of its failure: the lines from the first error on, or else the last line.
std::string error_in(const std::string& output);

/// Folder of the running executable.
std::filesystem::path executable_folder();

}  // namespace mbtfm::runner
