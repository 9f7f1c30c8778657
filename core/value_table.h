/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_VALUE_TABLE_H
#define QMAT_CORE_VALUE_TABLE_H

#include <string.h>

#include "core/context.h"
#include "core/value_types.h"

/* The table of value types, for core only. Each type has one entry: its name, size, rows, rules and counts. Freeing,
 * measuring, hashing, writing and reading a value all walk its rows, so a new type needs no code in value.c or
 * value_form.c. */

/* What one row holds. These numbers are part of the serialised form. */
typedef enum qmat_row_kind {
  QMAT_ROW_U32 = 2,     /* array of uint32_t */
  QMAT_ROW_F64 = 3,     /* array of double */
  QMAT_ROW_TEXT = 4,    /* char *, NUL-terminated */
  QMAT_ROW_JSON = 5,    /* json_t *, an object */
  QMAT_ROW_BOOL = 6,    /* bool, written as one byte 0 or 1 */
  QMAT_ROW_ENUM = 7,    /* an enum, written as u32 */
  QMAT_ROW_SIZE = 8,    /* a size_t that is not the count of another row, written as u64 */
  QMAT_ROW_PARTS = 9,   /* array of qmat_file_part: u64 count, then for each part text name, u64 size, bytes */
  QMAT_ROW_NUMBER = 10, /* one double */
  QMAT_ROW_ITEMS = 11,  /* array of qmat_value *: for each value the u64 size of its serialised form, and its digest */
  QMAT_ROW_NAMES = 12   /* array of char *, written as texts */
} qmat_row_kind;

/* One field of a value's struct. */
typedef struct qmat_value_row {
  const char *name; /* NULL ends the rows */
  qmat_row_kind kind;
  size_t offset;       /* of the field, or of the pointer to the array */
  size_t count_offset; /* of the array's count, a size_t; several arrays may share one count */
  size_t components;   /* elements per count; 0: the row is no array */
} qmat_value_row;

typedef struct qmat_value_layout {
  const char *name;
  size_t size; /* of the struct */
  const qmat_value_row *rows;
  /* The rules of this type beyond what its rows say, checked when a value is sealed. Rows are consistent by then. */
  qmat_status (*check)(qmat_context *context, const qmat_value *value);
  qmat_value_count_row counts[QMAT_MOST_COUNTS + 1];
} qmat_value_layout;

extern const qmat_value_layout qmat_value_layouts[QMAT_VALUE_TYPE_COUNT];

static inline const qmat_value_row *qmat_value_rows(const qmat_value *value) {
  return qmat_value_layouts[value->type].rows;
}

static inline bool qmat_row_is_array(const qmat_value_row *row) {
  return row->components > 0;
}

static inline bool qmat_row_has_pointer(const qmat_value_row *row) {
  return qmat_row_is_array(row) || row->kind == QMAT_ROW_TEXT || row->kind == QMAT_ROW_JSON;
}

static inline const void *qmat_row_place(const qmat_value *value, const qmat_value_row *row) {
  return (const char *)value + row->offset;
}

/* The array, text or JSON of a row. */
static inline void *qmat_row_pointer(const qmat_value *value, const qmat_value_row *row) {
  void *pointer;
  memcpy(&pointer, qmat_row_place(value, row), sizeof pointer);
  return pointer;
}

static inline size_t qmat_row_count(const qmat_value *value, const qmat_value_row *row) {
  return *(const size_t *)((const char *)value + row->count_offset);
}

/* Bytes of one array element in memory; 0 for a row that is no array. */
size_t qmat_row_element_size(const qmat_value_row *row);

/* The rows of `value` can be walked, and the rules of its type hold. Otherwise QMAT_ERROR_GEOMETRY, or
 * QMAT_ERROR_INTERNAL when only a mistake of a node can be the cause. */
qmat_status qmat_value_check(qmat_context *context, const qmat_value *value);

#endif
