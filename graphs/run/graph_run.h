/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_RUN_GRAPH_RUN_H
#define QMAT_GRAPHS_RUN_GRAPH_RUN_H

#include "graphs/run/run_step.h"

/* Runs the steps in order, once per plan. Nothing is written; see qmat_run_write. A value is released after its last
 * reader.
 *
 * With a cache, a step whose result is known does not run; its values are loaded only where a running node, an output
 * file or a wanted value needs them. A node runs once per item where it is given lists (run_lists.h); each item has a
 * cache key of its own, and the run continues while any item succeeds.
 *
 * Returns the status of the first step that fails, for a list that of the first item in order. QMAT_CANCELLED when the
 * context's progress function asks to stop. */
qmat_status qmat_run_execute(qmat_context *context, qmat_run *run, const qmat_run_observer *observer);

/* Sets the state of every step without running any. Once per plan, instead of qmat_run_execute. */
void qmat_run_foresee(qmat_run *run);

#endif
