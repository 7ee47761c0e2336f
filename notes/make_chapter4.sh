#!/usr/bin/env bash
# Make the figures of chapter 4 in notes/validation.md: means of 17 simulated colonies (thesis figs. 4.2 to 4.4) and the map of
# the indentation (fig. 4.7). Run from the project's folder, built; some three minutes. Needs the Debian package chromium.
set -euo pipefail
cd "$(dirname "$0")/.."
bin=$PWD/build/bin work=${1:-build/chapter4} out=notes/images/validation
mkdir -p "$work" "$out"
picture() { # SVG, PNG, width, height
  chromium --headless --no-sandbox --disable-gpu --hide-scrollbars --user-data-dir="$work/profile" --window-size="$3,$4" \
    --screenshot="$work/page.png" "file://$(realpath "$1")" >/dev/null 2>&1
  convert "$work/page.png" -trim -bordercolor white -border 12 +dither -colors 128 -strip "PNG8:$2"
}
for shape in disc spikes; do
  [ -d "$work/$shape" ] || "$bin/mbtfm-simulate" --quiet --scenario "colony-$shape" --n_colonies 17 --scatter_um 4 --out "$work/$shape"
  symmetry=C4v
  [ "$shape" = disc ] && symmetry=Cinfv
  "$bin/mbtfm-mean" --cells "$work/$shape" --symmetry "$symmetry" --config "$work/$shape/colony_001/cell.toml" --out "$work/mean_$shape"
  picture "$work/mean_$shape/mean.svg" "$out/colony_$shape.png" 960 1000
done
# two colonies alone, without their symmetry
mkdir -p "$work/single"
for k in 1 2; do cp -r "$work/spikes/colony_00$k" "$work/single/"; done
"$bin/mbtfm-mean" --cells "$work/single" --config "$work/spikes/colony_001/cell.toml" --out "$work/mean_single"
picture "$work/mean_single/mean.svg" "$out/colony_pair.png" 960 1000
cat >"$work/indent.toml" <<'TOML'
[gel]
youngs_modulus_kPa = 10
[indent]
sweep = "height_um=5.3..15.8:16 modulus_ratio=0.1,0.2,0.5,1,1.5,2"
TOML
"$bin/mbtfm-indent" --config "$work/indent.toml" --out "$work/indent"
picture "$work/indent/indent.svg" "$out/indentation.png" 960 900
cat "$work/indent/optima.csv"
