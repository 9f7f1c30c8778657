/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_PAGE_SKIN_COLOURS_H
#define QMAT_NODES_PAGE_SKIN_COLOURS_H

#include "core/context.h"
#include "core/value.h"

/* Colours the vertices of a skin by the kind of what they lie on: sphere, cone or slab of the medial mesh, in the
 * colours of pages and pictures (nodes/page/look.h). `*colours` gets 4 bytes per vertex, linear RGB and 255, in the
 * context's arena. QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads; the result does not depend on their number. Cost: a
 * query of the envelope per vertex. */
qmat_status qmat_skin_colours(qmat_context *context, const qmat_medial *medial, const qmat_mesh *skin,
                              const uint8_t **colours);

#endif
