/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USDC_TABLES_H
#define QMAT_IO_USD_USDC_TABLES_H

#include "io/bytes.h"
#include "io/usd/usd_layer.h"

/* The tables of a crate: tokens, strings, fields, sets of fields, paths and specs. Every index in a table is checked
 * against the table that it refers to. */

#define QMAT_USDC_NONE UINT32_MAX /* ends a set of fields; the parent of the root */

typedef struct qmat_usdc_path {
  uint32_t parent;     /* QMAT_USDC_NONE for the root, and for paths that the table lacks */
  const char *element; /* the name, or "{set=variant}", or "[target]"; NULL for paths that the table lacks */
  bool is_property;
  bool is_below_target; /* this element or one above it is a target: such specs are not kept */
  qmat_usd_spec *spec;  /* NULL until it is made */
  const char *text;     /* NULL until it is needed */
} qmat_usdc_path;

typedef struct qmat_usdc_spec {
  uint32_t path, set, type; /* set: the start of its fields in field_sets, not checked */
} qmat_usdc_spec;

/* A zeroed crate is empty and valid. Free `scratch`, which has all tables but the tokens; these are the layer's. */
typedef struct qmat_usdc {
  qmat_usd_layer *layer;
  const uint8_t *bytes; /* of the file */
  size_t size;
  int version; /* the 8 of 0.8.0 */
  size_t token_count, string_count, field_count, field_set_length, path_count, path_order_count, spec_count;
  const char **tokens;
  uint32_t *strings; /* tokens */
  uint32_t *field_names;
  uint64_t *field_reps; /* representations of values: io/usd/usdc_value.h */
  uint32_t *field_sets; /* indices of fields; QMAT_USDC_NONE ends each set, and the last one */
  qmat_usdc_path *paths;
  uint32_t *path_order; /* parents before children */
  qmat_usdc_spec *specs;
  qmat_arena scratch;
} qmat_usdc;

/* Reads all tables. `layer`, `bytes`, `size` and `version` are set. QMAT_ERROR_FORMAT, QMAT_ERROR_MEMORY. */
qmat_status qmat_usdc_read_tables(qmat_usdc *c);

/* A token or string by its index; NULL when there is none. */
const char *qmat_usdc_token(const qmat_usdc *c, uint32_t index);
const char *qmat_usdc_string(const qmat_usdc *c, uint32_t index);
/* The text of a path; "" for the empty path; NULL with the error recorded. */
const char *qmat_usdc_path_text(const qmat_usdc *c, uint32_t index);

/* QMAT_ERROR_FORMAT: something reaches beyond the end of the file or of its table. */
qmat_status qmat_usdc_fail_short(const qmat_usdc *c);

#endif
