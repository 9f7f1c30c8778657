/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/hull_merge.h"

#include <math.h>
#include <omp.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "core/side_by_side.h"
#include "nodes/colliders/convex_hull_cgal.h"
#include "nodes/colliders/hull_exchange.h"
#include "nodes/colliders/hull_outside.h"
#include "nodes/colliders/hull_vertices.h"
#include "nodes/colliders/outer_hull.h"
#include "nodes/colliders/tangent_hull.h"

/* Before the end hulls may have this many times as many vertices, and are within this share of the error. */
enum { ROOM_FACTOR = 4 };
static const double fine_share = 0.1;

/* In diagonals: what rounding may do to the points of parts. */
static const double least_margin = 2e-7;

/* Vertices of a hull at the end are farther apart than this, in diagonals: single precision has to tell them apart,
 * also some diagonals from the origin, and edges to be long enough for normals. For small errors it is a share of
 * these. */
static const double least_edge = 1e-5, edge_share = 0.05;

/* Pairs are compared by a coarse search; the one that is joined is searched to the end. */
enum { FEW_HALVINGS = 3, MANY_HALVINGS = 48 };

/* The limit rises by this factor while there are too many hulls, up to the diagonal. */
static const double limit_step = 1.25;

typedef struct part {
  double *points; /* 3 each; owned */
  size_t count;
  double low[3], high[3]; /* of its box */
  double volume;
  uint32_t shape; /* whose spheres it keeps */
  uint32_t last;  /* of the chain of given parts in it, which begins with its own */
  bool live;
} part;

typedef struct pair {
  uint32_t a, b; /* a < b */
  double leaves; /* how far the joint hull was found to leave the solid; unit frame */
  double growth; /* the volume of the joint hull, less those of the two */
  bool exceeds;  /* `leaves` is above the limit of the test */
} pair;

/* Scratch of a thread: a joint hull, and hulls before and at the end. */
typedef struct joint {
  size_t point_count, triangle_count;
  double *points, *unit; /* in the model, and in the unit frame */
  uint32_t *triangles;
  uint8_t *is_vertex; /* per point */
  qmat_tangent_hull fine, coarse;
  qmat_outer_hull outer;
} joint;

typedef struct merging {
  qmat_context *context;
  const qmat_surface *solid;
  size_t room, most_points; /* vertices of a part, and of a hull at the end */
  double limit;             /* unit frame */
  double error;             /* of the vertices of hulls, in the model */
  part *parts;
  const qmat_solid_part *given;
  qmat_hull_pieces *hulls; /* at the end: what they are around */
  part *ends;              /* and they themselves */
  uint32_t *following;     /* of given parts: the next one in the same part */
  size_t part_count, live_count;
  pair *pairs;
  size_t pair_count, pair_capacity;
  joint *joints;       /* one per thread */
  _Atomic size_t done; /* hulls of those that are made side by side */
} merging;

/* Records why hulls were not made. */
static qmat_status record(qmat_context *context, qmat_status status) {
  if (status == QMAT_OK || status == QMAT_CANCELLED) return status;
  if (status == QMAT_ERROR_MEMORY) return qmat_fail_memory(context, "the hulls");
  return qmat_fail(context, status, "rounding spoils the hull of a part of the solid");
}

static qmat_status fail(const merging *m, qmat_status status) {
  return record(m->context, status);
}

/* The scratch of this thread, which asks the context of its item whether to go on. */
static joint *joint_of_thread(const merging *m, qmat_context *context) {
  joint *j = &m->joints[omp_get_thread_num()];
  j->fine.context = j->coarse.context = j->outer.context = context;
  return j;
}

static void end_of_items(const merging *m) {
  for (int i = 0; i < qmat_threads(m->context); i++)
    m->joints[i].fine.context = m->joints[i].coarse.context = m->joints[i].outer.context = NULL;
}

