/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_DECIMATION_RESUME_H
#define QMAT_NODES_SIMPLIFY_DECIMATION_RESUME_H

#include "nodes/simplify/decimation_state.h"

/* Extracts the present medial mesh in the unit frame: live vertices in the order of the initial medial mesh, with their
 * responsible regions. `medial` is new and unsealed. QMAT_ERROR_MEMORY. */
qmat_status qmat_decimation_extract(const qmat_decimation *decimation, qmat_medial *medial);

/* Sets up `to` to continue from `from`. `left` is the result of qmat_decimation_extract; spheres may have been
 * appended, joined to it by edges. The quadrics, bounds and witnesses of `from` are carried over. `extra` are
 * additional constraint points. The caller has given `to` its context, surface and rules. `constraints` gets all
 * constraint points and has to outlive `to`. `from` is unchanged; several threads may resume it. QMAT_ERROR_MEMORY,
 * QMAT_CANCELLED. Cost: linear. */
qmat_status qmat_decimation_resume(const qmat_decimation *from, const qmat_medial *left, const qmat_extra_points *extra,
                                   qmat_constraint_points *constraints, qmat_decimation *to);

#endif
