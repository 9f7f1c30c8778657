/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/hull_merge.h"

#include <math.h>
#include <omp.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "nodes/colliders/convex_hull_cgal.h"
#include "nodes/colliders/tangent_hull.h"

/* Until the end joint hulls may have this many times as many vertices as the limit. */
enum { ROOM_FACTOR = 4 };

/* Pairs are compared by a coarse search; the one that is joined is searched to the end. */
enum { FEW_HALVINGS = 3, MANY_HALVINGS = 48 };

/* The limit rises by this factor while there are too many hulls, up to the diagonal. */
static const double limit_step = 1.25;

typedef struct part {
  double *points; /* 3 each */
  size_t count;
  double low[3], high[3]; /* of its box */
  double volume;
  uint32_t shape; /* whose spheres it keeps */
  bool live, is_joint;
} part;

typedef struct pair {
  uint32_t a, b; /* a < b */
  double leaves; /* how far the joint hull was found to leave the solid; unit frame */
  double growth; /* the volume of the joint hull, less those of the two */
  bool exceeds;  /* `leaves` is above the limit of the test */
} pair;

/* Scratch of a thread: a joint hull. */
typedef struct joint {
  size_t point_count, triangle_count;
  double *points, *unit; /* in the model, and in the unit frame */
  uint32_t *triangles;
} joint;

typedef struct merging {
  qmat_context *context;
  const qmat_surface *solid;
  size_t room; /* vertices of a part */
  double limit;
  part *parts;
  size_t part_count, live_count;
  pair *pairs;
  size_t pair_count, pair_capacity;
  joint *joints; /* one per thread */
} merging;

/* The volume within a closed surface. */
static double volume_of(const double *points, const uint32_t *triangles, size_t count) {
  const double *origin = &points[3 * (size_t)triangles[0]];
  double volume = 0;
  for (size_t i = 0; i < count; i++) {
    double corners[3][3], across[3];
    for (size_t k = 0; k < 3; k++) qmat_subtract(&points[3 * (size_t)triangles[3 * i + k]], origin, corners[k]);
    qmat_cross(corners[0], corners[1], across);
    volume += qmat_dot(across, corners[2]) / 6;
  }
  return volume;
}

static void find_box(part *p) {
  for (int k = 0; k < 3; k++) {
    p->low[k] = INFINITY;
    p->high[k] = -INFINITY;
    for (size_t i = 0; i < p->count; i++) {
      p->low[k] = fmin(p->low[k], p->points[3 * i + (size_t)k]);
      p->high[k] = fmax(p->high[k], p->points[3 * i + (size_t)k]);
    }
  }
}

/* The hull of two parts. */
static qmat_status join(const merging *m, const part *a, const part *b, joint *j) {
  j->point_count = a->count + b->count;
  memcpy(j->points, a->points, 3 * a->count * sizeof *j->points);
  memcpy(&j->points[3 * a->count], b->points, 3 * b->count * sizeof *j->points);
  qmat_frame_to_unit(qmat_surface_frame(m->solid), j->points, j->point_count, j->unit);
  return qmat_convex_hull(j->points, j->point_count, j->triangles, &j->triangle_count);
}

/* Raises `*found` to the largest distance outside of the solid over a triangle, to half of the limit, until it exceeds
 * the limit. The triangle is halved `halvings` times at most. */
static void search_triangle(const merging *m, double corners[3][3], int halvings, double *found) {
  double centre[3], reach = 0, longest = -1, to_triangle = 0;
  int a = 0;
  uint32_t nearest;
  for (int k = 0; k < 3; k++) centre[k] = (corners[0][k] + corners[1][k] + corners[2][k]) / 3;
  const double distance = qmat_surface_distance(m->solid, centre, INFINITY, NULL, &nearest);
  for (int i = 0; i < 3; i++) {
    reach = fmax(reach, qmat_point_distance(corners[i], centre));
    to_triangle = fmax(to_triangle, qmat_surface_distance_to_triangle(m->solid, corners[i], nearest));
    const double length = qmat_point_distance(corners[i], corners[(i + 1) % 3]);
    if (length > longest) {
      longest = length;
      a = i;
    }
  }
  double bound = fmin(to_triangle, distance + reach);
  if (distance > *found) {
    if (qmat_surface_inside(m->solid, centre))
      bound = fmin(bound, reach - distance);
    else
      *found = distance;
  }
  if (*found > m->limit || halvings == 0 || reach <= 0.5 * m->limit || bound <= fmax(*found, 0.5 * m->limit)) return;
  const int b = (a + 1) % 3;
  double low[3][3], high[3][3];
  memcpy(low, corners, sizeof low);
  memcpy(high, corners, sizeof high);
  for (int k = 0; k < 3; k++) low[b][k] = high[a][k] = 0.5 * (corners[a][k] + corners[b][k]);
  search_triangle(m, low, halvings - 1, found);
  if (!(*found > m->limit)) search_triangle(m, high, halvings - 1, found);
}

