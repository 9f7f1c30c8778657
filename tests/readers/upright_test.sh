#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# USD scenes as GLB: a skinned body and a cube of a scene in centimetres with z up are upright and in metres in three.js
# and in Blender. upright_test.sh PROGRAM SOURCE_FOLDER BUILD_FOLDER. What is not installed is skipped (exit code 77); the
# test of the ES module (js_test.sh) fetches three.js.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 1' HUP INT TERM
cat >"$work/scene.usda" <<'END'
#usda 1.0
(
    metersPerUnit = 0.01
    upAxis = "Z"
)
def SkelRoot "man"
{
    double3 xformOp:translate = (200, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Skeleton "bones" {
        uniform token[] joints = ["hip", "hip/head"]
        uniform matrix4d[] bindTransforms = [((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1)),
            ((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,200,1))]
        uniform matrix4d[] restTransforms = [((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1)),
            ((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,200,1))]
    }
    def Mesh "body"
    {
        rel skel:skeleton = </man/bones>
        point3f[] points = [(-50,-20,0),(50,-20,0),(50,20,0),(-50,20,0),(-50,-20,300),(50,-20,300),(50,20,300),(-50,20,300)]
        int[] faceVertexCounts = [4,4,4,4,4,4]
        int[] faceVertexIndices = [0,3,2,1,4,5,6,7,0,1,5,4,1,2,6,5,2,3,7,6,3,0,4,7]
        int[] primvars:skel:jointIndices = [0,0,0,0,1,1,1,1] (elementSize = 1
            interpolation = "vertex")
        float[] primvars:skel:jointWeights = [1,1,1,1,1,1,1,1] (elementSize = 1
            interpolation = "vertex")
        uniform token subdivisionScheme = "none"
    }
}
def Cube "box"
{
    double size = 100
    double3 xformOp:translate = (0, 500, 50)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
END
QMAT_CACHE=off "$1" mat --quiet --progress off "$work/scene.usda" -o "$work/scene.glb" --epsilon 2% 2>"$work/complaint"

done=
if command -v node >/dev/null 2>&1 && [ -e "$3/reader_packages/node_modules/.complete" ]; then
  cp "$2/tests/readers/upright_test.mjs" "$3/reader_packages"
  node "$3/reader_packages/upright_test.mjs" "$work/scene.glb" "$2/examples/readers"
  done=three.js
fi
if command -v blender >/dev/null 2>&1 &&
  blender --background --factory-startup --python-exit-code 1 --python-expr 'import numpy' >/dev/null 2>&1; then
  cat >"$work/measure.py" <<'END'
import sys
import bpy
import mathutils
import numpy
if "bool" not in vars(numpy):
    numpy.bool = bool  # Blender 3.4 uses this name, which numpy 1.24 has no longer
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=sys.argv[-1])
points = [o.matrix_world @ mathutils.Vector(c) for o in bpy.data.objects if o.type == "MESH" for c in o.bound_box]
low, high = [min(p[k] for p in points) for k in range(3)], [max(p[k] for p in points) for k in range(3)]
# 2 % of a body of 3.2 m is 6.4 cm.
for found, wanted in zip(low + high, [-0.5, -0.2, 0, 2.5, 5.5, 3]):
    assert abs(found - wanted) < 0.07, (low, high)
print("ok Blender")
END
  blender --background --factory-startup --python-exit-code 1 --python "$work/measure.py" -- "$work/scene.glb" \
    >"$work/out" 2>&1 || { tail -n 20 "$work/out"; exit 1; }
  grep '^ok' "$work/out"
  done="$done Blender"
fi
if [ "$done" != 'three.js Blender' ]; then
  echo "skipped in part: tested in ${done:-nothing}, not in three.js and Blender"
  exit 77
fi
