/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_BOX_PAIRS_CGAL_H
#define QMAT_NODES_MESH_BOX_PAIRS_CGAL_H

#include "core/context.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Is called with the numbers of two boxes that meet. A status other than QMAT_OK ends the search. */
typedef qmat_status qmat_box_visit(void *data, uint32_t a, uint32_t b);

/* Calls `visit` with `data` once, in no order, for each box of `a` and box of `b` that have a point in common. A box is
 * 6 doubles: the least x, y, z, then the largest; counts are below 2^32. `b` NULL: for each two boxes of `a`, the
 * smaller number first. QMAT_ERROR_MEMORY, QMAT_ERROR_DEPENDENCY with CGAL's message, QMAT_CANCELLED, and what `visit`
 * returns. One thread. Cost: n log^2 n, and the calls. Source: Zomorodian, Edelsbrunner 2002, Fast software for box
 * intersections. */
qmat_status qmat_find_box_pairs(qmat_context *context, const double *a, size_t a_count, const double *b, size_t b_count,
                                qmat_box_visit *visit, void *data);

#ifdef __cplusplus
}
#endif

#endif
