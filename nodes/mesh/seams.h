/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_SEAMS_H
#define QMAT_NODES_MESH_SEAMS_H

#include "nodes/mesh/parts.h"

/* Divides a mesh as qmat_parts_find does, with its seams closed.
 *
 * Where vertices of a border lie on an edge of a border, at most `tolerance` away, as in T-junctions, the triangle
 * there is split so that it runs along them. Where two border edges run along each other in opposite directions, with
 * ends at most `width` apart, as between the halves of a mirrored model, two triangles join them. 0: there are none. No
 * vertex moves. Both is done where it makes solids of sheets, or one closed solid of open ones; where no more border is
 * left open than is closed; and where the solid is much thicker than the seam is wide, which two near sheets are not.
 *
 * `parts->triangles` are the given ones, those that are split in place of them, then those in seams
 * (`parts->seam_count`). Other arguments, statuses and threads as for qmat_parts_find, and QMAT_ERROR_DEPENDENCY. Cost:
 * up to seven divisions, a sweep over the border edges, and that of qmat_find_edge_splits. */
qmat_status qmat_parts_find_with_seams(qmat_context *context, size_t vertex_count, const double *positions,
                                       size_t triangle_count, const uint32_t *triangles, double width, double tolerance,
                                       qmat_parts *parts);

#endif
