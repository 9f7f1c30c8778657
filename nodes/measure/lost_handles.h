/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_LOST_HANDLES_H
#define QMAT_NODES_MEASURE_LOST_HANDLES_H

#include "core/geometry/surface.h"

/* A handle of a solid, or a hole through it, by the loop around it that was chosen: one whose middle tells that it is
 * lost comes before a shorter one, so place and size depend on the result, not on the solid alone. */
typedef struct qmat_lost_handle {
  double place[3]; /* the middle of the loop, unit frame */
  double size;     /* the loop's length divided by pi: the diameter of a circle as long */
  bool is_hole;    /* the middle lies outside of the solid */
} qmat_lost_handle;

/* Finds handles of the solid that a medial mesh (unit frame) with fewer loops has lost: at most `most`, no two of which
 * are the same handle, those first whose middle is on different sides of surface and envelope, then the thinnest. The
 * loops consist of mesh edges, are at most `longest` long, and bound no part of the surface. `*handles`: `*count` in
 * the context's arena. None are found on a surface with an edge that does not have two triangles, or with more than 32
 * handles. One thread. QMAT_ERROR_MEMORY, QMAT_CANCELLED. Cost: at most 4,096 searches of `longest` around a vertex.
 * Source: Erickson and Whittlesey, "Greedy optimal homotopy and homology generators", SODA 2005, with short loops only.
 */
qmat_status qmat_lost_handles_find(qmat_context *context, const qmat_surface *surface, const qmat_medial *unit,
                                   double longest, size_t most, qmat_lost_handle **handles, size_t *count);

#endif
