/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/winding_tree.h"

#include <math.h>
#include <string.h>

#include "core/geometry/morton.h"
#include "core/geometry/triangle.h"

#define LEAF_SIZE 8
/* A node farther away than this many of its radii is evaluated as one dipole. */
#define DIPOLE_BETA 2.3

/* Triangles as one dipole. */
typedef struct winding_node {
  double centre[3];
  double area_vector[3];
  double radius; /* of a ball around the centre that contains all its triangles */
} winding_node;

/* A tree over the triangles along a curve (qmat_curve_node_items). */
struct qmat_winding_tree {
  const double *positions;
  const uint32_t *triangles;
  size_t count, leaf_count; /* the second is a power of two */
  winding_node *nodes;      /* node 0 is not used */
  uint32_t *order;
};

static const double *corner_position(const qmat_winding_tree *tree, uint32_t triangle, int corner) {
  return tree->positions + 3 * (size_t)tree->triangles[3 * (size_t)triangle + (size_t)corner];
}

/* The solid angle of a triangle as seen from a point, over 4 pi. */
static double solid_angle(const qmat_winding_tree *tree, uint32_t triangle, const double point[3]) {
  double y, x;
  qmat_triangle_half_angle(corner_position(tree, triangle, 0), corner_position(tree, triangle, 1),
                           corner_position(tree, triangle, 2), point, &y, &x);
  return y == 0 ? 0 : atan2(y, x) * (1 / (2 * QMAT_PI));
}

static void items_of(const qmat_winding_tree *tree, size_t node, size_t *begin, size_t *end) {
  qmat_curve_node_items(tree->count, tree->leaf_count, node, begin, end);
}

double qmat_winding_tree_number(const qmat_winding_tree *tree, const double point[3]) {
  size_t stack[72];
  int depth = 0;
  stack[depth++] = 1;
  double winding = 0;
  while (depth > 0) {
    const size_t index = stack[--depth];
    const winding_node *node = tree->nodes + index;
    double offset[3];
    qmat_subtract(node->centre, point, offset);
    const double square = qmat_dot(offset, offset);
    if (square > DIPOLE_BETA * DIPOLE_BETA * node->radius * node->radius) {
      winding += qmat_dot(node->area_vector, offset) / (square * sqrt(square)) * (1 / (4 * QMAT_PI));
    } else if (index >= tree->leaf_count) {
      size_t begin, end;
      items_of(tree, index, &begin, &end);
      for (size_t i = begin; i < end; i++) winding += solid_angle(tree, tree->order[i], point);
    } else {
      stack[depth++] = 2 * index + 1;
      stack[depth++] = 2 * index;
    }
  }
  return winding;
}

static void area_and_centroid(const qmat_winding_tree *tree, uint32_t triangle, double area_vector[3],
                              double centroid[3]) {
  const double *a = corner_position(tree, triangle, 0), *b = corner_position(tree, triangle, 1),
               *c = corner_position(tree, triangle, 2);
  qmat_triangle_normal(a, b, c, area_vector);
  for (int i = 0; i < 3; i++) {
    area_vector[i] *= 0.5;
    centroid[i] = (a[i] + b[i] + c[i]) / 3;
  }
}

static double farthest_corner(const qmat_winding_tree *tree, size_t begin, size_t end, const double centre[3]) {
  double square = 0;
  for (size_t i = begin; i < end; i++) {
    for (int corner = 0; corner < 3; corner++) {
      double offset[3];
      qmat_subtract(corner_position(tree, tree->order[i], corner), centre, offset);
      square = fmax(square, qmat_dot(offset, offset));
    }
  }
  return sqrt(square);
}

/* The area-weighted centre, dipole and radius of the triangles of one leaf. */
static void fill_leaf(const qmat_winding_tree *tree, winding_node *node, size_t begin, size_t end, double *area) {
  double vector[3], centroid[3], mean[3] = {0, 0, 0};
  *area = 0;
  memset(node, 0, sizeof *node);
  for (size_t i = begin; i < end; i++) {
    area_and_centroid(tree, tree->order[i], vector, centroid);
    const double weight = sqrt(qmat_dot(vector, vector));
    *area += weight;
    for (int k = 0; k < 3; k++) {
      node->area_vector[k] += vector[k];
      node->centre[k] += weight * centroid[k];
      mean[k] += centroid[k] / (double)(end - begin);
    }
  }
  for (int k = 0; k < 3; k++) node->centre[k] = *area > 0 ? node->centre[k] / *area : mean[k];
  node->radius = farthest_corner(tree, begin, end, node->centre);
}

