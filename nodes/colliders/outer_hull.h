/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_OUTER_HULL_H
#define QMAT_NODES_COLLIDERS_OUTER_HULL_H

#include "core/context.h"

/* Scratch for hulls of up to `most` vertices around up to `room` points. */
typedef struct qmat_outer_hull {
  size_t room, most, cloud_count, point_count;
  double *points;                        /* 3 per vertex: the result */
  double *cloud;                         /* 3 per point */
  double *tangents;                      /* 4 per half-edge: normal, offset */
  double *scores;                        /* of triangles */
  uint32_t *triangles, *twins, *scratch; /* of half-edges: where it begins; the other one of its edge */
  uint32_t *leaving, *farthest;          /* a half-edge of each vertex; a point of each triangle */
  uint8_t *known, *chosen;               /* tangents of half-edges; points */
  qmat_context *context;                 /* whose progress function is asked on the way; NULL: none */
} qmat_outer_hull;

/* Takes the arrays from the context's arena, and asks no progress function. `most` is at least 24, `room` at least 4.
 * QMAT_ERROR_MEMORY. */
qmat_status qmat_outer_hull_init(qmat_context *context, size_t room, size_t most, qmat_outer_hull *hull);

/* Finds at most `most` vertices of a convex polyhedron that contains `count` points (3 doubles each, `room` at most)
 * and all within `margin` of them, for which the whole hull grows. It begins with some of the points: those that are
 * farthest outside of the hull of the others, weighted by its facets, until none is farther than `error` (a length
 * above 0). That hull grows until it contains all points. Then each vertex moves to where the volume is least while all
 * facets around keep the points inside: a linear program, whose constraints are the tangent planes of the points
 * through the edges around the vertex. For a ball a facet is a triangle: four times as many as where half-spaces meet
 * (tangent_hull.h), and a third of the volume beyond it.
 *
 * QMAT_ERROR_GEOMETRY for points near a plane, or where rounding spoils the vertices by more than a thousandth;
 * QMAT_ERROR_MEMORY, QMAT_CANCELLED. Cost: some ten hulls of `most` points, and some 200 times `count` times `most`
 * steps. */
qmat_status qmat_outer_hull_fit(qmat_outer_hull *hull, const double *points, size_t count, double margin, double error);

#endif
