/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/skin/skin_distance.h"

#include <math.h>
#include <string.h>

#include "core/geometry/envelope.h"
#include "core/geometry/surface.h"
#include "nodes/measure/boundary_distance.h"
#include "nodes/measure/hausdorff_bound.h"

/* The share of the threshold, or of the distance, that bounds may be too large by. Those of the boundary are better
 * where that decides whether the threshold is kept. */
static const double TOLERANCE = 0.1, FINE_TOLERANCE = 0.02;
/* Samples that search the boundary before the bounds do. */
enum { SAMPLE_COUNT = 4000 };

void qmat_skin_distance_uninit(qmat_skin_distance *distance) {
  qmat_free(distance->far_points);
  *distance = (qmat_skin_distance){0};
}

/* The medial mesh in the frame, without spheres that enclose nothing. Its arrays are in the arena. */
static qmat_status place(qmat_context *context, const qmat_medial *medial, const qmat_frame *frame, qmat_medial *unit) {
  qmat_arena *arena = &context->arena;
  const size_t count = medial->sphere_count;
  uint32_t *ids = qmat_arena_calloc(arena, count, sizeof *ids);
  *unit = (qmat_medial){.edge_count = medial->edge_count, .triangle_count = medial->triangle_count};
  unit->spheres = qmat_arena_alloc(arena, count, 4 * sizeof *unit->spheres);
  unit->edges = qmat_arena_alloc(arena, medial->edge_count, 2 * sizeof *unit->edges);
  unit->triangles = qmat_arena_alloc(arena, medial->triangle_count, 3 * sizeof *unit->triangles);
  if (!ids || !unit->spheres || !unit->edges || !unit->triangles) return qmat_fail_memory(context, "medial spheres");
  for (size_t i = 0; i < 2 * medial->edge_count; i++) ids[medial->edges[i]] = 1;
  for (size_t i = 0; i < count; i++) {
    if (!ids[i] && !(medial->spheres[4 * i + 3] > 0)) continue;
    ids[i] = (uint32_t)unit->sphere_count;
    memcpy(unit->spheres + 4 * unit->sphere_count++, medial->spheres + 4 * i, 4 * sizeof *unit->spheres);
  }
  for (size_t i = 0; i < 2 * medial->edge_count; i++) unit->edges[i] = ids[medial->edges[i]];
  for (size_t i = 0; i < 3 * medial->triangle_count; i++) unit->triangles[i] = ids[medial->triangles[i]];
  qmat_frame_spheres_to_unit(frame, unit->spheres, unit->sphere_count, unit->spheres);
  return QMAT_OK;
}

static qmat_status add_points(qmat_context *context, const qmat_frame *frame, const double *points, size_t count,
                              qmat_skin_distance *distance) {
  if (count == 0) return QMAT_OK;
  if (qmat_grow((void **)&distance->far_points, &distance->far_capacity, distance->far_count + count,
                3 * sizeof *points))
    return qmat_fail_memory(context, "places far from the skin");
  qmat_frame_to_model(frame, points, count, distance->far_points + 3 * distance->far_count);
  distance->far_count += count;
  return QMAT_OK;
}

static qmat_status measure(qmat_context *context, const qmat_surface *surface, const qmat_medial *unit,
                           double threshold, qmat_skin_distance *distance) {
  const qmat_frame *frame = qmat_surface_frame(surface);
  qmat_envelope *envelope;
  qmat_boundary_distance boundary = {0};
  qmat_hausdorff_bound bound = {0};
  qmat_status status = qmat_envelope_of_medial(context, unit, &envelope);
  if (status == QMAT_OK)
    status = qmat_boundary_distance_measure(
        context, surface, envelope, unit,
        &(qmat_boundary_request){.epsilon = threshold, .tolerance = TOLERANCE, .sample_count = SAMPLE_COUNT},
        &boundary);
  if (status == QMAT_OK)
    status = qmat_hausdorff_bound_measure(context, surface, envelope, 0, FINE_TOLERANCE * threshold, threshold,
                                          -INFINITY, &bound);
  distance->from_envelope = frame->diagonal * boundary.either_side.hi;
  distance->to_envelope = frame->diagonal * fmax(bound.bound, 0);
  if (status == QMAT_OK) status = add_points(context, frame, boundary.far_points, boundary.far_count, distance);
  if (status == QMAT_OK)
    status = add_points(context, frame, boundary.undecided_points, boundary.undecided_count, distance);
  if (status == QMAT_OK) status = add_points(context, frame, bound.points, bound.count, distance);
  qmat_boundary_distance_uninit(&boundary);
  qmat_envelope_free(envelope);
  return status;
}

qmat_status qmat_skin_distance_measure(qmat_context *context, const qmat_medial *medial,
                                       const qmat_skin_triangles *surface, double threshold,
                                       qmat_skin_distance *distance) {
  const qmat_mesh mesh = {.vertex_count = surface->vertex_count,
                          .triangle_count = surface->triangle_count,
                          .positions = surface->positions,
                          .triangles = surface->triangles,
                          .closed = true,
                          .oriented = true};
  *distance = (qmat_skin_distance){0};
  qmat_surface *tree;
  qmat_medial unit;
  qmat_status status = qmat_surface_new(context, &mesh, &tree);
  if (status != QMAT_OK) return status;
  status = place(context, medial, qmat_surface_frame(tree), &unit);
  if (status == QMAT_OK)
    status = measure(context, tree, &unit, threshold / qmat_surface_frame(tree)->diagonal, distance);
  qmat_surface_free(tree);
  return status;
}
