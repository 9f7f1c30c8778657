/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/unit_spheres.h"

#include <math.h>

static const double farthest_sphere = 1e6;

qmat_status qmat_unit_spheres(qmat_context *context, const qmat_frame *frame, const qmat_medial *medial,
                              double **spheres) {
  if (medial->sphere_count == 0) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the medial mesh has no sphere");
    return qmat_fail_field(context, "medial");
  }
  *spheres = qmat_arena_alloc(&context->arena, medial->sphere_count, 4 * sizeof **spheres);
  if (!*spheres) return qmat_fail_memory(context, "the medial mesh");
  qmat_frame_spheres_to_unit(frame, medial->spheres, medial->sphere_count, *spheres);
  for (size_t i = 0; i < 4 * medial->sphere_count; i++) {
    if (fabs((*spheres)[i]) <= farthest_sphere) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the sphere is too far away from the mesh, or too large, to belong to it");
    qmat_fail_field(context, "medial");
    return qmat_fail_element(context, "sphere", (int64_t)(i / 4));
  }
  return QMAT_OK;
}
