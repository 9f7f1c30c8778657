/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_TWO_SIDES_H
#define QMAT_NODES_MESH_TWO_SIDES_H

#include "core/context.h"

typedef struct qmat_two_sides {
  size_t solids;         /* closed surfaces that are given with both sides; 0: nothing else is set */
  size_t dropped;        /* triangles of their second sides */
  double distance;       /* the largest between both sides: rounding */
  size_t triangle_count; /* those that are left */
  uint32_t *triangles;   /* 3 * triangle_count, in the given order; in the context's arena */
} qmat_two_sides;

/* Leaves out the second side of closed surfaces that are given twice, the second time turned, as exporters do for
 * materials of two sides. The sides may divide a polygon along different diagonals. Such a component has two or four
 * triangles at each edge, where two half-planes each hold one of either side, and falls apart into two closed sides of
 * opposite volumes. The second is the one that is given later, on the average. A component is no such solid where
 * others are wound around it: there it is a wall between a solid and what fills its cavity. `positions`: 3 *
 * vertex_count, in a unit frame; `triangles`: 3 * count. QMAT_ERROR_MEMORY, QMAT_CANCELLED. One thread. Cost: linear,
 * and for each component that is found a box test of each other one, and a test of each triangle of those whose shadow
 * along a fixed direction holds a point of it. */
qmat_status qmat_drop_second_sides(qmat_context *context, size_t vertex_count, const double *positions, size_t count,
                                   const uint32_t *triangles, qmat_two_sides *sides);

#endif
