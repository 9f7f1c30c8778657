/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/border_split.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/half_edges.h"
#include "core/geometry/vector.h"
#include "nodes/mesh/box_pairs_cgal.h"

/* ---- vertices on edges ---- */

typedef struct split_finder {
  qmat_context *context;
  const double *positions;
  qmat_half_edges edges;
  double tolerance;
  uint32_t *border, *vertices; /* half-edges; their ends */
  size_t border_count, end_count;
  qmat_edge_split *splits; /* on the heap */
  size_t count, capacity;
} split_finder;

static qmat_status fail_shortage(qmat_context *context) {
  return qmat_fail_memory(context, "the borders");
}

static const double *position(const split_finder *f, uint32_t vertex) {
  return f->positions + 3 * (size_t)vertex;
}

static qmat_status find_border(split_finder *f, size_t vertex_count) {
  const qmat_half_edges *e = &f->edges;
  uint8_t *is_border = qmat_arena_calloc(&f->context->arena, vertex_count, 1);
  for (size_t first = 0, last; first < e->count; first = last) {
    last = qmat_edge_last(e, first);
    f->border_count += last - first == 1;
  }
  f->border = qmat_arena_alloc(&f->context->arena, f->border_count, sizeof *f->border);
  f->vertices = qmat_arena_alloc(&f->context->arena, 2 * f->border_count, sizeof *f->vertices);
  if (!is_border || !f->border || !f->vertices) return fail_shortage(f->context);
  f->border_count = 0;
  for (size_t first = 0, last; first < e->count; first = last) {
    last = qmat_edge_last(e, first);
    if (last - first > 1) continue;
    const uint32_t h = e->order[first], ends[2] = {qmat_half_edge_low(e, h), qmat_half_edge_high(e, h)};
    f->border[f->border_count++] = h;
    for (size_t k = 0; k < 2; k++) {
      if (!is_border[ends[k]]) f->vertices[f->end_count++] = ends[k];
      is_border[ends[k]] = 1;
    }
  }
  return QMAT_OK;
}

/* Notes the vertex if it lies on the edge. */
static qmat_status try_vertex(void *data, uint32_t edge, uint32_t number) {
  split_finder *f = data;
  const uint32_t h = f->border[edge], v = f->vertices[number], start = qmat_half_edge_start(&f->edges, h),
                 end = qmat_half_edge_end(&f->edges, h);
  if (v == start || v == end || v == qmat_half_edge_across(&f->edges, h)) return QMAT_OK;
  const double *a = position(f, start), *b = position(f, end), *p = position(f, v);
  double along[3], from[3], at[3];
  qmat_subtract(b, a, along);
  qmat_subtract(p, a, from);
  const double share = qmat_dot(from, along) / qmat_dot(along, along);
  if (!(share > 0 && share < 1)) return QMAT_OK;
  for (size_t k = 0; k < 3; k++) at[k] = a[k] + share * along[k];
  const double distance = qmat_point_distance(p, at);
  if (!(distance <= f->tolerance) ||
      !(fmin(qmat_point_distance(p, a), qmat_point_distance(p, b)) > fmax(f->tolerance, 2 * distance)))
    return QMAT_OK;
  if (f->count == f->capacity && qmat_grow((void **)&f->splits, &f->capacity, f->count + 1, sizeof *f->splits) != 0)
    return fail_shortage(f->context);
  f->splits[f->count++] = (qmat_edge_split){h, v, share, distance};
  return QMAT_OK;
}

static int compare_splits(const void *left, const void *right) {
  const qmat_edge_split *a = left, *b = right;
  if (a->half_edge != b->half_edge) return a->half_edge < b->half_edge ? -1 : 1;
  if (a->share != b->share) return a->share < b->share ? -1 : 1;
  return (a->vertex > b->vertex) - (a->vertex < b->vertex);
}

static qmat_status try_vertices(split_finder *f) {
  double *boxes = qmat_arena_alloc(&f->context->arena, f->border_count, 6 * sizeof *boxes),
         *points = qmat_arena_alloc(&f->context->arena, f->end_count, 6 * sizeof *points);
  if (!boxes || !points) return fail_shortage(f->context);
  for (size_t i = 0; i < 3 * f->border_count; i++) {
    const uint32_t h = f->border[i / 3];
    const double a = position(f, qmat_half_edge_start(&f->edges, h))[i % 3],
                 b = position(f, qmat_half_edge_end(&f->edges, h))[i % 3];
    double *box = boxes + 6 * (i / 3) + i % 3;
    box[0] = fmin(a, b) - f->tolerance;
    box[3] = fmax(a, b) + f->tolerance;
  }
  for (size_t i = 0; i < 6 * f->end_count; i++) points[i] = position(f, f->vertices[i / 6])[i % 3];
  return qmat_find_box_pairs(f->context, boxes, f->border_count, points, f->end_count, try_vertex, f);
}

