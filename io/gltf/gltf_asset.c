/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_asset.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/arena.h"
#include "io/bytes.h"

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
  if (version != 2) return fail(context, path, "GLB version %u is not supported; 2 is", version);
  if (end > size) return fail(context, path, "the GLB header promises %zu bytes, the file has %zu", end, size);
  size_t chunk = 0;
  for (; reader.at < end; chunk++) {
    const size_t start = reader.at;
    if (end - start < 8) return fail_chunk(context, path, chunk, "the GLB ends within a chunk's header");
    const size_t chunk_size = qmat_take_u32(&reader);
    const uint32_t type = qmat_take_u32(&reader);
    if (chunk_size > end - reader.at) {
      fail(context, path, "has %zu bytes, but the GLB ends after %zu", chunk_size, end - reader.at);
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
  asset->root = json_loadb(text, length, JSON_REJECT_DUPLICATES, &error);
  if (!asset->root && json_error_code(&error) == json_error_out_of_memory) {
    qmat_fail_memory(context, "a glTF asset");
    return qmat_fail_at(context, path, 0, 0);
  }
  if (!asset->root) {
    qmat_fail(context, QMAT_ERROR_FORMAT, "the JSON is damaged: %s", error.text);
    return qmat_fail_at(context, path, error.line > 0 ? error.line : 0, error.column > 0 ? error.column : 0);
  }
  return json_is_object(asset->root) ? QMAT_OK : fail(context, path, "the JSON is not an object");
}

void qmat_gltf_asset_uninit(qmat_gltf_asset *asset) {
  json_decref(asset->root);
  *asset = (qmat_gltf_asset){0};
}

/* ---- names of files ---- */

static int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

qmat_status qmat_gltf_relative_path(qmat_context *context, const char *uri, size_t length, char **name) {
  char *path = *name = qmat_alloc(length + 1, 1);
  if (!path) return qmat_fail_memory(context, "the name of a file");
  size_t used = 0;
  bool sound = length > 0;
  for (size_t i = 0; i < length && sound; i++) {
    char c = uri[i];
    if (c == '?' || c == '#' || (c == ':' && memchr(uri, '/', i) == NULL)) sound = false; /* a query, or a scheme */
    if (c == '%') {
      int high = i + 1 < length ? hex_digit(uri[i + 1]) : -1, low = i + 2 < length ? hex_digit(uri[i + 2]) : -1;
      if (high < 0 || low < 0) sound = false;
      c = (char)(high * 16 + low);
      i += 2;
    }
    if (c == '\0' || c == '\\') sound = false;
    path[used++] = c;
  }
  path[used] = '\0';
  if (path[0] == '/') sound = false;
  for (const char *part = path; sound && *part;) {
    size_t part_length = strcspn(part, "/");
    if (part_length == 2 && part[0] == '.' && part[1] == '.') sound = false;
    part += part_length;
    if (*part == '/') part++;
  }
  if (sound && path[used - 1] != '/') return QMAT_OK;
  qmat_free(path);
  *name = NULL;
  return QMAT_OK;
}

char *qmat_gltf_beside(const char *asset, const char *name) {
  const char *slash = strrchr(asset, '/');
  size_t folder = slash ? (size_t)(slash - asset) + 1 : 0, length = strlen(name);
  char *path = qmat_alloc(folder + length + 1, 1);
  if (!path) return NULL;
  memcpy(path, asset, folder);
  memcpy(path + folder, name, length + 1);
  return path;
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
    qmat_fail_hint(context, "choose by number, from 0 to %zu", mesh_count - 1);
  } else {
    qmat_fail(context, QMAT_ERROR_USAGE, "there is no mesh '%s' on a node of the scene", choice);
    qmat_fail_hint(context, "all, merged, a mesh's name, or its number below %zu", mesh_count);
  }
  qmat_fail_at(context, path, 0, 0);
  return qmat_fail_field(context, "mesh");
}

/* The one mesh of that name or, without one, of that number; `*named` meshes have the name. */
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

