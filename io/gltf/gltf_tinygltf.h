/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_TINYGLTF_H
#define QMAT_IO_GLTF_GLTF_TINYGLTF_H

#include <stddef.h>
#include <stdint.h>

#include "core/context.h"

#ifdef __cplusplus
extern "C" {
#endif

/* `size` bytes of one buffer; not owned. */
typedef struct qmat_gltf_bytes {
  const uint8_t *bytes;
  size_t size;
} qmat_gltf_bytes;

/* Takes the triangles of one primitive: 3 * vertex_count doubles, and 3 * triangle_count ids below vertex_count.
 * `which` is the mesh's place among those that were asked for. What it returns, unless QMAT_OK, ends the reading. */
typedef qmat_status qmat_gltf_sink(void *user, size_t which, const double *positions, size_t vertex_count,
                                   const uint32_t *corners, size_t triangle_count);

typedef struct qmat_gltf_counts {
  size_t primitives_read, primitives_skipped, meshes_placed, meshes_skinned;
} qmat_gltf_counts;

/* Gives triangles of `text` to `sink`: of the first scene in world space, node by node, parents first; or, with
 * `meshes` (mesh_count ids below the number of meshes; else NULL), of those meshes in their own spaces, one after the
 * other, with their own weights of morph targets and without the pose of a skin. The text is glTF JSON as
 * qmat_gltf_document_read leaves it, `buffers` what its buffer views point into. What only the data can tell is checked
 * here: indices, joint ids and Draco data. No exception leaves it. QMAT_ERROR_FORMAT with the element,
 * QMAT_ERROR_GEOMETRY beyond `most` vertices or triangles, QMAT_ERROR_MEMORY, QMAT_ERROR_DEPENDENCY, QMAT_CANCELLED. */
qmat_status qmat_gltf_triangles(qmat_context *context, const char *text, size_t text_length,
                                const qmat_gltf_bytes *buffers, size_t most, const uint32_t *meshes, size_t mesh_count,
                                qmat_gltf_sink *sink, void *user, qmat_gltf_counts *counts);

#ifdef __cplusplus
}
#endif

#endif
