/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_COVER_BOUND_H
#define QMAT_NODES_COLLIDERS_COVER_BOUND_H

#include "core/geometry/surface.h"
#include "nodes/colliders/shape_set.h"

/* A part of the solid that no shape was shown to contain. */
typedef struct qmat_uncovered {
  double point[3];
  double reach;   /* half the thickness of the sheet that the point is on, or 0 */
  double value;   /* a shape that grows by this contains the part */
  uint32_t shape; /* that shape */
} qmat_uncovered;

/* The arrays are in the context's arena. */
typedef struct qmat_cover_bound {
  double bound;          /* if all shapes grow by this, no point of the solid is outside of them; 0 at least */
  size_t count;          /* of the parts, at most a limit per region */
  qmat_uncovered *parts; /* in an order that does not depend on threads */
  bool *covered;         /* per region of solid_cubes.h: whether no part is in it */
} qmat_cover_bound;

/* Proves that shapes contain a solid, or finds where they do not, by branch and bound over cubes. The solid's part in a
 * cube is within the convex hull of the corners of the cube that are inside the solid and of the surface in the cube.
 * So a shape contains that part if it contains those corners and the corners of the facets clipped to the cube: shapes
 * are convex. A sheet counts as the balls of half its thickness around its points; those in a cube are contained where
 * the corners of the clipped facets are that deep in the shape. A cube without such a shape is split, down to a half
 * diagonal of `tolerance` (above 0). With `only_parts` the search of a region ends with the last part that it keeps:
 * the parts are the same, and of the bound only whether it is 0. `before` (may be NULL) is the answer before some
 * shapes grew: what was covered then is not searched again. The surface must be closed and oriented; for others the
 * answer is an estimate. Rounding: distances are exact to 1e-9, and points within 1e-6 of the surface count as inside.
 * QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads; the answer does not depend on their number. Cost: the cubes are small
 * only where the boundary of the union has creases near the surface. */
qmat_status qmat_cover_bound_measure(qmat_context *context, const qmat_surface *surface, const qmat_shape_set *set,
                                     double tolerance, bool only_parts, const qmat_cover_bound *before,
                                     qmat_cover_bound *result);

#endif
