/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_VALUE_H
#define QMAT_CORE_VALUE_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <jansson.h>

#include "core/cage.h"
#include "core/context.h"
#include "core/digest.h"

/* Values travel along the edges of a graph. A value is made by one node, sealed, and only read afterwards, by any
 * number of threads. Each concrete type starts with a qmat_value; arrays are flat, 64-byte aligned and padded
 * (qmat_alloc). Positions are double, in the units of the model; indices are uint32_t. */

typedef enum qmat_value_type {
  QMAT_SCENE,
  QMAT_MESH,
  QMAT_FIELD,
  QMAT_SAMPLES,
  QMAT_MEDIAL,
  QMAT_CHAIN,
  QMAT_REPORT,
  QMAT_FILE,
  QMAT_FAILURE,
  QMAT_LIST,
  QMAT_VALUE_TYPE_COUNT
} qmat_value_type;

typedef struct qmat_value {
  qmat_value_type type;
  atomic_uint references;
  bool sealed;
  qmat_digest digest; /* of the content; set by qmat_value_seal */
} qmat_value;

/* The bytes of a file, or of one that it refers to. */
typedef struct qmat_file_part {
  char *name; /* "" for the main part, whose name the user chooses; else what qmat_is_part_name takes */
  size_t size;
  uint8_t *bytes;
} qmat_file_part;

/* Where a value came from, and its name; of glTF the whole asset, so that it can be handed on. */
typedef struct qmat_scene {
  qmat_value base;
  char *name;             /* NUL-terminated UTF-8: the file's base name without its ending */
  char *format;           /* "off", "obj", "ply", "stl", "gltf", "glb", "ma", "usd" */
  double meters_per_unit; /* of the model's unit of length; 0: not known */
  bool is_z_up;           /* else y is up, or it is not known */
  size_t part_count;      /* 0: the asset is not kept */
  qmat_file_part *parts;  /* the file as it was read, then those beside it that it refers to */
  size_t mesh_count;      /* 0: all meshes were placed as one */
  uint32_t *meshes;       /* mesh_count: the asset's meshes that were read, each in its own space */
} qmat_scene;

/* A triangle mesh. Corner k of triangle t is triangles[3 * t + k]. */
typedef struct qmat_mesh {
  qmat_value base;
  size_t vertex_count, triangle_count;
  double *positions;   /* 3 * vertex_count: x y z */
  uint32_t *triangles; /* 3 * triangle_count */
  bool closed;         /* every edge lies on two triangles (an even number, where surfaces touch) */
  bool oriented;       /* both triangles at every edge agree on its side */
  double deviation;    /* how far they are from the surface that they stand for, in model units: 0, they are it */
  qmat_cage cage;      /* empty where nothing is to be subdivided */
} qmat_mesh;

typedef enum qmat_domain { QMAT_PER_FACET, QMAT_PER_VERTEX } qmat_domain;

/* One number per facet or vertex of a mesh. */
typedef struct qmat_field {
  qmat_value base;
  size_t count;
  double *values; /* count */
  qmat_domain domain;
  char *unit; /* "model unit" or "1" */
} qmat_field;

/* Points on a surface: first every vertex of the mesh in its order, then the added ones by facet; behind them may
 * come those of medial.refine. */
typedef struct qmat_samples {
  qmat_value base;
  size_t count, vertex_count; /* all samples, and how many of them are mesh vertices */
  double *positions;          /* 3 * count */
  uint32_t *facets;           /* count: the facet that a sample lies on; a vertex names its first facet */
  double *barycentrics;       /* 3 * count, in that facet's corner order; each triple sums to 1 */
} qmat_samples;

/* A medial mesh: medial spheres joined by medial cones (edges) and medial slabs (triangles). */
typedef struct qmat_medial {
  qmat_value base;
  size_t sphere_count, edge_count, triangle_count;
  double *spheres;     /* 4 * sphere_count: x y z radius */
  uint32_t *edges;     /* 2 * edge_count: lower id first, sorted; holds every edge of every triangle too */
  uint32_t *triangles; /* 3 * triangle_count: ids rising within a triangle, triangles sorted */
  /* The samples that each sphere answers for (the responsible region, eq. 11), in compressed rows:
   * of sphere i, region_samples[region_offsets[i] .. region_offsets[i + 1]). No rows: region_offsets NULL. */
  size_t region_offset_count, region_sample_count; /* sphere_count + 1 or 0; length of region_samples */
  uint32_t *region_offsets;
  uint32_t *region_samples;
} qmat_medial;

/* A medial mesh and the edge collapses that simplify it, in their order: after the first n of them sphere_count - n
 * spheres are left (nodes/simplify/collapse_chain.h). */
typedef struct qmat_chain {
  qmat_value base;
  size_t sphere_count, edge_count, triangle_count; /* of the initial medial mesh */
  double *spheres;                                 /* spheres, edges and triangles as those of qmat_medial */
  uint32_t *edges;
  uint32_t *triangles;
  size_t sample_count;
  uint32_t *owners; /* sample_count: the initial sphere that answers for a sample, UINT32_MAX: none */
  size_t collapse_count;
  uint32_t *ends; /* 2 * collapse_count: the sphere that stays, and the one that goes */
  double *merged; /* 4 * collapse_count: what becomes of the one that stays */
  double *errors; /* collapse_count: what the errors were held to, in diagonals; never falls */
} qmat_chain;

