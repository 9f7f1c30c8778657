/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/two_sides.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/disjoint_sets.h"
#include "core/geometry/half_edges.h"
#include "core/geometry/triangle.h"

/* Triangles of both sides lie in one plane if they leave it by at most this, in diagonals: coordinates of single
 * precision that were rounded. */
static const double most_apart = 1e-6;
/* Volumes and areas of both sides differ by at most this share. */
static const double most_unlike = 1e-4;

/* Bounds in a projection: least and largest of both coordinates. */
typedef struct shadow {
  double low[2], high[2];
} shadow;

/* A set of triangles connected across edges. */
typedef struct component {
  size_t first, count; /* in the members */
  bool may_be_double;  /* no edge speaks against it */
  bool has_four;       /* an edge has four triangles */
  shadow bounds;
} component;

/* A closed set of triangles that agree. */
typedef struct side {
  size_t count;
  double volume, area, order; /* the sum of the triangles' numbers */
} side;

typedef struct side_finder {
  qmat_context *context;
  const double *positions;
  const uint32_t *triangles;
  size_t count, component_count;
  component *components;
  uint32_t *component_of, *members;
  uint32_t *partners; /* per half-edge: the one of the next triangle of the same side; UINT32_MAX: not known */
  uint8_t *states;    /* per triangle: 0, or 1 + the number of its side */
  uint32_t *path;     /* scratch */
  double distance;
} side_finder;

static qmat_status fail_shortage(const side_finder *s) {
  return qmat_fail_memory(s->context, "the sides of the mesh");
}

static const double *corner(const side_finder *s, size_t t, size_t k) {
  return s->positions + 3 * (size_t)s->triangles[3 * t + k];
}

/* ---- edges ---- */

/* How far two triangles at an edge are from one half-plane: a third corner from the other's plane. Infinite if they lie
 * on two sides of the edge, or one has no plane. */
static double distance_apart(const side_finder *s, const qmat_half_edges *e, uint32_t a, uint32_t b) {
  const double *from = s->positions + 3 * (size_t)qmat_half_edge_start(e, a),
               *to = s->positions + 3 * (size_t)qmat_half_edge_end(e, a),
               *p = s->positions + 3 * (size_t)qmat_half_edge_across(e, a),
               *q = s->positions + 3 * (size_t)qmat_half_edge_across(e, b);
  double p_normal[3], q_normal[3], p_from[3], q_from[3];
  qmat_triangle_normal(from, to, p, p_normal);
  qmat_triangle_normal(from, to, q, q_normal);
  const double p_length = sqrt(qmat_dot(p_normal, p_normal)), q_length = sqrt(qmat_dot(q_normal, q_normal));
  if (!(p_length > 0 && q_length > 0 && qmat_dot(p_normal, q_normal) > 0)) return INFINITY;
  qmat_subtract(p, from, p_from);
  qmat_subtract(q, from, q_from);
  return fmax(fabs(qmat_dot(q_from, p_normal)) / p_length, fabs(qmat_dot(p_from, q_normal)) / q_length);
}

static void make_partners(side_finder *s, uint32_t a, uint32_t b) {
  s->partners[a] = b;
  s->partners[b] = a;
}

/* Of four triangles at an edge, two that rise and two that fall: one that rises continues in the one that falls which
 * is not in its half-plane. */
static void join_four(side_finder *s, const qmat_half_edges *e, const uint32_t *four) {
  uint32_t rising[2] = {0}, falling[2] = {0};
  size_t up = 0, down = 0;
  for (size_t i = 0; i < 4; i++) {
    const bool rises = qmat_half_edge_rises(e, four[i]);
    if ((rises ? up : down) == 2) return;
    if (rises)
      rising[up++] = four[i];
    else
      falling[down++] = four[i];
  }
  for (size_t k = 0; k < 2; k++) {
    const double apart =
        fmax(distance_apart(s, e, rising[0], falling[k]), distance_apart(s, e, rising[1], falling[!k]));
    if (!(apart <= most_apart)) continue;
    s->distance = fmax(s->distance, apart);
    make_partners(s, rising[0], falling[!k]);
    make_partners(s, rising[1], falling[k]);
    return;
  }
}

