/// The linear algebra library's own threads and kernels.
#pragma once

namespace mbtfm {

/// The BLAS' own threads off: ours share its work, and other numbers of them round differently, as they would on a
/// machine of more processors or under OPENBLAS_NUM_THREADS. Does nothing where there is no OpenBLAS in the process.
void keep_blas_to_one_thread();

/// An OpenBLAS that is older than the processor takes kernels for processors of 2004, which are ten times slower than
/// those for the vectors that this one has (OpenBLAS 0.3.21 of Debian 12, processors of 2023 on). It chooses as it is
/// loaded and listens to the environment alone, so the program is started again with OPENBLAS_CORETYPE set. Returns
/// where there is nothing to mend, or the variable is set already.
void restart_with_kernels_of_processor(char** argv);

}  // namespace mbtfm