/* Named counts and errors as a JSON object; never times, so that equal work gives an equal digest. */
typedef struct qmat_report {
  qmat_value base;
  json_t *root;
} qmat_report;

/* A finished file in memory: the main part first, then the files it refers to by relative name. */
typedef struct qmat_file {
  qmat_value base;
  char *format; /* "glb", "gltf", "ma", "ply", "usda", "usdz" */
  size_t part_count;
  qmat_file_part *parts;
} qmat_file;

/* Stands in a list for a value that could not be made. */
typedef struct qmat_failure {
  qmat_value base;
  char *reason; /* UTF-8, one line: the type of the node and its error, nothing of where files lie */
} qmat_failure;

/* Values of one type, and what each is of: the meshes of a scene, and all that is made of each of them. Two at least: a
 * list of one is the value itself. Failures stand among them, but are not all of them. */
typedef struct qmat_list {
  qmat_value base;
  size_t count;
  qmat_value **items; /* sealed, owned */
  char **names;       /* count: UTF-8; need not differ */
} qmat_list;

/* Makes an empty, unsealed value of one reference; NULL when memory is short. Fill it with qmat_alloc'd arrays and
 * strings, which it then owns, and seal it. A report starts with an empty JSON object. */
qmat_scene *qmat_scene_new(void);
qmat_mesh *qmat_mesh_new(void);
qmat_field *qmat_field_new(void);
qmat_samples *qmat_samples_new(void);
qmat_medial *qmat_medial_new(void);
qmat_chain *qmat_chain_new(void);
qmat_report *qmat_report_new(void);
qmat_file *qmat_file_new(void);
qmat_failure *qmat_failure_new(void);
/* A list of `count` items and names, all NULL; fill both. */
qmat_list *qmat_list_new(size_t count);

/* The values that `value` stands for: those of a list, or itself; NULL has none. `index` is below the count. */
size_t qmat_value_count(const qmat_value *value);
const qmat_value *qmat_value_at(const qmat_value *value, size_t index);
/* The type of those values, or of those that are no failures. */
qmat_value_type qmat_value_item_type(const qmat_value *value);

/* A sealed failure whose reason is the context's newest error, without its file and the node's id. NULL when memory is
 * short, which is then the newest error. */
qmat_value *qmat_failure_of_error(qmat_context *context);
/* Why a value could not be made; NULL: it was made, and is no failure. The value owns the text. */
const char *qmat_value_failure(const qmat_value *value);

/* Whether `name` is a relative path that leads to a file below its folder: no "..", no "." and nothing empty in it, no
 * backslash, at most 255 bytes. */
bool qmat_is_part_name(const char *name);

/* A copy of `text` that a value can own (qmat_free frees it); NULL when memory is short. */
char *qmat_strdup(const char *text);

/* The bytes of the UTF-8 character that `text` starts with: 1 to 4, also 1 for the zero at its end; 0 when it starts
 * with none. */
size_t qmat_utf8_length(const char *text);
/* Whether all of `text` is UTF-8. */
bool qmat_is_utf8(const char *text);

/* Checks the value (every index in range, every number finite, counts consistent), computes its digest and makes it
 * read-only. QMAT_ERROR_GEOMETRY names the first bad element. Cost: linear in the content. */
qmat_status qmat_value_seal(qmat_context *context, qmat_value *value);

/* One more reader. Returns its argument; NULL gives NULL. Safe from any thread. */
qmat_value *qmat_value_retain(const qmat_value *value);
/* One reader less; the last one frees. NULL is allowed. Safe from any thread. */
void qmat_value_release(qmat_value *value);

/* "mesh", "medial", ... Never NULL. */
const char *qmat_value_type_name(qmat_value_type type);

/* The bytes that the value's arrays hold. */
size_t qmat_value_bytes(const qmat_value *value);

/* The versioned little-endian binary form: what the digest is taken over. That of a list names its items by their
 * digests and does not hold them. Writes a qmat_alloc'd buffer that the caller frees. */
qmat_status qmat_value_serialize(qmat_context *context, const qmat_value *value, uint8_t **bytes, size_t *size);

/* Where the items of a list are found: `find` gives the sealed value whose binary form has that digest and size, for
 * the caller to release; NULL: it has none. */
typedef struct qmat_value_source {
  qmat_value *(*find)(void *user, const qmat_digest *digest, uint64_t size);
  void *user;
} qmat_value_source;

/* The value that `size` bytes describe, sealed; every length is checked against `size` before it is trusted. `items`
 * NULL: lists are refused. QMAT_ERROR_FORMAT, also where an item of a list is not found. */
qmat_status qmat_value_deserialize(qmat_context *context, const uint8_t *bytes, size_t size,
                                   const qmat_value_source *items, qmat_value **value);

#endif
