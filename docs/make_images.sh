#!/bin/sh
# Make docs/images/result.png from the report of a cell: the segmentation beside the fitted tensions.
#
#   docs/make_images.sh CELL/report.html [OUT.png]
#
# Needs the Debian packages chromium and imagemagick, which mbtfm itself does not.
set -eu

report=${1:?usage: docs/make_images.sh CELL/report.html [OUT.png]}
out=${2:-$(dirname "$0")/images/result.png}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# The report with nothing left but the two figures, side by side.
cat "$report" - > "$work/page.html" <<'END'
<style id="only">
body { background: #fff }
#row { display: flex; gap: 24px; align-items: center; width: 1400px; padding: 12px }
#row > * { flex: 1; max-width: none }
figcaption, h3 { display: none }
.buttons { display: none }
figure { max-width: none }
</style>
<script>
const row = document.createElement('div');
row.id = 'row';
for (const title of ['Segmentation', 'Tension of each fibre']) {
  row.append([...document.querySelectorAll('figure')].find(f => f.querySelector('h3').textContent === title));
}
document.head.append(document.getElementById('only'));
document.body.replaceChildren(row);
</script>
END
# no sandbox: it would not start as root, and the page is our own
chromium --headless --no-sandbox --disable-gpu --disable-background-networking --disable-component-update \
  --disable-sync --no-first-run --hide-scrollbars --user-data-dir="$work/profile" \
  --screenshot="$work/page.png" --window-size=1424,1200 "file://$work/page.html" 2> "$work/log" ||
  { cat "$work/log" >&2; exit 1; }
# 256 colours suffice for the picture and keep it small
mkdir -p "$(dirname "$out")"
convert "$work/page.png" -trim -bordercolor white -border 12 +dither -colors 256 -strip "PNG8:$out"
