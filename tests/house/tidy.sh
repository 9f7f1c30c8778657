#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# clang-tidy with the checks of .clang-tidy has nothing to say about C code: tidy.sh SOURCE_FOLDER BUILD_FOLDER
# The build folder has the compile commands. Code that is not part of the build, such as the examples' game, is left out.
set -eu
cd "$1"
if ! clang-tidy --version 2>/dev/null | grep -q 'version 14\.'; then
  echo "skipped: there is no clang-tidy 14 (Debian: apt install clang-tidy)"
  exit 77
fi
files=$(sed -n 's/^ *"file": "\(.*\.c\)",*$/\1/p' "$2/compile_commands.json" | grep "^$PWD/" | grep -v "^$2/" | LC_ALL=C sort -u)
if [ -z "$files" ]; then
  echo "$2/compile_commands.json has no C file of $PWD"
  exit 1
fi
echo "$files" | xargs -n 8 -P "$(nproc)" clang-tidy -p "$2" --quiet --warnings-as-errors='*' \
  --extra-arg=-Wno-unknown-warning-option 2>/dev/null
