#!/bin/sh
# Make notes/images/validation/calibration.svg (thesis fig. 3.8 and 3.9): simulated cells, fitted, beside FTTC.
#
#   notes/make_calibration.sh [CELLS] [FOLDER]
#
# Needs build/bin. Cells of one mesh and 4 000 beads: the total force hangs on neither.
set -eu

notes=$(cd "$(dirname "$0")" && pwd)
bin=$notes/../build/bin
cells=${1:-8}
folder=${2:-$(mktemp -d)}
for seed in $(seq 1 "$cells"); do
  "$bin/mbtfm-simulate" --scenario u2os --seed "$seed" --noise 0.07 --beads 4000 --quiet --out "$folder/cell$seed"
  printf '\n[fit]\nn_meshes = 1\n' >> "$folder/cell$seed/cell.toml"
  "$bin/mbtfm" run "$folder/cell$seed"
done
"$bin/mbtfm-calibrate" --cells "$folder" --out "$folder/calibration.csv"
cp "$folder/calibration.svg" "$notes/images/validation/calibration.svg"
