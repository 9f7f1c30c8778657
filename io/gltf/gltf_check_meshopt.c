/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_check_meshopt.h"

#include <string.h>

#include "core/arena.h"
#include "io/gltf/gltf_meshopt.h"

/* Views that share compressed bytes would multiply a small file without end. */
#define MOST_RATIO 64

/* The object's extension EXT_meshopt_compression; NULL: none. */
static qmat_status take_extension(const qmat_gltf_checker *check, json_t *object, const char *kind, size_t index,
                                  json_t **extension) {
  json_t *extensions;
  *extension = NULL;
  const qmat_status status = qmat_gltf_take_object(check, object, "extensions", kind, index, &extensions);
  if (status != QMAT_OK || !extensions) return status;
  return qmat_gltf_take_object(check, extensions, QMAT_GLTF_MESHOPT, kind, index, extension);
}

qmat_status qmat_gltf_check_placeholder(const qmat_gltf_checker *check, size_t index, json_t *buffer,
                                        bool *is_fallback) {
  json_t *extension;
  const qmat_status status = take_extension(check, buffer, "buffer", index, &extension);
  const json_t *fallback = json_object_get(extension, "fallback");
  if (status == QMAT_OK && fallback && !json_is_boolean(fallback))
    return qmat_gltf_fail(check, "buffer", index, QMAT_GLTF_MESHOPT ": fallback must be a boolean");
  *is_fallback = json_is_true(fallback);
  return status;
}

/* Reads one of the `count` names; the first one if the key is missing and may be. */
static qmat_status take_name(const qmat_gltf_checker *check, size_t index, const json_t *extension, const char *key,
                             const char *const names[], int count, bool is_optional, int *number) {
  const json_t *value = json_object_get(extension, key);
  const char *name = json_string_value(value);
  *number = 0;
  if (!value && is_optional) return QMAT_OK;
  for (int i = 0; name && i < count; i++) {
    if (strcmp(names[i], name) != 0) continue;
    *number = i;
    return QMAT_OK;
  }
  return qmat_gltf_fail(check, "bufferView", index, QMAT_GLTF_MESHOPT ": %s \"%.20s\" is unknown", key,
                        name ? name : "");
}

/* Reads the extension of a view. */
static qmat_status take_view(const qmat_gltf_checker *check, size_t index, json_t *extension, qmat_meshopt_view *view) {
  static const char *const modes[] = {"ATTRIBUTES", "TRIANGLES", "INDICES"};
  static const char *const filters[] = {"NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL"};
  static const char kind[] = "bufferView";
  int64_t id = 0, offset = 0, size = 0, stride = 0, count = 0;
  int mode = 0, filter = 0;
  bool present;
  qmat_status status = qmat_gltf_take_id(check, extension, "buffer", kind, index, "buffers", &id, NULL);
  if (status == QMAT_OK)
    status = qmat_gltf_take_whole(check, extension, "byteOffset", kind, index, 0, UINT32_MAX, &offset, &present);
  if (status == QMAT_OK)
    status = qmat_gltf_take_whole(check, extension, "byteLength", kind, index, 1, UINT32_MAX, &size, NULL);
  if (status == QMAT_OK)
    status = qmat_gltf_take_whole(check, extension, "byteStride", kind, index, 1, 256, &stride, NULL);
  if (status == QMAT_OK)
    status = qmat_gltf_take_whole(check, extension, "count", kind, index, 1, UINT32_MAX, &count, NULL);
  if (status == QMAT_OK) status = take_name(check, index, extension, "mode", modes, 3, false, &mode);
  if (status == QMAT_OK) status = take_name(check, index, extension, "filter", filters, 4, true, &filter);
  if (status != QMAT_OK) return status;
  const qmat_gltf_buffer *buffer = &check->document->buffers[id];
  if (buffer->is_placeholder)
    return qmat_gltf_fail(check, kind, index,
                          "its compressed data are in buffer %lld, which has no uri and no GLB chunk, or is a fallback",
                          (long long)id);
  if ((uint64_t)(offset + size) > buffer->size) {
    return qmat_gltf_fail(check, kind, index, "compressed bytes %lld to %lld lie outside buffer %lld of %zu bytes",
                          (long long)offset, (long long)(offset + size), (long long)id, buffer->size);
  }
  *view = (qmat_meshopt_view){.bytes = buffer->bytes + offset,
                              .size = (size_t)size,
                              .mode = (qmat_meshopt_mode)mode,
                              .filter = (qmat_meshopt_filter)filter,
                              .count = (size_t)count,
                              .stride = (size_t)stride};
  return QMAT_OK;
}

qmat_status qmat_gltf_check_meshopt(const qmat_gltf_checker *check, size_t index, json_t *view, int64_t *size) {
  qmat_gltf_document *document = check->document;
  const size_t buffer = (size_t)json_integer_value(json_object_get(view, "buffer"));
  json_t *extension;
  qmat_meshopt_view packed;
  qmat_status status = take_extension(check, view, "bufferView", index, &extension);
  if (status != QMAT_OK) return status;
  if (!extension && document->buffers[buffer].is_placeholder)
    return qmat_gltf_fail(check, "bufferView", index, "buffer %zu has no uri and no GLB chunk, or is a fallback",
                          buffer);
  if (!extension) return QMAT_OK;
  status = take_view(check, index, extension, &packed);
  if (status != QMAT_OK) return status;
  const json_t *stride = json_object_get(view, "byteStride");
  if (stride && (size_t)json_integer_value(stride) != packed.stride) {
    return qmat_gltf_fail(check, "bufferView", index, "byteStride is %lld, but %zu in " QMAT_GLTF_MESHOPT,
                          (long long)json_integer_value(stride), packed.stride);
  }
  uint8_t *decoded;
  status = qmat_meshopt_decode(check->context, &packed, &decoded);
  if (status != QMAT_OK) {
    qmat_fail_element(check->context, "bufferView", (int64_t)index);
    return qmat_fail_at(check->context, check->path, 0, 0);
  }
  const size_t number = document->buffer_count++;
  document->buffers[number] =
      (qmat_gltf_buffer){.bytes = decoded, .size = packed.count * packed.stride, .owned = decoded};
  document->decoded_size += document->buffers[number].size;
  if (document->decoded_size > MOST_RATIO * document->data_size)
    return qmat_gltf_fail(check, NULL, 0, "the decompressed buffer views have more than %d times the size of the data",
                          MOST_RATIO);
  *size = (int64_t)document->buffers[number].size;
  const bool done = json_object_set_new(view, "buffer", json_integer((json_int_t)number)) == 0 &&
                    json_object_set_new(view, "byteOffset", json_integer(0)) == 0 &&
                    json_object_set_new(view, "byteLength", json_integer((json_int_t)*size)) == 0;
  return done ? QMAT_OK : qmat_gltf_fail_memory(check);
}
