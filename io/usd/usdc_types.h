/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USDC_TYPES_H
#define QMAT_IO_USD_USDC_TYPES_H

#include "io/usd/usd_layer.h"

/* How a crate represents a value: 64 bits with flags, the number of its type, and the value itself or its offset in the
 * file. Source: OpenUSD, pxr/usd/sdf/crateFile and crateDataTypes. */

#define QMAT_USDC_REP_ARRAY ((uint64_t)1 << 63)
#define QMAT_USDC_REP_INLINED ((uint64_t)1 << 62)
#define QMAT_USDC_REP_PACKED ((uint64_t)1 << 61)
#define QMAT_USDC_REP_PAYLOAD (((uint64_t)1 << 48) - 1)

enum { QMAT_USDC_FEWEST_PACKED = 16 }; /* elements of an array: shorter ones are never packed */

/* The types of specs. */
enum {
  QMAT_USDC_SPEC_ATTRIBUTE = 1,
  QMAT_USDC_SPEC_PRIM = 6,
  QMAT_USDC_SPEC_PSEUDO_ROOT = 7,
  QMAT_USDC_SPEC_RELATIONSHIP = 8,
  QMAT_USDC_SPEC_VARIANT = 10,
  QMAT_USDC_SPEC_SET = 11
};

/* The types of values, by their number in the file; plain ones are in the table below. */
typedef enum qmat_usdc_type {
  QMAT_USDC_BOOL = 1,
  QMAT_USDC_INT = 3,
  QMAT_USDC_UINT = 4,
  QMAT_USDC_INT64 = 5,
  QMAT_USDC_UINT64 = 6,
  QMAT_USDC_DOUBLE = 9,
  QMAT_USDC_TOKEN = 11,
  QMAT_USDC_DOUBLE2 = 19,
  QMAT_USDC_DICTIONARY = 31,
  QMAT_USDC_TOKEN_LIST_OP,
  QMAT_USDC_STRING_LIST_OP,
  QMAT_USDC_PATH_LIST_OP,
  QMAT_USDC_REFERENCE_LIST_OP,
  QMAT_USDC_INT_LIST_OP,
  QMAT_USDC_INT64_LIST_OP,
  QMAT_USDC_UINT_LIST_OP,
  QMAT_USDC_UINT64_LIST_OP,
  QMAT_USDC_PATH_VECTOR,
  QMAT_USDC_TOKEN_VECTOR,
  QMAT_USDC_SPECIFIER,
  QMAT_USDC_PERMISSION,
  QMAT_USDC_VARIABILITY,
  QMAT_USDC_VARIANT_SELECTION_MAP,
  QMAT_USDC_TIME_SAMPLES,
  QMAT_USDC_PAYLOAD,
  QMAT_USDC_DOUBLE_VECTOR,
  QMAT_USDC_LAYER_OFFSET_VECTOR,
  QMAT_USDC_STRING_VECTOR,
  QMAT_USDC_VALUE_BLOCK,
  QMAT_USDC_VALUE,
  QMAT_USDC_UNREGISTERED_VALUE,
  QMAT_USDC_UNREGISTERED_VALUE_LIST_OP,
  QMAT_USDC_PAYLOAD_LIST_OP,
  QMAT_USDC_TIME_CODE,
  QMAT_USDC_PATH_EXPRESSION
} qmat_usdc_type;

enum { QMAT_USDC_PLAIN_TYPES = QMAT_USDC_TIME_CODE + 1 };

/* Plain types by their number in the file; `components` is 0 for types that are not plain. */
typedef struct qmat_usdc_plain_type {
  qmat_usd_type type;
  uint8_t components, rows; /* rows: of a matrix; else 0 */
  bool is_quaternion;       /* stored with the real part last */
} qmat_usdc_plain_type;
extern const qmat_usdc_plain_type qmat_usdc_plain_types[QMAT_USDC_PLAIN_TYPES];

/* The lists of a list operation in their order in the file, and the bits of its header that announce them. */
typedef struct qmat_usdc_list {
  uint8_t bit;
  qmat_usd_edit edit;
} qmat_usdc_list;
extern const qmat_usdc_list qmat_usdc_lists[QMAT_USD_EDIT_COUNT];

/* The size of a component in the file. */
extern const uint8_t qmat_usdc_component_bytes[QMAT_USD_TYPE_COUNT];

#endif
