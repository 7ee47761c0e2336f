#!/usr/bin/env bash
# Build the Debian packages, check them with lintian, install them in a bare Debian 12, run the demo from them there, use the
# libraries, purge all: nothing must be left. As root; takes some minutes beside the compilation. Nothing in the tree is changed.
#
#   tests/package/run.sh [FOLDER]     FOLDER (default: build/package) keeps the packages; those that are there are not built again
#
# DEB_BUILD_PROFILES=pkg.mbtfm.nomesh leaves the finite elements out. MBTFM_CMAKE_FLAGS goes to CMake.
set -euo pipefail
cd "$(dirname "$0")/../.."
folder=$(realpath -m "${1:-build/package}")
./cmake/install_packages.sh all debhelper dh-python pybuild-plugin-pyproject python3-all python3-setuptools python3-numpy \
  python3-pandas lintian mmdebstrap
mkdir -p "$folder"
version=$(dpkg-parsechangelog -S Version)
say() { printf 'package: %s\n' "$*"; }
fail() { printf 'package: error: %s\n' "$*" >&2; exit 1; }

if ! ls "$folder"/mbtfm_"${version}"_*.deb >/dev/null 2>&1; then
  say "building in $folder/mbtfm-$version"
  rm -rf "$folder/mbtfm-$version"
  mkdir "$folder/mbtfm-$version"
  git ls-files -z --cached --others --exclude-standard | xargs -0 cp --parents -t "$folder/mbtfm-$version"
  # debhelper gives the build a home of its own: the compiler cache is named, and paths in it do not depend on the folder
  if command -v ccache >/dev/null; then
    CCACHE_DIR=$(ccache -k cache_dir) CCACHE_BASEDIR=$folder
    export CCACHE_DIR CCACHE_BASEDIR
  fi
  # and Debian's own python3 is meant, whatever else is on the path
  (cd "$folder/mbtfm-$version" && PATH=/usr/sbin:/usr/bin:/sbin:/bin dpkg-buildpackage --build=full --no-sign --jobs=2) >"$folder/build.log" 2>&1 ||
    { tail -n 30 "$folder/build.log" >&2; fail "dpkg-buildpackage ($folder/build.log)"; }
fi

say "lintian"
lintian --fail-on error,warning "$folder"/mbtfm_"${version}"_*.changes || fail "lintian has complaints"

root=$(mktemp -d "${TMPDIR:-/tmp}/mbtfm-root.XXXXXX")
leave() { if mountpoint -q "$root/proc"; then umount "$root/proc" || return; fi; rm -rf --one-file-system "$root"; }
trap leave EXIT
say "a bare Debian 12"
mmdebstrap --quiet --variant=minbase bookworm "$root"
mount -t proc proc "$root/proc"
inside() { DEBIAN_FRONTEND=noninteractive chroot "$root" "$@"; }
listing() { (cd "$root" && find . -path ./proc -prune -o -path ./var/lib -prune -o -path ./var/log -prune -o -path ./var/cache -prune -o -path ./tmp -prune -o -print | sort); }
dpkg-query --admindir="$root/var/lib/dpkg" -W -f '${Package}\n' | sort >"$folder/packages-before.txt"
listing >"$folder/files-before.txt"
# there is no engine here: the Dockerfile's COPY and RUN, as they are written
copy() { mkdir -p "$root/tmp/packages" && cp "$folder"/$1 "$root/tmp/packages"; }
copy "$(sed -n 's#^COPY \(.*\) /tmp/packages/$#\1#p' packaging/Dockerfile)"
run=$(sed -n '/^RUN /,/[^\\]$/p' packaging/Dockerfile | sed '1s/^RUN //')
cp /etc/resolv.conf "$root/etc/" 2>/dev/null || true

begin=$(date +%s)
inside sh -c "$run" >"$folder/install.log" 2>&1 ||
  { tail -n 20 "$folder/install.log" >&2; fail "the package does not install"; }
