#!/usr/bin/env bash
# Make docs/accuracy-and-cost.md: the error budget against observed errors, the presets on the demo cell, and the cost
# studies of two simulated cells. Takes a quarter of an hour on two idle processors. Run from the project's folder, built.
set -euo pipefail
cd "$(dirname "$0")/.."
bin=$PWD/build/bin
work=${1:-build/accuracy-and-cost}
mkdir -p "$work" docs/images/cost

simulate() { [ -d "$work/$1" ] || "$bin/mbtfm-simulate" --scenario u2os --seed 1 --beads 10000 --quiet --out "$work/$1" "${@:2}"; }

budget_table() {  # first and last seed, more
  [ -f "$work/budget$1$3.csv" ] || (cd "$work" && "$OLDPWD/build/tests/error_budget" "$@" >"budget$1$3.csv")
  awk -F, -v what="$3" '/^(tensions|total forces),/ {
    printf "| %s, %s | %.2f | %.2f | %.2f |", $1, what == "" ? "true segmentation" : "from images", $2, $3, $4
    for (i = 6; i <= NF; ++i) printf " %.2f |", $i; print "" }' "$work/budget$1$3.csv"
}

preset_row() {
  local cell=$work/$1 before after
  rm -rf "${cell:?}"/[1-4]_* "$cell/run.json"
  before=$(date +%s.%N)
  local cpu
  cpu=$( { TIMEFORMAT='%U %S'; time "$bin/mbtfm" run --quiet --threads 2 --preset "$2" "$cell" 2>/dev/null; } 2>&1)
  after=$(date +%s.%N)
  local error
  error=$("$bin/mbtfm" compare "$cell" | sed -n 's/.*|truth| = //p')
  awk -v name="$2" -v error="$error" -v passed="$(echo "$after $before" | awk '{print $1 - $2}')" -v cpu="$cpu" \
    'BEGIN { split(cpu, t, " "); printf "| `%s` | %s | %.1f | %.1f |\n", name, error, t[1] + t[2], passed }'
}

study() {
  [ -f "$work/$1/run.json" ] || "$bin/mbtfm" run --quiet "$work/$1"
  [ -f "$work/$1/cost/cost.md" ] || "$bin/mbtfm" cost --repeats 1 --budget "${MINUTES:-15}" "$work/$1"
  cp "$work/$1/cost/cost.svg" "docs/images/cost/$1.svg"
  sed -e "s|cost.svg|images/cost/$1.svg|" -e "s|^## .*|## $2|" "$work/$1/cost/cost.md"
}

simulate noisy --noise 0.07
simulate clean --noise 0
simulate demo --noise 0.07 --images

{
  cat <<'PAGE'
# What accuracy costs in time

Made by `docs/make_accuracy_and_cost.sh`. Every fit writes an error budget ([theory](theory.md), section 3) into `fit.json` and
`run.json`. `mbtfm cost CELL` turns one knob at a time, for any cell, and says what it gains and costs. `mbtfm run --preset fast`
(`standard`, `high`) sets several together; `mbtfm run --accuracy 5%` takes the cheapest that the error budget finds accurate
enough, and says where bead noise, segmentation and the model's misfit make that impossible at any price.

## Do the parts add up?

Root sums of squares (nN) over the fibres, or the cells' total forces, of simulated u2os cells with 7 % noise, whose seeds nothing
was chosen on: what was observed, what the budget stated, and its parts. `build/tests/error_budget 101 110`, `… 101 104 images`.

| | observed | stated | ratio | beads | segmentation | mesh | substrate | solver | model |
|---|---|---|---|---|---|---|---|---|---|
PAGE
  budget_table 101 110 ""
  budget_table 101 104 images
  cat <<'PAGE'

## The presets on the demo cell

From the images to the report, two threads; the error is ‖t̂ − t‖/‖t‖ against the truth.

| preset | error of the tensions | processor (s) | passed (s) |
|---|---|---|---|
PAGE
  for preset in fast standard high; do preset_row demo "$preset"; done
  echo
  study clean "Beads without noise"
  echo
  study noisy "Seven per cent of noise"
} >"$work/page.md"
cp "$work/page.md" docs/accuracy-and-cost.md