/* An inner node of the tree, from its two children. */
static void fill_inner(const qmat_winding_tree *tree, size_t index, double *areas) {
  const winding_node *left = tree->nodes + 2 * index, *right = left + 1;
  winding_node *node = tree->nodes + index;
  const double left_area = areas[2 * index], right_area = areas[2 * index + 1], area = left_area + right_area;
  areas[index] = area;
  const double share = area > 0 ? left_area / area : 0.5;
  for (int k = 0; k < 3; k++) {
    node->centre[k] = share * left->centre[k] + (1 - share) * right->centre[k];
    node->area_vector[k] = left->area_vector[k] + right->area_vector[k];
  }
  /* Computed from the corners: from the children's balls, radii near the root would be twice too large. */
  size_t begin, end;
  items_of(tree, index, &begin, &end);
  node->radius = farthest_corner(tree, begin, end, node->centre);
}

/* Sorts the triangles along a curve that fills the box. */
static void sort_along_curve(qmat_winding_tree *tree, const uint32_t *chosen, qmat_curve_item *items) {
  for (size_t i = 0; i < tree->count; i++) {
    const uint32_t triangle = chosen ? chosen[i] : (uint32_t)i;
    double vector[3], centroid[3];
    area_and_centroid(tree, triangle, vector, centroid);
    items[i] = (qmat_curve_item){qmat_curve_code(centroid), triangle};
  }
  qmat_curve_sort(items, tree->count);
  for (size_t i = 0; i < tree->count; i++) tree->order[i] = items[i].id;
}

static qmat_status build(qmat_context *context, const uint32_t *chosen, qmat_winding_tree *tree) {
  const size_t n = tree->count;
  const int threads = qmat_threads(context);
  size_t leaf_count = 1;
  while (leaf_count * LEAF_SIZE < n) leaf_count *= 2;
  qmat_curve_item *items = qmat_alloc(n, sizeof *items);
  double *areas = qmat_alloc(2 * leaf_count, sizeof *areas);
  tree->order = qmat_alloc(n, sizeof *tree->order);
  tree->nodes = qmat_calloc(2 * leaf_count, sizeof *tree->nodes);
  qmat_status status = QMAT_OK;
  if (!items || !areas || !tree->order || !tree->nodes) {
    status = qmat_fail_memory(context, "the winding number tree");
  } else {
    tree->leaf_count = leaf_count;
    sort_along_curve(tree, chosen, items);
    status = qmat_progress(context, 0, 0, "surface");
  }
  for (size_t level = leaf_count; level > 0 && status == QMAT_OK; level /= 2) {
#pragma omp parallel for num_threads(threads) schedule(guided)
    for (size_t index = level; index < 2 * level; index++) {
      if (level == leaf_count) {
        size_t begin, end;
        items_of(tree, index, &begin, &end);
        fill_leaf(tree, tree->nodes + index, begin, end, areas + index);
      } else {
        fill_inner(tree, index, areas);
      }
    }
    status = qmat_progress(context, 0, 0, "surface");
  }
  qmat_free(items);
  qmat_free(areas);
  return status;
}

qmat_status qmat_winding_tree_new(qmat_context *context, const double *positions, const uint32_t *triangles,
                                  const uint32_t *chosen, size_t count, qmat_winding_tree **tree) {
  *tree = NULL;
  qmat_winding_tree *made = qmat_calloc(1, sizeof *made);
  if (!made) return qmat_fail_memory(context, "the winding number tree");
  made->positions = positions;
  made->triangles = triangles;
  made->count = count;
  const qmat_status status = build(context, chosen, made);
  if (status == QMAT_OK)
    *tree = made;
  else
    qmat_winding_tree_free(made);
  return status;
}

void qmat_winding_tree_free(qmat_winding_tree *tree) {
  if (!tree) return;
  qmat_free(tree->nodes);
  qmat_free(tree->order);
  qmat_free(tree);
}
