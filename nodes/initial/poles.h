/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_POLES_H
#define QMAT_NODES_INITIAL_POLES_H

#include "nodes/initial/delaunay_cgal.h"

/* The poles of samples, and which of them are inside (N. Amenta, S. Choi, R. K. Kolluri: The power crust, 2001). All
 * arrays live in the context's arena; all lengths are in the unit frame. */

#define QMAT_NO_POLE UINT32_MAX

typedef enum { QMAT_POLE_UNLABELLED = 0, QMAT_POLE_INSIDE, QMAT_POLE_OUTSIDE } qmat_pole_label;

/* A pole is a Voronoi vertex that is farthest from a sample, or farthest on the other side of it. Its sphere touches
 * the samples around it. */
typedef struct qmat_poles {
  size_t count;
  double *spheres;   /* 4 per pole */
  uint8_t *at_box;   /* per pole: its sphere touches the box, so that it is outside */
  uint32_t *of_cell; /* per tetrahedron: the pole at its circumcentre, or QMAT_NO_POLE */
  /* Opposite poles: those of one sample. Two ids per pair; a pair may repeat. */
  size_t pair_count;
  uint32_t *pairs;
  double *cosines; /* per pair: of the angle between both poles at the sample, at most 0 */
  size_t rejected; /* second poles that the sampling constant rejects */
} qmat_poles;

/* Finds the poles of the first `site_count` points (3 doubles each); the points after those are the corners of a box
 * around them. `cells` are the Delaunay tetrahedra of all points. Circumcentres of neighbours that are at most `merge`
 * apart are one Voronoi vertex. `sampling` is the paper's r, below 1: the samples are at most that share of the local
 * feature size apart; it gives a lower bound on the feature size, and nearer second poles are left out. With 1 none is.
 * QMAT_ERROR_MEMORY, QMAT_CANCELLED. One thread. Cost: linear in the tetrahedra. */
qmat_status qmat_poles_find(qmat_context *context, const double *points, size_t site_count,
                            const qmat_tetrahedra *cells, double sampling, double merge, qmat_poles *poles);

#endif
