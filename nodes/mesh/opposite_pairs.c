/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/opposite_pairs.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/triangle.h"
#include "nodes/mesh/half_edges.h"

/* A set encloses nothing when its volume is less than this share of its area to the power 3/2. */
static const double least_volume = 1e-5;
/* Half-edges between two looks at whether the run is cancelled. */
enum { POLL = 65536 };

static uint32_t third_corner(const uint32_t *triangles, uint32_t half_edge) {
  return triangles[half_edge - half_edge % 3 + (half_edge + 2) % 3];
}

/* ---- pairs ---- */

/* A triangle at the edge of its two lowest corners. */
typedef struct wing {
  uint32_t third, triangle;
  bool rises;
} wing;

static int compare_wings(const void *left, const void *right) {
  const wing *a = left, *b = right;
  if (a->third != b->third) return a->third < b->third ? -1 : 1;
  if (a->rises != b->rises) return a->rises ? -1 : 1;
  return (a->triangle > b->triangle) - (a->triangle < b->triangle);
}

/* Pairs wings of the same corners: the first that rises with the first that falls, and so on. */
static void pair_wings(wing *wings, size_t count, uint8_t *classes) {
  if (count < 2) return;
  qsort(wings, count, sizeof *wings, compare_wings);
  for (size_t first = 0, last; first < count; first = last) {
    size_t falls = first;
    while (falls < count && wings[falls].third == wings[first].third && wings[falls].rises) falls++;
    for (last = falls; last < count && wings[last].third == wings[first].third;) last++;
    for (size_t i = first, k = falls; i < falls && k < last; i++, k++) {
      const uint32_t a = wings[i].triangle, b = wings[k].triangle;
      classes[a < b ? a : b] = 1;
      classes[a < b ? b : a] = 2;
    }
  }
}

qmat_status qmat_find_opposite_pairs(qmat_context *context, size_t vertex_count, size_t count,
                                     const uint32_t *triangles, uint8_t *classes) {
  qmat_half_edges e;
  qmat_status status = qmat_half_edges_sort(context, vertex_count, count, triangles, &e);
  wing *wings = NULL;
  size_t capacity = 0;
  for (size_t first = 0, last, poll = 0; status == QMAT_OK && first < e.count; first = last) {
    last = qmat_edge_last(&e, first);
    const uint32_t high = qmat_half_edge_high(&e, e.order[first]);
    size_t found = 0;
    if (last - first > capacity && qmat_grow((void **)&wings, &capacity, last - first, sizeof *wings) != 0)
      status = qmat_fail_memory(context, "the opposite triangles");
    for (size_t i = first; status == QMAT_OK && i < last; i++) {
      const uint32_t h = e.order[i], third = third_corner(e.triangles, h);
      if (third > high) wings[found++] = (wing){third, h / 3, qmat_half_edge_rises(&e, h)};
    }
    pair_wings(wings, found, classes);
    if (status == QMAT_OK && last >= poll) {
      status = qmat_progress(context, first, e.count, "edges");
      poll = last + POLL;
    }
  }
  qmat_free(wings);
  return status;
}

/* ---- closed surfaces of pairs ---- */

enum { UNSEEN = 0, AS_GIVEN = 1, TURNED = 2 };

/* Bounds of a triangle in a projection: least and largest of both coordinates. */
typedef struct shadow {
  double low[2], high[2];
} shadow;

typedef struct pair_sets {
  qmat_context *context;
  const double *positions;
  size_t count, plain_count;
  uint32_t *pairs;
  const uint32_t *plain;
  uint32_t *partners; /* per half-edge: the one of the other pair at its edge; UINT32_MAX: not two pairs */
  uint8_t *states;    /* per triangle */
  uint32_t *found;    /* the triangles of a set */
  shadow *shadows;    /* per plain triangle; made when they are needed */
} pair_sets;

static qmat_status fail_shortage(const pair_sets *s) {
  return qmat_fail_memory(s->context, "the opposite triangles");
}

static const double *corner(const pair_sets *s, const uint32_t *triangles, size_t t, size_t k) {
  return s->positions + 3 * (size_t)triangles[3 * t + k];
}

