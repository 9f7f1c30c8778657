/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_TRANSFORM_H
#define QMAT_IO_USD_USD_TRANSFORM_H

#include "io/usd/usd_prim.h"

/* A transform of row vectors: p' = p * m, by rows. */
typedef struct qmat_usd_transform {
  double m[16];
} qmat_usd_transform;

qmat_usd_transform qmat_usd_identity(void);

/* First `a`, then `b`. */
qmat_usd_transform qmat_usd_product(const qmat_usd_transform *a, const qmat_usd_transform *b);

/* The inverse; false when there is none. */
bool qmat_usd_inverse(const qmat_usd_transform *t, qmat_usd_transform *inverse);

/* The rotation of a quaternion of any length, its real part first; none for a quaternion of zeros. */
qmat_usd_transform qmat_usd_orientation(const double q[4]);

/* The volume to which the transform takes the unit cube, negative where it turns a right hand into a left hand. */
double qmat_usd_volume(const qmat_usd_transform *t);

/* Whether the transform turns a right hand into a left hand. */
bool qmat_usd_mirrors(const qmat_usd_transform *t);

/* Turns the world transform of a prim's parent into that of the prim, by its xformOpOrder. `type` is the prim's; "" and
 * "Scope" have no transform, which gives a warning. QMAT_ERROR_FORMAT with the prim; QMAT_ERROR_MEMORY. */
qmat_status qmat_usd_read_transform(const qmat_usd_prim *prim, const char *type, qmat_usd_transform *world);

#endif
