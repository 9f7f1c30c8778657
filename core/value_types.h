/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_VALUE_TYPES_H
#define QMAT_CORE_VALUE_TYPES_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <jansson.h>

#include "core/cage.h"
#include "core/digest.h"
#include "core/rig.h"

/* The types of value that travel along the edges of a graph. Each struct starts with a qmat_value. Arrays are flat,
 * 64-byte aligned and padded (qmat_alloc). Positions are double, in the units of the model; indices are uint32_t.
 *
 * A new type is two edits: its struct and its line in QMAT_VALUE_TYPES here, and its block in core/value_table.c. */

/* Every type but the list, as QMAT_<NAME> and qmat_<name>. Append new types at the end. */
#define QMAT_VALUE_TYPES(TYPE) \
  TYPE(SCENE, scene)           \
  TYPE(MESH, mesh)             \
  TYPE(FIELD, field)           \
  TYPE(SAMPLES, samples)       \
  TYPE(MEDIAL, medial)         \
  TYPE(CHAIN, chain)           \
  TYPE(REPORT, report)         \
  TYPE(FILE, file)             \
  TYPE(FAILURE, failure)       \
  TYPE(COLLIDERS, colliders)

#define QMAT_ENUMERATOR(NAME, name) QMAT_##NAME,
typedef enum qmat_value_type { QMAT_VALUE_TYPES(QMAT_ENUMERATOR) QMAT_LIST, QMAT_VALUE_TYPE_COUNT } qmat_value_type;
#undef QMAT_ENUMERATOR

/* What is made of a sealed value when it is first needed, and freed with it. It never changes. */
typedef struct qmat_kept {
  void (*free)(struct qmat_kept *kept);
} qmat_kept;

/* What all types share. */
typedef struct qmat_value {
  qmat_value_type type;
  atomic_uint references;
  bool sealed;
  qmat_digest digest; /* of the serialised form; set by qmat_value_seal */
  /* Of a mesh: its surface with sheets and without (qmat_surface_new); NULL where none was needed yet. */
  _Atomic(qmat_kept *) kept[2];
} qmat_value;

/* A file in memory: the main file, or one that it refers to. */
typedef struct qmat_file_part {
  char *name; /* "" for the main part, whose name the user chooses; else a name that qmat_is_part_name accepts */
  size_t size;
  uint8_t *bytes;
} qmat_file_part;

/* Where a model came from: its name, unit and up axis. A glTF scene keeps the whole asset, so that it can be written
 * again with the result; a USD scene keeps the places of its meshes, and its file, or a package of its files. */
typedef struct qmat_scene {
  qmat_value base;
  char *name;             /* UTF-8: the file's base name without its extension */
  char *format;           /* "off", "obj", "ply", "stl", "gltf", "glb", "ma", "usd" */
  double meters_per_unit; /* the model's unit of length; 0: unknown */
  bool is_z_up;           /* false: y is up, or the up axis is unknown */
  size_t part_count;      /* 0: the asset was not kept */
  qmat_file_part *parts;  /* the file as read, then the side files that it refers to */
  size_t mesh_count;      /* 0: all meshes of the asset were merged into one */
  uint32_t *meshes;       /* mesh_count: indices of the asset's meshes that were read, each in its own coordinates */
  /* Where the meshes of a USD scene are, one by one; none where they were merged. glTF has this in its nodes. */
  size_t placement_count;
  uint32_t *placed;       /* placement_count: a mesh, from 0 to mesh_count - 1 */
  double *placements;     /* 16 * placement_count: from the mesh's space into the scene's, p' = (p, 1) * m by rows */
  char **placement_paths; /* placement_count: of the prim with the mesh */
  /* placement_count: 1 where the scene itself says whether the prim moves: it or one above it is a rigid body, or it is
   * a collider; else 0. */
  uint32_t *placement_bodies;
  bool has_instances; /* prims are marked as instanceable: the prims below them take no opinions */
  qmat_rig rig;       /* of a USD scene */
} qmat_scene;

