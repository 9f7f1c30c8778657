/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/flat_folds.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/half_edges.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector.h"
#include "nodes/mesh/flat_fill_cgal.h"

/* Half-edges, or folds, between two polls for a cancel. */
enum { POLL = 65536 };
/* A fold is as flat as this share of its triangles' heights, and so are the corners of its face; else it has an inside
 * worth keeping. */
static const double flatness = 1e-3;

/* Two triangles on the same side of their edge; the larger one is the first. */
typedef struct fold {
  double area, height; /* twice the larger one's area; the smaller height above the edge */
  uint32_t first, second;
} fold;

/* A side of a triangle of a face. */
typedef struct side {
  uint32_t low, high;
  int direction; /* 1: to the higher end, else -1 */
} side;

typedef struct unfolder {
  qmat_context *context;
  const double *positions;
  double tolerance, longest_fold;
  qmat_half_edges e;
  uint32_t *mates; /* per half-edge: the other one of an edge of two triangles, or UINT32_MAX */
  fold *folds;
  size_t fold_count, fold_capacity;
  uint8_t *is_seen;  /* per triangle: 1 in a face, 2 in one that is triangulated again */
  uint32_t *numbers; /* per vertex: its number in the face, or UINT32_MAX */
  uint32_t *members; /* triangles of the face; room for all */
  size_t member_count;
  double distance; /* of the face's corners from its plane */
  qmat_flat_folds *result;
  size_t capacity; /* of result->triangles */
} unfolder;

static qmat_status fail_shortage(const unfolder *u) {
  return qmat_fail_memory(u->context, "the flat faces");
}

static const double *position(const unfolder *u, uint32_t vertex) {
  return u->positions + 3 * (size_t)vertex;
}

static void normal_of(const unfolder *u, uint32_t triangle, double normal[3]) {
  const uint32_t *c = u->e.triangles + 3 * (size_t)triangle;
  qmat_triangle_normal(position(u, c[0]), position(u, c[1]), position(u, c[2]), normal);
}

/* ---- folds ---- */

/* Whether the triangles of two opposite half-edges lie flat on the same side of their edge. */
static bool is_fold(const unfolder *u, uint32_t h, uint32_t mate, fold *found) {
  const double *start = position(u, qmat_half_edge_start(&u->e, h)), *end = position(u, qmat_half_edge_end(&u->e, h));
  double one[3], other[3];
  normal_of(u, h / 3, one);
  normal_of(u, mate / 3, other);
  if (!(qmat_dot(one, other) < 0)) return false; /* nearly all end here */
  const double length = qmat_point_distance(start, end), a = sqrt(qmat_dot(one, one)), b = sqrt(qmat_dot(other, other));
  const bool swaps = b > a;
  const uint32_t apex = qmat_half_edge_across(&u->e, swaps ? h : mate);
  const double *p = position(u, apex), *n = swaps ? other : one, largest = fmax(a, b);
  const double from[3] = {p[0] - start[0], p[1] - start[1], p[2] - start[2]};
  *found = (fold){largest, fmin(a, b) / length, (swaps ? mate : h) / 3, (swaps ? h : mate) / 3};
  return found->height > u->longest_fold &&
         fabs(qmat_dot(n, from)) <= largest * fmin(u->tolerance, flatness * found->height);
}

static int compare_folds(const void *left, const void *right) {
  const fold *a = left, *b = right;
  if (a->area != b->area) return a->area > b->area ? -1 : 1;
  if (a->first != b->first) return a->first < b->first ? -1 : 1;
  return (a->second > b->second) - (a->second < b->second);
}

/* Fills `mates` and `folds`, the largest fold first: its plane is the most precise. */
static qmat_status find_folds(unfolder *u) {
  const qmat_half_edges *e = &u->e;
  qmat_status status = QMAT_OK;
  memset(u->mates, 0xff, e->count * sizeof *u->mates);
  for (size_t first = 0, last, poll = 0; status == QMAT_OK && first < e->count; first = last) {
    last = qmat_edge_last(e, first);
    const uint32_t h = e->order[first], mate = e->order[last - 1];
    fold found;
    if (last >= poll) status = qmat_progress(u->context, first, e->count, "folds"), poll = last + POLL;
    if (last - first != 2 || qmat_half_edge_rises(e, h) == qmat_half_edge_rises(e, mate)) continue;
    u->mates[h] = mate;
    u->mates[mate] = h;
    if (status != QMAT_OK || !is_fold(u, h, mate, &found)) continue;
    if (u->fold_count + 1 > u->fold_capacity &&
        qmat_grow((void **)&u->folds, &u->fold_capacity, u->fold_count + 1, sizeof *u->folds) != 0)
      return fail_shortage(u);
    u->folds[u->fold_count++] = found;
  }
  if (u->fold_count > 0) qsort(u->folds, u->fold_count, sizeof *u->folds, compare_folds);
  return status;
}

