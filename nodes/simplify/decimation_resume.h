/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_DECIMATION_RESUME_H
#define QMAT_NODES_SIMPLIFY_DECIMATION_RESUME_H

#include "nodes/simplify/decimation_state.h"

/* What is left, renumbered in the order of the initial medial mesh, still in the unit frame, with the samples that each
 * sphere answers for. `medial` is new and unsealed. QMAT_ERROR_MEMORY. */
qmat_status qmat_decimation_extract(const qmat_decimation *decimation, qmat_medial *medial);

/* Goes on in `to` where `from` stopped: with `left`, what qmat_decimation_extract gives of it, with the quadrics,
 * bounds and witnesses that it has. Spheres may have been added behind it, joined by edges, and there may be `extra`
 * places. `to` has context, surface and rules; `constraints` gets its constraint points and has to live as long. `from`
 * stays as it is. QMAT_ERROR_MEMORY, QMAT_CANCELLED. Cost: linear. */
qmat_status qmat_decimation_resume(const qmat_decimation *from, const qmat_medial *left, const qmat_extra_points *extra,
                                   qmat_constraint_points *constraints, qmat_decimation *to);

#endif
