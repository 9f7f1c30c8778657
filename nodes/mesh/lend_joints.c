/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/lend_joints.h"

#include <string.h>

#include "core/geometry/point_grid.h"
#include "core/node.h"

qmat_status qmat_lend_joints(qmat_context *context, const qmat_mesh *given, qmat_mesh *mesh) {
  if (given->skinned_count == 0) return QMAT_OK;
  mesh->joints = qmat_alloc(4 * mesh->vertex_count, sizeof *mesh->joints);
  mesh->weights = qmat_alloc(4 * mesh->vertex_count, sizeof *mesh->weights);
  if (!mesh->joints || !mesh->weights) return qmat_fail_memory(context, "the joints of vertices");
  mesh->skinned_count = mesh->vertex_count;
  qmat_point_grid grid;
  qmat_status status = qmat_point_grid_init(context, given->positions, given->vertex_count, &grid);
  for (size_t v = 0; v < mesh->vertex_count && status == QMAT_OK; v++) {
    const size_t nearest = qmat_point_grid_nearest(&grid, mesh->positions + 3 * v);
    memcpy(mesh->joints + 4 * v, given->joints + 4 * nearest, 4 * sizeof *mesh->joints);
    memcpy(mesh->weights + 4 * v, given->weights + 4 * nearest, 4 * sizeof *mesh->weights);
    if (v % 1024 == 0) status = qmat_progress(context, v, mesh->vertex_count, "vertices");
  }
  return status;
}
