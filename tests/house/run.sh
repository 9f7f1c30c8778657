#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Checks one rule of the house: run.sh RULE ARGUMENT...   runs RULE.sh ARGUMENT..., whose first argument is the sources.
# What allowed.txt lists, by the beginning of a complaint's line, is let pass. An allowance that is no longer needed is a
# mistake, too, so that the list only gets shorter.
set -u
house=$(cd "$(dirname "$0")" && pwd) || exit 1
rule=$1
shift
said=$(mktemp) || exit 1
trap 'rm -f "$said"' EXIT
sh "$house/$rule.sh" "$@" >"$said" 2>&1
code=$?
if [ $code -eq 77 ] || [ ! -e "$house/allowed.txt" ]; then
  cat "$said"
  exit $code
fi
awk -v rule="$rule" -v code=$code '
  FNR == NR {
    if ($1 == rule) {
      text[++count] = $0
      sub(/^[^ ]+ +/, "", text[count])
    }
    next
  }
  {
    for (i = 1; i <= count && index($0, text[i]) != 1; i++) continue
    if (i <= count) used[i] = 1
    else { print; bad = 1 }
    complaints++
  }
  END {
    for (i = 1; i <= count; i++) {
      if (!(i in used)) { print "tests/house/allowed.txt: no longer needed: " rule " " text[i]; bad = 1 }
    }
    exit bad || (code != 0 && !complaints)
  }' "$house/allowed.txt" "$said"
