/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_BOUNDARY_FEATURES_H
#define QMAT_NODES_MEASURE_BOUNDARY_FEATURES_H

#include "core/context.h"
#include "core/value.h"

/* The surfaces that together contain the boundary of an envelope. A feature is a number: first the spheres, then the
 * cone side of each edge, then both slab faces of each triangle. */
typedef struct qmat_boundary_features {
  const double *spheres; /* 4 each */
  const uint32_t *edges, *triangles;
  size_t sphere_count, edge_count, triangle_count;
  /* In compressed rows: the spheres joined to a sphere, and those joined to an edge by a triangle. */
  size_t *neighbour_offsets, *apex_offsets;
  uint32_t *neighbours, *apexes;
} qmat_boundary_features;

typedef enum { QMAT_FEATURE_SPHERE, QMAT_FEATURE_CONE_SIDE, QMAT_FEATURE_SLAB_FACE } qmat_feature_kind;

/* The features of `unit`, a sealed medial mesh's arrays in the unit frame, which have to live as long. All new arrays
 * are in the context's arena. QMAT_ERROR_MEMORY. Cost: linear, but for finding the edges of triangles. */
qmat_status qmat_boundary_features_init(qmat_context *context, const qmat_medial *unit, qmat_boundary_features *f);

size_t qmat_boundary_features_count(const qmat_boundary_features *f);

/* What a feature is, and its row: of a sphere, an edge, or twice that of a triangle plus the side (0 or 1). */
qmat_feature_kind qmat_boundary_feature_kind(const qmat_boundary_features *f, size_t feature, size_t *row);

/* The part of a cone that its tangent planes touch. Along the axis the normal changes with the angle around it only. */
typedef struct qmat_cone_side {
  const double *a, *b;        /* the end spheres */
  double length;              /* of the side, measured on it */
  double axis[3], v[3], w[3]; /* orthonormal */
  double along, across;       /* the components of the normal along the axis and at right angles to it */
} qmat_cone_side;

/* The cone side of an edge; false where one end sphere holds the other, which leaves none. */
bool qmat_cone_side_of_edge(const qmat_boundary_features *f, size_t edge, qmat_cone_side *side);
/* The medial sphere (4 doubles) at t in [0, 1], and the unit normal (3 doubles) at an angle. */
void qmat_cone_side_sphere(const qmat_cone_side *side, double t, double sphere[4]);
void qmat_cone_side_normal(const qmat_cone_side *side, double angle, double normal[3]);

/* The corners (9 doubles) of a slab's face; `row` as above. False where the slab has no tangent planes. */
bool qmat_slab_face(const qmat_boundary_features *f, size_t row, double corners[9]);

/* The area of a feature, and a point of it for two even random numbers in [0, 1): even in its area. `point` stays as it
 * is where the area is 0. */
double qmat_boundary_feature_area(const qmat_boundary_features *f, size_t feature);
void qmat_boundary_feature_point(const qmat_boundary_features *f, size_t feature, double x, double y, double point[3]);

#endif
