#include "pipeline/runner/process.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>

#include "pipeline/contract/errors.h"

namespace mbtfm::runner {
namespace {

// The shell's code for a command that cannot be executed.
constexpr int kCannotExecute = 127;

std::atomic<bool> was_interrupted = false;
constexpr const char* kStopped = "interrupted; finished stages are kept";
extern "C" void note_interrupt(int) { was_interrupted = true; }

/// The child, between fork and exec: only async-signal-safe calls, as other threads of the parent may hold locks.
[[noreturn]] void become(char* const* arguments, int log_descriptor) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (log_descriptor >= 0) {
    dup2(log_descriptor, STDOUT_FILENO);
    dup2(log_descriptor, STDERR_FILENO);
  }
  execv(arguments[0], arguments);
  _exit(kCannotExecute);
}

}  // namespace

void watch_interrupts() {
  struct sigaction action {};
  action.sa_handler = note_interrupt;
  sigaction(SIGINT, &action, nullptr);
}

ProcessResult run_process(const std::vector<std::string>& command,
                          const std::optional<std::filesystem::path>& log_file) {
  if (was_interrupted) throw Interrupted(kStopped);
  std::vector<char*> arguments;
  for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  if (access(arguments[0], X_OK) != 0) {
    throw OutputError("cannot start " + command[0] + ": " + std::strerror(errno));
  }
  int log_descriptor = -1;
  if (log_file) {
    log_descriptor = open(log_file->c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    if (log_descriptor < 0) throw OutputError("cannot write " + log_file->string() + ": " + std::strerror(errno));
  }

  const auto start = std::chrono::steady_clock::now();
  const pid_t child = fork();
  if (child == 0) become(arguments.data(), log_descriptor);
  const int fork_error = errno;
  if (log_descriptor >= 0) close(log_descriptor);
  if (child < 0) throw OutputError("cannot start " + command[0] + ": " + std::strerror(fork_error));

  int status = 0;
  rusage usage{};
  while (wait4(child, &status, 0, &usage) < 0 && errno == EINTR) {
  }
  if (was_interrupted) throw Interrupted(kStopped);
  ProcessResult result;
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const auto seconds_of = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  result.cpu_seconds = seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime);
  constexpr double kMegabytePerKibibyte = 1024e-6;  // ru_maxrss is in KiB
  result.peak_memory_MB = static_cast<double>(usage.ru_maxrss) * kMegabytePerKibibyte;
  if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 0;
  return result;
}

std::string how_it_ended(const ProcessResult& result) {
  if (result.signal) {
    return "killed by signal " + std::to_string(*result.signal) + " (" + strsignal(*result.signal) + ")";
  }
  return "exit code " + std::to_string(result.exit_code);
}

std::filesystem::path executable_folder() { return std::filesystem::read_symlink("/proc/self/exe").parent_path(); }

}  // namespace mbtfm::runner