/* The hull of two parts. */
static qmat_status join(const merging *m, const part *a, const part *b, joint *j) {
  j->point_count = a->count + b->count;
  memcpy(j->points, a->points, 3 * a->count * sizeof *j->points);
  memcpy(&j->points[3 * a->count], b->points, 3 * b->count * sizeof *j->points);
  qmat_frame_to_unit(qmat_surface_frame(m->solid), j->points, j->point_count, j->unit);
  return qmat_convex_hull(j->points, j->point_count, j->triangles, &j->triangle_count);
}

/* How far the facets between two parts leave the solid. Parts without a joint hull stay apart. */
static qmat_status test_pair(const merging *m, pair *p, int halvings, joint *j) {
  const part *a = &m->parts[p->a], *b = &m->parts[p->b];
  p->leaves = INFINITY;
  p->exceeds = true;
  const qmat_status status = join(m, a, b, j);
  if (status != QMAT_OK) return status == QMAT_ERROR_GEOMETRY ? QMAT_OK : status;
  p->leaves = qmat_joint_protrusion(m->solid, j->unit, a->count, j->triangles, j->triangle_count, m->limit, halvings);
  p->growth = qmat_hull_volume(j->points, j->triangles, j->triangle_count) - a->volume - b->volume;
  p->exceeds = p->leaves > m->limit;
  return QMAT_OK;
}

static bool set_points(part *p, const double *points, size_t count) {
  double *copy = qmat_alloc(count, 3 * sizeof *copy);
  if (!copy) return false;
  qmat_free(p->points);
  p->points = memcpy(copy, points, 3 * count * sizeof *copy);
  p->count = count;
  qmat_hull_box(copy, count, p->low, p->high);
  return true;
}

static bool is_near(const merging *m, const part *a, const part *b) {
  const double gap = m->limit * qmat_surface_frame(m->solid)->diagonal;
  for (int k = 0; k < 3; k++)
    if (a->low[k] > b->high[k] + gap || b->low[k] > a->high[k] + gap) return false;
  return true;
}

static qmat_status add_pair(merging *m, size_t a, size_t b) {
  if (!m->parts[b].live || m->given[a].joint != m->given[b].joint || !is_near(m, &m->parts[a], &m->parts[b]))
    return QMAT_OK;
  if (qmat_grow((void **)&m->pairs, &m->pair_capacity, m->pair_count + 1, sizeof *m->pairs))
    return qmat_fail_memory(m->context, "pairs of hulls");
  m->pairs[m->pair_count++] = (pair){(uint32_t)(a < b ? a : b), (uint32_t)(a < b ? b : a), 0, 0, true};
  return QMAT_OK;
}

/* Tests the pairs from `first` on. */
static qmat_status test_pairs(merging *m, size_t first) {
  const int threads = qmat_threads(m->context);
  const size_t slice = 64;
  bool done = true;
  for (; first < m->pair_count; first += slice) {
    const size_t end = first + slice < m->pair_count ? first + slice : m->pair_count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1) reduction(&& : done)
    for (size_t i = first; i < end; i++)
      if (test_pair(m, &m->pairs[i], FEW_HALVINGS, &m->joints[omp_get_thread_num()]) != QMAT_OK) done = false;
    if (!done) return fail(m, QMAT_ERROR_MEMORY);
    const qmat_status status = qmat_progress(m->context, m->part_count - m->live_count, m->part_count, "hulls joined");
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

/* All pairs of live parts that are near each other for the limit of now. */
static qmat_status find_pairs(merging *m) {
  qmat_status status = QMAT_OK;
  m->pair_count = 0;
  for (size_t a = 0; a < m->part_count; a++)
    for (size_t b = a + 1; m->parts[a].live && b < m->part_count && status == QMAT_OK; b++) status = add_pair(m, a, b);
  return status == QMAT_OK ? test_pairs(m, 0) : status;
}

/* The pair within the limit whose joint hull gains the least volume, the first of equal ones; NULL: none. */
static pair *best_pair(const merging *m) {
  pair *best = NULL;
  for (size_t i = 0; i < m->pair_count; i++) {
    pair *p = &m->pairs[i];
    if (p->exceeds || (best && p->growth > best->growth)) continue;
    if (!best || p->growth < best->growth || p->a < best->a || (p->a == best->a && p->b < best->b)) best = p;
  }
  return best;
}

static void give_up(merging *m, uint32_t a, uint32_t b) {
  size_t kept = 0;
  for (size_t i = 0; i < m->pair_count; i++)
    if (m->pairs[i].a != a || m->pairs[i].b != b) m->pairs[kept++] = m->pairs[i];
  m->pair_count = kept;
}

/* Takes the pairs of a part out, and adds those of now. */
static qmat_status renew_pairs(merging *m, uint32_t a, uint32_t gone) {
  size_t kept = 0;
  for (size_t i = 0; i < m->pair_count; i++) {
    const pair *p = &m->pairs[i];
    if (p->a != a && p->b != a && p->a != gone && p->b != gone) m->pairs[kept++] = *p;
  }
  m->pair_count = kept;
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < m->part_count && status == QMAT_OK; i++)
    if (i != a) status = add_pair(m, a, i);
  return status == QMAT_OK ? test_pairs(m, kept) : status;
}

