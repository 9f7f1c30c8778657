/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/triangle_cover.h"

#include <math.h>

#include "core/geometry/triangle.h"

/* Whether a point is inside, or as near as `reach`. */
static bool is_covered(const qmat_surface *solids, const double *point, double reach) {
  return (reach > 0 && qmat_surface_distance(solids, point, reach, NULL, NULL) <= reach) ||
         qmat_surface_inside(solids, point);
}

static void interpolate(const double *const corners[3], double a, double b, double point[3]) {
  for (size_t k = 0; k < 3; k++) point[k] = a * corners[0][k] + b * corners[1][k] + (1 - a - b) * corners[2][k];
}

bool qmat_triangle_is_covered(const qmat_surface *solids, const double *const corners[3], double reach,
                              double spacing) {
  enum { MOST = 128 };
  static const double weights[][2] = {{1, 0}, {0, 1}, {0, 0}, {0.5, 0.5}, {0, 0.5}, {0.5, 0}, {1.0 / 3, 1.0 / 3}};
  double point[3];
  for (size_t i = 0; i < sizeof weights / sizeof *weights; i++) {
    interpolate(corners, 0.99 * weights[i][0] + 0.01 / 3, 0.99 * weights[i][1] + 0.01 / 3, point);
    if (!is_covered(solids, point, reach)) return false;
  }
  const qmat_longest_side side = qmat_triangle_longest_side(corners[0], corners[1], corners[2]);
  const double *const turned[3] = {corners[(side.base + 2) % 3], corners[side.base], corners[(side.base + 1) % 3]};
  const int rows = (int)fmin(ceil(side.height / spacing), MOST);
  for (int i = 0; i < rows; i++) {
    const double up = (i + 0.5) / rows;
    const int count = (int)fmin(ceil((1 - up) * side.length / spacing), MOST);
    for (int k = 0; k < count; k++) {
      interpolate(turned, up, (1 - up) * (k + 0.5) / count, point);
      if (!is_covered(solids, point, reach)) return false;
    }
  }
  return true;
}

qmat_status qmat_triangles_find_covered(qmat_context *context, const qmat_surface *solids, const double *positions,
                                        const uint32_t *triangles, size_t count, double reach, double spacing,
                                        uint8_t *covered) {
  enum { SLICE = 512 };
  const int threads = qmat_threads(context);
  for (size_t first = 0; first < count; first += SLICE) {
    const size_t last = count - first < SLICE ? count : first + SLICE;
    const qmat_status status = qmat_progress(context, first, count, "triangles");
    if (status != QMAT_OK) return status;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 64)
    for (size_t t = first; t < last; t++) {
      const double *corners[3];
      for (size_t k = 0; k < 3; k++) corners[k] = positions + 3 * (size_t)triangles[3 * t + k];
      if (!covered[t]) covered[t] = qmat_triangle_is_covered(solids, (const double *const *)corners, reach, spacing);
    }
  }
  return QMAT_OK;
}
