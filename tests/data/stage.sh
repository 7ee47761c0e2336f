#!/bin/sh
# Each output is a line that the stage's inputs decide, but for the segmentation: it is the same for all images, as for
# two images that differ outside the cell only. With exit-<name> beside it, a stage ends with the code in that file;
# shell-<name> is run first, check-<name> where it only reads its parameters.
here=$(dirname "$0"); name=$(basename "$0"); name=${name#mbtfm-}; all=""
while [ $# -gt 0 ]; do
  case "$1" in
    --check) check=1; shift;;
    --quiet) shift;;
    --out) out=$2; shift 2;;
    --record) record=$2; shift 2;;
    --config) config=$2; shift 2;;
    --threads) shift 2;;
    --kept) kept=$2; shift 2;;
    *) [ -f "$2" ] && all="$all $2"; shift 2;;
  esac
done
if [ -n "$check" ]; then [ -f "$here/check-$name" ] && . "$here/check-$name"; grep -q refuse_$name "$config" && { echo "mbtfm-$name: error: refused" >&2; exit 2; }; exit 0; fi
echo $name${kept:+-keeping} >> "$here/calls"
[ -f "$here/shell-$name" ] && . "$here/shell-$name"
code=0; [ -f "$here/exit-$name" ] && code=$(cat "$here/exit-$name")
[ $code -ne 0 ] && [ $code -ne 4 ] && { echo "mbtfm-$name: error: made to fail" >&2; exit $code; }
sum=$(cat $all "$config" | cksum)
case $name in
  segment) for f in adhesions fibres fibre_points outline; do echo same > "$out/$f.csv"; done;;
  track) echo "$sum" > "$out/displacement.csv"
    if [ -f "$here/series" ]; then
      printf 'frame,refused\n1,\n2,blurred\n3,\n' > "$out/frames.csv"
      for k in 1 3; do [ -n "$kept" -a -f "$out/displacement_000$k.csv" ] || echo "$k" > "$out/displacement_000$k.csv"; done
      outputs='{"file": "frames.csv"}, {"file": "displacement_0001.csv"}, {"file": "displacement_0003.csv"}'
    fi;;
  network) echo "$sum" > "$out";;
  fit) for f in tensions.csv adhesion_forces.csv fit.json contracted.vtu; do echo "{}" > "$out/$f"; done;;
  sheet) for f in sheet_fit sheet_models sheet traction displacement; do echo "{}" > "$out/$f.csv"; done
    for f in sheet.json sheet.svg sheet.html sheet.vtu; do echo "{}" > "$out/$f"; done;;
esac
echo "{\"stage\": \"$name\", \"version\": \"1\", \"summary\": \"made by a script\", \"outputs\": [$outputs]}" > "$record"
exit $code
