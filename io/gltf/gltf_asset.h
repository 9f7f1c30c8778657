/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_ASSET_H
#define QMAT_IO_GLTF_GLTF_ASSET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <jansson.h>

#include "core/value.h"
#include "io/bytes.h"

/* Component types of accessors. */
enum {
  QMAT_GLTF_BYTE = 5120,
  QMAT_GLTF_UNSIGNED_BYTE,
  QMAT_GLTF_SHORT,
  QMAT_GLTF_UNSIGNED_SHORT,
  QMAT_GLTF_UNSIGNED_INT = 5125,
  QMAT_GLTF_FLOAT
};

/* This key in a mesh's extras marks the skin of a medial mesh, as opposed to a model. */
#define QMAT_GLTF_SKIN_MARK "qmat_skin"
/* The extras of a node with a collider that qmat added have this. */
#define QMAT_GLTF_COLLIDER_MARK "qmat_collider"
/* The same where the motion of the body is ours, too. */
#define QMAT_GLTF_MOTION_MARK "qmat_motion"

/* The extras of a node with the medial mesh of all meshes of an asset together have this. */
#define QMAT_GLTF_MERGED_MARK "qmat_merged"

/* The JSON and chunks of a .glb or .gltf. Only the container is checked. A zeroed one is empty and valid. */
typedef struct qmat_gltf_asset {
  bool binary;
  json_t *root;         /* an object */
  const uint8_t *chunk; /* the GLB's binary chunk, not owned; NULL: none */
  size_t chunk_size;
  const uint8_t *more; /* the GLB's further chunks with their headers, not owned; NULL: none */
  size_t more_size;
} qmat_gltf_asset;

/* Opens a binary or text asset, detected from its first bytes. `bytes` must outlive it; `path` names it in errors.
 * QMAT_ERROR_FORMAT, with line and column for invalid JSON; QMAT_ERROR_MEMORY. Free it with
 * qmat_gltf_asset_uninit, also after a failure. Linear. */
qmat_status qmat_gltf_asset_init(qmat_context *context, const uint8_t *bytes, size_t size, const char *path,
                                 qmat_gltf_asset *asset);
void qmat_gltf_asset_uninit(qmat_gltf_asset *asset);

/* Appends the asset as a file: a .glb with `data_size` bytes of `data` at the end of its binary chunk, or a .gltf
 * without `data`. QMAT_ERROR_MEMORY, also for a .glb above 4 GiB. Linear. */
qmat_status qmat_gltf_asset_put(qmat_context *context, const qmat_gltf_asset *asset, const uint8_t *data,
                                size_t data_size, qmat_writer *out);

/* The name of a mesh, or "mesh 3" if it has none; NULL when out of memory. Free it with qmat_free. */
char *qmat_gltf_mesh_name(const json_t *root, size_t mesh);

/* The size in bytes of a componentType, 5120 (BYTE) to 5126 (FLOAT); 0 for any other type. */
size_t qmat_gltf_component_size(int64_t component_type);

/* Sets object[key] and takes ownership of the value; false when out of memory or when the value is NULL. */
bool qmat_gltf_set(json_t *object, const char *key, json_t *value);

/* Appends a member to the array root[key], creates the array if it is missing, and takes ownership of the member.
 * `*number` (may be NULL) gets its index. False when out of memory, or if the member is NULL or root[key] no array. */
bool qmat_gltf_add(json_t *root, const char *key, json_t *member, json_int_t *number);

/* Pads with bytes `with` until the size is a multiple of 4. */
void qmat_gltf_pad(qmat_writer *writer, uint8_t with);

/* Adds an extension to extensionsUsed and extensionsRequired if it is missing there; false when out of memory. */
bool qmat_gltf_require_extension(json_t *root, const char *name);

/* The number of the mesh that a node references, also if written as 3.0; -1: none. */
int64_t qmat_gltf_mesh_of(const json_t *node);

/* Whether nodes move or turn the mesh, whatever they scale: its coordinates are then not those of the scene. */
bool qmat_gltf_moves_mesh(const json_t *root, uint32_t mesh);

/* The node that a node is a child of; SIZE_MAX: it is a root. Linear in all children. */
size_t qmat_gltf_parent_of(const json_t *root, size_t node);

/* Takes those children off a node that are among the first `given` nodes and for which is_dropped(root, child) holds;
 * whether there are any. Each stays in the asset as an empty node without a parent, so that the others keep their
 * numbers. */
bool qmat_gltf_drop_children(json_t *root, json_t *node, size_t given,
                             bool (*is_dropped)(const json_t *root, const json_t *child));

/* Whether qmat writes a member of that name into the extras of nodes with medial meshes. Others with its prefix are a
 * user's own. */
bool qmat_gltf_is_key(const char *key);

/* Removes the members that qmat wrote from the extras of a node; NULL is allowed. */
void qmat_gltf_drop_keys(json_t *extras);

/* Whether a mesh is a skin that qmat added to the asset. */
bool qmat_gltf_is_skin(const json_t *root, size_t mesh);

/* Whether a node has a skin that qmat added, or nothing but a medial mesh. Colliders do not count. */
bool qmat_gltf_is_addition(const json_t *root, const json_t *node);

/* The number of nodes that reference a mesh. */
size_t qmat_gltf_mesh_carriers(const json_t *root, size_t mesh);

/* Selects meshes by `choice`: "all" (every mesh that a node references, ascending, without skins that qmat added), a
 * mesh's name, or its number if no name matches. `*meshes` (free it with qmat_free) gets `*count` mesh numbers, at
 * least one; NULL on failure. `path` names the asset in errors. QMAT_ERROR_USAGE if the choice matches no mesh or
 * several, QMAT_ERROR_GEOMETRY if no node references a mesh, QMAT_ERROR_MEMORY. Linear. */
qmat_status qmat_gltf_choose_meshes(qmat_context *context, const json_t *root, const char *path, const char *choice,
                                    uint32_t **meshes, size_t *count);

#endif
