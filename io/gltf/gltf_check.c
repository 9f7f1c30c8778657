/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_check.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/arena.h"
#include "io/base64.h"
#include "io/gltf/gltf_asset.h"
#include "io/gltf/gltf_uri.h"

#define MOST_BUFFERS 4096
/* An accessor without a buffer view stands for zeros that no byte pays for. Morph targets use it, with as many as the
 * mesh has vertices, which other bytes have paid for. */
#define FREE_ZEROS 65536

/* An accessor, as far as its users are checked against it. */
typedef struct accessor {
  int64_t component_type, components, count;
  bool has_view, normalized;
} accessor;

typedef struct view {
  int64_t size, stride; /* stride 0: tightly packed */
} view;

typedef struct checker {
  qmat_context *context;
  const char *path;
  qmat_gltf_document *document;
  json_t *root;
  qmat_gltf_asset asset;
  accessor *accessors;
  view *views;
} checker;

/* ---- errors and typed access ---- */

static qmat_status fail(const checker *check, const char *kind, size_t element, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
static qmat_status fail(const checker *check, const char *kind, size_t element, const char *format, ...) {
  char text[384];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  qmat_fail(check->context, QMAT_ERROR_FORMAT, "%s", text);
  if (kind) qmat_fail_element(check->context, kind, (int64_t)element);
  return qmat_fail_at(check->context, check->path, 0, 0);
}

static qmat_status fail_memory(const checker *check) {
  qmat_fail_memory(check->context, "a glTF asset");
  return qmat_fail_at(check->context, check->path, 0, 0);
}

/* A whole number in [least, most], also when written 3.0. */
static bool whole(const json_t *value, int64_t least, int64_t most, int64_t *number) {
  int64_t n;
  if (json_is_integer(value)) {
    n = json_integer_value(value);
  } else if (json_is_real(value) && fabs(json_real_value(value)) < 9e15 &&
             json_real_value(value) == floor(json_real_value(value))) {
    n = (int64_t)json_real_value(value);
  } else {
    return false;
  }
  if (n < least || n > most) return false;
  *number = n;
  return true;
}

/* Reads object[key] as a whole number and writes it whole into the object. Without the key `*number` stays and
 * `present` (may be NULL: the key is required) is false. */
static qmat_status take_whole(const checker *check, json_t *object, const char *key, const char *kind, size_t element,
                              int64_t least, int64_t most, int64_t *number, bool *present) {
  json_t *value = json_object_get(object, key);
  if (present) *present = value != NULL;
  if (!value && present) return QMAT_OK;
  if (!value) return fail(check, kind, element, "%s is missing", key);
  if (!whole(value, least, most, number)) {
    return fail(check, kind, element, "%s must be a whole number in [%lld, %lld]", key, (long long)least,
                (long long)most);
  }
  if (json_object_set_new(object, key, json_integer(*number)) != 0) return fail_memory(check);
  return QMAT_OK;
}

/* The same for the id of a member of the root's array `of`. */
static qmat_status take_id(const checker *check, json_t *object, const char *key, const char *kind, size_t element,
                           const char *of, int64_t *id, bool *present) {
  size_t count = json_array_size(json_object_get(check->root, of));
  int64_t number = 0;
  bool there = true;
  qmat_status status = take_whole(check, object, key, kind, element, 0, INT64_MAX, &number, present ? &there : NULL);
  if (present) *present = there;
  if (status != QMAT_OK || !there) return status;
  if ((uint64_t)number >= count) {
    return fail(check, kind, element, "%s is %lld, but there are %zu %s", key, (long long)number, count, of);
  }
  *id = number;
  return QMAT_OK;
}

/* Reads object[key] as `count` finite numbers (any number of them when count is SIZE_MAX and numbers NULL). */
static qmat_status take_numbers(const checker *check, const json_t *object, const char *key, const char *kind,
                                size_t element, size_t count, double *numbers, bool *present) {
  const json_t *array = json_object_get(object, key);
  *present = array != NULL;
  if (!array) return QMAT_OK;
  if (!json_is_array(array) || (count != SIZE_MAX && json_array_size(array) != count)) {
    if (count == SIZE_MAX) return fail(check, kind, element, "%s must be an array of numbers", key);
    return fail(check, kind, element, "%s must be an array of %zu numbers", key, count);
  }
  for (size_t i = 0; i < json_array_size(array); i++) {
    const json_t *number = json_array_get(array, i);
    if (!json_is_number(number)) return fail(check, kind, element, "%s must hold numbers only", key);
    if (numbers) numbers[i] = json_number_value(number);
  }
  return QMAT_OK;
}

/* object[key] as an object (NULL when it is missing). */
static qmat_status take_object(const checker *check, const json_t *object, const char *key, const char *kind,
                               size_t element, json_t **value) {
  *value = json_object_get(object, key);
  if (*value && !json_is_object(*value)) return fail(check, kind, element, "%s must be an object", key);
  return QMAT_OK;
}

/* object[key] as an array (NULL when it is missing). */
static qmat_status take_array(const checker *check, const json_t *object, const char *key, const char *kind,
                              size_t element, json_t **value) {
  *value = json_object_get(object, key);
  if (*value && !json_is_array(*value)) return fail(check, kind, element, "%s must be an array", key);
  return QMAT_OK;
}

/* The root's array of that name: missing, or an array of objects. `kind` names one of them. */
static qmat_status check_root_array(const checker *check, const char *name, const char *kind) {
  json_t *array;
  qmat_status status = take_array(check, check->root, name, NULL, 0, &array);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < json_array_size(array); i++) {
    if (!json_is_object(json_array_get(array, i))) return fail(check, kind, i, "must be an object");
  }
  return QMAT_OK;
}

