#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The built-in graph lod: each level is what qmat mat makes, certified, of fewer spheres the farther it is:
# levels_test.sh PROGRAM MODELS_PROGRAM SOURCE_FOLDER
qmat=$1
models=$2
source=$3
. "$(dirname "$0")/../../lib.sh"
QMAT_CACHE=off
export QMAT_CACHE

# levels MODEL: the three levels of MODEL.off at the epsilons of the graph.
levels() {
  expect 0 "(certified)" "$qmat" run lod --set model="$1.off" --set require=certified -o near=near.ma -o middle=middle.ma \
    -o far=far.ma
  awk '/ spheres describe / { spheres[++count] = $2; certified += /\(certified\)/ }
    / envelope to surface / { errors[count] = $4 + 0 > $9 + 0 ? $4 : $9 }
    END {
      for (i = 1; i <= count; i++) printf "%s spheres, %s %%; ", spheres[i], errors[i]
      exit !(count == 3 && certified == 3 && spheres[1] > spheres[2] && spheres[2] > spheres[3] && errors[3] > 0 &&
             errors[1] < errors[2] && errors[2] < errors[3])
    }' out.txt >figures.txt || fail "$1: certified levels of falling spheres and rising errors: $(cat figures.txt)"
}

# A clean surface, and one of 80 facets, of which a chain of collapses leaves twice the spheres, beyond epsilon.
cp "$source/tests/assets/letter_b.off" .
levels letter_b
"$models" octopus -o octopus.off || die "the model is made"
levels octopus

for level in near@0.5% middle@1% far@2%; do
  file=${level%@*}.ma
  expect 0 "(certified)" "$qmat" mat octopus.off -o mat.ma --epsilon "${level#*@}"
  holds "the $file is that of mat" cmp mat.ma "$file"
done

# Levels as numbers of spheres.
write_box box.off
coarse="samples.spacing=10%"
expect 0 "" "$qmat" run lod --set model=box.off --set far=0 --set far_vertices=4 --set "far_$coarse" -o far=far.ma
expect 0 "" "$qmat" mat box.off -o mat.ma --vertices 4 --set "$coarse"
holds "a level of four spheres is that of mat" cmp mat.ma far.ma
holds "at most four" test "$(head -n 1 far.ma | cut -d ' ' -f 1)" -le 4

finish
