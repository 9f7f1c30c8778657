/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_UNIT_SPHERES_H
#define QMAT_NODES_MEASURE_UNIT_SPHERES_H

#include "core/geometry/frame.h"
#include "core/value.h"

/* Maps the spheres of a node's input `medial` to the unit frame of its mesh: `*spheres` (4 doubles each) in the
 * context's arena. QMAT_ERROR_GEOMETRY, which names the input and the sphere, where there is none, or where a sphere
 * is so far away or so large (10^6 diagonals) that it cannot belong to the mesh: squares of such lengths lose all
 * digits. QMAT_ERROR_MEMORY. Cost: linear. */
qmat_status qmat_unit_spheres(qmat_context *context, const qmat_frame *frame, const qmat_medial *medial,
                              double **spheres);

#endif
