/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_PAGE_ERROR_DETAIL_H
#define QMAT_NODES_PAGE_ERROR_DETAIL_H

#include "nodes/page/display_mesh.h"

/* Halves edges of a display mesh until its vertices show the errors between them too: a box has only eight vertices of
 * its own. An edge is halved where it is longer than 1/16 of the frame, or where the error at its middle differs by
 * more than `tolerance` (> 0, unit frame) from the mean of its ends'. Edges below 1/256 stay, and all stay where a
 * round would make more than 40,000 triangles. Facets keep their shape and order. `display` has errors; its arrays are
 * replaced by longer ones in the context's arena. QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads; the result does not
 * depend on their number. Cost: a query of the envelope for each edge and round. */
qmat_status qmat_display_mesh_refine(qmat_context *context, const qmat_envelope *envelope, double tolerance,
                                     qmat_display_mesh *display);

#endif
