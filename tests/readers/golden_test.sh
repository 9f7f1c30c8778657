#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The golden files of examples/readers are what the writer makes: golden_test.sh PROGRAM SOURCE_FOLDER [--renew]
set -eu
golden=$2/examples/readers/golden
if [ "${3:-}" = --renew ]; then
  "$1" "$golden"
  exit
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 1' HUP INT TERM
"$1" "$work"
diff -r -q "$work" "$golden"
