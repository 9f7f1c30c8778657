/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/boundary_features.h"

#include <math.h>

#include "core/geometry/medial_build.h"
#include "core/geometry/medial_distance.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector.h"
#include "nodes/measure/area_samples.h"

/* Turns counts at [row + 2] into the places where rows are filled. Filling them makes the places offsets. */
static void sum_counts(size_t *offsets, size_t rows) {
  for (size_t i = 0; i < rows; i++) offsets[i + 2] += offsets[i + 1];
}

qmat_status qmat_boundary_features_init(qmat_context *context, const qmat_medial *unit, qmat_boundary_features *f) {
  qmat_arena *arena = &context->arena;
  *f = (qmat_boundary_features){.spheres = unit->spheres,
                                .edges = unit->edges,
                                .triangles = unit->triangles,
                                .sphere_count = unit->sphere_count,
                                .edge_count = unit->edge_count,
                                .triangle_count = unit->triangle_count};
  f->neighbour_offsets = qmat_arena_calloc(arena, f->sphere_count + 2, sizeof *f->neighbour_offsets);
  f->apex_offsets = qmat_arena_calloc(arena, f->edge_count + 2, sizeof *f->apex_offsets);
  f->neighbours = qmat_arena_alloc(arena, f->edge_count, 2 * sizeof *f->neighbours);
  f->apexes = qmat_arena_alloc(arena, f->triangle_count, 3 * sizeof *f->apexes);
  uint32_t *sides = qmat_arena_alloc(arena, f->triangle_count, 3 * sizeof *sides);
  if (!f->neighbour_offsets || !f->apex_offsets || !f->neighbours || !f->apexes || !sides)
    return qmat_fail_memory(context, "the envelope's boundary");
  for (size_t i = 0; i < 2 * f->edge_count; i++) f->neighbour_offsets[f->edges[i] + 2]++;
  sum_counts(f->neighbour_offsets, f->sphere_count);
  for (size_t i = 0; i < 2 * f->edge_count; i++)
    f->neighbours[f->neighbour_offsets[f->edges[i] + 1]++] = f->edges[i ^ 1];
  const qmat_status status = qmat_medial_sides(context, unit, sides);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < 3 * f->triangle_count; i++) f->apex_offsets[sides[i] + 2]++;
  sum_counts(f->apex_offsets, f->edge_count);
  for (size_t i = 0; i < 3 * f->triangle_count; i++) f->apexes[f->apex_offsets[sides[i] + 1]++] = f->triangles[i];
  return QMAT_OK;
}

size_t qmat_boundary_features_count(const qmat_boundary_features *f) {
  return f->sphere_count + f->edge_count + 2 * f->triangle_count;
}

qmat_feature_kind qmat_boundary_feature_kind(const qmat_boundary_features *f, size_t feature, size_t *row) {
  *row = feature;
  if (*row < f->sphere_count) return QMAT_FEATURE_SPHERE;
  *row -= f->sphere_count;
  if (*row < f->edge_count) return QMAT_FEATURE_CONE_SIDE;
  *row -= f->edge_count;
  return QMAT_FEATURE_SLAB_FACE;
}

bool qmat_cone_side_of_edge(const qmat_boundary_features *f, size_t edge, qmat_cone_side *side) {
  const double *a = &f->spheres[4 * (size_t)f->edges[2 * edge]], *b = &f->spheres[4 * (size_t)f->edges[2 * edge + 1]];
  *side = (qmat_cone_side){.a = a, .b = b};
  const double length = qmat_point_distance(a, b), growth = b[3] - a[3];
  if (!(length > fabs(growth)) || !(fabs(growth / length) < 1)) return false;
  for (int k = 0; k < 3; k++) side->axis[k] = (b[k] - a[k]) / length;
  side->along = -growth / length;
  side->across = sqrt((1 - side->along) * (1 + side->along));
  side->length = length * side->across;
  int least = 0;
  for (int k = 1; k < 3; k++)
    if (fabs(side->axis[k]) < fabs(side->axis[least])) least = k;
  double unit[3] = {0, 0, 0};
  unit[least] = 1;
  qmat_cross(side->axis, unit, side->v);
  qmat_normalize(side->v);
  qmat_cross(side->axis, side->v, side->w);
  return true;
}

