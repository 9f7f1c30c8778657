/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_ENVELOPE_TO_SURFACE_H
#define QMAT_NODES_MEASURE_ENVELOPE_TO_SURFACE_H

#include "core/geometry/depth_lattice.h"
#include "core/geometry/medial_complex.h"

/* Tracks the envelope-to-surface error, how far the envelope leaves the solid, while a medial mesh is simplified.
 *
 * A sphere with centre c and radius r leaves the solid by at most h = r - depth(c). The depth is the distance to the
 * surface, negative outside. It is 1-Lipschitz, so one query bounds h around it. Bounds of old primitives carry over to
 * their images: when a corner c of radius r moves to the sphere m, h of a primitive at it grows by at most |c_m - c| +
 * r_m - r. A primitive is searched piece by piece only where these bounds exceed the limit: with bounds of second order
 * inside a watertight surface, which take pieces of about sqrt(limit * depth), with the depths that a lattice
 * remembers, then by queries to the surface. */
typedef struct qmat_envelope_to_surface {
  qmat_depth_lattice lattice;
  double limit;
  bool by_squares;         /* whether the depth is the distance to a watertight surface */
  double *depths;          /* per vertex: a lower bound of its depth */
  size_t sheet_vertices;   /* the first so many vertices are of sheets, and need not lie inside */
  double *edge_bounds;     /* per edge: an upper bound of h over it */
  double *triangle_bounds; /* per triangle */
  /* The results of the newest test: bounds of the merged vertex and of its star. */
  double sphere_depth;
  double failed;          /* after a failure: the largest h found, or the limit */
  double failed_place[4]; /* after a failure: a medial sphere with an h above the limit */
  double *new_edge_bounds, *new_triangle_bounds;
  size_t new_edge_capacity, new_triangle_capacity;
} qmat_envelope_to_surface;

/* Starts from the initial medial mesh. `depths` (per vertex, copied) are lower bounds of the depths. The bounds of
 * edges and triangles follow from them without queries. QMAT_ERROR_MEMORY. Free with qmat_envelope_to_surface_uninit,
 * also after a failure. */
qmat_status qmat_envelope_to_surface_init(qmat_context *context, qmat_envelope_to_surface *tracker,
                                          const qmat_surface *surface, const qmat_complex *complex,
                                          const double *depths, double limit);
void qmat_envelope_to_surface_uninit(qmat_envelope_to_surface *tracker);

/* Bounds the depth of the merged sphere's centre from below: from the ends where that proves it inside and within the
 * limit, else by a query. True when the sphere is within the limit and, unless it is of a sheet, its centre inside. */
bool qmat_envelope_to_surface_test_sphere(qmat_envelope_to_surface *tracker, const qmat_complex *complex,
                                          const qmat_collapse *collapse, const double sphere[4]);

/* Whether the midpoint of every edge of the merged vertex lies inside the model (section 3.4). Edges of two spheres
 * with radii up to `exempt_radius` (at least 0) are exempt: those of radius zero are creases of the model's surface.
 * Call it after qmat_envelope_to_surface_test_sphere. */
bool qmat_envelope_to_surface_test_midpoints(qmat_envelope_to_surface *tracker, const qmat_complex *complex,
                                             const qmat_collapse *collapse, const double sphere[4],
                                             double exempt_radius);

/* Whether every primitive of the merged vertex's star is within the limit: `*kept`. Call it after
 * qmat_envelope_to_surface_test_sphere. QMAT_ERROR_MEMORY. */
qmat_status qmat_envelope_to_surface_test(qmat_context *context, qmat_envelope_to_surface *tracker,
                                          const qmat_complex *complex, const qmat_collapse *collapse,
                                          const double sphere[4], bool *kept);

/* Accepts the newest successful test. Call it before the complex changes. */
void qmat_envelope_to_surface_commit(qmat_envelope_to_surface *tracker, const qmat_collapse *collapse);

/* Carries over bounds of h over `count` rows of `width` vertices (2: edges, 3: triangles), which are live in the
 * complex by their new numbers `ids`, where they are tighter than those known. `alive`: whether a row counts; NULL: all
 * do. Cost: rows times a star. */
void qmat_envelope_to_surface_carry(qmat_envelope_to_surface *tracker, const qmat_complex *complex, const uint32_t *ids,
                                    size_t width, const uint32_t *rows, const uint8_t *alive, const double *bounds,
                                    size_t count);

/* Searches the edges and triangles whose bounds exceed the limit for tighter ones. One thread. */
void qmat_envelope_to_surface_tighten(qmat_envelope_to_surface *tracker, const qmat_complex *complex);

/* An upper bound of h over all live spheres, edges and triangles. */
double qmat_envelope_to_surface_largest_bound(const qmat_envelope_to_surface *tracker, const qmat_complex *complex);

/* An upper bound of h over a primitive of `count` (1, 2 or 3) spheres (4 doubles each), by branch and bound. It exceeds
 * the largest h by at most `tolerance`, or is `enough` where that is larger. Thread-safe. */
double qmat_envelope_to_surface_bound(const qmat_surface *surface, const double *const spheres[], int count,
                                      double enough, double tolerance);

/* The same, but the tolerance doubles after each `patience` queries of the surface; 0: it stays. A primitive that
 * touches curved surface along an area, or many facets of a thick sheet, may take millions. */
double qmat_envelope_to_surface_bound_soon(const qmat_surface *surface, const double *const spheres[], int count,
                                           double enough, double tolerance, size_t patience);

/* r - depth for one sphere (4 doubles). Thread-safe. */
double qmat_envelope_to_surface_of_sphere(const qmat_surface *surface, const double sphere[4]);

#endif
