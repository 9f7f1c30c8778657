/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/solid_cubes.h"

#include <math.h>
#include <omp.h>
#include <stdatomic.h>
#include <string.h>

#include "core/geometry/convex_polygon.h"
#include "core/geometry/sheets.h"
#include "core/geometry/vector.h"

/* The regions are a grid of GRID^3, searched SLICE at a time. */
enum { GRID = 16, SLICE = 64 };
_Static_assert(GRID *GRID *GRID == QMAT_CUBE_REGIONS, "the header says how many regions there are");

/* Cubes are larger by the first, so that none is missed between them. Corners count so near to the surface. */
static const double rounding = 1e-9, beside_surface = 1e-6;

int qmat_cube_clip(const qmat_cube_search *s, const qmat_solid_cube *c, uint32_t facet,
                   double polygon[QMAT_CUBE_MOST_CORNERS][3]) {
  double other[QMAT_CUBE_MOST_CORNERS][3], heights[QMAT_CUBE_MOST_CORNERS];
  int count = 3;
  for (int k = 0; k < 3; k++)
    memcpy(polygon[k], &s->positions[3 * (size_t)s->triangles[3 * (size_t)facet + (size_t)k]], sizeof polygon[k]);
  for (int plane = 0; plane < 6 && count > 0; plane++) {
    const int axis = plane / 2;
    const double sign = plane % 2 ? 1 : -1, limit = c->half * (1 + rounding);
    for (int i = 0; i < count; i++) heights[i] = sign * (polygon[i][axis] - c->centre[axis]) - limit;
    count = qmat_convex_polygon_cut(polygon, heights, count, other);
    memcpy(polygon, other, sizeof other);
  }
  return count;
}

/* Whether the facet's box meets the cube. */
static bool is_near(const qmat_cube_search *s, const qmat_solid_cube *c, uint32_t facet) {
  const uint32_t *row = &s->triangles[3 * (size_t)facet];
  for (int k = 0; k < 3; k++) {
    const double x = s->positions[3 * (size_t)row[0] + (size_t)k], y = s->positions[3 * (size_t)row[1] + (size_t)k],
                 z = s->positions[3 * (size_t)row[2] + (size_t)k];
    const double limit = c->half * (1 + rounding);
    if (qmat_smaller(x, qmat_smaller(y, z)) > c->centre[k] + limit ||
        qmat_larger(x, qmat_larger(y, z)) < c->centre[k] - limit)
      return false;
  }
  return true;
}

/* Keeps of the given shapes those that are nearest to some point of the cube. */
static void filter_candidates(qmat_cube_search *s, qmat_solid_cube *c, const uint32_t *given, size_t count) {
  uint32_t *kept = s->stack + c->top;
  size_t first = 0;
  c->nearest = INFINITY;
  for (size_t i = 0; i < count; i++) {
    s->near[i] = qmat_shape_distance(&s->shapes[given[i]], c->centre, NULL);
    if (!(s->near[i] < c->nearest)) continue;
    c->nearest = s->near[i];
    first = i;
  }
  kept[c->candidate_count++] = given[first];
  for (size_t i = 0; i < count; i++)
    if (i != first && s->near[i] <= c->nearest + 2 * c->reach) kept[c->candidate_count++] = given[i];
  c->candidates = kept;
  c->top += c->candidate_count;
}

void qmat_cube_corner(const qmat_solid_cube *c, int corner, double point[3]) {
  for (int k = 0; k < 3; k++) point[k] = c->centre[k] + (corner >> k & 1 ? c->half : -c->half);
}

bool qmat_cube_corner_counts(const qmat_cube_search *s, qmat_solid_cube *c, int corner) {
  signed char *known = &c->known[corner];
  if (*known < 0) {
    double point[3];
    qmat_cube_corner(c, corner, point);
    *known = qmat_surface_inside(s->surface, point) ||
             isfinite(qmat_surface_distance(s->surface, point, beside_surface, NULL, NULL));
  }
  return *known;
}

