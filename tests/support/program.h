/// The project's programs as a person runs them.
#pragma once

#include <sys/wait.h>

#include "pipeline/files/text.h"
#include "tests/support/folders.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm::test {

struct Outcome {
  int code = 0;
  std::string output;  ///< standard output and error
};

/// @param command  a program of build/bin with its arguments, e.g. "mbtfm run cell"
/// @param before  shell commands that set its surroundings, e.g. "ulimit -f 4;"
inline Outcome run_program(const std::string& command, const std::string& before = {}) {
  const TemporaryFolder folder;
  const std::filesystem::path log = folder / "log";
  const std::string whole =
      before + test::build_folder().string() + "/bin/" + command + " > '" + log.string() + "' 2>&1";
  const int status = std::system(whole.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), files::read_text(log)};
}

/// The same in a folder: names of files are of it.
inline Outcome run_in(const TemporaryFolder& folder, const std::string& command) {
  return run_program(command, "cd '" + folder.path().string() + "' && ");
}

/// What a program said that ended with this exit code; with another one, the test ends.
inline std::string output_of(const Outcome& outcome, int code = 0) {
  if (outcome.code == code) return outcome.output;
  throw std::runtime_error("exit code " + std::to_string(outcome.code) + ": " + outcome.output);
}

inline std::string output_of(const std::string& command, int code = 0, const std::string& before = {}) {
  return output_of(run_program(command, before), code);
}

}  // namespace mbtfm::test

namespace mbtfm {

using test::Outcome;
using test::output_of;
using test::run_in;
using test::run_program;

}  // namespace mbtfm
