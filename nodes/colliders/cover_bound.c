/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/cover_bound.h"

#include <math.h>
#include <omp.h>
#include <string.h>

#include "core/geometry/vector.h"

/* The unit frame's box is cut into GRID^3 regions, which are searched independently. Each region keeps its first parts
 * and stops splitting after a number of cubes; what is left then counts with its bound. */
enum { GRID = 16, MOST_PARTS = 24, MOST_CUBES = 1000000, DEEPEST = 16, SLICE = 64, MOST_CORNERS = 9 };

/* Above this a shape does not contain a point: a margin for rounding, which is part of the bound. */
static const double rounding = 1e-9;
static const double beside_surface = 1e-6;

typedef struct region {
  double bound;
  size_t count;
  qmat_uncovered parts[MOST_PARTS];
} region;

typedef struct search {
  const qmat_surface *surface;
  const double *positions;
  const uint32_t *triangles;
  const qmat_prepared_shape *shapes;
  double tolerance;
  uint32_t *stack; /* of candidates and facets, level by level */
  double *near;    /* distances of the candidates of one cube */
  size_t cubes;
  region *region;
} search;

typedef struct cube {
  double centre[3], half;
  uint32_t *candidates, *facets; /* on the stack */
  size_t candidate_count, facet_count, top;
} cube;

/* The convex polygon of a triangle in a cube; its number of corners. */
static int clip(const search *s, const cube *c, uint32_t facet, double polygon[MOST_CORNERS][3]) {
  double other[MOST_CORNERS][3];
  int count = 3;
  for (int k = 0; k < 3; k++)
    memcpy(polygon[k], &s->positions[3 * (size_t)s->triangles[3 * (size_t)facet + (size_t)k]], sizeof polygon[k]);
  for (int plane = 0; plane < 6 && count > 0; plane++) {
    const int axis = plane / 2;
    const double sign = plane % 2 ? 1 : -1, limit = c->half * (1 + 1e-9);
    int kept = 0;
    for (int i = 0; i < count; i++) {
      const double *p = polygon[i], *q = polygon[(i + 1) % count];
      const double a = sign * (p[axis] - c->centre[axis]) - limit, b = sign * (q[axis] - c->centre[axis]) - limit;
      if (a <= 0) memcpy(other[kept++], p, sizeof other[0]);
      if ((a < 0 && b > 0) || (a > 0 && b < 0)) {
        const double t = a / (a - b);
        for (int k = 0; k < 3; k++) other[kept][k] = p[k] + t * (q[k] - p[k]);
        kept++;
      }
    }
    memcpy(polygon, other, sizeof other);
    count = kept;
  }
  return count;
}

/* Whether the facet's box meets the cube. */
static bool is_near(const search *s, const cube *c, uint32_t facet) {
  const uint32_t *row = &s->triangles[3 * (size_t)facet];
  for (int k = 0; k < 3; k++) {
    const double x = s->positions[3 * (size_t)row[0] + (size_t)k], y = s->positions[3 * (size_t)row[1] + (size_t)k],
                 z = s->positions[3 * (size_t)row[2] + (size_t)k];
    const double limit = c->half * (1 + 1e-9);
    if (qmat_smaller(x, qmat_smaller(y, z)) > c->centre[k] + limit ||
        qmat_larger(x, qmat_larger(y, z)) < c->centre[k] - limit)
      return false;
  }
  return true;
}

/* Keeps of the given shapes those that are nearest to some point of the cube. The nearest to its centre comes first;
 * its distance is returned. */
static double filter_candidates(search *s, cube *c, const uint32_t *given, size_t count, double reach) {
  double best = INFINITY;
  size_t first = 0;
  for (size_t i = 0; i < count; i++) {
    s->near[i] = qmat_shape_distance(&s->shapes[given[i]], c->centre, NULL);
    if (s->near[i] < best) {
      best = s->near[i];
      first = i;
    }
  }
  c->candidates = s->stack + c->top;
  c->candidates[0] = given[first];
  c->candidate_count = 1;
  for (size_t i = 0; i < count; i++)
    if (i != first && s->near[i] <= best + 2 * reach) c->candidates[c->candidate_count++] = given[i];
  c->top += c->candidate_count;
  return best;
}

