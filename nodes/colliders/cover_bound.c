/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/cover_bound.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "nodes/colliders/solid_cubes.h"

/* Each region keeps its first parts and stops splitting after a number of cubes; what is left then counts with its
 * bound. */
enum { MOST_PARTS = 256, MOST_CUBES = 1000000 };

/* Above this a shape does not contain a point: a margin for rounding, which is part of the bound. */
static const double rounding = 1e-9;

typedef struct region {
  double bound;
  size_t count;
  qmat_uncovered parts[MOST_PARTS];
} region;

typedef struct gathered {
  double tolerance, bound;
  qmat_uncovered *parts;
  size_t count, capacity;
} gathered;

/* How far the solid's part in the cube may leave a shape, as far as it exceeds `enough`; the worst point. -INFINITY
 * where facets only touch the cube. */
static double leaves(const qmat_cube_search *s, qmat_solid_cube *c, uint32_t shape, double enough, double worst[3]) {
  const qmat_prepared_shape *prepared = &s->shapes[shape];
  double largest = -INFINITY, corners[8][3], at[8], highest = -INFINITY;
  for (int i = 0; i < 8; i++) {
    qmat_cube_corner(c, i, corners[i]);
    at[i] = qmat_shape_distance(prepared, corners[i], NULL);
    if (!(at[i] > highest)) continue;
    highest = at[i];
    memcpy(worst, corners[i], sizeof corners[i]);
  }
  if (c->facet_count == 0 || highest <= 0) return highest; /* all of the cube */
  for (size_t f = 0; f < c->facet_count && largest < enough; f++) {
    double polygon[QMAT_CUBE_MOST_CORNERS][3];
    const int count = qmat_cube_clip(s, c, c->facets[f], polygon);
    for (int i = 0; i < count; i++) {
      const double value = qmat_shape_distance(prepared, polygon[i], NULL);
      if (!(value > largest)) continue;
      largest = value;
      memcpy(worst, polygon[i], sizeof polygon[i]);
    }
  }
  for (int i = 0; i < 8 && largest < enough; i++) {
    if (!(at[i] > largest) || !qmat_cube_corner_counts(s, c, i)) continue;
    largest = at[i];
    memcpy(worst, corners[i], sizeof corners[i]);
  }
  return largest;
}

static void finish(region *r, uint32_t shape, double value, const double worst[3]) {
  r->bound = qmat_larger(r->bound, value);
  if (r->count == MOST_PARTS) return;
  qmat_uncovered *part = &r->parts[r->count++];
  *part = (qmat_uncovered){.value = value, .shape = shape};
  memcpy(part->point, worst, sizeof part->point);
}

/* Divides a cube whose part of the solid no shape contains. */
static bool visit(const qmat_cube_search *s, qmat_solid_cube *c) {
  const gathered *all = s->visitor->all;
  double value = INFINITY, worst[3];
  uint32_t shape = c->candidates[0];
  memcpy(worst, c->centre, sizeof worst);
  for (size_t i = 0; i < c->candidate_count; i++) {
    double at[3];
    const double of_shape = leaves(s, c, c->candidates[i], value, at) + rounding;
    if (of_shape <= 0) return false;
    if (!(of_shape < value)) continue;
    value = of_shape;
    shape = c->candidates[i];
    memcpy(worst, at, sizeof worst);
  }
  if (c->reach > all->tolerance && c->depth < QMAT_CUBE_DEEPEST && s->cubes < MOST_CUBES && c->nearest <= 4 * c->reach)
    return true;
  finish(s->region, shape, value, worst);
  return false;
}

static qmat_status gather(void *data, void *found) {
  gathered *all = data;
  const region *r = found;
  all->bound = fmax(all->bound, r->bound);
  if (qmat_grow((void **)&all->parts, &all->capacity, all->count + r->count, sizeof *all->parts) != 0)
    return QMAT_ERROR_MEMORY;
  for (size_t i = 0; i < r->count; i++) all->parts[all->count++] = r->parts[i];
  return QMAT_OK;
}

qmat_status qmat_cover_bound_measure(qmat_context *context, const qmat_surface *surface, const qmat_shape_set *set,
                                     double tolerance, qmat_cover_bound *result) {
  gathered all = {.tolerance = tolerance};
  const qmat_cube_visitor visitor = {.region_size = sizeof(region),
                                     .visit = visit,
                                     .gather = gather,
                                     .all = &all,
                                     .skips_covered = true,
                                     .what = "regions searched"};
  qmat_status status = qmat_solid_cubes_search(context, surface, set, &visitor);
  *result = (qmat_cover_bound){.bound = all.bound, .count = all.count};
  result->parts = qmat_arena_alloc(&context->arena, result->count, sizeof *all.parts);
  if (status == QMAT_OK && !result->parts) status = qmat_fail_memory(context, "the proof of colliders");
  if (status == QMAT_OK && result->count > 0) memcpy(result->parts, all.parts, result->count * sizeof *all.parts);
  qmat_free(all.parts);
  return status;
}
