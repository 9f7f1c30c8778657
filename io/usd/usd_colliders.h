/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_COLLIDERS_H
#define QMAT_IO_USD_USD_COLLIDERS_H

#include "core/value.h"
#include "io/bytes.h"

/* Parts of a USD text layer. Points are relative to `origin`. */

/* The metadata of a prim that becomes a rigid body, indented by `depth` levels. */
void qmat_usd_put_body_schemas(qmat_writer *writer, size_t depth);
/* Its attributes for a body (the 10 numbers of qmat_colliders), the mass in units of `kilograms`; indented by `depth`
 * levels. A kinematic body follows its animation, and no force moves it. */
void qmat_usd_put_body(qmat_writer *writer, size_t depth, const double body[10], const double origin[3],
                       double kilograms, bool is_kinematic);

/* A child "colliders" of a root prim with a Sphere, Capsule_1 or Mesh (approximated by its convex hull) for each shape,
 * of purpose "guide". */
void qmat_usd_put_colliders(qmat_writer *writer, const qmat_colliders *colliders, const double origin[3]);

#endif