qmat_status qmat_find_edge_splits(qmat_context *context, size_t vertex_count, const double *positions,
                                  size_t triangle_count, const uint32_t *triangles, double tolerance,
                                  qmat_edge_split **splits, size_t *count) {
  split_finder f = {.context = context, .positions = positions, .tolerance = tolerance};
  qmat_status status = qmat_half_edges_sort(context, vertex_count, triangle_count, triangles, &f.edges);
  if (status == QMAT_OK) status = find_border(&f, vertex_count);
  if (status == QMAT_OK && f.border_count > 0) status = try_vertices(&f);
  *count = 0;
  *splits = qmat_arena_alloc(&context->arena, f.count, sizeof **splits);
  if (status == QMAT_OK && !*splits) status = fail_shortage(context);
  if (status == QMAT_OK && f.count > 0) {
    qsort(f.splits, f.count, sizeof *f.splits, compare_splits);
    memcpy(*splits, f.splits, f.count * sizeof **splits);
    *count = f.count;
  }
  qmat_free(f.splits);
  return status;
}

/* ---- triangles along them ---- */

/* The vertices on a side. */
typedef struct side_splits {
  const qmat_edge_split *at;
  size_t count;
} side_splits;

/* A fan from `apex` to the side from `from` to `to`. A triangle of a sliver that loses a corner is left out. */
static void add_fan(qmat_split_triangles *made, uint32_t from, uint32_t to, side_splits side, uint32_t apex) {
  for (size_t i = 0; i <= side.count; i++) {
    const uint32_t next = i < side.count ? side.at[i].vertex : to;
    uint32_t *row = made->triangles + 3 * made->count;
    row[0] = from;
    row[1] = next;
    row[2] = apex;
    made->count += from != next && next != apex && apex != from;
    from = next;
  }
}

/* Of a triangle whose first side is split. The triangles at its ends are fans to the other sides. */
static void add_fans(qmat_split_triangles *made, const uint32_t corners[3], const side_splits sides[3]) {
  const side_splits inner = {sides[0].at + 1, sides[0].count - 1};
  const uint32_t first = sides[0].at[0].vertex, last = sides[0].at[inner.count].vertex;
  add_fan(made, corners[2], corners[0], sides[2], first);
  if (inner.count > 0) add_fan(made, first, last, (side_splits){inner.at, inner.count - 1}, corners[2]);
  add_fan(made, corners[1], corners[2], sides[1], last);
}

qmat_status qmat_split_edges(qmat_context *context, size_t triangle_count, const uint32_t *triangles,
                             const qmat_edge_split *splits, size_t count, qmat_split_triangles *made) {
  *made = (qmat_split_triangles){.count = 0};
  made->triangles = qmat_arena_alloc(&context->arena, triangle_count + count + 1, 3 * sizeof *made->triangles);
  made->first = qmat_arena_alloc(&context->arena, triangle_count + 1, sizeof *made->first);
  if (!made->triangles || !made->first) return fail_shortage(context);
  size_t next = 0;
  for (size_t t = 0; t < triangle_count; t++) {
    side_splits sides[3];
    size_t k = 0;
    for (size_t i = 0; i < 3; i++) {
      sides[i] = (side_splits){splits + next, 0};
      while (next < count && splits[next].half_edge == 3 * t + i) next++, sides[i].count++;
    }
    while (k < 3 && sides[k].count == 0) k++;
    made->first[t] = made->count;
    const uint32_t *c = triangles + 3 * t;
    if (k == 3)
      memcpy(made->triangles + 3 * made->count++, c, 3 * sizeof *c);
    else
      add_fans(made, (const uint32_t[3]){c[k], c[(k + 1) % 3], c[(k + 2) % 3]},
               (const side_splits[3]){sides[k], sides[(k + 1) % 3], sides[(k + 2) % 3]});
  }
  made->first[triangle_count] = made->count;
  return QMAT_OK;
}
