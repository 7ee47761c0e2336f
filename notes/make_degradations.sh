#!/usr/bin/env bash
# Make notes/degradations.md: three simulated cells, degraded in each way, and twenty that are sound. Run from the
# project's folder, built; takes some seventy minutes of one processor. What was made before is kept in the work folder
# (build/degradations).
set -euo pipefail
cd "$(dirname "$0")/.."
work=${1:-build/degradations}
mkdir -p "$work"
table() { # name, first seed, number of cells, names
  [ -s "$work/$1.csv" ] || (build/tests/degradations "$work/cells" "${@:2}" >"$work/$1.part" && mv "$work/$1.part" "$work/$1.csv")
}
table sound 41 20 sound
table degraded 61 3 "$(build/tests/degradations | sed -n 's/^| `\([^`]*\)`.*/\1/p' | grep -vx sound | paste -sd,)"
{ cat "$work/sound.csv"; tail -qn +2 "$work/degraded.csv"; } >"$work/all.csv"
build/tests/degradations page "$work/all.csv" >notes/degradations.md
