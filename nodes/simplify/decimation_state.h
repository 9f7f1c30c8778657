/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_DECIMATION_STATE_H
#define QMAT_NODES_SIMPLIFY_DECIMATION_STATE_H

#include "core/geometry/surface.h"
#include "nodes/measure/constraint_points.h"
#include "nodes/measure/envelope_to_surface.h"
#include "nodes/measure/surface_to_envelope.h"
#include "nodes/simplify/collapse_chain.h"
#include "nodes/simplify/collapse_cost.h"
#include "nodes/simplify/crease_guard.h"
#include "nodes/simplify/edge_heap.h"
#include "nodes/simplify/medial_quadrics.h"
#include "nodes/simplify/neighbourhood_fit.h"
#include "nodes/simplify/sphere_fit.h"

typedef enum { QMAT_ERROR_TWO_SIDED, QMAT_ERROR_ONE_SIDED } qmat_error_kind;
typedef enum { QMAT_EXCEED_SKIP, QMAT_EXCEED_STOP, QMAT_EXCEED_RAISE } qmat_exceed_rule;
typedef enum { QMAT_PROTECT_OFF, QMAT_PROTECT_LATE, QMAT_PROTECT_ALWAYS } qmat_protection;
typedef enum { QMAT_FEATURES_NONE, QMAT_FEATURES_SHARP, QMAT_FEATURES_AUTO } qmat_feature_rule;
typedef enum { QMAT_TOPOLOGY_FREE, QMAT_TOPOLOGY_GUARD, QMAT_TOPOLOGY_PRESERVE } qmat_topology_policy;

/* Collapses done, and refused by each test. */
typedef struct qmat_collapse_counts {
  size_t collapses, refused_by_inside_test, refused_by_surface_to_envelope, refused_by_envelope_to_surface,
      refused_by_protection, refused_by_topology;
} qmat_collapse_counts;

/* The collapses that are allowed, and when they end. */
typedef struct qmat_decimation_rules {
  double limit;       /* limit of both errors at the constraint points, unit frame; INFINITY: none */
  double share;       /* share of the limit that collapses may use: above 0, at most 1 */
  double thin_radius; /* where the envelope is bounded, edges of spheres up to this radius may leave the model */
  double finest;      /* the first threshold where it rises, unit frame */
  size_t vertices;    /* collapses end at this number of spheres; 0: never */
  double most_cost;   /* or when the cheapest collapse costs more; 0: never */
  double k;           /* of eq. 6 */
  qmat_cost_kind cost;
  bool published; /* quadrics and candidates of the public Q-MAT code, inside the model or not */
  qmat_error_kind error;
  qmat_exceed_rule on_exceed;
  qmat_topology_policy topology;
  qmat_protection protect;
  size_t late_spheres;        /* with QMAT_PROTECT_LATE, protection starts at this number of spheres */
  qmat_feature_rule features; /* whether spheres of radius zero stay on their creases; never auto */
  double crease_share; /* of the threshold: the largest distance of a crease from its remaining points; above 0 */
  uint64_t seed;       /* of the factors of the costs; 0: none */
  int refits;          /* passes that fit spheres to the surface after the last collapse, to make room for more */
  bool neighbourhoods; /* edges are tried with the spheres around them fitted jointly, from the end of an earlier run */
  bool final_refit;    /* spheres are fitted at the end to lower the error itself */
  bool repairs;        /* no collapses: spheres move where the newest constraint points exceed their limits */
  const uint8_t *thin; /* per sample: whether it lies on a thin feature; read only with protection */
} qmat_decimation_rules;

/* Places that no fit could repair; 3 doubles each, unit frame. */
typedef struct qmat_failed_places {
  double *points;
  size_t count, capacity;
} qmat_failed_places;

/* A medial mesh while its edges collapse, the cheapest first, each to the best candidate that lies inside the model and
 * keeps both errors within the threshold (sections 3.1.2, 3.3 and 3.4).
 *
 * With QMAT_EXCEED_SKIP the threshold is the limit from the first collapse on. With the others the collapses are the
 * same for any limit and number of vertices, which only end them: the threshold starts at the finest and rises by
 * levels, twelve to each doubling. It rises when the next collapse in the order of costs exceeds it (STOP), or when all
 * remaining ones do (RAISE). */
typedef struct qmat_decimation {
  qmat_context *context;
  qmat_decimation_rules rules;
  qmat_surface *surface;
  qmat_complex complex;
  size_t sheet_vertices;  /* the first so many vertices are those of sheets */
  qmat_quadric *quadrics; /* per vertex */
  qmat_edge_heap heap;
  const qmat_constraint_points *constraints;
  size_t newest_surface_count, newest_inner_count; /* of constraint points that were added last, each the last ones */
  qmat_surface_to_envelope surface_tracker;
  qmat_envelope_to_surface envelope_tracker;
  qmat_collapse collapse;
  qmat_sphere_fit fit;
  double fitted[4]; /* the result of the newest fit of one sphere */
  qmat_neighbourhood_fit neighbourhood;
  struct qmat_neighbourhood_state *saved; /* the spheres and bounds of a neighbourhood before it was tried */
  size_t saved_count, saved_capacity;
  qmat_crease_guard creases;
  double threshold;        /* of both errors, now; INFINITY: none */
  int level;               /* of the threshold, where it rises */
  qmat_collapse_log log;   /* every collapse, where the threshold rises */
  uint32_t *failed_points; /* per edge: the constraint point where it failed, or QMAT_NONE */
  double *needed;          /* per edge: a lower bound of the threshold that allows it */
  uint8_t *stale;          /* per edge: whether its neighbourhood changed after its cost */
  double *fitted_errors;   /* per edge: the error of its newest fitted sphere */
  uint8_t *converged;      /* per vertex: whether its last fit did not move it, and no neighbour has moved since */
  const uint8_t *locked;   /* per vertex: whether its edges stay, in a piece of a larger medial mesh; NULL: none do */
  bool fitting;            /* whether spheres are fitted where no candidate is allowed; not in the first pass */
  int refusal;             /* why the newest test of a sphere failed */
  uint32_t tested_first;   /* the constraint point that it tested first, or QMAT_NONE */
  struct qmat_copy *copy;  /* NULL: the decimation is alone */
  qmat_failed_places *failed_places; /* of earlier repairs of the same round; the caller's */
  size_t moves;                      /* of spheres by refits and repairs, with those of the rounds before */
  qmat_collapse_counts counts;
} qmat_decimation;

/* Whether the collapses are the same for every limit. */
static inline bool qmat_decimation_in_order(const qmat_decimation *s) {
  return s->rules.on_exceed != QMAT_EXCEED_SKIP;
}

static inline bool qmat_decimation_is_two_sided(const qmat_decimation *s) {
  return s->rules.error == QMAT_ERROR_TWO_SIDED;
}

/* Whether a vertex belongs to a sheet. Its sphere keeps its radius, and never merges with one of a solid. */
static inline bool qmat_decimation_is_of_sheet(const qmat_decimation *s, uint32_t vertex) {
  return vertex < s->sheet_vertices;
}

/* Whether a constraint point lies inside the solid, not on its surface. */
static inline bool qmat_decimation_is_inner(const qmat_decimation *s, size_t point) {
  return point >= s->constraints->surface_count;
}

#endif
