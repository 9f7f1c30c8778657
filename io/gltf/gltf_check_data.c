/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_check_data.h"

#include <string.h>

#include "core/arena.h"
#include "io/gltf/gltf_check_meshopt.h"
#include "io/gltf/gltf_uri.h"

#define MOST_BUFFERS 4096
/* An accessor without a buffer view means zeros and needs no bytes. It may have this many elements plus one per byte of
 * data. Morph targets have one element per vertex, and the vertices themselves normally need more bytes. */
#define FREE_ZEROS 65536

/* ---- buffers ---- */

static qmat_status load_external(const qmat_gltf_checker *check, size_t index, const char *uri, size_t uri_length) {
  qmat_gltf_buffer *buffer = &check->document->buffers[index];
  const json_t *all = json_object_get(check->root, "buffers");
  for (size_t i = 0; i < index; i++) { /* several buffers may name one file */
    const char *other = json_string_value(json_object_get(json_array_get(all, i), "uri"));
    if (other && strcmp(other, uri) == 0 && !check->document->buffers[i].is_placeholder) {
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
    return qmat_gltf_fail(check, "buffer", index, "uri \"%.100s\" is not a relative path inside the asset's folder",
                          uri);
  }
  char *path = qmat_gltf_beside(check->path, name);
  status = path ? qmat_bytes_read_file(check->context, path, &buffer->file) : qmat_gltf_fail_memory(check);
  if (status != QMAT_OK && path) qmat_fail_element(check->context, "buffer", (int64_t)index);
  buffer->bytes = buffer->file.data;
  buffer->size = buffer->file.size;
  qmat_free(path);
  qmat_free(name);
  return status;
}

static qmat_status load_data_uri(const qmat_gltf_checker *check, size_t index, const char *uri, size_t uri_length) {
  qmat_gltf_buffer *buffer = &check->document->buffers[index];
  const qmat_status status = qmat_gltf_decode_uri(check->context, uri, uri_length, &buffer->owned, &buffer->size);
  if (status != QMAT_OK) {
    qmat_fail_element(check->context, "buffer", (int64_t)index);
    return qmat_fail_at(check->context, check->path, 0, 0);
  }
  if (!buffer->owned) return qmat_gltf_fail(check, "buffer", index, "the data URI is not base64");
  buffer->bytes = buffer->owned;
  return QMAT_OK;
}

static qmat_status load_buffers(const qmat_gltf_checker *check) {
  json_t *array = json_object_get(check->root, "buffers");
  size_t count = json_array_size(array);
  if (count > MOST_BUFFERS) return qmat_gltf_fail(check, NULL, 0, "%zu buffers; the limit is %d", count, MOST_BUFFERS);
  const size_t view_count = json_array_size(json_object_get(check->root, "bufferViews"));
  check->document->buffers = qmat_calloc(count + view_count, sizeof *check->document->buffers);
  if (!check->document->buffers) return qmat_gltf_fail_memory(check);
  check->document->buffer_count = count;
  for (size_t i = 0; i < count; i++) {
    json_t *object = json_array_get(array, i), *uri = json_object_get(object, "uri");
    qmat_gltf_buffer *buffer = &check->document->buffers[i];
    int64_t length = 0;
    qmat_status status = qmat_gltf_take_whole(check, object, "byteLength", "buffer", i, 1, UINT32_MAX, &length, NULL);
    if (status != QMAT_OK) return status;
    if (uri && !json_is_string(uri)) return qmat_gltf_fail(check, "buffer", i, "uri must be a string");
    const bool is_chunk = !uri && i == 0 && check->asset.chunk;
    status = qmat_gltf_check_placeholder(check, i, object, &buffer->is_placeholder);
    if (status != QMAT_OK) return status;
    buffer->is_placeholder = !is_chunk && (!uri || buffer->is_placeholder); /* some writers do not mark them */
    if (buffer->is_placeholder) {
      buffer->size = (size_t)length;
      continue;
    }
    if (is_chunk) {
      buffer->bytes = check->asset.chunk;
      buffer->size = check->asset.chunk_size;
    } else if (strncmp(json_string_value(uri), "data:", 5) == 0) {
      status = load_data_uri(check, i, json_string_value(uri), json_string_length(uri));
    } else {
      status = load_external(check, i, json_string_value(uri), json_string_length(uri));
    }
    if (status != QMAT_OK) return status;
    if ((uint64_t)length > buffer->size) {
      return qmat_gltf_fail(check, "buffer", i, "byteLength is %lld, but there are %zu bytes", (long long)length,
                            buffer->size);
    }
    buffer->size = (size_t)length;
    check->document->data_size += buffer->size;
  }
  return QMAT_OK;
}

static qmat_status check_views(qmat_gltf_checker *check) {
  static const char *const keys[] = {"buffer", "byteOffset", "byteLength", "byteStride", NULL};
  json_t *array = json_object_get(check->root, "bufferViews");
  size_t count = json_array_size(array);
  check->views = qmat_calloc(count, sizeof *check->views);
  if (!check->views) return qmat_gltf_fail_memory(check);
  for (size_t i = 0; i < count; i++) {
    json_t *object = json_array_get(array, i);
    int64_t buffer = 0, offset = 0, length = 0, stride = 0;
    bool present;
    qmat_status status = qmat_gltf_take_id(check, object, "buffer", "bufferView", i, "buffers", &buffer, NULL);
    if (status == QMAT_OK)
      status = qmat_gltf_take_whole(check, object, "byteOffset", "bufferView", i, 0, UINT32_MAX, &offset, &present);
    if (status == QMAT_OK)
      status = qmat_gltf_take_whole(check, object, "byteLength", "bufferView", i, 1, UINT32_MAX, &length, NULL);
    if (status == QMAT_OK)
      status = qmat_gltf_take_whole(check, object, "byteStride", "bufferView", i, 4, 252, &stride, &present);
    if (status != QMAT_OK) return status;
    if (stride % 4 != 0)
      return qmat_gltf_fail(check, "bufferView", i, "byteStride %lld is not a multiple of 4", (long long)stride);
    size_t size = check->document->buffers[buffer].size;
    if ((uint64_t)(offset + length) > size) {
      return qmat_gltf_fail(check, "bufferView", i, "bytes %lld to %lld lie outside buffer %lld of %zu bytes",
                            (long long)offset, (long long)(offset + length), (long long)buffer, size);
    }
    status = qmat_gltf_check_meshopt(check, i, object, &length);
    if (status != QMAT_OK) return status;
    check->views[i] = (qmat_gltf_view){.size = length, .stride = stride};
    qmat_gltf_keep_keys(object, keys);
  }
  return QMAT_OK;
}

/* ---- accessors ---- */

/* The size of one element in bytes; matrix columns are aligned to 4 bytes. */
static int64_t element_size(int64_t component_type, int64_t components, bool matrix) {
  int64_t size = (int64_t)qmat_gltf_component_size(component_type);
  if (!matrix) return components * size;
  int64_t rows = components == 4 ? 2 : components == 9 ? 3 : 4;
  return rows * ((rows * size + 3) / 4 * 4);
}

/* Checks that `count` elements fit into the view. */
static qmat_status check_range(const qmat_gltf_checker *check, size_t index, const char *what, int64_t view_id,
                               int64_t offset, int64_t count, int64_t stride, int64_t size) {
  int64_t end = offset + (count - 1) * stride + size; /* all below 2^41 */
  if (end <= check->views[view_id].size) return QMAT_OK;
  return qmat_gltf_fail(check, "accessor", index, "%s%lld elements need %lld bytes, but bufferView %lld has %lld", what,
                        (long long)count, (long long)end, (long long)view_id, (long long)check->views[view_id].size);
}

static qmat_status check_sparse(const qmat_gltf_checker *check, size_t index, json_t *sparse,
                                const qmat_gltf_accessor *of, int64_t size) {
  static const char *const keys[] = {"count", "indices", "values", NULL};
  static const char *const part_keys[] = {"bufferView", "byteOffset", "componentType", NULL};
  json_t *indices, *values;
  int64_t count = 0, type = 0, view_id[2] = {0}, offset[2] = {0};
  bool present;
  qmat_status status = qmat_gltf_take_object(check, sparse, "indices", "accessor", index, &indices);
  if (status == QMAT_OK) status = qmat_gltf_take_object(check, sparse, "values", "accessor", index, &values);
  if (status != QMAT_OK) return status;
  if (!indices || !values) return qmat_gltf_fail(check, "accessor", index, "sparse must have indices and values");
  int64_t most = of->count < INT32_MAX ? of->count : INT32_MAX;
  status = qmat_gltf_take_whole(check, sparse, "count", "accessor", index, 1, most, &count, NULL);
  for (int k = 0; k < 2 && status == QMAT_OK; k++) {
    json_t *part = k ? values : indices;
    status = qmat_gltf_take_id(check, part, "bufferView", "accessor", index, "bufferViews", &view_id[k], NULL);
    if (status == QMAT_OK)
      status = qmat_gltf_take_whole(check, part, "byteOffset", "accessor", index, 0, INT32_MAX, &offset[k], &present);
  }
  if (status == QMAT_OK) {
    status = qmat_gltf_take_whole(check, indices, "componentType", "accessor", index, QMAT_GLTF_BYTE, QMAT_GLTF_FLOAT,
                                  &type, NULL);
  }
  if (status != QMAT_OK) return status;
  if (type != QMAT_GLTF_UNSIGNED_BYTE && type != QMAT_GLTF_UNSIGNED_SHORT && type != QMAT_GLTF_UNSIGNED_INT)
    return qmat_gltf_fail(check, "accessor", index, "sparse.indices.componentType must be 5121, 5123 or 5125");
  int64_t index_size = (int64_t)qmat_gltf_component_size(type);
  status = check_range(check, index, "sparse.indices: ", view_id[0], offset[0], count, index_size, index_size);
  if (status == QMAT_OK)
    status = check_range(check, index, "sparse.values: ", view_id[1], offset[1], count, size, size);
  qmat_gltf_keep_keys(sparse, keys);
  qmat_gltf_keep_keys(indices, part_keys);
  qmat_gltf_keep_keys(values, part_keys);
  return status;
}

static qmat_status check_accessor(const qmat_gltf_checker *check, size_t index, json_t *object,
                                  qmat_gltf_accessor *out) {
  static const char *const keys[] = {"bufferView", "byteOffset", "componentType", "normalized",
                                     "count",      "type",       "sparse",        NULL};
  static const struct {
    const char *name;
    int64_t components;
  } types[] = {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}};
  const char *type = json_string_value(json_object_get(object, "type"));
  if (!type) return qmat_gltf_fail(check, "accessor", index, "type must be a string");
  for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
    if (strcmp(types[i].name, type) == 0) out->components = types[i].components;
  }
  if (out->components == 0) return qmat_gltf_fail(check, "accessor", index, "type \"%.20s\" is unknown", type);
  const json_t *normalized = json_object_get(object, "normalized");
  if (normalized && !json_is_boolean(normalized))
    return qmat_gltf_fail(check, "accessor", index, "normalized must be a boolean");
  out->normalized = json_is_true(normalized);

  int64_t view_id = 0, offset = 0;
  bool present;
  qmat_status status = qmat_gltf_take_whole(check, object, "componentType", "accessor", index, QMAT_GLTF_BYTE,
                                            QMAT_GLTF_FLOAT, &out->component_type, NULL);
  if (status == QMAT_OK)
    status = qmat_gltf_take_whole(check, object, "count", "accessor", index, 1, UINT32_MAX, &out->count, NULL);
  if (status == QMAT_OK)
    status = qmat_gltf_take_whole(check, object, "byteOffset", "accessor", index, 0, UINT32_MAX, &offset, &present);
  if (status == QMAT_OK)
    status = qmat_gltf_take_id(check, object, "bufferView", "accessor", index, "bufferViews", &view_id, &out->has_view);
  if (status != QMAT_OK) return status;
  if (out->component_type == 5124)
    return qmat_gltf_fail(check, "accessor", index, "componentType 5124 is not allowed in glTF");
  int64_t size = element_size(out->component_type, out->components, type[0] == 'M');
  if (out->has_view) {
    int64_t stride = check->views[view_id].stride;
    if (stride == 0) stride = size;
    if (stride < size) {
      return qmat_gltf_fail(check, "accessor", index,
                            "elements of %lld bytes overlap: bufferView %lld has byteStride %lld", (long long)size,
                            (long long)view_id, (long long)stride);
    }
    status = check_range(check, index, "", view_id, offset, out->count, stride, size);
    if (status != QMAT_OK) return status;
  }
  json_t *sparse;
  status = qmat_gltf_take_object(check, object, "sparse", "accessor", index, &sparse);
  if (status == QMAT_OK && sparse) status = check_sparse(check, index, sparse, out, size);
  qmat_gltf_keep_keys(object, keys);
  return status;
}

