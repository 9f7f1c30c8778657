/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/hull_exchange.h"

#include <math.h>
#include <omp.h>
#include <string.h>

#include "nodes/colliders/convex_hull_cgal.h"
#include "nodes/colliders/hull_columns.h"
#include "nodes/colliders/hull_outside.h"
#include "nodes/colliders/hull_split.h"
#include "nodes/colliders/hull_vertices.h"

/* A step gains this share of the volume of the union at least. */
static const double least_share = 1e-5;

/* Boxes of two hulls so near to each other may be joined; in the unit frame. */
static const double near = 1e-3;

/* The facets between two joint hulls may leave the solid by this many times the limit: a step that gains may need one
 * that was too far outside before. */
static const double limit_factor = 2;

/* Triangles between two hulls are halved this often at most, to find how far they leave the solid. */
enum { MOST_HALVINGS = 48 };

/* So many steps in a row may be taken back. */
enum { MOST_FAILURES = 5 };

/* Work of all threads between two looks whether the run is cancelled. */
enum { SLICE = 64 };

/* A coarse hull. */
typedef struct hull {
  qmat_hull_pieces pieces;
  double *points; /* 3 each; owned */
  size_t count;
  double low[3], high[3]; /* of its box */
  qmat_hull_columns columns;
} hull;

/* A hull of the union, and the best division of it. */
typedef struct member {
  hull all, halves[2];
  double gain; /* the volume of the union that the division saves */
  int round;   /* of the gain */
  bool live, searched, refused;
} member;

typedef struct pair {
  uint32_t a, b;
  double growth; /* the volume of the union that the joint hull adds; INFINITY: it leaves the solid by too much */
  int round;     /* of the growth */
  bool tested;   /* whether it leaves the solid by too much */
} pair;

typedef struct exchange {
  qmat_context *context;
  const qmat_surface *solid;
  double limit; /* of how far the facets between joint hulls leave the solid */
  const qmat_solid_part *parts;
  member *members;
  size_t count, room;
  pair *pairs;
  size_t pair_count, pair_capacity;
  const qmat_hull_columns **others; /* scratch, one set per thread */
  int round;                        /* changes of the union so far, from 1 */
  size_t steps, most_steps;
} exchange;

static void free_hull(hull *h) {
  qmat_free(h->pieces.pieces);
  qmat_free(h->points);
  qmat_hull_columns_free(&h->columns);
  *h = (hull){0};
}

static void free_member(member *m) {
  free_hull(&m->all);
  free_hull(&m->halves[0]);
  free_hull(&m->halves[1]);
  *m = (member){0};
}

/* Makes the hull of its pieces. Points in a plane have no columns. */
static qmat_status make_hull(const qmat_solid_part *parts, hull *h) {
  const qmat_status status = qmat_hull_pieces_points(parts, &h->pieces, true, &h->points, &h->count);
  if (status != QMAT_OK) return status;
  qmat_hull_box(h->points, h->count, h->low, h->high);
  return qmat_hull_columns_around(h->points, h->count, &h->columns);
}

/* The live members but one that may meet a hull, in the scratch of this thread, which has room for another one. */
static const qmat_hull_columns **find_others(const exchange *x, const qmat_hull_columns *of, size_t but,
                                             size_t *count) {
  const qmat_hull_columns **others = x->others + (size_t)omp_get_thread_num() * (x->room + 1);
  *count = 0;
  for (size_t i = 0; i < x->count; i++)
    if (x->members[i].live && i != but && qmat_hull_columns_meet(of, &x->members[i].all.columns))
      others[(*count)++] = &x->members[i].all.columns;
  return others;
}

/* The volume of a hull beyond those of the live members but one, and beyond another hull, which may be NULL. */
static double volume_beyond(const exchange *x, const qmat_hull_columns *of, size_t but, const qmat_hull_columns *also) {
  size_t count;
  const qmat_hull_columns **others = find_others(x, of, but, &count);
  if (also) others[count++] = also;
  return qmat_hull_columns_beyond(of, others, count);
}

/* The volume of the union that goes where a member is divided. */
static double gain_of(const exchange *x, size_t i, const hull halves[2]) {
  if (!halves[0].columns.z || !halves[1].columns.z) return 0;
  return volume_beyond(x, &x->members[i].all.columns, i, NULL) - volume_beyond(x, &halves[0].columns, i, NULL) -
         volume_beyond(x, &halves[1].columns, i, &halves[0].columns);
}

