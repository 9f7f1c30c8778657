/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_INSIDE_FIT_H
#define QMAT_NODES_COLLIDERS_INSIDE_FIT_H

#include "core/geometry/surface.h"
#include "nodes/colliders/shape_set.h"

/* Changes radii until no point of a shape is outside of the solid. A radius first becomes the depth of its centre. Then
 * it falls where its shapes leave the solid at sample points of their simplices, and rises again where they allow it.
 * Last, the distance by which each shape leaves the solid is bounded by branch and bound
 * (qmat_envelope_to_surface_bound_soon), and its radii fall by that bound. A sphere whose radius is then below
 * `least_radius` leaves its shapes. `*proved` becomes whether the surface is closed and oriented; for others inside is
 * an estimate. The set may become empty. QMAT_ERROR_MEMORY, QMAT_CANCELLED. The result does not depend on the number of
 * threads. */
qmat_status qmat_inside_fit(qmat_context *context, const qmat_surface *surface, qmat_shape_set *set,
                            double least_radius, bool *proved);

#endif
