#!/usr/bin/env bash
# Remake the tables of "A sheet beside the cables" in notes/doublet.md: the real doublet on an H, fitted with
# cables and with contracting sheets. Run from the project's folder, built; some ten minutes of one processor. Needs the
# doublet's images ($1, or ../shared/data/real/doublet_on_h). What was made before is kept in the work folder
# (build/doublet).
set -euo pipefail
cd "$(dirname "$0")/.."
data=${1:-../shared/data/real/doublet_on_h} work=${2:-build/doublet} bin=$PWD/build/bin page=notes/doublet.md
cell=$work/cell
if [ ! -s "$cell/4_fit/models.csv" ]; then
  mkdir -p "$cell"
  cp "$data"/{actin,beads_relaxed,beads_stressed}.tif "$cell/"
  cp "$data/pattern_derived.tif" "$cell/adhesion_mask.tif"
  cp "$data/mask.tif" "$cell/outline_mask.tif"
  cat >"$cell/cell.toml" <<'TOML'
pixel_size_um = 0.108
[gel]
youngs_modulus_kPa = 19.66
poisson_ratio = 0.5
thickness_um = 60
[segment]
adhesions = "pattern"
[fit]
compare_sheet = "on"
[sheet]
thickness_um = 4
TOML
  "$bin/mbtfm" run "$cell" --quiet
fi
fit() { # name, arguments: an even sheet fitted to the beads under load
  [ -s "$work/$1/sheet_models.csv" ] || "$bin/mbtfm-sheet" --quiet --config "$cell/cell.toml" \
    --outline "$cell/1_segment/outline.csv" --displacement "$cell/2_track/displacement.csv" \
    --adhesions "$cell/1_segment/adhesions.csv" --beads_under_load on "${@:2}" --out "$work/$1"
}
pattern=(--adhesive "$cell/adhesion_mask.tif") bundles=(--bundles "$cell/1_segment/fibre_points.csv")
fit pattern_bundles "${pattern[@]}" "${bundles[@]}"
fit everywhere_bundles "${bundles[@]}"
fit everywhere_bundles_line "${bundles[@]}" --fit_line_tension
fit everywhere_line --fit_line_tension
fit everywhere_line_springs --fit_line_tension --fit_adhesion_stiffness
fit pattern "${pattern[@]}"
fit everywhere
python3 - "$work" "$cell" "$page" <<'PY'
import csv, sys
work, cell, page = sys.argv[1:]

def rows(file):
    return list(csv.DictReader(open(file)))

def model(folder, name):
    return next(r for r in rows(f"{work}/{folder}/sheet_models.csv") if r["model"] == name)

def own(folder):
    return rows(f"{work}/{folder}/sheet_models.csv")[-2]  # the last is that of independent forces

def cables(name):
    return next(r for r in rows(f"{cell}/4_fit/models.csv") if r["model"] == name)

def thousands(x):
    return f"{float(x):,.0f}".replace(",", " ")

named = [("sheet, adhering on the pattern, with bundles", own("pattern_bundles")),
         ("sheet, adhering everywhere, with bundles", own("everywhere_bundles")),
         ("the same with a line", own("everywhere_bundles_line")),
         ("sheet, adhering everywhere, with a line, on springs", own("everywhere_line_springs")),
         ("sheet, adhering everywhere, with a line", own("everywhere_line")),
         ("sheet, adhering on the pattern", own("pattern")),
         ("sheet, adhering everywhere", own("everywhere")),
         ("independent forces on the candidates", model("pattern_bundles", "adhesion-forces")),
         ("network with fibres (cables)", cables("full")),
         ("network alone", cables("no-fibres"))]
named.sort(key=lambda row: float(row[1]["bic"]))
models = ["| model | parameters | L2 | chi² | BIC |", "|---|---|---|---|---|"]
for name, row in named:
    models.append(f"| {name} | {row['n_parameters']} | {float(row['relative_l2']):.3f} | "
                  f"{thousands(row['chi_squared'])} | {thousands(row['bic'])} |")

def middle(points, fibre):
    xs = [float(p["x_um"]) for p in points if p["fibre_id"] == fibre]
    return xs

points = rows(f"{cell}/1_segment/fibre_points.csv")
lengths = {r["fibre_id"]: float(r["length_um"]) for r in rows(f"{cell}/1_segment/fibres.csv")}

def longest(is_left):
    there = [f for f in lengths if all((x < 42) if is_left else (x > 65) for x in middle(points, f))]
    return max(there, key=lengths.get)

left, right = longest(True), longest(False)

def estimate(folder, quantity, part=""):
    for r in rows(f"{work}/{folder}/sheet_fit.csv"):
        if r["quantity"] == quantity and r["part"] == part:
            if r["sigma"]:
                return f"{float(r['value']):.3g} ± {float(r['sigma']):.2g}"
            if r["low"]:
                return f"> {float(r['low']):.3g}"
            return f"< {float(r['high']):.3g}" if r["high"] else "not known"
    return "–"

tensions = {r["fibre_id"]: r for r in rows(f"{cell}/4_fit/tensions.csv")}

def cable(fibre):
    r = tensions[fibre]
    return f"{float(r['tension_nN']):.3g} ({float(r['low_nN']):.3g} to {float(r['high_nN']):.3g})"

import json
surface = json.load(open(f"{cell}/4_fit/fit.json"))["network_surface_tension_nN_per_um"]
found = ["| | right, left fibre (nN) | surface tension or contraction (nN/µm) | stiffness M (nN/µm) | line (nN) |",
         "|---|---|---|---|---|",
         f"| cables | {cable(right)}, {cable(left)} | {surface:.3g} | – | – |"]
for name, folder in [("sheet with bundles, on the pattern", "pattern_bundles"),
                     ("sheet with bundles, everywhere", "everywhere_bundles"),
                     ("the same with a line", "everywhere_bundles_line"),
                     ("sheet with a line, no bundles", "everywhere_line"),
                     ("sheet with a line on springs", "everywhere_line_springs")]:
    fibres = ", ".join(estimate(folder, "bundle_tension_nN", f"fibre {f}") for f in (right, left))
    found.append(f"| {name} | {fibres} | {estimate(folder, 'contraction_nN_per_um')} | "
                 f"{estimate(folder, 'stiffness_nN_per_um')} | {estimate(folder, 'line_tension_nN')} |")

text = open(page, encoding="utf-8").read()
for mark, table in [("models", models), ("found", found)]:
    begin, end = f"<!-- make_doublet.sh: {mark} -->\n", "<!-- end -->"
    head, rest = text.split(begin, 1)
    text = head + begin + "\n" + "\n".join(table) + "\n\n" + end + rest.split(end, 1)[1]
open(page, "w", encoding="utf-8").write(text)
PY
