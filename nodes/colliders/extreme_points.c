/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/extreme_points.h"

#include <stdlib.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "nodes/colliders/convex_hull_cgal.h"
#include "nodes/colliders/hull_vertices.h"
#include "nodes/colliders/plane_tree.h"

/* So many points of a heap are reduced. Points inside of the hull of those along every fourth direction go first. */
enum { MANY_POINTS = 4096, FEW_STRIDE = 4 };

/* Of more planes the farthest of a point is found by a tree. */
enum { FEW_PLANES = 64 };

/* Those may be so far outside of that hull. */
static const double least_tolerance = 1e-9;

/* The points: those chosen, those left that may be outside of the hull of these, and those dropped. */
typedef struct cloud {
  qmat_growing_hull hull;
  double *points;
  size_t chosen, left; /* left: the end of those that are */
  double *planes;      /* of the facets of the hull: normal, offset */
  double (*places)[3]; /* their centroids */
  qmat_plane_tree tree;
  uint32_t *triangles;
  size_t *farthest; /* of each facet: the number of its farthest point, or `none` */
  double *heights;
  size_t plane_count, room; /* room: points whose hull fits in the arrays */
} cloud;

static const size_t none = SIZE_MAX;

static void swap_points(double *points, size_t i, size_t j) {
  double kept[3];
  memcpy(kept, &points[3 * i], sizeof kept);
  memmove(&points[3 * i], &points[3 * j], sizeof kept);
  memcpy(&points[3 * j], kept, sizeof kept);
}

/* Moves the farthest points along every `stride`-th direction behind the first `chosen` ones; the number with these. */
static size_t choose_farthest(double *points, size_t count, size_t chosen, size_t directions, size_t stride) {
  for (size_t d = 0; d < directions && count > 0; d += stride) {
    double direction[3], most = -INFINITY;
    size_t best = 0;
    qmat_spread_direction(d, directions, direction);
    for (size_t i = 0; i < count; i++) {
      const double height = qmat_dot(direction, &points[3 * i]);
      if (!(height > most)) continue;
      most = height;
      best = i;
    }
    if (best >= chosen) swap_points(points, best, chosen++);
  }
  return chosen;
}

size_t qmat_extreme_points_first(double *points, size_t count, size_t directions) {
  return choose_farthest(points, count, 0, directions, 1);
}

static bool make_room(cloud *c) {
  if (c->chosen <= c->room) return true;
  c->room = 2 * c->chosen;
  qmat_free(c->planes);
  qmat_free(c->places);
  qmat_free(c->triangles);
  qmat_free(c->farthest);
  qmat_free(c->heights);
  c->planes = qmat_alloc(c->room, 8 * sizeof *c->planes);
  c->places = qmat_alloc(c->room, 2 * sizeof *c->places);
  c->triangles = qmat_alloc(c->room, 6 * sizeof *c->triangles);
  c->farthest = qmat_alloc(c->room, 2 * sizeof *c->farthest);
  c->heights = qmat_alloc(c->room, 2 * sizeof *c->heights);
  return c->planes && c->places && c->triangles && c->farthest && c->heights;
}

/* The planes of the hull of the points chosen. */
static qmat_status find_planes(cloud *c) {
  size_t count;
  if (!make_room(c)) return QMAT_ERROR_MEMORY;
  const qmat_status status = qmat_growing_hull_of(&c->hull, c->points, c->chosen, c->triangles, &count);
  if (status != QMAT_OK) return status;
  c->plane_count = 0;
  for (size_t t = 0; t < count; t++) {
    const uint32_t *corners = &c->triangles[3 * t];
    if (!qmat_hull_plane(c->points, corners, &c->planes[4 * c->plane_count])) continue;
    for (size_t k = 0; k < 3; k++)
      c->places[c->plane_count][k] = (c->points[3 * (size_t)corners[0] + k] + c->points[3 * (size_t)corners[1] + k] +
                                      c->points[3 * (size_t)corners[2] + k]) /
                                     3;
    c->farthest[c->plane_count] = none;
    c->heights[c->plane_count++] = 0;
  }
  if (c->plane_count <= FEW_PLANES) return QMAT_OK;
  const double(*places)[3] = (const double(*)[3])c->places;
  return qmat_plane_tree_make(&c->tree, c->planes, places, c->plane_count) ? QMAT_OK : QMAT_ERROR_MEMORY;
}

