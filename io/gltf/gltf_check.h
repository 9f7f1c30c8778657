/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_CHECK_H
#define QMAT_IO_GLTF_GLTF_CHECK_H

#include "io/gltf/gltf_document.h"

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
