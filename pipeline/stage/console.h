/// What every program does with its terminal: what it prints, and the signals that reach it.
#pragma once

#include <string>
#include <string_view>

namespace mbtfm::stage {

/// Write all of it to standard output: lists, tables, help. Where its reader has gone (`| head`), the program ends as
/// SIGPIPE ends any other.
/// @throws OutputError where it cannot be written (a full disk)
void print(std::string_view text);

/// Standard error is a terminal, or is passed on to one by `mbtfm`.
bool is_terminal();
/// In the colour of warnings on a terminal, unless NO_COLOR is set (no-color.org).
std::string warning(const std::string& text);

/// "40 s", "3 min", "2.5 h"
std::string readable_duration(double seconds);

/// Who reads what a program says of its work.
enum class Reader {
  nobody,      ///< --quiet: errors alone
  person,      ///< a line on the terminal
  program,     ///< --json: an object a line, on standard output
  runner,      ///< `mbtfm run`, which reads the record, for a person
  json_runner  ///< the same for a program: progress as JSON on standard error
};
/// As the flags and the environment (kRunnerVariable) say.
Reader reader(bool is_quiet, bool is_json);
/// Set for the stages by `mbtfm run`: for whom it speaks.
constexpr const char *kRunnerVariable = "MBTFM_RUNNER", *kForPerson = "text", *kForProgram = "json";

enum class SecondSignal { ends_at_once, is_noted };

/// From now on Ctrl-C, SIGTERM and a closed terminal (SIGHUP, but under nohup) are noted, and the work is asked to
/// stop. Nobody who reads our messages (SIGPIPE) is no reason to: the work goes on.
void watch_signals(SecondSignal second);
bool is_stop_asked();

}  // namespace mbtfm::stage
