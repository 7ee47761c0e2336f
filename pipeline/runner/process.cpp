#include "pipeline/runner/process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <fstream>
#include <sstream>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/stage/console.h"

namespace mbtfm::runner {
namespace {

using Clock = std::chrono::steady_clock;

// The shell's code for a command that cannot be executed.
constexpr int kCannotExecute = 127;
// How often we look whether the program is over its time, or ours is: unnoticed by people, and costs nothing.
constexpr int kTick_ms = 100;
// For an interrupted program to end by itself. Stages look for the signal at each step of their progress.
constexpr double kGrace_s = 10;
// Of the output, kept for messages: an error and its hint, never the whole log.
constexpr std::size_t kTailBytes = 8192;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// The child, between fork and exec: only async-signal-safe calls, as other threads of the parent may hold locks.
[[noreturn]] void become(char* const* arguments, int output, pid_t parent) {
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kCannotExecute);  // it died before that call
  dup2(output, STDOUT_FILENO);
  dup2(output, STDERR_FILENO);
  std::signal(SIGPIPE, SIG_DFL);  // ignored by us, and by what we start only if it chooses so
  execv(arguments[0], arguments);
  _exit(kCannotExecute);
}

/// A program that runs: its process group and what it prints.
class Child {
 public:
  Child(const std::vector<std::string>& command, const Sink& sink) : sink_(sink) {
    std::vector<char*> arguments;
    for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
    arguments.push_back(nullptr);
    const auto fail = [&] { throw OutputError("cannot start " + command[0] + ": " + std::strerror(errno)); };
    if (access(arguments[0], X_OK) != 0) fail();
    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC | O_NONBLOCK) != 0) fail();
    fcntl(ends[1], F_SETFL, 0);  // the program's end is an ordinary one
    output_ = ends[0];
    const pid_t parent = getpid();
    pid_ = fork();
    if (pid_ == 0) become(arguments.data(), ends[1], parent);
    const int fork_error = errno;
    close(ends[1]);
    if (pid_ < 0) {
      close(output_);
      errno = fork_error;
      fail();
    }
    setpgid(pid_, pid_);  // here, too: whoever comes first
  }
  ~Child() { close(output_); }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// Wait for output or a tick of the clock, and pass on what there is.
  void listen() {
    pollfd place{.fd = is_output_open_ ? output_ : -1, .events = POLLIN, .revents = 0};
    // Where the output is closed, the program ends in this moment as a rule.
    const int wait_ms = is_output_open_ ? kTick_ms : 1;
    if (poll(&place, 1, wait_ms) > 0) read_once();
  }

  bool has_ended() const {
    siginfo_t info{};
    return waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid == pid_;
  }

  /// That it holds.
  std::uint64_t memory_bytes() const {
    std::ifstream statm("/proc/" + std::to_string(pid_) + "/statm");
    std::uint64_t all_pages = 0, resident_pages = 0;
    statm >> all_pages >> resident_pages;
    return resident_pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  }

  void signal_group(int signal) const { kill(-pid_, signal); }

  /// End what is left of its group, and take its result. After has_ended only.
  ProcessResult result() {
    signal_group(SIGKILL);  // not reaped yet: its number cannot be another's
    while (read_once()) {
    }
    int status = 0;
    rusage usage{};
    while (wait4(pid_, &status, 0, &usage) < 0 && errno == EINTR) {
    }
    ProcessResult result;
    const auto seconds_of = [](const timeval& t) {
      return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    result.cpu_seconds = seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime);
    constexpr double kMegabytePerKibibyte = 1024e-6;  // ru_maxrss is in KiB
    result.peak_memory_MB = static_cast<double>(usage.ru_maxrss) * kMegabytePerKibibyte;
    if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
    result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 0;
    result.last_output = std::move(tail_);
    return result;
  }

 private:
  bool read_once() {
    std::array<char, 4096> block;
    const ssize_t n = read(output_, block.data(), block.size());
    if (n == 0) is_output_open_ = false;
    if (n <= 0) return false;
    const std::string_view text(block.data(), static_cast<std::size_t>(n));
    sink_(text);
    tail_ += text;
    if (tail_.size() > kTailBytes) tail_.erase(0, tail_.size() - kTailBytes);
    return true;
  }

  pid_t pid_ = -1;
  int output_ = -1;
  bool is_output_open_ = true;
  const Sink& sink_;
  std::string tail_;
};

}  // namespace

void watch_interrupts() { stage::watch_signals(stage::SecondSignal::is_noted); }

void throw_if_interrupted() {
  if (stage::is_stop_asked()) throw Interrupted("interrupted; finished stages are kept");
}

void print_on(std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = write(STDERR_FILENO, text.data(), text.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return;  // nobody listens any more: no reason to stop the work
    text.remove_prefix(static_cast<std::size_t>(n));
  }
}

ProcessResult run_process(const std::vector<std::string>& command, const ProcessLimits& limits, const Sink& sink) {
  throw_if_interrupted();
  const auto start = Clock::now();
  Child child(command, sink);
  std::optional<Clock::time_point> asked_to_end;
  auto exceeded = ProcessResult::Limit::none;
  while (!child.has_ended()) {
    child.listen();
    if (stage::is_stop_asked() && !asked_to_end) {
      asked_to_end = Clock::now();
      child.signal_group(SIGTERM);
    }
    if (asked_to_end && seconds_since(*asked_to_end) > kGrace_s) child.signal_group(SIGKILL);
    if (limits.seconds && seconds_since(start) > *limits.seconds) exceeded = ProcessResult::Limit::seconds;
    if (limits.memory_bytes && child.memory_bytes() > *limits.memory_bytes) exceeded = ProcessResult::Limit::memory;
    if (exceeded != ProcessResult::Limit::none) child.signal_group(SIGKILL);
  }
  ProcessResult result = child.result();
  result.seconds = seconds_since(start);
  if (result.signal) result.exceeded = exceeded;  // or else it ended by itself in the last moment
  throw_if_interrupted();
  return result;
}

std::string how_it_ended(const ProcessResult& result) {
  std::ostringstream text;
  if (result.exceeded == ProcessResult::Limit::memory)
    text << "took too much memory (" << std::lround(result.peak_memory_MB) << " MB)";
  else if (result.exceeded == ProcessResult::Limit::seconds)
    text << "timed out after " << brief(result.seconds) << " s";
  else if (result.signal)
    text << "killed by signal " << *result.signal << " (" << strsignal(*result.signal) << ")";
  else
    text << "exit code " << result.exit_code;
  return text.str();
}

int exit_code_of(const ProcessResult& result) {
  if (result.exceeded != ProcessResult::Limit::none) return exit_code::kResources;
  return result.signal ? 128 + *result.signal : result.exit_code;
}

std::string error_in(const std::string& output) {
  std::istringstream lines(output);
  std::string errors, last;
  for (std::string line; std::getline(lines, line);) {
    line.erase(0, line.rfind('\r') + 1);  // npos + 1 is 0; before it is a progress line that was overwritten
    if (line.starts_with("\033[K")) line.erase(0, 3);
    if (line.empty()) continue;
    if (!errors.empty() || line.find("error: ") != std::string::npos) errors += (errors.empty() ? "" : "\n") + line;
    last = line;
  }
  return errors.empty() ? last : errors;
}

std::filesystem::path executable_folder() { return std::filesystem::read_symlink("/proc/self/exe").parent_path(); }

}  // namespace mbtfm::runner
