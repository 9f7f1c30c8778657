/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_MORTON_H
#define QMAT_CORE_GEOMETRY_MORTON_H

#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include "core/geometry/vector.h"

/* Something by its place along the curve of Morton 1966, which fills a box. */
typedef struct qmat_curve_item {
  uint64_t code;
  uint32_t id; /* breaks ties */
} qmat_curve_item;

/* Spreads the bits of a 21-bit number to every third bit of the result. */
static inline uint64_t qmat_spread_bits(uint64_t x) {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x1f00000000ffff;
  x = (x | x << 16) & 0x1f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  return (x | x << 2) & 0x1249249249249249;
}

/* The place along the curve of a point (3 doubles) of the unit box around the origin. What is outside is moved to it.
 */
static inline uint64_t qmat_curve_code(const double point[3]) {
  uint64_t code = 0;
  for (int k = 0; k < 3; k++) {
    const double cell = (point[k] + 0.5) * 2097151; /* 2^21 - 1 */
    code |= qmat_spread_bits((uint64_t)qmat_smaller(qmat_larger(cell, 0), 2097151)) << k;
  }
  return code;
}

static inline int qmat_compare_curve_items(const void *left, const void *right) {
  const qmat_curve_item *a = left, *b = right;
  if (a->code != b->code) return a->code < b->code ? -1 : 1;
  return a->id < b->id ? -1 : a->id > b->id;
}

/* Sorts along the curve. */
static inline void qmat_curve_sort(qmat_curve_item *items, size_t count) {
  qsort(items, count, sizeof *items, qmat_compare_curve_items);
}

/* The items of a node of a complete binary tree over `count` items along the curve, from `*begin` to before `*end`.
 * Node 1 is the root; the children of node k are 2 k and 2 k + 1, and the leaves start at `leaf_count`, a power of two.
 */
static inline void qmat_curve_node_items(size_t count, size_t leaf_count, size_t node, size_t *begin, size_t *end) {
  size_t first = node, last = node + 1;
  while (first < leaf_count) first *= 2, last *= 2;
  first -= leaf_count, last -= leaf_count;
  const size_t share = count / leaf_count, rest = count % leaf_count; /* leaf * count could overflow */
  *begin = first * share + first * rest / leaf_count;
  *end = last * share + last * rest / leaf_count;
}

#endif