static qmat_status check_accessors(qmat_gltf_checker *check) {
  json_t *array = json_object_get(check->root, "accessors");
  size_t count = json_array_size(array);
  check->accessors = qmat_calloc(count, sizeof *check->accessors);
  if (!check->accessors) return qmat_gltf_fail_memory(check);
  for (size_t i = 0; i < count; i++) {
    qmat_status status = check_accessor(check, i, json_array_get(array, i), &check->accessors[i]);
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

qmat_status qmat_gltf_check_data(qmat_gltf_checker *check) {
  qmat_status status = load_buffers(check);
  if (status == QMAT_OK) status = check_views(check);
  return status == QMAT_OK ? check_accessors(check) : status;
}

/* ---- accessor uses ---- */

qmat_status qmat_gltf_check_use(const qmat_gltf_checker *check, int64_t id, const char *what, int64_t components,
                                unsigned allowed, bool compressed) {
  const qmat_gltf_accessor *of = &check->accessors[id];
  bool fits = of->components == components;
  switch (of->component_type) {
    case QMAT_GLTF_BYTE:
      fits = fits && (allowed & QMAT_GLTF_ALLOW_BYTES) && (allowed & QMAT_GLTF_ALLOW_SIGNED);
      break;
    case QMAT_GLTF_UNSIGNED_BYTE:
      fits = fits && (allowed & QMAT_GLTF_ALLOW_BYTES);
      break;
    case QMAT_GLTF_SHORT:
      fits = fits && (allowed & QMAT_GLTF_ALLOW_SHORTS) && (allowed & QMAT_GLTF_ALLOW_SIGNED);
      break;
    case QMAT_GLTF_UNSIGNED_SHORT:
      fits = fits && (allowed & QMAT_GLTF_ALLOW_SHORTS);
      break;
    case QMAT_GLTF_UNSIGNED_INT:
      fits = fits && (allowed & QMAT_GLTF_ALLOW_UINTS);
      break;
    default:
      fits = fits && (allowed & QMAT_GLTF_ALLOW_FLOATS);
      break;
  }
  if (!fits) {
    return qmat_gltf_fail(check, "accessor", (size_t)id, "%lld components of type %lld cannot be %s",
                          (long long)of->components, (long long)of->component_type, what);
  }
  if (!compressed && !of->has_view && (uint64_t)of->count > check->document->data_size + FREE_ZEROS)
    return qmat_gltf_fail(check, "accessor", (size_t)id,
                          "has %lld elements without data, too many for the size of the asset", (long long)of->count);
  return QMAT_OK;
}
