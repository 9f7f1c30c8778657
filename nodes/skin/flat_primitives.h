/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SKIN_FLAT_PRIMITIVES_H
#define QMAT_NODES_SKIN_FLAT_PRIMITIVES_H

#include "core/context.h"
#include "core/value_types.h"
#include "nodes/skin/skin_triangles.h"

/* Slabs and cones of radius zero: sheets that enclose nothing. */

/* Divides the slabs and cones of `medial`: `solid` gets those that have a positive radius, and all sides of its slabs;
 * `flat` gets the others, of which cones only where no slab has them and they have a length. Both borrow the spheres of
 * `medial`; their rows are in the context's arena. QMAT_ERROR_MEMORY. Linear but for finding edges. */
qmat_status qmat_flat_primitives_separate(qmat_context *context, const qmat_medial *medial, qmat_medial *solid,
                                          qmat_medial *flat);

/* Appends to `surface` both sides of each flat slab, with vertices of their own, and a prism of three sides around each
 * flat cone, with the given radius. `spheres`: 4 doubles per sphere, in the frame of the surface. On QMAT_ERROR_MEMORY
 * the surface is unchanged. Linear. */
qmat_status qmat_flat_primitives_append(qmat_context *context, const qmat_medial *flat, const double *spheres,
                                        double radius, qmat_skin_triangles *surface);

#endif
