/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_bind.h"

#include <math.h>
#include <string.h>

#include "io/bytes.h"
#include "io/gltf/gltf_keep.h"
#include "io/gltf/gltf_uri.h"

/* A whole number of the JSON, also if written as 3.0; `missing` where there is none. */
static size_t number(const json_t *object, const char *key, size_t missing) {
  const json_t *value = json_object_get(object, key);
  const double x = json_number_value(value);
  return json_is_number(value) && x >= 0 && x < 9e15 ? (size_t)x : missing;
}

/* The bytes of a buffer: not owned, or `*owned`. NULL: they are not there. */
static qmat_status find_bytes(qmat_context *context, const qmat_scene *scene, const qmat_gltf_asset *asset,
                              size_t buffer, const uint8_t **bytes, size_t *size, uint8_t **owned) {
  const json_t *uri = json_object_get(json_array_get(json_object_get(asset->root, "buffers"), buffer), "uri");
  size_t part = 0;
  *bytes = NULL;
  *size = 0;
  if (!uri) {
    *bytes = buffer == 0 ? asset->chunk : NULL;
    *size = asset->chunk_size;
    return QMAT_OK;
  }
  const char *text = json_string_value(uri);
  if (!text) return QMAT_OK;
  qmat_status status = qmat_gltf_decode_uri(context, text, json_string_length(uri), owned, size);
  *bytes = *owned;
  if (status != QMAT_OK || *owned) return status;
  status = qmat_gltf_find_part(context, scene, text, json_string_length(uri), &part);
  if (status != QMAT_OK || part == 0) return status;
  *bytes = scene->parts[part].bytes;
  *size = scene->parts[part].size;
  return QMAT_OK;
}

qmat_status qmat_gltf_bind_matrices(qmat_context *context, const qmat_scene *scene, const qmat_gltf_asset *asset,
                                    size_t skin, double **matrices) {
  const json_t *object = json_array_get(json_object_get(asset->root, "skins"), skin);
  const size_t count = json_array_size(json_object_get(object, "joints"));
  const size_t accessor_id = number(object, "inverseBindMatrices", SIZE_MAX);
  double *all = qmat_alloc(16 * count, sizeof *all);
  *matrices = NULL;
  if (!all) return qmat_fail_memory(context, "the joints of colliders");
  for (size_t i = 0; i < 16 * count; i++) all[i] = i % 16 % 5 == 0;
  *matrices = all;
  if (accessor_id == SIZE_MAX) return QMAT_OK;
  const json_t *accessor = json_array_get(json_object_get(asset->root, "accessors"), accessor_id);
  const json_t *view =
      json_array_get(json_object_get(asset->root, "bufferViews"), number(accessor, "bufferView", SIZE_MAX));
  const uint8_t *bytes;
  uint8_t *owned = NULL;
  size_t size;
  qmat_status status = find_bytes(context, scene, asset, number(view, "buffer", SIZE_MAX), &bytes, &size, &owned);
  const size_t stride = number(view, "byteStride", 64),
               at = number(view, "byteOffset", 0) + number(accessor, "byteOffset", 0);
  bool good = status == QMAT_OK && view && bytes && !json_object_get(view, "extensions") &&
              !json_object_get(accessor, "sparse") && number(accessor, "componentType", 0) == QMAT_GLTF_FLOAT &&
              number(accessor, "count", 0) >= count && stride >= 64 && at <= size &&
              (count == 0 || (size - at >= 64 && (size - at - 64) / stride >= count - 1));
  for (size_t i = 0; i < 16 * count && good; i++) {
    qmat_byte_reader reader = {.bytes = bytes, .size = size, .at = at + i / 16 * stride + i % 16 * 4};
    all[i] = (double)qmat_take_f32(&reader);
    good = isfinite(all[i]);
  }
  qmat_free(owned);
  if (good) return QMAT_OK;
  qmat_free(all);
  *matrices = NULL;
  return status;
}