/* A triangle mesh. Corner k of triangle t is triangles[3 * t + k]. The first triangles bound solids; the last ones may
 * be sheets, surfaces without volume. */
typedef struct qmat_mesh {
  qmat_value base;
  size_t vertex_count, triangle_count;
  double *positions;           /* 3 * vertex_count: x y z */
  uint32_t *triangles;         /* 3 * triangle_count */
  size_t sheet_triangle_count; /* the last so many triangles are sheets; 0 for a mesh with a cage */
  /* Of these, the last so many are flaps: they stick out of solids by less than an error that is allowed. They count
   * as surface, but no medial slabs are made of them. */
  size_t flap_triangle_count;
  double sheet_thickness; /* of sheets, in model units; 0: none */
  /* Of the triangles that bound solids. */
  bool closed;      /* every edge has two triangles, or an even number where surfaces touch */
  bool oriented;    /* neighbouring triangles agree on which side is outside */
  double deviation; /* bound on the distance to the surface that the triangles approximate, in model units; 0: exact */
  qmat_cage cage;   /* the subdivision cage; empty when nothing is to be subdivided */
  /* Metres per unit of its positions, where its nodes make it largest; 0: unknown. */
  double meters_per_unit;
  /* The skin: 4 joints per vertex and their weights, as in qmat_medial. */
  size_t skinned_count; /* vertex_count, or 0 without a skin */
  uint32_t *joints;     /* 4 * skinned_count */
  double *weights;      /* 4 * skinned_count */
} qmat_mesh;

typedef enum qmat_domain { QMAT_PER_FACET, QMAT_PER_VERTEX } qmat_domain;

/* One number per facet or vertex of a mesh, or per sphere of a medial mesh (its vertices). */
typedef struct qmat_field {
  qmat_value base;
  size_t count;
  double *values; /* count */
  qmat_domain domain;
  char *unit; /* "model unit" or "1" */
} qmat_field;

/* Points on a surface: first every mesh vertex in mesh order, then the added points by facet, then the points that
 * medial.refine added. */
typedef struct qmat_samples {
  qmat_value base;
  size_t count, vertex_count; /* all samples; the mesh vertices among them */
  double *positions;          /* 3 * count */
  uint32_t *facets;           /* count: the facet that contains a sample; for a vertex its first facet */
  double *barycentrics;       /* 3 * count: in the facet's corner order; each triple sums to 1 */
} qmat_samples;

/* A medial mesh: medial spheres joined by medial cones (edges) and medial slabs (triangles). */
typedef struct qmat_medial {
  qmat_value base;
  size_t sphere_count, edge_count, triangle_count;
  double *spheres;           /* 4 * sphere_count: x y z radius */
  uint32_t *edges;           /* 2 * edge_count: lower id first, sorted; contains every side of every triangle */
  uint32_t *triangles;       /* 3 * triangle_count: ids ascending within a triangle, triangles sorted */
  size_t sheet_sphere_count; /* the first so many spheres are those of sheets; 0: none, or not known */
  /* The responsible region (eq. 11) of sphere i is region_samples[region_offsets[i] .. region_offsets[i + 1]).
   * region_offsets is NULL when no regions are known. */
  size_t region_offset_count, region_sample_count; /* sphere_count + 1, or 0; the length of region_samples */
  uint32_t *region_offsets;
  uint32_t *region_samples;
  /* The skin: up to 4 joints per sphere, numbered as in the skin of the model. Weights descend and sum to 1. An unused
   * place has joint 0 and weight 0. A pose moves the centre c to the sum of weight * joint matrix * c. */
  size_t skinned_count; /* sphere_count, or 0 without a skin */
  uint32_t *joints;     /* 4 * skinned_count */
  double *weights;      /* 4 * skinned_count */
} qmat_medial;

/* A medial mesh and the sequence of edge collapses that simplifies it. Applying the first n leaves sphere_count - n
 * spheres (nodes/simplify/collapse_chain.h). */
