#!/usr/bin/env bash
# The hard cases (ctest label stability) in each mode: optimised, with traps where a NaN or an infinity is made, under
# the address and undefined-behaviour sanitizers, under the thread sanitizer.
#   tests/modes.sh [release|traps|asan-ubsan|tsan]...
# CMAKE_BUILD_PARALLEL_LEVEL and CTEST_PARALLEL_LEVEL share a machine with others.
set -euo pipefail
cd "$(dirname "$0")/.."
modes=("$@")
[ $# -gt 0 ] || modes=(release traps asan-ubsan tsan)

build() {
  cmake --preset "$1" >/dev/null
  cmake --build --preset "$1" --target stability_tests
}

hard_cases() {
  ctest --test-dir "$1" -L stability --output-on-failure --no-tests=error -j "${CTEST_PARALLEL_LEVEL:-$(nproc)}"
}

for mode in "${modes[@]}"; do
  echo "== $mode"
  case $mode in
    release) build release && MBTFM_SCENES=20 hard_cases build ;;
    traps) build release && MBTFM_SCENES=20 LD_PRELOAD=$PWD/build/tests/libmbtfm_fp_traps.so hard_cases build ;;
    # the sanitizers take five to ten times as long: fewer random scenes
    # up to GCC 13 the leak check takes some thread-local blocks of libraries loaded at run time, as deal.II is, for
    # those of glibc before 2.25, and dies of what it reads there (github.com/google/sanitizers/issues/1322)
    asan-ubsan) build asan-ubsan && MBTFM_SCENES=3 ASAN_OPTIONS=intercept_tls_get_addr=0 \
      UBSAN_OPTIONS=print_stacktrace=1 hard_cases build-asan ;;
    # OpenBLAS's own threads are not seen, and OpenCV's loops only in threads of ours
    tsan) build tsan && MBTFM_SCENES=3 OPENBLAS_NUM_THREADS=1 LD_PRELOAD=$PWD/build-tsan/tests/libmbtfm_cv_threads.so \
      TSAN_OPTIONS="suppressions=$PWD/tests/support/tsan.supp halt_on_error=1" hard_cases build-tsan ;;
    *) echo "unknown mode '$mode': release, traps, asan-ubsan, tsan" >&2; exit 2 ;;
  esac
done
