#!/usr/bin/env bash
# The laws of an installation: it can be moved, nothing in it looks into the source or build tree, its manual pages and completions
# are sound, its libraries serve a program of somebody else.
#   tests/package/installed.sh BUILD
set -euo pipefail
build=$(realpath "$1") source=$(realpath "$(dirname "$0")/../..")
scratch=$(mktemp -d "${TMPDIR:-/tmp}/mbtfm-installed.XXXXXX")
trap 'rm -rf "$scratch"' EXIT
fail() { echo "$*" >&2; exit 1; }

cmake --install "$build" --prefix "$scratch/first" --strip >/dev/null
mv "$scratch/first" "$scratch/moved"
prefix=$scratch/moved

# Paths of sources stand in what assertions say; nothing is opened there: moved away, all goes on.
"$prefix/bin/mbtfm" --version | grep -q '^mbtfm [0-9]' || fail "no version"
cd "$scratch"
strace=$(command -v strace || true)
run() { if [ -n "$strace" ]; then strace -f -qq -e trace=openat,execve,readlink -o trace -A "$@"; else "$@"; fi; }
run "$prefix/bin/mbtfm-simulate" --quiet --scenario two-adhesions --beads 500 --out cell
run "$prefix/bin/mbtfm" run --quiet --preset fast cell
[ -s cell/report.html ] || fail "no report"
if [ -n "$strace" ] && grep -E "\"($source|$build)/" trace | grep -v ENOENT >found; then head -n 3 found >&2; fail "it looks into the tree"; fi

for page in "$prefix"/share/man/man1/*.1; do
  complaints=$(MANROFFSEQ= man --warnings -l "$page" 2>&1 >/dev/null)
  [ -z "$complaints" ] || fail "$page: $complaints"
done
for program in "$prefix"/bin/*; do [ -e "$prefix/share/man/man1/$(basename "$program").1" ] || fail "no manual page of $program"; done
for file in "$prefix"/share/bash-completion/completions/*; do bash -n "$file"; done
for file in "$prefix"/share/zsh/site-functions/*; do zsh -n "$file"; done
for file in "$prefix"/share/fish/vendor_completions.d/*; do fish -n "$file"; done
# shellcheck disable=SC1091
(. "$prefix/share/bash-completion/completions/mbtfm" && COMP_WORDS=(mbtfm run --pre) COMP_CWORD=2 && _mbtfm && [ "${COMPREPLY[*]}" = --preset ]) ||
  fail "bash does not complete a flag"

python3 - "$prefix" <<'PYTHON' || fail "a page links to what is not installed"
import pathlib
import re
import sys

whole, n_pages = True, 0
for page in pathlib.Path(sys.argv[1]).rglob("*.md"):
    n_pages += 1
    for link in re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
        if not (page.parent / link).exists():
            print(page.relative_to(sys.argv[1]), "links to", link, file=sys.stderr)
            whole = False
sys.exit(0 if whole and n_pages > 20 else 1)
PYTHON

cp -r "$source/tests/package/consumer" consumer
cmake -S consumer -B consumer/build -DCMAKE_PREFIX_PATH="$prefix" >consumer.log 2>&1 || { cat consumer.log >&2; fail "find_package"; }
cmake --build consumer/build >consumer.log 2>&1 || { cat consumer.log >&2; fail "a program with the libraries"; }
consumer/build/consumer cell/1_segment/adhesions.csv | grep -q ', 2 adhesions$' || fail "the program"
package=$(dirname "$(find "$prefix" -name mbtfm.pc)")
# shellcheck disable=SC2046
g++ $(PKG_CONFIG_PATH=$package pkg-config --cflags mbtfm) consumer/main.cpp -o with-pkg-config $(PKG_CONFIG_PATH=$package pkg-config --libs mbtfm)
[ "$(./with-pkg-config)" = "$(consumer/build/consumer)" ] || fail "pkg-config"
echo "the installation is whole ($(du -sm "$prefix" | cut -f1) MB with the libraries)"
