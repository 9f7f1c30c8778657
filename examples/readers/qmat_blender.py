# SPDX-FileCopyrightText: 2026 the qmat authors
# SPDX-License-Identifier: MIT
"""Shows the medial meshes that qmat writes into glTF files (qmat_flat, see FORMAT.md) in Blender: every sphere, and the
convex hull of every slab, cone and point, as children of the object that carries them.

Install it under Edit > Preferences > Add-ons. File > Import > glTF with medial meshes reads a file with Blender's own glTF
importer first. Object > Show medial mesh does the second half for objects that are there already, since that importer
keeps qmat_flat as a custom property. decode() needs no Blender."""

import base64
import binascii
import math
import struct

try:
    import bmesh
    import bpy
    from bpy_extras.io_utils import ImportHelper
except ImportError:  # only decode() is wanted
    bpy = None

bl_info = {
    "name": "qmat medial meshes",
    "author": "the qmat authors",
    "version": (1, 0, 0),
    "blender": (3, 4, 0),
    "location": "File > Import > glTF with medial meshes; Object > Show medial mesh",
    "description": "Shows the spheres, cones and slabs of medial meshes in glTF files",
    "category": "Import-Export",
}


class Medial:
    """`spheres` is a list of (x, y, z, radius); `slabs`, `cones` and `points` are lists of tuples of 3, 2 and 1 numbers of
    spheres; `errors`, `joints` and `weights` have one item a sphere, or are None."""


