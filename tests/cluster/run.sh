#!/usr/bin/env bash
# The workflow on simulated cells, one of them broken, against `mbtfm batch`, byte by byte.
#
#   tests/cluster/run.sh local 4          Snakemake on this machine, 4 cells
#   tests/cluster/run.sh slurm 20         on a SLURM of this machine alone, set up in a temporary folder (needs root)
#
# Exit code 77: skipped, and says what lacks. MBTFM_BIN: folder of the executables.
set -euo pipefail

mode=${1:-local}
n_cells=${2:-4}
here=$(cd "$(dirname "$0")" && pwd)
project=$(cd "$here/../.." && pwd)
bin=${MBTFM_BIN:-$project/build/bin}

skip() {
  echo "skipped: $*"
  exit 77
}
lacks=()
for program in snakemake; do command -v $program >/dev/null || lacks+=("$program"); done
if [ "$mode" = slurm ]; then
  for program in slurmctld slurmd munged sbatch; do command -v $program >/dev/null || lacks+=("$program"); done
  [ "$(id -u)" -eq 0 ] || lacks+=("root, to set up SLURM")
fi
[ ${#lacks[@]} -eq 0 ] || skip "this test needs ${lacks[*]} (Debian: snakemake slurmctld slurmd slurm-client munge)"

work=$(mktemp -d)
pids=()
end() {
  for pid in "${pids[@]}"; do kill "$pid" 2>/dev/null || true; done
  wait 2>/dev/null || true
  [ -n "${MBTFM_KEEP:-}" ] && echo "kept: $work" || rm -rf "$work"
}
trap end EXIT
fail() {
  echo "FAILED: $*" >&2
  exit 1
}

# Cells of two adhesions and one fibre, some 25 um wide: a second of work each. Four experiments are simulated; the cells
# are copies of them that differ in a parameter. The second cell's actin image is cut short.
mkdir "$work/study" "$work/experiments"
for k in $(seq 4); do
  [ "$k" -gt "$n_cells" ] && break
  "$bin/mbtfm-simulate" --scenario two-adhesions --seed "$((100 + k))" --noise 0.05 --beads 300 --images --quiet \
    --threads 1 --out "$work/experiments/$k"
done
for i in $(seq "$n_cells"); do
  cell=$work/study/$(printf 'day %d/cell%02d' $((1 + i % 2)) "$i") # names with a space, in sub-folders
  case $i in # and what Snakemake does not bear
    3) cell+=$' {control}\n"$HOME"' ;;
    4) cell+=$'_caf\xe9' ;;
  esac
  mkdir -p "$(dirname "$cell")"
  cp -r "$work/experiments/$((1 + (i - 1) % 4))" "$cell"
  rm -rf "$cell/truth"
  printf '[fit]\nn_meshes = 1\n[substrate]\nmodel = "layer"\n[network]\nseed = %d\n' "$i" >>"$cell/cell.toml"
done
# A sheet among them, by beads that are given: no job runs a stage that is given.
sheet=$work/study/day\ 2/sheet
"$bin/mbtfm-simulate" --scenario contracting-disc --radius_um 14 --beads 1500 --mesh_um 0.7 --quiet --threads 1 --out "$sheet"
rm -rf "$sheet/truth"
sed -i 's/^\[sheet\]/[sheet]\nmesh_um = 2/' "$sheet/cell.toml"
printf '[run]\nmodel = "sheet"\n' >>"$sheet/cell.toml"
broken=$work/study/day\ 1/cell02
truncate -s 1000 "$broken/actin.tif"
cp -r "$work/study" "$work/by_batch"

echo "== mbtfm batch"
"$bin/mbtfm" batch "$work/by_batch" --jobs 2 --threads 2 2>&1 | tail -n 5 && fail "a broken cell, and no error"

workflow() {
  (cd "$work" && snakemake --snakefile "$project/pipeline/Snakefile" --config folder="$work/study" mbtfm="$bin/mbtfm" \
    "$@" >>"$work/snakemake.log" 2>&1)
}

case $mode in
  local) run=(--cores 2 --keep-going) ;;
  slurm)
    echo "== a SLURM of one machine"
    # shellcheck source=tests/cluster/slurm.sh
    source "$here/slurm.sh"
    start_slurm "$work/slurm"
    # this machine has the memory of one machine only, and its file system shows files at once
    run=(--profile "$project/pipeline/profiles/slurm" --restart-times 0 --latency-wait 5 --default-resources
      --set-resources segment:mem_mb=300 track:mem_mb=300 network:mem_mb=100 fit:mem_mb=400 stats:mem_mb=300
      --set-threads track=1 fit=1)
    ;;
  *) fail "unknown mode $mode: local or slurm" ;;
esac

compare() {
  diff -rq --exclude=record.json --exclude=run.json --exclude='*.log' --exclude=report.html --exclude='.*' \
    --exclude=batch.csv --exclude=batch_all.csv --exclude=statistics "$work/by_batch" "$work/study" || fail "results differ from those of mbtfm batch"
  n=$(find "$work/study" -name tensions.csv -printf x | wc -c)
  [ "$n" -eq $((n_cells - 1)) ] || fail "$n cells have tensions, expected $((n_cells - 1))"
}

echo "== snakemake"
workflow "${run[@]}" && fail "a broken cell, and no error"
compare
grep -q 'cell02.*segment' "$work/study/batch.csv" || fail "the table does not tell of the broken cell"
[ -s "$work/study/statistics/report.html" ] || fail "no statistics of the other cells"
[ -s "$sheet/3_sheet/sheet_fit.csv" ] || fail "the sheet was not fitted"
grep -q 'day 2/sheet,.*TRUE.*,sheet,' "$work/study/statistics/cells.csv" || fail "the statistics do not have the sheet"

echo "== the broken image mended, a parameter of another cell changed"
for study in study by_batch; do
  cp "$work/experiments/2/actin.tif" "$work/$study/day 1/cell02/actin.tif"
  sed -i 's/n_meshes = 1/n_meshes = 2/' "$work/$study/day 2/cell01/cell.toml"
done
"$bin/mbtfm" batch "$work/by_batch" --jobs 2 --threads 2 --quiet 2>/dev/null || fail "mbtfm batch failed"
: >"$work/snakemake.log"
workflow "${run[@]}" || { tail -n 40 "$work/snakemake.log"; fail "snakemake failed"; }
n_cells=$((n_cells + 1)) compare
# segment, track, network and fit of the one, fit of the other, table, statistics, and `all`
n_jobs=$(sed -n 's/^total *\([0-9]*\).*/\1/p' "$work/snakemake.log" | head -n 1)
[ "$n_jobs" -eq 8 ] || fail "$n_jobs jobs, expected the 8 that depend on the changes"

echo "== nothing left to do"
: >"$work/snakemake.log"
workflow "${run[@]}" || fail "snakemake failed"
grep -q 'Nothing to be done' "$work/snakemake.log" || fail "jobs, though all is up to date"
for cell in "$work"/study/day*/cell* "$sheet"; do "$bin/mbtfm" verify "$cell" >/dev/null || fail "mbtfm verify $cell"; done
echo "passed: $mode, $n_cells cells"
