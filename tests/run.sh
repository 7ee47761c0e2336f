#!/usr/bin/env bash
# Build everything and run the whole test suite. Arguments go to ctest, e.g. ./tests/run.sh -L unit
set -euo pipefail
cd "$(dirname "$0")/.."
./cmake/install_packages.sh chromium  # to look at the pages; those tests skip where there is none
cmake --preset release >build-configure.log 2>&1 || { cat build-configure.log >&2; exit 1; }
mv build-configure.log build/configure.log
cmake --build build
exec ctest --test-dir build --output-on-failure --no-tests=error -j "$(nproc)" "$@"
