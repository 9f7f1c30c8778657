/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLAPSE_TRIAL_H
#define QMAT_NODES_COLLAPSE_TRIAL_H

#include "nodes/simplification.h"

/* What trying a collapse works on. Nothing but scratch changes, so that trials on tools of their own may run side by
 * side. */
typedef struct qmat_trial_tools {
  qmat_context *context;
  qmat_complex *complex;
  qmat_coverage *coverage;
  qmat_protrusion *protrusion;
  qmat_sphere_fit *fit;
  qmat_collapse *collapse; /* the preview of what is tried */
} qmat_trial_tools;

typedef enum { QMAT_TRIAL_DONE, QMAT_TRIAL_REFUSED, QMAT_TRIAL_EXCEEDED } qmat_trial_outcome;

/* What came of a trial. */
typedef struct qmat_trial {
  qmat_trial_outcome outcome;
  double sphere[4];      /* of QMAT_TRIAL_DONE: what the edge collapses to */
  double asked;          /* of the others: no less has to be held, as far as is known */
  double fitted_error;   /* of the sphere that was fitted; 0 where none was */
  uint32_t failed_point; /* the control point that refused last, or QMAT_NONE */
  size_t refused_by_surface, refused_by_coverage, refused_by_protrusion;
} qmat_trial;

/* The tools that belong to `simplification` itself: what a trial with them leaves there may be committed. */
qmat_trial_tools qmat_trial_tools_of(qmat_simplification *simplification);

/* Whether the newest preview may be done with this sphere (4 doubles): inside the model, and both errors within what is
 * held. `first` is the control point to try first, or QMAT_NONE. Sets the outcome of `trial` and adds to its counts;
 * `*asked` becomes no more than what would have to be held. QMAT_ERROR_MEMORY. */
qmat_status qmat_trial_test_sphere(const qmat_simplification *simplification, const qmat_trial_tools *tools,
                                   const double sphere[4], uint32_t first, qmat_trial *trial, double *asked);

/* What `edge` may collapse to by the cost that the rules name. May preview it. QMAT_ERROR_MEMORY. */
qmat_status qmat_trial_candidates(const qmat_simplification *simplification, const qmat_trial_tools *tools,
                                  uint32_t edge, qmat_candidates *candidates);

/* Tries the candidates of the newest preview in turn (sections 3.1.2 and 3.4), or, where spheres are fitted and the
 * candidates are not `bound` to a place, the best of them fitted to the surface, and starts `*trial` with that.
 * QMAT_ERROR_MEMORY. */
qmat_status qmat_trial_run(const qmat_simplification *simplification, const qmat_trial_tools *tools,
                           const qmat_candidates *candidates, bool bound, qmat_trial *trial);

#endif
