#!/usr/bin/env bash
# What batches cost: 20 cells with 1 and 2 jobs, what a cell costs beside its stages, and the look at N finished cells
# (10 000 unless said otherwise). For an idle machine of two processors or more; some 2 minutes.
set -euo pipefail
n=${1:-10000}
bin=${MBTFM_BIN:-$(cd "$(dirname "$0")/../.." && pwd)/build/bin}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
seconds() { # of a command: wall clock, and processor time
  local TIMEFORMAT="%R s, %U + %S s of the processors"
  { time "$@" >/dev/null 2>&1; } 2>&1
}

"$bin/mbtfm-simulate" --scenario two-adhesions --seed 1 --noise 0.05 --beads 300 --images --quiet --out "$work/cell"
rm -r "$work/cell/truth"
printf '[substrate]\nmodel = "layer"\n' >>"$work/cell/cell.toml"
mkdir "$work/one" "$work/two"
for i in $(seq -w 20); do cp -r "$work/cell" "$work/one/$i"; cp -r "$work/cell" "$work/two/$i"; done
echo "20 cells, 1 job:  $(seconds "$bin/mbtfm" batch "$work/one" --jobs 1 --threads 1)"
echo "20 cells, 2 jobs: $(seconds "$bin/mbtfm" batch "$work/two" --jobs 2 --threads 2)"
python3 - "$work/one" <<'PY'
import csv, glob, json, sys
wall = [float(row["seconds"]) for row in csv.DictReader(open(sys.argv[1] + "/batch_all.csv"))]
stages = [sum(s["run"]["seconds"] for s in json.load(open(f))["stages"].values()) for f in glob.glob(sys.argv[1] + "/*/run.json")]
print(f"beside its stages a cell takes {(sum(wall) - sum(stages)) / len(wall):.3f} s")
PY

# Links to the files of one finished cell: as many names and inodes to look at, without their room on the disk.
cell=$work/one/01
rm -f "$cell"/.mbtfm.*
python3 - "$cell" "$work/many" "$n" <<'PY'
import os, sys
cell, out, n = sys.argv[1], sys.argv[2], int(sys.argv[3])
tree = [(os.path.relpath(folder, cell), files) for folder, _, files in os.walk(cell)]
for i in range(n):
    for folder, files in tree:
        to = os.path.join(out, f"plate{i // 500:02d}", f"cell{i:05d}", folder)
        os.makedirs(to)
        for name in files:
            os.link(os.path.join(cell, folder, name), os.path.join(to, name))
PY
sleep 3 # the links have changed the files' ctime: they must come to rest
echo "$n cells, every file hashed: $(seconds "$bin/mbtfm" batch "$work/many")"
echo "$n cells, up to date:        $(seconds "$bin/mbtfm" batch "$work/many")"
