/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/hull_vertices.h"

#include <math.h>
#include <string.h>

#include "core/geometry/triangle.h"
#include "core/geometry/vector.h"

size_t qmat_hull_vertices_keep(double *points, size_t count, const uint32_t *triangles, size_t triangle_count,
                               uint8_t *is_vertex) {
  size_t kept = 0;
  memset(is_vertex, 0, count * sizeof *is_vertex);
  for (size_t i = 0; i < 3 * triangle_count; i++) is_vertex[triangles[i]] = 1;
  for (size_t i = 0; i < count; i++)
    if (is_vertex[i]) memmove(&points[3 * kept++], &points[3 * i], 3 * sizeof *points);
  return kept;
}

size_t qmat_hull_vertices_apart(double *points, size_t count, double distance) {
  size_t kept = 0;
  for (size_t i = 0; i < count; i++) {
    size_t near = 0;
    while (near < kept && qmat_point_distance(&points[3 * near], &points[3 * i]) > distance) near++;
    if (near == kept) memmove(&points[3 * kept++], &points[3 * i], 3 * sizeof *points);
  }
  return kept;
}

void qmat_hull_box(const double *points, size_t count, double low[3], double high[3]) {
  for (int k = 0; k < 3; k++) {
    low[k] = INFINITY;
    high[k] = -INFINITY;
    for (size_t i = 0; i < count; i++) {
      low[k] = fmin(low[k], points[3 * i + (size_t)k]);
      high[k] = fmax(high[k], points[3 * i + (size_t)k]);
    }
  }
}

bool qmat_hull_plane(const double *points, const uint32_t *triangle, double plane[4]) {
  const double *corner = &points[3 * (size_t)triangle[0]];
  double u[3], v[3];
  qmat_subtract(&points[3 * (size_t)triangle[1]], corner, u);
  qmat_subtract(&points[3 * (size_t)triangle[2]], corner, v);
  qmat_cross(u, v, plane);
  if (!(qmat_dot(plane, plane) > 0)) return false;
  qmat_normalize(plane);
  plane[3] = qmat_dot(plane, corner);
  return true;
}

double qmat_hull_volume(const double *points, const uint32_t *triangles, size_t triangle_count) {
  const double *origin = &points[3 * (size_t)triangles[0]];
  double volume = 0;
  for (size_t i = 0; i < triangle_count; i++) {
    const double *corners[3];
    for (size_t k = 0; k < 3; k++) corners[k] = &points[3 * (size_t)triangles[3 * i + k]];
    volume += qmat_triangle_six_volumes(corners[2], corners[0], corners[1], origin) / 6;
  }
  return volume;
}
