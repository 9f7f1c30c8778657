#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# What people see on terminals of 80 and 60 columns, and what programs see: terminal_test.sh PROGRAM SOURCE_FOLDER
qmat=$1
source=$2
. "$(dirname "$0")/../../lib.sh"
QMAT_CACHE=$work/cache
TERM=xterm
export QMAT_CACHE TERM
unset COLUMNS
plus=$source/graphs/qmat_plus.yaml
coarse="--epsilon 5% --set samples.spacing=10%"

# on COLUMNS COMMAND: its output on a terminal of that width, as it was written in raw.txt, and line by line without
# colours in shown.txt. A line that is drawn again counts as another.
on() {
  columns=$1
  script -qec "stty cols $columns rows 30; $2" /dev/null </dev/null >raw.txt 2>&1
  code=$?
  sed 's/\x1b\[[0-9;]*[mK]//g' raw.txt | tr '\r' '\n' | sed '/^$/d' >shown.txt
  cp raw.txt out.txt
  holds "$columns columns: nothing is wider: $2" awk -v most="$columns" '
    { gsub(/[\200-\277]/, ""); if (length($0) > most) { print "too wide: " $0; bad = 1 } } END { exit bad }' shown.txt
}

# left: the lines that a terminal shows at the end, without those that were drawn over.
left() {
  sed 's/\x1b\[[0-9;]*m//g; s/\r$//; s/.*\r//; s/\x1b\[K//g' raw.txt | sed '/^$/d'
}

widths="80 60"
if ! script -qec true /dev/null </dev/null >/dev/null 2>&1; then
  echo "skipped: what terminals show (this system has none: /dev/pts is not mounted)"
  widths=
fi
write_box box.off
cp box.off "a box with a name that is so long that it alone takes more columns than there are on any of these terminals.off"
long=$(ls a*.off)
for columns in $widths; do
  on $columns "$qmat mat box.off -o box$columns.glb $coarse --force"
  holds "mat" test $code -eq 0
  left >left.txt
  if [ $columns -eq 80 ]; then holds "a summary of three lines" test "$(wc -l <left.txt)" -eq 3; fi
  holds "what was made" grep -q '^box: [0-9]* spheres describe 12 triangles (certified)' left.txt
  holds "how good it is" grep -q '^  surface to envelope [0-9.]* %, envelope to surface [0-9.]* %' left.txt
  holds "which files" grep -q "^  box$columns.glb ([0-9.]* [kM]*B) in [0-9.]* s" left.txt
  holds "the model and its step are named" grep -q '^box \[1/12\] model' shown.txt
  holds "progress only moves forward, to the end" sh -c '
    sed -n "s/^box .* \([0-9]*\) %.*/\1/p" shown.txt >shares.txt
    [ -s shares.txt ] && sort -n -c shares.txt && [ "$(tail -n 1 shares.txt)" -ge 90 ]'
  on $columns "$qmat mat box.off -o box.glb -o box.gltf -o box.ma $coarse --verbose"
  holds "a table of the nodes" grep -q '^simple .*from cache .*[0-9]* spheres' shown.txt
  holds "no digests and no words of the cache" sh -c '! grep -q "[0-9a-f]\{12\}\|hit" shown.txt'
  on $columns "$qmat mat '$long' -o box.glb $coarse"
  on $columns "$qmat mat missing.off -o box.glb"
  holds "a failing run is told" grep -q '^qmat: missing.off: ' shown.txt
  on $columns "$qmat run $plus --dry-run --set model=box.off --set epsilon=5% --set samples.spacing=10%"
  holds "what would run" grep -q '^simple .*from cache' shown.txt
  on $columns "$qmat help mat"
  on $columns "$qmat help"
done

# A batch: a line as each model ends, three lines, and what failed.
write_graph graph.yaml 20%
mkdir models
for name in one two three; do cp box.off models/$name.off; done
echo "OFF 1 2" >models/broken.off
for columns in $widths; do
  on $columns "$qmat batch $plus --inputs 'models/*.off' --out results --set epsilon=5% --set samples.spacing=10% -v"
  holds "batch" test $code -eq 1
  left >left.txt
  holds "a line per model" test "$(grep -c '^\[[1-4]/4\] models/' left.txt)" -eq 4
  holds "a summary" grep -q '^3 done, 1 failed, 0 not run: [0-9]* spheres' left.txt
  holds "the largest errors" grep -q '^  surface to envelope [0-9.]* %, envelope' left.txt
  holds "the files" grep -q '^  3 files in results (' left.txt
  holds "what failed" grep -q '^models/broken.off:1:6: ' left.txt
done

# No terminal: no control characters, and 80 columns but for the paths.
expect 0 "spheres" "$qmat" mat box.off -o box.glb $coarse --force -v
holds "no control characters" sh -c '! grep -q "[[:cntrl:]]" out.txt err.txt'
holds "80 columns" sh -c '! grep -q ".\{81\}" out.txt'
expect 1 "1 failed" "$qmat" batch graph.yaml --inputs 'models/*.off' --out results
holds "no control characters of a batch" sh -c '! grep -q "[[:cntrl:]]" out.txt err.txt'
expect 0 "spheres" env COLUMNS=40 "$qmat" mat box.off -o box.glb $coarse -v
holds "COLUMNS" sh -c '! grep -q ".\{41\}" out.txt'

# The later of two opposites wins.
expect 0 "" "$qmat" mat box.off -o box.glb $coarse --verbose --quiet
holds "quiet after verbose" test ! -s out.txt
expect 0 "medial.simplify" "$qmat" mat box.off -o box.glb $coarse --quiet --verbose

finish
