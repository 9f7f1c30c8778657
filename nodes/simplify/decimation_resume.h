/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_DECIMATION_RESUME_H
#define QMAT_NODES_SIMPLIFY_DECIMATION_RESUME_H

#include "nodes/simplify/decimation_state.h"

/* Extracts the present medial mesh in the unit frame: live vertices in the order of the initial medial mesh, with their
 * responsible regions. `medial` is new and unsealed. QMAT_ERROR_MEMORY. */
qmat_status qmat_decimation_extract(const qmat_decimation *decimation, qmat_medial *medial);

/* Continues in `to` where `from` stopped: with `left`, which qmat_decimation_extract made of it, and with its quadrics,
 * bounds and witnesses. `left` may have further spheres at the end, joined by edges, and there may be `extra` points.
 * `to` has context, surface and rules. `constraints` gets its constraint points and has to live as long. `from` stays
 * as it is. QMAT_ERROR_MEMORY, QMAT_CANCELLED. Cost: linear. */
qmat_status qmat_decimation_resume(const qmat_decimation *from, const qmat_medial *left, const qmat_extra_points *extra,
                                   qmat_constraint_points *constraints, qmat_decimation *to);

#endif
