#!/usr/bin/env bash
# Make the numbers of docs/validation.md, "Forces in space": the scenes of the thesis' chapter 2, with exact fields.
# Run from the project's folder, built; takes some ten minutes of one processor. docs/make_validation_in_space.sh [WORK_FOLDER]
set -euo pipefail
cd "$(dirname "$0")/.."
work=${1:-build/validation_in_space}
mkdir -p "$work"
simulate() { # folder, scenario and more
  [ -d "$work/$1" ] || build/bin/mbtfm-simulate --quiet --scenario "${@:2}" --noise 0 --out "$work/$1"
}
simulate ring patches-on-ring
simulate ring-beads-on-top patches-on-ring --bead_depth_um 0.5
simulate wave wave
for rows in noise losses; do
  for scene in ring wave; do
    echo "== $rows, $scene (figs. $([ $scene = ring ] && echo 2.5 to 2.9 || echo 2.11 and 2.12))"
    build/tests/tractions_in_space $rows "$work" $scene
  done
done
echo "== beside FTTC (fig. 2.10)"
build/tests/tractions_in_space fttc "$work" ring-beads-on-top
