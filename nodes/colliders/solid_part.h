/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_SOLID_PART_H
#define QMAT_NODES_COLLIDERS_SOLID_PART_H

#include "core/geometry/surface.h"

/* Finds points whose convex hull is that of the part of a solid in a convex polyhedron: the corners of the surface's
 * triangles, clipped by its facets, and its own vertices inside the solid. `points`: 3 doubles each, in units of the
 * model; `triangles`: 3 ids per facet, counter-clockwise from outside. `*part` receives 3 doubles for each of `*count`
 * points, NULL for none; the caller frees it with qmat_free. The surface is watertight. QMAT_ERROR_MEMORY. Safe from
 * any thread. Cost: linear in the triangles of the surface, and in the facets for each near the polyhedron. */
qmat_status qmat_solid_part(const qmat_surface *surface, const double *points, const uint32_t *triangles,
                            size_t triangle_count, double **part, size_t *count);

#endif
