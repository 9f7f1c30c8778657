/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/shape_merge.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/vector.h"

/* Up to six spheres of two shapes, and the best shape found for both. */
typedef struct pair {
  double spheres[6][4];
  int count;
  double best[3][4];
  uint32_t ids[3]; /* 0, 1 or 2 in `best`, as in a shape */
  double volume;
} pair;

/* Tries the hull of some of the spheres, grown by `growth` times what the others leave it by. */
static void try_hull(pair *p, const int chosen[3], double growth) {
  static const uint32_t all[3][3] = {{0, 0, 0}, {0, 1, 1}, {0, 1, 2}};
  const int width = chosen[1] == chosen[0] ? 1 : chosen[2] == chosen[1] ? 2 : 3;
  double spheres[3][4], left_by = 0;
  for (int k = 0; k < 3; k++) memcpy(spheres[k], p->spheres[chosen[k]], sizeof spheres[k]);
  qmat_prepared_shape shape;
  qmat_shape_prepare(&shape, spheres[0], all[width - 1]);
  for (int k = 0; k < p->count; k++)
    left_by = fmax(left_by, qmat_shape_distance(&shape, p->spheres[k], NULL) + p->spheres[k][3]);
  /* Without growth a hull that leaves much out must not win for being small. */
  for (int k = 0; k < 3; k++) spheres[k][3] += left_by;
  const double volume = qmat_shape_volume(spheres[0], all[width - 1]);
  if (!(volume < p->volume)) return;
  p->volume = volume;
  for (int k = 0; k < 3; k++) spheres[k][3] += (growth - 1) * left_by;
  memcpy(p->best, spheres, sizeof spheres);
  memcpy(p->ids, all[width - 1], sizeof p->ids);
}

static void join(const qmat_shape_set *set, size_t a, size_t b, qmat_shape_kind kind, double growth, pair *p) {
  *p = (pair){.volume = INFINITY};
  const size_t shapes[2] = {a, b};
  for (int s = 0; s < 2; s++) {
    const uint32_t *ids = &set->shapes[3 * shapes[s]];
    for (int k = 0; k < qmat_shape_width(ids); k++)
      memcpy(p->spheres[p->count++], &set->spheres[4 * (size_t)ids[k]], sizeof p->spheres[0]);
  }
  const int most = kind == QMAT_SHAPES_SPHERES ? 1 : kind == QMAT_SHAPES_CAPSULES ? 2 : 3;
  for (int i = 0; i < p->count; i++) {
    try_hull(p, (const int[]){i, i, i}, growth);
    for (int j = i + 1; j < p->count && most > 1; j++) {
      try_hull(p, (const int[]){i, j, j}, growth);
      for (int k = j + 1; k < p->count && most > 2; k++) try_hull(p, (const int[]){i, j, k}, growth);
    }
  }
  if (p->count != 2) return; /* the smallest sphere around two */
  const double *s = p->spheres[0], *t = p->spheres[1], length = qmat_point_distance(s, t);
  const double around[4] = {0, 0, 0, 0.5 * (length + s[3] + t[3])}, share = (around[3] - s[3]) / fmax(length, 1e-300);
  if (!(share > 0 && share < 1)) return;
  pair whole = {.count = 1, .volume = p->volume};
  for (int k = 0; k < 3; k++) whole.spheres[0][k] = s[k] + share * (t[k] - s[k]);
  whole.spheres[0][3] = around[3];
  try_hull(&whole, (const int[]){0, 0, 0}, growth);
  if (whole.volume < p->volume) *p = whole;
}

/* The distance between the nearest two spheres of two shapes, below 0 where they overlap. */
static double apart(const qmat_shape_set *set, size_t a, size_t b) {
  double least = INFINITY;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      const double *s = &set->spheres[4 * (size_t)set->shapes[3 * a + (size_t)i]],
                   *t = &set->spheres[4 * (size_t)set->shapes[3 * b + (size_t)j]];
      least = fmin(least, qmat_point_distance(s, t) - s[3] - t[3]);
    }
  return least;
}

/* The cheapest partner of shape `a` among those after it; `*cost` INFINITY: none. Neighbours come before others. */
static void find_partner(const qmat_shape_set *set, size_t a, qmat_shape_kind kind, double growth, double *cost,
                         size_t *partner) {
  *cost = INFINITY;
  *partner = a;
  for (int pass = 0; pass < 2 && !isfinite(*cost); pass++)
    for (size_t b = a + 1; b < set->shape_count; b++) {
      if (!qmat_shape_set_same_joint(set, a, b) || (pass == 0 && apart(set, a, b) > 0)) continue;
      pair p;
      join(set, a, b, kind, growth, &p);
      const double grown = p.volume - qmat_shape_volume(set->spheres, &set->shapes[3 * a]) -
                           qmat_shape_volume(set->spheres, &set->shapes[3 * b]) + (pass > 0 ? 1 : 0);
      if (grown < *cost) {
        *cost = grown;
        *partner = b;
      }
    }
}

