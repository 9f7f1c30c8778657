/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/topology_mending.h"

#include <math.h>
#include <string.h>

#include "nodes/measure/envelope_to_surface.h"

/* Removes a triangle, not its edges; the order of the others stays. */
static void remove_triangle(qmat_medial *medial, size_t triangle) {
  uint32_t *row = &medial->triangles[3 * triangle];
  memmove(row, row + 3, 3 * (--medial->triangle_count - triangle) * sizeof *row);
}

static void restore_triangle(qmat_medial *medial, size_t triangle, const uint32_t corners[3]) {
  uint32_t *row = &medial->triangles[3 * triangle];
  memmove(row + 3, row, 3 * (medial->triangle_count++ - triangle) * sizeof *row);
  memcpy(row, corners, 3 * sizeof *row);
}

/* `*opened`: whether there was a wall to spare; `*error` is then the surface-to-envelope error without it. */
static qmat_status open_void(const qmat_simplification *s, qmat_medial *unit, bool *opened, double *error) {
  const double epsilon = s->params.epsilon;
  uint32_t *walls;
  size_t count;
  *opened = false;
  qmat_status status = qmat_topology_find_walls(s->context, unit, &walls, &count);
  for (size_t i = 0; i < count && i < QMAT_MOST_WALLS && status == QMAT_OK && !*opened; i++) {
    uint32_t corners[3];
    memcpy(corners, &unit->triangles[3 * (size_t)walls[i]], sizeof corners);
    qmat_medial_errors errors = {.surface_to_envelope = 0};
    remove_triangle(unit, walls[i]);
    status = qmat_simplification_measure(s, unit, true, &errors);
    *error = errors.surface_to_envelope;
    *opened = status == QMAT_OK && *error <= epsilon && errors.boundary_to_surface <= epsilon;
    qmat_medial_errors_uninit(&errors);
    if (!*opened) restore_triangle(unit, walls[i], corners);
  }
  return status;
}

qmat_status qmat_simplification_open_voids(const qmat_simplification *s, qmat_simplified *result) {
  if (!result->within_epsilon || !s->solid.known) return QMAT_OK;
  for (;;) {
    qmat_topology topology;
    bool opened;
    double error;
    qmat_status status = qmat_topology_of_medial(s->context, result->medial, &topology);
    if (status != QMAT_OK || !topology.known || topology.voids <= s->solid.voids) return status;
    status = open_void(s, result->medial, &opened, &error);
    if (status != QMAT_OK || !opened) return status;
    result->figures.surface_to_envelope = error;
  }
}

/* Inserts a triangle in its sorted place. */
static qmat_status insert_triangle(qmat_context *context, qmat_medial *medial, const uint32_t corners[3],
                                   size_t *place) {
  size_t capacity = 3 * medial->triangle_count;
  if (qmat_grow((void **)&medial->triangles, &capacity, 3 * (medial->triangle_count + 1), sizeof *corners))
    return qmat_fail_memory(context, "medial slabs");
  for (*place = 0; *place < medial->triangle_count; ++*place) {
    const uint32_t *row = &medial->triangles[3 * *place];
    if (row[0] != corners[0] ? row[0] > corners[0] : row[1] != corners[1] ? row[1] > corners[1] : row[2] > corners[2])
      break;
  }
  restore_triangle(medial, *place, corners);
  return QMAT_OK;
}

/* `*closed`: whether there was such a loop among `loops`; `*error` is then how far its slab leaves the solid. */
static qmat_status close_loop(const qmat_simplification *s, qmat_medial *unit, size_t loops, bool *closed,
                              double *error) {
  const double epsilon = s->params.epsilon;
  uint32_t *triangles;
  size_t count;
  *closed = false;
  qmat_status status = qmat_topology_find_empty_triangles(s->context, unit, &triangles, &count);
  for (size_t i = 0; i < count && status == QMAT_OK && !*closed; i++) {
    const uint32_t *corners = &triangles[3 * i];
    const double *spheres[3];
    for (size_t k = 0; k < 3; k++) spheres[k] = &unit->spheres[4 * (size_t)corners[k]];
    *error = qmat_envelope_to_surface_bound(s->surface, spheres, 3, qmat_least_reported * epsilon,
                                            qmat_error_tolerance * epsilon);
    if (*error > epsilon) continue;
    size_t place = 0;
    qmat_topology topology;
    qmat_medial_errors errors = {.surface_to_envelope = 0};
    status = insert_triangle(s->context, unit, corners, &place);
    if (status != QMAT_OK) break;
    status = qmat_topology_of_medial(s->context, unit, &topology);
    if (status == QMAT_OK && topology.known && topology.loops < loops) {
      status = qmat_medial_boundary_measure(s->context, s->surface, unit, epsilon, &errors);
      *closed = status == QMAT_OK && errors.boundary_to_surface <= epsilon;
      qmat_medial_errors_uninit(&errors);
    }
    if (!*closed) remove_triangle(unit, place);
  }
  return status;
}

qmat_status qmat_simplification_close_loops(const qmat_simplification *s, qmat_simplified *result) {
  if (!result->within_epsilon || !s->solid.known) return QMAT_OK;
  for (;;) {
    qmat_topology topology;
    bool closed;
    double error;
    qmat_status status = qmat_topology_of_medial(s->context, result->medial, &topology);
    if (status != QMAT_OK || !topology.known || topology.loops <= s->solid.loops) return status;
    status = close_loop(s, result->medial, topology.loops, &closed, &error);
    if (status != QMAT_OK || !closed) return status;
    result->figures.envelope_to_surface = fmax(result->figures.envelope_to_surface, error);
  }
}
