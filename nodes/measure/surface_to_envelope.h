/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_SURFACE_TO_ENVELOPE_H
#define QMAT_NODES_MEASURE_SURFACE_TO_ENVELOPE_H

#include "core/geometry/medial_complex.h"
#include "core/geometry/medial_primitive.h"

/* A growing list of prepared primitives, and the ball that holds each: beside them, since most are passed over by it.
 */
typedef struct qmat_star_primitives {
  struct qmat_star_primitive *items;
  qmat_primitive_ball *balls;
  size_t count, item_capacity, ball_capacity;
} qmat_star_primitives;

/* Holds the distance from the surface to the envelope while a medial mesh is simplified (eq. 9-12, with the signed F).
 *
 * Each constraint point on the surface has a witness: a point of the medial complex, as weights on one live simplex,
 * whose medial sphere lies within the point's limit. A collapse maps simplices to simplices, so it carries witnesses
 * along; a witness that still lies within the limit proves the new complex good there, and only where it does not are
 * the primitives around searched for another. The points that a vertex's witnesses serve are its responsible region. */
typedef struct qmat_surface_to_envelope {
  size_t point_count;
  const double *points;      /* 3 per point */
  double *limits;            /* per point: what F may reach there */
  uint32_t *witnesses;       /* 3 per point: live vertices, QMAT_NONE where fewer */
  double *weights;           /* 3 per point; sum 1 */
  uint32_t *next, *previous; /* per witness slot (3 * point + k): the list of its vertex */
  uint32_t *heads;           /* per vertex: its first slot, or QMAT_NONE */
  uint32_t *slot_counts;     /* per vertex */
  uint32_t *marks, stamp;    /* per point */
  /* Witnesses found by the newest test, taken over by a commit. */
  struct qmat_new_witness *found;
  size_t found_count, found_capacity;
  /* The primitives of the merged vertex's star, prepared when first needed, and those of the link's vertices. */
  qmat_star_primitives star, link;
  bool prepared, link_known;
  uint32_t failed_point;  /* why the newest test failed */
  double failed_distance; /* F there */
} qmat_surface_to_envelope;

/* Starts with the given constraint points; the arrays `points` and `limits` stay the caller's, `witnesses` and
 * `weights` (3 per point) are copied. `vertex_count` is the complex's. QMAT_ERROR_MEMORY. Free with
 * qmat_surface_to_envelope_uninit, also after a failure. */
qmat_status qmat_surface_to_envelope_init(qmat_context *context, qmat_surface_to_envelope *tracker, size_t point_count,
                                          const double *points, double *limits, const uint32_t *witnesses,
                                          const double *weights, size_t vertex_count);
void qmat_surface_to_envelope_uninit(qmat_surface_to_envelope *tracker);

/* Whether every constraint point keeps within its limit when `collapse` makes `sphere` (4 doubles) of its edge. `first`
 * is a point to try first (QMAT_NONE: none): what failed before is likely to fail again. Changes nothing but scratch.
 * `*kept` is the answer. QMAT_ERROR_MEMORY. */
qmat_status qmat_surface_to_envelope_test(qmat_context *context, qmat_surface_to_envelope *tracker,
                                          const qmat_complex *complex, const qmat_collapse *collapse,
                                          const double sphere[4], uint32_t first, bool *kept);

/* Prepares the primitives of the star of the merged vertex for qmat_surface_to_envelope_star_foot. Tests prepare their
 * own. QMAT_ERROR_MEMORY. */
qmat_status qmat_surface_to_envelope_prepare(qmat_context *context, qmat_surface_to_envelope *tracker,
                                             const qmat_complex *complex, const qmat_collapse *collapse,
                                             const double sphere[4]);

/* The signed distance from a point to the primitives prepared last, which belong to `sphere`; `foot` (4 doubles) is the
 * medial sphere that attains it, `*share` the weight of `sphere` in it. */
double qmat_surface_to_envelope_star_foot(const qmat_surface_to_envelope *tracker, const qmat_complex *complex,
                                          const qmat_collapse *collapse, const double sphere[4], const double point[3],
                                          double foot[4], double *share);

/* How far `collapse` to `sphere` leaves the constraint points that its vertices answer for, of the first `point_count`:
 * the largest F, to the primitives of the merged vertex and to those at the vertices around it; -INFINITY where there
 * is no such point. QMAT_ERROR_MEMORY. Cost: points times primitives. */
qmat_status qmat_surface_to_envelope_of_collapse(qmat_context *context, qmat_surface_to_envelope *tracker,
                                                 const qmat_complex *complex, const qmat_collapse *collapse,
                                                 const double sphere[4], size_t point_count, double *error);

/* Takes the collapse of the newest successful test over (or, without limits, of any): call it before the complex
 * changes. */
void qmat_surface_to_envelope_commit(qmat_surface_to_envelope *tracker, const qmat_collapse *collapse);

/* The vertex that a point belongs to: the corner of its witness with the largest weight. */
uint32_t qmat_surface_to_envelope_owner(const qmat_surface_to_envelope *tracker, size_t point);

/* Calls for each slot of a vertex: for (slot = qmat_surface_to_envelope_first(...); slot != QMAT_NONE; slot =
 * next[slot]); the constraint point is slot / 3. A point may come up twice. */
static inline uint32_t qmat_surface_to_envelope_first(const qmat_surface_to_envelope *tracker, uint32_t vertex) {
  return tracker->heads[vertex];
}

#endif
