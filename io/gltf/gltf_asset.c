/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_asset.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/arena.h"
#include "core/json_text.h"
#include "io/scanner.h"

/* ---- the container ---- */

static const uint32_t JSON_CHUNK = 0x4E4F534A, BINARY_CHUNK = 0x004E4942;

static qmat_status fail(qmat_context *context, const char *path, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
static qmat_status fail(qmat_context *context, const char *path, const char *format, ...) {
  char text[384];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  qmat_fail(context, QMAT_ERROR_FORMAT, "%s", text);
  return qmat_fail_at(context, path, 0, 0);
}

static qmat_status fail_chunk(qmat_context *context, const char *path, size_t chunk, const char *what) {
  fail(context, path, "%s", what);
  return qmat_fail_element(context, "chunk", (int64_t)chunk);
}

/* Finds the JSON text and the chunks. */
static qmat_status open_container(qmat_context *context, const uint8_t *bytes, size_t size, const char *path,
                                  qmat_gltf_asset *asset, const char **text, size_t *length) {
  *text = (const char *)bytes;
  *length = size;
  if (size < 4 || memcmp(bytes, "glTF", 4) != 0) return QMAT_OK;
  qmat_byte_reader reader = {.bytes = bytes, .size = size, .at = 4};
  const uint32_t version = qmat_take_u32(&reader);
  const size_t end = qmat_take_u32(&reader);
  asset->binary = true;
  if (size < 20) return fail(context, path, "the file ends within the GLB header");
  if (version != 2) return fail(context, path, "GLB version %u is not supported (only 2 is)", version);
  if (end > size) return fail(context, path, "the GLB header states %zu bytes, but the file has %zu", end, size);
  size_t chunk = 0;
  for (; reader.at < end; chunk++) {
    const size_t start = reader.at;
    if (end - start < 8) return fail_chunk(context, path, chunk, "the GLB ends within a chunk's header");
    const size_t chunk_size = qmat_take_u32(&reader);
    const uint32_t type = qmat_take_u32(&reader);
    if (chunk_size > end - reader.at) {
      fail(context, path, "needs %zu bytes, but only %zu follow in the GLB", chunk_size, end - reader.at);
      return qmat_fail_element(context, "chunk", (int64_t)chunk);
    }
    const uint8_t *data = qmat_take_bytes(&reader, chunk_size);
    if (chunk == 0) {
      if (type != JSON_CHUNK) return fail_chunk(context, path, 0, "the first chunk of a GLB must be JSON");
      *text = (const char *)data;
      *length = chunk_size;
    } else if (chunk == 1 && type == BINARY_CHUNK) {
      asset->chunk = data;
      asset->chunk_size = chunk_size;
    } else if (!asset->more) {
      asset->more = bytes + start;
      asset->more_size = end - start;
    }
  }
  if (chunk == 0) return fail(context, path, "the GLB has no JSON chunk");
  while (*length > 0 && (*text)[*length - 1] == '\0') (*length)--; /* some writers pad with zeros */
  return QMAT_OK;
}

qmat_status qmat_gltf_asset_init(qmat_context *context, const uint8_t *bytes, size_t size, const char *path,
                                 qmat_gltf_asset *asset) {
  *asset = (qmat_gltf_asset){0};
  const char *text = NULL;
  size_t length = 0;
  json_error_t error;
  const qmat_status status = open_container(context, bytes, size, path, asset, &text, &length);
  if (status != QMAT_OK) return status;
  const size_t mark = qmat_byte_order_mark(text, length);
  asset->root = json_loadb(text + mark, length - mark, JSON_REJECT_DUPLICATES | JSON_ALLOW_NUL, &error);
  if (!asset->root && json_error_code(&error) == json_error_out_of_memory) {
    qmat_fail_memory(context, "a glTF asset");
    return qmat_fail_at(context, path, 0, 0);
  }
  if (!asset->root) {
    qmat_fail(context, QMAT_ERROR_FORMAT, "the JSON is invalid: %s", error.text);
    return qmat_fail_at(context, path, error.line > 0 ? error.line : 0, error.column > 0 ? error.column : 0);
  }
  return json_is_object(asset->root) ? QMAT_OK : fail(context, path, "the JSON is not an object");
}

void qmat_gltf_asset_uninit(qmat_gltf_asset *asset) {
  json_decref(asset->root);
  *asset = (qmat_gltf_asset){0};
}

static void put_chunk_head(qmat_writer *out, size_t size, const char *type) {
  qmat_put_u32(out, (uint32_t)size);
  qmat_put_bytes(out, type, 4);
}

static qmat_status put_glb(qmat_context *context, const qmat_gltf_asset *asset, const char *json, const uint8_t *data,
                           size_t data_size, qmat_writer *out) {
  const size_t json_size = (strlen(json) + 3) / 4 * 4, kept = asset->chunk ? (asset->chunk_size + 3) / 4 * 4 : 0;
  const size_t chunk_size = kept + data_size;
  const bool has_chunk = asset->chunk || data_size > 0;
  const uint64_t total = 12 + 8 + (uint64_t)json_size + (has_chunk ? 8 + chunk_size : 0) + asset->more_size;
  if (total > UINT32_MAX) {
    qmat_fail(context, QMAT_ERROR_MEMORY, "a .glb file of %llu bytes exceeds the format's limit of 4 GiB",
              (unsigned long long)total);
    return qmat_fail_hint(context, "set side_files to true, or write a .gltf");
  }
  qmat_put_text(out, "glTF");
  qmat_put_u32(out, 2);
  qmat_put_u32(out, (uint32_t)total);
  put_chunk_head(out, json_size, "JSON");
  qmat_put_text(out, json);
  qmat_gltf_pad(out, ' ');
  if (has_chunk) {
    put_chunk_head(out, chunk_size, "BIN");
    if (asset->chunk) qmat_put_bytes(out, asset->chunk, asset->chunk_size);
    qmat_gltf_pad(out, 0);
    qmat_put_bytes(out, data, data_size);
  }
  if (asset->more_size > 0) qmat_put_bytes(out, asset->more, asset->more_size);
  return QMAT_OK;
}

qmat_status qmat_gltf_asset_put(qmat_context *context, const qmat_gltf_asset *asset, const uint8_t *data,
                                size_t data_size, qmat_writer *out) {
  const size_t flags = JSON_REAL_PRECISION(17) | (asset->binary ? JSON_COMPACT : JSON_INDENT(2));
  char *json = qmat_json_text(asset->root, flags, NULL);
  if (!json) return qmat_fail_memory(context, "a glTF file");
  qmat_status status = QMAT_OK;
  if (asset->binary) {
    status = put_glb(context, asset, json, data, data_size, out);
  } else {
    qmat_put_text(out, json);
    qmat_put_u8(out, '\n');
  }
  qmat_free(json);
  return status;
}

/* ---- meshes ---- */

char *qmat_gltf_mesh_name(const json_t *root, size_t mesh) {
  const json_t *name = json_object_get(json_array_get(json_object_get(root, "meshes"), mesh), "name");
  if (json_string_length(name) > 0) return qmat_strdup(json_string_value(name));
  char text[32];
  snprintf(text, sizeof text, "mesh %zu", mesh);
  return qmat_strdup(text);
}

size_t qmat_gltf_component_size(int64_t component_type) {
  static const uint8_t sizes[] = {1, 1, 2, 2, 4, 4, 4};
  return component_type >= 5120 && component_type <= 5126 ? sizes[component_type - 5120] : 0;
}

bool qmat_gltf_set(json_t *object, const char *key, json_t *value) {
  return value && json_object_set_new(object, key, value) == 0;
}

bool qmat_gltf_add(json_t *root, const char *key, json_t *member, json_int_t *number) {
  json_t *array = json_object_get(root, key);
  if (!array && qmat_gltf_set(root, key, json_array())) array = json_object_get(root, key);
  if (number) *number = (json_int_t)json_array_size(array);
  if (json_is_array(array) && member) return json_array_append_new(array, member) == 0;
  json_decref(member);
  return false;
}

void qmat_gltf_pad(qmat_writer *writer, uint8_t with) {
  while (!writer->failed && writer->size % 4 != 0) qmat_put_u8(writer, with);
}

static bool add_name(json_t *root, const char *key, const char *name) {
  json_t *names = json_object_get(root, key);
  if (!names && json_object_set_new(root, key, json_array()) == 0) names = json_object_get(root, key);
  for (size_t i = 0; i < json_array_size(names); i++) {
    const char *other = json_string_value(json_array_get(names, i));
    if (other && strcmp(other, name) == 0) return true;
  }
  return json_array_append_new(names, json_string(name)) == 0;
}

bool qmat_gltf_require_extension(json_t *root, const char *name) {
  return add_name(root, "extensionsUsed", name) && add_name(root, "extensionsRequired", name);
}

int64_t qmat_gltf_mesh_of(const json_t *node) {
  const json_t *mesh = json_object_get(node, "mesh");
  const double number = json_is_number(mesh) ? json_number_value(mesh) : -1;
  return number >= 0 && number < UINT32_MAX ? (int64_t)number : -1;
}

size_t qmat_gltf_mesh_carriers(const json_t *root, size_t mesh) {
  const json_t *nodes = json_object_get(root, "nodes");
  size_t count = 0;
  for (size_t i = 0; i < json_array_size(nodes); i++)
    count += qmat_gltf_mesh_of(json_array_get(nodes, i)) == (int64_t)mesh;
  return count;
}

static qmat_status fail_choice(qmat_context *context, const char *path, const char *choice, size_t named,
                               size_t mesh_count) {
  if (named > 1) {
    qmat_fail(context, QMAT_ERROR_USAGE, "%zu meshes have the name '%s'", named, choice);
    qmat_fail_hint(context, "a number from 0 to %zu; qmat mat: --set model.mesh=0", mesh_count - 1);
  } else {
    qmat_fail(context, QMAT_ERROR_USAGE, "no node references a mesh named or numbered '%s'", choice);
    qmat_fail_hint(context, "a mesh's name, a number below %zu, merged, or all; qmat mat: --set model.mesh=all",
                   mesh_count);
  }
  qmat_fail_at(context, path, 0, 0);
  return qmat_fail_field(context, "mesh");
}

/* Finds the only mesh with that name; if no name matches, the mesh with that number. `*named` counts the matches. */
static bool find_mesh(const json_t *meshes, const char *choice, size_t *mesh, size_t *named) {
  const size_t count = json_array_size(meshes);
  *named = 0;
  for (size_t i = 0; i < count; i++) {
    const char *name = json_string_value(json_object_get(json_array_get(meshes, i), "name"));
    if (name && strcmp(name, choice) == 0 && (*named)++ == 0) *mesh = i;
  }
  if (*named > 0) return *named == 1;
  const size_t digits = strspn(choice, "0123456789");
  if (digits == 0 || digits > 9 || choice[digits] != '\0') return false;
  *mesh = (size_t)strtoul(choice, NULL, 10);
  return *mesh < count;
}

size_t qmat_gltf_parent_of(const json_t *root, size_t node) {
  const json_t *nodes = json_object_get(root, "nodes");
  for (size_t i = 0; i < json_array_size(nodes); i++) {
    const json_t *children = json_object_get(json_array_get(nodes, i), "children");
    for (size_t k = 0; k < json_array_size(children); k++)
      if (json_number_value(json_array_get(children, k)) == (double)node) return i;
  }
  return SIZE_MAX;
}

/* Whether an array of numbers, if it is one, differs from the other in the components that `mask` has a bit for. */
static bool differs(const json_t *array, const double *plain, unsigned mask) {
  for (size_t i = 0; i < json_array_size(array) && i < 16; i++)
    if ((mask >> i & 1) && json_number_value(json_array_get(array, i)) != plain[i]) return true;
  return false;
}

bool qmat_gltf_moves_mesh(const json_t *root, uint32_t mesh) {
  static const double zero[16] = {0}, unturned[] = {0, 0, 0, 1};
  const unsigned all = 0xffff, diagonal = 1u << 0 | 1u << 5 | 1u << 10 | 1u << 15;
  const json_t *nodes = json_object_get(root, "nodes");
  for (size_t i = 0; i < json_array_size(nodes); i++) {
    if (qmat_gltf_mesh_of(json_array_get(nodes, i)) != (int64_t)mesh) continue;
    for (size_t at = i; at != SIZE_MAX; at = qmat_gltf_parent_of(root, at)) {
      const json_t *node = json_array_get(nodes, at);
      if (differs(json_object_get(node, "translation"), zero, all) ||
          differs(json_object_get(node, "rotation"), unturned, all) ||
          differs(json_object_get(node, "matrix"), zero, all & ~diagonal))
        return true;
    }
  }
  return false;
}

bool qmat_gltf_drop_children(json_t *root, json_t *node, size_t given,
                             bool (*is_dropped)(const json_t *root, const json_t *child)) {
  json_t *children = json_object_get(node, "children"), *nodes = json_object_get(root, "nodes");
  bool any = false;
  for (size_t i = json_array_size(children); i-- > 0;) {
    const size_t id = (size_t)json_number_value(json_array_get(children, i));
    json_t *child = id < given ? json_array_get(nodes, id) : NULL;
    if (!child || !is_dropped(root, child)) continue;
    json_array_remove(children, i);
    json_object_clear(child);
    any = true;
  }
  if (children && json_array_size(children) == 0) json_object_del(node, "children");
  return any;
}

bool qmat_gltf_is_key(const char *key) {
  static const char *const keys[] = {
      "certified",         "data",          "data_format", "edges",        "epsilon",
      "error_in",          "error_out",     "error_unit",  "flat",         "flat_format",
      "flat_quantisation", "frame",         "merged",      "origin_x",     "origin_y",
      "origin_z",          "position_bits", "prim",        "quantisation", "quantisation_unit",
      "radius_bits",       "skinned",       "triangles",   "version",      "vertices"};
  if (strncmp(key, "qmat_", 5) != 0) return false;
  for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
    if (strcmp(&key[5], keys[i]) == 0) return true;
  return false;
}

void qmat_gltf_drop_keys(json_t *extras) {
  const char *key;
  json_t *value;
  void *next;
  json_object_foreach_safe(extras, next, key, value) {
    if (qmat_gltf_is_key(key)) json_object_del(extras, key);
  }
}

bool qmat_gltf_is_skin(const json_t *root, size_t mesh) {
  const json_t *object = json_array_get(json_object_get(root, "meshes"), mesh);
  return json_is_true(json_object_get(json_object_get(object, "extras"), QMAT_GLTF_SKIN_MARK));
}

bool qmat_gltf_is_addition(const json_t *root, const json_t *node) {
  const int64_t mesh = qmat_gltf_mesh_of(node);
  const json_t *extras = json_object_get(node, "extras");
  const char *key;
  json_t *value;
  if (json_object_get(extras, QMAT_GLTF_COLLIDER_MARK)) return false;
  if (mesh >= 0) return qmat_gltf_is_skin(root, (size_t)mesh);
  if (!json_object_get(extras, "qmat_data") || json_object_get(node, "children")) return false;
  json_object_foreach((json_t *)(uintptr_t)extras, key, value) {
    if (!qmat_gltf_is_key(key)) return false;
  }
  return true;
}

qmat_status qmat_gltf_choose_meshes(qmat_context *context, const json_t *root, const char *path, const char *choice,
                                    uint32_t **meshes, size_t *count) {
  const json_t *nodes = json_object_get(root, "nodes"), *array = json_object_get(root, "meshes");
  const size_t mesh_count = json_array_size(array);
  uint8_t *carried = qmat_calloc(mesh_count, 1);
  uint32_t *chosen = qmat_alloc(mesh_count, sizeof *chosen);
  qmat_status status = carried && chosen ? QMAT_OK : qmat_fail_memory(context, "the meshes of a scene");
  *meshes = NULL;
  *count = 0;
  for (size_t i = 0; i < json_array_size(nodes) && status == QMAT_OK; i++) {
    const int64_t mesh = qmat_gltf_mesh_of(json_array_get(nodes, i));
    if (mesh >= 0 && (uint64_t)mesh < mesh_count) carried[mesh] = 1;
  }
  if (status == QMAT_OK && strcmp(choice, "all") != 0) {
    size_t mesh = 0, named = 0;
    if (find_mesh(array, choice, &mesh, &named) && carried[mesh]) {
      chosen[(*count)++] = (uint32_t)mesh;
    } else {
      status = fail_choice(context, path, choice, named, mesh_count);
    }
  } else if (status == QMAT_OK) {
    for (size_t i = 0; i < mesh_count; i++)
      if (carried[i] && !qmat_gltf_is_skin(root, i)) chosen[(*count)++] = (uint32_t)i;
    if (*count == 0) {
      status = qmat_fail(context, QMAT_ERROR_GEOMETRY, "no node references a mesh");
      qmat_fail_at(context, path, 0, 0);
    }
  }
  qmat_free(carried);
  if (status == QMAT_OK) {
    *meshes = chosen;
  } else {
    qmat_free(chosen);
  }
  return status;
}
