#!/usr/bin/env bash
# Which units does the compiler take longest for? Compiles all programs, without a cache, one unit at a time, and prints the
# sum and the twenty dearest: processor seconds, unit. Arguments go to cmake (-DCMAKE_UNITY_BUILD=OFF: each source by itself).
set -euo pipefail
if [ "${1:-}" = --launch ]; then  # as the compiler's launcher: append seconds and unit to the file named
  log=$2 unit=
  shift 2
  for ((i = 1; i < $#; i++)); do [ "${!i}" = -o ] && { ((i++)); unit=${!i}; break; }; done
  TIMEFORMAT="%U %S $unit"
  { time "$@" 2>&3; } 3>&2 2>>"$log"
  exit
fi
cd "$(dirname "$0")/.."
build=build-times log=$PWD/build-times/seconds
rm -rf $build
cmake --preset release -B $build -DMBTFM_TESTS=OFF -DCCACHE="$PWD/tests/compile_times.sh;--launch;$log" "$@" >/dev/null
cmake --build $build --target executables -j 1 >/dev/null
awk '{printf "%.1f %s\n", $1 + $2, $3}' "$log" | sort -rn >"$log.sorted"
awk '{sum += $1} END {printf "%.0f processor seconds in %d units\n", sum, NR}' "$log.sorted"
head -n 20 "$log.sorted"
