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
  bool only_parts;
  qmat_uncovered *parts;
  size_t count, capacity;
  bool *covered;
  size_t next; /* the region that is gathered next */
} gathered;

/* How far the solid's part in the cube, and the sheets around their middle in it, may leave a shape, as far as that
 * exceeds `enough`; the worst point, and how far the solid reaches around it. -INFINITY where facets only touch it. */
static double leaves(const qmat_cube_search *s, qmat_solid_cube *c, uint32_t shape, double enough, double worst[3],
                     double *reach) {
  const qmat_prepared_shape *prepared = &s->shapes[shape];
  double largest = -INFINITY, corners[8][3], at[8], highest = -INFINITY;
  for (int i = 0; i < 8; i++) {
    qmat_cube_corner(c, i, corners[i]);
    at[i] = qmat_shape_distance(prepared, corners[i], NULL);
    if (!(at[i] > highest)) continue;
    highest = at[i];
    memcpy(worst, corners[i], sizeof corners[i]);
  }
  *reach = c->facet_count > 0 ? s->half_thickness : 0;
  if (c->facet_count == 0 || highest + *reach <= 0) return highest + *reach; /* all of the cube */
  for (size_t f = 0; f < c->facet_count && largest < enough; f++) {
    double polygon[QMAT_CUBE_MOST_CORNERS][3];
    const int count = qmat_cube_clip(s, c, c->facets[f], polygon);
    const double around = qmat_cube_facet_reach(s, c->facets[f]);
    for (int i = 0; i < count; i++) {
      const double value = qmat_shape_distance(prepared, polygon[i], NULL) + around;
      if (!(value > largest)) continue;
      largest = value;
      *reach = around;
      memcpy(worst, polygon[i], sizeof polygon[i]);
    }
  }
  for (int i = 0; i < 8 && largest < enough; i++) {
    if (!(at[i] > largest) || !qmat_cube_corner_counts(s, c, i)) continue;
    largest = at[i];
    *reach = 0;
    memcpy(worst, corners[i], sizeof corners[i]);
  }
  return largest;
}

static void finish(region *r, const qmat_uncovered *part) {
  r->bound = qmat_larger(r->bound, part->value);
  if (r->count < MOST_PARTS) r->parts[r->count++] = *part;
}

/* Divides a cube whose part of the solid no shape contains. */
static bool visit(const qmat_cube_search *s, qmat_solid_cube *c) {
  const gathered *all = s->visitor->all;
  const region *r = s->region;
  if (all->only_parts && r->count == MOST_PARTS) return false;
  qmat_uncovered part = {.value = INFINITY, .shape = c->candidates[0]};
  memcpy(part.point, c->centre, sizeof part.point);
  for (size_t i = 0; i < c->candidate_count; i++) {
    qmat_uncovered other = {.shape = c->candidates[i]};
    other.value = leaves(s, c, other.shape, part.value, other.point, &other.reach) + rounding;
    if (other.value <= 0) return false;
    if (other.value < part.value) part = other;
  }
  if (c->reach > all->tolerance && c->depth < QMAT_CUBE_DEEPEST && s->cubes < MOST_CUBES &&
      c->nearest + part.reach <= 4 * c->reach)
    return true;
  finish(s->region, &part);
  return false;
}

static qmat_status gather(void *data, void *found) {
  gathered *all = data;
  const region *r = found;
  all->covered[all->next++] = r->count == 0;
  all->bound = fmax(all->bound, r->bound);
  if (qmat_grow((void **)&all->parts, &all->capacity, all->count + r->count, sizeof *all->parts) != 0)
    return QMAT_ERROR_MEMORY;
  for (size_t i = 0; i < r->count; i++) all->parts[all->count++] = r->parts[i];
  return QMAT_OK;
}

qmat_status qmat_cover_bound_measure(qmat_context *context, const qmat_surface *surface, const qmat_shape_set *set,
                                     double tolerance, bool only_parts, const qmat_cover_bound *before,
                                     qmat_cover_bound *result) {
  gathered all = {.tolerance = tolerance,
                  .only_parts = only_parts,
                  .covered = qmat_arena_calloc(&context->arena, QMAT_CUBE_REGIONS, sizeof *all.covered)};
  if (!all.covered) return qmat_fail_memory(context, "the proof of colliders");
  const qmat_cube_visitor visitor = {.region_size = sizeof(region),
                                     .visit = visit,
                                     .gather = gather,
                                     .all = &all,
                                     .skipped = before ? before->covered : NULL,
                                     .skips_covered = true,
                                     .what = "regions searched"};
  const qmat_arena aside = qmat_arena_set_aside(&context->arena); /* a fit searches many times */
  qmat_status status = qmat_solid_cubes_search(context, surface, set, &visitor);
  qmat_arena_put_back(&context->arena, aside);
  *result = (qmat_cover_bound){.bound = all.bound, .count = all.count, .covered = all.covered};
  result->parts = qmat_arena_alloc(&context->arena, result->count, sizeof *all.parts);
  if (status == QMAT_OK && !result->parts) status = qmat_fail_memory(context, "the proof of colliders");
  if (status == QMAT_OK && result->count > 0) memcpy(result->parts, all.parts, result->count * sizeof *all.parts);
  qmat_free(all.parts);
  return status;
}
