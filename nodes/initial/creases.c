/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/creases.h"

#include <math.h>
#include <string.h>

#include "core/disjoint_sets.h"
#include "core/geometry/half_edges.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector.h"

const double qmat_corner_bend = 45;

static const double RADIANS_PER_DEGREE = QMAT_PI / 180;

static double cosine_of(double degrees) {
  return cos(degrees * RADIANS_PER_DEGREE);
}

static void normal_of(const qmat_mesh *mesh, const double *positions, size_t triangle, double normal[3]) {
  const uint32_t *t = &mesh->triangles[3 * triangle];
  qmat_triangle_area(&positions[3 * (size_t)t[0]], &positions[3 * (size_t)t[1]], &positions[3 * (size_t)t[2]], normal);
}

/* How an edge bends: the angle between the normals of its triangles, and whether the second triangle's opposite corner
 * is below the first triangle. */
typedef struct {
  double angle; /* radians; 0 at degenerate triangles */
  bool is_convex;
} edge_bend;

/* `sides`: both half-edges. */
static edge_bend bend_of(const qmat_mesh *mesh, const double *positions, uint32_t low, const uint32_t sides[2]) {
  double normals[2][3], axis[3], across[3];
  for (int k = 0; k < 2; k++) normal_of(mesh, positions, sides[k] / 3, normals[k]);
  if (qmat_dot(normals[0], normals[0]) == 0 || qmat_dot(normals[1], normals[1]) == 0) return (edge_bend){0};
  qmat_cross(normals[0], normals[1], axis);
  const size_t second = sides[1] / 3, opposite = (sides[1] + 2) % 3;
  const double *apex = &positions[3 * (size_t)mesh->triangles[3 * second + opposite]];
  for (int k = 0; k < 3; k++) across[k] = apex[k] - positions[3 * (size_t)low + (size_t)k];
  return (edge_bend){atan2(sqrt(qmat_dot(axis, axis)), qmat_dot(normals[0], normals[1])),
                     qmat_dot(normals[0], across) < 0};
}

/* Leaves out connected edges with a total length below `shortest`. */
static qmat_status drop_short(qmat_context *context, const double *positions, size_t vertex_count, double shortest,
                              qmat_crease_edges *edges) {
  uint32_t *parent = qmat_sets_new(context, vertex_count);
  double *lengths = qmat_arena_calloc(&context->arena, vertex_count, sizeof *lengths);
  if (!parent || !lengths) return qmat_fail_memory(context, "creases");
  for (size_t e = 0; e < edges->count; e++) qmat_sets_join(parent, edges->ends[2 * e], edges->ends[2 * e + 1]);
  for (size_t e = 0; e < edges->count; e++) {
    const uint32_t *ends = &edges->ends[2 * e];
    lengths[qmat_set_leader(parent, ends[0])] +=
        qmat_point_distance(&positions[3 * (size_t)ends[0]], &positions[3 * (size_t)ends[1]]);
  }
  size_t kept = 0;
  for (size_t e = 0; e < edges->count; e++)
    if (!(lengths[qmat_set_leader(parent, edges->ends[2 * e])] < shortest))
      memmove(&edges->ends[2 * kept++], &edges->ends[2 * e], 2 * sizeof *edges->ends);
  edges->count = kept;
  return QMAT_OK;
}

qmat_status qmat_crease_edges_find(qmat_context *context, const qmat_mesh *mesh, const double *positions, double angle,
                                   double shortest, qmat_crease_edges *edges) {
  const size_t count = 3 * mesh->triangle_count;
  edges->ends = qmat_arena_alloc(&context->arena, count / 2, 2 * sizeof *edges->ends);
  edges->count = 0;
  edges->sharp_share = 0;
  if (!edges->ends) return qmat_fail_memory(context, "creases");
  qmat_half_edges sides;
  qmat_status status = qmat_progress(context, 0, 0, "creases");
  if (status == QMAT_OK)
    status = qmat_half_edges_sort(context, mesh->vertex_count, mesh->triangle_count, mesh->triangles, &sides);
  if (status == QMAT_OK) status = qmat_progress(context, 0, 0, "creases");
  if (status != QMAT_OK) return status;
  const double least_angle = angle * RADIANS_PER_DEGREE;
  double bending = 0, sharp = 0;
  for (size_t i = 0, end; i < count; i = end) {
    end = qmat_edge_last(&sides, i);
    if (end - i != 2) continue;
    const uint32_t low = qmat_half_edge_low(&sides, sides.order[i]), high = qmat_half_edge_high(&sides, sides.order[i]);
    const edge_bend bend = bend_of(mesh, positions, low, &sides.order[i]);
    const double share = bend.angle * qmat_point_distance(&positions[3 * (size_t)low], &positions[3 * (size_t)high]);
    bending += share;
    if (!(bend.angle > least_angle)) continue;
    sharp += share;
    if (!bend.is_convex) continue;
    edges->ends[2 * edges->count] = low;
    edges->ends[2 * edges->count++ + 1] = high;
  }
  edges->sharp_share = bending > 0 ? sharp / bending : 0;
  return drop_short(context, positions, mesh->vertex_count, shortest, edges);
}

