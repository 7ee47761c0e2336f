#include "pipeline/contract/blas.h"

#include <dlfcn.h>

namespace mbtfm {

void keep_blas_to_one_thread() {
  static const auto set = reinterpret_cast<void (*)(int)>(dlsym(RTLD_DEFAULT, "openblas_set_num_threads"));
  if (set) set(1);
}

}  // namespace mbtfm