/* Joins two parts into the first. The pair is given up where rounding spoils the hull of fewer vertices. */
static qmat_status join_pair(merging *m, uint32_t a, uint32_t b) {
  part *into = &m->parts[a], *from = &m->parts[b];
  joint *j = &m->joints[0];
  const qmat_status joined = join(m, into, from, j);
  if (joined != QMAT_OK) return fail(m, joined);
  const double volume = qmat_hull_volume(j->points, j->triangles, j->triangle_count);
  size_t used = qmat_hull_vertices_keep(j->points, j->point_count, j->triangles, j->triangle_count, j->is_vertex);
  const double *vertices = j->points;
  if (used > m->room) {
    const qmat_status status = qmat_tangent_hull_fit_points(&j->fine, j->points, used, 0, fine_share * m->error);
    if (status == QMAT_ERROR_MEMORY) return qmat_fail_memory(m->context, "the hulls");
    if (status != QMAT_OK) {
      give_up(m, a, b);
      return QMAT_OK;
    }
    vertices = j->fine.points;
    used = j->fine.point_count;
  }
  if (!set_points(into, vertices, used)) return qmat_fail_memory(m->context, "the hulls");
  if (from->volume > into->volume) into->shape = from->shape;
  m->following[into->last] = b;
  into->last = from->last;
  into->volume = volume;
  from->live = false;
  m->live_count--;
  return renew_pairs(m, a, b);
}

/* Finds vertices of a hull around points, farther out by `margin`. Where rounding spoils the hull, they are the corners
 * of a box. */
static qmat_status surround(qmat_tangent_hull *hull, const double *points, size_t count, double margin, double error) {
  const qmat_status status = qmat_tangent_hull_fit_points(hull, points, count, margin, error);
  if (status != QMAT_ERROR_GEOMETRY) return status;
  double low[3], high[3];
  qmat_hull_box(points, count, low, high);
  for (int i = 0; i < 8; i++)
    for (int k = 0; k < 3; k++) hull->points[3 * i + k] = i >> k & 1 ? high[k] + margin : low[k] - margin;
  hull->point_count = 8;
  return QMAT_OK;
}

/* By how much a hull contains the points of the solid's part. */
static double margin_of(const merging *m) {
  return qmat_surface_mesh(m->solid)->deviation + least_margin * qmat_surface_frame(m->solid)->diagonal;
}

