#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The page about graph files: its graphs are right, and its limits those of the program.
# reference_test.sh PROGRAM SOURCE_FOLDER
qmat=$1
source=$2
. "$(dirname "$0")/../../lib.sh"
QMAT_CACHE=off
export QMAT_CACHE
page=$source/graphs/README.md

# Each block is a whole graph.
awk '/^```/ && !fenced { fenced = 1; file = "block" ++n "." substr($0, 4); next }
  /^```/ { fenced = 0; next }
  fenced { print >file }' "$page"
holds "the page has two graphs" test "$(ls block* | wc -l)" -eq 2
for block in block*; do expect 0 "" "$qmat" check "$block"; done

# The first runs as the page says, and saves what it says.
write_box box.off
expect 0 "" "$qmat" run block1.yaml --set model=box.off --set epsilon=10% -o asset=box.ma --quiet
holds "the output with a path is saved" test -s results/report.json

# limit WORDS FILE NAME: the number that the page has with these words is that of the source.
limit() {
  number=$(sed -n "s/.*\b$3 = \([0-9< ]*\).*/\1/p" "$source/graphs/$2" | head -n 1)
  shown=$(echo "$(($number))" | sed 's/\([0-9]\)\([0-9]\{3\}\)$/\1,\2/')
  holds "the limit '$1' of $shown" grep -q "^| $1.*| $shown\b" "$page"
}
limit "entries of one mapping" yaml_tree.h QMAT_TREE_MAX_ENTRIES
limit "mappings within mappings" yaml_tree.h QMAT_TREE_MAX_DEPTH
limit "a value" graph_params.h QMAT_GRAPH_MAX_TEXT
holds "the limit of a file" grep -q "QMAT_TREE_MAX_BYTES = 1 << 20" "$source/graphs/yaml_tree.h"
holds "the limit of an id" grep -q "QMAT_GRAPH_NAME_SIZE = 64 " "$source/graphs/graph.h"
finish
