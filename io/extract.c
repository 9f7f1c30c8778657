/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/extract.h"

#include <string.h>

#include "io/base64.h"
#include "io/draco.h"
#include "io/ma.h"
#include "io/model.h"
#include "io/usd_medial.h"

/* The JSON of a glTF asset, binary or text; NULL with the error recorded. */
static json_t *read_gltf_json(qmat_context *context, const qmat_bytes *bytes, const char *path) {
  qmat_byte_reader reader = {.bytes = bytes->data, .size = bytes->size, .at = 12};
  const char *text = (const char *)bytes->data;
  size_t length = bytes->size;
  if (qmat_format_of_bytes(bytes) == QMAT_FORMAT_GLB) {
    length = qmat_take_u32(&reader);
    const uint32_t kind = qmat_take_u32(&reader);
    text = (const char *)qmat_take_bytes(&reader, length);
    if (!text || kind != 0x4E4F534A) {
      qmat_fail(context, QMAT_ERROR_FORMAT, "the GLB does not begin with its JSON");
      qmat_fail_at(context, path, 0, 0);
      return NULL;
    }
  }
  json_error_t error;
  json_t *root = json_loadb(text, length, JSON_REJECT_DUPLICATES, &error);
  if (!root) {
    qmat_fail(context, QMAT_ERROR_FORMAT, "%s", error.text);
    qmat_fail_at(context, path, error.line > 0 ? error.line : 0, error.column > 0 ? error.column : 0);
  }
  return root;
}

static qmat_status take_facts(qmat_context *context, const json_t *extras, json_t *facts) {
  const char *key;
  json_t *value;
  if (!facts) return QMAT_OK;
  json_object_foreach((json_t *)(uintptr_t)extras, key, value) {
    if (strncmp(key, "qmat_", 5) != 0 || strcmp(key, "qmat_data") == 0) continue;
    if (json_object_set(facts, key, value) != 0) return qmat_fail_memory(context, "what a file says of itself");
  }
  return QMAT_OK;
}

static qmat_status read_gltf(qmat_context *context, const qmat_bytes *bytes, const char *path, const char *name,
                             qmat_medial **medial, json_t *facts) {
  json_t *root = read_gltf_json(context, bytes, path);
  if (!root) return context->error.status;
  const json_t *nodes = json_object_get(root, "nodes"), *found = NULL;
  size_t carriers = 0, index = 0;
  for (size_t i = 0; i < json_array_size(nodes); i++) {
    const json_t *node = json_array_get(nodes, i), *extras = json_object_get(node, "extras");
    const char *node_name = json_string_value(json_object_get(node, "name"));
    if (!json_is_string(json_object_get(extras, "qmat_data"))) continue;
    carriers++;
    if (found || (name && (!node_name || strcmp(name, node_name) != 0))) continue;
    found = extras;
    index = i;
  }
  qmat_status status = QMAT_OK;
  uint8_t *blob = NULL;
  size_t size = 0;
  if (!found) {
    status = qmat_fail(context, QMAT_ERROR_GEOMETRY,
                       carriers > 0 ? "no node of this name has a medial mesh" : "no node has a medial mesh");
  } else if (!name && carriers > 1) {
    status = qmat_fail(context, QMAT_ERROR_USAGE, "%zu nodes have a medial mesh: one has to be named", carriers);
  } else {
    const json_t *data = json_object_get(found, "qmat_data");
    status = qmat_base64_decode(context, json_string_value(data), json_string_length(data), &blob, &size);
    if (status == QMAT_OK) status = qmat_draco_decode_medial(context, blob, size, medial);
    if (status != QMAT_OK) qmat_fail_element(context, "node", (int64_t)index);
    if (status == QMAT_OK) status = take_facts(context, found, facts);
  }
  if (status != QMAT_OK) qmat_fail_at(context, path, 0, 0);
  qmat_free(blob);
  json_decref(root);
  return status;
}

/* The counts that the file states are those of what it holds. */
static qmat_status check_counts(qmat_context *context, const qmat_medial *medial, const json_t *facts,
                                const char *path) {
  const struct {
    const char *key;
    size_t count;
  } rows[] = {{"qmat_vertices", medial->sphere_count},
              {"qmat_edges", medial->edge_count},
              {"qmat_triangles", medial->triangle_count}};
  for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
    const json_t *stated = json_object_get(facts, rows[i].key);
    if (!stated || (json_is_integer(stated) && json_integer_value(stated) == (json_int_t)rows[i].count)) continue;
    qmat_fail(context, QMAT_ERROR_FORMAT, "%s is not the %zu that the file holds", rows[i].key, rows[i].count);
    return qmat_fail_at(context, path, 0, 0);
  }
  return QMAT_OK;
}

qmat_status qmat_medial_extract(qmat_context *context, const char *path, const char *name, qmat_medial **medial,
                                json_t *facts) {
  *medial = NULL;
  qmat_bytes bytes = {0};
  qmat_format format = QMAT_FORMAT_UNKNOWN;
  json_t *stated = json_object();
  qmat_status status = stated ? qmat_bytes_read_file(context, path, &bytes) : qmat_fail_memory(context, "facts");
  if (status == QMAT_OK) status = qmat_format_choose(context, path, &bytes, &format);
  if (status == QMAT_OK && (format == QMAT_FORMAT_GLB || format == QMAT_FORMAT_GLTF)) {
    status = read_gltf(context, &bytes, path, name, medial, stated);
  } else if (status == QMAT_OK && format == QMAT_FORMAT_USD) {
    status = qmat_usd_read_medial(context, &bytes, path, name, medial, stated);
  } else if (status == QMAT_OK && format == QMAT_FORMAT_MA) {
    status = qmat_ma_read(context, &bytes, path, medial);
  } else if (status == QMAT_OK) {
    qmat_fail(context, status = QMAT_ERROR_GEOMETRY, "%s does not carry medial meshes", qmat_format_title(format));
    qmat_fail_at(context, path, 0, 0);
  }
  if (status == QMAT_OK) status = check_counts(context, *medial, stated, path);
  if (status == QMAT_OK && facts && json_object_update(facts, stated) != 0) status = qmat_fail_memory(context, "facts");
  if (status != QMAT_OK && *medial) {
    qmat_value_release(&(*medial)->base);
    *medial = NULL;
  }
  json_decref(stated);
  qmat_bytes_uninit(&bytes);
  return status;
}
