/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_BOUNDARY_DISTANCE_H
#define QMAT_NODES_MEASURE_BOUNDARY_DISTANCE_H

#include "core/geometry/envelope.h"
#include "core/geometry/surface.h"

/* The largest of some distances lies in [lo, hi]; unit frame. */
typedef struct qmat_bounds {
  double lo, hi;
} qmat_bounds;

/* The distance from the boundary of an envelope to a surface. */
typedef struct qmat_boundary_distance {
  qmat_bounds either_side; /* over all points of the boundary */
  qmat_bounds outside;  /* over the points that lie out of the solid; 0 where there is none, or where not requested */
  double largest, mean; /* over the sampled points, to either side; 0 without one */
  size_t sample_count;  /* of the samples that lie on the boundary */
  size_t query_count;   /* of the pieces of the boundary that were evaluated */
  size_t far_count, far_capacity, undecided_count, undecided_capacity;
  double *far_points;       /* 3 each: places farther than epsilon from the surface, on the boundary or perhaps so */
  double *undecided_points; /* 3 each: places where the distance may exceed epsilon although none was found to */
} qmat_boundary_distance;

void qmat_boundary_distance_uninit(qmat_boundary_distance *result);

/* What is measured, as below. */
typedef struct qmat_boundary_request {
  double epsilon;      /* unit frame, above 0 */
  double tolerance;    /* a share of epsilon, above 0; their product is taken for 1e-5 at least */
  size_t sample_count; /* 0: no samples */
  bool outside;        /* false: the inside tests are left out */
  bool only_places;    /* the search is for places farther than epsilon */
} qmat_boundary_request;

/* Measures the distance to the surface over the boundary of the union of the spheres, cones and slabs of `unit` (a
 * sealed medial mesh's arrays in the unit frame, of which `envelope` was made). Both sides of the surface count.
 *
 * First, `sample_count` points are spread evenly over the features (nodes/measure/boundary_features.h); those on the
 * boundary give sampled figures and lower bounds. Then branch and bound runs over pieces of the features: the distance
 * to the surface is 1-Lipschitz, so over a piece of radius `reach` it exceeds the middle's by at most that. Pieces
 * deeper than QMAT_BOUNDARY_SKIN in the envelope are discarded, and with `outside` those deeper than 1e-6. Cells of
 * space replace the features where there are more than 65,536. A level of pieces is compared with the lower bound of
 * the levels before it, so that the answer does not depend on threads.
 *
 * hi - lo is at most `tolerance` times epsilon or lo, the larger, and smaller where that decides whether hi is at most
 * `epsilon`. There are two exceptions. Errors below five times the tolerated share of epsilon are not resolved: hi is
 * then up to that. And where the smallest pieces do not decide whether a place is on the boundary, or the number of
 * queries reaches its limit, hi is larger; it still is an upper bound.
 *
 * The arrays of places have one point for each piece that was finished so, the farthest among them. Free them with
 * qmat_boundary_distance_uninit, also after a failure. With `only_places` the search covers all of the boundary: a
 * piece with such a place is not split, and once there is one, no piece is split below a tenth of epsilon. hi is then
 * INFINITY. A search without such a place ends as usual. QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads. */
qmat_status qmat_boundary_distance_measure(qmat_context *context, const qmat_surface *surface,
                                           const qmat_envelope *envelope, const qmat_medial *unit,
                                           const qmat_boundary_request *request, qmat_boundary_distance *result);

/* The upper bound that a search for the largest of some distances has to prove, with `lo` attained: lo plus the
 * tolerance above, or less where that proves the distance to be at most epsilon. */
double qmat_bound_target(double lo, double epsilon, double tolerance);

#endif
