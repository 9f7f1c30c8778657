/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_SKIN_H
#define QMAT_IO_GLTF_GLTF_SKIN_H

#include <jansson.h>

#include "core/value.h"
#include "io/bytes.h"

/* The skin of a medial mesh as an ordinary glTF mesh: POSITION, area-weighted NORMAL, indices, one material. */

/* What the JSON says of a skin whose bytes are in a buffer. */
typedef struct qmat_gltf_skin {
  size_t vertex_count, index_count;
  float min[3], max[3];
  bool compressed, wide;           /* wide: 32-bit indices */
  uint32_t position_id, normal_id; /* Draco's */
  size_t sizes[3];                 /* of the buffer views: positions, normals, indices; or Draco's data */
} qmat_gltf_skin;

/* Appends the data of `mesh`, which has a triangle, to `buffer`, padded to 4 bytes; `*skin`, zeroed, describes them.
 * Positions count from `origin`. With `moved` above zero the data are compressed by Draco, which moves a vertex by no
 * more than that (model units); with 0 they are plain. QMAT_ERROR_GEOMETRY names the first vertex that single precision
 * does not hold; QMAT_ERROR_MEMORY, QMAT_ERROR_DEPENDENCY. Linear. */
qmat_status qmat_gltf_skin_put(qmat_context *context, const qmat_mesh *mesh, const double origin[3], double moved,
                               qmat_gltf_skin *skin, qmat_writer *buffer);

/* Adds the views, accessors and mesh of a skin whose data start at `offset` of buffer `buffer`, and its material where
 * `*material` is below 0. `name` may be NULL; with `mark` the mesh's extras say that it is a skin. `*mesh` gets the
 * mesh's number. False when memory is short. */
bool qmat_gltf_skin_add(json_t *root, const qmat_gltf_skin *skin, json_int_t buffer, size_t offset,
                        json_int_t *material, const char *name, bool mark, json_int_t *mesh);

#endif
