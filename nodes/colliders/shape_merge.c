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

/* The shapes that are joined, and the cheapest partner of each among those after it. */
typedef struct merging {
  qmat_shape_set *set;
  qmat_shape_kind kind;
  double growth;
  size_t *partners;
  double *costs;   /* the growth of volume; INFINITY: there is no partner; NAN: not known */
  uint8_t *is_far; /* whether the partner does not touch the shape: one that does is better at any cost */
} merging;

/* Makes shape `b` the partner of an earlier one where that is cheaper, or as cheap and b comes first. */
static void offer(const merging *m, size_t i, size_t b, bool is_far) {
  const qmat_shape_set *set = m->set;
  pair p;
  join(set, i, b, m->kind, m->growth, &p);
  const double cost = p.volume - qmat_shape_volume(set->spheres, &set->shapes[3 * i]) -
                      qmat_shape_volume(set->spheres, &set->shapes[3 * b]) + is_far;
  const bool is_first = !isfinite(m->costs[i]) || (m->is_far[i] && !is_far);
  if (!isfinite(cost) || !(is_first || cost < m->costs[i] || (cost == m->costs[i] && b < m->partners[i]))) return;
  m->costs[i] = cost;
  m->partners[i] = b;
  m->is_far[i] = is_far;
}

/* Offers a shape that has changed. One far away counts only where none is near. */
static void offer_changed(const merging *m, size_t i, size_t b) {
  if (!qmat_shape_set_same_joint(m->set, i, b)) return;
  const bool is_far = apart(m->set, i, b) > 0;
  if (!is_far || m->is_far[i] || isinf(m->costs[i])) offer(m, i, b, is_far);
}

static void find_partner(const merging *m, size_t i) {
  m->costs[i] = INFINITY;
  m->partners[i] = i;
  m->is_far[i] = 0;
  for (int far = 0; far < 2 && isinf(m->costs[i]); far++)
    for (size_t b = i + 1; b < m->set->shape_count; b++)
      if (qmat_shape_set_same_joint(m->set, i, b) && (far == 1 || apart(m->set, i, b) <= 0)) offer(m, i, b, far == 1);
}

/* The joint that moves a shape; 0 where nothing is skinned. */
static uint32_t joint_of(const qmat_shape_set *set, size_t shape) {
  return set->joints ? set->joints[set->shapes[3 * shape]] : 0;
}

/* Replaces shapes a and b by their joint shape, in the place of a; the last shape moves to the place of b. */
static void replace(qmat_shape_set *set, size_t a, size_t b, const pair *p) {
  const uint32_t joint = joint_of(set, a);
  for (int k = 0; k < 3; k++) {
    memcpy(&set->spheres[4 * (set->sphere_count + (size_t)k)], p->best[k], sizeof p->best[k]);
    if (set->joints) set->joints[set->sphere_count + (size_t)k] = joint;
    set->shapes[3 * a + (size_t)k] = (uint32_t)(set->sphere_count + p->ids[k]);
  }
  set->sphere_count += 3;
  set->shape_count--;
  memmove(&set->shapes[3 * b], &set->shapes[3 * set->shape_count], 3 * sizeof *set->shapes);
}

/* Joins shape `a` and its partner, and updates the partners of the others. */
static void join_partners(merging *m, size_t a) {
  const size_t b = m->partners[a], last = m->set->shape_count - 1;
  pair p;
  join(m->set, a, b, m->kind, m->growth, &p);
  replace(m->set, a, b, &p);
  m->costs[a] = m->costs[b] = NAN;
  for (size_t i = 0; i < last; i++) {
    const size_t partner = m->partners[i];
    if (partner == a || partner == b || (partner == last && i > b)) m->costs[i] = NAN;
    if (isnan(m->costs[i])) continue;
    if (partner == last) m->partners[i] = b; /* it has moved */
    if (i < a) offer_changed(m, i, a);
    if (i < b && b < last && partner != last) offer_changed(m, i, b); /* of equal partners the first is taken */
  }
}

