/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_ENVELOPE_TO_SURFACE_H
#define QMAT_NODES_MEASURE_ENVELOPE_TO_SURFACE_H

#include "core/geometry/depth_lattice.h"
#include "core/geometry/medial_complex.h"

/* Holds the qmat_point_distance by which the envelope leaves the solid while a medial mesh is simplified.
 *
 * A sphere with centre c and radius r leaves the solid by at most h = r - depth(c), depth being the qmat_point_distance
 * to the surface, negative outside. depth is 1-Lipschitz, so one look at the surface bounds h around it, and bounds of
 * old primitives carry over to their images: when a corner moves to sphere m, h of a primitive at it grows by at most
 * |c_m - c| + r_m - r. Only where such bounds pass the limit is a primitive searched piece by piece, first among depths
 * that are remembered on a lattice, then by asking the surface. */
typedef struct qmat_envelope_to_surface {
  qmat_depth_lattice lattice;
  double limit;
  double *depths;          /* per vertex: a lower bound of its depth */
  double *edge_bounds;     /* per edge: an upper bound of h over it */
  double *triangle_bounds; /* per triangle */
  /* The bounds of the merged vertex's star, of the newest test. */
  double sphere_depth;
  double failed;          /* an h that the newest test found, or the limit, when it failed */
  double failed_place[4]; /* a medial sphere with an h above the limit, when it failed */
  double *new_edge_bounds, *new_triangle_bounds;
  size_t new_edge_capacity, new_triangle_capacity;
} qmat_envelope_to_surface;

/* Starts with what is known of the initial medial mesh: `depths` (per vertex, copied) are lower bounds. Bounds of edges
 * and triangles are made from them, without asking the surface. QMAT_ERROR_MEMORY. Free with
 * qmat_envelope_to_surface_uninit, also after a failure. */
qmat_status qmat_envelope_to_surface_init(qmat_context *context, qmat_envelope_to_surface *tracker,
                                          const qmat_surface *surface, const qmat_complex *complex,
                                          const double *depths, double limit);
void qmat_envelope_to_surface_uninit(qmat_envelope_to_surface *tracker);

/* Bounds the depth of the merged sphere's centre from below: from its ends where that proves it inside and within the
 * limit, else by asking. True when the centre lies inside and the sphere within the limit. */
bool qmat_envelope_to_surface_test_sphere(qmat_envelope_to_surface *tracker, const qmat_complex *complex,
                                          const qmat_collapse *collapse, const double sphere[4]);

/* Whether the midpoint of every edge of the merged vertex lies inside the model (section 3.4), but for edges of two
 * spheres of radius zero, which are creases of its surface. Call it after qmat_envelope_to_surface_test_sphere. */
bool qmat_envelope_to_surface_test_midpoints(qmat_envelope_to_surface *tracker, const qmat_complex *complex,
                                             const qmat_collapse *collapse, const double sphere[4]);

/* Whether every primitive of the merged vertex's star keeps within the limit. Call it after
 * qmat_envelope_to_surface_test_sphere. `*kept` is the answer; QMAT_ERROR_MEMORY. */
qmat_status qmat_envelope_to_surface_test(qmat_context *context, qmat_envelope_to_surface *tracker,
                                          const qmat_complex *complex, const qmat_collapse *collapse,
                                          const double sphere[4], bool *kept);

/* Takes the newest successful test over: call it before the complex changes. */
void qmat_envelope_to_surface_commit(qmat_envelope_to_surface *tracker, const qmat_collapse *collapse);

/* Takes over what is known from elsewhere of the live edge (triangle) of these vertices: h over it is at most `bound`.
 * Cost: linear in a star. */
void qmat_envelope_to_surface_bound_edge(qmat_envelope_to_surface *tracker, const qmat_complex *complex, uint32_t a,
                                         uint32_t b, double bound);
void qmat_envelope_to_surface_bound_triangle(qmat_envelope_to_surface *tracker, const qmat_complex *complex, uint32_t a,
                                             uint32_t b, uint32_t c, double bound);

/* An upper bound of h over all spheres, edges and triangles that are left of the complex. */
double qmat_envelope_to_surface_largest_bound(const qmat_envelope_to_surface *tracker, const qmat_complex *complex);

/* An upper bound of h over a primitive of `count` (1, 2 or 3) spheres (4 doubles each): the largest h itself to within
 * `tolerance`, unless it is below `enough`, which is then the answer. Branch and bound; thread-safe. */
double qmat_envelope_to_surface_bound(const qmat_surface *surface, const double *const spheres[], int count,
                                      double enough, double tolerance);

/* r - depth for one sphere (4 doubles). Thread-safe. */
double qmat_envelope_to_surface_of_sphere(const qmat_surface *surface, const double sphere[4]);

#endif
