#!/usr/bin/env bash
# Would the suite see a fault? Plants those of tests/mutations.txt, one at a time, in a copy of the sources, builds the
# tests that should see each, and tells which does. By hand: it builds some thirty tests before the first fault.
#   tests/mutations.sh [--list] [NUMBER | FOLDER]...    which faults; none named: all
# MBTFM_MUTATIONS is the folder of copy and build (build-mutations), CMAKE_BUILD_PARALLEL_LEVEL the compilers at once.
set -euo pipefail
cd "$(dirname "$0")/.."
work=${MBTFM_MUTATIONS:-build-mutations}
list=tests/mutations.txt
longest_s=900  # a fault may keep a loop from ending

names=() files=() olds=() news=() seen_by=() excuses=()
read_list() {
  local line at=-1
  while IFS= read -r line; do
    case $line in
      'fault: '*) names+=("${line#fault: }") files+=('') olds+=('') news+=('') seen_by+=('') excuses+=('') at=$((at + 1)) ;;
      'in: '*) files[at]=${line#in: } ;;
      '- '*) olds[at]+=${olds[at]:+$'\n'}${line#- } ;;
      '+ '*) news[at]+=${news[at]:+$'\n'}${line#+ } ;;
      '+') ;;  # nothing in its place
      'seen by: '*) seen_by[at]=${line#seen by: } ;;
      'no fault: '*) excuses[at]=${line#no fault: } ;;
      '' | '#'*) ;;
      *) echo "$list: what is '$line'?" >&2; exit 2 ;;
    esac
  done <$list
}

# The faults that the arguments name.
chosen() {
  local i word
  for i in "${!names[@]}"; do
    [ $# -gt 0 ] || echo "$i"
    for word in "$@"; do
      if [ "$word" = $((i + 1)) ] || [[ ${files[i]} == "${word%/}"/* ]]; then echo "$i"; fi
    done
  done | sort -nu
}

# Only what has changed gets a new time, so that only that is built again.
copy_sources() {
  mkdir -p "$work/source"
  git ls-files -z --cached --others --exclude-standard |
    while IFS= read -r -d '' file; do
      [ -f "$file" ] || continue
      cmp -s "$file" "$work/source/$file" && continue
      mkdir -p "$work/source/$(dirname "$file")"
      cp "$file" "$work/source/$file"
    done
  cmake -S "$work/source" -B "$work/source/build" -G Ninja -DCMAKE_BUILD_TYPE=Release >"$work/configure.log"
}

build() { nice -n 19 cmake --build "$work/source/build" --target "$@" -j "${CMAKE_BUILD_PARALLEL_LEVEL:-1}" >"$work/build.log" 2>&1; }

# run TARGET[:FILTER]: prints the first test that fails, or the signal that ended it; false where none does
failed_test() {
  local target=${1%%:*} filter='*' status=0
  [[ $1 != *:* ]] || filter=${1#*:}
  (cd "$work/source/build/tests" && nice -n 19 timeout $longest_s "./$target" --gtest_filter="$filter" \
    --gtest_fail_fast --gtest_brief=1) >"$work/test.log" 2>&1 || status=$?
  [ $status != 0 ] || return 1
  sed -n 's/^\[  FAILED  \] \([^ ,]*\).*/\1/p' "$work/test.log" | grep -m 1 . || echo "$target ended with status $status"
}

# A test proves nothing of a fault where it fails without one: prints which does; false where it passes. What has passed
# once is known by the program that was run.
fails_without() {
  local failed known
  [ -z "${passed[$1]:-}" ] || return 1
  build "${1%%:*}" || { echo "${1%%:*} does not build without any fault"; return; }
  known="$1 $(sha256sum <"$work/source/build/tests/${1%%:*}")"
  if ! grep -qxF -- "$known" "$work/passed"; then
    if failed=$(failed_test "$1"); then echo "${1%%:*} fails without any fault: $failed"; return; fi
    echo "$known" >>"$work/passed"
  fi
  return 1
}

# plant FILE OLD NEW: false where the old text is not there exactly once
plant() {
  perl -0777 -e 'my ($file, $old, $new) = @ARGV; open(my $in, "<", $file) or exit 4; my $text = <$in>; close $in;
    exit 3 if (() = $text =~ /\Q$old\E/g) != 1; $text =~ s/\Q$old\E/$new/; open(my $out, ">", $file); print $out $text' "$@"
}

# Sets `outcome` to what became of fault $1.
try_fault() {
  local i=$1 test failed
  local file=$work/source/${files[i]}
  outcome=survived
  for test in ${seen_by[i]}; do
    if failed=$(fails_without "$test"); then outcome=$failed; return; fi
    passed[$test]=yes
    cp "$file" "$work/original"
    if ! plant "$file" "${olds[i]}" "${news[i]}"; then outcome='stale: the old text is not there once'; return; fi
    if ! build "${test%%:*}"; then
      outcome='does not build'
    elif failed=$(failed_test "$test"); then
      outcome="caught by ${test%%:*}: $failed"
    fi
    cp "$work/original" "$file"
    [ "$outcome" = survived ] || return 0
  done
}

read_list
if [ "${1:-}" = --list ]; then
  shift
  for i in $(chosen "$@"); do printf '%3d  %-34s %s\n' $((i + 1)) "${files[i]}" "${names[i]}"; done
  exit
fi
mapfile -t which < <(chosen "$@")
[ ${#which[@]} -gt 0 ] || { echo "no fault is named so: tests/mutations.sh --list" >&2; exit 2; }
declare -A passed
copy_sources
touch "$work/passed"
table=() n_caught=0 n_excused=0
for i in "${which[@]}"; do
  try_fault "$i"
  case $outcome in
    caught*) n_caught=$((n_caught + 1)) ;;
    survived) [ -z "${excuses[i]}" ] || { outcome="no fault: ${excuses[i]}"; n_excused=$((n_excused + 1)); } ;;
  esac
  table+=("$(printf '%3d  %-34s %-62s %s' $((i + 1)) "${files[i]}" "${names[i]}" "$outcome")")
  echo "${table[-1]}"
done
printf '\n%s\n' "number, file, fault, what became of it"
printf '%s\n' "${table[@]}"
echo "$n_caught of ${#which[@]} caught, $n_excused are no faults"
[ $((n_caught + n_excused)) = ${#which[@]} ]
