#!/usr/bin/env bash
# Simulate the demo cell (images and all), run every stage on it, and print the tensions beside the truth.
set -euo pipefail
cd "$(dirname "$0")/.."
./cmake/install_packages.sh
cmake --preset release >build-configure.log 2>&1 || { cat build-configure.log >&2; exit 1; }
mv build-configure.log build/configure.log
echo "mbtfm: building (a few minutes the first time)"
cmake --build build --target executables >build/build.log 2>&1 || { tail -n 40 build/build.log >&2; exit 1; }

exec ./build/bin/mbtfm demo build/demo/u2os
