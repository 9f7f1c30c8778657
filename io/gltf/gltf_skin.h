/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_SKIN_H
#define QMAT_IO_GLTF_GLTF_SKIN_H

#include <jansson.h>

#include "core/value.h"
#include "io/bytes.h"

/* Stores the skin of a medial mesh as an ordinary glTF mesh: POSITION, area-weighted NORMAL, indices, COLOR_0, JOINTS_0
 * and WEIGHTS_0 where they are given, one material. */

/* What vertices of a skin may have; NULL: nothing of the kind. */
typedef struct qmat_gltf_vertex_data {
  const uint8_t *colours; /* 4 per vertex: linear RGBA */
  const uint32_t *joints; /* 4 per vertex, below 65536 */
  const double *weights;  /* 4 per vertex, with joints */
} qmat_gltf_vertex_data;

/* The buffer views of a skin that is not compressed. */
enum {
  QMAT_GLTF_SKIN_POSITIONS,
  QMAT_GLTF_SKIN_NORMALS,
  QMAT_GLTF_SKIN_INDICES,
  QMAT_GLTF_SKIN_COLOURS,
  QMAT_GLTF_SKIN_JOINTS,
  QMAT_GLTF_SKIN_WEIGHTS,
  QMAT_GLTF_SKIN_VIEWS
};

/* Describes the data of a skin in a buffer. */
typedef struct qmat_gltf_skin {
  size_t vertex_count, index_count;
  float min[3], max[3];
  bool compressed, wide;           /* wide: 32-bit indices */
  uint32_t position_id, normal_id; /* attribute ids of the Draco data */
  double error;                    /* how far it is from the envelope at most, in model units; 0: not known */
  /* The buffer views, from the start of the skin's data; size 0: there is none. The first is that of Draco's data. */
  size_t offsets[QMAT_GLTF_SKIN_VIEWS], sizes[QMAT_GLTF_SKIN_VIEWS];
} qmat_gltf_skin;

/* Appends the data of `mesh` to `buffer`, padded to 4 bytes. The mesh needs a triangle. `*skin` must be zeroed and then
 * describes the data. Positions are relative to `origin`. If `moved` is above 0, Draco compresses the data with bits
 * chosen for that movement of a vertex (model units), without `more`; with 0 the data are plain. QMAT_ERROR_GEOMETRY
 * names the first vertex beyond single precision; QMAT_ERROR_MEMORY, QMAT_ERROR_DEPENDENCY. Linear. */
qmat_status qmat_gltf_skin_put(qmat_context *context, const qmat_mesh *mesh, const double origin[3],
                               const qmat_gltf_vertex_data *more, double moved, qmat_gltf_skin *skin,
                               qmat_writer *buffer);

/* Adds the views, accessors and mesh of a skin whose data start at `offset` in buffer `buffer`. Adds a material too if
 * `*material` is below 0: white where the skin has colours. `name` may be NULL. With `mark`, the mesh's extras mark it
 * as a skin. They also have its error as qmat_skin_error, and qmat_skin_error_unit "model". `*mesh` gets the mesh's
 * number. False when out of memory. */
bool qmat_gltf_skin_add(json_t *root, const qmat_gltf_skin *skin, json_int_t buffer, size_t offset,
                        json_int_t *material, const char *name, bool mark, json_int_t *mesh);

#endif
