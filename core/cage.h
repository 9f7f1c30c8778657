/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_CAGE_H
#define QMAT_CORE_CAGE_H

#include <stddef.h>
#include <stdint.h>

/* How a surface of a cage is subdivided, and what its border does: as USD says it. */
typedef enum qmat_scheme {
  QMAT_SCHEME_NONE,
  QMAT_SCHEME_CATMULL_CLARK,
  QMAT_SCHEME_LOOP,
  QMAT_SCHEME_BILINEAR,
  QMAT_SCHEME_COUNT
} qmat_scheme;

typedef enum qmat_boundary {
  QMAT_BOUNDARY_NONE,            /* faces at the border are left out */
  QMAT_BOUNDARY_EDGE,            /* the border is a smooth curve */
  QMAT_BOUNDARY_EDGE_AND_CORNER, /* the same, and vertices of one face are corners */
  QMAT_BOUNDARY_COUNT
} qmat_boundary;

/* The polygons that triangles were made of, where some of them are control cages of subdivision surfaces: one surface
 * after the other, each a run of faces with vertices of its own. Sharpness 0 is smooth, from 10 on it is infinite. */
typedef struct qmat_cage {
  size_t surface_count, vertex_count, face_count, corner_count, hole_count, crease_count, sharp_count;
  uint32_t *surface_faces;  /* surface_count: how many faces it has */
  uint32_t *schemes;        /* surface_count: a qmat_scheme */
  uint32_t *boundaries;     /* surface_count: a qmat_boundary */
  double *positions;        /* 3 * vertex_count: x y z */
  uint32_t *face_sizes;     /* face_count: how many corners it has */
  uint32_t *corners;        /* corner_count: vertices of the faces, one face after the other */
  uint32_t *holes;          /* hole_count: faces that are not part of the surface, but shape it */
  uint32_t *creases;        /* 2 * crease_count: the vertices of a sharp edge */
  double *crease_sharpness; /* crease_count */
  uint32_t *sharp_vertices; /* sharp_count */
  double *vertex_sharpness; /* sharp_count */
} qmat_cage;

#endif
