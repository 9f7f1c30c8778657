#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Searches for inputs that break a reader, with libFuzzer: run.sh [--minutes M] [--program FILE] [TARGET...]
# M minutes (default: 1) are divided among the targets (default: all). FILE is a built qmat_fuzz; without it the preset
# asan builds one. Inputs that break a reader stay in build/fuzz/found; exit code 1 then.
# Add an input that broke a reader to tests/fuzz/corpus/TARGET: the test fuzz.corpus repeats it with every compiler.
set -u
top=$(cd "$(dirname "$0")/../.." && pwd) || exit 2
build=$top/build/fuzz
minutes=1
program=
while :; do
  case ${1:-} in
    --minutes) minutes=$2 ;;
    --program) program=$2 ;;
    *) break ;;
  esac
  shift 2
done

work=$(mktemp -d) || exit 2
trap 'rm -rf "$work"' EXIT
trap 'exit 1' HUP INT TERM
if [ -z "$program" ]; then
  program=$top/build/asan/qmat_fuzz
  if ! (cd "$top" && cmake --preset asan && cmake --build --preset asan --target qmat_fuzz) >"$work/build.log" 2>&1; then
    tail -n 40 "$work/build.log"
    exit 1
  fi
fi

if [ $# -eq 0 ]; then
  for folder in "$top"/tests/fuzz/corpus/*; do set -- "$@" "$(basename "$folder")"; done
fi
seconds=$(awk -v minutes="$minutes" -v targets=$# 'BEGIN { s = int(60 * minutes / targets); print s < 1 ? 1 : s }')
LSAN_OPTIONS=suppressions=$top/tests/known_leaks.txt:print_suppressions=0
CMOCKA_TEST_ABORT=1 # the checks of shared test code
export LSAN_OPTIONS CMOCKA_TEST_ABORT
failed=0
mkdir -p "$build/found"
for target in "$@"; do
  corpus=$top/tests/fuzz/corpus/$target
  dictionary=$top/tests/fuzz/dictionaries/$target.dict
  mkdir -p "$build/grown/$target" "$work/real/$target"
  # Small real files join the corpus where they are present.
  find "$top/../shared/data" -name "*.$target" -size -64k -exec cp {} "$work/real/$target" \; 2>"$work/said"
  if [ -e "$dictionary" ]; then dictionary=-dict=$dictionary; else dictionary=-use_value_profile=1; fi
  # Inputs that reach new code stay in build/fuzz/grown, where the next run continues.
  if "$program" "$target" -max_total_time="$seconds" -timeout=20 -rss_limit_mb=2048 -max_len=65536 \
    -print_final_stats=1 -artifact_prefix="$build/found/$target-" "$dictionary" "$build/grown/$target" "$corpus" \
    "$work/real/$target" >"$work/said" 2>&1; then
    echo "ok      fuzz: $target: $(sed -n 's/^stat::number_of_executed_units: *//p' "$work/said") inputs in $seconds s"
  else
    failed=1
    echo "FAILED  fuzz: $target: $(sed -n 's/.*Test unit written to //p' "$work/said" | head -n 1)"
    grep -E 'ERROR|SUMMARY|violated|runtime error|allocated at once|^ *#[0-9]+ .* in (qmat|[a-z_]+ /)' "$work/said" |
      head -n 20 | sed 's/^/        /'
  fi
done
exit $failed
