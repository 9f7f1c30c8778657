/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/page/error_detail.h"

#include <math.h>
#include <string.h>

#include "core/geometry/triangle.h"
#include "core/key_table.h"

static const double longest = 1.0 / 16, shortest = 1.0 / 256;
enum { MOST_TRIANGLES = 40000, MOST_ROUNDS = 8 };

/* The edges of a display mesh, each once. Arrays of `count`, or 3 for each triangle. */
typedef struct edge_list {
  uint32_t *ends;    /* 2 each */
  uint32_t *sides;   /* the edges of each triangle: side k is between corners k and k + 1 */
  uint32_t *middles; /* the vertex that halves an edge, or QMAT_NO_ID */
  double *errors;    /* at the middle of each */
  size_t count;
} edge_list;

static qmat_status list_edges(qmat_context *context, const qmat_display_mesh *display, qmat_key_table *table,
                              edge_list *edges) {
  const size_t corners = 3 * display->triangle_count;
  *edges = (edge_list){.ends = qmat_arena_alloc(&context->arena, corners, 2 * sizeof *edges->ends),
                       .sides = qmat_arena_alloc(&context->arena, corners, sizeof *edges->sides),
                       .middles = qmat_arena_alloc(&context->arena, corners, sizeof *edges->middles),
                       .errors = qmat_arena_alloc(&context->arena, corners, sizeof *edges->errors)};
  if (!edges->ends || !edges->sides || !edges->middles || !edges->errors || qmat_key_table_init(table, corners))
    return qmat_fail_memory(context, "the surface to draw");
  for (size_t i = 0; i < corners; i++) {
    const uint32_t a = display->triangles[i], b = display->triangles[i % 3 == 2 ? i - 2 : i + 1];
    const uint32_t low = a < b ? a : b, high = a < b ? b : a;
    const uint64_t key = (uint64_t)low << 32 | high;
    uint32_t id = qmat_key_table_id(table, key);
    if (id == QMAT_NO_ID) {
      qmat_key_slot *slot = qmat_key_table_add(table, key);
      if (!slot) return qmat_fail_memory(context, "the surface to draw");
      id = slot->id = (uint32_t)edges->count;
      edges->ends[2 * edges->count] = low;
      edges->ends[2 * edges->count++ + 1] = high;
    }
    edges->sides[i] = id;
  }
  return QMAT_OK;
}

/* Whether to halve an edge; sets the error at its middle. Both facets at an edge decide alike, also where each has
 * vertices of its own there. */
static bool is_halved(const qmat_display_mesh *display, const qmat_envelope *envelope, double tolerance,
                      const uint32_t ends[2], double *error) {
  const double *a = &display->positions[3 * (size_t)ends[0]], *b = &display->positions[3 * (size_t)ends[1]];
  const double length = qmat_point_distance(a, b);
  if (!(length > shortest)) return false;
  const double middle[3] = {0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2])};
  *error = qmat_envelope_distance(envelope, middle, NULL);
  return length > longest || fabs(*error - 0.5 * (display->errors[ends[0]] + display->errors[ends[1]])) > tolerance;
}

static qmat_status measure_middles(qmat_context *context, const qmat_display_mesh *display,
                                   const qmat_envelope *envelope, double tolerance, edge_list *edges) {
  const int threads = qmat_threads(context);
  const size_t slice = 1 << 12;
  for (size_t first = 0; first < edges->count; first += slice) {
    const qmat_status status = qmat_progress(context, first, edges->count, "edges measured");
    if (status != QMAT_OK) return status;
    const size_t last = first + slice < edges->count ? first + slice : edges->count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 64)
    for (size_t e = first; e < last; e++)
      edges->middles[e] =
          is_halved(display, envelope, tolerance, &edges->ends[2 * e], &edges->errors[e]) ? 0 : QMAT_NO_ID;
  }
  return QMAT_OK;
}

