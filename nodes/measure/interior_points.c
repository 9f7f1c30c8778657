/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/interior_points.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/morton.h"
#include "core/geometry/vector.h"

enum { MOST_NODES_ALONG = 128, LAYERS_A_REPORT = 4 };
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

/* A hierarchy of the placed spheres along a curve through space (Morton 1966): each group of a level holds up to
 * GROUP_SIZE groups of the level below, those of level 0 as many spheres. */
enum { GROUP_SIZE = 8, MOST_LEVELS = 12 };

typedef struct group {
  double low[3], high[3], largest; /* the box of the centres, and the largest radius */
} group;

typedef struct sphere_groups {
  const qmat_complex *complex;
  const placed_sphere *placed;
  size_t count;
  uint32_t *order; /* count: numbers of placed spheres along the curve */
  size_t counts[MOST_LEVELS];
  group *levels[MOST_LEVELS];
  int level_count;
} sphere_groups;

typedef struct curve_place {
  uint64_t code;
  uint32_t number;
} curve_place;

static int by_code(const void *left, const void *right) {
  const curve_place *a = left, *b = right;
  if (a->code != b->code) return a->code < b->code ? -1 : 1;
  return a->number < b->number ? -1 : a->number > b->number;
}

/* The bits of three numbers of 21 bits, which follow each other in `cube`, in turns. */
static uint64_t morton_code(uint64_t cube) {
  return qmat_spread_bits(cube) | qmat_spread_bits(cube >> 21) << 1 | qmat_spread_bits(cube >> 42) << 2;
}

static void enclose(group *g, const double low[3], const double high[3], double largest) {
  for (int k = 0; k < 3; k++) {
    g->low[k] = fmin(g->low[k], low[k]);
    g->high[k] = fmax(g->high[k], high[k]);
  }
  g->largest = fmax(g->largest, largest);
}

/* `g->count` is 1 or more. */
static qmat_status make_groups(qmat_context *context, sphere_groups *g) {
  const size_t count = g->count;
  qmat_arena *arena = &context->arena;
  curve_place *places = qmat_arena_alloc(arena, count, sizeof *places);
  g->order = qmat_arena_alloc(arena, count, sizeof *g->order);
  if (!places || !g->order) return qmat_fail_memory(context, "interior points");
  for (size_t i = 0; i < count; i++) places[i] = (curve_place){morton_code(g->placed[i].cube), (uint32_t)i};
  qsort(places, count, sizeof *places, by_code);
  for (size_t i = 0; i < count; i++) g->order[i] = places[i].number;
  for (size_t below = count; below > 1 || g->level_count == 0; below = g->counts[g->level_count++]) {
    const int level = g->level_count;
    g->counts[level] = (below + GROUP_SIZE - 1) / GROUP_SIZE;
    group *groups = g->levels[level] = qmat_arena_alloc(arena, g->counts[level], sizeof *groups);
    if (!groups) return qmat_fail_memory(context, "interior points");
    for (size_t i = 0; i < g->counts[level]; i++)
      groups[i] = (group){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}, 0};
    for (size_t i = 0; i < below; i++) {
      group *into = &groups[i / GROUP_SIZE];
      if (level > 0) {
        const group *own = &g->levels[level - 1][i];
        enclose(into, own->low, own->high, own->largest);
      } else {
        const double *s = &g->complex->spheres[4 * (size_t)g->placed[g->order[i]].vertex];
        enclose(into, s, s, s[3]);
      }
    }
  }
  return QMAT_OK;
}

/* The placed sphere that contains a node deepest, the first of equally deep ones; UINT32_MAX: none to the depth. */
typedef struct deepest {
  float depth;
  uint32_t number;
} deepest;

static void try_sphere(const sphere_groups *g, uint32_t number, const double node[3], deepest *best) {
  const double *s = &g->complex->spheres[4 * (size_t)g->placed[number].vertex];
  const float depth = (float)(s[3] - qmat_point_distance(node, s));
  if (depth > best->depth || (depth == best->depth && number < best->number)) *best = (deepest){depth, number};
}

/* More than rounding of the depth. */
static const double rounding = 1e-12;

static bool may_be_deeper(const group *g, const double node[3], float depth) {
  double square = 0;
  for (int k = 0; k < 3; k++) {
    const double away = qmat_larger(qmat_larger(g->low[k] - node[k], node[k] - g->high[k]), 0);
    square += away * away;
  }
  return (float)(g->largest - sqrt(square) + rounding) >= depth;
}

static void search_group(const sphere_groups *g, int level, size_t index, const double node[3], deepest *best) {
  if (!may_be_deeper(&g->levels[level][index], node, best->depth)) return;
  const size_t below = level > 0 ? g->counts[level - 1] : g->count, first = index * GROUP_SIZE;
  for (size_t i = first; i < first + GROUP_SIZE && i < below; i++) {
    if (level > 0)
      search_group(g, level - 1, i, node, best);
    else
      try_sphere(g, g->order[i], node, best);
  }
}

/* The owners of the nodes of a layer. The owner of the node before is tried first: it is near the best. */
static void find_owners(const sphere_groups *g, double depth, double low, double spacing, size_t along, size_t x,
                        uint32_t *owners) {
  uint32_t near = UINT32_MAX;
  for (size_t y = 0; y < along; y++)
    for (size_t z = 0; z < along; z++) {
      const double node[3] = {low + (double)x * spacing, low + (double)y * spacing, low + (double)z * spacing};
      deepest best = {(float)depth, UINT32_MAX};
      if (near != UINT32_MAX) try_sphere(g, near, node, &best);
      search_group(g, g->level_count - 1, 0, node, &best);
      owners[(x * along + y) * along + z] = best.number;
      if (best.number != UINT32_MAX) near = best.number;
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
  uint32_t *owners = qmat_arena_alloc(arena, nodes, sizeof *owners); /* numbers of placed spheres, or UINT32_MAX */
  if (!placed || !owners) return qmat_fail_memory(context, "interior points");
  if (count == 0) return QMAT_OK;
  sphere_groups groups = {.complex = complex, .placed = placed, .count = count};
  qmat_status status = make_groups(context, &groups);
  const int threads = qmat_threads(context);
  for (size_t first = 0; first < along && status == QMAT_OK; first += LAYERS_A_REPORT) {
    const size_t end = first + LAYERS_A_REPORT < along ? first + LAYERS_A_REPORT : along;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1)
    for (size_t x = first; x < end; x++) find_owners(&groups, depth, low, spacing, along, x, owners);
    status = qmat_progress(context, end, along, "layers of interior points");
  }
  if (status != QMAT_OK) return status;
  inner->count = count;
  for (size_t i = 0; i < nodes; i++) inner->count += owners[i] != UINT32_MAX;
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
    if (owners[i] == UINT32_MAX) continue;
    const size_t steps[3] = {i / along / along, i / along % along, i % along};
    double *point = &inner->points[3 * next];
    for (int k = 0; k < 3; k++) point[k] = low + (double)steps[k] * spacing;
    const uint32_t vertex = placed[owners[i]].vertex;
    const double *sphere = &complex->spheres[4 * (size_t)vertex];
    inner->limits[next] = 0;
    inner->spheres[next] = vertex;
    inner->distances[next++] = qmat_point_distance(point, sphere) - sphere[3];
  }
  return QMAT_OK;
}
