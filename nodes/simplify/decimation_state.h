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
typedef enum { QMAT_FEATURES_NONE, QMAT_FEATURES_SHARP } qmat_feature_rule;
typedef enum { QMAT_TOPOLOGY_FREE, QMAT_TOPOLOGY_GUARD, QMAT_TOPOLOGY_PRESERVE } qmat_topology_policy;

/* What was done, and what was refused by which test. */
typedef struct qmat_collapse_counts {
  size_t collapses, refused_by_inside_test, refused_by_surface_to_envelope, refused_by_envelope_to_surface,
      refused_by_protection, refused_by_topology;
} qmat_collapse_counts;

/* What collapses are allowed, and when they end. */
typedef struct qmat_decimation_rules {
  double limit;     /* what both errors are threshold to at the constraint points, unit frame; INFINITY: nothing is
                       threshold */
  double share;     /* of the limit, how much of it collapses may use up: above 0, at most 1 */
  double finest;    /* what is threshold first where that rises, unit frame */
  size_t vertices;  /* collapses end when so few are left; 0: never */
  double most_cost; /* or when the cheapest costs more; 0: never */
  double k;         /* of eq. 6 */
  qmat_cost_kind cost;
  bool published; /* quadrics and candidates of the public Q-MAT code, inside the model or not */
  qmat_error_kind error;
  qmat_exceed_rule on_exceed;
  qmat_topology_policy topology;
  qmat_protection protect;
  qmat_feature_rule features; /* whether spheres of radius zero stay on their creases */
  double crease_share; /* of what is threshold, how far points of a crease may be from what is left of it: above 0 */
  int refits;          /* how often spheres are fitted to the surface after the last collapse, to make room for more */
  bool neighbourhoods; /* edges are tried with the spheres around them fitted at once, where an earlier run was left
                          without */
  bool final_refit;    /* at the end spheres are fitted for the sake of a smaller error, too */
  const uint8_t *thin; /* per sample: whether it lies on a thin part; read only with protection */
  bool has_target;     /* whether the solid's Euler characteristic is known */
  int64_t target_euler;
} qmat_decimation_rules;

/* A medial mesh while its edges collapse, the cheapest first, each to the best candidate that lies inside the model and
 * keeps both errors (sections 3.1.2, 3.3 and 3.4).
 *
 * With QMAT_EXCEED_SKIP the limit is what is threshold from the first collapse on. With the others the collapses are
 * the same for any limit and number of vertices, which only say where they end: what is threshold starts at the finest
 * and rises, by twelve levels to each doubling, when the next collapse in the order of costs would exceed it (STOP), or
 * when every one would (RAISE). */
typedef struct qmat_decimation {
  qmat_context *context;
  qmat_decimation_rules rules;
  qmat_surface *surface;
  qmat_complex complex;
  qmat_quadric *quadrics; /* per vertex */
  qmat_edge_heap heap;
  const qmat_constraint_points *constraints;
  qmat_surface_to_envelope surface_tracker;
  qmat_envelope_to_surface envelope_tracker;
  qmat_collapse collapse;
  qmat_sphere_fit fit;
  double fitted[4]; /* what the newest fit of it has made of a collapse's sphere */
  qmat_neighbourhood_fit neighbourhood;
  struct qmat_neighbourhood_state *saved; /* what a patch was before it was tried */
  size_t saved_count, saved_capacity;
  qmat_crease_guard creases;
  double threshold;        /* what both errors are threshold to now; INFINITY: nothing is threshold */
  int level;               /* of it, where it rises */
  qmat_collapse_log log;   /* every collapse, where what is threshold rises */
  uint32_t *failed_points; /* per edge: the constraint point that refused it, or QMAT_NONE */
  double *needed;          /* per edge: no less has to be threshold for it to collapse, as far as is known */
  uint8_t *stale;          /* per edge: whether its cost is older than its neighbourhood */
  double *fitted_errors;   /* per edge: of the sphere that was fitted last */
  uint8_t *converged;      /* per vertex: whether a fit did not move it, and nothing has moved around it since */
  const uint8_t *locked;   /* per vertex: whether its edges stay, in a part of a larger medial mesh; NULL: none do */
  bool protecting, fitting;
  int refusal;   /* why the newest test of a sphere failed */
  int64_t euler; /* of the medial mesh */
  size_t moves;
  qmat_collapse_counts counts;
} qmat_decimation;

/* Whether the collapses are the same for every limit. */
static inline bool qmat_decimation_in_order(const qmat_decimation *s) {
  return s->rules.on_exceed != QMAT_EXCEED_SKIP;
}

static inline bool qmat_decimation_is_two_sided(const qmat_decimation *s) {
  return s->rules.error == QMAT_ERROR_TWO_SIDED;
}

/* Whether a constraint point lies inside the solid, not on its surface. */
static inline bool qmat_decimation_is_inner(const qmat_decimation *s, size_t point) {
  return point >= s->constraints->surface_count;
}

#endif
