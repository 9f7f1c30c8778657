/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_OVERLAPS_H
#define QMAT_NODES_MESH_OVERLAPS_H

#include "nodes/mesh/union_cgal.h"

/* The boundary of the union of the shells of a mesh that overlap, cross themselves, or lie in each other. At each edge
 * as many triangles run one way as the other; there are at most 2^32 / 3. `united` is as of qmat_unite_shells; its
 * arrays are the caller's (qmat_free). Sides of blocks that are apart by rounding touch (qmat_square_blocks). A shell
 * that meets only itself stays as it is if it has no walls inside and no fold longer than `longest_fold` (>= 0, in the
 * unit of the positions): every vertex that the union leaves out is so near to the border of its region, and no piece
 * of a triangle that it leaves out has a side above twice that. QMAT_ERROR_MEMORY, QMAT_ERROR_DEPENDENCY,
 * QMAT_CANCELLED. One thread. Cost: n log^2 n with boxes of patches and triangles, and a box test of each two patches
 * whose boxes meet; then that of qmat_unite_shells for the shells that may overlap. */
qmat_status qmat_unite_overlaps(qmat_context *context, size_t vertex_count, const double *positions,
                                size_t triangle_count, const uint32_t *triangles, double longest_fold,
                                qmat_united *united);

#endif