/* Makes the hull of a part, or of a box around it. Without a box it fails where the points are too near a plane. */
static qmat_status make_part(const merging *m, const qmat_solid_part *given, bool may_be_box, joint *j, part *p) {
  const qmat_frame *frame = qmat_surface_frame(m->solid);
  const double margin = margin_of(m);
  qmat_tangent_hull *fine = &j->fine;
  double *model = qmat_alloc(given->count, 3 * sizeof *model);
  if (!model) return QMAT_ERROR_MEMORY;
  qmat_frame_to_model(frame, given->points, given->count, model);
  qmat_status status =
      (may_be_box ? surround : qmat_tangent_hull_fit_points)(fine, model, given->count, margin, fine_share * m->error);
  qmat_free(model);
  size_t triangle_count;
  if (status == QMAT_OK) status = qmat_convex_hull(fine->points, fine->point_count, fine->triangles, &triangle_count);
  if (status != QMAT_OK) return status;
  if (!set_points(p, fine->points, fine->point_count)) return QMAT_ERROR_MEMORY;
  p->volume = qmat_hull_volume(p->points, fine->triangles, triangle_count);
  p->live = true;
  return QMAT_OK;
}

/* The live part of its joint with the point nearest to the first one of another part; itself where there is none. */
static size_t nearest_part(const merging *m, const qmat_solid_part *given, size_t of) {
  size_t best = of;
  double least = INFINITY;
  for (size_t i = 0; i < m->part_count; i++)
    for (size_t k = 0; m->parts[i].live && given[i].joint == given[of].joint && k < given[i].count; k++) {
      const double distance = qmat_point_distance(&given[i].points[3 * k], given[of].points);
      if (!(distance < least)) continue;
      least = distance;
      best = i;
    }
  return best;
}

/* Gives the points of a part without a hull to the nearest one that has. */
static qmat_status move_part(merging *m, qmat_solid_part *given, size_t from) {
  qmat_solid_part *to = &given[nearest_part(m, given, from)];
  if (to == &given[from]) { /* the joint has no other one: a box around it */
    m->live_count++;
    return make_part(m, to, true, &m->joints[0], &m->parts[from]);
  }
  double *points = qmat_alloc(to->count + given[from].count, 3 * sizeof *points);
  if (!points) return QMAT_ERROR_MEMORY;
  memcpy(points, to->points, 3 * to->count * sizeof *points);
  memcpy(&points[3 * to->count], given[from].points, 3 * given[from].count * sizeof *points);
  qmat_free(to->points);
  to->points = points;
  to->count += given[from].count;
  part *p = &m->parts[to - given];
  m->following[p->last] = (uint32_t)from;
  p->last = (uint32_t)from;
  return make_part(m, to, true, &m->joints[0], p);
}

/* The hull of a part; rounding may spoil it. */
static qmat_status make_part_of(void *data, qmat_context *context, size_t i) {
  merging *m = data;
  m->parts[i].shape = m->parts[i].last = m->following[i] = (uint32_t)i;
  qmat_status status = qmat_progress(context, 1, 0, "hulls");
  if (status == QMAT_OK && m->given[i].count > 0)
    status = make_part(m, &m->given[i], false, joint_of_thread(m, context), &m->parts[i]);
  m->done++;
  return status == QMAT_ERROR_GEOMETRY ? QMAT_OK : record(context, status);
}

/* Makes the hulls of all parts, then moves parts without one. */
static qmat_status make_parts(merging *m, qmat_solid_part *given) {
  qmat_status status =
      qmat_run_side_by_side(m->context, m->part_count, make_part_of, m, &m->done, m->part_count, "hulls");
  end_of_items(m);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < m->part_count; i++) m->live_count += m->parts[i].live;
  for (size_t i = 0; i < m->part_count && m->live_count > 0 && status == QMAT_OK; i++)
    if (!m->parts[i].live && given[i].count > 0) status = move_part(m, given, i);
  return fail(m, status);
}

