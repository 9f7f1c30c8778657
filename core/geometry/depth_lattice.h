/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_DEPTH_LATTICE_H
#define QMAT_CORE_GEOMETRY_DEPTH_LATTICE_H

#include "core/geometry/surface.h"
#include "core/key_table.h"

/* A cache of depths at the nodes of a cubic lattice. Depth is the distance to the surface, negative outside. Each node
 * is computed when it is first needed. The depth of a closed surface is 1-Lipschitz, so a node bounds it everywhere
 * nearby. Results depend on the point alone, not on earlier queries. One thread at a time. */
typedef struct qmat_depth_lattice {
  const qmat_surface *surface;
  double spacing;
  qmat_key_table nodes; /* the depths of the nodes known so far */
  uint64_t queries;     /* number of distance queries to the surface */
} qmat_depth_lattice;

/* Starts empty. `spacing` is in the unit frame; less than 7.7e-6 is raised to about that, so that keys have room.
 * QMAT_ERROR_MEMORY. Free with qmat_depth_lattice_uninit, also after a failure. */
qmat_status qmat_depth_lattice_init(qmat_context *context, qmat_depth_lattice *lattice, const qmat_surface *surface,
                                    double spacing);
void qmat_depth_lattice_uninit(qmat_depth_lattice *lattice);

/* The depth at the node nearest to `point` (3 doubles, unit frame), and the distance to that node. For a point beyond
 * the lattice (more than 2 diagonals from the centre) the exact depth, and 0. */
double qmat_depth_lattice_near(qmat_depth_lattice *lattice, const double point[3], double *distance);

/* The exact depth at `point`. */
double qmat_depth_lattice_exact(qmat_depth_lattice *lattice, const double point[3]);

/* The exact depth, given that the depth is `near` at a point `distance` away (see qmat_depth_lattice_near). That limits
 * the search radius and often decides the side. */
double qmat_depth_lattice_exact_near(qmat_depth_lattice *lattice, const double point[3], double near, double distance);

/* The same, but INFINITY where the depth is certainly above `depth`, which is cheaper to decide. */
double qmat_depth_lattice_exact_up_to(qmat_depth_lattice *lattice, const double point[3], double near, double distance,
                                      double depth);

/* A lower bound of the depth of a point inside a watertight surface (qmat_surface_is_watertight), by the depths of the
 * eight nodes around it; -INFINITY where they do not give one. The square of a distance is |x|^2 less a convex
 * function: the bound is of second order in the spacing over the depth. */
double qmat_depth_lattice_least(qmat_depth_lattice *lattice, const double point[3]);

#endif
