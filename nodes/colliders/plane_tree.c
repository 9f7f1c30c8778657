/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/plane_tree.h"

#include <math.h>
#include <string.h>

#include "core/arena.h"
#include "core/geometry/morton.h"
#include "core/geometry/vector.h"
#include "nodes/colliders/hull_vertices.h"

enum { LEAF_SIZE = 8 };

/* The rounding of heights, as a share of coordinates and offsets. */
static const double rounding = 1e-14;

/* Planes of facets near each other. At a point p each of them is at most normal (p - place) + spread |p - place| + rise
 * below it. */
typedef struct qmat_plane_node {
  double place[3], normal[3]; /* the means of facets and normals */
  double spread;              /* the largest distance of a normal from the mean */
  double rise;                /* of `place` over a plane, at most */
} plane_node;

/* The planes of a node. */
static void items_of(const qmat_plane_tree *t, size_t node, size_t *begin, size_t *end) {
  qmat_curve_node_items(t->count, t->leaf_count, node, begin, end);
}

static void fill_node(const qmat_plane_tree *t, const double (*places)[3], size_t number) {
  plane_node *node = &t->nodes[number];
  size_t begin, end;
  items_of(t, number, &begin, &end);
  *node = (plane_node){.rise = -INFINITY};
  for (size_t i = begin; i < end; i++)
    for (int k = 0; k < 3; k++) {
      node->place[k] += places[t->order[i].id][k] / (double)(end - begin);
      node->normal[k] += t->planes[4 * (size_t)t->order[i].id + (size_t)k] / (double)(end - begin);
    }
  for (size_t i = begin; i < end; i++) {
    const double *plane = &t->planes[4 * (size_t)t->order[i].id];
    node->spread = fmax(node->spread, qmat_point_distance(plane, node->normal));
    node->rise = fmax(node->rise, qmat_dot(plane, node->place) - plane[3]);
  }
}

static bool make_room(qmat_plane_tree *t, size_t count) {
  if (count <= t->room) return true;
  qmat_plane_tree_uninit(t);
  t->order = qmat_alloc(2 * count, sizeof *t->order);
  t->nodes = qmat_alloc(count, sizeof *t->nodes); /* enough: leaves have LEAF_SIZE / 2 planes at least */
  t->room = t->order && t->nodes ? 2 * count : 0;
  return t->room > 0;
}

bool qmat_plane_tree_make(qmat_plane_tree *tree, const double *planes, const double (*places)[3], size_t count) {
  double low[3], high[3], size = 0, reach = 0;
  if (!make_room(tree, count + LEAF_SIZE)) return false;
  tree->planes = planes;
  tree->count = count;
  tree->leaf_count = 1;
  while (tree->leaf_count * LEAF_SIZE < count) tree->leaf_count *= 2;
  qmat_hull_box(places[0], count, low, high);
  for (int k = 0; k < 3; k++) {
    size = fmax(size, high[k] - low[k]);
    reach += fmax(fabs(low[k]), fabs(high[k]));
  }
  for (size_t i = 0; i < count; i++) {
    double at[3];
    for (int k = 0; k < 3; k++) at[k] = size > 0 ? (places[i][k] - low[k]) / size - 0.5 : 0;
    tree->order[i] = (qmat_curve_item){qmat_curve_code(at), (uint32_t)i};
    reach = fmax(reach, fabs(planes[4 * i + 3]));
  }
  tree->slack = rounding * reach;
  qmat_curve_sort(tree->order, count);
  for (size_t i = 1; i < 2 * tree->leaf_count; i++) fill_node(tree, places, i);
  return true;
}

/* At most so far the point is outside of a plane of the node. */
static double bound(const qmat_plane_tree *t, size_t number, const double *point) {
  const plane_node *node = &t->nodes[number];
  double offset[3];
  qmat_subtract(point, node->place, offset);
  const double length = sqrt(qmat_dot(offset, offset));
  return qmat_dot(node->normal, offset) + node->spread * length + node->rise + t->slack + 4 * rounding * length;
}

size_t qmat_plane_tree_farthest(const qmat_plane_tree *tree, const double *point, double *height, size_t *visited) {
  size_t stack[80], best = SIZE_MAX;
  double bounds[80];
  int depth = 0;
  stack[0] = 1;
  bounds[depth++] = INFINITY;
  while (depth > 0) {
    const size_t number = stack[--depth];
    if (bounds[depth] <= *height) continue;
    if (number < tree->leaf_count) { /* the child that may be farther comes first */
      const double left = bound(tree, 2 * number, point), right = bound(tree, 2 * number + 1, point);
      const bool left_first = left > right;
      stack[depth] = 2 * number + (left_first ? 1 : 0);
      bounds[depth++] = left_first ? right : left;
      stack[depth] = 2 * number + (left_first ? 0 : 1);
      bounds[depth++] = left_first ? left : right;
      continue;
    }
    size_t begin, end;
    items_of(tree, number, &begin, &end);
    if (visited) *visited += end - begin;
    for (size_t i = begin; i < end; i++) {
      const uint32_t id = tree->order[i].id;
      const double *plane = &tree->planes[4 * (size_t)id];
      const double of_plane = qmat_dot(plane, point) - plane[3];
      if (!(of_plane > *height) && !(of_plane == *height && best != SIZE_MAX && id < best)) continue;
      *height = of_plane;
      best = id;
    }
  }
  return best;
}

void qmat_plane_tree_uninit(qmat_plane_tree *tree) {
  qmat_free(tree->nodes);
  qmat_free(tree->order);
  *tree = (qmat_plane_tree){0};
}
