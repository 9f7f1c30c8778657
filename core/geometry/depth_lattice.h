/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_DEPTH_LATTICE_H
#define QMAT_CORE_GEOMETRY_DEPTH_LATTICE_H

#include "core/geometry/surface.h"

/* A node that was asked. */
typedef struct qmat_lattice_node {
  uint64_t key; /* 0: none */
  double depth;
} qmat_lattice_node;

/* The newest place in a cube between the nodes that was asked. */
typedef struct qmat_lattice_place {
  uint64_t key; /* of the cube; 0: none */
  double point[3], least_depth;
} qmat_lattice_place;

/* Depths (the distance to the surface, negative outside) remembered at the nodes of a cubic lattice, each asked of the
 * surface when it is first wanted. Depth is 1-Lipschitz, so a node bounds it everywhere around. What it answers depends
 * on the place alone, never on what was asked before, but for qmat_depth_lattice_least. One thread at a time. */
typedef struct qmat_depth_lattice {
  const qmat_surface *surface;
  double spacing;
  size_t count, capacity; /* capacity: a power of two */
  qmat_lattice_node *nodes;
  qmat_lattice_place *places; /* by the lowest bits of the hash of their keys */
  uint64_t questions;         /* how often the surface was asked */
} qmat_depth_lattice;

/* Starts empty. `spacing` is in the unit frame, at least 1e-6. QMAT_ERROR_MEMORY. Free with qmat_depth_lattice_uninit,
 * also after a failure. */
qmat_status qmat_depth_lattice_init(qmat_context *context, qmat_depth_lattice *lattice, const qmat_surface *surface,
                                    double spacing);
void qmat_depth_lattice_uninit(qmat_depth_lattice *lattice);

/* The depth at the node nearest to `point` (3 doubles, unit frame), and how far that node is. Points beyond the lattice
 * (farther than 2 diagonals) are asked of the surface themselves. */
double qmat_depth_lattice_near(qmat_depth_lattice *lattice, const double point[3], double *distance);

/* The exact depth at `point`. */
double qmat_depth_lattice_exact(qmat_depth_lattice *lattice, const double point[3]);

/* The same where a depth `near` is known `distance` away, as qmat_depth_lattice_near gives it: it tells how far to
 * look, and often the side. */
double qmat_depth_lattice_exact_near(qmat_depth_lattice *lattice, const double point[3], double near, double distance);

/* The same, but INFINITY where it is known to be more than `depth`: quicker there. */
double qmat_depth_lattice_exact_up_to(qmat_depth_lattice *lattice, const double point[3], double near, double distance,
                                      double depth);

/* A lower bound of the depth at `point`, by the newest place that qmat_depth_lattice_exact_up_to was asked nearby;
 * -INFINITY where none is known. */
double qmat_depth_lattice_least(const qmat_depth_lattice *lattice, const double point[3]);

#endif
