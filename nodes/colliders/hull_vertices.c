/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/hull_vertices.h"

#include <string.h>

size_t qmat_hull_vertices_keep(double *points, size_t count, const uint32_t *triangles, size_t triangle_count,
                               uint8_t *is_vertex) {
  size_t kept = 0;
  memset(is_vertex, 0, count * sizeof *is_vertex);
  for (size_t i = 0; i < 3 * triangle_count; i++) is_vertex[triangles[i]] = 1;
  for (size_t i = 0; i < count; i++)
    if (is_vertex[i]) memmove(&points[3 * kept++], &points[3 * i], 3 * sizeof *points);
  return kept;
}
