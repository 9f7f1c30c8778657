/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/solid_labels.h"

#include <math.h>

#include "core/disjoint_sets.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector.h"

/* Of a connected component of the surface, kept at its smallest vertex. */
typedef struct shell {
  double volume; /* six times the signed one: negative for a void */
  uint32_t rightmost;
} shell;

static void measure_shells(const qmat_dual_complex *d, const uint32_t *leaders, shell *shells) {
  const qmat_mesh *mesh = d->mesh;
  const double *positions = qmat_surface_positions(d->surface);
  for (size_t i = 0; i < mesh->vertex_count; i++) {
    const uint32_t leader = leaders[i];
    uint32_t *rightmost = &shells[leader].rightmost;
    if (leader == i || positions[3 * i] > positions[3 * (size_t)*rightmost]) *rightmost = (uint32_t)i;
  }
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const uint32_t *ids = &mesh->triangles[3 * t];
    const double *a = &positions[3 * (size_t)ids[0]], *b = &positions[3 * (size_t)ids[1]],
                 *c = &positions[3 * (size_t)ids[2]];
    double normal[3];
    qmat_triangle_normal(a, b, c, normal);
    shells[leaders[ids[0]]].volume += qmat_dot(normal, a);
  }
}

/* To the right of a void's rightmost vertex is solid, as far as another void of it or its outer surface. */
static void join_void(const qmat_dual_complex *d, uint32_t rightmost, uint32_t *sets) {
  static const double right[3] = {1, 0, 0};
  const double *from = &qmat_surface_positions(d->surface)[3 * (size_t)rightmost];
  const double start = 1e-8; /* unit frame; beyond the triangles of the vertex itself */
  uint32_t triangle;
  if (qmat_surface_cast(d->surface, from, right, start, INFINITY, NULL, &triangle, NULL))
    qmat_sets_join(sets, rightmost, d->mesh->triangles[3 * (size_t)triangle]);
}

qmat_status qmat_solids_find(qmat_dual_complex *d) {
  const qmat_mesh *mesh = d->mesh;
  const size_t count = mesh->vertex_count;
  uint32_t *sets = qmat_sets_new(d->context, count), *leaders = qmat_sets_new(d->context, count);
  shell *shells = qmat_arena_calloc(&d->context->arena, count, sizeof *shells);
  if (!sets || !leaders || !shells) return qmat_fail_memory(d->context, "the solids");
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    qmat_sets_join(sets, mesh->triangles[3 * t], mesh->triangles[3 * t + 1]);
    qmat_sets_join(sets, mesh->triangles[3 * t], mesh->triangles[3 * t + 2]);
  }
  for (size_t i = 0; i < count; i++) leaders[i] = qmat_set_leader(sets, (uint32_t)i);
  measure_shells(d, leaders, shells);
  for (size_t i = 0; i < count; i++)
    if (leaders[i] == i && shells[i].volume < 0) join_void(d, shells[i].rightmost, sets);
  size_t solids = 0;
  for (size_t i = 0; i < count; i++) {
    leaders[i] = qmat_set_leader(sets, (uint32_t)i);
    solids += leaders[i] == i;
  }
  d->solids = solids > 1 ? leaders : NULL;
  return QMAT_OK;
}

/* The solid in which a medial vertex lies. */
static uint32_t find_solid(const qmat_dual_complex *d, size_t cell) {
  const uint32_t *corners = &d->cells.corners[4 * cell];
  const uint32_t first = qmat_dual_solid_of_point(d, corners[0]);
  bool same = true;
  for (size_t k = 1; k < 4; k++) same = same && qmat_dual_solid_of_point(d, corners[k]) == first;
  uint32_t triangle;
  if (same || !(qmat_surface_distance(d->surface, &d->spheres[4 * cell], INFINITY, NULL, &triangle) < INFINITY))
    return first;
  return d->solids[d->mesh->triangles[3 * (size_t)triangle]];
}

qmat_status qmat_solids_part(qmat_dual_complex *d, size_t *dropped) {
  *dropped = 0;
  if (!d->solids) return QMAT_OK;
  const size_t count = d->cells.count;
  const int threads = qmat_threads(d->context);
  d->solid_of = qmat_arena_alloc(&d->context->arena, count, sizeof *d->solid_of);
  if (!d->solid_of) return qmat_fail_memory(d->context, "the tetrahedra");
#pragma omp parallel for num_threads(threads) schedule(dynamic, 512)
  for (size_t i = 0; i < count; i++) d->solid_of[i] = d->kinds[i] ? find_solid(d, i) : QMAT_NO_ID;
  for (size_t i = 0; i < count; i++)
    for (size_t k = 0; k < 4 && d->kinds[i]; k++) {
      const uint32_t j = d->cells.neighbours[4 * i + k];
      if (j == QMAT_NO_TETRAHEDRON || !d->kinds[j] || d->solid_of[j] == d->solid_of[i]) continue;
      const bool drop_neighbour = d->spheres[4 * (size_t)j + 3] < d->spheres[4 * i + 3];
      d->kinds[drop_neighbour ? j : i] = QMAT_CELL_DROPPED;
      ++*dropped;
    }
  return QMAT_OK;
}
