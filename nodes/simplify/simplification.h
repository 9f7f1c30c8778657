/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_SIMPLIFICATION_H
#define QMAT_NODES_SIMPLIFY_SIMPLIFICATION_H

#include "nodes/simplify/simplification_state.h"

/* Reads the inputs. They and the statuses are those of qmat_simplify_prepare. The caller has given `simplification` its
 * context and parameters, and frees it with qmat_simplification_uninit, also after a failure. All threads. */
qmat_status qmat_simplification_prepare(qmat_simplification *simplification, const qmat_value *const inputs[]);

/* Runs all passes of a prepared simplification with on_exceed=skip. `best` gets the result; free it with
 * qmat_simplified_uninit, also after a failure. QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads. */
qmat_status qmat_simplification_run(qmat_simplification *simplification, qmat_simplified *best);

#endif
