/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_keep.h"

#include <string.h>

#include "core/arena.h"
#include "io/bytes.h"
#include "io/gltf/gltf_uri.h"

typedef struct keeper {
  qmat_context *context;
  const char *path; /* of the asset */
  qmat_scene *scene;
  size_t capacity;
  json_t *warnings;
} keeper;

const char *qmat_gltf_image_type(const uint8_t *bytes, size_t size) {
  static const struct {
    const char *type;
    size_t at, length;
    const char *magic;
  } types[] = {
      {"image/png", 0, 8, "\x89PNG\r\n\x1a\n"}, {"image/jpeg", 0, 3, "\xff\xd8\xff"}, {"image/webp", 8, 4, "WEBP"},
      {"image/ktx2", 0, 7, "\xabKTX 20"},       {"image/vnd-ms.dds", 0, 4, "DDS "},   {"image/avif", 4, 8, "ftypavif"}};
  for (size_t i = 0; i < sizeof types / sizeof *types; i++)
    if (size >= types[i].at + types[i].length && memcmp(bytes + types[i].at, types[i].magic, types[i].length) == 0)
      return types[i].type;
  return NULL;
}

/* Adds a part and takes ownership of `name`. */
static qmat_status add_part(keeper *keeper, char *name, const uint8_t *bytes, size_t size) {
  qmat_scene *scene = keeper->scene;
  if (!name || qmat_grow((void **)&scene->parts, &keeper->capacity, scene->part_count + 1, sizeof *scene->parts) != 0) {
    qmat_free(name);
    return qmat_fail_memory(keeper->context, "a glTF asset");
  }
  qmat_file_part *part = &scene->parts[scene->part_count++];
  *part = (qmat_file_part){.name = name, .bytes = qmat_alloc(size, 1)};
  if (!part->bytes) return qmat_fail_memory(keeper->context, "a glTF asset");
  memcpy(part->bytes, bytes, size);
  part->size = size;
  return QMAT_OK;
}

static qmat_status warn(const keeper *keeper, const char *uri, const char *what) {
  enum { MOST_BYTES = 200 };
  size_t length = strnlen(uri, MOST_BYTES);
  while (length > 0 && ((unsigned char)uri[length] & 0xC0) == 0x80) length--; /* not inside a UTF-8 character */
  json_t *text = json_sprintf("the file \"%.*s\" %s: it is not copied", (int)length, uri, what);
  return json_array_append_new(keeper->warnings, text) == 0
             ? QMAT_OK
             : qmat_fail_memory(keeper->context, "the warnings of a reader");
}

static size_t part_of(const qmat_scene *scene, const char *part_name) {
  for (size_t i = 1; i < scene->part_count; i++)
    if (strcmp(scene->parts[i].name, part_name) == 0) return i;
  return 0;
}

qmat_status qmat_gltf_find_part(qmat_context *context, const qmat_scene *scene, const char *uri, size_t length,
                                size_t *part) {
  char *name;
  *part = 0;
  const qmat_status status = qmat_gltf_file_name(context, uri, length, &name);
  if (status != QMAT_OK || !name) return status;
  char *part_name = qmat_gltf_part_name(name);
  if (part_name) *part = part_of(scene, part_name);
  const bool failed = !part_name;
  qmat_free(part_name);
  qmat_free(name);
  return failed ? qmat_fail_memory(context, "the name of a file") : QMAT_OK;
}

/* Reads a file, adds it as a part and takes ownership of `part_name`. An unreadable file is a warning. */
static qmat_status read_part(keeper *keeper, const char *uri, const char *name, char *part_name) {
  qmat_context *context = keeper->context;
  const qmat_error before = context->error;
  qmat_bytes bytes = {0};
  char *path = qmat_gltf_beside(keeper->path, name);
  qmat_status status = path ? qmat_bytes_read_file(context, path, &bytes) : qmat_fail_memory(context, "a glTF asset");
  if (status == QMAT_OK && qmat_gltf_is_outside(name) && !qmat_gltf_image_type(bytes.data, bytes.size)) {
    status = warn(keeper, uri, "is outside the asset's folder and is not an image");
  } else if (status == QMAT_OK) {
    status = add_part(keeper, part_name, bytes.data, bytes.size);
    part_name = NULL;
  } else if (status == QMAT_ERROR_IO || status == QMAT_ERROR_FORMAT) {
    context->error = before;
    status = warn(keeper, uri, "cannot be read");
  }
  qmat_bytes_uninit(&bytes);
  qmat_free(part_name);
  qmat_free(path);
  return status;
}

static qmat_status keep_file(void *user, json_t *owner, const char *key, qmat_gltf_uri_kind kind) {
  keeper *keeper = user;
  const json_t *value = json_object_get(owner, key);
  const char *uri = json_string_value(value);
  char *name;
  if (strncmp(uri, "data:", 5) == 0) return QMAT_OK;
  qmat_status status = qmat_gltf_file_name(keeper->context, uri, json_string_length(value), &name);
  if (status != QMAT_OK) return status;
  if (!name || (qmat_gltf_is_outside(name) && kind != QMAT_GLTF_IMAGE_URI)) {
    status = warn(keeper, uri, name ? "is outside the asset's folder" : "is not named by a relative path");
  } else {
    char *part_name = qmat_gltf_part_name(name);
    if (!part_name) {
      status = qmat_fail_memory(keeper->context, "a glTF asset");
    } else if (!qmat_is_part_name(part_name) || !qmat_is_utf8(part_name)) {
      status = warn(keeper, uri, "has a name that is too long or not UTF-8");
      qmat_free(part_name);
    } else if (part_of(keeper->scene, part_name) > 0) {
      qmat_free(part_name);
    } else {
      status = read_part(keeper, uri, name, part_name);
    }
  }
  qmat_free(name);
  return status;
}

qmat_status qmat_gltf_keep(qmat_context *context, json_t *root, const uint8_t *bytes, size_t size, const char *path,
                           qmat_scene *scene, json_t *warnings) {
  keeper keeper = {.context = context, .path = path, .scene = scene, .warnings = warnings};
  const qmat_status status = add_part(&keeper, qmat_strdup(""), bytes, size);
  return status == QMAT_OK ? qmat_gltf_visit_uris(root, keep_file, &keeper) : status;
}
