/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/thickness.h"

#include <math.h>

double qmat_thickness_threshold(const qmat_field *thickness, double ratio) {
  if (thickness->count == 0) return 0;
  double sum = 0;
  for (size_t i = 0; i < thickness->count; i++) sum += thickness->values[i];
  return ratio * (sum / (double)thickness->count);
}

void qmat_thickness_of_samples(const qmat_mesh *mesh, const qmat_field *thickness, const qmat_samples *samples,
                               double *out) {
  /* A vertex of no facet stays infinitely thick: nothing there is thin. */
  for (size_t i = 0; i < samples->vertex_count; i++) out[i] = INFINITY;
  for (size_t corner = 0; corner < 3 * mesh->triangle_count; corner++) {
    const uint32_t vertex = mesh->triangles[corner];
    if (vertex < samples->vertex_count) out[vertex] = fmin(out[vertex], thickness->values[corner / 3]);
  }
  for (size_t i = samples->vertex_count; i < samples->count; i++) out[i] = thickness->values[samples->facets[i]];
}
