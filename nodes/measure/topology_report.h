/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_TOPOLOGY_REPORT_H
#define QMAT_NODES_MEASURE_TOPOLOGY_REPORT_H

#include <jansson.h>

#include "core/geometry/surface.h"

/* Adds the topology of a medial mesh and of the solid within `surface` to the report `root`: `components`, `loops` and
 * `voids` (Betti numbers over Z/2) and `euler_characteristic`, and the same keys with the suffix `_of_solid`. A number
 * that is not known has no key: `loops` and `voids` where qmat_topology_of_medial gives up, and all four of the solid
 * where qmat_topology_of_solid does; `topology_of_solid_not_known` then says why. `medial` may be in any frame.
 * QMAT_ERROR_MEMORY. One thread. Cost: that of the two functions. */
qmat_status qmat_topology_report(qmat_context *context, const qmat_medial *medial, const qmat_surface *surface,
                                 json_t *root);

#endif
