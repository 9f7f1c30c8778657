/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_SEAMS_H
#define QMAT_NODES_MESH_SEAMS_H

#include "nodes/mesh/parts.h"

/* Divides a mesh as qmat_parts_find does, with its seams closed. At a seam two border edges run along each other in
 * opposite directions, with ends at most `tolerance` apart (0: there are no seams), as between the halves of a mirrored
 * model. Two triangles join them; no vertex moves. They stay where they make solids of sheets, or one closed solid of
 * open ones; where no more border is left open than is closed; and where the solid is much thicker than the seam is
 * wide, which two near sheets are not. `parts->triangles` are the given ones, then those in seams. Arguments, statuses
 * and threads as for qmat_parts_find. Cost: up to three divisions, and a sweep over the border edges. */
qmat_status qmat_parts_find_with_seams(qmat_context *context, size_t vertex_count, const double *positions,
                                       size_t triangle_count, const uint32_t *triangles, double tolerance,
                                       qmat_parts *parts);

#endif
