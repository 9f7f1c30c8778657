/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/json_text.h"

#include <stdarg.h>
#include <stdbool.h>
#include <string.h>

#include "core/arena.h"
#include "core/text.h"

typedef struct growing_text {
  char *bytes;
  size_t size, capacity;
  bool failed;
} growing_text;

static int append(const char *bytes, size_t size, void *data) {
  growing_text *text = data;
  if (!text->failed && qmat_grow((void **)&text->bytes, &text->capacity, text->size + size + 1, 1) != 0)
    text->failed = true;
  if (text->failed) return -1;
  memcpy(text->bytes + text->size, bytes, size);
  text->size += size;
  text->bytes[text->size] = '\0';
  return 0;
}

char *qmat_json_text(const json_t *json, size_t flags, size_t *size) {
  growing_text text = {NULL, 0, 0, false};
  if (json_dump_callback(json, append, &text, flags) != 0 || text.failed) {
    qmat_free(text.bytes);
    return NULL;
  }
  if (size) *size = text.size;
  return text.bytes;
}

json_t *qmat_json_string(const char *text) {
  char *copy = qmat_strdup(text);
  if (!copy) return NULL;
  qmat_repair_utf8(copy);
  json_t *json = json_string(copy);
  qmat_free(copy);
  return json;
}

int qmat_json_set_count(json_t *object, const char *key, size_t count) {
  return json_object_set_new(object, key, json_integer((json_int_t)count));
}

int qmat_json_set_counts(json_t *object, const qmat_json_count *rows, size_t row_count) {
  int bad = 0;
  for (size_t i = 0; i < row_count; i++) bad |= qmat_json_set_count(object, rows[i].key, rows[i].count);
  return bad;
}

int qmat_json_add_warning(json_t *report, const char *format, ...) {
  json_t *warnings = json_object_get(report, "warnings");
  if (!warnings && json_object_set_new(report, "warnings", warnings = json_array()) != 0) return -1;
  va_list values;
  va_start(values, format);
  json_t *text = json_vsprintf(format, values);
  va_end(values);
  return json_array_append_new(warnings, text);
}
