#!/usr/bin/env bash
# Check the format, build what is not built yet and run the whole test suite. Arguments go to ctest, e.g.
# ./tests/run.sh -L unit, or -E '^long/' without the long tests.
set -euo pipefail
cd "$(dirname "$0")/.."
./cmake/install_packages.sh tests chromium clang-format doxygen imagemagick mkdocs mypy python3-numpy python3-pandas man-db r-base-core strace zsh fish  # for tests that skip where there is none
find continuum mbtfm network pipeline samples segment substrate tests -name '*.cpp' -o -name '*.h' -o -name '*.inc' |
  xargs clang-format --dry-run -Werror || { echo "mbtfm: run clang-format -i on these files" >&2; exit 1; }
cmake --preset release -DMBTFM_ALL=ON ${MBTFM_STRICT:+-DMBTFM_STRICT=$MBTFM_STRICT} >build-configure.log 2>&1 || { cat build-configure.log >&2; exit 1; }
mv build-configure.log build/configure.log
cmake --build build
cmake --build build --target docs
exec ctest --test-dir build --output-on-failure --no-tests=error -j "$(nproc)" "$@"