void qmat_cone_side_sphere(const qmat_cone_side *side, double t, double sphere[4]) {
  for (int k = 0; k < 4; k++) sphere[k] = (1 - t) * side->a[k] + t * side->b[k];
}

void qmat_cone_side_normal(const qmat_cone_side *side, double angle, double normal[3]) {
  const double x = side->across * cos(angle), y = side->across * sin(angle);
  for (int k = 0; k < 3; k++) normal[k] = side->along * side->axis[k] + x * side->v[k] + y * side->w[k];
}

bool qmat_slab_face(const qmat_boundary_features *f, size_t row, double corners[9]) {
  const double *s[3];
  for (size_t i = 0; i < 3; i++) s[i] = &f->spheres[4 * (size_t)f->triangles[3 * (row / 2) + i]];
  qmat_slab slab;
  qmat_slab_prepare(&slab, s[0], s[1], s[2]);
  if (!slab.solid) return false;
  for (size_t k = 0; k < 3; k++) {
    const double rise = row % 2 ? -slab.rise * slab.normal[k] : slab.rise * slab.normal[k];
    const double normal = rise - slab.gradient[0] * slab.u[k] - slab.gradient[1] * slab.v[k];
    for (size_t i = 0; i < 3; i++) corners[3 * i + k] = s[i][k] + s[i][3] * normal;
  }
  return true;
}

double qmat_boundary_feature_area(const qmat_boundary_features *f, size_t feature) {
  size_t row;
  qmat_cone_side side;
  double corners[9], normal[3];
  switch (qmat_boundary_feature_kind(f, feature, &row)) {
    case QMAT_FEATURE_SPHERE:
      return 4 * QMAT_PI * f->spheres[4 * row + 3] * f->spheres[4 * row + 3];
    case QMAT_FEATURE_CONE_SIDE:
      return qmat_cone_side_of_edge(f, row, &side) ? QMAT_PI * (side.a[3] + side.b[3]) * side.across * side.length : 0;
    default:
      return qmat_slab_face(f, row, corners) ? qmat_triangle_area(corners, corners + 3, corners + 6, normal) : 0;
  }
}

static void cone_side_point(const qmat_cone_side *side, double x, double y, double point[3]) {
  double sphere[4], normal[3];
  /* The square of the radius is even along the side: r(t)^2 = (1 - x) ra^2 + x rb^2. */
  const double ra = side->a[3], rb = side->b[3], sum = ra + sqrt((1 - x) * ra * ra + x * rb * rb);
  qmat_cone_side_sphere(side, sum > 0 ? x * (ra + rb) / sum : x, sphere);
  qmat_cone_side_normal(side, 2 * QMAT_PI * y, normal);
  for (int k = 0; k < 3; k++) point[k] = sphere[k] + sphere[3] * normal[k];
}

void qmat_boundary_feature_point(const qmat_boundary_features *f, size_t feature, double x, double y, double point[3]) {
  size_t row;
  const qmat_feature_kind kind = qmat_boundary_feature_kind(f, feature, &row);
  qmat_cone_side side;
  double corners[9];
  if (kind == QMAT_FEATURE_SPHERE) {
    const double *s = &f->spheres[4 * row], z = 2 * x - 1, ring = sqrt(1 - z * z);
    const double normal[3] = {ring * cos(2 * QMAT_PI * y), ring * sin(2 * QMAT_PI * y), z};
    for (int k = 0; k < 3; k++) point[k] = s[k] + s[3] * normal[k];
  } else if (kind == QMAT_FEATURE_CONE_SIDE) {
    if (qmat_cone_side_of_edge(f, row, &side)) cone_side_point(&side, x, y, point);
  } else if (qmat_slab_face(f, row, corners)) {
    qmat_triangle_point(corners, corners + 3, corners + 6, x, y, point);
  }
}
