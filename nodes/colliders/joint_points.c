/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/joint_points.h"

#include <math.h>
#include <string.h>

#include "core/geometry/joint_weights.h"
#include "core/geometry/sheets.h"
#include "core/hash.h"
#include "nodes/measure/area_samples.h"

enum { EVEN_POINTS = 20000, JOINTS = 65536 };

/* A point belongs to joints with this share of the largest weight. Weights so near to each other are equal. */
static const double belonging_share = 0.25, rounding = 1e-9;

typedef struct taking {
  const qmat_surface *surface;
  const qmat_mesh *mesh;
  size_t solid_count;
  uint8_t *has_points; /* JOINTS */
  qmat_joint_points *taken;
} taking;

/* The joint with the largest weight, and in `*largest` that weight. */
static uint32_t strongest_of(const uint32_t joints[4], const double weights[4], double *largest) {
  uint32_t best = joints[0];
  *largest = weights[0];
  for (int k = 1; k < 4; k++)
    if (weights[k] >= *largest - rounding && joints[k] < best) best = joints[k];
  return best;
}

/* Adds a point of a facet for each of its joints. */
static void add_point(const taking *t, size_t facet, const double place[3], const double corners[3]) {
  qmat_joint_points *all = t->taken;
  const uint32_t *ids = &t->mesh->triangles[3 * facet];
  uint32_t joints[12], strongest[4];
  double weights[12], strengths[4], largest;
  for (size_t k = 0; k < 12; k++) {
    const size_t at = 4 * (size_t)ids[k / 4] + k % 4;
    joints[k] = t->mesh->joints[at];
    weights[k] = corners[k / 4] * t->mesh->weights[at];
  }
  qmat_strongest_joints(joints, weights, 12, strongest, strengths);
  uint32_t best = strongest_of(strongest, strengths, &largest);
  /* Inside a triangle a joint may be the strongest that is so at no vertex. */
  for (int k = 0; k < 4 && !t->has_points[best]; k++) best = strongest[k];
  for (int k = 0; k < 4; k++) {
    const bool belongs = strongest[k] == best || strengths[k] >= belonging_share * largest - rounding;
    if (!(strengths[k] > 0) || !belongs || !t->has_points[strongest[k]]) continue;
    double *point = &all->points[4 * all->count];
    memcpy(point, place, 3 * sizeof *point);
    point[3] = facet < t->solid_count ? 0 : qmat_surface_half_thickness(t->surface);
    all->joints[all->count++] = strongest[k];
  }
}

static void find_joints(const taking *t) {
  qmat_joint_points *all = t->taken;
  for (size_t i = 0; i < 3 * t->mesh->triangle_count; i++) {
    const size_t vertex = t->mesh->triangles[i];
    double largest;
    t->has_points[strongest_of(&t->mesh->joints[4 * vertex], &t->mesh->weights[4 * vertex], &largest)] = 1;
  }
  all->first_joint = UINT32_MAX;
  for (uint32_t j = 0; j < JOINTS; j++) {
    if (!t->has_points[j]) continue;
    if (all->joint_count++ == 0) all->first_joint = j;
  }
}

qmat_status qmat_joint_points_take(qmat_context *context, const qmat_surface *surface, qmat_joint_points *taken) {
  const qmat_mesh *mesh = qmat_surface_mesh(surface);
  const double *positions = qmat_surface_positions(surface);
  *taken = (qmat_joint_points){0};
  if (mesh->skinned_count == 0 || mesh->triangle_count == 0) return QMAT_OK;
  const size_t room = 4 * (EVEN_POINTS + mesh->vertex_count);
  taking t = {.surface = surface, .mesh = mesh, .solid_count = qmat_solid_triangle_count(mesh), .taken = taken};
  t.has_points = qmat_arena_calloc(&context->arena, JOINTS, 1);
  taken->points = qmat_arena_alloc(&context->arena, room, 4 * sizeof *taken->points);
  taken->joints = qmat_arena_alloc(&context->arena, room, sizeof *taken->joints);
  uint8_t *done = qmat_arena_calloc(&context->arena, mesh->vertex_count, 1);
  double *areas = qmat_arena_alloc(&context->arena, mesh->triangle_count, sizeof *areas);
  if (!t.has_points || !taken->points || !taken->joints || !done || !areas)
    return qmat_fail_memory(context, "the points of joints");
  find_joints(&t);
  qmat_running_areas(positions, mesh->triangles, mesh->triangle_count, areas);
  static const double axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (size_t i = 0; i < EVEN_POINTS; i++) {
    const double at = areas[mesh->triangle_count - 1] * ((double)i + 0.5) / EVEN_POINTS;
    const size_t facet = qmat_area_element_at(areas, mesh->triangle_count, at);
    const uint32_t *ids = &mesh->triangles[3 * facet];
    const double x = qmat_hash_unit(qmat_hash3(5, i, 0)), y = qmat_hash_unit(qmat_hash3(5, i, 1));
    double place[3], corners[3];
    qmat_triangle_point(&positions[3 * (size_t)ids[0]], &positions[3 * (size_t)ids[1]], &positions[3 * (size_t)ids[2]],
                        x, y, place);
    qmat_triangle_point(axes[0], axes[1], axes[2], x, y, corners);
    add_point(&t, facet, place, corners);
  }
  taken->even_count = taken->count;
  for (size_t i = 0; i < 3 * mesh->triangle_count; i++) {
    const size_t vertex = mesh->triangles[i];
    if (!done[vertex]) add_point(&t, i / 3, &positions[3 * vertex], axes[i % 3]);
    done[vertex] = 1;
  }
  return QMAT_OK;
}
