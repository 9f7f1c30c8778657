/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_SHAPE_SET_H
#define QMAT_NODES_COLLIDERS_SHAPE_SET_H

#include "core/geometry/envelope.h"
#include "core/geometry/medial_distance.h"

/* Colliders under construction, in the unit frame of a mesh. A shape is the convex hull of up to three spheres. Shapes
 * of three spheres come first, then those of two, then those of one; ids rise within a shape. No shape contains
 * another's spheres as a side, so that shape i is primitive i of the set's envelope. All arrays are in the context's
 * arena. */
typedef struct qmat_shape_set {
  size_t sphere_count, shape_count;
  double *spheres;  /* 4 per sphere */
  uint32_t *shapes; /* 3 per shape, as in qmat_colliders */
  uint32_t *joints; /* per sphere; those of a shape have the same; NULL: nothing is skinned */
} qmat_shape_set;

typedef enum qmat_shape_kind { QMAT_SHAPES_ANY, QMAT_SHAPES_CAPSULES, QMAT_SHAPES_SPHERES } qmat_shape_kind;

/* A shape prepared for distance queries. */
typedef struct qmat_prepared_shape {
  int count;
  double sphere[4];
  qmat_cone cone;
  qmat_slab slab;
} qmat_prepared_shape;

/* The number of spheres of a shape (3 ids): 1, 2 or 3. */
int qmat_shape_width(const uint32_t shape[3]);

/* Prepares the shape of these spheres (4 doubles each). */
void qmat_shape_prepare(qmat_prepared_shape *shape, const double *spheres, const uint32_t ids[3]);

/* The signed distance to a shape: exact outside, a bound inside, convex (core/geometry/medial_distance.h). `weights`
 * (may be NULL) receives the shares of its spheres at the medial point that attains it. */
double qmat_shape_distance(const qmat_prepared_shape *shape, const double point[3], double weights[3]);

/* As qmat_shape_distance; `medial` receives the medial sphere that attains it, centre and radius. `spheres` and `ids`
 * are those that the shape was prepared from. */
double qmat_shape_medial(const qmat_prepared_shape *shape, const double *spheres, const uint32_t ids[3],
                         const double point[3], double medial[4]);

/* Finds the shape of a joint that is nearest to a point, the first of equally near ones. Returns its signed distance;
 * INFINITY where the joint has none, which leaves `*nearest` as it is. `shapes` are all of the set, which has joints,
 * prepared. */
double qmat_shape_set_nearest_of_joint(const qmat_shape_set *set, const qmat_prepared_shape *shapes, uint32_t joint,
                                       const double point[3], size_t *nearest);

/* Whether two shapes move with the same joint. */
bool qmat_shape_set_same_joint(const qmat_shape_set *set, size_t a, size_t b);

/* The volume of a shape; of three spheres it is that of spheres with their mean radius. */
double qmat_shape_volume(const double *spheres, const uint32_t ids[3]);

/* The most shapes that colliders have where rows of them replace cones and slabs; also the most steps of a row. */
enum { QMAT_MOST_IN_ROWS = 256 };

/* Makes the shapes of a medial mesh: its maximal simplices. Radii below `least_radius` (above 0) become that. A simplex
 * whose spheres contain each other becomes those that count, and a shape inside another one is left out. With `kind`,
 * slabs and cones become rows of capsules or spheres; the dents between them are at most `dent` deep (above 0). Where
 * that takes more than QMAT_MOST_IN_ROWS steps along a row, or more than `most` shapes before any is left out, there is
 * no set: set->shape_count is SIZE_MAX, and the caller tries again with deeper dents. `joints` (may be NULL) are those
 * of the spheres; only what is inside a shape of the same joint is left out, here and below. QMAT_ERROR_MEMORY,
 * QMAT_CANCELLED. Cost: quadratic in the shapes where all are near each other. One thread. */
qmat_status qmat_shape_set_make(qmat_context *context, const qmat_medial *unit, const uint32_t *joints,
                                double least_radius, qmat_shape_kind kind, double dent, size_t most,
                                qmat_shape_set *set);

/* Leaves out what changed spheres have made redundant: simplices whose spheres contain each other, shapes inside
 * others, unused spheres. Errors and cost as above. */
qmat_status qmat_shape_set_reduce(qmat_context *context, qmat_shape_set *set);

/* The union of the shapes, whose primitives are numbered like them. The caller frees it with qmat_envelope_free. */
qmat_status qmat_shape_set_envelope(qmat_context *context, const qmat_shape_set *set, qmat_envelope **envelope);

#endif
