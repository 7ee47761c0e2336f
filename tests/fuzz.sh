#!/usr/bin/env bash
# Reads damaged files with every reader, under the address and undefined-behaviour sanitizers: with clang and its
# libFuzzer where they are installed (Debian: clang, libclang-rt-14-dev), else with GCC and the suite's own loop.
#   tests/fuzz.sh [FAMILY]...      csv, field, vtu, surface, settings, records, image, ome, roi; all without one
# MBTFM_FUZZ_INPUTS: how many inputs by family (a million), MBTFM_FUZZ_LONGEST: their most bytes (8192). How many are done is
# told at powers of two and in the build folder's tests/fuzz-FAMILY.log; what breaks a reader is kept beside it.
set -euo pipefail
cd "$(dirname "$0")/.."
families=("$@")
[ $# -gt 0 ] || families=(csv field vtu surface settings records image ome roi)
inputs=${MBTFM_FUZZ_INPUTS:-1000000}
export UBSAN_OPTIONS=print_stacktrace=1
# freed memory is watched for 16 MB, not 256, which the limit of memory would count; stacks are asked of a kept input
export ASAN_OPTIONS=${ASAN_OPTIONS:-malloc_context_size=2:quarantine_size_mb=16}

if echo 'extern "C" int LLVMFuzzerTestOneInput(const char*, unsigned long) { return 0; }' |
    clang++ -x c++ -fsanitize=fuzzer - -o /dev/null 2>/dev/null; then
  build=build-fuzz
  cmake --preset fuzz >/dev/null
else
  build=build-asan
  cmake --preset asan-ubsan >/dev/null
fi

failed=()
for family in "${families[@]}"; do
  echo "== $family"
  if [ $build = build-fuzz ]; then
    cmake --build $build --target fuzzer
    export MBTFM_FUZZ_FAMILY=$family MBTFM_FUZZ_CORPUS=$build/tests/corpus-$family
    mkdir -p "$MBTFM_FUZZ_CORPUS"
    # libFuzzer reads its corpus after the target has put the samples there. Its clock is the wall's: on a busy machine
    # an input of a millisecond waits 5 s for the processor. Inputs above 5 s are told and kept, above 60 s they fail.
    # Samples have 0.1 to 7 kB; what longer inputs add is a repetition that costs most of the time.
    "$build/tests/fuzzer" -runs="$inputs" -timeout=60 -report_slow_units=5 -malloc_limit_mb=1024 -rss_limit_mb=2048 \
      -max_len="${MBTFM_FUZZ_LONGEST:-8192}" -print_final_stats=1 -artifact_prefix="$build/tests/$family-" "$MBTFM_FUZZ_CORPUS" 2>&1 |
      tee "$build/tests/fuzz-$family.log" | grep -vE '^#[0-9]+[[:space:]]+(NEW|REDUCE|RELOAD)|NEW_FUNC' || failed+=("$family")
  else
    cmake --build $build --target fuzz_tests
    MBTFM_FUZZ_INPUTS=$inputs "$build/tests/fuzz_tests" --gtest_filter="*/Fuzz.*/$family" || failed+=("$family")
  fi
done
[ ${#failed[@]} -eq 0 ] || { echo "broken: ${failed[*]}" >&2; exit 1; }
