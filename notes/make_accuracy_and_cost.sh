#!/usr/bin/env bash
# Make notes/presets.md (the presets) and notes/cost-tables.md (the cost studies of simulated
# cells). Run from the project's folder, built, on an idle machine: it counts processor time, which a busy machine
# lengthens, too. MINUTES (15) is the budget of each of the two cost studies; what was made before is kept in the work
# folder (build/accuracy-and-cost) and not made again.
set -euo pipefail
cd "$(dirname "$0")/.."
bin=$PWD/build/bin
work=${1:-build/accuracy-and-cost}
mkdir -p "$work" notes/images/cost

simulate() { # name, seed, more
  [ -d "$work/$1" ] || "$bin/mbtfm-simulate" --scenario u2os --seed "$2" --beads 10000 --quiet --out "$work/$1" "${@:3}"
}

# Of one cell with one preset: error of the tensions, its part from the beads' noise as stated, processor time and time
# passed from the first stage to the report.
run_preset() { # cell, preset
  local cell=$work/$1 cpu_and_passed
  rm -rf "${cell:?}"/[34]_* "$cell/run.json"
  [ ! -f "$cell/paxillin.tif" ] || rm -rf "${cell:?}"/[12]_*
  cpu_and_passed=$( { TIMEFORMAT='%U %S %R'; time "$bin/mbtfm" run --quiet --threads 2 --preset "$2" "$cell" 2>/dev/null; } 2>&1)
  echo "$("$bin/mbtfm" compare "$cell" | sed -n 's/.*|truth| = //p') $cpu_and_passed" | awk '{ print $1, $2 + $3, $4 }'
}

# Root mean square of the errors over several cells, and means of the times.
over_cells() { # preset, cells
  local preset=$1 cell
  shift
  for cell in "$@"; do run_preset "$cell" "$preset"; done |
    awk '{ e += $1 * $1; cpu += $2; passed += $3 } END { printf "%.3f %.1f %.1f", sqrt(e / NR), cpu / NR, passed / NR }'
}

preset_rows() {
  local preset demo imaged clean
  for preset in fast standard high; do
    demo=$(over_cells "$preset" demo)
    imaged=$(over_cells "$preset" imaged101 imaged102 imaged103 imaged104)
    clean=$(over_cells "$preset" clean101 clean102 clean103 clean104)
    awk -v name="$preset" -v d="$demo" -v i="$imaged" -v c="$clean" 'BEGIN {
      split(d, a, " "); split(i, b, " "); split(c, e, " ")
      printf "| `%s` | %s | %s | %s | %s | %s |\n", name, a[2], a[3], a[1], b[1], e[1] }'
  done
}

study() { # name, title, cells
  local name=$1 title=$2 cell
  shift 2
  for cell in "$@"; do [ -f "$work/$cell/run.json" ] || "$bin/mbtfm" run --quiet "$work/$cell"; done
  [ -f "$work/study_$name/cost.md" ] ||
    "$bin/mbtfm" cost --repeats 1 --budget "${MINUTES:-15}" --out "$work/study_$name" "${@/#/$work/}"
  cp "$work/study_$name/cost.svg" "notes/images/cost/$name.svg"
  sed -e "s|cost.svg|images/cost/$name.svg|" -e "s|^## .*|## $title|" "$work/study_$name/cost.md"
}

# A round cell in space on 72 um of gel, with its surface given.
simulate_in_space() { # name, noise
  [ -d "$work/$1" ] || {
    "$bin/mbtfm-simulate" --scenario patches-on-ring --pixel_size_um 0.25 --image_size_px 288 --beads 500 --seed 1 \
      --noise "$2" --quiet --out "$work/$1"
    mkdir "$work/$1/3_surface" && mv "$work/$1/surface.vtp" "$work/$1/3_surface/"
  }
  [ -f "$work/$1/run.json" ] || "$bin/mbtfm" run --quiet "$work/$1"
  [ -f "$work/study_$1/cost.csv" ] ||
    "$bin/mbtfm" cost --repeats 1 --budget "${MINUTES:-15}" --out "$work/study_$1" "$work/$1"
}

# Error of the map, of the total force, and processor time of the presets, of both noises.
space_rows() {
  local preset knob
  for preset in fast standard high; do
    knob="preset,$preset,"
    [ $preset = standard ] && knob="as it is,,"
    awk -F, -v knob="$knob" -v name="$preset" 'index($0, knob) == 1 {
      cell[++n] = sprintf(" %.0f | %.2f | %.0f %% |", $4, $13, 100 * $8) }
      END { printf "| `%s` |%s%s\n", name, cell[1], cell[2] }' "$work"/study_space2/cost.csv "$work"/study_space10/cost.csv
  done
}

simulate demo 1 --noise 0.07 --images
simulate_in_space space2 0.02
simulate_in_space space10 0.1
for seed in 101 102 103 104; do
  simulate "imaged$seed" "$seed" --noise 0.07 --images
  simulate "clean$seed" "$seed" --noise 0
done
for seed in 1 2 3; do
  simulate "imaged$seed" "$seed" --noise 0.07 --images
  simulate "clean$seed" "$seed" --noise 0
done

