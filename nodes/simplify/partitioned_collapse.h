/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_PARTITIONED_COLLAPSE_H
#define QMAT_NODES_SIMPLIFY_PARTITIONED_COLLAPSE_H

#include "nodes/simplify/decimation.h"

/* Whether most collapses of a medial mesh can be done in parts: it is large enough for two, and what a collapse may do
 * depends on what is near it alone, not on the order of all. Without spheres of radius zero that have to stay. */
bool qmat_can_collapse_partitioned(const qmat_decimation_rules *rules, const qmat_complex *complex);

/* Does the first collapses of a dense medial mesh, those of all but a quarter of its vertices, in parts, each by
 * itself: boxes of space, whose edges collapse in the order of their costs. Vertices with an edge to another part stay
 * as they are. What is left is put together again in `simplification`, which is then as qmat_decimation_init makes
 * it, with the quadrics, bounds and witnesses of the parts; the rest is up to qmat_decimation_run.
 *
 * The caller has given `simplification` its context, surface and rules (qmat_can_collapse_partitioned), and `complex`
 * (unit frame, unchanged so far), which is replaced. `constraints` are its constraint points; they get the witnesses
 * and weights of what is left, and stay the caller's. `depths`: per vertex of the complex. How the parts are made
 * depends on the medial mesh alone, never on threads. QMAT_ERROR_MEMORY, QMAT_CANCELLED; free with
 * qmat_decimation_uninit in any case. All threads. */
qmat_status qmat_collapse_partitioned(qmat_decimation *decimation, qmat_constraint_points *constraints,
                                      const double *depths);

#endif
