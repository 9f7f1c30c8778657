#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The Blender add-on of examples/readers, in a Blender without a window: blender_test.sh SOURCE_FOLDER
set -eu
if ! command -v python3 >/dev/null 2>&1; then
  echo "skipped: there is no python3 (Debian: apt install python3)"
  exit 77
fi
test=$1/tests/readers/blender_test.py
python3 "$test" "$1/examples/readers"
if ! command -v blender >/dev/null 2>&1; then
  echo "skipped in part: there is no Blender (Debian: apt install blender)"
  exit 77
fi
if ! blender --background --factory-startup --python-exit-code 1 --python-expr 'import numpy' >/dev/null 2>&1; then
  echo "skipped in part: Blender's glTF importer needs numpy (Debian: apt install python3-numpy)"
  exit 77
fi
out=$(mktemp)
trap 'rm -f "$out"' EXIT
trap 'exit 1' HUP INT TERM
PYTHONDONTWRITEBYTECODE=1 blender --background --factory-startup --python-exit-code 1 --python "$test" -- "$1/examples/readers" \
  >"$out" 2>&1 || { tail -n 20 "$out"; exit 1; }
grep '^ok' "$out"
grep -q '^done$' "$out" || { tail -n 20 "$out"; exit 1; }