static void corner_of(const cube *c, int corner, double point[3]) {
  for (int k = 0; k < 3; k++) point[k] = c->centre[k] + (corner >> k & 1 ? c->half : -c->half);
}

/* Whether a corner of the cube may belong to the solid: 1 or 0, remembered in `known` (-1: not tested yet). */
static bool corner_counts(const search *s, const double point[3], signed char *known) {
  if (*known < 0)
    *known = qmat_surface_inside(s->surface, point) ||
             isfinite(qmat_surface_distance(s->surface, point, beside_surface, NULL, NULL));
  return *known;
}

/* How far the solid's part in the cube may leave a shape, as far as it exceeds `enough`; the worst point. */
static double leaves(const search *s, const cube *c, uint32_t shape, bool has_surface, signed char known[8],
                     double enough, double worst[3]) {
  const qmat_prepared_shape *prepared = &s->shapes[shape];
  double largest = -INFINITY, corners[8][3], at[8], highest = -INFINITY;
  for (int i = 0; i < 8; i++) {
    corner_of(c, i, corners[i]);
    at[i] = qmat_shape_distance(prepared, corners[i], NULL);
    if (at[i] > highest) {
      highest = at[i];
      if (!has_surface) memcpy(worst, corners[i], sizeof corners[i]);
    }
  }
  if (!has_surface || highest <= 0) return highest; /* all of the cube */
  for (size_t f = 0; f < c->facet_count && largest < enough; f++) {
    double polygon[MOST_CORNERS][3];
    const int count = clip(s, c, c->facets[f], polygon);
    for (int i = 0; i < count; i++) {
      const double value = qmat_shape_distance(prepared, polygon[i], NULL);
      if (!(value > largest)) continue;
      largest = value;
      memcpy(worst, polygon[i], sizeof polygon[i]);
    }
  }
  for (int i = 0; i < 8 && largest < enough; i++) {
    if (!(at[i] > largest) || !corner_counts(s, corners[i], &known[i])) continue;
    largest = at[i];
    memcpy(worst, corners[i], sizeof corners[i]);
  }
  return largest;
}

static void finish(search *s, uint32_t shape, double value, const double worst[3]) {
  region *r = s->region;
  r->bound = qmat_larger(r->bound, value);
  if (r->count == MOST_PARTS) return;
  qmat_uncovered *part = &r->parts[r->count++];
  *part = (qmat_uncovered){.value = value, .shape = shape};
  memcpy(part->point, worst, sizeof part->point);
}

/* `candidates` and `facets` are those of the cube around. */
static void search_cube(search *s, const cube *around, const double centre[3], double half, int depth) {
  cube c = {.half = half, .top = around->top};
  const double reach = half * sqrt(3.0);
  memcpy(c.centre, centre, sizeof c.centre);
  s->cubes++;
  const double best = filter_candidates(s, &c, around->candidates, around->candidate_count, reach);
  if (best + reach + rounding <= 0) return;
  c.facets = s->stack + c.top;
  for (size_t i = 0; i < around->facet_count; i++) {
    double polygon[MOST_CORNERS][3];
    if (is_near(s, &c, around->facets[i]) && clip(s, &c, around->facets[i], polygon) > 0)
      c.facets[c.facet_count++] = around->facets[i];
  }
  c.top += c.facet_count;
  const bool has_surface = c.facet_count > 0;
  if (!has_surface && !qmat_surface_inside(s->surface, c.centre)) return;

  signed char known[8];
  double value = INFINITY, worst[3];
  uint32_t shape = c.candidates[0];
  memset(known, -1, sizeof known);
  memcpy(worst, c.centre, sizeof worst);
  for (size_t i = 0; i < c.candidate_count; i++) {
    double at[3];
    const double of_shape = leaves(s, &c, c.candidates[i], has_surface, known, value, at) + rounding;
    if (of_shape <= 0) return;
    if (!(of_shape < value)) continue;
    value = of_shape;
    shape = c.candidates[i];
    memcpy(worst, at, sizeof worst);
  }
  if (value == -INFINITY) return; /* facets only touch the cube */
  if (reach <= s->tolerance || depth == DEEPEST || s->cubes >= MOST_CUBES || best > 4 * reach) {
    finish(s, shape, value, worst);
    return;
  }
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

static qmat_status fill_buckets(qmat_context *context, const qmat_surface *surface, buckets *b) {
  const qmat_mesh *mesh = qmat_surface_mesh(surface);
  const double *positions = qmat_surface_positions(surface);
  const size_t regions = (size_t)GRID * GRID * GRID;
  *b = (buckets){.starts = qmat_arena_calloc(&context->arena, regions + 2, sizeof *b->starts)};
  if (!b->starts) return qmat_fail_memory(context, "the proof of colliders");
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
    if (!b->items) return qmat_fail_memory(context, "the proof of colliders");
  }
  return QMAT_OK;
}

