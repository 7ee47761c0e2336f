#include "pipeline/contract/blas.h"

#include <dlfcn.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/contract/csv.h"
#include "pipeline/contract/errors.h"

namespace mbtfm {

namespace {

constexpr const char* kThreadsVariable = "OPENBLAS_NUM_THREADS";

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

}  // namespace

void keep_blas_to_one_thread() {
  static const auto set = symbol<void(int)>("openblas_set_num_threads");
  if (set) set(1);
}

void restart_without_blas_threads(char** argv) {
  rlimit limit{};
  const char* threads = std::getenv(kThreadsVariable);
  if (!symbol<void(int)>("openblas_set_num_threads")) return;
  if (!is_address_space_limited(limit) || (threads && std::string_view(threads) == "1")) return;
  setenv(kThreadsVariable, "1", 1);
  execv("/proc/self/exe", argv);  // where that fails, reserve_blas_buffers tells
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

}  // namespace mbtfm
