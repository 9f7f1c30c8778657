/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_TRIANGLE_COVER_H
#define QMAT_NODES_MESH_TRIANGLE_COVER_H

#include "core/geometry/surface.h"

/* Whether a triangle is inside solids, or sticks out of them by at most `reach` (0: not at all). `solids` is the
 * surface of solids, and all lengths are in its frame. It is tested at points: the corners, the middles of the sides
 * and the centroid, all drawn a little towards the centroid, where most searches end; then points in rows along the
 * longest side, `spacing` or a 128th of a side apart. Any thread. Cost: up to 8,000 queries of the surface. */
bool qmat_triangle_is_covered(const qmat_surface *solids, const double *const corners[3], double reach, double spacing);

/* Sets `covered` (count) to 1 for the triangles (3 * count ids of `positions`, in the frame of `solids`) that
 * qmat_triangle_is_covered is true for. Those that are 1 already are passed over. QMAT_CANCELLED. All threads of the
 * context. Cost: that of qmat_triangle_is_covered for each. */
qmat_status qmat_triangles_find_covered(qmat_context *context, const qmat_surface *solids, const double *positions,
                                        const uint32_t *triangles, size_t count, double reach, double spacing,
                                        uint8_t *covered);

#endif
