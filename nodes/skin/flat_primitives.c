/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/skin/flat_primitives.h"

#include <math.h>
#include <string.h>

#include "core/arena.h"
#include "core/geometry/vector.h"
#include "core/value_check.h"

static bool is_flat(const qmat_medial *medial, const uint32_t *row, size_t size) {
  for (size_t k = 0; k < size; k++)
    if (medial->spheres[4 * (size_t)row[k] + 3] > 0) return false;
  return true;
}

/* Whether a cone has a length; two spheres may be in one place. */
static bool has_length(const qmat_medial *medial, const uint32_t *row) {
  const double *a = &medial->spheres[4 * (size_t)row[0]], *b = &medial->spheres[4 * (size_t)row[1]];
  return a[0] != b[0] || a[1] != b[1] || a[2] != b[2];
}

/* The slabs that an edge is a side of. */
enum { FLAT_SLAB = 1, SOLID_SLAB = 2 };

qmat_status qmat_flat_primitives_separate(qmat_context *context, const qmat_medial *medial, qmat_medial *solid,
                                          qmat_medial *flat) {
  qmat_arena *arena = &context->arena;
  uint8_t *slabs = qmat_arena_calloc(arena, medial->edge_count, 1);
  qmat_medial *const parts[2] = {solid, flat};
  for (int i = 0; i < 2; i++) {
    *parts[i] = (qmat_medial){.sphere_count = medial->sphere_count, .spheres = medial->spheres};
    parts[i]->edges = qmat_arena_alloc(arena, medial->edge_count, 2 * sizeof(uint32_t));
    parts[i]->triangles = qmat_arena_alloc(arena, medial->triangle_count, 3 * sizeof(uint32_t));
    if (!slabs || !parts[i]->edges || !parts[i]->triangles) return qmat_fail_memory(context, "medial slabs");
  }
  for (size_t t = 0; t < medial->triangle_count; t++) {
    const uint32_t *row = &medial->triangles[3 * t];
    const bool is_thin = is_flat(medial, row, 3);
    qmat_medial *part = parts[is_thin];
    memcpy(&part->triangles[3 * part->triangle_count++], row, 3 * sizeof *row);
    for (size_t k = 0; k < 3; k++) {
      const uint32_t side[2] = {row[k == 2], row[k == 0 ? 1 : 2]};
      slabs[qmat_simplex_find(medial->edges, medial->edge_count, 2, side)] |= is_thin ? FLAT_SLAB : SOLID_SLAB;
    }
  }
  for (size_t e = 0; e < medial->edge_count; e++) {
    const uint32_t *row = &medial->edges[2 * e];
    const bool is_line = is_flat(medial, row, 2) && !(slabs[e] & SOLID_SLAB);
    if (is_line && (slabs[e] || !has_length(medial, row))) continue;
    memcpy(&parts[is_line]->edges[2 * parts[is_line]->edge_count++], row, 2 * sizeof *row);
  }
  return QMAT_OK;
}

/* Both sides of a slab: 6 vertices and 2 triangles, with ids from `first` on. */
static void put_slab(const double *spheres, const uint32_t *row, uint32_t first, double *positions,
                     uint32_t *triangles) {
  for (size_t i = 0; i < 6; i++) memcpy(&positions[3 * i], &spheres[4 * (size_t)row[i % 3]], 3 * sizeof *positions);
  const uint32_t sides[6] = {0, 1, 2, 3, 5, 4};
  for (size_t i = 0; i < 6; i++) triangles[i] = first + sides[i];
}

/* A multiple of the axis whose square neither vanishes nor overflows. Spheres that are in two places in the model may
 * be in one place of the frame: every axis is theirs. */
static void find_axis(const double *ends[2], double axis[3]) {
  qmat_subtract(ends[1], ends[0], axis);
  const double largest = fmax(fmax(fabs(axis[0]), fabs(axis[1])), fabs(axis[2]));
  int exponent;
  frexp(largest, &exponent);
  for (int k = 0; k < 3; k++) axis[k] = ldexp(axis[k], -exponent);
  if (!(largest > 0)) axis[0] = 1;
}

/* A prism around a cone: 6 vertices and 8 triangles. */
static void put_prism(const double *spheres, const uint32_t *row, double radius, uint32_t first, double *positions,
                      uint32_t *triangles) {
  static const uint32_t faces[24] = {0, 2, 1, 3, 4, 5, 0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4, 2, 0, 3, 2, 3, 5};
  const double *ends[2] = {&spheres[4 * (size_t)row[0]], &spheres[4 * (size_t)row[1]]};
  double axis[3], u[3], v[3], unit[3] = {0, 0, 0};
  find_axis(ends, axis);
  int least = 0;
  for (int k = 1; k < 3; k++)
    if (fabs(axis[k]) < fabs(axis[least])) least = k;
  unit[least] = 1;
  qmat_cross(axis, unit, u);
  qmat_normalize(u);
  qmat_cross(axis, u, v);
  qmat_normalize(v);
  static const double turns[3][2] = {{1, 0}, {-0.5, 0.86602540378443865}, {-0.5, -0.86602540378443865}};
  for (size_t i = 0; i < 6; i++)
    for (size_t k = 0; k < 3; k++)
      positions[3 * i + k] = ends[i / 3][k] + radius * (turns[i % 3][0] * u[k] + turns[i % 3][1] * v[k]);
  for (size_t i = 0; i < 24; i++) triangles[i] = first + faces[i];
}

qmat_status qmat_flat_primitives_append(qmat_context *context, const qmat_medial *flat, const double *spheres,
                                        double radius, qmat_skin_triangles *surface) {
  const size_t added = flat->triangle_count + flat->edge_count, before = surface->vertex_count;
  if (added == 0) return QMAT_OK;
  const size_t vertices = before + 6 * added, old = surface->triangle_count,
               triangles = old + 2 * flat->triangle_count + 8 * flat->edge_count;
  double *positions = qmat_alloc(vertices, 3 * sizeof *positions);
  uint32_t *rows = qmat_alloc(triangles, 3 * sizeof *rows);
  if (!positions || !rows || vertices >= UINT32_MAX) {
    qmat_free(positions);
    qmat_free(rows);
    return qmat_fail_memory(context, "the skin");
  }
  if (before) memcpy(positions, surface->positions, 3 * before * sizeof *positions);
  if (old) memcpy(rows, surface->triangles, 3 * old * sizeof *rows);
  double *position = positions + 3 * before;
  uint32_t *row = rows + 3 * old, first = (uint32_t)before;
  for (size_t t = 0; t < flat->triangle_count; t++, position += 18, row += 6, first += 6)
    put_slab(spheres, &flat->triangles[3 * t], first, position, row);
  for (size_t e = 0; e < flat->edge_count; e++, position += 18, row += 24, first += 6)
    put_prism(spheres, &flat->edges[2 * e], radius, first, position, row);
  qmat_free(surface->positions);
  qmat_free(surface->triangles);
  *surface = (qmat_skin_triangles){vertices, triangles, positions, rows};
  return QMAT_OK;
}