/* Divides a member by a plane, and keeps that where it gains more than what is kept. */
static qmat_status try_plane(const exchange *x, size_t i, qmat_cell_plane plane) {
  member *m = &x->members[i];
  qmat_hull_pieces pieces[2];
  hull halves[2] = {0};
  qmat_status status = qmat_hull_pieces_split(&m->all.pieces, plane, pieces);
  if (status != QMAT_OK) return status;
  for (int h = 0; h < 2; h++) halves[h].pieces = pieces[h];
  for (int h = 0; h < 2 && status == QMAT_OK; h++) status = make_hull(x->parts, &halves[h]);
  const double gain = status == QMAT_OK ? gain_of(x, i, halves) : 0;
  for (int h = 0; h < 2; h++) {
    if (gain > m->gain) {
      const hull kept = m->halves[h];
      m->halves[h] = halves[h];
      halves[h] = kept;
    }
    free_hull(&halves[h]);
  }
  if (gain > m->gain) m->gain = gain;
  return status;
}

/* Finds the best division of a member. */
static qmat_status search_member(const exchange *x, size_t i) {
  member *m = &x->members[i];
  qmat_cell_plane planes[3];
  m->searched = true;
  m->round = x->round;
  size_t count;
  const qmat_hull_columns **others = find_others(x, &m->all.columns, i, &count);
  qmat_status status = qmat_hull_split_find(x->parts, &m->all.pieces, others, count, planes);
  for (int k = 0; k < 3 && status == QMAT_OK; k++)
    if (planes[k].gain > 0) status = try_plane(x, i, planes[k]);
  return status;
}

static qmat_status search_members(exchange *x) {
  const int threads = qmat_threads(x->context);
  for (size_t first = 0; first < x->count; first += SLICE) {
    const size_t end = first + SLICE < x->count ? first + SLICE : x->count;
    const qmat_status status = qmat_progress(x->context, x->steps, x->most_steps, "hulls exchanged");
    bool done = true;
    if (status != QMAT_OK) return status;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1) reduction(&& : done)
    for (size_t i = first; i < end; i++) {
      const member *m = &x->members[i];
      if (m->live && !m->searched && m->all.columns.z && search_member(x, i) != QMAT_OK) done = false;
    }
    if (!done) return qmat_fail_memory(x->context, "the hulls");
  }
  return QMAT_OK;
}

/* The member whose division gains most, the first of equal ones; SIZE_MAX: none gains enough. */
static size_t best_member(exchange *x, double least) {
  for (;;) {
    size_t best = SIZE_MAX;
    for (size_t i = 0; i < x->count; i++) {
      const member *m = &x->members[i];
      if (m->live && !m->refused && m->gain > (best == SIZE_MAX ? least : x->members[best].gain)) best = i;
    }
    if (best == SIZE_MAX || x->members[best].round == x->round) return best;
    x->members[best].gain = gain_of(x, best, x->members[best].halves);
    x->members[best].round = x->round;
  }
}

static bool are_near(const hull *a, const hull *b) {
  for (int k = 0; k < 3; k++)
    if (a->low[k] > b->high[k] + near || b->low[k] > a->high[k] + near) return false;
  return true;
}

/* The joint that a member moves with. */
static uint32_t joint_of(const exchange *x, size_t i) {
  const qmat_hull_pieces *pieces = &x->members[i].all.pieces;
  return pieces->count > 0 ? x->parts[pieces->pieces[0].part].joint : 0;
}

/* The points of a joint hull: those of the one, then those of the other. The caller frees them; NULL: no memory. */
static double *joint_points(const exchange *x, const pair *p) {
  const hull *a = &x->members[p->a].all, *b = &x->members[p->b].all;
  double *points = qmat_alloc(a->count + b->count, 3 * sizeof *points);
  if (!points) return NULL;
  memcpy(points, a->points, 3 * a->count * sizeof *points);
  memcpy(&points[3 * a->count], b->points, 3 * b->count * sizeof *points);
  return points;
}

/* The volume of the union that a joint hull adds. */
static qmat_status set_growth(const exchange *x, pair *p) {
  qmat_hull_columns columns = {0};
  double *points = joint_points(x, p);
  if (!points) return QMAT_ERROR_MEMORY;
  const size_t count = x->members[p->a].all.count + x->members[p->b].all.count;
  const qmat_status status = qmat_hull_columns_around(points, count, &columns);
  p->growth = columns.z ? volume_beyond(x, &columns, SIZE_MAX, NULL) : INFINITY;
  p->round = x->round;
  qmat_hull_columns_free(&columns);
  qmat_free(points);
  return status;
}

