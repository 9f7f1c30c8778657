/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_TINYGLTF_H
#define QMAT_IO_GLTF_TINYGLTF_H

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

/* Takes the triangles of one primitive in world space: 3 * vertex_count doubles, and 3 * triangle_count ids below
 * vertex_count. What it returns, unless QMAT_OK, ends the reading. */
typedef qmat_status qmat_gltf_sink(void *user, const double *positions, size_t vertex_count, const uint32_t *corners,
                                   size_t triangle_count);

typedef struct qmat_gltf_counts {
  size_t primitives_read, primitives_skipped, meshes_placed, meshes_skinned;
} qmat_gltf_counts;

/* Gives the triangles of the first scene of `text` to `sink`, node by node, parents first. The text is glTF JSON as
 * qmat_gltf_document_read leaves it, `buffers` what its buffer views point into. What only the data can tell is checked
 * here: indices, joint ids and Draco data. No exception leaves it. QMAT_ERROR_FORMAT with the element,
 * QMAT_ERROR_GEOMETRY beyond `most` vertices or triangles, QMAT_ERROR_MEMORY, QMAT_ERROR_DEPENDENCY, QMAT_CANCELLED. */
qmat_status qmat_gltf_triangles(qmat_context *context, const char *text, size_t text_length,
                                const qmat_gltf_bytes *buffers, size_t most, qmat_gltf_sink *sink, void *user,
                                qmat_gltf_counts *counts);

#ifdef __cplusplus
}
#endif

#endif
