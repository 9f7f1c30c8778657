/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/interior_points.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/vector.h"

enum { MOST_NODES_ALONG = 128 };
static const double spacing_share = 2, cube_share = 0.5;

/* A centre needs this share of its sphere's depth beyond `depth`. The whole depth would refuse joints that several
 * spheres fill together. */
static const double covered_share = 0.5;

typedef struct {
  uint64_t cube;
  double radius;
  uint32_t vertex;
} placed_sphere;

static int by_cube(const void *left, const void *right) {
  const placed_sphere *a = left, *b = right;
  if (a->cube != b->cube) return a->cube < b->cube ? -1 : 1;
  if (a->radius != b->radius) return a->radius > b->radius ? -1 : 1;
  return a->vertex < b->vertex ? -1 : a->vertex > b->vertex;
}

/* The spheres larger than `depth`, the largest of each cube, in the order of the cubes. */
static placed_sphere *place_spheres(qmat_context *context, const qmat_complex *complex, double depth, double low,
                                    double extent, size_t *count) {
  placed_sphere *placed = qmat_arena_alloc(&context->arena, complex->vertex_count, sizeof *placed);
  if (!placed) return NULL;
  const double most = (1 << 21) - 1, side = fmax(cube_share * depth, extent / most);
  *count = 0;
  for (size_t v = 0; v < complex->vertex_count; v++) {
    const double *s = &complex->spheres[4 * v];
    if (!(s[3] > depth)) continue;
    uint64_t cube = 0;
    for (int k = 0; k < 3; k++) cube = cube << 21 | (uint64_t)fmin(floor((s[k] - low) / side), most);
    placed[(*count)++] = (placed_sphere){cube, s[3], (uint32_t)v};
  }
  if (*count) qsort(placed, *count, sizeof *placed, by_cube);
  size_t kept = 0;
  for (size_t i = 0; i < *count; i++)
    if (i == 0 || placed[i].cube != placed[i - 1].cube) placed[kept++] = placed[i];
  *count = kept;
  return placed;
}

/* Records a sphere at the nodes that it contains to the depth, where it contains them deepest so far. */
static void enter_sphere(const double *sphere, uint32_t vertex, double depth, double low, double spacing, size_t along,
                         float *depths, uint32_t *owners) {
  const double reach = sphere[3] - depth;
  size_t first[3], last[3];
  for (int k = 0; k < 3; k++) {
    first[k] = (size_t)fmax(ceil((sphere[k] - reach - low) / spacing), 0);
    last[k] = (size_t)fmax(fmin(floor((sphere[k] + reach - low) / spacing), (double)along - 1), 0);
  }
  for (size_t x = first[0]; x <= last[0]; x++)
    for (size_t y = first[1]; y <= last[1]; y++)
      for (size_t z = first[2]; z <= last[2]; z++) {
        const double node[3] = {low + (double)x * spacing, low + (double)y * spacing, low + (double)z * spacing};
        const float found = (float)(sphere[3] - qmat_point_distance(node, sphere));
        const size_t i = (x * along + y) * along + z;
        if (!(found >= (float)depth) || !(found > depths[i])) continue;
        depths[i] = found;
        owners[i] = vertex;
      }
}

qmat_status qmat_interior_points_find(qmat_context *context, const qmat_complex *complex, double depth,
                                      qmat_interior_points *inner) {
  qmat_arena *arena = &context->arena;
  *inner = (qmat_interior_points){.count = 0};
  double low = INFINITY, high = -INFINITY;
  for (size_t v = 0; v < complex->vertex_count; v++) {
    const double *s = &complex->spheres[4 * v];
    for (int k = 0; k < 3; k++) {
      low = fmin(low, s[k] - s[3]);
      high = fmax(high, s[k] + s[3]);
    }
  }
  const double extent = fmax(high - low, 0), spacing = fmax(spacing_share * depth, extent / (MOST_NODES_ALONG - 1));
  if (!(spacing > 0 && extent < INFINITY)) return QMAT_OK;
  const size_t along = (size_t)(extent / spacing) + 1, nodes = along * along * along;
  size_t count;
  const placed_sphere *placed = place_spheres(context, complex, depth, low, extent, &count);
  float *depths = qmat_arena_calloc(arena, nodes, sizeof *depths);
  uint32_t *owners = qmat_arena_alloc(arena, nodes, sizeof *owners);
  if (!placed || !depths || !owners) return qmat_fail_memory(context, "interior points");
  for (size_t i = 0; i < count; i++)
    enter_sphere(&complex->spheres[4 * (size_t)placed[i].vertex], placed[i].vertex, depth, low, spacing, along, depths,
                 owners);
  inner->count = count;
  for (size_t i = 0; i < nodes; i++) inner->count += depths[i] > 0;
  inner->points = qmat_arena_alloc(arena, inner->count, 3 * sizeof *inner->points);
  inner->spheres = qmat_arena_alloc(arena, inner->count, sizeof *inner->spheres);
  inner->distances = qmat_arena_alloc(arena, inner->count, sizeof *inner->distances);
  inner->limits = qmat_arena_alloc(arena, inner->count, sizeof *inner->limits);
  if (!inner->points || !inner->spheres || !inner->distances || !inner->limits)
    return qmat_fail_memory(context, "interior points");
  size_t next = 0;
  for (size_t i = 0; i < count; i++) {
    const double *sphere = &complex->spheres[4 * (size_t)placed[i].vertex];
    memcpy(&inner->points[3 * next], sphere, 3 * sizeof *sphere);
    inner->spheres[next] = placed[i].vertex;
    inner->limits[next] = -covered_share * (sphere[3] - depth);
    inner->distances[next++] = -sphere[3];
  }
  for (size_t i = 0; i < nodes; i++) {
    if (!(depths[i] > 0)) continue;
    const size_t steps[3] = {i / along / along, i / along % along, i % along};
    double *point = &inner->points[3 * next];
    for (int k = 0; k < 3; k++) point[k] = low + (double)steps[k] * spacing;
    const double *sphere = &complex->spheres[4 * (size_t)owners[i]];
    inner->limits[next] = 0;
    inner->spheres[next] = owners[i];
    inner->distances[next++] = qmat_point_distance(point, sphere) - sphere[3];
  }
  return QMAT_OK;
}
