#!/usr/bin/env bash
# Check the format, build everything with warnings as errors, and run the whole test suite. Arguments go to ctest,
# e.g. ./tests/run.sh -L unit, or -E '^long/' without the long tests. MBTFM_TIDY=1: clang-tidy on the sources that
# differ from origin/main, too.
set -euo pipefail
cd "$(dirname "$0")/.."
./cmake/install_packages.sh chromium clang-format doxygen imagemagick mkdocs mypy python3-numpy python3-pandas man-db r-base-core strace zsh fish  # for tests that skip where there is none
find continuum mbtfm network pipeline samples segment substrate tests -name '*.cpp' -o -name '*.h' -o -name '*.inc' |
  xargs clang-format --dry-run -Werror || { echo "mbtfm: run clang-format -i on these files" >&2; exit 1; }
# Sources of a library are compiled together, and what most tests include is read once: for machines without a cache. The
# compiler's own memory is not tidied below 2 GB, which takes a sixteenth of its time.
cmake --preset release -DMBTFM_STRICT=ON -DCMAKE_UNITY_BUILD=ON -DMBTFM_PRECOMPILED=ON -DCMAKE_CXX_FLAGS="--param ggc-min-heapsize=2000000" >build-configure.log 2>&1 || { cat build-configure.log >&2; exit 1; }
mv build-configure.log build/configure.log
cmake --build build
cmake --build build --target docs
if [ -n "${MBTFM_TIDY:-}" ]; then
  git diff --name-only --diff-filter=d origin/main -- '*.cpp' | xargs -r clang-tidy -p build --quiet
fi
exec ctest --test-dir build --output-on-failure --no-tests=error -j "$(nproc)" "$@"
