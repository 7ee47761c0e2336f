#include "pipeline/stage/console.h"

#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <iomanip>
#include <sstream>

#include "pipeline/contract/errors.h"

namespace mbtfm::stage {

namespace {

std::atomic<bool> was_asked = false;
extern "C" void note_signal(int) { was_asked = true; }

bool is_ignored(int signal) {
  struct sigaction now {};
  return sigaction(signal, nullptr, &now) == 0 && now.sa_handler == SIG_IGN;
}

[[noreturn]] void end_by_broken_pipe() {
  std::signal(SIGPIPE, SIG_DFL);
  std::raise(SIGPIPE);
  _exit(128 + SIGPIPE);  // it was blocked
}

}  // namespace

void print(std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = write(STDOUT_FILENO, text.data(), text.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0 && errno == EPIPE) end_by_broken_pipe();
    if (n <= 0) throw OutputError(std::string("cannot write to standard output: ") + std::strerror(errno));
    text.remove_prefix(static_cast<std::size_t>(n));
  }
}

bool is_terminal() { return isatty(STDERR_FILENO) != 0 || std::getenv("MBTFM_TERMINAL") != nullptr; }

std::string warning(const std::string& text) {
  constexpr std::string_view kWithoutColours = "dumb";
  const char* no_color = std::getenv("NO_COLOR");
  const char* terminal = std::getenv("TERM");
  const bool is_plain = !is_terminal() || (no_color != nullptr && *no_color != '\0') ||
                        (terminal != nullptr && terminal == kWithoutColours);
  return is_plain ? text : "\033[33m" + text + "\033[0m";
}

std::string readable_duration(double seconds) {
  constexpr double kMinute = 60, kHour = 3600;
  std::ostringstream text;
  if (seconds < 1.5 * kMinute)
    text << std::lround(seconds) << " s";
  else if (seconds < 1.5 * kHour)
    text << std::lround(seconds / kMinute) << " min";
  else
    text << std::fixed << std::setprecision(1) << seconds / kHour << " h";
  return text.str();
}

Reader reader(bool is_quiet, bool is_json) {
  if (is_json) return Reader::program;
  if (is_quiet) return Reader::nobody;
  const char* runner = std::getenv(kRunnerVariable);
  if (runner == nullptr) return Reader::person;
  return std::string_view(runner) == kForProgram ? Reader::json_runner : Reader::runner;
}

void watch_signals(SecondSignal second) {
  struct sigaction action {};
  action.sa_handler = note_signal;
  if (second == SecondSignal::ends_at_once) action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  if (!is_ignored(SIGHUP)) sigaction(SIGHUP, &action, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
}

bool is_stop_asked() { return was_asked; }

}  // namespace mbtfm::stage
