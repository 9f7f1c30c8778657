/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_PARTITIONED_COLLAPSE_H
#define QMAT_NODES_SIMPLIFY_PARTITIONED_COLLAPSE_H

#include "nodes/simplify/decimation.h"

/* Whether the first collapses of a medial mesh can be done in pieces: it is large enough for two, the rules depend on
 * the neighbourhood of a collapse only and not on the order of all, and no sphere of radius zero has to stay, those of
 * sheets aside. */
bool qmat_can_collapse_partitioned(const qmat_decimation_rules *rules, const qmat_complex *complex,
                                   size_t sheet_vertices);

/* Does the first collapses of a dense medial mesh in pieces, down to `qmat_piece_share` of its vertices. The pieces are
 * boxes of space; in each the edges collapse in the order of their costs. Vertices with an edge to another piece stay.
 * Afterwards `decimation` is what qmat_decimation_init makes of the joined medial mesh, with the quadrics, bounds and
 * witnesses of the pieces; qmat_decimation_run does the remaining collapses.
 *
 * The caller has given `decimation` its context, surface and rules (qmat_can_collapse_partitioned), and `complex` (unit
 * frame, unchanged so far), which is replaced. `constraints` are its constraint points. `decimation->constraints`
 * becomes a copy with the witnesses and weights of the result, in the context's arena. `depths`: per vertex of the
 * complex. The partition depends on the medial mesh only, never on threads. QMAT_ERROR_MEMORY, QMAT_CANCELLED; free
 * with qmat_decimation_uninit in any case. All threads. */
qmat_status qmat_collapse_partitioned(qmat_decimation *decimation, const qmat_constraint_points *constraints,
                                      const double *depths);

#endif