qmat_status qmat_shape_set_merge(qmat_context *context, qmat_shape_set *set, qmat_shape_kind kind, double growth,
                                 size_t most) {
  const size_t given = set->shape_count;
  if (given <= most) return QMAT_OK;
  const size_t room = set->sphere_count + 3 * given;
  double *spheres = qmat_arena_alloc(&context->arena, room, 4 * sizeof *spheres);
  merging m = {.set = set,
               .kind = kind,
               .growth = growth,
               .partners = qmat_arena_alloc(&context->arena, given, sizeof *m.partners),
               .costs = qmat_arena_alloc(&context->arena, given, sizeof *m.costs),
               .is_far = qmat_arena_alloc(&context->arena, given, sizeof *m.is_far)};
  if (!spheres || !m.partners || !m.costs || !m.is_far) return qmat_fail_memory(context, "the colliders");
  memcpy(spheres, set->spheres, 4 * set->sphere_count * sizeof *spheres);
  set->spheres = spheres;
  if (set->joints) {
    uint32_t *joints = qmat_arena_alloc(&context->arena, room, sizeof *joints);
    if (!joints) return qmat_fail_memory(context, "the colliders");
    set->joints = memcpy(joints, set->joints, set->sphere_count * sizeof *joints);
  }
  for (size_t i = 0; i < given; i++) m.costs[i] = NAN;
  while (set->shape_count > most) {
    size_t best = 0;
    for (size_t i = 0; i < set->shape_count; i++) {
      if (isnan(m.costs[i])) {
        const qmat_status status = qmat_progress(context, given - set->shape_count, given - most, "shapes joined");
        if (status != QMAT_OK) return status;
        find_partner(&m, i);
      }
      if (m.costs[i] < m.costs[best]) best = i;
    }
    if (isinf(m.costs[best])) break;
    join_partners(&m, best);
  }
  return qmat_shape_set_reduce(context, set);
}

qmat_status qmat_shape_set_find_lost(qmat_context *context, const qmat_shape_set *given, const qmat_shape_set *set,
                                     qmat_shape_set *lost) {
  size_t joints = 0;
  for (size_t i = 0; i < given->shape_count; i++)
    if (joint_of(given, i) >= joints) joints = (size_t)joint_of(given, i) + 1;
  uint8_t *has_shape = qmat_arena_calloc(&context->arena, joints, 1);
  *lost = *given;
  lost->shape_count = 0;
  lost->shapes = qmat_arena_alloc(&context->arena, given->shape_count, 3 * sizeof *lost->shapes);
  lost->spheres = qmat_arena_alloc(&context->arena, given->sphere_count, 4 * sizeof *lost->spheres);
  if (!has_shape || !lost->shapes || !lost->spheres) return qmat_fail_memory(context, "the colliders");
  memcpy(lost->spheres, given->spheres, 4 * given->sphere_count * sizeof *lost->spheres);
  for (size_t i = 0; i < set->shape_count; i++) has_shape[joint_of(set, i)] = 1;
  for (size_t i = 0; i < given->shape_count; i++)
    if (!has_shape[joint_of(given, i)])
      memcpy(&lost->shapes[3 * lost->shape_count++], &given->shapes[3 * i], 3 * sizeof *lost->shapes);
  return QMAT_OK;
}

qmat_status qmat_shape_set_append(qmat_context *context, qmat_shape_set *set, const qmat_shape_set *other) {
  const qmat_shape_set *const parts[] = {set, other};
  const size_t spheres = set->sphere_count + other->sphere_count, shapes = set->shape_count + other->shape_count;
  qmat_shape_set all = {.spheres = qmat_arena_alloc(&context->arena, spheres, 4 * sizeof *all.spheres),
                        .shapes = qmat_arena_alloc(&context->arena, shapes, 3 * sizeof *all.shapes),
                        .joints = set->joints ? qmat_arena_alloc(&context->arena, spheres, sizeof *all.joints) : NULL};
  if (!all.spheres || !all.shapes || (set->joints && !all.joints)) return qmat_fail_memory(context, "the colliders");
  for (int p = 0; p < 2; p++) {
    for (size_t i = 0; i < 3 * parts[p]->shape_count; i++)
      all.shapes[3 * all.shape_count + i] = parts[p]->shapes[i] + (uint32_t)all.sphere_count;
    for (size_t i = 0; i < parts[p]->sphere_count; i++) {
      if (all.joints) all.joints[all.sphere_count] = parts[p]->joints[i];
      memcpy(&all.spheres[4 * all.sphere_count++], &parts[p]->spheres[4 * i], 4 * sizeof *all.spheres);
    }
    all.shape_count += parts[p]->shape_count;
  }
  *set = all;
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
    order[i] = (ranked_shape){joint_of(set, i), (uint32_t)i, qmat_shape_volume(set->spheres, ids)};
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