static void find_facets(qmat_cube_search *s, qmat_solid_cube *c, const qmat_solid_cube *around) {
  uint32_t *facets = s->stack + c->top;
  for (size_t i = 0; i < around->facet_count; i++) {
    double polygon[QMAT_CUBE_MOST_CORNERS][3];
    if (is_near(s, c, around->facets[i]) && qmat_cube_clip(s, c, around->facets[i], polygon) > 0)
      facets[c->facet_count++] = around->facets[i];
  }
  c->facets = facets;
  c->top += c->facet_count;
}

/* `around` has the candidates and facets of the cube around. */
static void search_cube(qmat_cube_search *s, const qmat_solid_cube *around, const double centre[3], double half,
                        int depth) {
  qmat_solid_cube c = {.half = half, .reach = half * sqrt(3.0), .depth = depth, .top = around->top};
  memcpy(c.centre, centre, sizeof c.centre);
  memset(c.known, -1, sizeof c.known);
  s->cubes++;
  filter_candidates(s, &c, around->candidates, around->candidate_count);
  if (s->visitor->skips_covered && c.nearest + c.reach + s->half_thickness + rounding <= 0) return;
  find_facets(s, &c, around);
  const bool is_known_inside = depth > 0 && around->facet_count == 0;
  if (c.facet_count == 0 && !is_known_inside && !qmat_surface_inside(s->surface, c.centre)) return;
  if (!s->visitor->visit(s, &c) || depth == QMAT_CUBE_DEEPEST) return;
  for (int i = 0; i < 8; i++) {
    double middle[3];
    for (int k = 0; k < 3; k++) middle[k] = centre[k] + (i >> k & 1 ? 0.5 : -0.5) * half;
    search_cube(s, &c, middle, 0.5 * half, depth + 1);
  }
}

/* The facets of each region, by their boxes: those of region i are items[starts[i] .. starts[i + 1]). */
typedef struct buckets {
  size_t *starts;
  uint32_t *items;
  size_t most; /* in one region */
} buckets;

static void range_of(const double *positions, const uint32_t *row, int range[3][2]) {
  for (int k = 0; k < 3; k++) {
    double low = INFINITY, high = -INFINITY;
    for (int i = 0; i < 3; i++) {
      const double x = positions[3 * (size_t)row[i] + (size_t)k];
      low = fmin(low, x);
      high = fmax(high, x);
    }
    range[k][0] = (int)fmax(floor((low + 0.5 - 1e-6) * GRID), 0);
    range[k][1] = (int)fmin(floor((high + 0.5 + 1e-6) * GRID), GRID - 1);
  }
}

static qmat_status fill_buckets(qmat_context *context, const qmat_surface *surface, const char *what, buckets *b) {
  const qmat_mesh *mesh = qmat_surface_mesh(surface);
  const double *positions = qmat_surface_positions(surface);
  const size_t regions = QMAT_CUBE_REGIONS;
  *b = (buckets){.starts = qmat_arena_calloc(&context->arena, regions + 2, sizeof *b->starts)};
  if (!b->starts) return qmat_fail_memory(context, what);
  for (int pass = 0; pass < 2; pass++) {
    for (size_t t = 0; t < mesh->triangle_count; t++) {
      int range[3][2];
      range_of(positions, &mesh->triangles[3 * t], range);
      for (int z = range[2][0]; z <= range[2][1]; z++)
        for (int y = range[1][0]; y <= range[1][1]; y++)
          for (int x = range[0][0]; x <= range[0][1]; x++) {
            const size_t id = (size_t)((z * GRID + y) * GRID + x);
            if (pass == 0)
              b->starts[id + 2]++;
            else
              b->items[b->starts[id + 1]++] = (uint32_t)t;
          }
    }
    if (pass > 0) break;
    for (size_t i = 0; i < regions; i++) {
      b->most = b->starts[i + 2] > b->most ? b->starts[i + 2] : b->most;
      b->starts[i + 2] += b->starts[i + 1];
    }
    b->items = qmat_arena_alloc(&context->arena, b->starts[regions + 1], sizeof *b->items);
    if (!b->items) return qmat_fail_memory(context, what);
  }
  return QMAT_OK;
}