/* The plane that a point is the farthest outside of, the first of equal ones, if by more than `*most`; `none`. */
static size_t farthest_plane(const cloud *c, const double *point, double *most) {
  size_t plane = none;
  if (c->plane_count > FEW_PLANES) return qmat_plane_tree_farthest(&c->tree, point, most, NULL);
  for (size_t t = 0; t < c->plane_count; t++) {
    const double height = qmat_dot(&c->planes[4 * t], point) - c->planes[4 * t + 3];
    if (!(height > *most)) continue;
    *most = height;
    plane = t;
  }
  return plane;
}

/* Drops points inside of all planes, and finds the farthest of each plane among the points that it is the farthest
 * plane of. */
static void drop_points(cloud *c, double tolerance) {
  for (size_t i = c->chosen; i < c->left;) {
    double most = tolerance;
    const size_t plane = farthest_plane(c, &c->points[3 * i], &most);
    if (plane == none) {
      swap_points(c->points, i, --c->left);
      continue;
    }
    if (most > c->heights[plane]) {
      c->heights[plane] = most;
      c->farthest[plane] = i;
    }
    i++;
  }
}

static int compare_numbers(const void *left, const void *right) {
  const size_t a = *(const size_t *)left, b = *(const size_t *)right;
  return (a > b) - (a < b);
}

/* Chooses the farthest points of the planes, in ascending order: so none has changed its place before it is chosen. */
static void choose_points(cloud *c) {
  qsort(c->farthest, c->plane_count, sizeof *c->farthest, compare_numbers);
  for (size_t t = 0; t < c->plane_count && c->farthest[t] != none; t++)
    swap_points(c->points, c->farthest[t], c->chosen++);
}

qmat_status qmat_extreme_points_keep(double *points, size_t *count, double tolerance) {
  cloud c = {.points = points, .left = *count};
  if (*count <= QMAT_EXTREME_DIRECTIONS) return QMAT_OK;
  c.chosen = choose_farthest(points, c.left, 0, QMAT_EXTREME_DIRECTIONS, FEW_STRIDE);
  qmat_status status = c.chosen >= 4 ? find_planes(&c) : QMAT_ERROR_GEOMETRY;
  if (status == QMAT_OK) drop_points(&c, qmat_smaller(tolerance, least_tolerance));
  if (status != QMAT_ERROR_MEMORY) status = QMAT_OK; /* more directions may have a hull */
  c.chosen = choose_farthest(points, c.left, c.chosen, QMAT_EXTREME_DIRECTIONS, 1);
  while (status == QMAT_OK && c.chosen >= 4) {
    status = find_planes(&c);
    if (status != QMAT_OK) break;
    drop_points(&c, tolerance);
    if (c.chosen == c.left) break;
    choose_points(&c);
  }
  if (status == QMAT_OK && c.chosen >= 4) *count = c.chosen;
  qmat_growing_hull_uninit(&c.hull);
  qmat_plane_tree_uninit(&c.tree);
  qmat_free(c.planes);
  qmat_free(c.places);
  qmat_free(c.triangles);
  qmat_free(c.farthest);
  qmat_free(c.heights);
  return status == QMAT_ERROR_MEMORY ? status : QMAT_OK;
}

bool qmat_point_heap_add(qmat_point_heap *heap, const double *points, size_t count, double tolerance) {
  if (count == 0) return true;
  if (heap->limit == 0) heap->limit = MANY_POINTS;
  if (heap->count + count > heap->limit) {
    if (qmat_extreme_points_keep(heap->points, &heap->count, tolerance) != QMAT_OK) return false;
    heap->limit = 2 * (heap->count + count) > MANY_POINTS ? 2 * (heap->count + count) : MANY_POINTS;
  }
  if (qmat_grow((void **)&heap->points, &heap->capacity, 3 * (heap->count + count), sizeof *heap->points) != 0)
    return false;
  memcpy(&heap->points[3 * heap->count], points, 3 * count * sizeof *points);
  heap->count += count;
  return true;
}