/* How far the facets between two parts leave the solid. */
static void test_pair(const merging *m, pair *p, int halvings, joint *j) {
  const size_t first = m->parts[p->a].count;
  p->leaves = 0;
  p->exceeds = true;
  if (join(m, &m->parts[p->a], &m->parts[p->b], j) != QMAT_OK) {
    p->leaves = INFINITY;
    return;
  }
  for (size_t t = 0; t < j->triangle_count && !(p->leaves > m->limit); t++) {
    const uint32_t *ids = &j->triangles[3 * t];
    int of_first = 0;
    double corners[3][3];
    for (int i = 0; i < 3; i++) {
      of_first += ids[i] < first;
      memcpy(corners[i], &j->unit[3 * (size_t)ids[i]], sizeof corners[i]);
    }
    if (of_first % 3 != 0) search_triangle(m, corners, halvings, &p->leaves);
  }
  p->growth = volume_of(j->points, j->triangles, j->triangle_count) - m->parts[p->a].volume - m->parts[p->b].volume;
  p->exceeds = p->leaves > m->limit;
}

static bool is_near(const merging *m, const part *a, const part *b) {
  const double gap = m->limit * qmat_surface_frame(m->solid)->diagonal;
  for (int k = 0; k < 3; k++)
    if (a->low[k] > b->high[k] + gap || b->low[k] > a->high[k] + gap) return false;
  return true;
}

static qmat_status add_pair(merging *m, size_t a, size_t b) {
  if (!m->parts[b].live || !is_near(m, &m->parts[a], &m->parts[b])) return QMAT_OK;
  if (qmat_grow((void **)&m->pairs, &m->pair_capacity, m->pair_count + 1, sizeof *m->pairs))
    return qmat_fail_memory(m->context, "pairs of hulls");
  m->pairs[m->pair_count++] = (pair){(uint32_t)(a < b ? a : b), (uint32_t)(a < b ? b : a), 0, 0, true};
  return QMAT_OK;
}

