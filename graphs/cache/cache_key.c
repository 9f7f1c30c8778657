/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/cache/cache_key.h"

#include <stdio.h>
#include <string.h>

#include "graphs/cache/source_digest.h"
#include "io/bytes.h"

const char *qmat_param_input_file(const qmat_node *type, size_t row, const void *params) {
  const qmat_param *param = &type->params[row];
  const char *path;
  if (param->type != QMAT_PARAM_PATH || !(param->flags & QMAT_PARAM_INPUT_FILE)) return NULL;
  memcpy(&path, (const char *)params + param->offset, sizeof path);
  return path;
}

/* Text as valid JSON, unique for its bytes: a backslash becomes two, a byte that is not UTF-8 becomes \xNN. */
static json_t *escaped(const char *text) {
  qmat_writer writer = {0};
  while (*text) {
    size_t length = qmat_utf8_length(text);
    if (*text == '\\') {
      qmat_put_text(&writer, "\\\\");
    } else if (length > 0) {
      qmat_put_bytes(&writer, text, length);
    } else {
      char code[8];
      snprintf(code, sizeof code, "\\x%02x", (unsigned char)*text);
      qmat_put_text(&writer, code);
    }
    text += length > 0 ? length : 1;
  }
  json_t *json = writer.failed ? NULL : json_stringn(writer.bytes ? (const char *)writer.bytes : "", writer.size);
  qmat_writer_uninit(&writer);
  return json;
}

static bool add_item(json_t *items, const char *tag, const char *name, const char *value) {
  json_t *item = json_array();
  bool done = json_array_append_new(item, json_string(tag)) == 0;
  done = json_array_append_new(item, escaped(name)) == 0 && done;
  done = json_array_append_new(item, escaped(value)) == 0 && done;
  if (done) return json_array_append_new(items, item) == 0;
  json_decref(item);
  return false;
}

static bool add_digest(json_t *items, const char *tag, const char *name, const char *before, const qmat_digest *digest,
                       const char *without) {
  char text[128] = "", hex[65];
  if (digest) {
    qmat_digest_hex(digest, hex);
    snprintf(text, sizeof text, "%s%s", before, hex);
  }
  return add_item(items, tag, name, digest ? text : without);
}

static bool add_param(json_t *items, const qmat_node *type, size_t row, const void *params,
                      const qmat_digest *const *files) {
  const qmat_param *param = &type->params[row];
  if (param->type == QMAT_PARAM_PATH && (param->flags & QMAT_PARAM_INPUT_FILE)) {
    const char *path = qmat_param_input_file(type, row, params);
    const char *slash = path ? strrchr(path, '/') : NULL;
    /* Results may contain the file's name and depend on its ending, but not on its folder. */
    bool done = !path || add_item(items, "name", param->name, slash ? slash + 1 : path);
    return add_digest(items, "file", param->name, "", path ? files[row] : NULL, "none") && done;
  }
  if (param->type == QMAT_PARAM_STRING || param->type == QMAT_PARAM_PATH) {
    const char *text;
    memcpy(&text, (const char *)params + param->offset, sizeof text);
    return add_item(items, text ? "param" : "unset", param->name, text ? text : "");
  }
  char text[256];
  qmat_param_format(param, params, text, sizeof text);
  return add_item(items, "param", param->name, text);
}

json_t *qmat_key_items(const qmat_node *type, const void *params, const qmat_digest *const *inputs,
                       const qmat_digest *const *files) {
  json_t *items = json_array();
  char number[24];
  snprintf(number, sizeof number, "%d", QMAT_KEY_FORMAT);
  bool done = items && add_item(items, "key", "format", number);
  done = done && add_item(items, "program", "version", QMAT_VERSION);
  if (*qmat_source_digest) done = done && add_item(items, "program", "sources", qmat_source_digest);
  snprintf(number, sizeof number, "%u", (unsigned)type->version);
  done = done && add_item(items, "node", type->name, number);
  for (size_t i = 0; type->libraries && type->libraries[i] && done; i++) {
    char text[128];
    type->libraries[i]->describe(text, sizeof text);
    done = add_item(items, "library", type->libraries[i]->name, text);
  }
  for (size_t row = 0; row < qmat_param_count(type) && done; row++) done = add_param(items, type, row, params, files);
  for (size_t port = 0; port < qmat_input_count(type) && done; port++) {
    char before[32];
    snprintf(before, sizeof before, "%s ", qmat_value_type_name(type->inputs[port].type));
    done = add_digest(items, "input", type->inputs[port].name, before, inputs[port], "none");
  }
  if (done) return items;
  json_decref(items);
  return NULL;
}

bool qmat_key_add_side_file(json_t *items, const char *param, const char *path, const qmat_digest *digest) {
  qmat_writer name = {0};
  qmat_put_text(&name, param);
  qmat_put_text(&name, ":");
  qmat_put_bytes(&name, path, strlen(path) + 1);
  bool done = !name.failed && add_digest(items, "side", (const char *)name.bytes, "", digest, "absent");
  qmat_writer_uninit(&name);
  return done;
}

bool qmat_key_digest(const json_t *items, qmat_digest *key) {
  qmat_hasher hasher;
  if (!json_is_array(items) || qmat_hasher_init(&hasher) != QMAT_OK) return false;
  bool sound = true;
  for (size_t i = 0; i < json_array_size(items); i++) {
    const json_t *item = json_array_get(items, i);
    sound = sound && json_array_size(item) == 3;
    for (size_t k = 0; k < 3 && sound; k++) {
      const json_t *text = json_array_get(item, k);
      sound = json_is_string(text);
      uint8_t length[8];
      for (int byte = 0; byte < 8; byte++) length[byte] = (uint8_t)((uint64_t)json_string_length(text) >> (8 * byte));
      qmat_hasher_add(&hasher, length, sizeof length);
      qmat_hasher_add(&hasher, json_string_value(text), json_string_length(text));
    }
  }
  return qmat_hasher_finish(&hasher, key) == QMAT_OK && sound;
}
