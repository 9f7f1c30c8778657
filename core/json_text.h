/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_JSON_TEXT_H
#define QMAT_CORE_JSON_TEXT_H

#include <stddef.h>

#include <jansson.h>

/* The zero-terminated text of `json`, written with jansson's flags. `size` (may be NULL) receives the length without
 * the zero. NULL when memory is short, where json_dumps of jansson 2.14 may silently drop keys. Free with qmat_free. */
char *qmat_json_text(const json_t *json, size_t flags, size_t *size);

/* A JSON string of `text`, whose bytes that are not UTF-8 become '?'; a path may have such bytes. NULL when memory is
 * short; the caller calls json_decref. */
json_t *qmat_json_string(const char *text);

/* Sets a whole number of an object. Returns 0, or -1 when memory is short or `object` is NULL, like
 * json_object_set_new. */
int qmat_json_set_count(json_t *object, const char *key, size_t count);

/* A whole number of an object. */
typedef struct qmat_json_count {
  const char *key;
  size_t count;
} qmat_json_count;

/* Sets `row_count` whole numbers, in their order. Returns as qmat_json_set_count. */
int qmat_json_set_counts(json_t *object, const qmat_json_count *rows, size_t row_count);

/* Appends a warning, as printf makes it of UTF-8 text, to the list "warnings" of a report. Returns as
 * qmat_json_set_count. */
int qmat_json_add_warning(json_t *report, const char *format, ...) __attribute__((format(printf, 2, 3)));

#endif