typedef struct qmat_chain {
  qmat_value base;
  size_t sphere_count, edge_count, triangle_count; /* of the initial medial mesh */
  double *spheres;                                 /* spheres to sheets as in qmat_medial */
  uint32_t *edges;
  uint32_t *triangles;
  size_t sheet_sphere_count;
  size_t sample_count;
  uint32_t *owners; /* sample_count: the initial sphere whose region contains a sample; UINT32_MAX: none */
  size_t collapse_count;
  uint32_t *ends;             /* 2 * collapse_count: the sphere that stays, then the sphere that is removed */
  double *merged;             /* 4 * collapse_count: the sphere that stays, after the collapse */
  double *errors;             /* collapse_count: the tolerance of each collapse, in diagonals; never decreases */
  double meters_per_diagonal; /* the length of the surface's diagonal in metres; 0: unknown */
  size_t bounded_count;       /* levels with proved bounds */
  uint32_t *bounded;          /* bounded_count: their numbers of collapses, rising */
  double *bounds;             /* 2 * bounded_count: surface to envelope and envelope to surface at most, in diagonals */
} qmat_chain;

/* Shapes for collision detection and the rigid body that they stand for. A shape is the convex hull of one, two or
 * three spheres: a sphere, a tapered capsule, a rounded triangle. Its hull is a polyhedron for engines without such
 * shapes. A hull that joins several shapes (medial.colliders with kind=hulls) stands with the spheres of one. */
typedef struct qmat_colliders {
  qmat_value base;
  size_t sphere_count, shape_count, point_count, triangle_count;
  double *spheres;     /* 4 * sphere_count: x y z radius, above 0 */
  uint32_t *shapes;    /* 3 * shape_count: ids of spheres; a capsule repeats its second, a sphere its first */
  double *points;      /* 3 * point_count: of all hulls, shape by shape */
  uint32_t *triangles; /* 3 * triangle_count: point ids, counter-clockwise from outside, shape by shape */
  uint32_t *hull_ends; /* 2 * shape_count: the end of its points, and of its triangles */
  size_t joint_count;  /* shape_count, or 0 without a skin */
  uint32_t *joints;    /* joint_count: the joint that moves a shape, numbered as in qmat_mesh */
  size_t body_count;   /* 1; 0: mass properties are not known */
  /* Mass in kg; centre x y z; inertia about it xx yy zz xy xz yz, in kg times the square of a model unit (products with
   * their sign in the tensor). */
  double *body;
} qmat_colliders;

/* Named counts and errors as a JSON object. It never contains times, so equal results have equal digests. */
typedef struct qmat_report {
  qmat_value base;
  json_t *root;
} qmat_report;

/* A finished file in memory: the main part first, then the side files that it refers to by relative name. */
typedef struct qmat_file {
  qmat_value base;
  char *format; /* "glb", "gltf", "ma", "ply", "usda", "usdz" */
  size_t part_count;
  qmat_file_part *parts;
} qmat_file;

/* Takes the place of a list item that could not be made. */
typedef struct qmat_failure {
  qmat_value base;
  char *reason; /* UTF-8, one line: the node's type and its error, without paths */
} qmat_failure;

/* Values of one type and their names: the meshes of a scene, or what was made from each of them. A list has at least
 * two items; a list of one is the value itself. Some items may be failures, but not all. */
typedef struct qmat_list {
  qmat_value base;
  size_t count;
  qmat_value **items; /* sealed, owned */
  char **names;       /* count: UTF-8; names may repeat */
} qmat_list;

/* One count by which a value is described to the user: "spheres". */
enum { QMAT_MOST_COUNTS = 3 };
typedef struct qmat_value_count_row {
  const char *name; /* in the plural; NULL ends the rows */
  size_t offset;    /* of a size_t in the value */
  bool detail;      /* appears in reports only, not in the line that is printed for a step */
} qmat_value_count_row;

#endif
