/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_ORDERED_COLLAPSE_H
#define QMAT_NODES_SIMPLIFY_ORDERED_COLLAPSE_H

#include "nodes/simplify/simplify_setup.h"

/* Collapses that do not depend on epsilon, and their result. */
typedef struct qmat_ordered_collapses {
  qmat_simplify_params params; /* with what compat sets */
  qmat_surface *surface;
  qmat_initial_medial initial;
  qmat_constraint_points constraints;
  qmat_decimation decimation;
} qmat_ordered_collapses;

/* Does these collapses. Inputs and statuses are those of qmat_simplify_prepare. Free with
 * qmat_ordered_collapses_uninit, also after a failure. */
qmat_status qmat_ordered_collapses_run(qmat_context *context, const qmat_simplify_params *params,
                                       const qmat_value *const inputs[], qmat_ordered_collapses *collapses);
void qmat_ordered_collapses_uninit(qmat_ordered_collapses *collapses);

#endif