static qmat_status find_partners(side_finder *s, const qmat_half_edges *e, uint32_t *sets) {
  size_t poll = 0;
  for (size_t i = 0; i < e->count; i++) s->partners[i] = UINT32_MAX;
  for (size_t first = 0, last; first < e->count; first = last) {
    last = qmat_edge_last(e, first);
    const uint32_t *here = e->order + first;
    for (size_t i = 1; i < last - first; i++) qmat_sets_join(sets, here[0] / 3, here[i] / 3);
    if (last - first == 2 && qmat_half_edge_rises(e, here[0]) != qmat_half_edge_rises(e, here[1]))
      make_partners(s, here[0], here[1]);
    if (last - first == 4) join_four(s, e, here);
    if (last < poll) continue;
    poll = last + 65536;
    const qmat_status status = qmat_progress(s->context, first, e->count, "edges");
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

/* ---- components ---- */

/* Along a direction that no plane of a model is likely to contain. */
static void project(const double *point, double at[2]) {
  at[0] = 1009 * point[1] - 211 * point[0];
  at[1] = 1009 * point[2] - 379 * point[0];
}

static void grow_shadow(shadow *b, const double *point) {
  double at[2];
  project(point, at);
  for (size_t i = 0; i < 2; i++) {
    b->low[i] = fmin(b->low[i], at[i]);
    b->high[i] = fmax(b->high[i], at[i]);
  }
}

static bool is_in_shadow(const shadow *b, const double seen[2]) {
  return seen[0] >= b->low[0] && seen[0] <= b->high[0] && seen[1] >= b->low[1] && seen[1] <= b->high[1];
}

/* Numbers the sets, and lists their triangles. */
static qmat_status find_components(side_finder *s, const qmat_half_edges *e, uint32_t *sets) {
  qmat_arena *arena = &s->context->arena;
  for (uint32_t t = 0; t < s->count; t++) s->component_count += qmat_set_leader(sets, t) == t;
  s->components = qmat_arena_calloc(arena, s->component_count, sizeof *s->components);
  s->component_of = qmat_arena_alloc(arena, s->count, sizeof *s->component_of);
  s->members = qmat_arena_alloc(arena, s->count, sizeof *s->members);
  if (!s->components || !s->component_of || !s->members) return fail_shortage(s);
  size_t made = 0, first = 0;
  for (uint32_t t = 0; t < s->count; t++) { /* the smallest triangle leads */
    const uint32_t leader = qmat_set_leader(sets, t);
    s->component_of[t] = leader == t ? (uint32_t)made++ : s->component_of[leader];
    component *c = &s->components[s->component_of[t]];
    if (leader == t) c->bounds = (shadow){{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
    if (leader == t) c->may_be_double = true;
    c->count++;
    for (size_t k = 0; k < 3; k++) {
      grow_shadow(&c->bounds, corner(s, t, k));
      if (s->partners[3 * (size_t)t + k] == UINT32_MAX) c->may_be_double = false;
    }
  }
  for (size_t i = 0; i < s->component_count; i++) {
    s->components[i].first = first;
    first += s->components[i].count;
    s->components[i].count = 0;
  }
  for (uint32_t t = 0; t < s->count; t++) {
    component *c = &s->components[s->component_of[t]];
    s->members[c->first + c->count++] = t;
  }
  for (size_t i = 0, last; i < e->count; i = last) {
    last = qmat_edge_last(e, i);
    if (last - i == 4) s->components[s->component_of[e->order[i] / 3]].has_four = true;
  }
  return QMAT_OK;
}

/* Collects the triangles of the side that holds a triangle. */
static side collect_side(side_finder *s, uint32_t start, uint8_t state) {
  side made = {0};
  const double *reference = corner(s, start, 0);
  s->states[start] = state;
  s->path[made.count++] = start;
  for (size_t i = 0; i < made.count; i++) {
    const uint32_t t = s->path[i];
    double from[3], normal[3];
    qmat_subtract(corner(s, t, 0), reference, from);
    qmat_triangle_normal(corner(s, t, 0), corner(s, t, 1), corner(s, t, 2), normal);
    made.area += sqrt(qmat_dot(normal, normal)) / 2;
    made.volume += qmat_dot(from, normal) / 6;
    made.order += t;
    for (size_t k = 0; k < 3; k++) {
      const uint32_t next = s->partners[3 * (size_t)t + k] / 3;
      if (s->states[next]) continue;
      s->states[next] = state;
      s->path[made.count++] = next;
    }
  }
  return made;
}

static bool are_alike(double a, double b) {
  return fabs(a - b) <= most_unlike * fmax(fabs(a), fabs(b));
}

/* Whether a component consists of two closed sides that enclose the same. `second`: the state of the later one. */
static bool has_two_sides(side_finder *s, const component *c, uint8_t *second) {
  const uint32_t *members = s->members + c->first;
  const side one = collect_side(s, members[0], 1);
  if (one.count == c->count) return false;
  size_t i = 0;
  while (s->states[members[i]]) i++;
  const side other = collect_side(s, members[i], 2);
  *second = one.order / (double)one.count <= other.order / (double)other.count ? 2 : 1;
  return one.count + other.count == c->count && are_alike(one.volume, -other.volume) &&
         are_alike(one.area, other.area) && qmat_encloses(one.volume, one.area);
}

static double turn_of(const double a[2], const double b[2], const double c[2]) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/* Counts how often a line through a point leaves other components minus how often it enters them, both ways. */
static void count_crossings(const side_finder *s, uint32_t t, const double *point, int *ahead, int *behind) {
  double seen[2], at[3][2], normal[3], from[3];
  project(point, seen);
  for (size_t k = 0; k < 3; k++) project(corner(s, t, k), at[k]);
  const bool left = turn_of(at[0], at[1], seen) > 0;
  if (left != (turn_of(at[1], at[2], seen) > 0) || left != (turn_of(at[2], at[0], seen) > 0)) return;
  qmat_triangle_normal(corner(s, t, 0), corner(s, t, 1), corner(s, t, 2), normal);
  qmat_subtract(corner(s, t, 0), point, from);
  const double heads = 1009 * normal[0] + 211 * normal[1] + 379 * normal[2], distance = qmat_dot(from, normal);
  if ((distance > 0) == (heads > 0))
    *ahead += heads > 0 ? 1 : -1;
  else
    *behind += heads > 0 ? -1 : 1;
}

/* Whether other components are wound around one: both ways along a line they are left as often. Open ones, such as a
 * ground, are on one side only. */
static bool is_within_others(const side_finder *s, uint32_t number) {
  const uint32_t start = s->members[s->components[number].first];
  double point[3], seen[2];
  int ahead = 0, behind = 0;
  for (size_t k = 0; k < 3; k++)
    point[k] = (corner(s, start, 0)[k] + corner(s, start, 1)[k] + corner(s, start, 2)[k]) / 3;
  project(point, seen);
  for (uint32_t i = 0; i < s->component_count; i++) {
    const component *c = &s->components[i];
    if (i == number || !is_in_shadow(&c->bounds, seen)) continue;
    for (size_t k = 0; k < c->count; k++) count_crossings(s, s->members[c->first + k], point, &ahead, &behind);
  }
  return ahead != 0 && ahead == behind;
}

static qmat_status find_second_sides(side_finder *s, uint8_t *is_second, qmat_two_sides *sides) {
  s->states = qmat_arena_calloc(&s->context->arena, s->count, 1);
  s->path = qmat_arena_alloc(&s->context->arena, s->count, sizeof *s->path);
  if (!s->states || !s->path) return fail_shortage(s);
  for (uint32_t i = 0; i < s->component_count; i++) {
    const component *c = &s->components[i];
    uint8_t second;
    const qmat_status status = qmat_progress(s->context, i, s->component_count, "components");
    if (status != QMAT_OK) return status;
    if (!c->may_be_double || !c->has_four || !has_two_sides(s, c, &second) || is_within_others(s, i)) continue;
    sides->solids++;
    for (size_t k = 0; k < c->count; k++) {
      const uint32_t t = s->members[c->first + k];
      is_second[t] = s->states[t] == second;
      sides->dropped += is_second[t];
    }
  }
  return QMAT_OK;
}

static qmat_status keep_first_sides(const side_finder *s, const uint8_t *is_second, qmat_two_sides *sides) {
  if (sides->solids == 0) return QMAT_OK;
  sides->distance = s->distance;
  sides->triangles = qmat_arena_alloc(&s->context->arena, 3 * s->count, sizeof *sides->triangles);
  if (!sides->triangles) return fail_shortage(s);
  for (size_t t = 0; t < s->count; t++)
    if (!is_second[t])
      memcpy(sides->triangles + 3 * sides->triangle_count++, s->triangles + 3 * t, 3 * sizeof *sides->triangles);
  return QMAT_OK;
}

qmat_status qmat_drop_second_sides(qmat_context *context, size_t vertex_count, const double *positions, size_t count,
                                   const uint32_t *triangles, qmat_two_sides *sides) {
  *sides = (qmat_two_sides){.solids = 0};
  if (count == 0) return QMAT_OK;
  side_finder s = {.context = context, .positions = positions, .triangles = triangles, .count = count};
  qmat_half_edges e;
  qmat_status status = qmat_half_edges_sort(context, vertex_count, count, triangles, &e);
  if (status != QMAT_OK) return status;
  s.partners = qmat_arena_alloc(&context->arena, e.count, sizeof *s.partners);
  uint32_t *sets = qmat_sets_new(context, count);
  uint8_t *is_second = qmat_arena_calloc(&context->arena, count, 1);
  if (!s.partners || !sets || !is_second) return fail_shortage(&s);
  status = find_partners(&s, &e, sets);
  if (status == QMAT_OK) status = find_components(&s, &e, sets);
  if (status == QMAT_OK) status = find_second_sides(&s, is_second, sides);
  return status == QMAT_OK ? keep_first_sides(&s, is_second, sides) : status;
}
