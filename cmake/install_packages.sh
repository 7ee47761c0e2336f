#!/usr/bin/env bash
# Install the missing Debian packages (12 or 13) that mbtfm builds with, as root or through sudo; says what is missing if it
# can do neither. First argument: cell (what a cell needs, from images to its report), all (all programs and tests) or
# tests (what these ask for in addition); then further packages.
set -euo pipefail

purpose=${1:-all}
case $purpose in
  cell | all | tests) shift || true ;;
  *) echo "mbtfm: error: expected cell, all or tests, found '$purpose'" >&2; exit 2 ;;
esac
packages=(
  g++ cmake ninja-build ccache mold
  libopencv-dev libvtk9-dev libeigen3-dev libboost-dev libboost-thread-dev libcgal-dev
  libmetis-dev libfftw3-dev libopenblas0-pthread libopenblas-pthread-dev
  libtiff-dev libpng-dev libjpeg62-turbo-dev libzip-dev libpugixml-dev libssl-dev
  libcli11-dev nlohmann-json3-dev libfmt-dev libtomlplusplus-dev libutf8proc-dev
)
[ "$purpose" = cell ] || packages+=(libdeal.ii-dev zlib1g-dev librsvg2-dev pkg-config fonts-dejavu-core libgtest-dev libgmock-dev)
[ "$purpose" != tests ] || packages+=(python3-jsonschema)
packages+=("$@")

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
  [ "$status" = installed ] || missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then exit 0; fi

echo "mbtfm: installing ${#missing[@]} Debian packages: ${missing[*]}"
as_root=()
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo >/dev/null; then
    echo "mbtfm: error: these packages are missing, and you are not root and have no sudo. Ask an administrator for:" >&2
    echo "  apt-get install --no-install-recommends ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi
install() {
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}"
}
if ! { "${as_root[@]}" apt-get update -q && install; } >/tmp/mbtfm-packages-$$.log 2>&1; then
  tail -n 20 "/tmp/mbtfm-packages-$$.log" >&2
  echo "mbtfm: error: the packages could not be installed (log: /tmp/mbtfm-packages-$$.log). Missing: ${missing[*]}" >&2
  exit 1
fi
rm -f "/tmp/mbtfm-packages-$$.log"