/* The edges at each vertex. */
typedef struct {
  const qmat_crease_edges *edges;
  const double *positions;
  size_t stride;
  size_t *starts; /* per vertex, + 1 */
  uint32_t *at;   /* rows of edges */
  uint8_t *used;  /* per edge */
} crease_graph;

static uint32_t other_end(const crease_graph *g, uint32_t edge, uint32_t vertex) {
  const uint32_t *ends = &g->edges->ends[2 * (size_t)edge];
  return ends[0] == vertex ? ends[1] : ends[0];
}

/* Whether a crease ends at the vertex. */
static bool is_corner(const crease_graph *g, uint32_t vertex, double least_cosine) {
  const size_t first = g->starts[vertex], degree = g->starts[vertex + 1] - first;
  if (degree != 2) return degree > 0;
  double along[2][3], square[2];
  for (size_t i = 0; i < 2; i++) {
    const uint32_t next = other_end(g, g->at[first + i], vertex);
    for (size_t k = 0; k < 3; k++)
      along[i][k] = g->positions[g->stride * next + k] - g->positions[g->stride * vertex + k];
    square[i] = qmat_dot(along[i], along[i]);
  }
  return !(-qmat_dot(along[0], along[1]) >= least_cosine * sqrt(square[0] * square[1]));
}

/* Follows a crease from a vertex to the next corner, or around a loop. */
static void follow(crease_graph *g, uint32_t vertex, uint32_t edge, qmat_creases *creases) {
  size_t *end = &creases->starts[creases->count + 1];
  const uint32_t first = vertex;
  *end = creases->starts[creases->count];
  creases->points[(*end)++] = vertex;
  for (;;) {
    g->used[edge] = 1;
    vertex = other_end(g, edge, vertex);
    creases->points[(*end)++] = vertex;
    if (creases->is_corner[vertex] || vertex == first) break;
    const size_t row = g->starts[vertex];
    edge = g->at[row] == edge ? g->at[row + 1] : g->at[row];
  }
  creases->count++;
}

qmat_status qmat_creases_chain(qmat_context *context, const qmat_crease_edges *edges, const double *positions,
                               size_t stride, size_t vertex_count, qmat_creases *creases) {
  qmat_arena *arena = &context->arena;
  crease_graph g = {.edges = edges, .positions = positions, .stride = stride};
  g.starts = qmat_arena_calloc(arena, vertex_count + 2, sizeof *g.starts);
  g.at = qmat_arena_alloc(arena, edges->count, 2 * sizeof *g.at);
  g.used = qmat_arena_calloc(arena, edges->count, 1);
  *creases = (qmat_creases){.starts = qmat_arena_calloc(arena, edges->count + 1, sizeof *creases->starts),
                            .points = qmat_arena_alloc(arena, edges->count, 2 * sizeof *creases->points),
                            .is_corner = qmat_arena_calloc(arena, vertex_count, 1)};
  if (!g.starts || !g.at || !g.used || !creases->starts || !creases->points || !creases->is_corner)
    return qmat_fail_memory(context, "creases");
  for (size_t i = 0; i < 2 * edges->count; i++) g.starts[edges->ends[i] + 2]++;
  for (size_t v = 0; v < vertex_count; v++) g.starts[v + 2] += g.starts[v + 1];
  for (size_t i = 0; i < 2 * edges->count; i++) g.at[g.starts[edges->ends[i] + 1]++] = (uint32_t)(i / 2);
  const double least_cosine = cosine_of(qmat_corner_bend);
  for (size_t v = 0; v < vertex_count; v++) creases->is_corner[v] = is_corner(&g, (uint32_t)v, least_cosine);
  for (int loops = 0; loops < 2; loops++)
    for (size_t v = 0; v < vertex_count; v++) {
      if (!creases->is_corner[v] && !loops) continue;
      for (size_t i = g.starts[v]; i < g.starts[v + 1]; i++)
        if (!g.used[g.at[i]]) follow(&g, (uint32_t)v, g.at[i], creases);
    }
  return QMAT_OK;
}
