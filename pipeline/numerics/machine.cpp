#include "pipeline/numerics/machine.h"

#include <dlfcn.h>
#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <vector>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::numerics {

namespace {

constexpr const char *kThreadsVariable = "OPENBLAS_NUM_THREADS", *kKernelsVariable = "OPENBLAS_CORETYPE";

template <class Function>
Function* symbol(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_DEFAULT, name));
}

bool is_address_space_limited(rlimit& limit) {
  return getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY;
}

double address_space_taken() {
  std::ifstream statm("/proc/self/statm");
  double pages = 0;
  statm >> pages;
  return pages * static_cast<double>(sysconf(_SC_PAGESIZE));
}

/// Without vectors of 256 bits.
bool is_outdated(std::string_view kernels) {
  for (const std::string_view name : {"Prescott", "Core2", "Penryn", "Dunnington", "Nehalem", "Generic", "Katmai"})
    if (kernels == name) return true;
  return false;
}

/// The fastest that this processor has vectors for; null: none beyond those of 2004.
const char* kernels_of_processor() {
#if defined(__x86_64__) && defined(__GNUC__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw") &&
      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512cd"))
    return "SkylakeX";
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return "Haswell";
#endif
  return nullptr;
}

/// @returns whether there was something to ask for, as of the next one
bool ask_for_kernels() {
  const auto name = symbol<char*()>("openblas_get_corename");
  const char* wanted = kernels_of_processor();
  if (!name || !wanted || std::getenv(kKernelsVariable) || !is_outdated(name())) return false;
  return setenv(kKernelsVariable, wanted, 1) == 0;
}

bool ask_for_one_thread() {
  rlimit limit{};
  const char* threads = std::getenv(kThreadsVariable);
  if (!is_address_space_limited(limit) || (threads && std::string_view(threads) == "1")) return false;
  return setenv(kThreadsVariable, "1", 1) == 0;
}

}  // namespace

void keep_blas_to_one_thread() {
  static const auto set = symbol<void(int)>("openblas_set_num_threads");
  if (set) set(1);
}

void restart_as_blas_needs(char** argv) {
  if (!symbol<void(int)>("openblas_set_num_threads")) return;
  const bool is_mended = ask_for_kernels() | ask_for_one_thread();
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  if (is_mended && !error) execv(program.c_str(), argv);
  // if that fails, it is slow, or reserve_blas_buffers reports it
}

void reserve_blas_buffers(int threads) {
  rlimit limit{};
  const auto take = symbol<void*(int)>("blas_memory_alloc");
  const auto give_back = symbol<void(void*)>("blas_memory_free");
  if (!take || !give_back || !is_address_space_limited(limit)) return;
  constexpr double kBuffer = 128 * 1024 * 1024;  // OpenBLAS 0.3 on x86-64, as seen in its calls of mmap
  const double given = static_cast<double>(limit.rlim_cur);
  const double needed = address_space_taken() + kBuffer * threads;
  if (needed > given) {
    throw OutOfMemory("memory is limited to " + brief(1e-6 * given) +
                      " MB of addresses (ulimit -v); the program takes " + brief(1e-6 * needed) +
                      " MB to begin with on " + std::to_string(threads) +
                      " threads: allow more, or ask for fewer --threads");
  }
  std::vector<void*> buffers;
  for (int i = 0; i < threads; ++i) buffers.push_back(take(0));
  for (void* buffer : buffers) give_back(buffer);  // to its pool: they stay mapped
}

std::string processor_name() {
  std::ifstream cpuinfo("/proc/cpuinfo");
  for (std::string line; std::getline(cpuinfo, line);) {
    const auto colon = line.find(": ");
    if (line.starts_with("model name") && colon != line.npos) return line.substr(colon + 2);
  }
  utsname system{};
  return uname(&system) == 0 ? system.machine : "unknown";
}

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[sizeof "2026-01-31T23:59:58Z"];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc)};
}

}  // namespace mbtfm::numerics
