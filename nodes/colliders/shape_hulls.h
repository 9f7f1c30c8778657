/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_SHAPE_HULLS_H
#define QMAT_NODES_COLLIDERS_SHAPE_HULLS_H

#include "core/geometry/surface.h"
#include "nodes/colliders/shape_set.h"

/* Where the vertices of hulls are: on the shape, so that the hull is inside it, or outside, so that it contains it. */
typedef enum qmat_hull_side { QMAT_HULL_INSIDE, QMAT_HULL_OUTSIDE } qmat_hull_side;

/* The smallest limit on the vertices of a hull. */
enum { QMAT_LEAST_HULL_POINTS = 24 };

/* Fills the hulls of `colliders` from its spheres and shapes: for each shape a convex polyhedron that is within about
 * `error` (a length of the model, above 0) of it, or the nearest of at most `most_points` (QMAT_LEAST_HULL_POINTS at
 * least) vertices. Outside, its facets touch the shape (nodes/colliders/tangent_hull.h); inside, its vertices are on
 * the spheres in directions that are spread evenly (a Fibonacci lattice), more of them on larger spheres.
 * QMAT_ERROR_MEMORY, QMAT_ERROR_GEOMETRY names the shape, QMAT_CANCELLED. Cost: some hulls of `most_points` points per
 * shape. */
qmat_status qmat_shape_hulls(qmat_context *context, qmat_colliders *colliders, size_t most_points, double error,
                             qmat_hull_side side);

#endif
