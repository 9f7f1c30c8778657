/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_COMPRESS_H
#define QMAT_IO_GLTF_GLTF_COMPRESS_H

#include <stddef.h>
#include <stdint.h>

#include <jansson.h>

#include "core/context.h"

#define QMAT_GLTF_DRACO "KHR_draco_mesh_compression"

/* What came of it. A zeroed one is empty and valid. */
typedef struct qmat_gltf_compressed {
  uint8_t *chunk; /* the binary chunk anew, owned; NULL: nothing was compressed, all is as it was */
  size_t chunk_size;
  size_t mesh_count;
  double *moved;           /* mesh_count, owned: no position of that mesh moves farther, in the mesh's units */
  size_t primitives, left; /* that were compressed, and that stay as they were */
} qmat_gltf_compressed;

/* Compresses the triangles of a glTF asset by KHR_draco_mesh_compression, all attributes of each primitive, and takes
 * what they were out of the binary chunk. `root` is the asset's JSON, of which a primitive's accessors, the buffer
 * views and the first buffer change; on failure it is in between. `chunk` has `size` bytes. `error` is how far a
 * position may be moved, in parts of the largest side of the primitive's box; at least 14 bits are taken. Normals get
 * 10 bits, texture coordinates 12, colours 8, other floats 12; whole numbers stay as they are. Vertices are reordered,
 * split and dropped as edgebreaker does, degenerate triangles go.
 *
 * Left as they are: what is compressed already, is no indexed triangle list, has morph targets, shares data with
 * another primitive that has other triangles, is not in the chunk, has types that glTF does not allow, or is nothing
 * that Draco can encode; and all of an asset that uses an extension which may refer to the data in ways that are not
 * known here. `notes` (an array) gains a text for each reason. QMAT_ERROR_MEMORY. Free with
 * qmat_gltf_compressed_uninit, also after a failure. One thread; the same bytes for the same input. Cost: linear. */
qmat_status qmat_gltf_compress(qmat_context *context, json_t *root, const uint8_t *chunk, size_t size, double error,
                               json_t *notes, qmat_gltf_compressed *compressed);

void qmat_gltf_compressed_uninit(qmat_gltf_compressed *compressed);

#endif
