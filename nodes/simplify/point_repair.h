/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_POINT_REPAIR_H
#define QMAT_NODES_SIMPLIFY_POINT_REPAIR_H

#include "nodes/simplify/decimation_state.h"

/* Frees the places. */
void qmat_failed_places_uninit(qmat_failed_places *failed);

/* Moves spheres so that the newest constraint points come within their limits. For each point that exceeds its limit,
 * every sphere of its witness is fitted alone, then each jointly with its neighbours, until a fit succeeds; all other
 * constraint points stay within their limits. Points near several of `decimation->failed_places`, which must not be
 * NULL, are passed over; a point that no fit repairs becomes one of them. QMAT_ERROR_MEMORY, QMAT_CANCELLED. One
 * thread. Cost: at most six fits a point. */
qmat_status qmat_decimation_repair(qmat_decimation *decimation);

/* Lifts the limits of the newest constraint points that exceed them, here and in `constraints`, which are those of the
 * decimation. QMAT_ERROR_MEMORY. */
qmat_status qmat_decimation_drop_exceeded(qmat_decimation *decimation, qmat_constraint_points *constraints);

#endif