def decode(text):
    """The Medial of the string qmat_flat, or of its bytes. ValueError says what is wrong with it."""
    try:
        data = base64.b64decode(text, validate=True) if isinstance(text, str) else bytes(text)
    except binascii.Error as error:
        raise ValueError("the medial mesh is not base64") from error
    if len(data) < 64 or data[:4] != b"QMAT":
        raise ValueError("not a medial mesh of qmat")
    version, flags, n, s, c, p = struct.unpack_from("<HHIIII", data, 4)
    if version != 1:
        raise ValueError("a later version of qmat_flat")
    number, index = ("f" if flags & 1 else "H"), ("I" if flags & 2 else "H")
    parts = [(number, 4 * n), (number, n if flags & 4 else 0), (index, 3 * s), (index, 2 * c), (index, p),
             ("H", 4 * n if flags & 8 else 0), ("H", 4 * n if flags & 8 else 0)]
    sizes = [(count * struct.calcsize(kind) + 3) // 4 * 4 for kind, count in parts]
    if flags > 15 or n == 0 or 64 + sum(sizes) != len(data):
        raise ValueError("the medial mesh is damaged: its size")
    values, at = [], 64
    for (kind, count), size in zip(parts, sizes):
        values.append(struct.unpack_from("<%d%s" % (count, kind), data, at))
        at += size
    offsets, scales = struct.unpack_from("<4f", data, 24), struct.unpack_from("<4f", data, 40)

    def rows(list_, width):
        return [tuple(list_[i:i + width]) for i in range(0, len(list_), width)]

    medial = Medial()
    medial.spheres = [tuple(offsets[k] + scales[k] * q for k, q in enumerate(row)) for row in rows(values[0], 4)]
    for i, sphere in enumerate(medial.spheres):
        if not all(map(math.isfinite, sphere)) or sphere[3] < 0:
            raise ValueError("the medial mesh is damaged: sphere %d" % i)
    if any(i >= n for ids in values[2:5] for i in ids):
        raise ValueError("the medial mesh is damaged: a simplex")
    medial.slabs, medial.cones, medial.points = rows(values[2], 3), rows(values[3], 2), rows(values[4], 1)
    scale = 1 if flags & 1 else struct.unpack_from("<f", data, 56)[0]
    medial.errors = [scale * q for q in values[1]] if flags & 4 else None
    medial.joints = rows(values[5], 4) if flags & 8 else None
    medial.weights = [tuple(q / 65535 for q in row) for row in rows(values[6], 4)] if flags & 8 else None
    return medial


# ---- Blender ----


def unit_sphere(detail):
    """A new mesh of radius 1."""
    mesh, shape = bpy.data.meshes.new("medial sphere"), bmesh.new()
    bmesh.ops.create_icosphere(shape, subdivisions=detail, radius=1)
    for face in shape.faces:
        face.smooth = True
    shape.to_mesh(mesh)
    shape.free()
    return mesh


def turned(sphere):
    """glTF's y axis is up, Blender's z axis is."""
    x, y, z, radius = sphere
    return (x, -z, y, radius)


def hull_mesh(name, spheres, directions):
    """A new mesh of the convex hull of spheres, each by its points in the given directions."""
    points = []
    for x, y, z, radius in spheres:
        around = directions if radius > 0 else [(0, 0, 0)]
        points += [(x + radius * d[0], y + radius * d[1], z + radius * d[2]) for d in around]
    mesh = bpy.data.meshes.new(name)
    if not any(sphere[3] > 0 for sphere in spheres):  # it is flat
        count = len(points)
        mesh.from_pydata(points, [(0, 1)] if count == 2 else [], [(0, 1, 2)] if count == 3 else [])
        return mesh
    shape = bmesh.new()
    for point in points:
        shape.verts.new(point)
    made = bmesh.ops.convex_hull(shape, input=shape.verts, use_existing_faces=False)
    inside = {item for key in ("geom_interior", "geom_unused") for item in made[key] if isinstance(item, bmesh.types.BMVert)}
    bmesh.ops.delete(shape, geom=list(inside), context="VERTS")
    bmesh.ops.recalc_face_normals(shape, faces=shape.faces)
    shape.to_mesh(mesh)
    shape.free()
    return mesh


def show(carrier, spheres=True, hulls=True, detail=2):
    """Adds the medial mesh of an object as its children, in collections of its name; returns them. None where the object
    has none."""
    text = carrier.get("qmat_flat")
    if not isinstance(text, str):
        return None
    medial, made = decode(text), []
    ball = unit_sphere(detail)
    directions = [tuple(vertex.co) for vertex in ball.vertices]

    def add(name, mesh, collection):
        child = bpy.data.objects.new(name, mesh)
        collection.objects.link(child)
        child.parent = carrier
        made.append(child)
        return child

    def collection_of(kind):
        collection = bpy.data.collections.new("%s %s" % (carrier.name, kind))
        bpy.context.scene.collection.children.link(collection)
        return collection

    turned_spheres = [turned(sphere) for sphere in medial.spheres]
    if spheres:
        collection = collection_of("spheres")
        for i, (x, y, z, radius) in enumerate(turned_spheres):
            child = add("sphere %d" % i, ball, collection)
            child.location, child.scale = (x, y, z), (radius, radius, radius)
            if medial.errors:
                child["qmat_error"] = medial.errors[i]
    if hulls:
        collection = collection_of("hulls")
        for kind, simplices in (("slab", medial.slabs), ("cone", medial.cones), ("point", medial.points)):
            for i, ids in enumerate(simplices):
                name = "%s %d" % (kind, i)
                add(name, hull_mesh(name, [turned_spheres[k] for k in ids], directions), collection)
    if not spheres:
        bpy.data.meshes.remove(ball)
    return made


if bpy:

    class Options:
        spheres: bpy.props.BoolProperty(name="Spheres", default=True, description="Add every sphere")
        hulls: bpy.props.BoolProperty(name="Hulls", default=True, description="Add the convex hulls of slabs, cones, points")
        detail: bpy.props.IntProperty(name="Detail", default=2, min=1, max=5, description="Subdivisions of the spheres")

        def show_all(self, objects):
            count = 0
            try:
                for carrier in objects:
                    count += show(carrier, self.spheres, self.hulls, self.detail) is not None
            except ValueError as error:
                self.report({"ERROR"}, "%s: %s" % (carrier.name, error))
                return {"CANCELLED"}
            if count == 0:
                self.report({"WARNING"}, "no object has a medial mesh")
            return {"FINISHED"}

    class OBJECT_OT_qmat_show(Options, bpy.types.Operator):
        """Show the medial meshes of the selected objects"""

        bl_idname = "object.qmat_show"
        bl_label = "Show medial mesh"
        bl_options = {"REGISTER", "UNDO"}

        def execute(self, context):
            return self.show_all(list(context.selected_objects))

    class IMPORT_OT_qmat(Options, bpy.types.Operator, ImportHelper):
        """Import a glTF file and show its medial meshes"""

        bl_idname = "import_scene.qmat"
        bl_label = "glTF with medial meshes"
        bl_options = {"REGISTER", "UNDO"}
        filename_ext = ".glb"
        filter_glob: bpy.props.StringProperty(default="*.glb;*.gltf", options={"HIDDEN"})

        def execute(self, context):
            import numpy

            if "bool" not in vars(numpy):  # the importer of Blender 3.4 asks for it, and numpy 1.24 of Debian 12 lacks it
                numpy.bool = bool
            before = set(bpy.data.objects)
            bpy.ops.import_scene.gltf(filepath=self.filepath)
            return self.show_all([item for item in bpy.data.objects if item not in before])

    def in_import_menu(self, context):
        self.layout.operator(IMPORT_OT_qmat.bl_idname)

    def in_object_menu(self, context):
        self.layout.operator(OBJECT_OT_qmat_show.bl_idname)

    def register():
        bpy.utils.register_class(OBJECT_OT_qmat_show)
        bpy.utils.register_class(IMPORT_OT_qmat)
        bpy.types.TOPBAR_MT_file_import.append(in_import_menu)
        bpy.types.VIEW3D_MT_object.append(in_object_menu)

    def unregister():
        bpy.types.VIEW3D_MT_object.remove(in_object_menu)
        bpy.types.TOPBAR_MT_file_import.remove(in_import_menu)
        bpy.utils.unregister_class(IMPORT_OT_qmat)
        bpy.utils.unregister_class(OBJECT_OT_qmat_show)
