/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SKIN_SKIN_JOINTS_H
#define QMAT_NODES_SKIN_SKIN_JOINTS_H

#include "core/geometry/frame.h"
#include "nodes/skin/skin_triangles.h"

/* Divides the edges of a surface where the weights of joints change, so that it bends as the model does. Between its
 * ends an edge has weights that vary evenly. It is divided where those of the nearest point of `mesh` (sealed, in model
 * units, with joints) differ most, if that difference times the length of the edge exceeds `allowed` (above 0, in the
 * unit of the positions). The surface stays the same set of points; new vertices follow the old ones, and triangles
 * share them. `frame` is that of its positions. Where that makes more than `most` triangles (0: any number), more is
 * allowed, until nothing is divided. On failure the surface is as it was. QMAT_ERROR_MEMORY, QMAT_ERROR_GEOMETRY for
 * 2^32 - 1 vertices or more, QMAT_CANCELLED. Threads are the context's; the result does not depend on them. Cost: a
 * query of the nearest point for each hundredth of the diagonal of all edges. */
qmat_status qmat_skin_divide_at_joints(qmat_context *context, const qmat_mesh *mesh, const qmat_frame *frame,
                                       double allowed, size_t most, qmat_skin_triangles *surface);

#endif