/* Tests the pairs from `first` on. */
static qmat_status test_pairs(merging *m, size_t first) {
  const int threads = qmat_threads(m->context);
  const size_t slice = 64;
  for (; first < m->pair_count; first += slice) {
    const size_t end = first + slice < m->pair_count ? first + slice : m->pair_count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1)
    for (size_t i = first; i < end; i++) test_pair(m, &m->pairs[i], FEW_HALVINGS, &m->joints[omp_get_thread_num()]);
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

/* Joins two parts into the first, unless the hull has too many vertices: then the pair is given up. */
static qmat_status join_pair(merging *m, uint32_t a, uint32_t b) {
  part *into = &m->parts[a], *from = &m->parts[b];
  joint *j = &m->joints[0];
  qmat_status status = join(m, into, from, j);
  if (status != QMAT_OK) return qmat_fail_memory(m->context, "the hulls");
  size_t used = 0;
  bool *is_used = qmat_calloc(j->point_count, sizeof *is_used);
  if (!is_used) return qmat_fail_memory(m->context, "the hulls");
  for (size_t i = 0; i < 3 * j->triangle_count; i++) {
    used += !is_used[j->triangles[i]];
    is_used[j->triangles[i]] = true;
  }
  const bool fits = used <= m->room;
  for (size_t i = 0, k = 0; fits && i < j->point_count; i++)
    if (is_used[i]) memcpy(&into->points[3 * k++], &j->points[3 * i], 3 * sizeof *j->points);
  qmat_free(is_used);
  if (fits) {
    if (from->volume > into->volume) into->shape = from->shape;
    into->volume = volume_of(j->points, j->triangles, j->triangle_count);
    into->count = used;
    into->is_joint = true;
    from->live = false;
    m->live_count--;
    find_box(into);
  }
  size_t kept = 0;
  for (size_t i = 0; i < m->pair_count; i++) {
    const pair *p = &m->pairs[i];
    const bool gone = fits ? p->a == a || p->a == b || p->b == a || p->b == b : p->a == a && p->b == b;
    if (!gone) m->pairs[kept++] = *p;
  }
  m->pair_count = kept;
  for (size_t i = 0; fits && i < m->part_count && status == QMAT_OK; i++)
    if (i != a) status = add_pair(m, a, i);
  return status == QMAT_OK ? test_pairs(m, kept) : status;
}

static qmat_status init(merging *m, const qmat_colliders *c, size_t most_points) {
  qmat_arena *arena = &m->context->arena;
  const int threads = qmat_threads(m->context);
  m->part_count = m->live_count = c->shape_count;
  m->room = ROOM_FACTOR * most_points;
  m->parts = qmat_arena_alloc(arena, m->part_count, sizeof *m->parts);
  m->joints = qmat_arena_alloc(arena, (size_t)threads, sizeof *m->joints);
  if (!m->parts || !m->joints) return qmat_fail_memory(m->context, "the hulls");
  for (int i = 0; i < threads; i++) {
    joint *j = &m->joints[i];
    j->points = qmat_arena_alloc(arena, 2 * m->room, 3 * sizeof *j->points);
    j->unit = qmat_arena_alloc(arena, 2 * m->room, 3 * sizeof *j->unit);
    j->triangles = qmat_arena_alloc(arena, 2 * m->room, 6 * sizeof *j->triangles);
    if (!j->points || !j->unit || !j->triangles) return qmat_fail_memory(m->context, "the hulls");
  }
  for (size_t i = 0; i < m->part_count; i++) {
    part *p = &m->parts[i];
    const size_t first = i > 0 ? c->hull_ends[2 * i - 2] : 0, first_triangle = i > 0 ? c->hull_ends[2 * i - 1] : 0;
    *p = (part){.count = c->hull_ends[2 * i] - first, .shape = (uint32_t)i, .live = true};
    p->points = qmat_arena_alloc(arena, m->room, 3 * sizeof *p->points);
    if (!p->points) return qmat_fail_memory(m->context, "the hulls");
    memcpy(p->points, &c->points[3 * first], 3 * p->count * sizeof *p->points);
    p->volume = volume_of(c->points, &c->triangles[3 * first_triangle], c->hull_ends[2 * i + 1] - first_triangle);
    find_box(p);
  }
  return QMAT_OK;
}

/* Writes the live parts as the hulls, in their order. */
static qmat_status write_parts(merging *m, size_t most_points, double error, qmat_colliders *c) {
  qmat_tangent_hull tangent;
  qmat_status status = qmat_tangent_hull_init(m->context, most_points, &tangent);
  double *points = qmat_alloc(m->live_count * most_points, 3 * sizeof *points);
  uint32_t *triangles = qmat_alloc(m->live_count * most_points, 6 * sizeof *triangles);
  uint32_t *shapes = qmat_alloc(m->live_count, 3 * sizeof *shapes);
  if (status == QMAT_OK && (!points || !triangles || !shapes)) status = qmat_fail_memory(m->context, "the hulls");
  size_t count = 0, point_count = 0, triangle_count = 0;
  for (size_t i = 0; i < m->part_count && status == QMAT_OK; i++) {
    const part *p = &m->parts[i];
    if (!p->live) continue;
    const double *from = p->points;
    size_t of_part = p->count, of_hull = 0;
    if (p->is_joint) {
      status = qmat_tangent_hull_fit_points(&tangent, p->points, p->count, 0, 0.5 * error);
      from = tangent.points;
      of_part = tangent.point_count;
    }
    if (status == QMAT_OK) status = qmat_convex_hull(from, of_part, &triangles[3 * triangle_count], &of_hull);
    if (status != QMAT_OK) break;
    memcpy(&points[3 * point_count], from, 3 * of_part * sizeof *points);
    for (size_t k = 0; k < 3 * of_hull; k++) triangles[3 * triangle_count + k] += (uint32_t)point_count;
    memcpy(&shapes[3 * count], &c->shapes[3 * (size_t)p->shape], 3 * sizeof *shapes);
    c->hull_ends[2 * count] = (uint32_t)(point_count += of_part);
    c->hull_ends[2 * count++ + 1] = (uint32_t)(triangle_count += of_hull);
  }
  if (status == QMAT_OK) {
    double *old_points = c->points;
    uint32_t *old_triangles = c->triangles, *old_shapes = c->shapes;
    c->points = points, points = old_points;
    c->triangles = triangles, triangles = old_triangles;
    c->shapes = shapes, shapes = old_shapes;
    c->shape_count = count;
    c->point_count = point_count;
    c->triangle_count = triangle_count;
  }
  qmat_free(points);
  qmat_free(triangles);
  qmat_free(shapes);
  return status == QMAT_ERROR_GEOMETRY ? qmat_fail(m->context, status, "the solid has no volume") : status;
}

qmat_status qmat_hulls_merge(qmat_context *context, const qmat_surface *solid, size_t most, size_t most_points,
                             double error, qmat_colliders *colliders) {
  merging m = {.context = context, .solid = solid, .limit = error / qmat_surface_frame(solid)->diagonal};
  qmat_status status = init(&m, colliders, most_points);
  for (size_t enough = 1; status == QMAT_OK; enough = most, m.limit *= limit_step) {
    status = find_pairs(&m);
    for (pair *p; status == QMAT_OK && m.live_count > enough && (p = best_pair(&m));) {
      test_pair(&m, p, MANY_HALVINGS, &m.joints[0]);
      if (!p->exceeds) status = join_pair(&m, p->a, p->b);
    }
    if (most == 0 || m.live_count <= most || !(m.limit < 1)) break;
  }
  qmat_free(m.pairs);
  if (status == QMAT_OK && m.live_count < m.part_count) status = write_parts(&m, most_points, error, colliders);
  return status;
}
