/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_CROSSINGS_CGAL_H
#define QMAT_NODES_MESH_CROSSINGS_CGAL_H

#include "core/context.h"
#include "nodes/mesh/shells.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Sets crosses[t] (zeroed, triangle_count) to 1 for triangles that meet another of their patch with which they share no
 * edge, beyond a shared vertex. All triangles need a shell. QMAT_ERROR_MEMORY, QMAT_ERROR_DEPENDENCY, QMAT_CANCELLED.
 * One thread. Cost: n log n, a microsecond or two per triangle. */
qmat_status qmat_find_crossings(qmat_context *context, const qmat_shells *shells, uint8_t *crosses);

#ifdef __cplusplus
}
#endif

#endif