/* Tests how far a joint hull leaves the solid. That does not depend on the other hulls. */
static qmat_status test_pair(const exchange *x, pair *p) {
  const size_t first = x->members[p->a].all.count, count = first + x->members[p->b].all.count;
  double *points = joint_points(x, p);
  uint32_t *triangles = qmat_alloc(count, 6 * sizeof *triangles);
  size_t triangle_count = 0;
  qmat_status status =
      points && triangles ? qmat_convex_hull(points, count, triangles, &triangle_count) : QMAT_ERROR_MEMORY;
  if (status == QMAT_OK &&
      qmat_joint_protrusion(x->solid, points, first, triangles, triangle_count, x->limit, MOST_HALVINGS) > x->limit)
    p->growth = INFINITY;
  p->tested = true;
  qmat_free(points);
  qmat_free(triangles);
  return status;
}

/* Adds the pairs of the members from one on with those before. */
static qmat_status add_pairs(exchange *x, size_t first) {
  const int threads = qmat_threads(x->context);
  const size_t start = x->pair_count;
  bool done = true;
  for (size_t b = first; b < x->count; b++)
    for (size_t a = 0; a < b; a++) {
      if (!x->members[a].live || !x->members[b].live || joint_of(x, a) != joint_of(x, b)) continue;
      if (!are_near(&x->members[a].all, &x->members[b].all)) continue;
      if (qmat_grow((void **)&x->pairs, &x->pair_capacity, x->pair_count + 1, sizeof *x->pairs) != 0)
        return qmat_fail_memory(x->context, "pairs of hulls");
      x->pairs[x->pair_count++] = (pair){.a = (uint32_t)a, .b = (uint32_t)b};
    }
  for (size_t slice = start; slice < x->pair_count; slice += SLICE) {
    const size_t end = slice + SLICE < x->pair_count ? slice + SLICE : x->pair_count;
    const qmat_status status = qmat_progress(x->context, x->steps, x->most_steps, "hulls exchanged");
    if (status != QMAT_OK) return status;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1) reduction(&& : done)
    for (size_t i = slice; i < end; i++)
      if (set_growth(x, &x->pairs[i]) != QMAT_OK) done = false;
    if (!done) return qmat_fail_memory(x->context, "pairs of hulls");
  }
  return QMAT_OK;
}

/* The pair whose joint hull adds least; NULL: there is none. `status` may become QMAT_ERROR_MEMORY or QMAT_CANCELLED.
 */
static pair *best_pair(exchange *x, qmat_status *status) {
  for (;;) {
    pair *best = NULL;
    for (size_t i = 0; i < x->pair_count; i++) {
      pair *p = &x->pairs[i];
      if (x->members[p->a].live && x->members[p->b].live && p->growth < (best ? best->growth : INFINITY)) best = p;
    }
    if (!best || (best->round == x->round && best->tested)) return best;
    *status = qmat_progress(x->context, x->steps, x->most_steps, "hulls exchanged");
    if (*status == QMAT_OK) *status = best->round == x->round ? test_pair(x, best) : set_growth(x, best);
    if (*status != QMAT_OK) return NULL;
  }
}

static void drop_pairs(exchange *x) {
  size_t kept = 0;
  for (size_t i = 0; i < x->pair_count; i++)
    if (x->members[x->pairs[i].a].live && x->members[x->pairs[i].b].live) x->pairs[kept++] = x->pairs[i];
  x->pair_count = kept;
}

/* Joins a pair into a new member. */
static qmat_status join_pair(exchange *x, const pair *p) {
  member *a = &x->members[p->a], *b = &x->members[p->b], *joint = &x->members[x->count];
  const bool is_b_larger =
      qmat_hull_columns_beyond(&b->all.columns, NULL, 0) > qmat_hull_columns_beyond(&a->all.columns, NULL, 0);
  *joint = (member){.live = true};
  qmat_status status = qmat_hull_pieces_join(is_b_larger ? &b->all.pieces : &a->all.pieces,
                                             is_b_larger ? &a->all.pieces : &b->all.pieces, &joint->all.pieces);
  if (status == QMAT_OK) status = make_hull(x->parts, &joint->all);
  x->count++;
  free_member(a);
  free_member(b);
  return status == QMAT_OK ? add_pairs(x, x->count - 1) : status;
}