/* ---- a face ---- */

/* Collects the triangles in the plane of a fold that are connected with it. */
static void find_face(unfolder *u, const fold *f, double normal[3]) {
  const double *origin = position(u, u->e.triangles[3 * (size_t)f->first]);
  const double most = f->area * fmin(u->tolerance, flatness * f->height);
  double farthest = 0;
  normal_of(u, f->first, normal);
  u->members[0] = f->first;
  u->is_seen[f->first] = 1;
  u->member_count = 1;
  for (size_t i = 0; i < u->member_count; i++)
    for (size_t k = 0; k < 3; k++) {
      const uint32_t mate = u->mates[3 * (size_t)u->members[i] + k];
      if (mate == UINT32_MAX || u->is_seen[mate / 3]) continue;
      const double *p = position(u, qmat_half_edge_across(&u->e, mate));
      const double from[3] = {p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]};
      const double distance = fabs(qmat_dot(normal, from));
      if (!(distance <= most)) continue;
      farthest = fmax(farthest, distance);
      u->is_seen[mate / 3] = 1;
      u->members[u->member_count++] = mate / 3;
    }
  u->distance = farthest / f->area;
}

static int compare_sides(const void *left, const void *right) {
  const side *a = left, *b = right;
  if (a->low != b->low) return a->low < b->low ? -1 : 1;
  return (a->high > b->high) - (a->high < b->high);
}

/* The border of a face in numbers of its vertices: `border` has room for 2 per side. False if an edge is used twice
 * more in one direction than in the other. */
static bool find_border(const unfolder *u, side *sides, uint32_t *border, size_t *count) {
  const size_t side_count = 3 * u->member_count;
  for (size_t i = 0; i < side_count; i++) {
    const uint32_t h = 3 * u->members[i / 3] + (uint32_t)(i % 3);
    const uint32_t a = u->numbers[qmat_half_edge_start(&u->e, h)], b = u->numbers[qmat_half_edge_end(&u->e, h)];
    sides[i] = a < b ? (side){a, b, 1} : (side){b, a, -1};
  }
  qsort(sides, side_count, sizeof *sides, compare_sides);
  *count = 0;
  for (size_t first = 0, last; first < side_count; first = last) {
    int net = 0;
    for (last = first; last < side_count && compare_sides(&sides[first], &sides[last]) == 0; last++)
      net += sides[last].direction;
    if (net > 1 || net < -1) return false;
    if (net == 0) continue;
    border[2 * *count] = net > 0 ? sides[first].low : sides[first].high;
    border[2 * *count + 1] = net > 0 ? sides[first].high : sides[first].low;
    ++*count;
  }
  return true;
}

/* Takes the place of the face's triangles: `made` triangles of numbers of the face's vertices. */
static qmat_status replace(unfolder *u, const uint32_t *vertices, const uint32_t *triangles, size_t made) {
  qmat_flat_folds *r = u->result;
  const size_t wanted = 3 * (r->triangle_count + made);
  if (wanted > u->capacity && qmat_grow((void **)&r->triangles, &u->capacity, wanted, sizeof *r->triangles) != 0)
    return fail_shortage(u);
  for (size_t i = 0; i < 3 * made; i++) r->triangles[3 * r->triangle_count + i] = vertices[triangles[i]];
  r->triangle_count += made;
  for (size_t i = 0; i < u->member_count; i++) u->is_seen[u->members[i]] = 2;
  r->faces++;
  r->distance = fmax(r->distance, u->distance);
  return QMAT_OK;
}

static size_t count_used(const uint32_t *triangles, size_t made, uint8_t *is_used) {
  size_t used = 0;
  for (size_t i = 0; i < 3 * made; i++) {
    used += !is_used[triangles[i]];
    is_used[triangles[i]] = 1;
  }
  return used;
}