/* Numbers the middles from `first`, which gets the number of vertices. Returns the number of triangles to come. */
static size_t number_middles(const qmat_display_mesh *display, edge_list *edges, size_t *first) {
  for (size_t e = 0; e < edges->count; e++)
    if (edges->middles[e] != QMAT_NO_ID) edges->middles[e] = (uint32_t)(*first)++;
  size_t triangles = display->triangle_count;
  for (size_t i = 0; i < 3 * display->triangle_count; i++) triangles += edges->middles[edges->sides[i]] != QMAT_NO_ID;
  return triangles;
}

/* The vertex between two others: its normal is theirs. */
static void set_middle(const qmat_display_mesh *from, const uint32_t ends[2], double error, size_t vertex,
                       qmat_display_mesh *to) {
  for (int k = 0; k < 3; k++) {
    const size_t a = 3 * (size_t)ends[0] + (size_t)k, b = 3 * (size_t)ends[1] + (size_t)k;
    to->positions[3 * vertex + (size_t)k] = 0.5 * (from->positions[a] + from->positions[b]);
    to->normals[3 * vertex + (size_t)k] = 0.5 * (from->normals[a] + from->normals[b]);
  }
  qmat_normalize(&to->normals[3 * vertex]);
  to->errors[vertex] = error;
}

static qmat_status halve(qmat_context *context, const edge_list *edges, size_t vertex_count, size_t triangle_count,
                         qmat_display_mesh *display) {
  qmat_arena *arena = &context->arena;
  qmat_display_mesh made = {.vertex_count = vertex_count,
                            .positions = qmat_arena_alloc(arena, vertex_count, 3 * sizeof(double)),
                            .normals = qmat_arena_alloc(arena, vertex_count, 3 * sizeof(double)),
                            .errors = qmat_arena_alloc(arena, vertex_count, sizeof(double)),
                            .triangles = qmat_arena_alloc(arena, triangle_count, 3 * sizeof(uint32_t))};
  if (!made.positions || !made.normals || !made.errors || !made.triangles)
    return qmat_fail_memory(context, "the surface to draw");
  memcpy(made.positions, display->positions, 3 * display->vertex_count * sizeof(double));
  memcpy(made.normals, display->normals, 3 * display->vertex_count * sizeof(double));
  memcpy(made.errors, display->errors, display->vertex_count * sizeof(double));
  for (size_t e = 0; e < edges->count; e++)
    if (edges->middles[e] != QMAT_NO_ID)
      set_middle(display, &edges->ends[2 * e], edges->errors[e], edges->middles[e], &made);
  for (size_t t = 0; t < display->triangle_count; t++) {
    uint32_t middles[3], pieces[12];
    for (size_t k = 0; k < 3; k++) middles[k] = edges->middles[edges->sides[3 * t + k]];
    const size_t count = qmat_triangle_divide(&display->triangles[3 * t], middles, pieces);
    memcpy(&made.triangles[3 * made.triangle_count], pieces, 3 * count * sizeof *pieces);
    made.triangle_count += count;
  }
  *display = made;
  return QMAT_OK;
}

qmat_status qmat_display_mesh_refine(qmat_context *context, const qmat_envelope *envelope, double tolerance,
                                     qmat_display_mesh *display) {
  for (int round = 0; round < MOST_ROUNDS; round++) {
    qmat_key_table table = {0};
    edge_list edges;
    qmat_status status = list_edges(context, display, &table, &edges);
    qmat_key_table_uninit(&table);
    if (status == QMAT_OK) status = measure_middles(context, display, envelope, tolerance, &edges);
    if (status != QMAT_OK) return status;
    size_t vertices = display->vertex_count;
    const size_t triangles = number_middles(display, &edges, &vertices);
    if (triangles == display->triangle_count || triangles > MOST_TRIANGLES) return QMAT_OK;
    status = halve(context, &edges, vertices, triangles, display);
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}
