/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_DUAL_COMPLEX_H
#define QMAT_NODES_INITIAL_DUAL_COMPLEX_H

#include "core/geometry/surface.h"
#include "nodes/initial/delaunay_cgal.h"
#include "nodes/initial/voronoi_dual_params.h"

/* The origin of a tetrahedron's medial vertex. A dropped tetrahedron has none. */
typedef enum { QMAT_CELL_DROPPED = 0, QMAT_CELL_CIRCUMCENTRE, QMAT_CELL_INCENTRE } qmat_cell_kind;

#define QMAT_NO_ID UINT32_MAX

/* The dual of the Delaunay tetrahedra while it is built, in the unit frame. Arrays live in the context's arena except
 * `edges` and `triangles`, which the owner frees. */
typedef struct qmat_dual_complex {
  qmat_context *context;
  const qmat_voronoi_dual_params *params; /* NULL where tetrahedra are not selected */
  double merge;                           /* adjacent medial vertices so near become one */
  double epsilon;                         /* QMAT_FINE_EPSILON where it is not known */
  double thinning_tolerance;
  double link_limit; /* components are not linked by edges that leave the solid by more */
  const qmat_mesh *mesh;
  const qmat_samples *samples;
  const qmat_surface *surface;
  size_t point_count;              /* the samples, then the mirrored points */
  const double *points;            /* 3 per point */
  const uint8_t *thin;             /* per point */
  const uint32_t *facets;          /* per point */
  const uint32_t *solids;          /* per mesh vertex: smallest vertex of the solid that it bounds; NULL: one solid */
  const uint32_t *representatives; /* per point: the triangulated one that represents it, possibly itself */
  size_t site_count;               /* triangulated points */
  qmat_tetrahedra cells;           /* corners are points */
  uint8_t *kinds;                  /* per cell: a qmat_cell_kind */
  double *spheres;                 /* 4 per cell */
  uint32_t *solid_of;              /* per cell: the solid in which its sphere is, or QMAT_NO_ID; NULL: one solid */
  uint32_t *sphere_of;             /* per cell: its medial vertex, or QMAT_NO_ID */
  size_t sphere_count;
  uint32_t *edges, *triangles; /* of medial vertices */
  size_t edge_count, triangle_count;
  size_t edge_capacity, triangle_capacity; /* of both, in ids */
  /* What edges and triangles are dual to, if `keep_duals` is set: 3 corners of a facet, 2 ends of a Delaunay edge. The
   * owner frees both. */
  bool keep_duals;
  uint32_t *edge_duals, *triangle_duals;
  size_t edge_dual_capacity, triangle_dual_capacity; /* in ids */
} qmat_dual_complex;

/* The solid that a point bounds. */
static inline uint32_t qmat_dual_solid_of_point(const qmat_dual_complex *dual, uint32_t point) {
  return dual->solids ? dual->solids[dual->mesh->triangles[3 * (size_t)dual->facets[point]]] : 0;
}

/* A step around the Delaunay edge (a, b) of a tetrahedron: the neighbour across the facet opposite the corner
 * `*leaving`, QMAT_NO_TETRAHEDRON outside of all. `*leaving` becomes the corner for the next step. */
static inline uint32_t qmat_dual_step_around(const qmat_dual_complex *dual, uint32_t cell, uint32_t a, uint32_t b,
                                             uint32_t *leaving) {
  const uint32_t *corners = &dual->cells.corners[4 * (size_t)cell];
  uint32_t entering = QMAT_NO_ID, next = QMAT_NO_TETRAHEDRON;
  for (size_t k = 0; k < 4; k++) {
    if (corners[k] == *leaving)
      next = dual->cells.neighbours[4 * (size_t)cell + k];
    else if (corners[k] != a && corners[k] != b)
      entering = corners[k];
  }
  *leaving = entering;
  return next;
}

/* Sets `edges` and `triangles`: an edge across each facet between two kept tetrahedra with different medial vertices,
 * and the triangles of a polygon for each Delaunay edge whose whole ring is kept. Reads `cells`, `kinds` and
 * `sphere_of`; in voronoi_dual.c. QMAT_ERROR_MEMORY, QMAT_CANCELLED. One thread. Cost: linear for rings whose numbers
 * are in no particular order, or rise. */
qmat_status qmat_dual_connect(qmat_dual_complex *dual);

#endif
