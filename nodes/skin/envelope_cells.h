/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SKIN_ENVELOPE_CELLS_H
#define QMAT_NODES_SKIN_ENVELOPE_CELLS_H

#include "core/geometry/envelope.h"
#include "core/geometry/medial_distance.h"
#include "core/key_table.h"

/* The cells of an octree that the surface of an envelope crosses. A cell is halved down to the base size, and further
 * where the medial radii near it are small, down to the finest size. */

/* The primitives of an envelope, with radii raised to a floor so that none is missed by the corners of the finest
 * cells. The order is slabs, cones, spheres; single spheres of radius 0 are left out. */
typedef struct qmat_cell_primitives {
  size_t slab_count, cone_count, sphere_count;
  qmat_slab *slabs;
  qmat_cone *cones;
  double *spheres;      /* 4 per sphere */
  double *slab_radii;   /* 3 per slab: of its corners */
  double *cone_radii;   /* 2 per cone */
  double *slab_centres; /* 9 per slab */
  double *cone_centres; /* 6 per cone */
} qmat_cell_primitives;

typedef struct qmat_cell {
  uint32_t at[3];      /* its lowest corner, in finest cells */
  uint32_t size;       /* in finest cells: a power of two */
  size_t list;         /* its primitives: lists[list .. list + list_count) */
  uint32_t list_count; /* one of them attains F wherever F is 0 or less in the cell */
} qmat_cell;

/* Corners and cells as keys: 19 bits a coordinate, in finest cells, and the size of a cell as a power of two. */
static inline uint64_t qmat_corner_key(const uint32_t at[3]) {
  return (uint64_t)at[0] | (uint64_t)at[1] << 19 | (uint64_t)at[2] << 38;
}

static inline uint64_t qmat_cell_key(const uint32_t at[3], uint32_t size) {
  return qmat_corner_key(at) | (uint64_t)__builtin_ctz(size) << 57;
}

typedef struct qmat_cells {
  qmat_cell_primitives primitives;
  double origin[3], finest; /* the corner (0, 0, 0), and the size of the finest cells */
  uint32_t base;            /* the size of the largest cells, in finest cells */
  size_t count;
  qmat_cell *cells;
  uint32_t *lists;
  size_t list_count;
  size_t refined_count;  /* cells smaller than the base size */
  size_t most;           /* the search stops where there will be more cells */
  bool is_incomplete;    /* it has stopped */
  qmat_key_table marked; /* cells to be halved, by their keys */
} qmat_cells;

/* A place where cells are halved `level` times at least, with the cells around it. */
typedef struct qmat_cell_mark {
  double point[3];
  int level; /* above 0 */
} qmat_cell_mark;

/* What cells are wanted; the arrays are the caller's. */
typedef struct qmat_cell_request {
  const double *spheres; /* 4 * sphere_count: those that the envelope was made of, in a frame of about unit size */
  size_t sphere_count;
  double base;                 /* the largest size of a cell */
  int detail;                  /* cells are halved up to this many times where radii are small, and at the marks */
  const qmat_cell_mark *marks; /* NULL for none */
  size_t mark_count;
  size_t most; /* the search stops where there will be more cells */
} qmat_cell_request;

/* Finds the cells. Radii below `floor` are raised to it. Free with qmat_cells_uninit, also after a failure.
 * QMAT_ERROR_MEMORY, QMAT_CANCELLED; QMAT_ERROR_GEOMETRY when there are too many cells for the memory. The same cells
 * in the same order for any number of threads. Cost: linear in the cells, times the primitives that meet in one. */
qmat_status qmat_cells_find(qmat_context *context, const qmat_envelope *envelope, const qmat_cell_request *request,
                            double floor, qmat_cells *cells);
void qmat_cells_uninit(qmat_cells *cells);

/* F with raised radii, at a point of the cell. Where F is positive: a positive number that is at least F. */
double qmat_cell_distance(const qmat_cells *cells, const qmat_cell *cell, const double point[3]);
/* The same, with its gradient: a unit vector (3 doubles). */
double qmat_cell_gradient(const qmat_cells *cells, const qmat_cell *cell, const double point[3], double gradient[3]);

#endif
