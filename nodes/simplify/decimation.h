/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_DECIMATION_H
#define QMAT_NODES_SIMPLIFY_DECIMATION_H

#include "nodes/simplify/decimation_state.h"

/* Sets up the quadrics, the crease guard, the heap and both error trackers of a complex. The caller has made `complex`
 * (unit frame) and given context, rules, surface and `sheet_vertices`; `locked` is NULL or given. Where `quadrics` are
 * given, they and the crease guard stay as they are. The caller keeps `constraints`. A surface point whose initial
 * distance exceeds the limit has this distance as its limit. `depths`: per vertex. All memory is in the context's
 * arena, except what qmat_decimation_uninit frees, also after a failure. QMAT_ERROR_MEMORY, QMAT_CANCELLED. All
 * threads. */
qmat_status qmat_decimation_init(qmat_decimation *decimation, const qmat_constraint_points *constraints,
                                 const double *depths);
void qmat_decimation_uninit(qmat_decimation *decimation);

/* Collapses edges until the heap is empty or the rules end it; then `*ended` is true. QMAT_ERROR_MEMORY,
 * QMAT_CANCELLED. One thread. */
qmat_status qmat_decimation_collapse_edges(qmat_decimation *decimation, bool *ended);

/* Collapses edges, with QMAT_EXCEED_SKIP, and fits spheres until the rules allow no more. QMAT_ERROR_MEMORY,
 * QMAT_CANCELLED. One thread. */
qmat_status qmat_decimation_run(qmat_decimation *decimation);

#endif
