/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SKIN_SKIN_TOPOLOGY_H
#define QMAT_NODES_SKIN_SKIN_TOPOLOGY_H

#include "core/context.h"

/* The number of components, and V - E + F, of triangles (3 ids below `vertex_count` each) that are a closed 2-manifold.
 * Vertices without triangles do not count. QMAT_ERROR_MEMORY. Nearly linear. */
qmat_status qmat_skin_topology(qmat_context *context, const uint32_t *triangles, size_t triangle_count,
                               size_t vertex_count, size_t *components, int64_t *euler);

#endif