/* `vertices`: the face's, by number. */
static qmat_status fill_face(unfolder *u, const double normal[3], const uint32_t *vertices, size_t count) {
  qmat_arena *arena = &u->context->arena;
  const double x = fabs(normal[0]), y = fabs(normal[1]), z = fabs(normal[2]);
  /* Without its steepest axis a plane keeps its coordinates: what is on a line stays on one. */
  const size_t drop = x > y && x > z ? 0 : y > z ? 1 : 2;
  side *sides = qmat_arena_alloc(arena, 3 * u->member_count, sizeof *sides);
  uint32_t *border = qmat_arena_alloc(arena, 6 * u->member_count, sizeof *border),
           *triangles = qmat_arena_alloc(arena, 6 * count, sizeof *triangles);
  double *points = qmat_arena_alloc(arena, 2 * count, sizeof *points);
  uint8_t *is_used = qmat_arena_calloc(arena, count, 1);
  if (!sides || !border || !triangles || !points || !is_used) return fail_shortage(u);
  for (size_t i = 0; i < count; i++) {
    points[2 * i] = position(u, vertices[i])[(drop + 1) % 3];
    points[2 * i + 1] = position(u, vertices[i])[(drop + 2) % 3];
  }
  size_t side_count, made = 0;
  qmat_status status = QMAT_OK;
  const bool is_simple = find_border(u, sides, border, &side_count);
  if (is_simple && side_count == 0) return QMAT_OK;
  if (is_simple) status = qmat_fill_flat_polygons(u->context, points, count, border, side_count, triangles, &made);
  if (status != QMAT_OK) return status;
  if (made == 0) {
    if (u->result->failed++ == 0) u->result->place = vertices[0];
    return QMAT_OK;
  }
  return count_used(triangles, made, is_used) == count ? replace(u, vertices, triangles, made) : QMAT_OK;
}

static qmat_status unfold(unfolder *u, const fold *f) {
  double normal[3];
  size_t count = 0;
  find_face(u, f, normal);
  uint32_t *vertices = qmat_arena_alloc(&u->context->arena, 3 * u->member_count, sizeof *vertices);
  if (!vertices) return fail_shortage(u);
  for (size_t i = 0; i < 3 * u->member_count; i++) {
    const uint32_t v = u->e.triangles[3 * (size_t)u->members[i / 3] + i % 3];
    if (u->numbers[v] != UINT32_MAX) continue;
    u->numbers[v] = (uint32_t)count;
    vertices[count++] = v;
  }
  const qmat_status status = fill_face(u, normal, vertices, count);
  for (size_t i = 0; i < count; i++) u->numbers[vertices[i]] = UINT32_MAX;
  return status;
}

/* The given triangles that stay, then the new ones. */
static qmat_status join_triangles(unfolder *u, size_t given) {
  qmat_flat_folds *r = u->result;
  const size_t made = r->triangle_count;
  uint32_t *all = qmat_arena_alloc(&u->context->arena, 3 * (given + made), sizeof *all);
  if (!all) return fail_shortage(u);
  size_t count = 0;
  for (size_t t = 0; t < given; t++)
    if ((u->is_seen[t] = u->is_seen[t] != 2)) memcpy(all + 3 * count++, u->e.triangles + 3 * t, 3 * sizeof *all);
  memcpy(all + 3 * count, r->triangles, 3 * made * sizeof *all);
  qmat_free(r->triangles);
  r->triangles = all;
  r->triangle_count = count + made;
  r->stays = u->is_seen;
  return QMAT_OK;
}

qmat_status qmat_unfold_flat_faces(qmat_context *context, size_t vertex_count, const double *positions,
                                   size_t triangle_count, const uint32_t *triangles, double tolerance,
                                   double longest_fold, qmat_flat_folds *folds) {
  *folds = (qmat_flat_folds){.faces = 0};
  unfolder u = {.context = context,
                .positions = positions,
                .tolerance = tolerance,
                .longest_fold = longest_fold,
                .result = folds};
  qmat_arena *arena = &context->arena;
  qmat_status status = qmat_half_edges_sort(context, vertex_count, triangle_count, triangles, &u.e);
  u.mates = qmat_arena_alloc(arena, 3 * triangle_count, sizeof *u.mates);
  if (status == QMAT_OK && !u.mates) status = fail_shortage(&u);
  if (status == QMAT_OK) status = find_folds(&u);
  if (status == QMAT_OK && u.fold_count > 0) {
    u.is_seen = qmat_arena_calloc(arena, triangle_count, 1);
    u.numbers = qmat_arena_alloc(arena, vertex_count, sizeof *u.numbers);
    u.members = qmat_arena_alloc(arena, triangle_count, sizeof *u.members);
    if (!u.is_seen || !u.numbers || !u.members)
      status = fail_shortage(&u);
    else
      memset(u.numbers, 0xff, vertex_count * sizeof *u.numbers);
  }
  for (size_t i = 0; status == QMAT_OK && i < u.fold_count; i++) {
    if (i % 1024 == 0) status = qmat_progress(context, i, u.fold_count, "folded faces");
    if (status == QMAT_OK && !u.is_seen[u.folds[i].first] && !u.is_seen[u.folds[i].second])
      status = unfold(&u, &u.folds[i]);
  }
  if (status == QMAT_OK && folds->faces > 0) status = join_triangles(&u, triangle_count);
  if (status != QMAT_OK) {
    qmat_free(folds->triangles); /* not yet the arena's */
    folds->triangles = NULL;
  }
  qmat_free(u.folds);
  return status;
}
