/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_ASSET_H
#define QMAT_IO_GLTF_GLTF_ASSET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <jansson.h>

#include "core/value.h"
#include "io/bytes.h"

/* The types of an accessor's components. */
enum {
  QMAT_GLTF_BYTE = 5120,
  QMAT_GLTF_UNSIGNED_BYTE,
  QMAT_GLTF_SHORT,
  QMAT_GLTF_UNSIGNED_SHORT,
  QMAT_GLTF_UNSIGNED_INT = 5125,
  QMAT_GLTF_FLOAT
};

/* The key in a mesh's extras that says that it is the skin of a medial mesh, and no model. */
#define QMAT_GLTF_SKIN_MARK "qmat_skin"

/* A .glb or .gltf as its JSON and its bytes, only the container checked. A zeroed one is empty and valid. */
typedef struct qmat_gltf_asset {
  bool binary;
  json_t *root;         /* an object */
  const uint8_t *chunk; /* the GLB's binary chunk; NULL: it has none. Not owned */
  size_t chunk_size;
  const uint8_t *more; /* the GLB's chunks behind that one (behind the JSON, where there is none), whole. Not owned */
  size_t more_size;
} qmat_gltf_asset;

/* Opens an asset, binary or text, told apart by the first bytes. `bytes` must outlive it; `path` is for errors.
 * QMAT_ERROR_FORMAT, with line and column where the JSON is damaged; QMAT_ERROR_MEMORY. Free it with
 * qmat_gltf_asset_uninit, also after a failure. Linear. */
qmat_status qmat_gltf_asset_init(qmat_context *context, const uint8_t *bytes, size_t size, const char *path,
                                 qmat_gltf_asset *asset);
void qmat_gltf_asset_uninit(qmat_gltf_asset *asset);

/* Appends the asset as a file: a .glb with `data_size` bytes of `data` behind its binary chunk, or a .gltf, which takes
 * no data. QMAT_ERROR_MEMORY, also beyond the 4 GiB of a .glb. Linear. */
qmat_status qmat_gltf_asset_put(qmat_context *context, const qmat_gltf_asset *asset, const uint8_t *data,
                                size_t data_size, qmat_writer *out);

/* The name of a mesh, or "mesh 3" where it has none; NULL when memory is short. qmat_free frees it. */
char *qmat_gltf_mesh_name(const json_t *root, size_t mesh);

/* The bytes of a number of an accessor's componentType, 5120 (BYTE) to 5126 (FLOAT); 0: there is no such type. */
size_t qmat_gltf_component_size(int64_t component_type);

/* Sets object[key] and takes the value over; false when memory is short or the value is NULL. */
bool qmat_gltf_set(json_t *object, const char *key, json_t *value);

/* Appends a member to the array root[key], which is made where there is none, and takes it over. `*number` (may be
 * NULL) becomes its index. False when memory is short, the member is NULL or root[key] is no array. */
bool qmat_gltf_add(json_t *root, const char *key, json_t *member, json_int_t *number);

/* Appends bytes `with` until the size is a multiple of 4. */
void qmat_gltf_pad(qmat_writer *writer, uint8_t with);

/* Names an extension among those that the asset uses and requires, once each; false when memory is short. */
bool qmat_gltf_require_extension(json_t *root, const char *name);

/* The number of the mesh that a node carries, also when written 3.0; -1: none. */
int64_t qmat_gltf_mesh_of(const json_t *node);

/* Whether a mesh is a skin that qmat added to the asset. */
bool qmat_gltf_is_skin(const json_t *root, size_t mesh);

/* How many nodes carry that mesh. */
size_t qmat_gltf_mesh_carriers(const json_t *root, size_t mesh);

/* The meshes that `choice` stands for: "all" (each that a node carries, in their order, without skins that qmat added),
 * else the one of that name, else the one of that number. `*meshes` (qmat_free it) has `*count` of them, at least one;
 * NULL on failure. `path` is for errors. QMAT_ERROR_USAGE for a choice that is none or several, QMAT_ERROR_GEOMETRY
 * where no node carries a mesh, QMAT_ERROR_MEMORY. Linear. */
qmat_status qmat_gltf_choose_meshes(qmat_context *context, const json_t *root, const char *path, const char *choice,
                                    uint32_t **meshes, size_t *count);

#endif
