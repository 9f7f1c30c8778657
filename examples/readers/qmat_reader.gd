# SPDX-FileCopyrightText: 2026 the qmat authors
# SPDX-License-Identifier: MIT
#
# Reads the medial meshes that qmat writes into glTF files (qmat_flat, see FORMAT.md), for Godot 4.2 and later.
# THIS FILE WAS NEVER RUN, for want of a Godot 4. The other readers compute the same and are tested.
#
#   GLTFDocument.register_gltf_document_extension(QmatMedial.Importer.new())   before the scene is imported
#   var medial := QmatMedial.of_node(node)                                     null: the node has no medial mesh
#   medial.add_colliders($StaticBody3D)
class_name QmatMedial
extends RefCounted

## Centres of the spheres, in the space of the node, and their radii.
var centres := PackedVector3Array()
var radii := PackedFloat64Array()
## Numbers of spheres: three a slab, two a cone, one a point.
var slabs := PackedInt32Array()
var cones := PackedInt32Array()
var points := PackedInt32Array()
## One a sphere, or empty.
var errors := PackedFloat64Array()
## Four a sphere, or empty. The weights of a sphere sum to 1.
var joints := PackedInt32Array()
var weights := PackedFloat64Array()


## Keeps the medial meshes of a glTF file that is imported, as metadata of its nodes. Godot from 4.4 keeps all extras, so
## that of_node works without it.
class Importer:
	extends GLTFDocumentExtension

	func _import_node(_state: GLTFState, _gltf_node: GLTFNode, json: Dictionary, node: Node) -> Error:
		var extras: Variant = json.get("extras")
		if node and extras is Dictionary and extras.has("qmat_flat"):
			node.set_meta("extras", extras)
		return OK


## The medial mesh of a node; null where there is none.
static func of_node(node: Node) -> QmatMedial:
	var extras: Variant = node.get_meta("extras", {})
	if not extras is Dictionary or not extras.get("qmat_flat") is String:
		return null
	return decode(extras["qmat_flat"])


## The medial mesh of the string qmat_flat; null, with an error, where it is damaged.
static func decode(text: String) -> QmatMedial:
	var data := Marshalls.base64_to_raw(text)
	if data.size() < 64 or data.slice(0, 4).get_string_from_ascii() != "QMAT" or data.decode_u16(4) != 1:
		push_error("not a medial mesh of qmat, or one of a later version")
		return null
	var flags := data.decode_u16(6)
	var count := data.decode_u32(8)
	var sizes := [data.decode_u32(12) * 3, data.decode_u32(16) * 2, data.decode_u32(20)]
	var real := 4 if flags & 1 else 2
	var width := 4 if flags & 2 else 2
	var needed := 64 + 4 * real * count
	if flags & 4:
		needed += _aligned(real * count)
	for size: int in sizes:
		needed += _aligned(width * size)
	if flags & 8:
		needed += 16 * count
	if flags > 15 or count == 0 or needed != data.size():
		push_error("the medial mesh is damaged: its size")
		return null
	var medial := QmatMedial.new()
	var at := 64
	for i in count:
		var row := [0.0, 0.0, 0.0, 0.0]
		for k in 4:
			var stored := data.decode_float(at) if flags & 1 else float(data.decode_u16(at))
			row[k] = data.decode_float(24 + 4 * k) + data.decode_float(40 + 4 * k) * stored
			at += real
			if not is_finite(row[k]) or (k == 3 and row[k] < 0.0):
				push_error("the medial mesh is damaged: sphere %d" % i)
				return null
		medial.centres.append(Vector3(row[0], row[1], row[2]))
		medial.radii.append(row[3])
	if flags & 4:
		for i in count:
			var error := data.decode_float(at + 4 * i) if flags & 1 else data.decode_float(56) * data.decode_u16(at + 2 * i)
			medial.errors.append(error)
		at += _aligned(real * count)
	var lists: Array[PackedInt32Array] = []
	for size: int in sizes:
		var list := PackedInt32Array()
		for i in size:
			var id := data.decode_u32(at + 4 * i) if flags & 2 else data.decode_u16(at + 2 * i)
			if id >= count:
				push_error("the medial mesh is damaged: there is no sphere %d" % id)
				return null
			list.append(id)
		lists.append(list)
		at += _aligned(width * size)
	medial.slabs = lists[0]
	medial.cones = lists[1]
	medial.points = lists[2]
	if flags & 8:
		for i in 4 * count:
			medial.joints.append(data.decode_u16(at + 2 * i))
			medial.weights.append(data.decode_u16(at + 8 * count + 2 * i) / 65535.0)
	return medial


static func _aligned(size: int) -> int:
	return (size + 3) / 4 * 4


