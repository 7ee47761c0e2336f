/// The linear algebra library's own threads and memory. Without effect where there is no OpenBLAS in the process.
#pragma once

namespace mbtfm {

/// The BLAS' own threads off: ours share its work, and other numbers of them round differently, as they would on a
/// machine of more processors or under OPENBLAS_NUM_THREADS.
void keep_blas_to_one_thread();

/// Where the address space is limited (ulimit -v), each of these threads, which start before any of our code, asks the
/// system for its buffer again and again for ever: the program then starts itself once more without them.
void restart_without_blas_threads(char** argv);

/// Where the address space is limited, take the buffers that the BLAS needs for calls from so many threads now, while
/// there is room: asked for later in vain, it would wait for ever.
/// @throws OutOfMemory where there is no room
void reserve_blas_buffers(int threads);

}  // namespace mbtfm