/* Deletes every key that is not in the NULL-terminated list. */
static void keep_keys(json_t *object, const char *const keys[]) {
  const char *key;
  json_t *value;
  void *next;
  json_object_foreach_safe(object, next, key, value) {
    bool keep = false;
    for (size_t i = 0; keys[i]; i++) keep = keep || strcmp(keys[i], key) == 0;
    if (!keep) json_object_del(object, key);
  }
}

/* ---- the asset and its extensions ---- */

static bool geometry_is_safe_with(const char *extension) {
  /* What changes only how a surface looks, or is read here. */
  static const char *const known[] = {
      "KHR_draco_mesh_compression",
      "KHR_mesh_quantization",
      "KHR_texture_transform",
      "KHR_texture_basisu",
      "EXT_texture_webp",
      "EXT_texture_avif",
      "MSFT_texture_dds",
      "KHR_lights_punctual",
      "EXT_lights_image_based",
      "KHR_xmp",
      "KHR_xmp_json_ld",
      "KHR_animation_pointer",
      "KHR_techniques_webgl",
      "KHR_audio_emitter",
      "EXT_mesh_features",
      "EXT_structural_metadata",
      "EXT_instance_features",
      NULL,
  };
  if (strncmp(extension, "KHR_materials_", 14) == 0 || strncmp(extension, "EXT_materials_", 14) == 0) return true;
  for (size_t i = 0; known[i]; i++) {
    if (strcmp(known[i], extension) == 0) return true;
  }
  return false;
}

static qmat_status check_extensions(const checker *check) {
  json_t *required, *used;
  qmat_status status = take_array(check, check->root, "extensionsRequired", NULL, 0, &required);
  if (status == QMAT_OK) status = take_array(check, check->root, "extensionsUsed", NULL, 0, &used);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < json_array_size(required); i++) {
    const char *name = json_string_value(json_array_get(required, i));
    if (!name) return fail(check, NULL, 0, "extensionsRequired must hold strings only");
    if (!geometry_is_safe_with(name)) {
      fail(check, NULL, 0, "the asset requires the extension %.100s, which is not supported", name);
      return qmat_fail_hint(check->context,
                            "supported: KHR_draco_mesh_compression, KHR_mesh_quantization, and those of materials, "
                            "textures, lights and metadata");
    }
  }
  for (size_t i = 0; i < json_array_size(used); i++) {
    const char *name = json_string_value(json_array_get(used, i));
    if (!name) return fail(check, NULL, 0, "extensionsUsed must hold strings only");
    if (geometry_is_safe_with(name)) continue;
    if (json_array_append_new(check->document->extensions_ignored, json_string(name)) != 0) return fail_memory(check);
  }
  return QMAT_OK;
}

static qmat_status check_asset(const checker *check) {
  json_t *asset;
  qmat_status status = take_object(check, check->root, "asset", NULL, 0, &asset);
  if (status != QMAT_OK) return status;
  const char *version = json_string_value(json_object_get(asset, "version"));
  const char *least = json_string_value(json_object_get(asset, "minVersion"));
  if (!version) return fail(check, NULL, 0, "not a glTF asset: asset.version is missing");
  if (strncmp(version, "2.", 2) != 0) {
    return fail(check, NULL, 0, "glTF version %.20s is not supported; 2.0 is", version);
  }
  if (least && strcmp(least, "2.0") != 0) {
    return fail(check, NULL, 0, "the asset asks for glTF %.20s; 2.0 is supported", least);
  }
  return check_extensions(check);
}

/* ---- buffers ---- */

static qmat_status load_external(const checker *check, size_t index, const char *uri, size_t uri_length) {
  qmat_gltf_buffer *buffer = &check->document->buffers[index];
  const json_t *all = json_object_get(check->root, "buffers");
  for (size_t i = 0; i < index; i++) { /* several buffers may name one file */
    const char *other = json_string_value(json_object_get(json_array_get(all, i), "uri"));
    if (other && strcmp(other, uri) == 0) {
      buffer->bytes = check->document->buffers[i].bytes;
      buffer->size = check->document->buffers[i].file.size;
      return QMAT_OK;
    }
  }
  char *name;
  qmat_status status = qmat_gltf_file_name(check->context, uri, uri_length, &name);
  if (status != QMAT_OK) return status;
  if (!name || qmat_gltf_is_outside(name)) {
    qmat_free(name);
    return fail(check, "buffer", index, "its uri \"%.100s\" is not a relative path inside the asset's folder", uri);
  }
  char *path = qmat_gltf_beside(check->path, name);
  status = path ? qmat_bytes_read_file(check->context, path, &buffer->file) : fail_memory(check);
  if (status != QMAT_OK && path) qmat_fail_element(check->context, "buffer", (int64_t)index);
  buffer->bytes = buffer->file.data;
  buffer->size = buffer->file.size;
  qmat_free(path);
  qmat_free(name);
  return status;
}

