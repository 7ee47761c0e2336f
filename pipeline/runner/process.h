/// Other programs, started and waited for.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace mbtfm::runner {

/// From now on Ctrl-C is noted, not obeyed: the running programs have got it, too, and end by themselves; no further
/// one is started.
void watch_interrupts();

struct ProcessResult {
  int exit_code = 0;          ///< of a program that ended by itself
  std::optional<int> signal;  ///< that ended it
  double seconds = 0;
  double cpu_seconds = 0;  ///< of all its threads
  double peak_memory_MB = 0;
};

/// Start command[0] with its arguments and wait for it. It ends with us. Its standard output and error are ours, or
/// appended to `log_file`.
/// @throws Interrupted where Ctrl-C was pressed before or while it ran, OutputError where it cannot be started or the
/// log cannot be written
ProcessResult run_process(const std::vector<std::string>& command,
                          const std::optional<std::filesystem::path>& log_file = {});

/// One line that says how it ended: "exit code 3", "killed by signal 9 (Killed)".
std::string how_it_ended(const ProcessResult& result);

/// Folder of the running executable.
std::filesystem::path executable_folder();

}  // namespace mbtfm::runner
