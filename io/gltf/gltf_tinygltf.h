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

/* Receives the triangles of one primitive: 3 * vertex_count doubles, and 3 * triangle_count ids below vertex_count;
 * `joints` and `weights` have 4 a vertex as in qmat_mesh, or are NULL in world space and without a skin. `which` is the
 * mesh's index among the requested meshes, 0 for a scene. Any status but QMAT_OK stops the reader. */
typedef qmat_status qmat_gltf_sink(void *user, size_t which, const double *positions, size_t vertex_count,
                                   const uint32_t *corners, size_t triangle_count, const uint32_t *joints,
                                   const double *weights);

typedef struct qmat_gltf_counts {
  size_t primitives_read, primitives_skipped, meshes_placed, meshes_skinned;
  size_t meshes_of_several_weights; /* their nodes move the morph targets differently */
} qmat_gltf_counts;

/* Passes triangles to `sink`. If `meshes` is NULL: the first scene in world space, node by node, parents first. Else:
 * the meshes with those mesh_count valid ids, each in its own space, with the mesh's morph weights and without
 * skinning, but with joints and weights where a node has a skin. `text` is the JSON of qmat_gltf_document_read; its
 * buffer views refer to `buffers`. Indices, joint ids and Draco data are checked here because they depend on the data.
 * `scales` (mesh_count numbers, NULL with `meshes`) gets for each mesh the largest length that its nodes, or the joints
 * of its skin, make of a unit; 1 where that is no length. No exception escapes. QMAT_ERROR_FORMAT with the element,
 * QMAT_ERROR_GEOMETRY beyond `most` vertices or triangles, QMAT_ERROR_MEMORY, QMAT_ERROR_DEPENDENCY, QMAT_CANCELLED. */
qmat_status qmat_gltf_triangles(qmat_context *context, const char *text, size_t text_length,
                                const qmat_gltf_bytes *buffers, size_t most, const uint32_t *meshes, size_t mesh_count,
                                double *scales, qmat_gltf_sink *sink, void *user, qmat_gltf_counts *counts);

#ifdef __cplusplus
}
#endif

#endif
