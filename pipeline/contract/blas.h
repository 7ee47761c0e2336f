/// The linear algebra library's own threads.
#pragma once

namespace mbtfm {

/// The BLAS' own threads off: ours share its work, and other numbers of them round differently, as they would on a
/// machine of more processors or under OPENBLAS_NUM_THREADS. Does nothing where there is no OpenBLAS in the process.
void keep_blas_to_one_thread();

}  // namespace mbtfm