## The slabs, cones and points: each an array of three, two or one numbers of spheres.
func simplices() -> Array[PackedInt32Array]:
	var list: Array[PackedInt32Array] = []
	for i in range(0, slabs.size(), 3):
		list.append(slabs.slice(i, i + 3))
	for i in range(0, cones.size(), 2):
		list.append(cones.slice(i, i + 2))
	for i in points.size():
		list.append(points.slice(i, i + 1))
	return list


## Adds a collision shape for each slab, cone and point: a sphere, or the convex hull of points on its spheres.
func add_colliders(body: CollisionObject3D, per_sphere := 32) -> void:
	for ids in simplices():
		var collider := CollisionShape3D.new()
		if ids.size() == 1:
			var sphere := SphereShape3D.new()
			sphere.radius = maxf(radii[ids[0]], 0.001)
			collider.shape = sphere
			collider.position = centres[ids[0]]
		else:
			var hull := ConvexPolygonShape3D.new()
			var corners := PackedVector3Array()
			for id in ids:
				for k in (per_sphere if radii[id] > 0.0 else 1):
					corners.append(centres[id] + radii[id] * _direction(k, per_sphere))
			hull.points = corners
			collider.shape = hull
		body.add_child(collider)


## Directions that cover the sphere evenly: a Fibonacci spiral.
static func _direction(k: int, count: int) -> Vector3:
	var z := 1.0 - (2.0 * k + 1.0) / count
	var turn := k * PI * (3.0 - sqrt(5.0))
	return Vector3(cos(turn) * sqrt(1.0 - z * z), sin(turn) * sqrt(1.0 - z * z), z)


## The signed distance: outside exact; inside below 0, and the solid is at least as deep.
func distance(point: Vector3) -> float:
	var best := INF
	for ids in simplices():
		if ids.size() == 3:
			best = minf(best, _slab(ids[0], ids[1], ids[2], point))
		elif ids.size() == 2:
			best = minf(best, _cone(ids[0], ids[1], point))
		else:
			best = minf(best, point.distance_to(centres[ids[0]]) - radii[ids[0]])
	return best


## The point of the solid's convex hull that is farthest along `direction`.
func support(direction: Vector3) -> Vector3:
	var best := -INF
	var point := Vector3.ZERO
	var along := direction.normalized()
	for i in centres.size():
		var reach := centres[i].dot(along) + radii[i]
		if reach > best:
			best = reach
			point = centres[i] + radii[i] * along
	return point


## The distance at which a ray along the unit vector `direction` meets the solid, 0 from within; -1: not within `most`.
func ray(origin: Vector3, direction: Vector3, most: float) -> float:
	var at := 0.0
	while at <= most:
		var step := distance(origin + at * direction)
		if step <= 1e-5:
			return at
		at += step
	return -1.0


func _cone(i: int, k: int, point: Vector3) -> float:
	var axis := centres[k] - centres[i]
	var offset := point - centres[i]
	var square := axis.length_squared()
	var slope := radii[k] - radii[i]
	if square <= slope * slope:
		return minf(offset.length() - radii[i], point.distance_to(centres[k]) - radii[k])
	var t := offset.dot(axis) / square
	var x := clampf(t + (offset - t * axis).length() * slope / sqrt(square * (square - slope * slope)), 0.0, 1.0)
	return (offset - x * axis).length() - radii[i] - x * slope


func _slab(a: int, b: int, c: int, point: Vector3) -> float:
	var u := centres[b] - centres[a]
	var v := centres[c] - centres[a]
	var offset := point - centres[a]
	var ru := radii[b] - radii[a]
	var rv := radii[c] - radii[a]
	var normal := u.cross(v)
	var area := normal.length_squared()
	var uu := u.length_squared()
	var uv := u.dot(v)
	var vv := v.length_squared()
	if area > 1e-10 * uu * vv:
		# The gradient of the radius over the plane is i u + j v. Where it is below 1 there are two tangent planes.
		var i := (vv * ru - uv * rv) / area
		var j := (uu * rv - uv * ru) / area
		var steep := 1.0 - (i * ru + j * rv)
		if steep > 0.0:
			var lean := absf(offset.dot(normal)) / sqrt(area * steep)
			var x := (vv * offset.dot(u) - uv * offset.dot(v)) / area + i * lean
			var y := (uu * offset.dot(v) - uv * offset.dot(u)) / area + j * lean
			if x >= 0.0 and y >= 0.0 and x + y <= 1.0:
				return (offset - x * u - y * v).length() - radii[a] - x * ru - y * rv
	return minf(minf(_cone(a, b, point), _cone(b, c, point)), _cone(a, c, point))
