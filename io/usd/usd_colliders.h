/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_COLLIDERS_H
#define QMAT_IO_USD_USD_COLLIDERS_H

#include "core/value.h"
#include "io/bytes.h"

/* Parts of a USD text layer, for the prim that becomes a rigid body: the metadata and the attributes of USD Physics
 * that make it one, and a child "colliders" with a Sphere, Capsule_1 or Mesh (approximated by its convex hull) for each
 * shape, of purpose "guide". Points are relative to `origin`. */
void qmat_usd_put_body_schemas(qmat_writer *writer);
void qmat_usd_put_body(qmat_writer *writer, const qmat_colliders *colliders, const double origin[3]);
void qmat_usd_put_colliders(qmat_writer *writer, const qmat_colliders *colliders, const double origin[3]);

#endif