installed=$(date +%s)
inside mbtfm --version
# as docker run --user does: without rights, without a home
chroot --userspec=1000:1000 "$root" env -i PATH=/usr/bin:/bin sh -c 'cd /tmp && mbtfm demo' || fail "the demo"
[ -s "$root/tmp/mbtfm-demo/report.html" ] || fail "no report"
end=$(date +%s)
say "from bare to the demo's report: $((end - begin)) s ($((installed - begin)) s of them apt-get; bar: 180 s)"
size=$(dpkg-query --admindir="$root/var/lib/dpkg" -W -f '${Installed-Size}' mbtfm)
say "installed size: $((size / 1024)) MB beside dependencies (bar: 60 MB)"
[ "$size" -le $((60 * 1024)) ] || fail "larger than 60 MB"

mapfile -t entry < <(sed -n 's/^\(ENTRYPOINT\|CMD\) \["\(.*\)"\]$/\2/p' packaging/Dockerfile)
inside "${entry[@]}" | grep -q '^ *batch ' || fail "the container without arguments: ${entry[*]}"

say "finite elements, which are another package"
# a gel with sides, which the layer does not have
gel='--youngs_modulus_kPa 8.4 --model split --adhesions 1_segment/adhesions.csv --forces 4_fit/adhesion_forces.csv --points 2_track/displacement.csv'
if inside sh -c "cd /tmp/mbtfm-demo && mbtfm-substrate $gel --out /tmp/field.csv" 2>"$folder/no-mesh.log"; then
  fail "finite elements without their package"
fi
grep -q "mbtfm-mesh" "$folder/no-mesh.log" || { cat "$folder/no-mesh.log"; fail "the missing package is not named"; }

say "the other packages, and a program of somebody else"
inside apt-get update -q >/dev/null
copy "*_${version}_*.deb"
inside apt-get install -y -q --no-install-recommends g++ cmake make pkg-config man-db bash-completion $(cd "$root" && ls -d tmp/packages/*.deb | sed 's#^#/#') \
  >"$folder/install-all.log" 2>&1 || { tail -n 20 "$folder/install-all.log" >&2; fail "the packages do not install together"; }
if [ -e "$root/usr/lib/mbtfm/libmbtfm_mesh_maker.so" ]; then
  inside sh -c "cd /tmp/mbtfm-demo && mbtfm-substrate --quiet $gel --out /tmp/field.csv" || fail "finite elements"
fi
cp -r tests/package/consumer "$root/tmp/consumer"
inside sh -c 'cd /tmp/consumer && cmake -B build >/dev/null && cmake --build build >/dev/null && build/consumer /tmp/mbtfm-demo/1_segment/adhesions.csv' ||
  fail "find_package(mbtfm)"
inside sh -c 'cd /tmp/consumer && g++ -O1 main.cpp $(pkg-config --cflags --libs mbtfm) -o pc && ./pc' || fail "pkg-config mbtfm"
inside python3 -c 'import mbtfm; cell = mbtfm.read("/tmp/mbtfm-demo"); print(len(cell.tensions), "tensions read by Python")' || fail "Python"
for page in "$root"/usr/share/man/man1/mbtfm*; do
  inside man --warnings -l "${page#"$root"}" 2>&1 >/dev/null | grep . && fail "$page"
done
inside bash -c '. /usr/share/bash-completion/completions/mbtfm && COMP_WORDS=(mbtfm ru) COMP_CWORD=1 && _mbtfm && [ "${COMPREPLY[0]}" = run ]' || fail "completion"

say "purge"
inside sh -c 'apt-get purge -y -q mbtfm mbtfm-mesh libmbtfm-dev python3-mbtfm && apt-get autoremove --purge -y -q && apt-get purge -y -q g++ cmake make pkg-config man-db bash-completion && apt-get autoremove --purge -y -q' >"$folder/purge.log" 2>&1 ||
  { tail -n 20 "$folder/purge.log" >&2; fail "purge"; }
listing >"$folder/files-after.txt"
left=$(comm -13 "$folder/files-before.txt" "$folder/files-after.txt" | grep -i mbtfm || true)
[ -z "$left" ] || { echo "$left"; fail "files are left"; }
say "all is well; nothing of the packages is left"
