/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_CHECK_H
#define QMAT_IO_GLTF_GLTF_CHECK_H

#include <stddef.h>
#include <stdint.h>

#include <jansson.h>

#include "core/context.h"
#include "io/bytes.h"

/* The bytes of one glTF buffer: exactly byteLength of them. */
typedef struct qmat_gltf_buffer {
  const uint8_t *bytes;
  size_t size;
  uint8_t *owned;  /* of a data URI; else NULL */
  qmat_bytes file; /* of an external file */
} qmat_gltf_buffer;

/* A glTF asset that has been checked, reduced to its geometry. A zeroed one is empty and valid. */
typedef struct qmat_gltf_document {
  size_t buffer_count;
  qmat_gltf_buffer *buffers;
  size_t data_size;           /* of all buffers */
  json_t *extensions_ignored; /* names that the asset uses, but does not require, and that nothing here knows */
  char *text;                 /* the reduced JSON, terminated, NUL-free */
  size_t text_length;
} qmat_gltf_document;

/* Takes a .glb or .gltf apart: checks the container, the JSON, every id, offset, length, count and type that geometry
 * depends on, that the nodes are trees, and that required extensions are known; loads the buffers; and writes what
 * geometry needs as JSON again, in which everything below holds, so that its reader need not check:
 *  - keys: asset, bufferViews, accessors, meshes, nodes, skins, scenes; numbers that must be whole are written whole;
 *  - bufferViews lie inside their buffers, accessors (dense and sparse parts) inside their views;
 *  - primitives keep POSITION, JOINTS_n and WEIGHTS_n with types that glTF allows and equal counts, and the POSITION of
 *    their morph targets; those without POSITION, and points and lines, have an empty attributes object;
 *  - KHR_draco_mesh_compression is the only extension; its primitives have no indices key;
 *  - nodes have finite transforms, at most one parent and no cycle; meshes, skins, joints and children exist;
 *  - exactly one scene, the one to be read.
 * `bytes` must outlive the document, which is freed with qmat_gltf_document_uninit also after a failure.
 * QMAT_ERROR_FORMAT with the element, QMAT_ERROR_IO for external files, QMAT_ERROR_MEMORY. */
qmat_status qmat_gltf_document_read(qmat_context *context, const uint8_t *bytes, size_t size, const char *path,
                                    qmat_gltf_document *document);

void qmat_gltf_document_uninit(qmat_gltf_document *document);

#endif
