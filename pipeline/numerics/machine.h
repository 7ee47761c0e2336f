/// The machine that a program runs on: what records say of it, and what its linear algebra library needs (without
/// effect where there is no OpenBLAS in the process).
#pragma once

#include <string>

namespace mbtfm::numerics {

/// The processor's name as the system has it ("AMD EPYC 7B13"); the architecture where it has none.
std::string processor_name();

/// The time now, UTC, as ISO 8601 has it: 2026-01-31T23:59:58Z.
std::string utc_now();

/// The BLAS' own threads off: ours share its work, and other numbers of them round differently, as they would on a
/// machine of more processors or under OPENBLAS_NUM_THREADS.
void keep_blas_to_one_thread();

/// OpenBLAS chooses its kernels and starts its threads as it is loaded, before any of our code, and listens to the
/// environment alone: where it chose badly, the program starts itself once more. To be called first.
/// - One that is older than the processor takes kernels for processors of 2004, ten times slower than those for the
///   vectors that this one has (0.3.21 of Debian 12 on processors of 2023 and later): OPENBLAS_CORETYPE, if not set.
/// - Where the address space is limited (ulimit -v), each of its threads asks the system for its buffer again and again
///   for ever: OPENBLAS_NUM_THREADS.
void restart_as_blas_needs(char** argv);

/// Where the address space is limited, take the buffers that the BLAS needs for calls from so many threads now, while
/// there is room: asked for later in vain, it would wait for ever.
/// @throws OutOfMemory where there is no room
void reserve_blas_buffers(int threads);

}  // namespace mbtfm::numerics