static qmat_status init(merging *m, qmat_solid_part *given, size_t count, size_t most_points) {
  qmat_arena *arena = &m->context->arena;
  const int threads = qmat_threads(m->context);
  m->part_count = count;
  m->room = ROOM_FACTOR * most_points;
  m->most_points = most_points;
  m->given = given;
  m->parts = qmat_arena_calloc(arena, count, sizeof *m->parts);
  m->following = qmat_arena_alloc(arena, count, sizeof *m->following);
  m->joints = qmat_arena_alloc(arena, (size_t)threads, sizeof *m->joints);
  if (!m->parts || !m->following || !m->joints) return qmat_fail_memory(m->context, "the hulls");
  qmat_status status = QMAT_OK;
  for (int i = 0; i < threads && status == QMAT_OK; i++) {
    joint *j = &m->joints[i];
    j->points = qmat_arena_alloc(arena, 2 * m->room, 3 * sizeof *j->points);
    j->unit = qmat_arena_alloc(arena, 2 * m->room, 3 * sizeof *j->unit);
    j->triangles = qmat_arena_alloc(arena, 2 * m->room, 6 * sizeof *j->triangles);
    j->is_vertex = qmat_arena_alloc(arena, 2 * m->room, sizeof *j->is_vertex);
    if (!j->points || !j->unit || !j->triangles || !j->is_vertex) return qmat_fail_memory(m->context, "the hulls");
    status = qmat_tangent_hull_init(m->context, m->room, &j->fine);
    if (status == QMAT_OK) status = qmat_tangent_hull_init(m->context, most_points, &j->coarse);
  }
  return status == QMAT_OK ? make_parts(m, given) : status;
}

/* What the hulls of the live parts are around, in the order of the parts. */
static qmat_status collect_pieces(merging *m) {
  size_t count = 0;
  m->hulls = qmat_arena_calloc(&m->context->arena, m->live_count + 1, sizeof *m->hulls);
  if (!m->hulls) return qmat_fail_memory(m->context, "the hulls");
  for (size_t i = 0; i < m->part_count; i++) {
    const part *p = &m->parts[i];
    if (!p->live) continue;
    qmat_hull_pieces *h = &m->hulls[count++];
    h->shape = p->shape;
    for (int fill = 0; fill < 2; fill++) {
      h->count = 0;
      for (uint32_t g = (uint32_t)i;; g = m->following[g]) {
        if (fill) h->pieces[h->count] = qmat_part_whole(g);
        h->count++;
        if (g == p->last) break;
      }
      if (!fill && !(h->pieces = qmat_alloc(h->count, sizeof *h->pieces)))
        return qmat_fail_memory(m->context, "the hulls");
    }
  }
  return QMAT_OK;
}

/* The points that a hull at the end is around, as far as they are its vertices. */
static qmat_status collect_points(const merging *m, const qmat_hull_pieces *pieces, part *p) {
  qmat_status status = qmat_hull_pieces_points(m->given, pieces, false, &p->points, &p->count);
  if (status != QMAT_OK) return status;
  qmat_frame_to_model(qmat_surface_frame(m->solid), p->points, p->count, p->points);
  uint32_t *triangles = qmat_alloc(p->count, 6 * sizeof *triangles);
  uint8_t *is_vertex = qmat_alloc(p->count, sizeof *is_vertex);
  size_t triangle_count = 0;
  if (!triangles || !is_vertex) status = QMAT_ERROR_MEMORY;
  if (status == QMAT_OK) status = qmat_convex_hull(p->points, p->count, triangles, &triangle_count);
  if (status == QMAT_OK) p->count = qmat_hull_vertices_keep(p->points, p->count, triangles, triangle_count, is_vertex);
  qmat_free(triangles);
  qmat_free(is_vertex);
  return status == QMAT_ERROR_GEOMETRY ? QMAT_OK : status;
}

/* How far apart the vertices of hulls at the end are at least. */
static double least_gap(const merging *m) {
  return fmin(least_edge * qmat_surface_frame(m->solid)->diagonal, edge_share * m->error);
}

/* Sets the vertices of a hull. Of those too near to each other one stays, unless the rest has no volume. */
static qmat_status set_vertices(const merging *m, part *p, double *points, size_t count, joint *j) {
  if (!set_points(p, points, count)) return QMAT_ERROR_MEMORY;
  size_t apart = qmat_hull_vertices_apart(points, count, least_gap(m)), triangles;
  if (apart == count) return QMAT_OK;
  const qmat_status status = qmat_convex_hull(points, apart, j->triangles, &triangles);
  if (status == QMAT_ERROR_GEOMETRY) return QMAT_OK;
  if (status != QMAT_OK) return status;
  memcpy(p->points, points, 3 * apart * sizeof *points);
  p->count = qmat_hull_vertices_keep(p->points, apart, j->triangles, triangles, j->is_vertex);
  qmat_hull_box(p->points, p->count, p->low, p->high);
  return QMAT_OK;
}

