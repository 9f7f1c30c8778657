/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_H
#define QMAT_IO_GLTF_GLTF_H

#include "io/bytes.h"
#include "io/soup.h"

/* Reads a glTF 2.0 asset, .glb or .gltf (detected from its first bytes), and adds its surface to `soup` in world
 * space. Data may be embedded, external or compressed by KHR_draco_mesh_compression. The surface consists of all
 * triangle lists, strips and fans in the default scene; without a default, in the first scene; without scenes, in all
 * nodes. Each node that references a mesh adds one copy of it. Node transforms are applied in double precision; a
 * mirroring transform reverses the triangles. Skinned meshes take the current pose of their joints (linear blend
 * skinning; as glTF requires, the node's own transform is ignored). Morph targets have their default weights.
 * Degenerate triangles that connect strips are dropped. Materials, textures, cameras, lights, animations and extras
 * are ignored. An unsupported required extension is an error that names it.
 *
 * External files need a relative path inside the asset's folder. Every id, offset, length and count is checked before
 * use. All instances together may have 2^24 vertices and 2^24 triangles, plus 16 of each per byte of data.
 * A node that is a root of the scene and a child of another node is read as a root, once, as engines do.
 * `report` (a JSON object, may be NULL) gains primitives_read, primitives_skipped (points, lines, and primitives
 * without positions), meshes_placed, meshes_skinned (whole numbers) and extensions_ignored (names of used extensions
 * that this reader does not know), and "warnings" (texts) where primitives or parents are passed over.
 * QMAT_ERROR_IO for unreadable files, QMAT_ERROR_FORMAT with the element ("accessor 3") for invalid glTF,
 * QMAT_ERROR_GEOMETRY for too many instances, QMAT_ERROR_MEMORY. On failure the soup holds part of the model.
 * One thread. Cost: linear in the data and in the vertices placed. */
qmat_status qmat_gltf_read(qmat_context *context, const char *path, qmat_soup *soup, json_t *report);

/* The same for an asset in memory. `path` names it in errors; external files are read from that path's folder. */
qmat_status qmat_gltf_parse(qmat_context *context, const uint8_t *bytes, size_t size, const char *path, qmat_soup *soup,
                            json_t *report);

/* Meshes of an asset, each in its own space. A zeroed one is empty and valid. */
typedef struct qmat_gltf_meshes {
  size_t count;
  uint32_t *ids;    /* count: mesh numbers in the asset, ascending */
  qmat_soup *soups; /* count */
} qmat_gltf_meshes;

/* Reads the surfaces of the meshes that `choice` selects (see qmat_gltf_choose_meshes) in their own coordinates: node
 * transforms and skins are not applied, and morph targets have the mesh's own weights. Meshes without triangles are
 * left out; if all are empty, the last one stays. `root` is the asset's whole JSON. `report` gains the same keys as in
 * qmat_gltf_read except meshes_placed and meshes_skinned. Otherwise as qmat_gltf_parse; free `meshes` also after a
 * failure. */
qmat_status qmat_gltf_parse_meshes(qmat_context *context, const uint8_t *bytes, size_t size, const char *path,
                                   const json_t *root, const char *choice, qmat_gltf_meshes *meshes, json_t *report);
void qmat_gltf_meshes_uninit(qmat_gltf_meshes *meshes);

#endif
