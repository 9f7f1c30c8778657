/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USDC_VALUE_H
#define QMAT_IO_USD_USDC_VALUE_H

#include "core/key_table.h"
#include "io/usd/usdc_tables.h"

/* The values of a crate. Each is represented by 64 bits: flags, its type, and the value itself or its offset in the
 * file. Source: OpenUSD, pxr/usd/sdf/crateFile and crateDataTypes. */

/* Zero it, set `crate`, whose tables are read, and initialise `known`; free that with qmat_key_table_uninit. */
typedef struct qmat_usdc_values {
  const qmat_usdc *crate;
  int depth;            /* of nested values */
  qmat_key_table known; /* values by their representation; NULL while one is being read */
} qmat_usdc_values;

/* The value of a representation; equal ones are read once. QMAT_ERROR_FORMAT, QMAT_ERROR_MEMORY. */
qmat_status qmat_usdc_value(qmat_usdc_values *v, uint64_t rep, const qmat_usd_value **value);

#endif