{
  cat <<'PAGE'
# Accuracy and cost: which preset

`--preset` sets how much the program computes for a cell. The default is `standard`.

```sh
mbtfm run CELL --preset fast      # a first look at many cells
mbtfm run CELL --preset high      # the figures of a paper
mbtfm run CELL --accuracy 5%      # the cheapest preset that finds the tensions to 5 %
mbtfm cost CELL                   # for this cell: what each setting gains and costs
```

## The presets

Times are from the images to the report, on two threads of a slow machine: seconds of the processors, and seconds that passed. The error is
‖t̂ − t‖/‖t‖: the difference of the fitted tensions from the true ones, over the true ones. It is given for the demo cell (7 % noise). The
last two columns are root mean squares over four other simulated cells: one from images with 7 % noise, one with exact beads on
the true segmentation. Only the last column shows what more computing can improve.

| preset | demo cell: processor (s) | passed (s) | error | from images, 7 % noise | no noise, true segmentation |
|---|---|---|---|---|---|
PAGE
  preset_rows
  cat <<'PAGE'

- `fast` tracks the beads on images of half the scale and fits two coarse meshes. Use it to find out whether the images are good.
- `standard` is right for most cells. The noise of the beads is then the larger part of the error.
- `high` takes the mean of many meshes. It helps if the beads are exact: strong cells, soft gels, many beads.

With noise, the presets differ little. For a single cell a coarser preset may come out better by luck.

## Cells in space

Presets and `mbtfm cost` work for [cells in space](../docs/curved-gels.md), too. `mbtfm cost` then runs the stage `traction` alone, and the error is that of the map of
tractions, ‖t̂ − t‖/‖t‖ over the surface, beside the truth or the finest choice. `--accuracy` is an error of fibre tensions and is refused.

| preset | distance of the tractions over that of the beads | elements of the gel |
|---|---|---|
| `fast` | 1.06 | growing twice as fast away from the cell, to 5 % |
| `standard` | 0.83 | to 2 % |
| `high` | 0.75 | to 2 % |

A round cell on 72 µm of gel (`patches-on-ring`, 500 beads, method `tikhonov`), with 2 and with 10 % noise: processor time of the stage `traction`, error of the map, error of the total force.

| preset | 2 % noise: s | map | total force | 10 % noise: s | map | total force |
|---|---|---|---|---|---|---|
PAGE
  space_rows
  cat <<'PAGE'

With noise a finer lattice shows no more. Its map may even be farther off, as more unknowns share the same data. What computing improves is `group-l1`, which is taken if
adhesions are given: its map is the nearer the finer the lattice is ([measured](tractions_in_space.md#meshes-of-the-gel-and-of-the-tractions)). `fast` is right for a first look at
hundreds of stacks. The lattice of `high` is bounded by 1 100 vertices.

## What computing cannot improve

Every fit writes an error budget into `fit.json` and `run.json`: which part of the error comes from the beads, the segmentation, the mesh
and so on. The report shows it. `--accuracy` uses this budget. If no preset can reach what you ask for, the program says why:

```
$ mbtfm run --accuracy 1% demo
PAGE
  "$bin/mbtfm" run --threads 2 --accuracy 1% "$work/demo" 2>&1 | grep '^mbtfm: tensions to' | fold -s -w 120
  cat <<'PAGE'
```

Then better data help: more beads, less noise, a softer gel ([plan an experiment](../docs/planning.md)).

This page is made by `notes/make_accuracy_and_cost.sh`. How well the budget agrees with observed errors, and what each
single setting costs, is in [cost tables](cost-tables.md).
PAGE
} >"$work/page.md"

{
  cat <<'PAGE'
# Cost tables

Made by `notes/make_accuracy_and_cost.sh`. Costs are seconds of processor time on two threads. Other programs on the machine lengthen
them far less than the time that passes. What each preset sets is in `pipeline/cost/presets.cpp`; what users need of this
is in [presets](presets.md).

## Do the parts of the error budget add up?

Root sums of squares (nN) over the fibres, or the cells' total forces, of simulated u2os cells with 7 % noise, whose seeds nothing
was chosen on: what was observed, what the budget stated ([theory](../docs/theory/errors.md#error-budget)), and its parts.
Seeds 101 to 110, from images 101 to 104. Measured with version 0.2 by a study that is no longer in the tree.

| | observed | stated | ratio | beads | segmentation | mesh | substrate | solver | model |
|---|---|---|---|---|---|---|---|---|---|
| tensions, true segmentation | 7.05 | 8.03 | 0.88 | 7.29 | 0.00 | 3.00 | 0.00 | 0.32 | 1.52 |
| total forces, true segmentation | 8.09 | 7.32 | 1.11 | 6.85 | 0.00 | 2.22 | 0.00 | 0.02 | 1.29 |
| tensions, from images | 5.12 | 5.10 | 1.00 | 4.14 | 1.52 | 1.59 | 0.00 | 0.05 | 1.99 |
| total forces, from images | 4.28 | 4.89 | 0.88 | 4.21 | 1.34 | 1.24 | 0.00 | 0.02 | 1.70 |

PAGE
  study clean "Beads without noise, true segmentation" clean1 clean2 clean3
  echo
  study noisy "Seven per cent of noise, from images" imaged1 imaged2 imaged3
} >"$work/tables.md"
cp "$work/page.md" notes/presets.md
cp "$work/tables.md" notes/cost-tables.md
