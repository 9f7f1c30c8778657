#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# No product file has more than 700 lines, no function more than 80, from the first line of its head to its closing brace,
# and the product no more lines than tests/house/product_lines says: sizes.sh SOURCE_FOLDER
#
# The layout that clang-format gives is relied on: a declaration starts in the first column, a function's head ends with
# "{" and its closing brace stands alone in the first column (methods: in the third).
set -eu
cd "$1"
most_lines=$(cat tests/house/product_lines)
find core io nodes graphs -name '*.[ch]' -o -name '*.cpp' | LC_ALL=C sort | xargs awk -v most_lines="$most_lines" \
  -v most_file=700 -v most_function=80 '
  function wrong(text) { print text; bad = 1 }
  function end_file() {
    if (lines > most_file) wrong(file ": " lines " lines, at most " most_file)
  }
  # Starts at column 0 or, in a struct or class of C++, at column 2.
  function begins(line) {
    return inside_class ? line ~ /^  [A-Za-z_~]/ : line ~ /^[A-Za-z_]/
  }
  FNR == 1 {
    if (NR > 1) end_file()
    file = FILENAME
    inside_comment = inside_function = inside_class = inside_macro = 0
    head = ""
  }
  { lines = FNR }
  inside_macro { inside_macro = /\\$/; next }
  /^#/ { inside_macro = /\\$/; next }
  inside_comment { if (/\*\//) inside_comment = 0; next }
  !inside_function && head == "" && /^ *\/\*/ { if (!/\*\//) inside_comment = 1; next }
  inside_function {
    if ($0 == closing || $0 ~ "^" closing "[ ;]") {
      size = FNR - start + 1
      if (size > most_function) wrong(file ":" start ": " size " lines, at most " most_function ": " head)
      inside_function = 0
      head = ""
    }
    next
  }
  inside_class && /^}/ { inside_class = 0; head = ""; next }
  head == "" && begins($0) {
    head = $0
    start = FNR
  }
  head != "" {
    if (/\{$/) {
      text = FNR == start ? head : head $0
      if (text ~ /^(namespace|extern "C")/) {
        head = ""
      } else if (file ~ /\.cpp$/ && text ~ /^(struct|class|template <[^(]*> *(struct|class)) [^(]*\{$/) {
        inside_class = 1
        head = ""
      } else if (text ~ /\(/ && text !~ /^[^(]*=/ && text !~ /^ *(typedef|enum|union) /) {
        inside_function = 1
        closing = inside_class ? "  }" : "}"
      } else {
        # An initialiser or a type: it ends where a line starts with its closing brace, which begins nothing.
        head = ""
      }
    } else if (/[;}]( *\/\*.*\*\/)?$/ || /;[ \t]*\/\//) {
      head = ""
    } else if (FNR > start) {
      head = head $0
    }
  }
  END {
    end_file()
    if (NR > most_lines) wrong("the product has " NR " lines, at most " most_lines " (tests/house/product_lines)")
    exit bad
  }'
