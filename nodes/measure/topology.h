/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_TOPOLOGY_H
#define QMAT_NODES_MEASURE_TOPOLOGY_H

#include "core/geometry/surface.h"
#include "nodes/measure/medial_topology.h"

/* Computes the topology of the solid within a closed and oriented surface. Outward shells bound its components, inward
 * shells its voids, and the genus of either counts its loops. Shells that do not separate inside from outside
 * (contained in another, or without volume) are left out; shells that cross count separately. Not known for an open
 * surface, or with an edge of more than two triangles. Sheets count as simplicial complexes of their own, whatever they
 * touch; closed ones without volume count as the thin solids that they bound, which have no void. Linear but for the
 * tests of each shell's sides. QMAT_ERROR_MEMORY, QMAT_CANCELLED. */
qmat_status qmat_topology_of_solid(qmat_context *context, const qmat_surface *surface, qmat_topology *topology);

#endif
