#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The hints of errors about models and scenes work when they are typed: hints_test.sh PROGRAM
qmat=$1
. "$(dirname "$0")/../../lib.sh"
QMAT_CACHE=off
export QMAT_CACHE

# hint CODE TEXT ARGUMENT...: `qmat mat ARGUMENT...` at 10 % must fail with that text and an option to type at the end of
# its hint, "qmat mat: --OPTION". With this option after the others it must work, and write the file x.*.
hint() {
  code=$1
  text=$2
  shift 2
  rm -f x.*
  expect "$code" "$text" "$qmat" mat --quiet --progress off --epsilon 10% "$@"
  option=$(sed -n 's/.*qmat mat: \(--[a-z]* [^ ,;)]*\).*/\1/p' err.txt)
  if [ -z "$option" ]; then fail "no option in the hint: $*"; fi
  # shellcheck disable=SC2086 # an option and its value
  expect 0 '' "$qmat" mat --quiet --progress off --epsilon 10% "$@" $option
  holds "a file of: $* $option" test -n "$(ls x.* 2>/dev/null)"
}

# Three boxes: a mesh of the name "box" twice, below two groups, and one that is moved and larger.
box_points() {
  printf 'point3f[] points = [(0,0,0),(%s,0,0),(%s,1,0),(0,1,0),(0,0,1),(%s,0,1),(%s,1,1),(0,1,1)]\n' "$1" "$1" "$1" "$1"
  echo 'int[] faceVertexCounts = [4,4,4,4,4,4]'
  echo 'int[] faceVertexIndices = [0,3,2,1,4,5,6,7,0,1,5,4,1,2,6,5,2,3,7,6,3,0,4,7]'
}
{
  echo '#usda 1.0'
  for part in 'a 2' 'b 3'; do
    echo "def Xform \"${part% *}\" { def Mesh \"box\" {"
    box_points "${part#* }"
    echo 'uniform token subdivisionScheme = "none" } }'
  done
} >two.usda
{
  echo '#usda 1.0'
  echo 'def Mesh "cage" {'
  box_points 2
  echo '}'
} >cage.usda
write_box box.off
sed 's/^8 6 0/8 7 0/' box.off >twice.off
echo '4 0 3 2 1' >>twice.off
printf 'OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n' >plane.off

hint 1 'the facet repeats facet' twice.off -o x.ma --set model.defects=refuse
hint 2 "the scene has no mesh 'none'" two.usda -o x.glb --set model.mesh=none
hint 2 "2 different meshes have a path that ends in 'box'" two.usda -o x.ma --set model.mesh=box
hint 2 'this format holds one medial mesh, not 2' two.usda -o x.ma --set model.mesh=all
hint 2 'has no unit of length' box.off -o x.ma --epsilon 0.1mm
hint 1 "Loop's scheme needs triangles" cage.usda -o x.ma --set surface.scheme=loop
hint 1 'encloses no solid' plane.off -o x.ma --set solid.solid=as_is
hint 1 'too many for a skin surface' box.off -o x.glb --epsilon 2% --set skin.method=skin_surface \
  --set skin.spacing=0.02
hint 1 'not certified' box.off -o x.ma --require certified --set errors.epsilon=0.0001%

# Hints and warnings have the names of the graph.
{
  echo 'OFF 16 11 0'
  for x in 0 5; do
    for z in 0 1; do printf '%s 0 %s\n%s 0 %s\n%s 1 %s\n%s 1 %s\n' $x $z $((x + 1)) $z $((x + 1)) $z $x $z; done
  done
  for i in 0 8; do
    for face in '3 2 1 0' '0 1 5 4' '1 2 6 5' '2 3 7 6' '3 0 4 7' '4 5 6 7'; do
      if [ "$i$face" = '04 5 6 7' ]; then continue; fi
      set -- $face
      echo 4 $(($1 + i)) $(($2 + i)) $(($3 + i)) $(($4 + i))
    done
  done
} >open.off
cat >names.yaml <<'END'
qmat: 1
nodes:
  file: { type: scene.read, params: { path: open.off } }
  body: { type: mesh.solid, in: { mesh: file.mesh } }
  field: { type: mesh.sdf, in: { mesh: body.mesh } }
  points: { type: mesh.sample, in: { mesh: body.mesh, thickness: field.thickness } }
outputs: { samples: points.samples }
END
expect 0 "node 'body': the openings of 1 component are closed" "$qmat" run names.yaml
holds 'the warning has the name of the node' grep -q -e '--set body.solid=sheet keeps' err.txt
expect 0 '' "$qmat" run names.yaml --set body.solid=sheet
expect 2 "spacing is 0.5mm, but the model has no unit of length" "$qmat" run names.yaml --set points.spacing=0.5mm
holds 'the hint has the name of the node' grep -q -e "state the file's unit: --set file.unit=mm)" err.txt

# A name that two meshes have, and one that none has, in glTF.
holds 'a scene' "$qmat" mat --quiet --progress off two.usda -o two.glb --epsilon 10%
hint 2 "no node references a mesh named or numbered 'none'" two.glb -o x.glb --set model.mesh=none

# Hints without an option name endings and numbers that exist.
expect 2 'known endings: .glb' "$qmat" mat box.off -o x.stl
for ending in $(sed -n 's/.*known endings: \(.*\))/\1/p' err.txt | tr -d ','); do
  case $ending in
    .yaml) hint 2 "cuRobo's YAML holds spheres only" box.off --colliders -o x.yaml ;;
    .urdf | .xml) expect 0 '' "$qmat" mat --quiet --progress off box.off --colliders --epsilon 10% -o "x$ending" ;;
    *) expect 0 '' "$qmat" mat --quiet --progress off box.off --epsilon 10% -o "x$ending" ;;
  esac
done
cp box.off box.glb
expect 1 'rename or convert the file' "$qmat" mat box.glb -o x.ma
finish