static qmat_status load_data_uri(const checker *check, size_t index, const char *uri, size_t uri_length) {
  qmat_gltf_buffer *buffer = &check->document->buffers[index];
  const char *comma = memchr(uri, ',', uri_length);
  if (!comma || comma - uri < 12 || memcmp(comma - 7, ";base64", 7) != 0) {
    return fail(check, "buffer", index, "its data URI is not base64");
  }
  size_t length = uri_length - (size_t)(comma + 1 - uri);
  qmat_status status = qmat_base64_decode(check->context, comma + 1, length, &buffer->owned, &buffer->size);
  if (status != QMAT_OK) {
    qmat_fail_element(check->context, "buffer", (int64_t)index);
    return qmat_fail_at(check->context, check->path, 0, 0);
  }
  buffer->bytes = buffer->owned;
  return QMAT_OK;
}

static qmat_status load_buffers(const checker *check) {
  json_t *array = json_object_get(check->root, "buffers");
  size_t count = json_array_size(array);
  if (count > MOST_BUFFERS) return fail(check, NULL, 0, "%zu buffers are more than %d", count, MOST_BUFFERS);
  check->document->buffers = qmat_calloc(count, sizeof *check->document->buffers);
  if (!check->document->buffers) return fail_memory(check);
  check->document->buffer_count = count;
  for (size_t i = 0; i < count; i++) {
    json_t *object = json_array_get(array, i), *uri = json_object_get(object, "uri");
    qmat_gltf_buffer *buffer = &check->document->buffers[i];
    int64_t length = 0;
    qmat_status status = take_whole(check, object, "byteLength", "buffer", i, 1, UINT32_MAX, &length, NULL);
    if (status != QMAT_OK) return status;
    if (uri && !json_is_string(uri)) return fail(check, "buffer", i, "uri must be a string");
    if (!uri) {
      if (i > 0 || !check->asset.chunk) return fail(check, "buffer", i, "has no uri, and there is no GLB chunk for it");
      buffer->bytes = check->asset.chunk;
      buffer->size = check->asset.chunk_size;
    } else if (strncmp(json_string_value(uri), "data:", 5) == 0) {
      status = load_data_uri(check, i, json_string_value(uri), json_string_length(uri));
    } else {
      status = load_external(check, i, json_string_value(uri), json_string_length(uri));
    }
    if (status != QMAT_OK) return status;
    if ((uint64_t)length > buffer->size) {
      return fail(check, "buffer", i, "byteLength is %lld, but there are %zu bytes", (long long)length, buffer->size);
    }
    buffer->size = (size_t)length;
    check->document->data_size += buffer->size;
  }
  return QMAT_OK;
}

static qmat_status check_views(checker *check) {
  static const char *const keys[] = {"buffer", "byteOffset", "byteLength", "byteStride", NULL};
  json_t *array = json_object_get(check->root, "bufferViews");
  size_t count = json_array_size(array);
  check->views = qmat_calloc(count, sizeof *check->views);
  if (!check->views) return fail_memory(check);
  for (size_t i = 0; i < count; i++) {
    json_t *object = json_array_get(array, i);
    int64_t buffer = 0, offset = 0, length = 0, stride = 0;
    bool present;
    qmat_status status = take_id(check, object, "buffer", "bufferView", i, "buffers", &buffer, NULL);
    if (status == QMAT_OK) {
      status = take_whole(check, object, "byteOffset", "bufferView", i, 0, UINT32_MAX, &offset, &present);
    }
    if (status == QMAT_OK) {
      status = take_whole(check, object, "byteLength", "bufferView", i, 1, UINT32_MAX, &length, NULL);
    }
    if (status == QMAT_OK) {
      status = take_whole(check, object, "byteStride", "bufferView", i, 4, 252, &stride, &present);
    }
    if (status != QMAT_OK) return status;
    if (stride % 4 != 0) return fail(check, "bufferView", i, "byteStride %lld is no multiple of 4", (long long)stride);
    size_t size = check->document->buffers[buffer].size;
    if ((uint64_t)(offset + length) > size) {
      return fail(check, "bufferView", i, "bytes %lld to %lld lie outside buffer %lld of %zu bytes", (long long)offset,
                  (long long)(offset + length), (long long)buffer, size);
    }
    check->views[i] = (view){.size = length, .stride = stride};
    keep_keys(object, keys);
  }
  return QMAT_OK;
}

/* ---- accessors ---- */

/* The bytes of one element; columns of matrices start at multiples of 4. */
static int64_t element_size(int64_t component_type, int64_t components, bool matrix) {
  int64_t size = (int64_t)qmat_gltf_component_size(component_type);
  if (!matrix) return components * size;
  int64_t rows = components == 4 ? 2 : components == 9 ? 3 : 4;
  return rows * ((rows * size + 3) / 4 * 4);
}

/* Whether `count` elements fit into the view. */
static qmat_status check_range(const checker *check, size_t index, const char *what, int64_t view_id, int64_t offset,
                               int64_t count, int64_t stride, int64_t size) {
  int64_t end = offset + (count - 1) * stride + size; /* all below 2^41 */
  if (end <= check->views[view_id].size) return QMAT_OK;
  return fail(check, "accessor", index, "%s%lld elements need %lld bytes of bufferView %lld, which has %lld", what,
              (long long)count, (long long)end, (long long)view_id, (long long)check->views[view_id].size);
}

