/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_CREASE_GUARD_H
#define QMAT_NODES_SIMPLIFY_CREASE_GUARD_H

#include "core/geometry/medial_complex.h"
#include "nodes/initial/creases.h"
#include "nodes/simplify/collapse_candidates.h"

/* Preserves the sharp features of a medial mesh while it is simplified: its spheres of radius zero, as medial.features
 * makes them. They stay in place, and so does the cone between two that follow each other on a crease. An inner sphere
 * may merge into a feature, except the last inner sphere; a feature never merges into an inner sphere. On a crease,
 * only points between its corners may merge, into one of their two neighbours, and only where all points of the initial
 * crease stay close to the remaining cones.
 *
 * The arrays live in the context's arena. Zeroed, it guards nothing. */
typedef struct qmat_crease_guard {
  size_t feature_count, left;   /* the initial and the present number */
  uint32_t *features;           /* per vertex of the complex: its feature, or QMAT_NONE; NULL: no features */
  uint32_t *vertices;           /* per feature: its vertex, or QMAT_NONE after it was merged */
  const double *points;         /* 3 per feature */
  const uint32_t *places;       /* per feature: its place along the creases, or QMAT_NONE for a corner */
  qmat_creases creases;         /* their points are features */
  const uint32_t *initial_next; /* per place: the next place on its crease, QMAT_NONE at its end */
  uint32_t *next, *previous;    /* per place: that of the next remaining feature, QMAT_NONE at an end */
} qmat_crease_guard;

/* Guards the spheres of radius zero of a complex without collapses, and the edges between two of them. The vertices
 * before `first` are those of sheets, and no features. QMAT_ERROR_MEMORY. Cost: linear. */
qmat_status qmat_crease_guard_init(qmat_context *context, const qmat_complex *complex, size_t first,
                                   qmat_crease_guard *guard);

/* Makes a guard of the same features for another complex with `vertex_count` vertices: `ids` maps the live vertices to
 * its vertices. `from` is unchanged and has to outlive `guard`. QMAT_ERROR_MEMORY. */
qmat_status qmat_crease_guard_renumber(qmat_context *context, const qmat_crease_guard *from, const uint32_t *ids,
                                       size_t vertex_count, qmat_crease_guard *guard);

static inline bool qmat_crease_guard_is_feature(const qmat_crease_guard *guard, uint32_t vertex) {
  return guard->features && vertex != QMAT_NONE && guard->features[vertex] != QMAT_NONE;
}

/* Restricts the candidates of an edge to its ends that preserve features, with their slab quadratic errors: none, one
 * or two. False, with unchanged candidates, if neither end is a feature. `tolerance` is the largest distance of crease
 * points from their crease; `*needed` gets the least tolerance that allows another candidate (INFINITY: none). Safe
 * from any thread. */
bool qmat_crease_guard_restrict(const qmat_crease_guard *guard, const qmat_complex *complex,
                                const qmat_quadric *quadrics, uint32_t edge, double tolerance,
                                qmat_candidates *candidates, double *needed);

/* Updates the guard for a collapse to `sphere`, one of the restricted candidates. The complex changes afterwards. */
void qmat_crease_guard_commit(qmat_crease_guard *guard, const qmat_complex *complex, const qmat_collapse *collapse,
                              const double sphere[4]);

/* The largest distance of a point of the initial creases to the remaining cones of its crease, in the complex's frame;
 * 0 without creases. Cost: linear in the initial creases. */
double qmat_crease_guard_error(const qmat_crease_guard *guard);

#endif
