/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_SIMPLIFICATION_H
#define QMAT_NODES_SIMPLIFY_SIMPLIFICATION_H

#include "nodes/simplify/simplification_state.h"

/* Runs all passes for parameters with on_exceed=skip. Inputs and statuses are those of qmat_simplify_prepare. `best`
 * gets the result; the caller has given `simplification` its context and parameters, and frees both with
 * qmat_simplification_uninit and qmat_simplified_uninit, also after a failure. All threads. */
qmat_status qmat_simplification_run(qmat_simplification *simplification, const qmat_value *const inputs[],
                                    qmat_simplified *best);

#endif
