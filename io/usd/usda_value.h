/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USDA_VALUE_H
#define QMAT_IO_USD_USDA_VALUE_H

#include "io/usd/usda_token.h"

/* The values of the text form of USD. Every function fills `*value`, whose contents the layer owns. Errors are
 * QMAT_ERROR_FORMAT with file, line and column, or QMAT_ERROR_MEMORY. */

/* The shape of the values of a type. */
typedef struct qmat_usda_type {
  const char *name;
  qmat_usd_type type; /* QMAT_USD_UNREAD: an unknown type, whose values are skipped */
  uint8_t components;
  uint8_t rows; /* of a matrix, whose rows have brackets of their own; else 0 */
  bool is_array;
} qmat_usda_type;

/* Takes the name of a type, with [] or without. An unknown name is no error. type->name is the layer's. */
qmat_status qmat_usda_take_type(qmat_usda *p, qmat_usda_type *type);

/* A value of that type, or None. */
qmat_status qmat_usda_take_typed(qmat_usda *p, const qmat_usda_type *type, qmat_usd_value *value);

/* { time: value, ... } */
qmat_status qmat_usda_take_samples(qmat_usda *p, const qmat_usda_type *type, qmat_usd_value *value);

/* A value whose type is not written, as in metadata. Integers become int64, other numbers double, names tokens. */
qmat_status qmat_usda_take_any(qmat_usda *p, qmat_usd_value *value);

/* The names in a list [...] of strings, or one string. */
qmat_status qmat_usda_take_names(qmat_usda *p, qmat_usd_value *value);

/* One item or several in [], or None for none, as an array of texts or references; `type` QMAT_USD_BLOCK: of any type.
 */
qmat_status qmat_usda_take_list(qmat_usda *p, qmat_usd_type type, qmat_usd_value *value);

/* [@asset@ (offset = 1; scale = 2), ...]: the assets, and pairs of offset and scale. */
qmat_status qmat_usda_take_sublayers(qmat_usda *p, qmat_usd_value *assets, qmat_usd_value *offsets);

/* Skips a value; `kind` becomes its text, which must outlive the layer. */
qmat_status qmat_usda_skip(qmat_usda *p, const char *kind, qmat_usd_value *value);

#endif