static qmat_status check_sparse(const checker *check, size_t index, json_t *sparse, const accessor *of, int64_t size) {
  static const char *const keys[] = {"count", "indices", "values", NULL};
  static const char *const part_keys[] = {"bufferView", "byteOffset", "componentType", NULL};
  json_t *indices, *values;
  int64_t count = 0, type = 0, view_id[2] = {0}, offset[2] = {0};
  bool present;
  qmat_status status = take_object(check, sparse, "indices", "accessor", index, &indices);
  if (status == QMAT_OK) status = take_object(check, sparse, "values", "accessor", index, &values);
  if (status != QMAT_OK) return status;
  if (!indices || !values) return fail(check, "accessor", index, "sparse must have indices and values");
  int64_t most = of->count < INT32_MAX ? of->count : INT32_MAX;
  status = take_whole(check, sparse, "count", "accessor", index, 1, most, &count, NULL);
  for (int k = 0; k < 2 && status == QMAT_OK; k++) {
    json_t *part = k ? values : indices;
    status = take_id(check, part, "bufferView", "accessor", index, "bufferViews", &view_id[k], NULL);
    if (status == QMAT_OK) {
      status = take_whole(check, part, "byteOffset", "accessor", index, 0, INT32_MAX, &offset[k], &present);
    }
  }
  if (status == QMAT_OK) {
    status =
        take_whole(check, indices, "componentType", "accessor", index, QMAT_GLTF_BYTE, QMAT_GLTF_FLOAT, &type, NULL);
  }
  if (status != QMAT_OK) return status;
  if (type != QMAT_GLTF_UNSIGNED_BYTE && type != QMAT_GLTF_UNSIGNED_SHORT && type != QMAT_GLTF_UNSIGNED_INT) {
    return fail(check, "accessor", index, "sparse.indices.componentType must be 5121, 5123 or 5125");
  }
  int64_t index_size = (int64_t)qmat_gltf_component_size(type);
  status = check_range(check, index, "sparse.indices: ", view_id[0], offset[0], count, index_size, index_size);
  if (status == QMAT_OK) {
    status = check_range(check, index, "sparse.values: ", view_id[1], offset[1], count, size, size);
  }
  keep_keys(sparse, keys);
  keep_keys(indices, part_keys);
  keep_keys(values, part_keys);
  return status;
}

static qmat_status check_accessor(const checker *check, size_t index, json_t *object, accessor *out) {
  static const char *const keys[] = {"bufferView", "byteOffset", "componentType", "normalized",
                                     "count",      "type",       "sparse",        NULL};
  static const struct {
    const char *name;
    int64_t components;
  } types[] = {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}};
  const char *type = json_string_value(json_object_get(object, "type"));
  if (!type) return fail(check, "accessor", index, "type is missing or no string");
  for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
    if (strcmp(types[i].name, type) == 0) out->components = types[i].components;
  }
  if (out->components == 0) return fail(check, "accessor", index, "type \"%.20s\" is unknown", type);
  const json_t *normalized = json_object_get(object, "normalized");
  if (normalized && !json_is_boolean(normalized)) return fail(check, "accessor", index, "normalized must be a boolean");
  out->normalized = json_is_true(normalized);

  int64_t view_id = 0, offset = 0;
  bool present;
  qmat_status status = take_whole(check, object, "componentType", "accessor", index, QMAT_GLTF_BYTE, QMAT_GLTF_FLOAT,
                                  &out->component_type, NULL);
  if (status == QMAT_OK) {
    status = take_whole(check, object, "count", "accessor", index, 1, UINT32_MAX, &out->count, NULL);
  }
  if (status == QMAT_OK) {
    status = take_whole(check, object, "byteOffset", "accessor", index, 0, UINT32_MAX, &offset, &present);
  }
  if (status == QMAT_OK) {
    status = take_id(check, object, "bufferView", "accessor", index, "bufferViews", &view_id, &out->has_view);
  }
  if (status != QMAT_OK) return status;
  if (out->component_type == 5124) return fail(check, "accessor", index, "componentType 5124 is not allowed in glTF");
  int64_t size = element_size(out->component_type, out->components, type[0] == 'M');
  if (out->has_view) {
    int64_t stride = check->views[view_id].stride;
    if (stride == 0) stride = size;
    if (stride < size) {
      return fail(check, "accessor", index, "its elements of %lld bytes overlap in bufferView %lld of byteStride %lld",
                  (long long)size, (long long)view_id, (long long)stride);
    }
    status = check_range(check, index, "", view_id, offset, out->count, stride, size);
    if (status != QMAT_OK) return status;
  }
  json_t *sparse;
  status = take_object(check, object, "sparse", "accessor", index, &sparse);
  if (status == QMAT_OK && sparse) status = check_sparse(check, index, sparse, out, size);
  keep_keys(object, keys);
  return status;
}

