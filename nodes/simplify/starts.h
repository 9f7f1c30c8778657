/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_STARTS_H
#define QMAT_NODES_SIMPLIFY_STARTS_H

#include "nodes/simplify/simplification.h"

/* Runs all passes from `params->effort` starts, and with features=auto each with and without kept creases; `best` is
 * the best of all results. Greedy collapses end in local optima: starts differ by factors of the costs, drawn by a
 * seed. Several starts run side by side. One that keeps creases is left out where the one without has hardly more
 * spheres than keeping the corners takes (qmat_least_kept). The simplification is prepared and stays as it is; `params`
 * differ from its own at most by epsilon and vertices. Each start has scratch memory of its own. Free `best` with
 * qmat_simplified_uninit, also after a failure. Statuses are those of qmat_simplification_run. All threads. */
qmat_status qmat_simplification_run_starts(const qmat_simplification *prepared, const qmat_simplify_params *params,
                                           qmat_simplified *best);

#endif
