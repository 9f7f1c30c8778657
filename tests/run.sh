#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs packages, builds and tests everything:
# - with gcc, optimised: all tests, and the whole program on generated and, where present, real models;
# - with clang and the address and undefined-behaviour sanitizers: all tests but the long ones, and a minute of fuzzing;
# - with clang and the thread sanitizer: the tests of code that runs on several threads.
# A compiler warning is an error. The last line counts: N passed, N failed, N skipped. The lines before it list each skip
# with its reason and the disk space that was used. Exit code 0 when nothing failed.
set -u
cd "$(dirname "$0")/.." || exit 1
started=$(date +%s)
export LC_ALL=C.UTF-8 # awk writes decimal points
# Several tests at a time, each on all processors: a thread that waits gives its processor away.
export OMP_WAIT_POLICY="${OMP_WAIT_POLICY:-passive}"
passed=0
failed=0
skipped=0
skips=$(mktemp)
counts=$(mktemp)
trap 'rm -f "$skips" "$counts"' EXIT
trap 'exit 1' HUP INT TERM

step() {
  printf '\n== %s (%d s)\n' "$1" $(($(date +%s) - started))
}

# list_skips FILE: the lines "skipped: REASON" of a log. In a log of ctest, each with the name of its test.
list_skips() {
  awk '/^[0-9]+\/[0-9]+ Test: / { test = $3 ": "; summary = 0 }
    /test\(s\), listed below:/ { summary = 1 }
    /^skipped: / { print "  " test substr($0, 10) }
    /^\[  SKIPPED \] test_/ && !summary { if (last !~ /^skipped: /) print "  " test $4 " (no reason given)" }
    { last = $0 }' "$1"
}

finish() {
  if [ -s "$skips" ]; then
    printf '\nSkipped:\n'
    sort -u "$skips"
    if grep -q '(no reason given)$' "$skips"; then failed=$((failed + 1)); fi
  fi
  printf '\nDisk space used:\n'
  du -sh build/* 2>/dev/null | awk '$1 !~ /K$/ { printf "  %6s %s\n", $1, $2 }'
  printf '\n%d passed, %d failed, %d skipped\n' "$passed" "$failed" "$skipped"
  [ "$failed" -eq 0 ]
  exit
}

# build PRESET OPTION...: configure and build; what the compiler says is shown when it fails.
build() {
  preset=$1
  shift
  mkdir -p build
  if cmake --preset "$preset" "$@" >"build/$preset.log" 2>&1 &&
    cmake --build --preset "$preset" -j "$(nproc)" >>"build/$preset.log" 2>&1; then
    passed=$((passed + 1))
    return 0
  fi
  grep -E 'FAILED|error|Error' -A 8 "build/$preset.log" | head -n 80
  tail -n 5 "build/$preset.log"
  echo "The build of '$preset' failed; all of it: build/$preset.log"
  failed=$((failed + 1))
  return 1
}

# attribute FILE NAME: a number in the first lines of ctest's report.
attribute() {
  sed -n "1,12s/.*[[:space:]]$2=\"\([0-9]*\)\".*/\1/p" "$1" | head -n 1
}

# run_ctest PRESET JOBS OPTION...: tests that do not end are stopped, since a hang is a failure.
run_ctest() {
  preset=$1
  jobs=$2
  shift 2
  report=$PWD/build/$preset/ctest.xml
  rm -f "$report"
  ctest --preset "$preset" -j "$jobs" --timeout 1800 --output-junit "$report" "$@"
  result=$?
  if [ ! -s "$report" ] || [ -z "$(attribute "$report" tests)" ]; then
    echo "ctest wrote no report (exit code $result)"
    failed=$((failed + 1))
    return
  fi
  all=$(attribute "$report" tests)
  bad=$(attribute "$report" failures)
  none=$(($(attribute "$report" skipped) + $(attribute "$report" disabled)))
  if [ "$result" -ne 0 ] && [ "$bad" -eq 0 ]; then bad=1; fi
  passed=$((passed + all - bad - none))
  failed=$((failed + bad))
  skipped=$((skipped + none))
  list_skips "build/$preset/Testing/Temporary/LastTest.log" >>"$skips"
}

step "What this needs"
echo "Builds: about 1 GB in $PWD/build. On two cores all of it takes about 40 minutes."
if ! sh .ci/packages.sh packages.txt tests/packages.txt; then
  failed=1
  finish
fi

step "Build, optimised, warnings are errors"
if build release -DQMAT_WERROR=ON -DQMAT_TESTS=ON; then
  step "Tests, optimised"
  # One more than processors: some of these tests wait, for Slurm, for servers, or for clocks.
  run_ctest release $(($(nproc) + 1))
  step "The whole program"
  { sh tests/end_to_end.sh "$PWD/build/release" "$counts"; echo $? >build/end_to_end.result; } | tee build/end_to_end.log
  result=$(cat build/end_to_end.result)
  rm -f build/end_to_end.result
  list_skips build/end_to_end.log >>"$skips"
  ok=0 bad=0 none=0
  read -r ok bad none <"$counts" || bad=1
  if [ "$result" -ne 0 ] && [ "${bad:-0}" -eq 0 ]; then bad=1; fi
  passed=$((passed + ${ok:-0}))
  failed=$((failed + ${bad:-1}))
  skipped=$((skipped + ${none:-0}))
fi

step "Build with the address and undefined-behaviour sanitizers"
if build asan -DQMAT_WERROR=ON; then
  step "Tests with these sanitizers"
  # Tests that build the tree once more, the long ones, and those of the sources and of other languages ran above.
  run_ctest asan "$(nproc)" -LE "builds|long|house|not_c"
fi

step "Build with clang and the thread sanitizer"
if build tsan -DQMAT_WERROR=ON; then
  step "Tests with the thread sanitizer"
  run_ctest tsan "$(nproc)"
fi

step "Done"
finish
