#!/usr/bin/env bash
# Without deal.II, which conda-forge builds against other libraries. The charts of the reports need the folder of Debian's
# libjs-vega (5.22), which conda-forge has not: VEGA_FOLDER and VEGA_LICENCE name it.
set -euo pipefail
cmake -S . -B build -G Ninja ${CMAKE_ARGS} -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_LIBDIR=lib \
  -DMBTFM_TESTS=OFF -DMBTFM_WITH_DEALII=OFF -DVEGA_FOLDER="${VEGA_FOLDER:?}" -DVEGA_LICENCE="${VEGA_LICENCE:?}"
cmake --build build
cmake --install build
