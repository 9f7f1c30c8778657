/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_COPIES_H
#define QMAT_NODES_SIMPLIFY_COPIES_H

#include "nodes/simplify/decimation.h"
#include "nodes/simplify/lookahead.h"

/* Depths that the copies know, kept from run to run: the first is for the first copy that the caller does not see. */
typedef struct qmat_copy_depths {
  qmat_depth_lattice lattices[QMAT_MOST_COPIES - 1];
} qmat_copy_depths;

void qmat_copy_depths_uninit(qmat_copy_depths *depths);

/* Sets up `to` as qmat_decimation_resume does, and runs it with copies (lookahead.h): one a thread, at most
 * QMAT_MOST_COPIES. A repair runs alone. `lattice` gives `to` its known depths while it runs. Statuses as both. */
qmat_status qmat_decimation_run_copies(const qmat_decimation *from, const qmat_medial *left,
                                       const qmat_extra_points *extra, qmat_depth_lattice *lattice,
                                       qmat_copy_depths *depths, qmat_constraint_points *constraints,
                                       qmat_decimation *to);

#endif
