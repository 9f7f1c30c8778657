/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_CHECK_H
#define QMAT_IO_GLTF_GLTF_CHECK_H

#include "io/gltf/gltf_document.h"

/* Checks a .glb or .gltf and loads its buffers. The checks cover the container, the JSON, the required extensions, the
 * node trees, and every id, offset, length, count and type that the geometry depends on. The document's text is JSON
 * reduced to the geometry. Its reader can rely on this:
 *  - keys: asset, bufferViews, accessors, meshes, nodes, skins, scenes; whole numbers are written without a fraction;
 *  - bufferViews lie inside their buffers, dense and sparse accessor data inside their views;
 *  - primitives have only POSITION, JOINTS_n and WEIGHTS_n, of valid types and equal counts, and the POSITION of their
 *    morph targets; primitives without POSITION, points and lines have an empty attributes object;
 *  - KHR_draco_mesh_compression is the only extension; its primitives have no indices key;
 *  - nodes have finite transforms, at most one parent and no cycle; meshes, skins, joints and children exist;
 *  - there is exactly one scene: the scene to read;
 *  - with `leaves_skins`, no node has a mesh that qmat has added to others, a skin or a hull.
 * `bytes` must outlive the document. Free it with qmat_gltf_document_uninit, also after a failure.
 * QMAT_ERROR_FORMAT with the element, QMAT_ERROR_IO for external files, QMAT_ERROR_MEMORY. */
qmat_status qmat_gltf_document_read(qmat_context *context, const uint8_t *bytes, size_t size, const char *path,
                                    bool leaves_skins, qmat_gltf_document *document);

void qmat_gltf_document_uninit(qmat_gltf_document *document);

#endif
