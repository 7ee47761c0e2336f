#!/bin/sh
# Make docs/images/mesh/hard_cells.png: docs/images/mesh/make.sh BUILD/tests/mesh_pictures
#
# Needs the Debian packages chromium and imagemagick, which mbtfm itself does not.
set -eu

program=${1:?usage: docs/images/mesh/make.sh BUILD/tests/mesh_pictures}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$program" > "$work/sheet.svg"
printf '<body style="margin:0">' | cat - "$work/sheet.svg" > "$work/sheet.html"
chromium --headless --no-sandbox --disable-gpu --disable-background-networking --disable-component-update \
  --disable-sync --no-first-run --hide-scrollbars --user-data-dir="$work/profile" \
  --screenshot="$work/sheet.png" --window-size=1200,1272 "file://$work/sheet.html" 2> "$work/log" ||
  { cat "$work/log" >&2; exit 1; }
convert "$work/sheet.png" +dither -colors 32 -strip "PNG8:$(dirname "$0")/hard_cells.png"
