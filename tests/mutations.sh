#!/usr/bin/env bash
# Would the suite see a fault? Plants those of tests/mutations.txt, one at a time, in a copy of the sources, builds the
# tests that should see each, and says which does. By hand: it builds the test programs before the first fault.
#   tests/mutations.sh [--list] [NUMBER | FOLDER]...    which faults; none named: all
# MBTFM_MUTATIONS is the folder of copy and build (build-mutations), CMAKE_BUILD_PARALLEL_LEVEL the compilers at once.
set -euo pipefail
cd "$(dirname "$0")/.."
work=$(realpath -m "${MBTFM_MUTATIONS:-build-mutations}")
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
  cmake -S "$work/source" -B "$work/source/build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_EXE_LINKER_FLAGS=-Wl,-z,muldefs ${MBTFM_STRICT:+-DMBTFM_STRICT=$MBTFM_STRICT} >"$work/configure.log"
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

# Compiles $work/planted.cpp in place of source $1, alone, and puts it first into the library: what it defines counts (-z
# muldefs), and the sources that are compiled together with it are not compiled again. False where $1 is in no library.
add_object() {
  local together target command
  together=$(grep -rlF --include='unity_*.cxx' "/$1\"" "$work/source/build" | head -n 1)
  target=$(basename "${together%.dir/Unity/*}")
  library=${together%%/CMakeFiles/*}/lib$target.a
  [ -n "$together" ] && [ -f "$library" ] || return 1
  command=$(ninja -C "$work/source/build" -t commands -s "${together#"$work/source/build/"}.o" |
    sed "s# -Werror # #; s# -MD -MT [^ ]* -MF [^ ]*##; s# -o .*# -o $work/planted.o -c $work/planted.cpp#" | tail -n 1)
  (cd "$work/source/build" && eval "nice -n 19 $command" && ar rcsb "$(ar t "$library" | head -n 1)" "$library" "$work/planted.o") \
    >"$work/build.log" 2>&1
}
remove_object() { ar d "$library" planted.o && ranlib "$library"; }

# Sets `outcome` to what test $2 makes of fault $1, which is in $work/planted.cpp. An object of its own is quick, but a call
# that was inlined elsewhere does not see it: what survives so is built properly.
judge() {
  local failed target=${2%%:*} file=${files[$1]}
  outcome=survived
  if [[ $file == *.cpp ]] && add_object "$file"; then
    if build "$target" && failed=$(failed_test "$2"); then outcome="caught by $target: $failed"; fi
    remove_object
  fi
  [ "$outcome" = survived ] || return 0
  cp "$work/source/$file" "$work/original"
  # what the fault leaves unused is no reason not to build
  { for unused in parameter variable but-set-variable function; do echo "#pragma GCC diagnostic ignored \"-Wunused-$unused\""; done
    cat "$work/planted.cpp"; } >"$work/source/$file"
  if ! build "$target"; then
    outcome='does not build'
  elif failed=$(failed_test "$2"); then
    outcome="caught by $target: $failed"
  fi
  cp "$work/original" "$work/source/$file"
}

# Sets `outcome` to what became of fault $1.
try_fault() {
  local i=$1 test
  cp "$work/source/${files[i]}" "$work/planted.cpp"
  if ! plant "$work/planted.cpp" "${olds[i]}" "${news[i]}"; then outcome='stale: the old text is not there once'; return; fi
  for test in ${seen_by[i]}; do
    if [ -n "${broken[$test]:-}" ]; then outcome=${broken[$test]}; return; fi
    judge "$i" "$test"
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
copy_sources
touch "$work/passed"
declare -A broken  # by test: what is wrong with it without any fault
for test in $(for i in "${which[@]}"; do printf '%s ' "${seen_by[i]}"; done | tr ' ' '\n' | sort -u); do
  ! failed=$(fails_without "$test") || broken[$test]=$failed
done
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
