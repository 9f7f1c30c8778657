/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/depth_lattice.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "core/hash.h"

enum { FIRST_CAPACITY = 1 << 14, PLACES = 1 << 14 };

/* Of the spacing, how wide the cubes are of which a place is remembered. */
static const double cube_share = 0.5;

/* By this much more than it is far a node has to be deep to tell a neighbour's side: far more than a side is unsure by.
 */
static const double side_margin = 1e-6;
/* 21 bits a coordinate; the offset keeps every key of the lattice above 0. */
static const double reach = 2;
static const int64_t key_offset = 1 << 20;

qmat_status qmat_depth_lattice_init(qmat_context *context, qmat_depth_lattice *lattice, const qmat_surface *surface,
                                    double spacing) {
  /* No finer than the keys can number. */
  *lattice = (qmat_depth_lattice){.surface = surface, .spacing = fmax(spacing, 4 * reach / (double)key_offset)};
  lattice->nodes = qmat_calloc(FIRST_CAPACITY, sizeof *lattice->nodes);
  lattice->places = qmat_calloc(PLACES, sizeof *lattice->places);
  if (!lattice->nodes || !lattice->places) return qmat_fail_memory(context, "depths");
  lattice->capacity = FIRST_CAPACITY;
  return QMAT_OK;
}

void qmat_depth_lattice_uninit(qmat_depth_lattice *lattice) {
  qmat_free(lattice->nodes);
  qmat_free(lattice->places);
  *lattice = (qmat_depth_lattice){0};
}

/* The node of a key, or where it has room. */
static qmat_lattice_node *find_node(qmat_lattice_node *nodes, size_t capacity, uint64_t key) {
  size_t slot = (size_t)qmat_hash_mix(key) & (capacity - 1);
  while (nodes[slot].key != 0 && nodes[slot].key != key) slot = (slot + 1) & (capacity - 1);
  return &nodes[slot];
}

/* Doubles the table; when memory is short it stays as it is and simply forgets nothing more. */
static bool grow(qmat_depth_lattice *lattice) {
  const size_t capacity = 2 * lattice->capacity;
  qmat_lattice_node *nodes = qmat_calloc(capacity, sizeof *nodes);
  if (!nodes) return false;
  for (size_t i = 0; i < lattice->capacity; i++)
    if (lattice->nodes[i].key != 0) *find_node(nodes, capacity, lattice->nodes[i].key) = lattice->nodes[i];
  qmat_free(lattice->nodes);
  lattice->nodes = nodes;
  lattice->capacity = capacity;
  return true;
}

double qmat_depth_lattice_exact(qmat_depth_lattice *lattice, const double point[3]) {
  lattice->questions++;
  return -qmat_surface_signed_distance(lattice->surface, point);
}

double qmat_depth_lattice_exact_near(qmat_depth_lattice *lattice, const double point[3], double near, double distance) {
  const double gap = distance * (1 + 1e-9) + side_margin;
  const double depth = qmat_surface_distance(lattice->surface, point, fabs(near) + gap, NULL, NULL);
  if (!(depth < INFINITY)) return qmat_depth_lattice_exact(lattice, point);
  lattice->questions++;
  const bool inside = fabs(near) > gap ? near > 0 : qmat_surface_inside(lattice->surface, point);
  return inside ? depth : -depth;
}

/* The cube that a point lies in, and where it is remembered. */
static qmat_lattice_place *find_place(const qmat_depth_lattice *lattice, const double point[3], uint64_t *key) {
  const double side = cube_share * lattice->spacing;
  *key = 1;
  for (int k = 0; k < 3; k++) *key = qmat_hash_mix(*key + (uint64_t)(int64_t)floor(point[k] / side));
  return &lattice->places[*key & (PLACES - 1)];
}

static void remember(const qmat_depth_lattice *lattice, const double point[3], double least_depth) {
  uint64_t key;
  qmat_lattice_place *place = find_place(lattice, point, &key);
  place->key = key;
  memcpy(place->point, point, sizeof place->point);
  place->least_depth = least_depth;
}

double qmat_depth_lattice_least(const qmat_depth_lattice *lattice, const double point[3]) {
  uint64_t key;
  const qmat_lattice_place *place = find_place(lattice, point, &key);
  return place->key == key ? place->least_depth - qmat_point_distance(place->point, point) : -INFINITY;
}

double qmat_depth_lattice_exact_up_to(qmat_depth_lattice *lattice, const double point[3], double near, double distance,
                                      double depth) {
  const double gap = distance * (1 + 1e-9) + side_margin;
  double found;
  if (near > gap && depth < near + gap) {
    lattice->questions++;
    found = qmat_surface_distance(lattice->surface, point, depth, NULL, NULL);
  } else {
    found = qmat_depth_lattice_exact_near(lattice, point, near, distance);
  }
  remember(lattice, point, found < INFINITY ? found : depth);
  return found;
}

/* The depth at a node; from a neighbour where one is known. */
static double ask_node(qmat_depth_lattice *lattice, uint64_t key, const double node[3]) {
  static const uint64_t steps[3] = {1, (uint64_t)1 << 21, (uint64_t)1 << 42};
  for (int k = 0; k < 3; k++)
    for (int sign = 0; sign < 2; sign++) {
      const uint64_t beside = sign ? key + steps[k] : key - steps[k];
      const qmat_lattice_node *neighbour = find_node(lattice->nodes, lattice->capacity, beside);
      if (neighbour->key == beside)
        return qmat_depth_lattice_exact_near(lattice, node, neighbour->depth, lattice->spacing);
    }
  return qmat_depth_lattice_exact(lattice, node);
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
  qmat_lattice_node *known = find_node(lattice->nodes, lattice->capacity, key);
  if (known->key == key) return known->depth;
  const double depth = ask_node(lattice, key, node);
  if (2 * (lattice->count + 1) > lattice->capacity) {
    if (!grow(lattice)) return depth;
    known = find_node(lattice->nodes, lattice->capacity, key);
  }
  *known = (qmat_lattice_node){key, depth};
  lattice->count++;
  return depth;
}