/* Makes of points a hull with as few vertices as it may have: triangles or half-spaces, whichever has the smaller
 * volume. It contains all within `gap` of them: as much as it may lose where vertices are too near to each other. With
 * 0 they may not be: `*again` tells where they are, and the points stay. */
static qmat_status reduce_points(const merging *m, part *p, double gap, joint *j, bool *again) {
  const qmat_tangent_hull *coarse = &j->coarse;
  const qmat_outer_hull *outer = &j->outer;
  const double margin = margin_of(m) + gap;
  double of_outer = INFINITY;
  size_t triangles;
  qmat_status status = surround(&j->coarse, p->points, p->count, margin, m->error);
  if (status == QMAT_OK) status = qmat_convex_hull(coarse->points, coarse->point_count, j->triangles, &triangles);
  if (status != QMAT_OK) return status;
  const double of_coarse = qmat_hull_volume(coarse->points, j->triangles, triangles);
  status = qmat_outer_hull_fit(&j->outer, p->points, p->count, margin, fine_share * m->error);
  if (status == QMAT_OK) status = qmat_convex_hull(outer->points, outer->point_count, j->triangles, &triangles);
  if (status == QMAT_OK) of_outer = qmat_hull_volume(outer->points, j->triangles, triangles);
  if (status != QMAT_OK && status != QMAT_ERROR_GEOMETRY) return status;
  const bool is_outer = of_outer < of_coarse;
  double *vertices = is_outer ? outer->points : coarse->points;
  const size_t count = is_outer ? outer->point_count : coarse->point_count;
  *again = gap == 0 && qmat_hull_vertices_apart(vertices, count, least_gap(m)) < count;
  return *again ? QMAT_OK : set_vertices(m, p, vertices, count, j);
}

static qmat_status collect_points_of(void *data, qmat_context *context, size_t i) {
  merging *m = data;
  qmat_status status = qmat_progress(context, 1, 0, "hulls collected");
  if (status == QMAT_OK) status = collect_points(m, &m->hulls[i], &m->ends[i]);
  m->done++;
  return record(context, status);
}

static qmat_status reduce_points_of(void *data, qmat_context *context, size_t i) {
  merging *m = data;
  joint *j = joint_of_thread(m, context);
  bool again;
  qmat_status status = reduce_points(m, &m->ends[i], 0, j, &again);
  if (status == QMAT_OK && again) status = reduce_points(m, &m->ends[i], least_gap(m), j, &again);
  m->done++;
  return record(context, status);
}

/* Makes the hulls around the pieces in place of the parts. */
static qmat_status make_hulls(merging *m) {
  const int threads = qmat_threads(m->context);
  const size_t count = m->live_count;
  size_t room = 4;
  m->ends = qmat_arena_calloc(&m->context->arena, count + 1, sizeof *m->ends);
  if (!m->ends) return qmat_fail_memory(m->context, "the hulls");
  m->done = 0;
  qmat_status status =
      qmat_run_side_by_side(m->context, count, collect_points_of, m, &m->done, count, "hulls collected");
  for (size_t i = 0; i < count; i++) room = m->ends[i].count > room ? m->ends[i].count : room;
  for (int i = 0; i < threads && status == QMAT_OK; i++)
    status = qmat_outer_hull_init(m->context, room, m->most_points, &m->joints[i].outer);
  m->done = 0;
  if (status == QMAT_OK)
    status = qmat_run_side_by_side(m->context, count, reduce_points_of, m, &m->done, count, "hulls fitted");
  end_of_items(m);
  return status;
}

