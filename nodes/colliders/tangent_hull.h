/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_TANGENT_HULL_H
#define QMAT_NODES_COLLIDERS_TANGENT_HULL_H

#include "nodes/colliders/shape_set.h"

/* Scratch for hulls of up to `most` vertices. */
typedef struct qmat_tangent_hull {
  size_t most, plane_count, point_count;
  double *normals;       /* 3 per plane */
  double *duals;         /* 3 per plane */
  double *points;        /* 3 per vertex, most at most: the result */
  double *ways;          /* 4 per vertex: the normal of the plane that would cut it off, and how far outside it is */
  uint32_t *triangles;   /* of a hull of `most` points at most; also the caller's scratch */
  qmat_context *context; /* whose progress function is asked while points are fitted; NULL: none */
} qmat_tangent_hull;

/* Takes the arrays from the context's arena, and asks no progress function. `most` is at least 24. QMAT_ERROR_MEMORY.
 */
qmat_status qmat_tangent_hull_init(qmat_context *context, size_t most, qmat_tangent_hull *hull);

/* Finds the vertices of a polyhedron that contains a shape: where half-spaces meet that touch it. A slab's two flat
 * sides are among them. Then each round adds half-spaces where vertices are farthest from the shape, until none is
 * farther than `error`, a length above 0, or there would be more than `most` vertices (the sandwich algorithm, from
 * outside). QMAT_ERROR_GEOMETRY for a shape without volume or where rounding spoils the vertices by more than a
 * thousandth; QMAT_ERROR_MEMORY. Cost: some twenty hulls of most / 2 points. */
qmat_status qmat_tangent_hull_fit(qmat_tangent_hull *hull, const double *spheres, const uint32_t ids[3], double error);

/* Finds the vertices of a polyhedron that contains `count` points (3 doubles each) and all within `margin` of them:
 * where half-spaces meet that are parallel to facets of the points' hull. Bounds and statuses as above;
 * QMAT_ERROR_GEOMETRY also for points near a plane; QMAT_CANCELLED. Cost: also that of the points' hull, and its facets
 * times the vertices. */
qmat_status qmat_tangent_hull_fit_points(qmat_tangent_hull *hull, const double *points, size_t count, double margin,
                                         double error);

#endif
