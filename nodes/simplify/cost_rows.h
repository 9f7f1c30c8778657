/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_COST_ROWS_H
#define QMAT_NODES_SIMPLIFY_COST_ROWS_H

#include "nodes/simplify/decimation_state.h"

/* How one method orders collapses, and what it collapses an edge to. */
typedef struct qmat_cost_row {
  /* The spheres that an edge may collapse to, best first. QMAT_ERROR_MEMORY. */
  qmat_status (*find)(qmat_decimation *decimation, uint32_t edge, qmat_candidates *candidates);
  /* The cost of a collapse to the best of them; `a` and `b` are the ends of the edge (4 doubles each). */
  double (*cost)(const qmat_decimation *decimation, const qmat_candidates *candidates, const double *a,
                 const double *b);
  bool by_quadrics;   /* candidates have slab quadratic errors: these break ties, and sharp features may replace them */
  bool takes_preview; /* `find` needs the decimation's preview, so that it runs on one thread */
} qmat_cost_row;

/* The row for the rules: slab costs (eq. 6), those of the public Q-MAT code, PMAT (Faraj et al. 2013) or HEM (Sun et
 * al. 2016). */
const qmat_cost_row *qmat_cost_row_of(const qmat_decimation_rules *rules);

#endif
