/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_COMPRESS_H
#define QMAT_IO_GLTF_GLTF_COMPRESS_H

#include <stddef.h>
#include <stdint.h>

#include <jansson.h>

#include "core/context.h"

#define QMAT_GLTF_DRACO "KHR_draco_mesh_compression"

/* The result of compression. A zeroed one is empty and valid. */
typedef struct qmat_gltf_compressed {
  uint8_t *chunk; /* the new binary chunk, owned; NULL: nothing was compressed or changed */
  size_t chunk_size;
  size_t mesh_count;
  double *moved;           /* mesh_count, owned: bound on the movement of positions, in the mesh's units */
  size_t primitives, left; /* numbers of compressed and of unchanged primitives */
} qmat_gltf_compressed;

/* Compresses triangle primitives with all their attributes by KHR_draco_mesh_compression and removes the old data from
 * the binary chunk. `root` is the asset's JSON: its primitives, accessors, buffer views and first buffer change. On
 * failure it is inconsistent. `chunk` has `size` bytes. `error` is the allowed movement of a position as a fraction of
 * the largest side of the primitive's box; positions get at least 14 bits. Normals get 10 bits, texture coordinates 12,
 * colours 8, other floats 12; integers are exact. Edgebreaker reorders, splits and drops vertices and drops degenerate
 * triangles.
 *
 * A primitive stays unchanged if it is already compressed, is not an indexed triangle list, has morph targets, shares
 * data with other geometry, a skin or an animation, has data outside the chunk, has invalid or unsupported data, or if
 * Draco cannot encode it. The whole asset stays unchanged if an extension may refer to the data in an unknown way.
 * `notes` (an array) gains a text for each reason. QMAT_ERROR_MEMORY. Free the result with qmat_gltf_compressed_uninit,
 * also after a failure. One thread; the same bytes for the same input. Cost: linear. */
qmat_status qmat_gltf_compress(qmat_context *context, json_t *root, const uint8_t *chunk, size_t size, double error,
                               json_t *notes, qmat_gltf_compressed *compressed);

void qmat_gltf_compressed_uninit(qmat_gltf_compressed *compressed);

#endif
