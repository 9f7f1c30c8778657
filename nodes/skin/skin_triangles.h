/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SKIN_SKIN_TRIANGLES_H
#define QMAT_NODES_SKIN_SKIN_TRIANGLES_H

#include <stddef.h>
#include <stdint.h>

/* A triangle surface as plain arrays (qmat_alloc): corner k of triangle t is triangles[3 * t + k], counter-clockwise
 * as seen from outside. */
typedef struct qmat_skin_triangles {
  size_t vertex_count, triangle_count;
  double *positions; /* 3 * vertex_count */
  uint32_t *triangles;
} qmat_skin_triangles;

/* A triangle is a sliver where its height is at most this share of its longest side. */
#define QMAT_SKIN_SLIVER 1e-3

#endif
