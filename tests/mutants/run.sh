#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Shows that the tests find defects: run.sh [--check] [NUMBER or NAME...]
# Applies the one-line defects of mutants.txt (default: all) one at a time to a copy of the sources in build/mutants,
# builds the named test, and runs it. A mutant is caught when the test fails. Exit code 1 when one survives, does not
# build, or does not apply. --check only checks that each text occurs exactly once, and builds nothing.
# QMAT_CMAKE_OPTIONS holds more options for cmake.
set -u
top=$(cd "$(dirname "$0")/../.." && pwd) || exit 2
list=$top/tests/mutants/mutants.txt
tree=$top/build/mutants
check=
if [ "${1:-}" = --check ]; then
  check=yes
  shift
fi
work=$(mktemp -d) || exit 2
trap 'rm -rf "$work"' EXIT
trap 'exit 1' HUP INT TERM
separator=$(printf '\037') # a separator that no text holds

# A mutant a line: number, name, text, replacement, test.
awk -v separator="$separator" '
  /^#/ { next }
  /^- / { text = substr($0, 3); next }
  /^\+ / { with = substr($0, 3); next }
  /^\+$/ { with = ""; next }
  NF == 0 { state = 0; next }
  state == 0 { name = $0; state = 1; next }
  { print ++number separator name separator text separator with separator $0 }' "$list" >"$work/mutants"
for wanted in "$@"; do
  if ! awk -F "$separator" -v wanted="$wanted" '$1 == wanted || $2 == wanted { print; found = 1 } END { exit !found }' \
    "$work/mutants" >>"$work/wanted"; then
    echo "mutants: there is no mutant $wanted" >&2
    exit 2
  fi
done
if [ $# -gt 0 ]; then mv "$work/wanted" "$work/mutants"; fi

# find_text ROOT TEXT: sets file to the one file that holds the text, and count to how often it occurs.
find_text() {
  (cd "$1" && grep -rnF --include='*.[ch]' --include='*.cpp' --include='*.yaml' -e "$2" core io nodes graphs) \
    >"$work/found"
  count=$(wc -l <"$work/found")
  file=$(cut -d : -f 1 "$work/found" | head -n 1)
}

failed=0
while IFS=$separator read -r number name text with test; do
  find_text "$top" "$text"
  if [ "$count" -eq 1 ]; then continue; fi
  failed=1
  echo "FAILED  mutant $number $name: its text occurs $count times, not once: $text"
done <"$work/mutants"
if [ -n "$check" ] || [ $failed -ne 0 ]; then
  [ $failed -ne 0 ] || echo "ok      $(wc -l <"$work/mutants") mutants apply"
  exit $failed
fi

# The copy keeps its build. Only files that differ are replaced, and so compiled again: also one that an interrupted run
# left mutated.
mkdir -p "$tree"
(cd "$top" && find CMakeLists.txt core io nodes graphs tests examples cmake -type f) | LC_ALL=C sort >"$work/wanted"
(cd "$tree" && find core io nodes graphs tests examples cmake -type f 2>"$work/log") | LC_ALL=C sort >"$work/present"
LC_ALL=C comm -13 "$work/wanted" "$work/present" | while read -r file; do rm -f "$tree/$file"; done
while read -r file; do
  cmp -s "$top/$file" "$tree/$file" && continue
  mkdir -p "$tree/$(dirname "$file")" && cp "$top/$file" "$tree/$file" || exit 2
done <"$work/wanted"
# shellcheck disable=SC2086 # options are words
if ! cmake -S "$tree" -B "$tree/build/release" -G Ninja -DCMAKE_BUILD_TYPE=Release -DQMAT_TESTS=ON \
  ${QMAT_CMAKE_OPTIONS:-} >"$work/log" 2>&1; then
  tail -n 20 "$work/log"
  exit 2
fi
ninja -C "$tree/build/release" -t targets all >"$work/targets"

# target_of TEST: what has to be built for it: its own program, or qmat for tests that are shell scripts.
target_of() {
  target=$(echo "$1" | tr . _)_test
  grep -q "^$target:" "$work/targets" || target=qmat
  echo "$target"
}

# build_and_run TEST, which may need the generated models, too: 0: the test passes; 1: it fails; 2: it cannot be built.
build_and_run() {
  ninja -C "$tree/build/release" "$(target_of "$1")" qmat_models >"$work/log" 2>&1 || return 2
  ctest --test-dir "$tree/build/release" -R "^$(echo "$1" | sed 's/\./\\./g')\$" --no-tests=error --timeout 600 \
    >"$work/log" 2>&1 || return 1
}

for test in $(cut -d "$separator" -f 5 "$work/mutants" | sort -u); do
  build_and_run "$test" && continue
  echo "FAILED  $test fails without a mutant:"
  tail -n 20 "$work/log"
  exit 1
done

caught=0
while IFS=$separator read -r number name text with test; do
  find_text "$tree" "$text"
  cp "$tree/$file" "$work/original"
  started=$(date +%s)
  TEXT=$text WITH=$with awk '{
    at = index($0, ENVIRON["TEXT"])
    if (at) $0 = substr($0, 1, at - 1) ENVIRON["WITH"] substr($0, at + length(ENVIRON["TEXT"]))
    print
  }' "$work/original" >"$tree/$file"
  build_and_run "$test" </dev/null
  result=$?
  cp "$work/original" "$tree/$file"
  seconds=$(($(date +%s) - started))
  case $result in
    1) caught=$((caught + 1)) && echo "ok      mutant $number $name: caught by $test ($seconds s)" ;;
    0) failed=1 && echo "FAILED  mutant $number $name survives $test: $file: $with" ;;
    *) failed=1 && echo "FAILED  mutant $number $name does not build: $file" && grep -m 3 error "$work/log" ;;
  esac
done <"$work/mutants"
echo "mutants: $caught of $(wc -l <"$work/mutants") caught"
exit $failed
