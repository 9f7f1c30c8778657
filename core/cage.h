/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_CAGE_H
#define QMAT_CORE_CAGE_H

#include <stddef.h>
#include <stdint.h>

/* The subdivision scheme and the boundary rule of a surface, as defined by USD. */
typedef enum qmat_scheme {
  QMAT_SCHEME_NONE,
  QMAT_SCHEME_CATMULL_CLARK,
  QMAT_SCHEME_LOOP,
  QMAT_SCHEME_BILINEAR,
  QMAT_SCHEME_COUNT
} qmat_scheme;

typedef enum qmat_boundary {
  QMAT_BOUNDARY_NONE,            /* faces at the border are dropped */
  QMAT_BOUNDARY_EDGE,            /* the border is a smooth curve */
  QMAT_BOUNDARY_EDGE_AND_CORNER, /* the same, and vertices with a single face are sharp corners */
  QMAT_BOUNDARY_COUNT
} qmat_boundary;

/* The polygons that a mesh was triangulated from, kept when some of them are control cages of subdivision surfaces. The
 * surfaces follow one another; each is a run of faces with its own vertices. Sharpness 0 is smooth, 10 and more is
 * infinitely sharp. */
typedef struct qmat_cage {
  size_t surface_count, vertex_count, face_count, corner_count, hole_count, crease_count, sharp_count;
  uint32_t *surface_faces;  /* surface_count: the number of its faces */
  uint32_t *schemes;        /* surface_count: a qmat_scheme */
  uint32_t *boundaries;     /* surface_count: a qmat_boundary */
  double *positions;        /* 3 * vertex_count: x y z */
  uint32_t *face_sizes;     /* face_count: the number of its corners */
  uint32_t *corners;        /* corner_count: the vertices of the faces, face by face */
  uint32_t *holes;          /* hole_count: faces that shape the surface without being part of it */
  uint32_t *creases;        /* 2 * crease_count: the ends of a sharp edge */
  double *crease_sharpness; /* crease_count */
  uint32_t *sharp_vertices; /* sharp_count */
  double *vertex_sharpness; /* sharp_count */
} qmat_cage;

#endif
