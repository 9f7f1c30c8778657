#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The tests of the house fail when they should: house_test.sh SOURCE_FOLDER
# A small tree that keeps the rules is made to break one rule after the other.
set -u
source=$1
unset GIT_DIR GIT_WORK_TREE GIT_INDEX_FILE # those of a hook are of another tree
house=$source/tests/house
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
trap 'exit 1' HUP INT TERM
tree=$work/tree
failures=0

# make_tree: files that keep all rules.
make_tree() {
  rm -rf "$tree"
  mkdir -p "$tree/core/geometry" "$tree/io" "$tree/nodes/measure" "$tree/nodes/simplify" "$tree/graphs/cli" "$tree/tests/house"
  cp "$source/.clang-format" "$source/.clang-tidy" "$tree/"
  cat >"$tree/core/value.h" <<'END'
/* A value. */
int value(int count);
END
  cat >"$tree/core/value.c" <<'END'
#include "core/value.h"

static const int table[] = {
    1,
    2,
};

struct kept {
  int count;
};

int value(int count) {
  if (count > 1) return table[0];
  return table[1];
}
END
  for name in core/geometry/surface io/off nodes/scale nodes/measure/error nodes/simplify/fit graphs/qmat graphs/cli/main; do
    printf '#include "core/value.h"\n\nint %s(void);\n' "$(basename $name)" >"$tree/$name.h"
    printf '#include "%s.h"\n\nint %s(void) {\n  return value(3);\n}\n' "$name" "$(basename $name)" >"$tree/$name.c"
  done
  printf '# A page\n\n[the code](core/value.c), `sh tests/run.sh`\n' >"$tree/README.md"
  printf '# Geometry\n\n`surface`\n' >"$tree/core/geometry/README.md"
  : >"$tree/tests/run.sh"
  echo 9999 >"$tree/tests/house/product_lines"
}

# lines N: that many lines of a function's body.
lines() {
  awk -v n="$1" 'BEGIN { for (i = 0; i < n; i++) print "  value(1);" }'
}

# passes RULE ARGUMENT...: the tree keeps the rule.
passes() {
  rule=$1
  shift
  sh "$house/$rule.sh" "$tree" "$@" >"$work/said" 2>&1
  code=$?
  if [ $code -eq 77 ]; then
    cat "$work/said"
  elif [ $code -ne 0 ]; then
    echo "FAILED: $rule complains about a tree that keeps the rule:"
    cat "$work/said"
    failures=$((failures + 1))
  fi
}

# fails TEXT RULE ARGUMENT...: the tree breaks the rule, and the complaint has the text. The tree is made anew.
fails() {
  text=$1
  rule=$2
  shift 2
  sh "$house/$rule.sh" "$tree" "$@" >"$work/said" 2>&1
  code=$?
  if [ $code -ne 77 ] && { [ $code -eq 0 ] || ! grep -qF -e "$text" "$work/said"; }; then
    echo "FAILED: $rule, exit code $code, does not say: $text"
    cat "$work/said"
    failures=$((failures + 1))
  fi
  make_tree
}

# add FILE LINE: a line at the start of a file.
add() {
  { echo "$2" && cat "$tree/$1"; } >"$work/added" && cp "$work/added" "$tree/$1"
}

make_tree
passes includes
passes sizes
passes words
passes links
passes format
passes versions

# A node's version is in the changelog.
printf 'const qmat_node node = {\n    .name = "mesh.scale",\n    .version = 2,\n};\n' >>"$tree/nodes/scale.c"
printf -- '- `mesh.scale` 21: it is faster.\n' >"$tree/CHANGELOG.md"
fails 'nodes/scale.c: CHANGELOG.md does not say what mesh.scale 2 changes' versions

# Includes point down.
add core/value.c '#include "io/off.h"'
fails 'core/value.c:1: core must not include io' includes
add io/off.c '#include "nodes/scale.h"'
fails 'io/off.c:1: io must not include nodes' includes
add nodes/scale.c '#include "graphs/qmat.h"'
fails 'nodes/scale.c:1: nodes must not include graphs/qmat' includes
add core/value.c '#include "core/geometry/surface.h"'
fails 'core/value.c:1: core must not include core/geometry' includes
add nodes/measure/error.c '#include "nodes/simplify/fit.h"'
fails 'nodes/measure/error.c:1: nodes/measure must not include nodes/simplify' includes
add graphs/qmat.c '#include "graphs/cli/main.h"'
fails 'graphs/qmat.c:1: graphs/qmat must not include graphs/cli' includes
add core/value.c '#include "hash.h"'
fails 'core/value.c:1: an include names the path from the root' includes
mkdir "$tree/nodes/new"
printf 'int x;\n' >"$tree/nodes/new/x.c"
fails 'no row for the folder nodes/new' includes