/* Divides a member, then joins the best pair, or takes that back. */
static qmat_status take_step(exchange *x, size_t s, double least, bool *taken) {
  const size_t pair_count = x->pair_count;
  member *m = &x->members[s];
  const double gain = m->gain;
  m->live = false;
  for (int h = 0; h < 2; h++) {
    x->members[x->count++] = (member){.all = m->halves[h], .live = true};
    m->halves[h] = (hull){0};
  }
  x->round++;
  qmat_status status = add_pairs(x, x->count - 2);
  if (status != QMAT_OK) return status;
  const pair *p = best_pair(x, &status);
  *taken = p && gain - p->growth > least;
  if (status == QMAT_OK && *taken) {
    const pair joined = *p;
    free_member(m);
    status = join_pair(x, &joined);
    drop_pairs(x);
    x->round++;
    for (size_t i = 0; i < x->count; i++) x->members[i].refused = false;
    return status;
  }
  for (int h = 0; h < 2; h++) {
    m->halves[h] = x->members[x->count - 2 + (size_t)h].all;
    x->members[x->count - 2 + (size_t)h] = (member){0};
  }
  x->count -= 2;
  x->pair_count = pair_count;
  m->live = m->refused = true;
  return status;
}

static double volume_of_union(const exchange *x) {
  double volume = 0;
  for (size_t i = 0; i < x->count; i++) {
    if (!x->members[i].live) continue;
    size_t count = 0;
    for (size_t k = 0; k < i; k++)
      if (x->members[k].live) x->others[count++] = &x->members[k].all.columns;
    volume += qmat_hull_columns_beyond(&x->members[i].all.columns, x->others, count);
  }
  return volume;
}

static qmat_status init(exchange *x, qmat_hull_pieces *hulls, size_t count) {
  const int threads = qmat_threads(x->context);
  bool done = true;
  x->room = 4 * count + 3;
  x->members = qmat_arena_calloc(&x->context->arena, x->room, sizeof *x->members);
  x->others = qmat_arena_alloc(&x->context->arena, (size_t)threads * (x->room + 1), sizeof *x->others);
  if (!x->members || !x->others) return qmat_fail_memory(x->context, "the hulls");
  for (x->count = 0; x->count < count && done; x->count++) {
    hull *h = &x->members[x->count].all;
    h->pieces = hulls[x->count];
    h->pieces.pieces = qmat_alloc(hulls[x->count].count, sizeof *h->pieces.pieces);
    if (h->pieces.pieces)
      memcpy(h->pieces.pieces, hulls[x->count].pieces, h->pieces.count * sizeof *h->pieces.pieces);
    else
      done = false;
    x->members[x->count].live = true;
  }
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1) reduction(&& : done)
  for (size_t i = 0; i < x->count; i++)
    if (done && make_hull(x->parts, &x->members[i].all) != QMAT_OK) done = false;
  return done ? add_pairs(x, 1) : qmat_fail_memory(x->context, "the hulls");
}

qmat_status qmat_hulls_exchange(qmat_context *context, const qmat_surface *solid, double limit,
                                const qmat_solid_part *parts, qmat_hull_pieces *hulls, size_t count) {
  exchange x = {.context = context,
                .solid = solid,
                .limit = limit_factor * limit,
                .parts = parts,
                .round = 1,
                .most_steps = count};
  if (count < 2) return QMAT_OK;
  qmat_status status = init(&x, hulls, count);
  const double least = status == QMAT_OK ? least_share * volume_of_union(&x) : 0;
  for (int failures = 0; status == QMAT_OK && x.steps < x.most_steps && failures < MOST_FAILURES;) {
    bool taken = false;
    status = search_members(&x);
    const size_t s = status == QMAT_OK ? best_member(&x, least) : SIZE_MAX;
    if (s == SIZE_MAX) break;
    status = take_step(&x, s, least, &taken);
    failures = taken ? 0 : failures + 1;
    x.steps += taken;
  }
  size_t written = 0;
  for (size_t i = 0; i < x.count && status == QMAT_OK; i++) {
    if (!x.members[i].live) continue;
    qmat_free(hulls[written].pieces);
    hulls[written++] = x.members[i].all.pieces;
    x.members[i].all.pieces.pieces = NULL;
  }
  for (size_t i = 0; i < x.count; i++) free_member(&x.members[i]);
  qmat_free(x.pairs);
  return status == QMAT_ERROR_MEMORY ? qmat_fail_memory(context, "the hulls") : status;
}
