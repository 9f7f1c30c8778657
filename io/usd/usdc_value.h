/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USDC_VALUE_H
#define QMAT_IO_USD_USDC_VALUE_H

#include "io/usd/usdc_tables.h"

/* The values of a crate. Each is represented by 64 bits: flags, its type, and the value itself or its offset in the
 * file. Source: OpenUSD, pxr/usd/sdf/crateFile and crateDataTypes. */

/* A value that was read, or (NULL) is being read. */
typedef struct qmat_usdc_known {
  uint64_t rep; /* 0: a free slot */
  const qmat_usd_value *value;
} qmat_usdc_known;

/* Zero it, and set `crate`, whose tables are read. Free `known` with qmat_free. */
typedef struct qmat_usdc_values {
  const qmat_usdc *crate;
  int depth; /* of nested values */
  qmat_usdc_known *known;
  size_t known_count, known_slots;
} qmat_usdc_values;

/* The value of a representation; equal ones are read once. QMAT_ERROR_FORMAT, QMAT_ERROR_MEMORY. */
qmat_status qmat_usdc_value(qmat_usdc_values *v, uint64_t rep, const qmat_usd_value **value);

#endif
