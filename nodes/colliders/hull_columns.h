/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_HULL_COLUMNS_H
#define QMAT_NODES_COLLIDERS_HULL_COLUMNS_H

#include "core/context.h"

/* A convex hull as what it has of vertical lines through the unit frame's box, 256 by 256 of them. */
typedef struct qmat_hull_columns {
  int low[2], count[2]; /* the first line along x and y, and how many */
  double *z;            /* 2 per line: from and to; from > to for none; owned */
} qmat_hull_columns;

/* Cuts the triangles (3 ids of points) of a hull with the lines; points are in the unit frame. Free the columns with
 * qmat_hull_columns_free. QMAT_ERROR_MEMORY. Cost: linear in the triangles and in the lines that they meet. */
qmat_status qmat_hull_columns_make(const double *points, const uint32_t *triangles, size_t triangle_count,
                                   qmat_hull_columns *columns);

/* The columns of the convex hull of points (3 doubles each); none where they are in a plane. QMAT_ERROR_MEMORY. Cost: a
 * hull, and as above. */
qmat_status qmat_hull_columns_around(const double *points, size_t count, qmat_hull_columns *columns);

void qmat_hull_columns_free(qmat_hull_columns *columns);

/* Whether some line may meet both. */
bool qmat_hull_columns_meet(const qmat_hull_columns *a, const qmat_hull_columns *b);

/* The volume of a hull that is in none of `count` others, by the lines. Cost: its lines times the others, or for lines
 * that meet k of them k * k. */
double qmat_hull_columns_beyond(const qmat_hull_columns *of, const qmat_hull_columns *const *others, size_t count);

#endif
