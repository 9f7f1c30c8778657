/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_SURFACE_TO_ENVELOPE_H
#define QMAT_NODES_MEASURE_SURFACE_TO_ENVELOPE_H

#include "core/geometry/medial_complex.h"
#include "core/geometry/medial_primitive.h"

/* A growing list of prepared primitives. The balls around them are apart, since they reject most primitives. */
typedef struct qmat_star_primitives {
  struct qmat_star_primitive *items;
  qmat_primitive_ball *balls;
  size_t count, item_capacity, ball_capacity;
} qmat_star_primitives;

/* Tracks the surface-to-envelope error while a medial mesh is simplified (eq. 9-12, with the signed F).
 *
 * Every constraint point has a witness: a point of the medial complex, as weights on one live simplex, whose medial
 * sphere is within the point's limit. That of a strict point (qmat_extra_points) may exceed it at first; a point that
 * is given up gets the limit INFINITY. A collapse maps simplices to simplices, so witnesses move along. A witness that
 * is still within the limit proves the new complex good at its point; otherwise the primitives around are searched for
 * another witness. The points whose witnesses are at a vertex are its responsible region. */
typedef struct qmat_surface_to_envelope {
  size_t point_count, vertex_count;
  const double *points;      /* 3 per point */
  double *limits;            /* per point: the largest F allowed */
  uint32_t *witnesses;       /* 3 per point: live vertices, QMAT_NONE where fewer */
  double *weights;           /* 3 per point; sum 1 */
  uint32_t *next, *previous; /* per witness slot (3 * point + k): the list of its vertex */
  uint32_t *heads;           /* per vertex: its first slot, or QMAT_NONE */
  uint32_t *slot_counts;     /* per vertex */
  uint32_t *marks, stamp;    /* per point */
  /* Copies of lists, in order, for fits that walk them often: a walk through memory at random takes longer than the
   * work. */
  uint32_t *copies;    /* 6 per point */
  size_t *copy_starts; /* per vertex: SIZE_MAX where there is no copy, or the list has changed */
  size_t copied;
  /* Witnesses found by the newest test; a commit accepts them. */
  struct qmat_new_witness *found;
  size_t found_count, found_capacity;
  /* The primitives of the merged vertex's star, prepared on demand, and those at the vertices of its link. */
  qmat_star_primitives star, link;
  bool prepared, link_known;
  uint32_t nearest;      /* of the star: the primitive nearest to the point tested last, tried first; QMAT_NONE: none */
  uint32_t failed_point; /* where the newest test failed */
  double failed_distance; /* F there */
} qmat_surface_to_envelope;

/* Starts with the given constraint points. The arrays `points` and `limits` stay the caller's; `witnesses` and
 * `weights` (3 per point) are copied. `vertex_count` is the complex's. QMAT_ERROR_MEMORY. Free with
 * qmat_surface_to_envelope_uninit, also after a failure. */
qmat_status qmat_surface_to_envelope_init(qmat_context *context, qmat_surface_to_envelope *tracker, size_t point_count,
                                          const double *points, double *limits, const uint32_t *witnesses,
                                          const double *weights, size_t vertex_count);
void qmat_surface_to_envelope_uninit(qmat_surface_to_envelope *tracker);

/* The list of a vertex as an array of its `slot_counts` slots, which the next call or commit may overwrite.
 * QMAT_ERROR_MEMORY. */
qmat_status qmat_surface_to_envelope_slots(qmat_context *context, qmat_surface_to_envelope *tracker, uint32_t vertex,
                                           const uint32_t **slots);

/* Whether every constraint point is within its limit (`*kept`) when `collapse` makes `sphere` (4 doubles) of its edge.
 * `first` is a point to test first (QMAT_NONE: none): a point that failed before is likely to fail again. Changes only
 * scratch. QMAT_ERROR_MEMORY. */
qmat_status qmat_surface_to_envelope_test(qmat_context *context, qmat_surface_to_envelope *tracker,
                                          const qmat_complex *complex, const qmat_collapse *collapse,
                                          const double sphere[4], uint32_t first, bool *kept);

/* Prepares the primitives of the merged vertex's star for qmat_surface_to_envelope_star_foot; tests prepare their own.
 * QMAT_ERROR_MEMORY. */
qmat_status qmat_surface_to_envelope_prepare(qmat_context *context, qmat_surface_to_envelope *tracker,
                                             const qmat_complex *complex, const qmat_collapse *collapse,
                                             const double sphere[4]);

/* The signed distance from a point to the primitives prepared last, for `sphere`. `foot` (4 doubles) is the medial
 * sphere that attains it, `*share` the weight of `sphere` in that. `*nearest` is the primitive to try first, QMAT_NONE
 * for none, and becomes the nearest: the result for the same point and collapse, with another sphere, saves time. */
double qmat_surface_to_envelope_star_foot(const qmat_surface_to_envelope *tracker, const qmat_complex *complex,
                                          const qmat_collapse *collapse, const double sphere[4], const double point[3],
                                          uint32_t *nearest, double foot[4], double *share);

/* The largest F after `collapse` to `sphere` over the points of its vertices, among the first `point_count`. F is taken
 * to the primitives of the merged vertex and of the vertices around it. -INFINITY where there is no such point.
 * QMAT_ERROR_MEMORY. Cost: points times primitives. */
qmat_status qmat_surface_to_envelope_of_collapse(qmat_context *context, qmat_surface_to_envelope *tracker,
                                                 const qmat_complex *complex, const qmat_collapse *collapse,
                                                 const double sphere[4], size_t point_count, double *error);

/* Accepts the collapse of the newest successful test, or without limits any collapse. Call it before the complex
 * changes. */
void qmat_surface_to_envelope_commit(qmat_surface_to_envelope *tracker, const qmat_collapse *collapse);

/* The vertex that a point belongs to: the corner with the largest weight in its witness. */
uint32_t qmat_surface_to_envelope_owner(const qmat_surface_to_envelope *tracker, size_t point);

/* The first slot of a vertex. A loop over its points is: for (slot = qmat_surface_to_envelope_first(...); slot !=
 * QMAT_NONE; slot = next[slot]); the constraint point is slot / 3. A point may occur twice. */
static inline uint32_t qmat_surface_to_envelope_first(const qmat_surface_to_envelope *tracker, uint32_t vertex) {
  return tracker->heads[vertex];
}

/* Whether no earlier slot of the same point has one of `count` vertices as witness. */
static inline bool qmat_surface_to_envelope_is_first(const qmat_surface_to_envelope *tracker, uint32_t slot,
                                                     const uint32_t *vertices, int count) {
  for (uint32_t s = slot - slot % 3; s < slot; s++)
    for (int i = 0; i < count; i++)
      if (tracker->witnesses[s] == vertices[i]) return false;
  return true;
}

#endif