static void search_region(qmat_cube_search *s, const buckets *b, size_t id, const uint32_t *all, size_t count) {
  const qmat_solid_cube around = {.candidates = all,
                                  .candidate_count = count,
                                  .facets = b->items + b->starts[id],
                                  .facet_count = b->starts[id + 1] - b->starts[id]};
  const double at[3] = {(double)(id % GRID), (double)(id / GRID % GRID), (double)(id / GRID / GRID)};
  double centre[3];
  for (int k = 0; k < 3; k++) centre[k] = (at[k] + 0.5) / GRID - 0.5;
  search_cube(s, &around, centre, 0.5 / GRID * (1 + 1e-6), 0);
  if (s->visitor->finish) s->visitor->finish(s->region);
}

qmat_status qmat_solid_cubes_search(qmat_context *context, const qmat_surface *surface, const qmat_shape_set *set,
                                    const qmat_cube_visitor *visitor) {
  const size_t count = set->shape_count, regions = QMAT_CUBE_REGIONS;
  const int threads = qmat_threads(context);
  buckets b;
  qmat_status status = fill_buckets(context, surface, visitor->what, &b);
  if (status != QMAT_OK) return status;
  const size_t room = (QMAT_CUBE_DEEPEST + 2) * (count + b.most);
  qmat_prepared_shape *shapes = qmat_arena_alloc(&context->arena, count, sizeof *shapes);
  uint32_t *all = qmat_arena_alloc(&context->arena, count, sizeof *all);
  uint32_t *stacks = qmat_arena_alloc(&context->arena, (size_t)threads, room * sizeof *stacks);
  double *near = qmat_arena_alloc(&context->arena, (size_t)threads, count * sizeof *near);
  atomic_bool stopped = false;
  char *found = qmat_arena_alloc(&context->arena, SLICE, visitor->region_size);
  if (!shapes || !all || !stacks || !near || !found) return qmat_fail_memory(context, visitor->what);
  for (size_t i = 0; i < count; i++) {
    qmat_shape_prepare(&shapes[i], set->spheres, &set->shapes[3 * i]);
    all[i] = (uint32_t)i;
  }
  for (size_t first = 0; first < regions && status == QMAT_OK; first += SLICE) {
    status = qmat_progress(context, first, regions, visitor->what);
    if (status != QMAT_OK) break;
    memset(found, 0, SLICE * visitor->region_size);
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1)
    for (size_t i = first; i < first + SLICE; i++) {
      const size_t thread = (size_t)omp_get_thread_num();
      if (thread == 0 && !atomic_load(&stopped)) /* the thread that runs the node */
        atomic_store(&stopped, qmat_progress(context, i, regions, visitor->what) != QMAT_OK);
      if (atomic_load(&stopped) || (visitor->skipped && visitor->skipped[i])) continue;
      qmat_cube_search s = {.surface = surface,
                            .positions = qmat_surface_positions(surface),
                            .triangles = qmat_surface_mesh(surface)->triangles,
                            .solid_count = qmat_solid_triangle_count(qmat_surface_mesh(surface)),
                            .half_thickness = qmat_surface_half_thickness(surface),
                            .shapes = shapes,
                            .visitor = visitor,
                            .stack = stacks + thread * room,
                            .near = near + thread * count,
                            .region = found + (i - first) * visitor->region_size};
      search_region(&s, &b, i, all, count);
    }
    if (atomic_load(&stopped)) status = QMAT_CANCELLED;
    for (size_t i = 0; i < SLICE; i++)
      if (visitor->gather(visitor->all, found + i * visitor->region_size) != QMAT_OK && status == QMAT_OK)
        status = qmat_fail_memory(context, visitor->what);
  }
  return status;
}
