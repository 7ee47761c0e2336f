#!/usr/bin/env bash
# Without deal.II, which conda-forge builds against other libraries.
set -euo pipefail
cmake -S . -B build -G Ninja ${CMAKE_ARGS} -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_LIBDIR=lib \
  -DMBTFM_TESTS=OFF -DMBTFM_WITH_DEALII=OFF
cmake --build build
cmake --install build