static qmat_status check_accessors(checker *check) {
  json_t *array = json_object_get(check->root, "accessors");
  size_t count = json_array_size(array);
  check->accessors = qmat_calloc(count, sizeof *check->accessors);
  if (!check->accessors) return fail_memory(check);
  for (size_t i = 0; i < count; i++) {
    qmat_status status = check_accessor(check, i, json_array_get(array, i), &check->accessors[i]);
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

/* ---- meshes ---- */

enum { ALLOW_BYTES = 1, ALLOW_SHORTS = 2, ALLOW_SIGNED = 4, ALLOW_UINTS = 8, ALLOW_FLOATS = 16 };

/* Whether the accessor may be what `what` asks for. `compressed`: its data come from Draco. */
static qmat_status check_use(const checker *check, int64_t id, const char *what, int64_t components, unsigned allowed,
                             bool compressed) {
  const accessor *of = &check->accessors[id];
  bool fits = of->components == components;
  switch (of->component_type) {
    case QMAT_GLTF_BYTE:
      fits = fits && (allowed & ALLOW_BYTES) && (allowed & ALLOW_SIGNED);
      break;
    case QMAT_GLTF_UNSIGNED_BYTE:
      fits = fits && (allowed & ALLOW_BYTES);
      break;
    case QMAT_GLTF_SHORT:
      fits = fits && (allowed & ALLOW_SHORTS) && (allowed & ALLOW_SIGNED);
      break;
    case QMAT_GLTF_UNSIGNED_SHORT:
      fits = fits && (allowed & ALLOW_SHORTS);
      break;
    case QMAT_GLTF_UNSIGNED_INT:
      fits = fits && (allowed & ALLOW_UINTS);
      break;
    default:
      fits = fits && (allowed & ALLOW_FLOATS);
      break;
  }
  if (!fits) {
    return fail(check, "accessor", (size_t)id, "its type of %lld components of %lld cannot be %s",
                (long long)of->components, (long long)of->component_type, what);
  }
  if (!compressed && !of->has_view && (uint64_t)of->count > check->document->data_size + FREE_ZEROS) {
    return fail(check, "accessor", (size_t)id, "asks for %lld elements without data", (long long)of->count);
  }
  return QMAT_OK;
}

/* Takes the number off "JOINTS_12"; -1 when the name is not of that kind. */
static int set_number(const char *name, const char *prefix) {
  size_t length = strlen(prefix);
  if (strncmp(name, prefix, length) != 0 || name[length] == '\0' || strlen(name + length) > 3) return -1;
  if (strspn(name + length, "0123456789") != strlen(name + length)) return -1;
  return atoi(name + length);
}

static qmat_status check_same_count(const checker *check, int64_t id, int64_t position, const char *what) {
  if (check->accessors[id].count == check->accessors[position].count) return QMAT_OK;
  return fail(check, "accessor", (size_t)id, "%.40s has %lld elements, POSITION has %lld", what,
              (long long)check->accessors[id].count, (long long)check->accessors[position].count);
}

/* The Draco extension of a primitive, reduced to ids; NULL when there is none. */
static qmat_status check_draco(const checker *check, size_t mesh, size_t index, json_t *primitive, json_t **draco) {
  static const char *const keys[] = {"bufferView", "attributes", NULL};
  static const char *const extension_keys[] = {"KHR_draco_mesh_compression", NULL};
  json_t *extensions, *attributes;
  *draco = NULL;
  qmat_status status = take_object(check, primitive, "extensions", "mesh", mesh, &extensions);
  if (status == QMAT_OK && extensions) {
    status = take_object(check, extensions, "KHR_draco_mesh_compression", "mesh", mesh, draco);
  }
  if (status != QMAT_OK) return status;
  if (!*draco) {
    json_object_del(primitive, "extensions");
    return QMAT_OK;
  }
  keep_keys(extensions, extension_keys);
  int64_t view_id = 0;
  status = take_id(check, *draco, "bufferView", "mesh", mesh, "bufferViews", &view_id, NULL);
  if (status == QMAT_OK) status = take_object(check, *draco, "attributes", "mesh", mesh, &attributes);
  if (status != QMAT_OK) return status;
  if (!attributes) return fail(check, "mesh", mesh, "primitive %zu: its Draco extension has no attributes", index);
  const json_t *plain = json_object_get(primitive, "attributes");
  const char *name;
  json_t *value;
  void *next;
  json_object_foreach_safe(attributes, next, name, value) {
    int64_t id;
    if (!whole(value, 0, INT32_MAX, &id)) {
      return fail(check, "mesh", mesh, "primitive %zu: the Draco id of %.40s must be a whole number from 0", index,
                  name);
    }
    if (!json_object_get(plain, name)) {
      return fail(check, "mesh", mesh, "primitive %zu: %.40s has a Draco id but is no attribute", index, name);
    }
    if (json_object_set_new(attributes, name, json_integer(id)) != 0) return fail_memory(check);
  }
  keep_keys(*draco, keys);
  /* Draco brings its own faces, and its accessor of indices need not have data. */
  json_object_del(primitive, "indices");
  return json_object_set_new(primitive, "mode", json_integer(4)) == 0 ? QMAT_OK : fail_memory(check);
}

/* The attributes that place vertices, checked; the others are deleted. */
static qmat_status check_attributes(const checker *check, size_t mesh, size_t index, json_t *attributes,
                                    const json_t *compressed, int64_t position) {
  const char *name;
  json_t *value;
  void *next;
  json_object_foreach_safe(attributes, next, name, value) {
    bool joints = set_number(name, "JOINTS_") >= 0, weights = set_number(name, "WEIGHTS_") >= 0;
    bool is_position = strcmp(name, "POSITION") == 0;
    if (!joints && !weights && !is_position) {
      json_object_del(attributes, name);
      continue;
    }
    int64_t id = json_integer_value(value);
    bool draco = json_object_get(compressed, name) != NULL;
    qmat_status status;
    if (is_position) {
      status = check_use(check, id, "POSITION", 3, ALLOW_BYTES | ALLOW_SHORTS | ALLOW_SIGNED | ALLOW_FLOATS, draco);
    } else if (joints) {
      status = check_use(check, id, "JOINTS", 4, ALLOW_BYTES | ALLOW_SHORTS, draco);
    } else {
      status = check_use(check, id, "WEIGHTS", 4, ALLOW_BYTES | ALLOW_SHORTS | ALLOW_FLOATS, draco);
    }
    if (status == QMAT_OK) status = check_same_count(check, id, position, name);
    if (status != QMAT_OK) return status;
    char partner[16];
    snprintf(partner, sizeof partner, "%s_%s", joints ? "WEIGHTS" : "JOINTS",
             is_position ? "" : strrchr(name, '_') + 1);
    if (!is_position && !json_object_get(attributes, partner)) {
      return fail(check, "mesh", mesh, "primitive %zu: %.40s without %s", index, name, partner);
    }
  }
  return QMAT_OK;
}

static qmat_status check_targets(const checker *check, size_t mesh, size_t index, json_t *primitive, int64_t position) {
  static const char *const keys[] = {"POSITION", NULL};
  json_t *targets;
  qmat_status status = take_array(check, primitive, "targets", "mesh", mesh, &targets);
  for (size_t t = 0; t < json_array_size(targets) && status == QMAT_OK; t++) {
    json_t *target = json_array_get(targets, t);
    if (!json_is_object(target)) {
      return fail(check, "mesh", mesh, "primitive %zu: morph target %zu must be an object", index, t);
    }
    int64_t id = 0;
    bool present;
    status = take_id(check, target, "POSITION", "mesh", mesh, "accessors", &id, &present);
    if (status == QMAT_OK && present) {
      status = check_use(check, id, "POSITION of a morph target", 3,
                         ALLOW_BYTES | ALLOW_SHORTS | ALLOW_SIGNED | ALLOW_FLOATS, false);
    }
    if (status == QMAT_OK && present) status = check_same_count(check, id, position, "a morph target");
    keep_keys(target, keys);
  }
  return status;
}

static qmat_status check_primitive(const checker *check, size_t mesh, size_t index, json_t *primitive) {
  static const char *const keys[] = {"attributes", "indices", "mode", "targets", "extensions", NULL};
  if (!json_is_object(primitive)) return fail(check, "mesh", mesh, "primitive %zu must be an object", index);
  keep_keys(primitive, keys);
  json_t *attributes, *draco;
  int64_t mode = 4, indices = 0, position = -1;
  bool present;
  qmat_status status = take_object(check, primitive, "attributes", "mesh", mesh, &attributes);
  if (status == QMAT_OK) status = take_whole(check, primitive, "mode", "mesh", mesh, 0, 6, &mode, &present);
  if (status != QMAT_OK) return status;
  if (!attributes) return fail(check, "mesh", mesh, "primitive %zu has no attributes", index);
  const char *name;
  json_t *value;
  void *next;
  json_object_foreach_safe(attributes, next, name, value) {
    int64_t id = 0;
    status = take_id(check, attributes, name, "mesh", mesh, "accessors", &id, NULL);
    if (status != QMAT_OK) return status;
    if (strcmp(name, "POSITION") == 0) position = id;
  }
  bool has_indices;
  status = take_id(check, primitive, "indices", "mesh", mesh, "accessors", &indices, &has_indices);
  if (status != QMAT_OK) return status;
  if (mode < 4 || position < 0) { /* nothing to show: left in as a mark that it was there */
    json_object_clear(primitive);
    return json_object_set_new(primitive, "attributes", json_object()) == 0 ? QMAT_OK : fail_memory(check);
  }
  status = check_draco(check, mesh, index, primitive, &draco);
  if (status != QMAT_OK) return status;
  if (has_indices && !draco) {
    status = check_use(check, indices, "indices", 1, ALLOW_BYTES | ALLOW_SHORTS | ALLOW_UINTS, false);
    if (status != QMAT_OK) return status;
    if (!check->accessors[indices].has_view) {
      return fail(check, "accessor", (size_t)indices, "holds indices but has no bufferView");
    }
  }
  status = check_attributes(check, mesh, index, attributes, json_object_get(draco, "attributes"), position);
  if (status == QMAT_OK) status = check_targets(check, mesh, index, primitive, position);
  return status;
}

static qmat_status check_meshes(const checker *check) {
  static const char *const keys[] = {"primitives", "weights", NULL};
  json_t *array = json_object_get(check->root, "meshes");
  for (size_t i = 0; i < json_array_size(array); i++) {
    json_t *mesh = json_array_get(array, i), *primitives;
    bool present;
    qmat_status status = take_array(check, mesh, "primitives", "mesh", i, &primitives);
    if (status == QMAT_OK) status = take_numbers(check, mesh, "weights", "mesh", i, SIZE_MAX, NULL, &present);
    if (status != QMAT_OK) return status;
    if (!primitives) return fail(check, "mesh", i, "has no primitives");
    for (size_t p = 0; p < json_array_size(primitives); p++) {
      status = check_primitive(check, i, p, json_array_get(primitives, p));
      if (status != QMAT_OK) return status;
    }
    keep_keys(mesh, keys);
  }
  return QMAT_OK;
}

/* ---- skins, nodes, scenes ---- */

/* An array of ids of nodes, written whole. */
static qmat_status check_node_ids(const checker *check, json_t *object, const char *key, const char *kind,
                                  size_t element, json_t **ids) {
  size_t count = json_array_size(json_object_get(check->root, "nodes"));
  qmat_status status = take_array(check, object, key, kind, element, ids);
  for (size_t i = 0; i < json_array_size(*ids) && status == QMAT_OK; i++) {
    int64_t id;
    if (!whole(json_array_get(*ids, i), 0, INT64_MAX, &id)) {
      return fail(check, kind, element, "%s must hold whole numbers from 0", key);
    }
    if ((uint64_t)id >= count) {
      return fail(check, kind, element, "%s names node %lld, but there are %zu", key, (long long)id, count);
    }
    if (json_array_set_new(*ids, i, json_integer(id)) != 0) return fail_memory(check);
  }
  return status;
}

static qmat_status check_skins(const checker *check) {
  static const char *const keys[] = {"joints", "inverseBindMatrices", NULL};
  json_t *array = json_object_get(check->root, "skins");
  for (size_t i = 0; i < json_array_size(array); i++) {
    json_t *skin = json_array_get(array, i), *joints;
    int64_t matrices = 0;
    bool present;
    qmat_status status = check_node_ids(check, skin, "joints", "skin", i, &joints);
    if (status == QMAT_OK) {
      status = take_id(check, skin, "inverseBindMatrices", "skin", i, "accessors", &matrices, &present);
    }
    if (status != QMAT_OK) return status;
    if (json_array_size(joints) == 0) return fail(check, "skin", i, "has no joints");
    if (present) {
      status = check_use(check, matrices, "inverse bind matrices", 16, ALLOW_FLOATS, false);
      if (status != QMAT_OK) return status;
      if ((size_t)check->accessors[matrices].count < json_array_size(joints)) {
        return fail(check, "skin", i, "has %zu joints but %lld inverse bind matrices", json_array_size(joints),
                    (long long)check->accessors[matrices].count);
      }
    }
    keep_keys(skin, keys);
  }
  return QMAT_OK;
}

static qmat_status check_node(const checker *check, size_t index, json_t *node) {
  static const char *const keys[] = {"children", "matrix", "translation", "rotation", "scale",
                                     "mesh",     "skin",   "weights",     NULL};
  json_t *children;
  int64_t id = 0;
  double numbers[16];
  bool present;
  qmat_status status = check_node_ids(check, node, "children", "node", index, &children);
  if (status == QMAT_OK) status = take_id(check, node, "mesh", "node", index, "meshes", &id, &present);
  if (status == QMAT_OK) status = take_id(check, node, "skin", "node", index, "skins", &id, &present);
  if (status == QMAT_OK) status = take_numbers(check, node, "matrix", "node", index, 16, numbers, &present);
  if (status == QMAT_OK) status = take_numbers(check, node, "translation", "node", index, 3, numbers, &present);
  if (status == QMAT_OK) status = take_numbers(check, node, "scale", "node", index, 3, numbers, &present);
  if (status == QMAT_OK) status = take_numbers(check, node, "weights", "node", index, SIZE_MAX, NULL, &present);
  if (status == QMAT_OK) status = take_numbers(check, node, "rotation", "node", index, 4, numbers, &present);
  if (status != QMAT_OK) return status;
  if (present) {
    double length = hypot(hypot(numbers[0], numbers[1]), hypot(numbers[2], numbers[3]));
    if (!(length > 0) || !isfinite(length)) return fail(check, "node", index, "rotation is no quaternion");
  }
  keep_keys(node, keys);
  return QMAT_OK;
}

/* The nodes are trees: one parent at most, and every node is reached from a root. `has_parent` and `stack` hold one
 * element a node. */
static qmat_status check_trees(const checker *check, uint8_t *has_parent, size_t *stack) {
  json_t *nodes = json_object_get(check->root, "nodes");
  size_t count = json_array_size(nodes), waiting = 0, reached = 0;
  for (size_t i = 0; i < count; i++) {
    json_t *children = json_object_get(json_array_get(nodes, i), "children");
    for (size_t k = 0; k < json_array_size(children); k++) {
      size_t child = (size_t)json_integer_value(json_array_get(children, k));
      if (has_parent[child]) return fail(check, "node", child, "is a child more than once");
      has_parent[child] = 1;
    }
  }
  for (size_t i = 0; i < count; i++) {
    if (!has_parent[i]) stack[waiting++] = i;
  }
  uint8_t *marks = qmat_calloc(count, 1);
  if (!marks) return fail_memory(check);
  while (waiting > 0) {
    size_t node = stack[--waiting];
    marks[node] = 1;
    reached++;
    json_t *children = json_object_get(json_array_get(nodes, node), "children");
    for (size_t k = 0; k < json_array_size(children); k++) {
      stack[waiting++] = (size_t)json_integer_value(json_array_get(children, k));
    }
  }
  size_t missed = 0;
  while (missed < count && marks[missed]) missed++;
  qmat_free(marks);
  if (reached < count) return fail(check, "node", missed, "is its own ancestor");
  return QMAT_OK;
}

/* Leaves one scene: the one to be read. `has_parent` as made by check_trees. */
static qmat_status choose_scene(const checker *check, uint8_t *has_parent) {
  json_t *scenes = json_object_get(check->root, "scenes"), *nodes = json_object_get(check->root, "nodes");
  json_t *ids = NULL;
  int64_t scene = 0;
  bool present;
  qmat_status status = take_id(check, check->root, "scene", NULL, 0, "scenes", &scene, &present);
  if (status != QMAT_OK) return status;
  json_t *roots = json_array();
  if (!roots) return fail_memory(check);
  if (json_array_size(scenes) > 0) {
    status = check_node_ids(check, json_array_get(scenes, (size_t)scene), "nodes", "scene", (size_t)scene, &ids);
    for (size_t i = 0; i < json_array_size(ids) && status == QMAT_OK; i++) {
      json_t *value = json_array_get(ids, i);
      size_t id = (size_t)json_integer_value(value);
      if (has_parent[id]) {
        status = fail(check, "scene", (size_t)scene, "names node %zu twice or below another node", id);
      } else if (json_array_append(roots, value) != 0) {
        status = fail_memory(check);
      }
      has_parent[id] = 1;
    }
  } else {
    for (size_t i = 0; i < json_array_size(nodes) && status == QMAT_OK; i++) {
      if (!has_parent[i] && json_array_append_new(roots, json_integer((json_int_t)i)) != 0) {
        status = fail_memory(check);
      }
    }
  }
  if (status != QMAT_OK) {
    json_decref(roots);
    return status;
  }
  json_t *only = json_pack("[{s:o}]", "nodes", roots);
  if (!only || json_object_set_new(check->root, "scenes", only) != 0) return fail_memory(check);
  return QMAT_OK;
}

static qmat_status check_nodes(const checker *check) {
  json_t *array = json_object_get(check->root, "nodes");
  size_t count = json_array_size(array);
  for (size_t i = 0; i < count; i++) {
    qmat_status status = check_node(check, i, json_array_get(array, i));
    if (status != QMAT_OK) return status;
  }
  uint8_t *has_parent = qmat_calloc(count, 1);
  size_t *stack = qmat_alloc(count, sizeof *stack);
  qmat_status status = has_parent && stack ? check_trees(check, has_parent, stack) : fail_memory(check);
  if (status == QMAT_OK) status = choose_scene(check, has_parent);
  qmat_free(stack);
  qmat_free(has_parent);
  return status;
}

/* ---- the document ---- */

static qmat_status write_reduced(const checker *check) {
  static const char *const keys[] = {"asset", "bufferViews", "accessors", "meshes", "nodes", "skins", "scenes", NULL};
  keep_keys(check->root, keys);
  json_t *asset = json_pack("{s:s}", "version", "2.0");
  if (!asset || json_object_set_new(check->root, "asset", asset) != 0) return fail_memory(check);
  size_t size = json_dumpb(check->root, NULL, 0, JSON_COMPACT);
  check->document->text = size > 0 ? qmat_alloc(size + 1, 1) : NULL;
  if (!check->document->text) return fail_memory(check);
  check->document->text_length = json_dumpb(check->root, check->document->text, size, JSON_COMPACT);
  if (check->document->text_length != size) return fail_memory(check);
  check->document->text[size] = '\0';
  return QMAT_OK;
}

qmat_status qmat_gltf_document_read(qmat_context *context, const uint8_t *bytes, size_t size, const char *path,
                                    qmat_gltf_document *document) {
  static const char *const arrays[][2] = {{"buffers", "buffer"},     {"bufferViews", "bufferView"},
                                          {"accessors", "accessor"}, {"meshes", "mesh"},
                                          {"nodes", "node"},         {"skins", "skin"},
                                          {"scenes", "scene"}};
  *document = (qmat_gltf_document){0};
  checker check = {.context = context, .path = path, .document = document};
  document->extensions_ignored = json_array();
  qmat_status status = document->extensions_ignored ? QMAT_OK : fail_memory(&check);
  if (status == QMAT_OK) status = qmat_gltf_asset_init(context, bytes, size, path, &check.asset);
  check.root = check.asset.root;
  if (status == QMAT_OK) status = check_asset(&check);
  for (size_t i = 0; i < sizeof arrays / sizeof *arrays && status == QMAT_OK; i++) {
    status = check_root_array(&check, arrays[i][0], arrays[i][1]);
  }
  if (status == QMAT_OK) status = load_buffers(&check);
  if (status == QMAT_OK) status = check_views(&check);
  if (status == QMAT_OK) status = check_accessors(&check);
  if (status == QMAT_OK) status = check_meshes(&check);
  if (status == QMAT_OK) status = check_skins(&check);
  if (status == QMAT_OK) status = check_nodes(&check);
  if (status == QMAT_OK) status = write_reduced(&check);
  qmat_free(check.views);
  qmat_free(check.accessors);
  qmat_gltf_asset_uninit(&check.asset);
  return status;
}

void qmat_gltf_document_uninit(qmat_gltf_document *document) {
  for (size_t i = 0; i < document->buffer_count; i++) {
    qmat_free(document->buffers[i].owned);
    qmat_bytes_uninit(&document->buffers[i].file);
  }
  qmat_free(document->buffers);
  qmat_free(document->text);
  json_decref(document->extensions_ignored);
  *document = (qmat_gltf_document){0};
}
