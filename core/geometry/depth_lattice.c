/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/depth_lattice.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"

enum { FIRST_CAPACITY = 1 << 13 };

/* A node decides the side of a point when its depth exceeds their distance by this much, which is far above the
 * rounding error of a depth. */
static const double side_margin = 1e-6;
/* The lattice reaches this far from the origin. A key has 21 bits per coordinate; the offset keeps them positive. */
static const double reach = 2;
static const int64_t key_offset = 1 << 20;

qmat_status qmat_depth_lattice_init(qmat_context *context, qmat_depth_lattice *lattice, const qmat_surface *surface,
                                    double spacing) {
  /* The key bits limit how fine the lattice can be. */
  *lattice = (qmat_depth_lattice){.surface = surface, .spacing = fmax(spacing, 4 * reach / (double)key_offset)};
  return qmat_key_table_init(&lattice->nodes, FIRST_CAPACITY) ? qmat_fail_memory(context, "depths") : QMAT_OK;
}

void qmat_depth_lattice_uninit(qmat_depth_lattice *lattice) {
  qmat_key_table_uninit(&lattice->nodes);
  *lattice = (qmat_depth_lattice){0};
}

double qmat_depth_lattice_exact(qmat_depth_lattice *lattice, const double point[3]) {
  lattice->queries++;
  return -qmat_surface_signed_distance(lattice->surface, point);
}

double qmat_depth_lattice_exact_near(qmat_depth_lattice *lattice, const double point[3], double near, double distance) {
  lattice->queries++;
  return -qmat_surface_signed_distance_near(lattice->surface, point, -near, distance * (1 + 1e-9) + side_margin);
}

double qmat_depth_lattice_exact_up_to(qmat_depth_lattice *lattice, const double point[3], double near, double distance,
                                      double depth) {
  const double gap = distance * (1 + 1e-9) + side_margin;
  const bool is_inside = near > gap && qmat_surface_is_closed(lattice->surface);
  if (!is_inside || depth >= near + gap) return qmat_depth_lattice_exact_near(lattice, point, near, distance);
  lattice->queries++;
  return qmat_surface_depth_up_to(lattice->surface, point, depth);
}

/* Computes the depth at a node, with the help of a neighbour whose depth is known. */
static double compute_node(qmat_depth_lattice *lattice, uint64_t key, const double node[3]) {
  static const uint64_t steps[3] = {1, (uint64_t)1 << 21, (uint64_t)1 << 42};
  for (int k = 0; k < 3; k++)
    for (int sign = 0; sign < 2; sign++) {
      const uint64_t beside = sign ? key + steps[k] : key - steps[k];
      const qmat_key_slot *neighbour = qmat_key_table_find(&lattice->nodes, beside);
      if (neighbour->key == beside)
        return qmat_depth_lattice_exact_near(lattice, node, neighbour->number, lattice->spacing);
    }
  return qmat_depth_lattice_exact(lattice, node);
}

/* The depth at a node, which is kept when memory allows. */
static double depth_of_node(qmat_depth_lattice *lattice, uint64_t key, const double node[3]) {
  qmat_key_slot *slot = qmat_key_table_find(&lattice->nodes, key);
  if (slot->key == key) return slot->number;
  const double depth = compute_node(lattice, key, node);
  slot = qmat_key_table_add(&lattice->nodes, key);
  if (slot) slot->number = depth;
  return depth;
}

double qmat_depth_lattice_least(qmat_depth_lattice *lattice, const double point[3]) {
  double low[3], share[3], square = 0;
  int64_t steps[3];
  for (int k = 0; k < 3; k++) {
    if (!(fabs(point[k]) < reach)) return -INFINITY;
    steps[k] = (int64_t)floor(point[k] / lattice->spacing);
    low[k] = (double)steps[k] * lattice->spacing;
    share[k] = qmat_smaller(qmat_larger((point[k] - low[k]) / lattice->spacing, 0), 1);
    square -= share[k] * (1 - share[k]) * lattice->spacing * lattice->spacing;
  }
  for (int corner = 0; corner < 8; corner++) {
    uint64_t key = 0;
    double node[3], weight = 1;
    for (int k = 0; k < 3; k++) {
      const int high = corner >> k & 1;
      key = key << 21 | (uint64_t)(steps[k] + high + key_offset);
      node[k] = (double)(steps[k] + high) * lattice->spacing;
      weight *= high ? share[k] : 1 - share[k];
    }
    const double depth = depth_of_node(lattice, key, node);
    if (!(depth > 0)) return -INFINITY;
    square += weight * depth * depth;
  }
  return square > 0 ? sqrt(square) * (1 - 1e-9) : -INFINITY;
}

double qmat_depth_lattice_near(qmat_depth_lattice *lattice, const double point[3], double *distance) {
  uint64_t key = 0;
  double node[3], square = 0;
  for (int k = 0; k < 3; k++) {
    if (!(fabs(point[k]) <= reach)) {
      *distance = 0;
      return qmat_depth_lattice_exact(lattice, point);
    }
    const int64_t step = (int64_t)floor(point[k] / lattice->spacing + 0.5);
    node[k] = (double)step * lattice->spacing;
    key = key << 21 | (uint64_t)(step + key_offset);
    square += (point[k] - node[k]) * (point[k] - node[k]);
  }
  *distance = sqrt(square);
  return depth_of_node(lattice, key, node);
}