static qmat_status find_partners(pair_sets *s, const qmat_half_edges *e) {
  s->partners = qmat_arena_alloc(&s->context->arena, e->count, sizeof *s->partners);
  if (!s->partners) return fail_shortage(s);
  for (size_t first = 0, last; first < e->count; first = last) {
    last = qmat_edge_last(e, first);
    const uint32_t a = e->order[first], b = e->order[last - 1];
    const bool are_two = last - first == 2 && third_corner(e->triangles, a) != third_corner(e->triangles, b);
    for (size_t i = first; i < last; i++) s->partners[e->order[i]] = are_two ? (i == first ? b : a) : UINT32_MAX;
  }
  return QMAT_OK;
}

/* Collects the set of a triangle, and how its triangles are turned to agree. False: it has a border, or one side. */
static bool collect_set(pair_sets *s, const qmat_half_edges *e, uint32_t start, size_t *size) {
  bool is_closed = true;
  size_t turned = 0;
  *size = 0;
  s->states[start] = AS_GIVEN;
  s->found[(*size)++] = start;
  for (size_t i = 0; i < *size; i++) {
    const uint32_t t = s->found[i];
    turned += s->states[t] == TURNED;
    for (uint32_t h = 3 * t; h < 3 * t + 3; h++) {
      const uint32_t other = s->partners[h];
      if (other == UINT32_MAX) {
        is_closed = false;
        continue;
      }
      const bool agree = qmat_half_edge_rises(e, h) != qmat_half_edge_rises(e, other);
      const uint8_t state = agree == (s->states[t] == AS_GIVEN) ? AS_GIVEN : TURNED;
      if (s->states[other / 3] == UNSEEN) {
        s->states[other / 3] = state;
        s->found[(*size)++] = other / 3;
      }
      is_closed = is_closed && s->states[other / 3] == state;
    }
  }
  for (size_t i = 0; i < *size && 2 * turned > *size; i++)
    s->states[s->found[i]] = s->states[s->found[i]] == TURNED ? AS_GIVEN : TURNED;
  return is_closed;
}

static bool encloses(const pair_sets *s, size_t size) {
  const double *reference = corner(s, s->pairs, s->found[0], 0);
  double volume = 0, area = 0;
  for (size_t i = 0; i < size; i++) {
    const uint32_t t = s->found[i];
    double from[3], normal[3];
    qmat_subtract(corner(s, s->pairs, t, 0), reference, from);
    qmat_triangle_normal(corner(s, s->pairs, t, 0), corner(s, s->pairs, t, 1), corner(s, s->pairs, t, 2), normal);
    area += sqrt(qmat_dot(normal, normal)) / 2;
    volume += (s->states[t] == TURNED ? -1 : 1) * qmat_dot(from, normal) / 6;
  }
  return fabs(volume) > least_volume * area * sqrt(area);
}

/* Along a direction that no plane of a model is likely to contain. */
static void project(const double *point, double at[2]) {
  at[0] = 1009 * point[1] - 211 * point[0];
  at[1] = 1009 * point[2] - 379 * point[0];
}

