/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USDC_PLAIN_H
#define QMAT_IO_USD_USDC_PLAIN_H

#include "io/usd/usdc_tables.h"

/* The plain values of a crate: numbers and texts, single or in arrays. A value is represented by 64 bits: flags, its
 * type (see qmat_usdc_type_of), and the value itself or its offset in the file. Errors are QMAT_ERROR_FORMAT and
 * QMAT_ERROR_MEMORY. */

#define QMAT_USDC_ARRAY ((uint64_t)1 << 63)
#define QMAT_USDC_INLINED ((uint64_t)1 << 62)
#define QMAT_USDC_PACKED ((uint64_t)1 << 61)
#define QMAT_USDC_PAYLOAD (((uint64_t)1 << 48) - 1)

/* The types that other files name. */
enum {
  QMAT_USDC_INT = 3,
  QMAT_USDC_UINT = 4,
  QMAT_USDC_INT64 = 5,
  QMAT_USDC_UINT64 = 6,
  QMAT_USDC_DOUBLE = 9,
  QMAT_USDC_DOUBLE2 = 19,
  QMAT_USDC_TIME_CODE = 56
};

/* The type in a representation. */
unsigned qmat_usdc_type_of(uint64_t rep);

/* Whether values of this type are plain. */
bool qmat_usdc_is_plain(unsigned type);

/* A reader at the offset in a representation. QMAT_ERROR_FORMAT when it is beyond the file. */
qmat_status qmat_usdc_seek(const qmat_usdc *c, uint64_t rep, qmat_byte_reader *reader);

/* The plain value of a representation. */
qmat_status qmat_usdc_read_plain(const qmat_usdc *c, uint64_t rep, qmat_usd_value *value);

/* Takes the index of a text and finds it; the layer owns it. A path may be "". */
qmat_status qmat_usdc_take_text(const qmat_usdc *c, qmat_byte_reader *reader, qmat_usd_type type, const char **text);

/* Takes an array of `count` texts, or of `count` elements of a plain type. */
qmat_status qmat_usdc_take_texts(const qmat_usdc *c, qmat_byte_reader *reader, qmat_usd_type type, uint64_t count,
                                 qmat_usd_value *value);
qmat_status qmat_usdc_take_elements(const qmat_usdc *c, qmat_byte_reader *reader, unsigned type, uint64_t count,
                                    qmat_usd_value *value);

#endif
