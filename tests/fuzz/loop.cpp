/// Runs a fuzz target over the inputs that once broke it and over changed samples.
///
/// MBTFM_FUZZ_INPUTS sets the number of changed samples (for an hour or a night), MBTFM_FUZZ_SEED the seed. An input
/// that breaks a reader is kept as fuzz-FAMILY-SEED-NUMBER in the build folder's tests/.
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <unistd.h>
#include <csignal>

#include "tests/fuzz/mutate.h"
#include "tests/fuzz/target.h"
#include "tests/support/folders.h"
#include "tests/support/test.h"

#if defined(__SANITIZE_ADDRESS__)
#define MBTFM_HAS_ASAN 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define MBTFM_HAS_ASAN 1
#endif
#endif
#ifdef MBTFM_HAS_ASAN
extern "C" void __sanitizer_set_death_callback(void (*)(void));
#endif

namespace mbtfm::fuzz {
namespace {

constexpr time_t kHang_s = 5;  // of the processor: a busy machine may let any input wait
constexpr rlim_t kMemory_bytes = rlim_t{1} << 30;

/// What is being read, for a handler that may not allocate.
struct Current {
  char file[512] = "";
  const char* bytes = nullptr;
  std::size_t n = 0;
} current;

void keep_input() {
  const int descriptor = open(current.file, O_WRONLY | O_CREAT | O_TRUNC, 0666);
  if (descriptor < 0) return;
  [[maybe_unused]] auto n = write(descriptor, current.bytes, current.n);
  close(descriptor);
  for (const char* text : {"broken by the input kept as ", static_cast<const char*>(current.file), "\n"})
    n = write(STDERR_FILENO, text, std::char_traits<char>::length(text));
}

void on_signal(int signal) {
  keep_input();
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

void set_clock(time_t seconds) {
  const itimerval clock{.it_value = {.tv_sec = seconds, .tv_usec = 0}};
  setitimer(ITIMER_PROF, &clock, nullptr);
}

void watch() {
  std::signal(SIGPROF, on_signal);
#ifdef MBTFM_HAS_ASAN
  __sanitizer_set_death_callback(keep_input);
#else
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGABRT, SIGILL}) std::signal(signal, on_signal);
  std::size_t n_pages = 0;
  std::ifstream("/proc/self/statm") >> n_pages;
  const rlim_t limit = n_pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + kMemory_bytes;
  const rlimit memory{limit, limit};
  setrlimit(RLIMIT_AS, &memory);
#endif
}

std::uint64_t number_of(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);
  return text ? std::strtoull(text, nullptr, 10) : otherwise;
}

/// False where it broke a reader.
bool is_answered(const Target& target, const std::string& input, const std::string& called) {
  std::snprintf(current.file, sizeof current.file, "%s/tests/fuzz-%s", test::build_folder().c_str(), called.c_str());
  current.bytes = input.data();
  current.n = input.size();
  std::string thrown;
  set_clock(kHang_s);
  try {
    target.read(input);
  } catch (const std::exception& error) {
    thrown = error.what();
  }
  set_clock(0);
  if (thrown.empty()) return true;
  keep_input();
  ADD_FAILURE() << called << ": expected an InputError or none, found " << thrown;
  return false;
}

std::vector<fs::path> kept_inputs(const Target& target) {
  std::vector<fs::path> files;
  const fs::path kept = test::source_folder() / "tests/fuzz/regression" / target.family;
  if (fs::is_directory(kept))
    for (const auto& entry : fs::directory_iterator(kept)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

class Fuzz : public testing::TestWithParam<Target> {};

TEST_P(Fuzz, what_once_broke_a_reader_is_read_or_refused) {
  watch();
  for (const fs::path& file : kept_inputs(GetParam()))
    is_answered(GetParam(), bytes_of(file), GetParam().family + ("-" + file.filename().string()));
}

TEST_P(Fuzz, changed_samples_are_read_or_refused) {
  const Target& target = GetParam();
  watch();
  std::vector<std::string> seeds = target.samples();
  for (const fs::path& file : kept_inputs(target)) seeds.push_back(bytes_of(file));
  const std::uint64_t seed = number_of("MBTFM_FUZZ_SEED", 1);
  const std::uint64_t n_inputs = number_of("MBTFM_FUZZ_INPUTS", target.n_inputs);
  Mutator mutator(seeds, seed);
  constexpr int kEnough = 5;  // broken inputs to look at
  int n_broken = 0;
  for (std::uint64_t i = 0; i < n_inputs && n_broken < kEnough; ++i) {
    const std::string called = std::string(target.family) + "-" + std::to_string(seed) + "-" + std::to_string(i);
    n_broken += !is_answered(target, mutator.next(), called);
  }
}

// in main, after each target has added itself
INSTANTIATE_TEST_SUITE_P(Readers, Fuzz, testing::ValuesIn(targets()),
                         [](const auto& target) { return std::string(target.param.family); });

}  // namespace
}  // namespace mbtfm::fuzz
