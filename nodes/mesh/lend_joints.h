/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_LEND_JOINTS_H
#define QMAT_NODES_MESH_LEND_JOINTS_H

#include "core/context.h"
#include "core/value.h"

/* Gives each vertex of an unsealed mesh the joints and weights of the nearest vertex of `given`, both in the same
 * units. Nothing is done where `given` has no skin. The mesh owns its new arrays, also on failure. QMAT_ERROR_MEMORY,
 * QMAT_CANCELLED. One thread. Cost: linear where the vertices of `given` are spread evenly. */
qmat_status qmat_lend_joints(qmat_context *context, const qmat_mesh *given, qmat_mesh *mesh);

#endif
