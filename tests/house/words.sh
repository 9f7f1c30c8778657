#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The words that words.txt lists are in no product code and no page: words.sh SOURCE_FOLDER
set -eu
. "$(dirname "$0")/files.sh"
words=$(cd "$(dirname "$0")" && pwd)/words.txt
cd "$1"
{
  source_files core io nodes graphs
  source_files . | grep '\.md$'
} | LC_ALL=C sort | xargs awk '
  FNR == NR {
    if ($1 == "word") {
      pattern[++count] = $2
      say[count] = $3
      for (i = 4; i <= NF; i++) say[count] = say[count] " " $i
    } else if ($1 == "allow") {
      allowed[$2] = allowed[$2] " " $3
    }
    next
  }
  FNR == 1 {
    for (i = 1; i <= count; i++) {
      skip[i] = 0
      n = split(allowed[pattern[i]] allowed["*"], place, " ")
      for (j = 1; j <= n; j++) if (index(FILENAME, place[j]) == 1) skip[i] = 1
    }
  }
  {
    text = tolower($0)
    gsub(/[^a-z0-9]+/, " ", text)
    text = " " text " "
    for (i = 1; i <= count; i++) {
      if (!skip[i] && text ~ (" " pattern[i] " ")) {
        print FILENAME ":" FNR ": not a word of the field (" say[i] "): " $0
        bad = 1
      }
    }
  }
  END { exit bad }' "$words"
