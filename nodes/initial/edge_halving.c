/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/edge_halving.h"

#include <math.h>
#include <string.h>

#include "core/geometry/medial_build.h"
#include "core/geometry/triangle.h"
#include "core/value_check.h"

#define NONE UINT32_MAX

/* Each round halves an edge at most once. */
enum { MOST_ROUNDS = 8 };

/* Sets a sphere at an edge's midpoint; false unless the interpolated one leaves the solid by more than is allowed:
 * `tolerance` where the midpoint is inside, `most` where it is outside. It leaves it by its radius less the depth of
 * its centre. Between two inscribed spheres that is at most (length^2 - change^2) / (2 length), so short edges need no
 * distance query. The new sphere is inscribed or, for a midpoint outside, the nearest point of the surface. */
static bool find_middle(const qmat_surface *surface, const double *a, const double *b, double tolerance, double most,
                        double middle[4]) {
  double square = 0, nearest[3];
  for (int k = 0; k < 4; k++) middle[k] = 0.5 * (a[k] + b[k]);
  for (int k = 0; k < 3; k++) square += (a[k] - b[k]) * (a[k] - b[k]);
  const double change = a[3] - b[3];
  if (!(square - change * change > 2 * fmin(tolerance, most) * sqrt(square))) return false;
  const double limit = middle[3] - tolerance;
  const double depth = limit > 0 ? -qmat_surface_signed_distance_within(surface, middle, limit) : INFINITY;
  const bool is_far = isinf(depth); /* on either side */
  if (is_far ? qmat_surface_inside(surface, middle) : !(depth < limit)) return false;
  if (!is_far && depth > 0) {
    middle[3] = depth;
    return true;
  }
  const double outside = qmat_surface_distance(surface, middle, INFINITY, nearest, NULL);
  if (!(middle[3] + outside > most)) return false;
  memcpy(middle, nearest, sizeof nearest);
  middle[3] = 0;
  return true;
}

/* The vertex that halves an edge, or NONE. `is_end`, per vertex: whether an edge of it is halved. */
static uint32_t middle_of(const qmat_medial *medial, const uint32_t *middles, const uint8_t *is_end, uint32_t a,
                          uint32_t b) {
  if (!is_end[a] || !is_end[b]) return NONE;
  const uint32_t ends[2] = {a < b ? a : b, a < b ? b : a};
  return middles[qmat_simplex_find(medial->edges, medial->edge_count, 2, ends)];
}

/* One round. Edges of two of the first `known` spheres stay: an earlier round has tried them. Adds the number of halved
 * edges to `*added`. */
static qmat_status halve_edges(qmat_context *context, const qmat_surface *surface, qmat_medial *medial, size_t known,
                               double tolerance, double most, size_t *added) {
  qmat_arena *arena = &context->arena;
  const size_t spheres = medial->sphere_count, edges = medial->edge_count, triangles = medial->triangle_count;
  double *middle_spheres = qmat_arena_alloc(arena, edges, 4 * sizeof *middle_spheres);
  uint32_t *middles = qmat_arena_alloc(arena, edges, sizeof *middles);
  if (!middle_spheres || !middles) return qmat_fail_memory(context, "medial edges");
  const int threads = qmat_threads(context);
  const size_t slice = 1 << 10; /* inside tests of an open surface are slow */
  for (size_t first = 0; first < edges; first += slice) {
    const qmat_status status = qmat_progress(context, first, edges, "refinement");
    if (status != QMAT_OK) return status;
    const size_t last = first + slice < edges ? first + slice : edges;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 64)
    for (size_t e = first; e < last; e++) {
      const uint32_t a = medial->edges[2 * e], b = medial->edges[2 * e + 1];
      const bool is_halved = (a >= known || b >= known) &&
                             find_middle(surface, &medial->spheres[4 * (size_t)a], &medial->spheres[4 * (size_t)b],
                                         tolerance, most, &middle_spheres[4 * e]);
      middles[e] = is_halved ? 0 : NONE;
    }
  }
  size_t count = 0;
  for (size_t e = 0; e < edges; e++)
    if (middles[e] != NONE) middles[e] = (uint32_t)(spheres + count++);
  *added += count;
  if (count == 0) return QMAT_OK;
  double *all = qmat_alloc(spheres + count, 4 * sizeof *all);
  uint32_t *new_edges = qmat_arena_alloc(arena, edges + count, 2 * sizeof *new_edges);
  uint32_t *new_triangles = qmat_arena_alloc(arena, 4 * triangles, 3 * sizeof *new_triangles);
  uint8_t *is_end = qmat_arena_calloc(arena, spheres, sizeof *is_end);
  if (!all || !new_edges || !new_triangles || !is_end) {
    qmat_free(all);
    return qmat_fail_memory(context, "medial spheres");
  }
  memcpy(all, medial->spheres, 4 * spheres * sizeof *all);
  size_t edge_count = 0, triangle_count = 0;
  for (size_t e = 0; e < edges; e++) {
    const uint32_t a = medial->edges[2 * e], b = medial->edges[2 * e + 1];
    const uint32_t halves[2][2] = {{a, middles[e] == NONE ? b : middles[e]}, {b, middles[e]}};
    const size_t pieces = middles[e] == NONE ? 1 : 2;
    memcpy(&new_edges[2 * edge_count], halves, pieces * sizeof halves[0]);
    edge_count += pieces;
    if (pieces == 1) continue;
    memcpy(&all[4 * (size_t)middles[e]], &middle_spheres[4 * e], 4 * sizeof *all);
    is_end[a] = is_end[b] = 1;
  }
  for (size_t t = 0; t < triangles; t++) {
    const uint32_t *corners = &medial->triangles[3 * t];
    uint32_t sides[3], pieces[12];
    for (int k = 0; k < 3; k++) sides[k] = middle_of(medial, middles, is_end, corners[k], corners[(k + 1) % 3]);
    const size_t made = qmat_triangle_divide(corners, sides, pieces);
    memcpy(&new_triangles[3 * triangle_count], pieces, 3 * made * sizeof *pieces);
    triangle_count += made;
  }
  qmat_free(medial->spheres);
  medial->spheres = all;
  medial->sphere_count = spheres + count;
  return qmat_medial_set_simplices(context, medial, new_edges, edge_count, new_triangles, triangle_count);
}

qmat_status qmat_edges_halve(qmat_context *context, const qmat_surface *surface, qmat_medial *medial, double tolerance,
                             double most, size_t *added) {
  size_t known = 0;
  *added = 0;
  for (int round = 0; round < MOST_ROUNDS; round++) {
    const size_t before = *added, count = medial->sphere_count;
    qmat_status status = halve_edges(context, surface, medial, known, tolerance, most, added);
    known = count;
    if (status == QMAT_OK) status = qmat_progress(context, 0, 0, "refinement");
    if (status != QMAT_OK || *added == before) return status;
  }
  return QMAT_OK;
}
