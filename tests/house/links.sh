#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# What the pages point at is there, as are the scripts that they name: links.sh SOURCE_FOLDER
set -eu
. "$(dirname "$0")/files.sh"
cd "$1"
source_files . | grep '\.md$' | xargs awk '
  /^```/ { fenced = !fenced; next }
  !fenced {
    folder = FILENAME
    sub(/[^\/]*$/, "", folder)
    text = $0
    while (match(text, /\]\([^)]+\)/)) {
      target = substr(text, RSTART + 2, RLENGTH - 3)
      text = substr(text, RSTART + RLENGTH)
      sub(/#.*/, "", target)
      if (target != "" && target !~ /^[a-z]+:/) print folder target "\t" FILENAME ":" FNR
    }
    text = $0
    while (match(text, /`sh [a-z_.\/]+\.sh/)) {
      print "./" substr(text, RSTART + 4, RLENGTH - 4) "\t" FILENAME ":" FNR
      text = substr(text, RSTART + RLENGTH)
    }
  }' | {
  bad=0
  while IFS='	' read -r target place; do
    if [ ! -e "$target" ]; then
      echo "$place: there is no ${target#./}"
      bad=1
    fi
  done
  exit $bad
}
