/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_H
#define QMAT_IO_GLTF_GLTF_H

#include "io/bytes.h"
#include "io/soup.h"

/* Reads a glTF 2.0 asset, .glb or .gltf (told apart by their first bytes), with embedded, external and
 * KHR_draco_mesh_compression data, and adds its surface to `soup` in world space: every triangle primitive (triangles,
 * strips, fans) of every node of the default scene, of the first scene when none is the default, of all nodes when
 * there are no scenes. Node transforms are applied in double precision; one that mirrors turns its triangles round.
 * Meshes appear once for each node that carries them; skinned ones in the pose that their joints stand in (linear
 * blend skinning, the node's own transform ignored, as glTF asks); morph targets at their default weights.
 * Degenerate triangles of strips, which only stitch, are dropped. Materials, textures, cameras, lights, animations and
 * extras are not looked at. A required extension that is not supported is an error that names it.
 *
 * External files are found by relative paths inside the asset's folder only. Every id, offset, length and count is
 * checked before it is trusted; what instances add up to is limited to 2^24 vertices and triangles plus 16 for each
 * byte of data.
 * `report` (a JSON object, may be NULL) gains primitives_read, primitives_skipped (points, lines, and primitives
 * without positions), meshes_placed, meshes_skinned (whole numbers) and extensions_ignored (the names that the asset
 * uses and this reader does not know).
 * QMAT_ERROR_IO for files that cannot be read, QMAT_ERROR_FORMAT with the element ("accessor 3") for what is not glTF,
 * QMAT_ERROR_GEOMETRY for too many instances, QMAT_ERROR_MEMORY. On failure the soup holds part of the model.
 * One thread. Cost: linear in the data and in the vertices placed. */
qmat_status qmat_gltf_read(qmat_context *context, const char *path, qmat_soup *soup, json_t *report);

/* The same for an asset that is in memory; `path` names it in errors, and external files are looked for in its
 * folder. */
qmat_status qmat_gltf_parse(qmat_context *context, const uint8_t *bytes, size_t size, const char *path, qmat_soup *soup,
                            json_t *report);

/* Meshes of an asset, each in its own space. A zeroed one is empty and valid. */
typedef struct qmat_gltf_meshes {
  size_t count;
  uint32_t *ids;    /* count: their numbers in the asset, rising */
  qmat_soup *soups; /* count */
} qmat_gltf_meshes;

/* The surfaces of the meshes that `choice` stands for (see qmat_gltf_choose_meshes), as they are stored: no transform
 * of a node is applied, skins are in bind pose, morph targets have the mesh's own weights. With "all", meshes without a
 * triangle are left out, unless none has one. `root` is the asset's whole JSON; `report` gains what it does in
 * qmat_gltf_read, but for the meshes placed and skinned. Otherwise as qmat_gltf_parse; free `meshes` also after a
 * failure. */
qmat_status qmat_gltf_parse_meshes(qmat_context *context, const uint8_t *bytes, size_t size, const char *path,
                                   const json_t *root, const char *choice, qmat_gltf_meshes *meshes, json_t *report);
void qmat_gltf_meshes_uninit(qmat_gltf_meshes *meshes);

#endif
