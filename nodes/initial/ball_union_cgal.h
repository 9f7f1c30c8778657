/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_BALL_UNION_CGAL_H
#define QMAT_NODES_INITIAL_BALL_UNION_CGAL_H

#include "core/context.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The union of balls and its dual shape: the weighted alpha complex for alpha = 0 (H. Edelsbrunner: The union of balls
 * and its dual shape, 1995). Its simplices join balls whose parts of the union meet. A simplex is singular if it is no
 * side of one of higher dimension. */
typedef struct qmat_ball_union qmat_ball_union;

/* The corners of the union's boundary, where three spheres meet, and the singular simplices of the dual shape. */
typedef struct qmat_ball_union_parts {
  size_t corner_count, edge_count, triangle_count;
  double *corners;        /* 3 * corner_count */
  uint32_t *corner_balls; /* 3 * corner_count: the balls that meet there, ascending */
  uint32_t *edges;        /* 2 * edge_count: singular, of balls, sorted */
  uint32_t *triangles;    /* 3 * triangle_count: the same */
  uint8_t *isolated;      /* per ball: 1 if it is a component of the union by itself */
} qmat_ball_union_parts;

/* Makes the union of `count` balls (4 doubles each: centre, radius > 0) whose centres are in the unit frame, by CGAL's
 * regular triangulation and exact predicates. The parts are in the context's arena, corners in the order of their
 * balls. Free with qmat_ball_union_free. On failure `*balls_union` is NULL: QMAT_ERROR_MEMORY, QMAT_ERROR_DEPENDENCY
 * with CGAL's message, QMAT_CANCELLED. One thread. Cost: O(n log n), about 20 microseconds per ball. */
qmat_status qmat_ball_union_new(qmat_context *context, const double *balls, size_t count, qmat_ball_union **balls_union,
                                qmat_ball_union_parts *parts);
void qmat_ball_union_free(qmat_ball_union *balls_union);

/* Whether points are in a tetrahedron of the dual shape, its boundary included: inside[i] becomes 1 or 0. `points`
 * holds `stride` doubles per point, of which the first three count. One thread, and one call at a time.
 * QMAT_ERROR_DEPENDENCY, QMAT_ERROR_MEMORY, QMAT_CANCELLED. Cost: a walk per point, short when neighbours in the list
 * are near each other. */
qmat_status qmat_ball_union_contains(qmat_context *context, qmat_ball_union *balls_union, const double *points,
                                     size_t stride, size_t count, uint8_t *inside);

#ifdef __cplusplus
}
#endif

#endif
