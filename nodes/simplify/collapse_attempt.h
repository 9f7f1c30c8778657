/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_COLLAPSE_ATTEMPT_H
#define QMAT_NODES_SIMPLIFY_COLLAPSE_ATTEMPT_H

#include "nodes/simplify/collapse_test.h"

/* Sets the cost of an edge in the heap to that of its best candidate; the caller moves it to its place. One thread, but
 * any number where the order of costs takes no preview. QMAT_ERROR_MEMORY. */
qmat_status qmat_decimation_set_cost(qmat_decimation *decimation, uint32_t edge);

/* Tries the candidates of an edge, best first, then, while spheres are fitted, fitted ones. Where `*result` allows the
 * collapse, `sphere` (4 doubles) is the first that passes all tests, ready for qmat_decimation_commit, and a jointly
 * fitted neighbourhood is in place. Otherwise only the facts about the edge (failed_points, needed, fitted_errors), the
 * counts of refusals and scratch have changed. QMAT_ERROR_MEMORY. One thread. */
qmat_status qmat_decimation_attempt(qmat_decimation *decimation, uint32_t edge, double sphere[4],
                                    qmat_collapse_outcome *result);

#endif
