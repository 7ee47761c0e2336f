#include "pipeline/contract/blas.h"

#include <dlfcn.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string_view>

namespace mbtfm {

namespace {

constexpr const char* kVariable = "OPENBLAS_CORETYPE";

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

}  // namespace

void keep_blas_to_one_thread() {
  static const auto set = reinterpret_cast<void (*)(int)>(dlsym(RTLD_DEFAULT, "openblas_set_num_threads"));
  if (set) set(1);
}

void restart_with_kernels_of_processor(char** argv) {
  const auto name = reinterpret_cast<const char* (*)()>(dlsym(RTLD_DEFAULT, "openblas_get_corename"));
  const char* wanted = kernels_of_processor();
  if (!name || !wanted || std::getenv(kVariable) || !is_outdated(name())) return;
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) return;
  setenv(kVariable, wanted, 1);
  execv(program.c_str(), argv);
  unsetenv(kVariable);  // where it cannot be started again, it is slow
}

}  // namespace mbtfm
