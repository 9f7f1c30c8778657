/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/thickness.h"

#include <math.h>

#include "core/geometry/sheets.h"

qmat_status qmat_thickness_check_field(qmat_context *context, const qmat_mesh *mesh, const qmat_field *thickness) {
  if (thickness->domain == QMAT_PER_FACET && thickness->count == mesh->triangle_count) return QMAT_OK;
  qmat_fail(context, QMAT_ERROR_GEOMETRY, "%zu values per %s do not fit a mesh of %zu facets", thickness->count,
            thickness->domain == QMAT_PER_FACET ? "facet" : "vertex", mesh->triangle_count);
  return qmat_fail_field(context, "thickness");
}

qmat_status qmat_thickness_check(qmat_context *context, const qmat_mesh *mesh, const qmat_field *thickness,
                                 const qmat_samples *samples) {
  const qmat_status status = qmat_thickness_check_field(context, mesh, thickness);
  if (status != QMAT_OK) return status;
  if (samples->vertex_count != mesh->vertex_count) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the samples were taken of a mesh with %zu vertices, not %zu",
              samples->vertex_count, mesh->vertex_count);
    return qmat_fail_field(context, "samples");
  }
  for (size_t i = 0; i < samples->count; i++) {
    const bool moved = i < samples->vertex_count && (samples->positions[3 * i] != mesh->positions[3 * i] ||
                                                     samples->positions[3 * i + 1] != mesh->positions[3 * i + 1] ||
                                                     samples->positions[3 * i + 2] != mesh->positions[3 * i + 2]);
    if (!moved && samples->facets[i] < mesh->triangle_count) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the samples were taken of another mesh");
    qmat_fail_field(context, "samples");
    return qmat_fail_element(context, "sample", (int64_t)i);
  }
  return QMAT_OK;
}

double qmat_thickness_threshold(const qmat_mesh *mesh, const qmat_field *thickness, double ratio) {
  const size_t count = qmat_solid_triangle_count(mesh);
  if (count == 0) return 0;
  double sum = 0;
  for (size_t i = 0; i < count; i++) sum += thickness->values[i];
  return ratio * (sum / (double)count);
}

void qmat_thickness_of_samples(const qmat_mesh *mesh, const qmat_field *thickness, const qmat_samples *samples,
                               double *out) {
  /* A vertex without facets has infinite thickness. */
  for (size_t i = 0; i < samples->vertex_count; i++) out[i] = INFINITY;
  for (size_t corner = 0; corner < 3 * mesh->triangle_count; corner++) {
    const uint32_t vertex = mesh->triangles[corner];
    if (vertex < samples->vertex_count) out[vertex] = fmin(out[vertex], thickness->values[corner / 3]);
  }
  for (size_t i = samples->vertex_count; i < samples->count; i++) out[i] = thickness->values[samples->facets[i]];
}