# Circles, of two and of three modules, through a header or a source.
printf '#include "core/value.h"\n' >"$tree/core/node.h"
add core/value.c '#include "core/node.h"'
fails 'a circle of includes' includes
printf '#include "core/b.h"\n' >"$tree/core/a.c"
printf '#include "core/c.h"\n' >"$tree/core/b.h"
printf '#include "core/a.h"\n' >"$tree/core/c.c"
fails 'core/c.c:1 includes core/a.h' includes

# Lengths. More than 80 lines of a table are no function.
{
  echo 'static const int many[] = {'
  for i in 1 2 3 4 5 6 7 8 9; do printf '    1,\n    2,\n    3,\n    4,\n    5,\n    6,\n    7,\n    8,\n    9,\n'; done
  echo '};'
  echo
  echo 'int error_of(int a,'
  echo '             int b) {'
  echo '  return many[a] + b;'
  echo '}'
} >>"$tree/core/table.c"
passes sizes
{ cat "$tree/io/off.c" && awk 'BEGIN { for (i = 0; i < 695; i++) print "" }'; } >"$work/long"
cp "$work/long" "$tree/io/off.c"
passes sizes
echo >>"$tree/io/off.c"
fails 'io/off.c: 701 lines, at most 700' sizes
for head in 'int long_one(void) {' 'static int *long_one(const int *a, int b) {'; do
  { echo "$head" && lines 78 && echo '}'; } >"$tree/core/long.c"
  passes sizes
  { echo "$head" && lines 79 && echo '}'; } >"$tree/core/long.c"
  fails 'core/long.c:1: 81 lines, at most 80' sizes
done
{ printf 'int long_one(int a,\n             int b) {\n' && lines 78 && echo '}'; } >"$tree/core/long.c"
fails 'core/long.c:1: 81 lines, at most 80' sizes
{ printf 'namespace {\n\nclass Long {\n public:\n  Long() : a_(1) {}\n\n  int one() const {\n' && lines 79 &&
  printf '  }\n\n private:\n  int a_;\n};\n\n}  // namespace\n'; } >"$tree/core/long.cpp"
fails 'core/long.cpp:7: 81 lines, at most 80' sizes
count=$(find "$tree" -name '*.[ch]' -exec cat {} + | wc -l)
echo "$count" >"$tree/tests/house/product_lines"
passes sizes
echo $((count - 1)) >"$tree/tests/house/product_lines"
fails "the product has $count lines, at most $((count - 1))" sizes

# Layout, and what clang-tidy finds.
printf 'int f( void ) { return 1; }\n' >"$tree/core/ugly.c"
fails 'ugly.c' format
mkdir "$work/build"
printf 'int f(int a) {\n  if (a == 1 && a == 1) return 1;\n  return 0;\n}\n' >"$tree/core/twice.c"
printf '[{\n  "directory": "%s",\n  "command": "cc -c %s/core/twice.c",\n  "file": "%s/core/twice.c"\n}]\n' \
  "$work/build" "$tree" "$tree" >"$work/build/compile_commands.json"
fails 'misc-redundant-expression' tidy "$work/build"

# Words and pages.
add core/value.c '/* A notch. */'
fails 'core/value.c:1: not a word of the field' words
add core/value.c 'static int control_points;'
fails 'core/value.c:1: not a word of the field' words
echo 'The Mantle of a cone.' >>"$tree/README.md"
fails 'README.md:4: not a word of the field' words
echo '[a page](missing.md)' >>"$tree/README.md"
fails 'README.md:4: there is no missing.md' links
cp "$tree/core/geometry/surface.h" "$tree/core/geometry/other.h"
fails 'core/geometry/README.md: it does not name other.h' links
rm "$tree/tests/run.sh"
fails 'README.md:3: there is no tests/run.sh' links

# add_made: what the builds of a user leave, which breaks the rules.
add_made() {
  mkdir -p "$tree/examples/game/build" "$tree/examples/page/node_modules/three"
  printf 'int f( void ) { return 1; }\n' >"$tree/examples/game/build/made.c"
  printf 'The mantle of [a page](missing.md)\n' >"$tree/examples/game/build/README.md"
  cp "$tree/examples/game/build/README.md" "$tree/examples/page/node_modules/three/"
}
add_made
passes format
passes words
passes links
if ! command -v git >"$work/said"; then
  echo "skipped: the files of a clone (Debian: apt install git)"
else
  make_tree
  printf 'build/\nnode_modules/\n' >"$tree/.gitignore"
  git init -q "$tree" && git -C "$tree" add . && add_made
  passes format
  passes words
  passes links
  cp -r "$tree" "$work/clone"
  printf '[a page](missing.md)\n' >"$tree/new.md"
  fails 'new.md:1: there is no missing.md' links
  cp -r "$work/clone/." "$tree"
  printf 'int f( void ) { return 1; }\n' >"$tree/core/ugly.c"
  fails 'ugly.c' format
  cp -r "$work/clone/." "$tree"
  rm "$tree/nodes/scale.h" "$tree/README.md" # deleted, and still in the index
  passes format
  passes words
fi

[ "$failures" -eq 0 ]
