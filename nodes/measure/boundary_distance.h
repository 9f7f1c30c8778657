/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_BOUNDARY_DISTANCE_H
#define QMAT_NODES_MEASURE_BOUNDARY_DISTANCE_H

#include "core/geometry/envelope.h"
#include "core/geometry/surface.h"

/* What a largest distance lies between, both included; unit frame. */
typedef struct qmat_bounds {
  double lo, hi;
} qmat_bounds;

/* How far the boundary of an envelope lies from a surface. */
typedef struct qmat_boundary_distance {
  qmat_bounds either_side; /* of the distance from a point of the boundary to the surface */
  qmat_bounds outside;     /* the same over the points that lie out of the solid; 0 where there is none, or unasked */
  double largest, mean;    /* over the sampled points, to either side; 0 without one */
  size_t sample_count;     /* of the samples that lie on the boundary */
  size_t looks;            /* pieces of the boundary that were looked at */
  size_t far_count, far_capacity, doubt_count, doubt_capacity;
  double *far_points; /* 3 each: places farther than epsilon from the surface that are, or may be, on the boundary */
  double *doubts;     /* 3 each: places for which hi is above epsilon although none was found that is as far */
} qmat_boundary_distance;

void qmat_boundary_distance_uninit(qmat_boundary_distance *result);

/* Measures the boundary of the union of the spheres, cones and slabs of `unit` (a sealed medial mesh's arrays in the
 * unit frame, of which `envelope` was made) against the surface, inside and outside of it alike.
 *
 * First `sample_count` points are spread evenly over the spheres, the mantles of the cones and the tangent planes of
 * the slabs, and those on the boundary asked. Then branch and bound over pieces of these same: the distance to the
 * surface is 1-Lipschitz, so it is at most `reach` above that at a piece's middle. A piece that lies deeper than
 * QMAT_BOUNDARY_SKIN within the envelope is no part of the boundary: within a neighbour whose support is larger
 * along all of its normals, or within a primitive that holds its middle deeper than its reach. Where all but
 * a twentieth of the samples are buried, or of more than 10,000 spheres, edges and sheets, cells of space are searched
 * instead, of which those that may meet the boundary count. Pieces are taken level by level, and all of a level are
 * compared with the one `lo` of the levels before, so that the answer does not depend on threads.
 *
 * Without `outside` what lies out of the solid is not told apart: quicker.
 *
 * hi - lo is at most `tolerance` (a share of `epsilon` or of lo, the larger), and less where that decides whether hi is
 * at most `epsilon`; but hi may be five times the tolerated share of epsilon where the truth is less. Where two
 * primitives meet so that the boundary between them is undecided down to the smallest pieces, or where the work would
 * be too much, hi is higher, and still no point of the boundary is farther. Of the places that were found farther than
 * epsilon, and of those that are as far and may or may not lie on the boundary, some are told, the farthest among them,
 * and of those that may be as far: free them with qmat_boundary_distance_uninit, also after a failure. `epsilon` > 0
 * and `tolerance` > 0; their product is taken for 1e-5 at least. QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads. */
qmat_status qmat_boundary_distance_measure(qmat_context *context, const qmat_surface *surface,
                                           const qmat_envelope *envelope, const qmat_medial *unit, double epsilon,
                                           double tolerance, bool outside, size_t sample_count,
                                           qmat_boundary_distance *result);

/* Points that lie this deep in the envelope, in diagonals, count as its boundary too, for hi: what a file in single
 * precision or a judge with samples cannot tell from it. */
#define QMAT_BOUNDARY_SKIN 1e-4

/* What a search for the largest of some distances has to get below, with `lo` known to be attained: `tolerance` (as
 * above) over it, or less to get below epsilon where lo is. */
double qmat_bound_target(double lo, double epsilon, double tolerance);

#endif
