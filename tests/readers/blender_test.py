# SPDX-License-Identifier: GPL-3.0-or-later
"""The Blender add-on against the golden files: python3 blender_test.py FOLDER_OF_READERS tests decoding, and 10,000
mutations of each; blender --background --factory-startup --python-exit-code 1 --python blender_test.py -- FOLDER the rest."""
import base64
import json
import math
import pathlib
import random
import sys

folder = pathlib.Path(sys.argv[-1])
sys.path.insert(0, str(folder))
sys.dont_write_bytecode = True
import qmat_blender  # noqa: E402


def json_of(file):
    data = file.read_bytes()
    return json.loads(data[20:20 + int.from_bytes(data[12:16], "little")] if file.suffix == ".glb" else data)


def expected_of(file):
    return json.loads(file.with_suffix(".expected.json").read_text())


def check_medial(medial, expected):
    assert len(medial.spheres) == len(expected["spheres"])
    for found, wanted in zip(medial.spheres, expected["spheres"]):
        assert math.dist(found[:3], wanted[:3]) + abs(found[3] - wanted[3]) <= expected["within"] * (1 + 1e-9)
    for kind in ("slabs", "cones", "points"):
        assert [list(ids) for ids in getattr(medial, kind)] == expected[kind], kind
    assert (medial.errors is None) == ("errors" not in expected)
    for i, error in enumerate(expected.get("errors", [])):
        assert error + expected["within"] * (1 - 1e-9) <= medial.errors[i] < error + 1.1 * expected["within"] + 1e-6
    assert (medial.joints is None) == (medial.weights is None) == ("joints" not in expected)
    for i, joints in enumerate(expected.get("joints", [])):
        assert list(medial.joints[i]) == joints
        assert all(abs(a - b) < 1e-4 for a, b in zip(medial.weights[i], expected["weights"][i]))


def mutate(data):
    chance, decoded = random.Random(1), 0
    for _ in range(10000):
        size = len(data) if chance.random() < 0.75 else chance.randrange(len(data))
        changed = bytearray(data[:size] + (bytes(chance.randrange(16)) if chance.random() < 0.1 else b""))
        for _ in range(chance.randrange(6)):
            if changed:
                changed[chance.randrange(min(len(changed), 64) if chance.random() < 0.5 else len(changed))] = chance.randrange(256)
        try:
            medial = qmat_blender.decode(bytes(changed))
        except ValueError:
            continue
        decoded += 1
        assert all(i < len(medial.spheres) for ids in medial.slabs + medial.cones + medial.points for i in ids)
    assert 500 < decoded < 9500, decoded


def check_hull(child, spheres):
    """Every vertex is on one of the spheres, and each sphere's own points are within. The surface is closed."""
    mesh = child.data
    points = [tuple(vertex.co) for vertex in mesh.vertices]
    for point in points:
        assert min(abs(math.dist(point, s[:3]) - s[3]) for s in spheres) < 1e-5, child.name
    if not any(s[3] > 0 for s in spheres):
        assert len(points) == len(spheres)
        return
    uses = {}
    for polygon in mesh.polygons:
        for key in polygon.edge_keys:
            uses[key] = uses.get(key, 0) + 1
    assert uses and all(count == 2 for count in uses.values()), child.name
    assert len(points) - len(uses) + len(mesh.polygons) == 2, child.name
    for polygon in mesh.polygons:  # the normals point outwards, and no sphere is cut deeper than its facets allow
        normal, centre = polygon.normal, polygon.center
        for s in spheres:
            depth = sum(normal[k] * (s[k] - centre[k]) for k in range(3))
            assert depth < 1e-5 - 0.9 * s[3] or s[3] == 0 and depth < 1e-5, (child.name, depth, s)


def test_in_blender(file, expected):
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    qmat_blender.register()
    assert bpy.ops.import_scene.qmat(filepath=str(file)) == {"FINISHED"}
    carriers = [item for item in bpy.data.objects if "qmat_flat" in item]
    assert len(carriers) == 1
    children = {child.name: child for child in carriers[0].children}
    spheres = [qmat_blender.turned(s) for s in expected["spheres"]]
    for i, sphere in enumerate(spheres):
        child = children.pop("sphere %d" % i)
        assert math.dist(child.location, sphere[:3]) + abs(child.scale[0] - sphere[3]) <= expected["within"] + 1e-5
    decoded = [qmat_blender.turned(s) for s in qmat_blender.decode(carriers[0]["qmat_flat"]).spheres]
    for kind in ("slab", "cone", "point"):
        for i, ids in enumerate(expected[kind + "s"]):
            check_hull(children.pop("%s %d" % (kind, i)), [decoded[k] for k in ids])
    assert not children
    if carriers[0].type == "MESH":  # its medial mesh is in the space of its mesh
        assert max(abs(x) for vertex in carriers[0].data.vertices for x in vertex.co) <= 1 + 1e-6
    # Only hulls, for an object that is there already.
    before = len(bpy.data.objects)
    bpy.ops.object.select_all(action="DESELECT")
    carriers[0].select_set(True)
    assert bpy.ops.object.qmat_show(spheres=False, detail=1) == {"FINISHED"}
    assert len(bpy.data.objects) == before + sum(len(expected[kind]) for kind in ("slabs", "cones", "points"))
    qmat_blender.unregister()


files = sorted(file for file in (folder / "golden").iterdir() if file.suffix in (".glb", ".gltf"))
assert len(files) >= 6
for file in files:
    text = json_of(file)["nodes"][0]["extras"]["qmat_flat"]
    if qmat_blender.bpy:
        test_in_blender(file, expected_of(file))
    else:
        check_medial(qmat_blender.decode(text), expected_of(file))
        mutate(base64.b64decode(text))
        for wrong in ("", "QMAT", text[:-4], text + "!!!!"):
            try:
                qmat_blender.decode(wrong)
                raise AssertionError(wrong)
            except ValueError:
                pass
    print("ok", file.name, flush=True)
print("done")
