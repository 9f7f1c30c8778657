/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_SIMPLIFICATION_STATE_H
#define QMAT_NODES_SIMPLIFY_SIMPLIFICATION_STATE_H

#include <stdatomic.h>

#include "nodes/measure/medial_errors.h"
#include "nodes/measure/topology.h"
#include "nodes/simplify/copies.h"
#include "nodes/simplify/simplify_report.h"
#include "nodes/simplify/simplify_setup.h"
#include "nodes/simplify/thresholds.h"

/* What all passes of medial.simplify work on, with on_exceed=skip. */
typedef struct qmat_simplification {
  qmat_context *context;
  qmat_simplify_params params; /* with epsilon less the mesh's deviation */
  const qmat_samples *samples;
  const qmat_medial *initial;
  qmat_initial_medial state;
  uint64_t seed;               /* of the start; 0: costs as they are */
  bool may_end_without_result; /* where the initial medial mesh is not within epsilon */
  /* The spheres of a certified result with the right topology that another start has; 0: not known yet; NULL: none. */
  const _Atomic size_t *rival_count;
  qmat_surface *surface;
  qmat_topology solid;                /* of the solid; not known for every input */
  qmat_constraint_points constraints; /* of `dense` */
  qmat_decimation dense;              /* the start of each round */
  /* Three places: for the newest round, which repairs replace, for the round that it continues, and a free one. */
  qmat_constraint_points round_constraints[3];
  qmat_decimation rounds[3];
  qmat_arena round_memory[3];
  int newest, base;        /* the places of the first two */
  double share;            /* of the error: what rounds use */
  qmat_copy_depths depths; /* of the copies of rounds */
} qmat_simplification;

/* A result so far, in the unit frame; `medial` is NULL where there is none. `fault` is its largest error, at least
 * epsilon. */
typedef struct qmat_simplified {
  qmat_medial *medial; /* unsealed; the caller releases it */
  qmat_simplify_figures figures;
  double fault;
  bool within_epsilon;     /* whether both errors are within epsilon, as far as measured */
  bool has_right_topology; /* whether its Betti numbers are the solid's, as far as known */
} qmat_simplified;

/* Measures both errors of a medial mesh (unit frame): the extract of the newest round, or that after edits. Where both
 * errors are bounded, `errors->envelope_to_surface` is the bound that the round keeps if that is within epsilon; it
 * leaves out what edits have added. `errors` also gets the places beyond epsilon; free with qmat_medial_errors_uninit,
 * also after a failure. With `only_within` measuring ends with the first error above epsilon; one that is not measured
 * then is 0, or INFINITY where the search ended early. QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads. */
qmat_status qmat_simplification_measure(const qmat_simplification *simplification, const qmat_medial *unit,
                                        bool only_within, qmat_medial_errors *errors);

/* The part of that which sets `errors->envelope_to_surface`. */
qmat_status qmat_simplification_measure_envelope(const qmat_simplification *simplification, const qmat_medial *unit,
                                                 qmat_medial_errors *errors);

/* Whether `a` is better: first by its fault, then by its topology, then by its number of spheres. */
bool qmat_simplified_is_better(const qmat_simplified *a, const qmat_simplified *b);

/* Frees what a simplification has made; the caller keeps the inputs. */
void qmat_simplification_uninit(qmat_simplification *simplification);
void qmat_simplified_uninit(qmat_simplified *result);

#endif