/* Writes the hulls. */
static qmat_status write_hulls(merging *m, qmat_colliders *c) {
  size_t room = 0;
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < m->live_count; i++) room += m->ends[i].count;
  double *points = qmat_alloc(room, 3 * sizeof *points);
  uint32_t *triangles = qmat_alloc(room, 6 * sizeof *triangles);
  uint32_t *shapes = qmat_alloc(m->live_count, 3 * sizeof *shapes);
  uint32_t *joints = c->joint_count > 0 ? qmat_alloc(m->live_count, sizeof *joints) : NULL;
  if (!points || !triangles || !shapes || (c->joint_count > 0 && !joints)) status = QMAT_ERROR_MEMORY;
  size_t count = 0, point_count = 0, triangle_count = 0;
  for (size_t i = 0; i < m->live_count && status == QMAT_OK; i++) {
    const part *p = &m->ends[i];
    size_t of_hull = 0;
    status = qmat_convex_hull(p->points, p->count, &triangles[3 * triangle_count], &of_hull);
    if (status != QMAT_OK) break;
    memcpy(&points[3 * point_count], p->points, 3 * p->count * sizeof *points);
    for (size_t k = 0; k < 3 * of_hull; k++) triangles[3 * triangle_count + k] += (uint32_t)point_count;
    memcpy(&shapes[3 * count], &c->shapes[3 * (size_t)m->hulls[i].shape], 3 * sizeof *shapes);
    if (joints) joints[count] = c->joints[m->hulls[i].shape];
    c->hull_ends[2 * count] = (uint32_t)(point_count += p->count);
    c->hull_ends[2 * count++ + 1] = (uint32_t)(triangle_count += of_hull);
  }
  if (status == QMAT_OK) {
    double *old_points = c->points;
    uint32_t *old_triangles = c->triangles, *old_shapes = c->shapes;
    c->points = points, points = old_points;
    c->triangles = triangles, triangles = old_triangles;
    c->shapes = shapes, shapes = old_shapes;
    if (joints) {
      uint32_t *old_joints = c->joints;
      c->joints = joints, joints = old_joints;
      c->joint_count = count;
    }
    c->shape_count = count;
    c->point_count = point_count;
    c->triangle_count = triangle_count;
  }
  qmat_free(points);
  qmat_free(triangles);
  qmat_free(shapes);
  qmat_free(joints);
  return fail(m, status);
}

qmat_status qmat_hulls_merge(qmat_context *context, const qmat_surface *solid, qmat_solid_part *parts, size_t most,
                             size_t most_points, double error, qmat_colliders *colliders) {
  merging m = {
      .context = context, .solid = solid, .limit = error / qmat_surface_frame(solid)->diagonal, .error = 0.2 * error};
  qmat_status status = init(&m, parts, colliders->shape_count, most_points);
  for (size_t enough = 1; status == QMAT_OK; enough = most, m.limit *= limit_step) {
    status = find_pairs(&m);
    for (pair *p; status == QMAT_OK && m.live_count > enough && (p = best_pair(&m));) {
      status = qmat_progress(context, m.part_count - m.live_count, m.part_count, "hulls joined");
      if (status == QMAT_OK) status = fail(&m, test_pair(&m, p, MANY_HALVINGS, &m.joints[0]));
      if (status == QMAT_OK && !p->exceeds) status = join_pair(&m, p->a, p->b);
    }
    if (most == 0 || m.live_count <= most || !(m.limit < 1)) break;
  }
  if (status == QMAT_OK) status = collect_pieces(&m);
  if (status == QMAT_OK) status = qmat_hulls_exchange(context, solid, m.limit, parts, m.hulls, m.live_count);
  if (status == QMAT_OK) status = make_hulls(&m);
  if (status == QMAT_OK && m.live_count > 0) status = write_hulls(&m, colliders);
  for (size_t i = 0; m.hulls && i < m.live_count; i++) {
    qmat_free(m.hulls[i].pieces);
    if (m.ends) qmat_free(m.ends[i].points);
  }
  for (size_t i = 0; m.parts && i < m.part_count; i++) qmat_free(m.parts[i].points);
  qmat_free(m.pairs);
  return status;
}
