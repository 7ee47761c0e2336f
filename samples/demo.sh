#!/usr/bin/env bash
# Simulate the demo cell (images and all), run every stage on it, and print the tensions beside the truth. Builds what a cell
# needs; --all: all programs.
set -euo pipefail
cd "$(dirname "$0")/.."
purpose=cell all=OFF target="what a cell needs"
if [ "${1:-}" = --all ] || grep -qs '^MBTFM_ALL:BOOL=ON' build/CMakeCache.txt; then  # once all, always all
  purpose=all all=ON target="all programs"
fi
./cmake/install_packages.sh $purpose
cmake --preset release -DMBTFM_ALL=$all >build-configure.log 2>&1 || { cat build-configure.log >&2; exit 1; }
mv build-configure.log build/configure.log
echo "mbtfm: building $target (log: build/build.log)"
# one line that counts the steps, on a terminal
count() {
  if [ ! -t 1 ]; then cat >/dev/null; return; fi
  local step n
  while IFS= read -r line; do
    case $line in
      \[*/*\]*)
        step=${line#\[} n=${step#*/} step=${step%%/*} n=${n%%\]*}
        printf '\rmbtfm: step %s of %s, about %s minutes left   ' "$step" "$n" $(((SECONDS * (n - step) / step + 59) / 60)) ;;
    esac
  done
  printf '\n'
}
SECONDS=0
cmake --build build --target executables 2>&1 | tee build/build.log | count || { tail -n 40 build/build.log >&2; exit 1; }

exec ./build/bin/mbtfm demo build/demo/u2os
