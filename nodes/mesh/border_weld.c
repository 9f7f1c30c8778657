/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/border_weld.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/disjoint_sets.h"
#include "core/geometry/half_edges.h"
#include "core/geometry/vector.h"

/* A border vertex and its place along qmat_border_direction. */
typedef struct border_vertex {
  double along;
  uint32_t vertex;
} border_vertex;

static int compare(const void *left, const void *right) {
  const border_vertex *a = left, *b = right;
  if (a->along != b->along) return a->along < b->along ? -1 : 1;
  return (a->vertex > b->vertex) - (a->vertex < b->vertex);
}

qmat_status qmat_weld_borders(qmat_context *context, size_t vertex_count, const double *positions,
                              size_t triangle_count, const uint32_t *triangles, double tolerance,
                              qmat_border_weld *weld) {
  *weld = (qmat_border_weld){.merged = 0};
  qmat_half_edges e;
  qmat_status status = qmat_half_edges_sort(context, vertex_count, triangle_count, triangles, &e);
  if (status != QMAT_OK) return status;
  uint32_t *sets = qmat_sets_new(context, vertex_count);
  uint8_t *is_border = qmat_arena_calloc(&context->arena, vertex_count, 1);
  border_vertex *border = qmat_arena_alloc(&context->arena, vertex_count, sizeof *border);
  weld->triangles = qmat_arena_alloc(&context->arena, 3 * triangle_count, sizeof *weld->triangles);
  if (!sets || !is_border || !border || !weld->triangles) return qmat_fail_memory(context, "the borders");
  for (size_t first = 0, last; first < e.count; first = last) {
    last = qmat_edge_last(&e, first);
    if (last - first > 1) continue;
    is_border[qmat_half_edge_low(&e, e.order[first])] = is_border[qmat_half_edge_high(&e, e.order[first])] = 1;
  }
  size_t count = 0;
  for (uint32_t v = 0; v < vertex_count; v++)
    if (is_border[v]) border[count++] = (border_vertex){qmat_dot(qmat_border_direction, positions + 3 * (size_t)v), v};
  qsort(border, count, sizeof *border, compare);
  for (size_t i = 0; i < count; i++) {
    const double *p = positions + 3 * (size_t)border[i].vertex;
    for (size_t k = i + 1; k < count && border[k].along - border[i].along <= tolerance; k++)
      if (qmat_point_distance(p, positions + 3 * (size_t)border[k].vertex) <= tolerance)
        weld->merged += qmat_sets_join(sets, border[i].vertex, border[k].vertex);
    if (i % 1024 == 0) status = qmat_progress(context, i, count, "border vertices");
    if (status != QMAT_OK) return status;
  }
  if (weld->merged == 0) return QMAT_OK;
  for (size_t t = 0; t < triangle_count; t++) {
    uint32_t *to = weld->triangles + 3 * weld->triangle_count;
    for (size_t k = 0; k < 3; k++) {
      const uint32_t v = triangles[3 * t + k];
      to[k] = qmat_set_leader(sets, v);
      weld->moved = fmax(weld->moved, qmat_point_distance(positions + 3 * (size_t)v, positions + 3 * (size_t)to[k]));
    }
    weld->triangle_count += to[0] != to[1] && to[1] != to[2] && to[2] != to[0];
  }
  return QMAT_OK;
}
