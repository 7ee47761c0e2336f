#!/bin/sh
made=${0%/*}/../made; name=${0##*/mbtfm-}
while [ $# -gt 0 ]; do
  case "$1" in
    --check) exit 0;;
    --out) out=$2; shift 2;;
    --record) record=$2; shift 2;;
    *) shift;;
  esac
done
case $name in
  segment) cp "$made"/1_segment/*.csv "$out"; cp "$made/1_segment/record.json" "$record";;
  track) cp "$made"/2_track/*.csv "$out"; cp "$made/2_track/record.json" "$record";;
  network) cp "$made/3_network/network.vtu" "$out"; cp "$made/3_network/record.json" "$record";;
  fit) cp "$made"/4_fit/*.csv "$made/4_fit/fit.json" "$made/4_fit/contracted.vtu" "$out"; cp "$made/4_fit/record.json" "$record";;
esac
