#!/usr/bin/env bash
# Make docs/resolution.md with its picture and tables: simulated cells and pairs of adhesions over density and noise.
# Run from the project's folder, built; takes some ten minutes of processor time.
set -euo pipefail
cd "$(dirname "$0")/.."
build/tests/resolution docs
