#!/usr/bin/env bash
# Do two builds give the same outputs, byte by byte? For changes of the code that must not change what it computes.
#   tests/same_outputs.sh OLD_BUILD NEW_BUILD [FOLDER_OF_CELLS]...
# The demo cell, a batch of three cells and each folder of cells that is named are made by OLD_BUILD and run with both.
# Times, memory and versions in records, and what is drawn of them (report.html, run.log, batch.csv) do not count.
set -euo pipefail
[ $# -ge 2 ] || { sed -n '2,5s/^# //p' "$0" >&2; exit 2; }
old=$(realpath "$1") new=$(realpath "$2")
shift 2
scratch=$(mktemp -d "${TMPDIR:-/tmp}/mbtfm-same.XXXXXX")
trap 'rm -rf "$scratch"' EXIT

simulate() { "$old/bin/mbtfm-simulate" --quiet --images "$@"; }
mkdir "$scratch/old"
simulate --scenario u2os --seed 1 --noise 0.07 --beads 10000 --out "$scratch/old/demo"
for seed in 2 3 4; do simulate --scenario two-adhesions --seed $seed --noise 0.1 --beads 1000 --out "$scratch/old/batch/$seed"; done
for folder in "$@"; do cp -rL "$folder" "$scratch/old/$(basename "$folder")"; done
cp -r "$scratch/old" "$scratch/new"

for build in old new; do
  for command in batch stats; do
    if ! "${!build}/bin/mbtfm" $command "$scratch/$build" >"$scratch/$build.log" 2>&1; then
      tail -n 5 "$scratch/$build.log" >&2
      echo "mbtfm $command did not end well with the $build build" >&2
      exit 1
    fi
  done
  find "$scratch/$build" -name record.json -exec sed -i -E '/"(seconds|peak_memory_MB|version|started|ended|processor|error_budget_s)":/d' {} +
done
differ=$(cd "$scratch" && diff -rq old new | grep -vE '(run\.json|report\.html|run\.log|batch(_all)?\.csv|\.mbtfm\.hashes|profile\.html) ' || true)
files=$(find "$scratch/old" -type f | wc -l)
if [ -n "$differ" ]; then
  echo "$differ"
  exit 1
fi
echo "$files files, those that count are the same"