qmat_status qmat_cover_bound_measure(qmat_context *context, const qmat_surface *surface, const qmat_shape_set *set,
                                     double tolerance, qmat_cover_bound *result) {
  const size_t count = set->shape_count, regions = (size_t)GRID * GRID * GRID;
  const int threads = qmat_threads(context);
  buckets b;
  *result = (qmat_cover_bound){.bound = 0};
  qmat_status status = fill_buckets(context, surface, &b);
  if (status != QMAT_OK) return status;
  const size_t room = (DEEPEST + 2) * (count + b.most);
  qmat_prepared_shape *shapes = qmat_arena_alloc(&context->arena, count, sizeof *shapes);
  uint32_t *all = qmat_arena_alloc(&context->arena, count, sizeof *all);
  uint32_t *stacks = qmat_arena_alloc(&context->arena, (size_t)threads, room * sizeof *stacks);
  double *near = qmat_arena_alloc(&context->arena, (size_t)threads, count * sizeof *near);
  region *found = qmat_arena_alloc(&context->arena, SLICE, sizeof *found);
  size_t capacity = 0;
  if (!shapes || !all || !stacks || !near || !found) return qmat_fail_memory(context, "the proof of colliders");
  for (size_t i = 0; i < count; i++) {
    qmat_shape_prepare(&shapes[i], set->spheres, &set->shapes[3 * i]);
    all[i] = (uint32_t)i;
  }
  qmat_uncovered *parts = NULL;
  for (size_t first = 0; first < regions && status == QMAT_OK; first += SLICE) {
    status = qmat_progress(context, first, regions, "regions searched");
    if (status != QMAT_OK) break;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1)
    for (size_t i = first; i < first + SLICE; i++) {
      const size_t thread = (size_t)omp_get_thread_num();
      search s = {.surface = surface,
                  .positions = qmat_surface_positions(surface),
                  .triangles = qmat_surface_mesh(surface)->triangles,
                  .shapes = shapes,
                  .tolerance = tolerance,
                  .stack = stacks + thread * room,
                  .near = near + thread * count,
                  .region = &found[i - first]};
      const cube around = {.candidates = all,
                           .candidate_count = count,
                           .facets = b.items + b.starts[i],
                           .facet_count = b.starts[i + 1] - b.starts[i]};
      const double at[3] = {(double)(i % GRID), (double)(i / GRID % GRID), (double)(i / GRID / GRID)};
      double centre[3];
      for (int k = 0; k < 3; k++) centre[k] = (at[k] + 0.5) / GRID - 0.5;
      *s.region = (region){.bound = 0};
      search_cube(&s, &around, centre, 0.5 / GRID * (1 + 1e-6), 0);
    }
    for (size_t i = 0; i < SLICE; i++) {
      result->bound = fmax(result->bound, found[i].bound);
      if (qmat_grow((void **)&parts, &capacity, result->count + found[i].count, sizeof *parts) != 0)
        status = qmat_fail_memory(context, "the proof of colliders");
      for (size_t k = 0; k < found[i].count && status == QMAT_OK; k++) parts[result->count++] = found[i].parts[k];
    }
  }
  result->parts = qmat_arena_alloc(&context->arena, result->count, sizeof *parts);
  if (status == QMAT_OK && !result->parts) status = qmat_fail_memory(context, "the proof of colliders");
  if (status == QMAT_OK && result->count > 0) memcpy(result->parts, parts, result->count * sizeof *parts);
  qmat_free(parts);
  return status;
}
