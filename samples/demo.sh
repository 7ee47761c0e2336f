#!/usr/bin/env bash
# Simulate the demo cell (images and all), run every stage on it, and print the tensions beside the truth.
set -euo pipefail
cd "$(dirname "$0")/.."
./cmake/install_packages.sh
# Sources of a library are compiled together, so that their headers are read once.
cmake --preset release -DCMAKE_UNITY_BUILD=ON >build-configure.log 2>&1 || { cat build-configure.log >&2; exit 1; }
mv build-configure.log build/configure.log
echo "mbtfm: building (the first time fifteen to twenty minutes on two cores; log: build/build.log)"
# one line that counts the steps, on a terminal
count() {
  if [ ! -t 1 ]; then cat >/dev/null; return; fi
  while IFS= read -r line; do
    case $line in \[*/*\]*) printf '\rmbtfm: step %s ' "${line%%]*}]" ;; esac
  done
  printf '\n'
}
cmake --build build --target executables 2>&1 | tee build/build.log | count || { tail -n 40 build/build.log >&2; exit 1; }

exec ./build/bin/mbtfm demo build/demo/u2os