bool qmat_gltf_is_skin(const json_t *root, size_t mesh) {
  const json_t *object = json_array_get(json_object_get(root, "meshes"), mesh);
  return json_is_true(json_object_get(json_object_get(object, "extras"), QMAT_GLTF_SKIN_MARK));
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
      status = qmat_fail(context, QMAT_ERROR_GEOMETRY, "no node of the scene carries a mesh");
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

/* ---- keeping all of it ---- */

typedef struct keeper {
  qmat_context *context;
  const char *path; /* of the asset */
  qmat_scene *scene;
  size_t capacity;
  json_t *warnings;
} keeper;

static qmat_status add_part(keeper *keeper, const char *name, const uint8_t *bytes, size_t size) {
  qmat_scene *scene = keeper->scene;
  if (qmat_grow((void **)&scene->parts, &keeper->capacity, scene->part_count + 1, sizeof *scene->parts) != 0)
    return qmat_fail_memory(keeper->context, "a glTF asset");
  qmat_file_part *part = &scene->parts[scene->part_count++];
  *part = (qmat_file_part){.name = qmat_strdup(name), .bytes = qmat_alloc(size, 1)};
  if (!part->name || !part->bytes) return qmat_fail_memory(keeper->context, "a glTF asset");
  memcpy(part->bytes, bytes, size);
  part->size = size;
  return QMAT_OK;
}

static qmat_status warn(const keeper *keeper, const char *uri, const char *what) {
  enum { MOST_BYTES = 200 };
  size_t length = strnlen(uri, MOST_BYTES);
  while (length > 0 && ((unsigned char)uri[length] & 0xC0) == 0x80) length--; /* not within a character */
  json_t *text = json_sprintf("the file \"%.*s\" %s: it is not copied", (int)length, uri, what);
  return json_array_append_new(keeper->warnings, text) == 0
             ? QMAT_OK
             : qmat_fail_memory(keeper->context, "the warnings of a reader");
}

/* Takes steps that lead nowhere ("./", "//") out of a relative path. */
static void shorten(char *name) {
  char *to = name;
  for (const char *from = name; *from;) {
    const size_t length = strcspn(from, "/");
    const bool nowhere = length == 0 || (length == 1 && from[0] == '.');
    if (!nowhere) {
      if (to > name) *to++ = '/';
      memmove(to, from, length);
      to += length;
    }
    from += length;
    if (*from == '/') from++;
  }
  *to = '\0';
}

static qmat_status keep_file(keeper *keeper, const char *uri, size_t length) {
  if (strncmp(uri, "data:", 5) == 0) return QMAT_OK;
  char *name;
  qmat_status status = qmat_gltf_relative_path(keeper->context, uri, length, &name);
  if (status != QMAT_OK) return status;
  if (name) shorten(name);
  if (!name || !qmat_is_part_name(name) || !qmat_is_utf8(name)) {
    qmat_free(name);
    return warn(keeper, uri, "does not lie below the scene's folder");
  }
  bool known = false;
  for (size_t i = 1; i < keeper->scene->part_count && !known; i++)
    known = strcmp(keeper->scene->parts[i].name, name) == 0;
  if (!known) {
    qmat_context *context = keeper->context;
    const qmat_error before = context->error;
    qmat_bytes bytes = {0};
    char *path = qmat_gltf_beside(keeper->path, name);
    status = path ? qmat_bytes_read_file(context, path, &bytes) : qmat_fail_memory(context, "a glTF asset");
    if (status == QMAT_OK) {
      status = add_part(keeper, name, bytes.data, bytes.size);
    } else if (status == QMAT_ERROR_IO || status == QMAT_ERROR_FORMAT) {
      context->error = before;
      status = warn(keeper, uri, "cannot be read");
    }
    qmat_bytes_uninit(&bytes);
    qmat_free(path);
  }
  qmat_free(name);
  return status;
}

static bool is_uri(const char *key) {
  const size_t length = strlen(key);
  return strcmp(key, "uri") == 0 || (length > 3 && strcmp(key + length - 3, "Uri") == 0);
}

/* jansson parses 2048 levels at most, which bounds the recursion. */
static qmat_status keep_files(keeper *keeper, const json_t *json) {
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < json_array_size(json) && status == QMAT_OK; i++)
    status = keep_files(keeper, json_array_get(json, i));
  const char *key;
  json_t *value;
  json_object_foreach((json_t *)(uintptr_t)json, key, value) {
    if (status != QMAT_OK) break;
    if (json_is_string(value) && is_uri(key)) {
      status = keep_file(keeper, json_string_value(value), json_string_length(value));
    } else if (strcmp(key, "extras") != 0) { /* what is said there is nobody else's business */
      status = keep_files(keeper, value);
    }
  }
  return status;
}

qmat_status qmat_gltf_keep(qmat_context *context, const json_t *root, const uint8_t *bytes, size_t size,
                           const char *path, qmat_scene *scene, json_t *warnings) {
  keeper keeper = {.context = context, .path = path, .scene = scene, .warnings = warnings};
  const qmat_status status = add_part(&keeper, "", bytes, size);
  return status == QMAT_OK ? keep_files(&keeper, root) : status;
}
