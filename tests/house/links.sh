#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# What the pages point at is there, as are the scripts that they name. The page of core/geometry names each header of the
# folder: links.sh SOURCE_FOLDER
set -eu
. "$(dirname "$0")/files.sh"
cd "$1"
missing=0
for header in core/geometry/*.h; do
  name=$(basename "$header" .h)
  if ! grep -q "\`$name\(\.h\)\{0,1\}\`" core/geometry/README.md; then
    echo "core/geometry/README.md: it does not name $name.h"
    missing=1
  fi
done
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
  exit $((bad | missing))
}
