#!/usr/bin/env bash
# The laws of cmake/version.cmake, on a repository of two files: the version names the code, and the code alone.
set -euo pipefail
script=$(realpath "$(dirname "$0")/../../cmake/version.cmake")
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
n=0

version() { cmake -DSOURCE="$1" -DRELEASE=1.2.3 -DOUT="$scratch/version.cpp" -P "$script"; sed -n 's/.*"\(.*\)";/\1/p' "$scratch/version.cpp"; }
expect() {  # TEXT PATTERN LAW
  n=$((n + 1))
  [[ $1 =~ ^$2$ ]] || { echo "$3: '$1' is not like '$2'" >&2; exit 1; }
}
differ() { n=$((n + 1)); [ "$1" != "$2" ] || { echo "$3: both are '$1'" >&2; exit 1; }; }
commit() { git -C "$repo" add -A && git -C "$repo" -c user.name=a -c user.email=a@b commit -q -m "$1"; }

repo=$scratch/repo
mkdir -p "$repo/pipeline" "$repo/docs"
git init -q "$repo"
echo one >"$repo/pipeline/a.cpp"
commit code
first=$(version "$repo")
expect "$first" '1\.2\.3-g[0-9a-f]{12}' "without a tag: the release and the commit"

echo text >"$repo/docs/a.md"
commit docs
expect "$(version "$repo")" "$first" "a commit of docs leaves the version"

touch -d 2001-01-01 "$scratch/version.cpp"
version "$repo" >/dev/null
expect "$(date -r "$scratch/version.cpp" +%Y)" 2001 "the same version does not touch the file: nothing is compiled"

echo two >"$repo/pipeline/a.cpp"
dirty=$(version "$repo")
expect "$dirty" "$first-dirty\.[0-9a-f]{12}" "a change in no commit is told"
echo three >"$repo/pipeline/a.cpp"
differ "$dirty" "$(version "$repo")" "two such changes differ"
commit code
differ "$first" "$(version "$repo")" "a commit of code changes the version"

git -C "$repo" tag v1.2.3
expect "$(version "$repo")" '1\.2\.3' "the tagged commit is the release"
echo four >"$repo/pipeline/a.cpp"
commit code
expect "$(version "$repo")" '1\.2\.3-1-g[0-9a-f]{12}' "after a tag: as git describe has it"

# Of two branches that both changed the code the merge is named, which has both changes.
git -C "$repo" checkout -q -b other HEAD~1
echo five >"$repo/pipeline/b.cpp"
commit code
git -C "$repo" checkout -q -
git -C "$repo" -c user.name=a -c user.email=a@b merge -q -m merge other
expect "$(version "$repo")" "1\.2\.3-3-g$(git -C "$repo" rev-parse --short=12 HEAD)" "a merge of code is named"

git -C "$repo" archive --prefix=tarball/ HEAD | tar -x -C "$scratch"
tarball=$(version "$scratch/tarball")
expect "$tarball" '1\.2\.3-src\.[0-9a-f]{12}' "a tarball: a hash of its sources"
mkdir "$repo/inside"
cp -r "$scratch/tarball/." "$repo/inside"
expect "$(version "$repo/inside")" "$tarball" "a tarball in another repository is not that repository's commit"
echo six >"$scratch/tarball/pipeline/a.cpp"
differ "$tarball" "$(version "$scratch/tarball")" "other sources have another hash"
project=$(realpath "$(dirname "$script")/..")
release=$(sed -n 's/^project(mbtfm VERSION \([0-9.]*\).*/\1/p' "$project/CMakeLists.txt")
says() { expect "$(sed -n "$2" "$project/$1" | head -n 1)" "${release//./\\.}" "the release is the same in CMakeLists.txt and $1"; }
says python/pyproject.toml 's/^version = "\(.*\)"/\1/p'
says python/mbtfm/__init__.py 's/^__version__ = "\(.*\)"/\1/p'
says debian/changelog 's/^mbtfm (\([^)]*\)).*/\1/p'
says packaging/conda/meta.yaml 's/.*set version = "\(.*\)".*/\1/p'
says CHANGELOG.md 's/^## \([0-9].*\)/\1/p'
echo "$n laws of the version hold"
