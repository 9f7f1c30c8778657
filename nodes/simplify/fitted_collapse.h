/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_FITTED_COLLAPSE_H
#define QMAT_NODES_SIMPLIFY_FITTED_COLLAPSE_H

#include "nodes/simplify/collapse_test.h"

/* Tries the newest preview, of `edge`, with a sphere that is fitted to the surface from the best candidate, then with
 * the candidates themselves where their error is small. `*result` allows `sphere`, if any. QMAT_ERROR_MEMORY. */
qmat_status qmat_decimation_try_fitted(qmat_decimation *decimation, uint32_t edge, const qmat_candidates *candidates,
                                       double sphere[4], qmat_collapse_outcome *result);

/* After qmat_decimation_try_fitted was refused: tries the same collapse with further fits, unless a midpoint outside of
 * the model refused it. The first fit moves its sphere alone, where the error was within qmat_test_ratio. The second
 * also moves the spheres around it, where all are at most QMAT_COLLAPSE_SPHERES and the error was within
 * qmat_neighbourhood_ratio. Where `*result` allows the collapse, all of these are in place, and it is the newest
 * preview and test; else nothing has changed. QMAT_ERROR_MEMORY. */
qmat_status qmat_decimation_try_neighbourhoods(qmat_decimation *decimation, uint32_t edge,
                                               qmat_collapse_outcome *result);

/* Tries to bring a constraint point within its limit by fits of `vertex` and, unless `alone`, its neighbours. Where
 * `*result` allows it, all of these are in place, and the move of `vertex` is the newest preview and test; else nothing
 * has changed. QMAT_ERROR_MEMORY. */
qmat_status qmat_decimation_try_move(qmat_decimation *decimation, uint32_t vertex, size_t point, bool alone,
                                     qmat_collapse_outcome *result);

/* Takes the neighbourhood of the newest qmat_decimation_try_neighbourhoods back that was allowed. */
void qmat_decimation_restore_neighbourhood(qmat_decimation *decimation);

#endif
