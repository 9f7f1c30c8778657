/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/page/display_mesh.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"

/* The cosine of 35 degrees. */
static const double crease = 0.81915204428899178968;
/* Normals that agree to this are one. */
static const double same_normal = 1e-3;
enum { MOST_FACETS = 256 };

/* The corners at each vertex, in compressed rows, and the area-weighted normal of each facet. */
typedef struct corner_rows {
  size_t *offsets;
  uint32_t *corners;
  double *normals; /* 3 per facet, not of length 1 */
} corner_rows;

static qmat_status collect_corners(qmat_context *context, const qmat_mesh *mesh, const double *positions,
                                   corner_rows *rows) {
  const size_t count = 3 * mesh->triangle_count;
  rows->offsets = qmat_arena_calloc(&context->arena, mesh->vertex_count + 2, sizeof *rows->offsets);
  rows->corners = qmat_arena_alloc(&context->arena, count, sizeof *rows->corners);
  rows->normals = qmat_arena_alloc(&context->arena, count, sizeof *rows->normals);
  if (!rows->offsets || !rows->corners || !rows->normals) return qmat_fail_memory(context, "the surface to draw");
  for (size_t i = 0; i < count; i++) rows->offsets[mesh->triangles[i] + 2]++;
  for (size_t v = 0; v < mesh->vertex_count; v++) rows->offsets[v + 2] += rows->offsets[v + 1];
  for (size_t i = 0; i < count; i++) rows->corners[rows->offsets[mesh->triangles[i] + 1]++] = (uint32_t)i;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const uint32_t *row = &mesh->triangles[3 * t];
    double u[3], v[3];
    qmat_subtract(&positions[3 * (size_t)row[1]], &positions[3 * (size_t)row[0]], u);
    qmat_subtract(&positions[3 * (size_t)row[2]], &positions[3 * (size_t)row[0]], v);
    qmat_cross(u, v, &rows->normals[3 * t]);
  }
  return QMAT_OK;
}

/* The normal of one corner: of the facets at its vertex that turn by at most the crease angle. */
static void corner_normal(const corner_rows *rows, size_t vertex, size_t facet, double normal[3]) {
  const double *own = &rows->normals[3 * facet];
  const size_t first = rows->offsets[vertex], last = rows->offsets[vertex + 1];
  double sum[3] = {0, 0, 0};
  const double own_length = sqrt(qmat_dot(own, own));
  for (size_t i = first; i < last && last - first <= MOST_FACETS; i++) {
    const double *other = &rows->normals[3 * (size_t)(rows->corners[i] / 3)];
    if (qmat_dot(own, other) < crease * own_length * sqrt(qmat_dot(other, other))) continue;
    for (int k = 0; k < 3; k++) sum[k] += other[k];
  }
  const double length = sqrt(qmat_dot(sum, sum));
  for (int k = 0; k < 3; k++) normal[k] = length > 0 ? sum[k] / length : own_length > 0 ? own[k] / own_length : 0;
}

/* Makes the display vertices of one mesh vertex: one for each distinct normal of its corners. */
static void split_vertex(const corner_rows *rows, const double *positions, size_t vertex, qmat_display_mesh *display) {
  const size_t first = display->vertex_count;
  for (size_t i = rows->offsets[vertex]; i < rows->offsets[vertex + 1]; i++) {
    double normal[3];
    corner_normal(rows, vertex, rows->corners[i] / 3, normal);
    size_t made = first;
    if (display->vertex_count - first > MOST_FACETS) made = display->vertex_count; /* not worth a search */
    while (made < display->vertex_count && qmat_point_distance(normal, &display->normals[3 * made]) > same_normal)
      made++;
    if (made == display->vertex_count) {
      memcpy(&display->positions[3 * made], &positions[3 * vertex], 3 * sizeof *positions);
      memcpy(&display->normals[3 * made], normal, sizeof normal);
      display->vertex_count++;
    }
    display->triangles[rows->corners[i]] = (uint32_t)made;
  }
}

static qmat_status measure(qmat_context *context, const qmat_envelope *envelope, qmat_display_mesh *display) {
  const size_t slice = 1 << 12, count = display->vertex_count;
  const int threads = qmat_threads(context);
  for (size_t first = 0; first < count; first += slice) {
    const qmat_status status = qmat_progress(context, first, count, "vertices measured");
    if (status != QMAT_OK) return status;
    const size_t last = first + slice < count ? first + slice : count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 64)
    for (size_t i = first; i < last; i++)
      display->errors[i] = qmat_envelope_distance(envelope, &display->positions[3 * i], NULL);
  }
  return QMAT_OK;
}

qmat_status qmat_display_mesh_make(qmat_context *context, const qmat_mesh *mesh, const qmat_frame *frame,
                                   const qmat_envelope *envelope, qmat_display_mesh *display) {
  qmat_arena *arena = &context->arena;
  const size_t corners = 3 * mesh->triangle_count;
  *display = (qmat_display_mesh){.triangle_count = mesh->triangle_count};
  double *positions = qmat_arena_alloc(arena, mesh->vertex_count, 3 * sizeof *positions);
  display->positions = qmat_arena_alloc(arena, corners, 3 * sizeof *display->positions);
  display->normals = qmat_arena_alloc(arena, corners, 3 * sizeof *display->normals);
  display->triangles = qmat_arena_alloc(arena, corners, sizeof *display->triangles);
  if (envelope) display->errors = qmat_arena_alloc(arena, corners, sizeof *display->errors);
  if (!positions || !display->positions || !display->normals || !display->triangles || (envelope && !display->errors))
    return qmat_fail_memory(context, "the surface to draw");
  qmat_frame_to_unit(frame, mesh->positions, mesh->vertex_count, positions);
  corner_rows rows;
  qmat_status status = collect_corners(context, mesh, positions, &rows);
  for (size_t v = 0; v < mesh->vertex_count && status == QMAT_OK; v++) {
    if (v % 4096 == 0) status = qmat_progress(context, v, mesh->vertex_count, "vertices");
    split_vertex(&rows, positions, v, display);
  }
  return status == QMAT_OK && envelope ? measure(context, envelope, display) : status;
}
