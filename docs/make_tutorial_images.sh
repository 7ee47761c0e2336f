#!/bin/sh
# Make the pictures of docs/tutorial.md from the demo cell: docs/make_tutorial_images.sh CELL [BIN]
#
# Needs the Debian packages chromium and imagemagick, which mbtfm itself does not.
set -eu

cell=${1:?usage: docs/make_tutorial_images.sh CELL [BIN]}
bin=${2:-build/bin}
out=$(dirname "$0")/images/tutorial
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$out"

# a segmentation that nobody should accept, beside that of the defaults
"$bin/mbtfm-segment" --adhesion-image "$cell/paxillin.tif" --actin-image "$cell/actin.tif" --out "$work/bad" \
  --adhesion_seed_noise 60 --fibre_least_probability 0 --fibre_start_noise 1.5 > /dev/null 2>&1
convert "$work/bad/overlay.png" -resize 700x "$work/bad.png"
convert "$cell/1_segment/overlay.png" -resize 700x "$work/good.png"
convert "$work/good.png" "$work/bad.png" -background white +append -strip -quality 75 "$out/overlays.jpg"

# charts of the report, by their titles
chart() {
  cat "$cell/report.html" - > "$work/page.html" <<END
<script>
const titles = [$2];
const row = document.createElement('div');
row.style = 'display:flex;gap:24px;align-items:flex-start;width:1400px;padding:12px;background:#fff';
for (const title of titles) {
  const figure = [...document.querySelectorAll('figure')].find(f => f.querySelector('h3').textContent === title);
  figure.style = 'flex:1;max-width:none';
  figure.querySelector('.buttons').remove();
  row.append(figure);
}
document.body.replaceChildren(row);
document.body.style = 'background:#fff';
</script>
END
  chromium --headless --no-sandbox --disable-gpu --disable-background-networking --disable-component-update \
    --disable-sync --no-first-run --hide-scrollbars --user-data-dir="$work/profile" --virtual-time-budget=5000 \
    --screenshot="$work/page.png" --window-size=1424,1200 "file://$work/page.html" > /dev/null 2>&1
  convert "$work/page.png" -trim -bordercolor white -border 12 -strip -quality 80 "$out/$1.jpg"
}
chart tensions "'Tension of each fibre', 'Tensions by type'"
chart forces "'Beads', 'Forces on the substrate'"
chart displacements "'Measured displacement', 'Measured minus fitted'"