static qmat_status make_shadows(pair_sets *s) {
  if (s->shadows || s->plain_count == 0) return QMAT_OK;
  s->shadows = qmat_arena_alloc(&s->context->arena, s->plain_count, sizeof *s->shadows);
  if (!s->shadows) return fail_shortage(s);
  for (size_t t = 0; t < s->plain_count; t++) {
    shadow *b = &s->shadows[t];
    *b = (shadow){{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
    for (size_t k = 0; k < 3; k++) {
      double at[2];
      project(corner(s, s->plain, t, k), at);
      for (size_t i = 0; i < 2; i++) {
        b->low[i] = fmin(b->low[i], at[i]);
        b->high[i] = fmax(b->high[i], at[i]);
      }
    }
  }
  return QMAT_OK;
}

static double turn_of(const double a[2], const double b[2], const double c[2]) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/* Whether closed surfaces of plain triangles are wound around a point: both ways along a line they are left as often.
 * Open ones, such as a ground, are on one side only. */
static bool is_within_plain(const pair_sets *s, const double *point) {
  int ahead = 0, behind = 0;
  double seen[2];
  project(point, seen);
  for (size_t t = 0; t < s->plain_count; t++) {
    const shadow *b = &s->shadows[t];
    if (seen[0] < b->low[0] || seen[0] > b->high[0] || seen[1] < b->low[1] || seen[1] > b->high[1]) continue;
    double at[3][2], normal[3], from[3];
    for (size_t k = 0; k < 3; k++) project(corner(s, s->plain, t, k), at[k]);
    const bool left = turn_of(at[0], at[1], seen) > 0;
    if (left != (turn_of(at[1], at[2], seen) > 0) || left != (turn_of(at[2], at[0], seen) > 0)) continue;
    qmat_triangle_normal(corner(s, s->plain, t, 0), corner(s, s->plain, t, 1), corner(s, s->plain, t, 2), normal);
    qmat_subtract(corner(s, s->plain, t, 0), point, from);
    const double heads = 1009 * normal[0] + 211 * normal[1] + 379 * normal[2], side = qmat_dot(from, normal);
    if ((side > 0) == (heads > 0))
      ahead += heads > 0 ? 1 : -1;
    else
      behind += heads > 0 ? -1 : 1;
  }
  return ahead != 0 && ahead == behind;
}

static void take_set(pair_sets *s, size_t size, uint8_t *closed) {
  for (size_t i = 0; i < size; i++) {
    const uint32_t t = s->found[i];
    uint32_t *c = s->pairs + 3 * (size_t)t;
    closed[t] = 1;
    if (s->states[t] != TURNED) continue;
    const uint32_t second = c[1];
    c[1] = c[2];
    c[2] = second;
  }
}

/* `closed` (count, zeroed) becomes 1 for the triangles of closed surfaces of pairs that are solids. */
static qmat_status find_closed_pairs(qmat_context *context, size_t vertex_count, const double *positions, size_t count,
                                     uint32_t *pairs, size_t plain_count, const uint32_t *plain, uint8_t *closed,
                                     size_t *solids) {
  pair_sets s = {context, positions, count, plain_count, pairs, plain, NULL, NULL, NULL, NULL};
  *solids = 0;
  if (count == 0) return QMAT_OK;
  qmat_half_edges e;
  qmat_status status = qmat_half_edges_sort(context, vertex_count, count, pairs, &e);
  if (status == QMAT_OK) status = find_partners(&s, &e);
  if (status != QMAT_OK) return status;
  s.states = qmat_arena_calloc(&context->arena, count, 1);
  s.found = qmat_arena_alloc(&context->arena, count, sizeof *s.found);
  if (!s.states || !s.found) return fail_shortage(&s);
  /* A set is turned when it is taken, which changes no other set: its edges are its own. */
  for (uint32_t t = 0; t < count && status == QMAT_OK; t++) {
    size_t size;
    if (s.states[t] != UNSEEN) continue;
    if (collect_set(&s, &e, t, &size) && encloses(&s, size)) {
      double centroid[3];
      for (size_t k = 0; k < 3; k++)
        centroid[k] = (corner(&s, pairs, t, 0)[k] + corner(&s, pairs, t, 1)[k] + corner(&s, pairs, t, 2)[k]) / 3;
      status = make_shadows(&s);
      if (status == QMAT_OK && !is_within_plain(&s, centroid)) {
        take_set(&s, size, closed);
        ++*solids;
      }
    }
    if (status == QMAT_OK) status = qmat_progress(context, t, count, "opposite triangles");
  }
  return status;
}

qmat_status qmat_split_pairs(qmat_context *context, size_t vertex_count, const double *positions, size_t count,
                             const uint32_t *triangles, uint32_t *plain, uint32_t *pairs, qmat_pair_split *split) {
  *split = (qmat_pair_split){.merged = 0};
  uint8_t *classes = qmat_arena_calloc(&context->arena, count, 1),
          *closed = qmat_arena_calloc(&context->arena, count, 1);
  if (!classes || !closed) return qmat_fail_memory(context, "the opposite triangles");
  qmat_status status = qmat_find_opposite_pairs(context, vertex_count, count, triangles, classes);
  for (size_t t = 0; status == QMAT_OK && t < count; t++) {
    if (classes[t] == 2) continue;
    uint32_t *to = classes[t] == 1 ? pairs + 3 * split->merged++ : plain + 3 * split->plain_count++;
    memcpy(to, triangles + 3 * t, 3 * sizeof *to);
  }
  if (status == QMAT_OK)
    status = find_closed_pairs(context, vertex_count, positions, split->merged, pairs, split->plain_count, plain,
                               closed, &split->two_sided_solids);
  for (size_t t = 0; status == QMAT_OK && t < split->merged; t++) {
    uint32_t *to = closed[t] ? plain + 3 * split->plain_count++ : pairs + 3 * split->pair_count++;
    memmove(to, pairs + 3 * t, 3 * sizeof *to);
  }
  return status;
}
