/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_POINT_GRID_H
#define QMAT_CORE_GEOMETRY_POINT_GRID_H

#include "core/context.h"

/* Points sorted into the cells of a grid, for nearest-point queries. Meant for points that are spread over a surface.
 * After qmat_point_grid_init it is only read, by any number of threads. */
typedef struct qmat_point_grid {
  const double *points;
  double low[3], width; /* the corner of the grid, and the side of a cell */
  size_t along[3];      /* cells */
  uint32_t *starts;     /* per cell, + 1: its first point in `items` */
  uint32_t *items;      /* per point, in rising order within a cell */
} qmat_point_grid;

/* Sorts `count` (at least 1, below 2^32 - 1) finite points (3 doubles each), which stay the caller's and have to live
 * as long. Memory comes from the context's arena: 4 bytes a point and up to 10 MB. QMAT_ERROR_MEMORY. Cost: linear. */
qmat_status qmat_point_grid_init(qmat_context *context, const double *points, size_t count, qmat_point_grid *grid);

/* The point nearest to `place` (3 doubles); of equally near points the first. Fast where it is few cells away. */
uint32_t qmat_point_grid_nearest(const qmat_point_grid *grid, const double place[3]);

/* Whether a point lies within `reach` of `place` (3 doubles). Fast where that is few cells. */
bool qmat_point_grid_has_within(const qmat_point_grid *grid, const double place[3], double reach);

#endif
