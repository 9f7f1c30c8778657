/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_VALUE_FORM_H
#define QMAT_CORE_VALUE_FORM_H

#include "core/value.h"

/* The serialised form of a value: versioned, little-endian, the same on every machine. A value's digest is the SHA-256
 * of this form. A list names its items by digest and does not contain them. */

/* Serialises a sealed value into a qmat_alloc'd buffer; the caller frees it. Cost: linear. */
qmat_status qmat_value_serialize(qmat_context *context, const qmat_value *value, uint8_t **bytes, size_t *size);

/* Finds the items of a list. `find` returns the sealed value whose serialised form has this digest and size, or NULL;
 * the caller releases it. */
typedef struct qmat_value_source {
  qmat_value *(*find)(void *user, const qmat_digest *digest, uint64_t size);
  void *user;
} qmat_value_source;

/* Makes the sealed value that `size` bytes describe. Every length is checked against `size` before it is used. With
 * `items` NULL, lists are refused. QMAT_ERROR_FORMAT: the bytes are damaged, or an item of a list is not found. */
qmat_status qmat_value_deserialize(qmat_context *context, const uint8_t *bytes, size_t size,
                                   const qmat_value_source *items, qmat_value **value);

#endif
