/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_TRANSFORM_H
#define QMAT_IO_USD_USD_TRANSFORM_H

#include "io/usd/usd_prim.h"

/* A transform of row vectors: p' = p * m, by rows. */
typedef struct qmat_usd_transform {
  double m[16];
} qmat_usd_transform;

qmat_usd_transform qmat_usd_identity(void);

/* Whether the transform turns a right hand into a left hand. */
bool qmat_usd_mirrors(const qmat_usd_transform *t);

/* Turns the world transform of a prim's parent into that of the prim, by its xformOpOrder. `type` is the prim's; "" and
 * "Scope" have no transform, which gives a warning. QMAT_ERROR_FORMAT with the prim; QMAT_ERROR_MEMORY. */
qmat_status qmat_usd_read_transform(const qmat_usd_prim *prim, const char *type, qmat_usd_transform *world);

#endif