/* Replaces shapes a and b by their joint shape, in the place of a; the last shape moves to the place of b. */
static void replace(qmat_shape_set *set, size_t a, size_t b, const pair *p) {
  const uint32_t joint = set->joints ? set->joints[set->shapes[3 * a]] : 0;
  for (int k = 0; k < 3; k++) {
    memcpy(&set->spheres[4 * (set->sphere_count + (size_t)k)], p->best[k], sizeof p->best[k]);
    if (set->joints) set->joints[set->sphere_count + (size_t)k] = joint;
    set->shapes[3 * a + (size_t)k] = (uint32_t)(set->sphere_count + p->ids[k]);
  }
  set->sphere_count += 3;
  set->shape_count--;
  memmove(&set->shapes[3 * b], &set->shapes[3 * set->shape_count], 3 * sizeof *set->shapes);
}

qmat_status qmat_shape_set_merge(qmat_context *context, qmat_shape_set *set, qmat_shape_kind kind, double growth,
                                 size_t most) {
  const size_t given = set->shape_count;
  if (given <= most) return QMAT_OK;
  const size_t room = set->sphere_count + 3 * given;
  double *spheres = qmat_arena_alloc(&context->arena, room, 4 * sizeof *spheres);
  double *costs = qmat_arena_alloc(&context->arena, given, sizeof *costs);
  size_t *partners = qmat_arena_alloc(&context->arena, given, sizeof *partners);
  if (!spheres || !costs || !partners) return qmat_fail_memory(context, "the colliders");
  memcpy(spheres, set->spheres, 4 * set->sphere_count * sizeof *spheres);
  set->spheres = spheres;
  if (set->joints) {
    uint32_t *joints = qmat_arena_alloc(&context->arena, room, sizeof *joints);
    if (!joints) return qmat_fail_memory(context, "the colliders");
    set->joints = memcpy(joints, set->joints, set->sphere_count * sizeof *joints);
  }
  for (size_t i = 0; i < given; i++) costs[i] = NAN; /* not known */
  while (set->shape_count > most) {
    size_t best = 0;
    for (size_t i = 0; i < set->shape_count; i++) {
      if (isnan(costs[i])) {
        const qmat_status status = qmat_progress(context, given - set->shape_count, given - most, "shapes joined");
        if (status != QMAT_OK) return status;
        find_partner(set, i, kind, growth, &costs[i], &partners[i]);
      }
      if (costs[i] < costs[best]) best = i;
    }
    if (isinf(costs[best])) break;
    const size_t a = best, b = partners[best], last = set->shape_count - 1;
    pair p;
    join(set, a, b, kind, growth, &p);
    replace(set, a, b, &p);
    costs[b] = costs[last];
    partners[b] = partners[last];
    /* Partners that changed or moved, and shapes that the joint shape or the moved one now follows. */
    for (size_t i = 0; i < set->shape_count; i++)
      if (i == a || i == b || partners[i] == a || partners[i] == b || partners[i] == last || i < a || i < b)
        costs[i] = NAN;
  }
  return qmat_shape_set_reduce(context, set);
}

/* A shape in the order in which shapes are kept. */
typedef struct ranked_shape {
  uint32_t group, id;
  double volume;
} ranked_shape;

/* By groups; the largest of a group first, the first of equal ones. */
static int compare_ranked(const void *left, const void *right) {
  const ranked_shape *a = left, *b = right;
  if (a->group != b->group) return a->group < b->group ? -1 : 1;
  if (a->volume != b->volume) return a->volume > b->volume ? -1 : 1;
  return a->id < b->id ? -1 : a->id > b->id;
}

qmat_status qmat_shape_set_keep_largest(qmat_context *context, qmat_shape_set *set, size_t most) {
  const size_t count = set->shape_count;
  if (count <= most) return QMAT_OK;
  ranked_shape *order = qmat_arena_alloc(&context->arena, count, sizeof *order);
  uint8_t *stays = qmat_arena_calloc(&context->arena, count, 1);
  if (!order || !stays) return qmat_fail_memory(context, "the colliders");
  for (size_t i = 0; i < count; i++) {
    const uint32_t *ids = &set->shapes[3 * i];
    order[i] = (ranked_shape){set->joints ? set->joints[ids[0]] : 0, (uint32_t)i, qmat_shape_volume(set->spheres, ids)};
  }
  qsort(order, count, sizeof *order, compare_ranked);
  /* From joints to two groups: the largest shapes of joints, and all others. */
  size_t kept = 0, joints = 0;
  for (size_t i = 0; i < count; i++) {
    const bool leads = i == 0 || !qmat_shape_set_same_joint(set, order[i].id, order[i - 1].id);
    order[i].group = !leads;
    joints += leads;
  }
  qsort(order, count, sizeof *order, compare_ranked);
  for (size_t i = 0; i < count && (i < most || i < joints); i++) stays[order[i].id] = 1;
  for (size_t i = 0; i < count; i++)
    if (stays[i]) memmove(&set->shapes[3 * kept++], &set->shapes[3 * i], 3 * sizeof *set->shapes);
  set->shape_count = kept;
  return qmat_shape_set_reduce(context, set);
}
