#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Code has the layout that clang-format 14 gives: format.sh SOURCE_FOLDER
# `clang-format -i FILE` mends a file.
set -eu
. "$(dirname "$0")/files.sh"
cd "$1"
if ! clang-format --version 2>/dev/null | grep -q 'version 14\.'; then
  echo "skipped: there is no clang-format 14 (Debian: apt install clang-format)"
  exit 77
fi
if source_files core io nodes graphs tests examples | grep -E '\.([ch]|cpp)$' |
  xargs -n 50 -P "$(nproc)" clang-format --style=file --dry-run -Werror --ferror-limit=1 2>&1 | grep ' error: '; then
  exit 1
fi
