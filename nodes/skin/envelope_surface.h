/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SKIN_ENVELOPE_SURFACE_H
#define QMAT_NODES_SKIN_ENVELOPE_SURFACE_H

#include "core/geometry/envelope.h"
#include "nodes/skin/skin_triangles.h"

/* What the grid came to. */
typedef struct qmat_envelope_grid {
  double base, finest;        /* cell sizes */
  double smallest_radius;     /* what radii were raised to: thinner parts would slip through the finest cells */
  size_t cell_count;          /* cells that hold surface */
  size_t refined_cell_count;  /* of them smaller than the base size */
  size_t raised_sphere_count; /* spheres whose radius was raised */
} qmat_envelope_grid;

/* The surface of an envelope by dual contouring (Ju et al. 2002) of F on the cells of an octree: one vertex per
 * surface sheet in a cell, where the tangent planes at the sheet's edge crossings meet best, and one polygon per
 * crossing. Sheets are told apart in each cell (as in the dual marching cubes of Nielson 2004, here for cells with
 * neighbours of any size), so that the surface is always a closed, oriented 2-manifold.
 * `spheres` are those that `envelope` was made of, in a frame of about unit size; cells are `base` wide, and halved up
 * to `detail` times where radii are small. Radii below 0.9 of the finest cell are raised to it, so that every primitive
 * leaves a connected trace; isolated spheres of radius 0 are left out.
 * `surface` gets new arrays that the caller frees; after a failure they may be NULL or not, and are freed the same way.
 * QMAT_ERROR_MEMORY, QMAT_ERROR_GEOMETRY when there is no primitive or the cells are too many, QMAT_CANCELLED. Uses all
 * threads; the same bytes for any number of them. */
qmat_status qmat_envelope_surface(qmat_context *context, const qmat_envelope *envelope, const double *spheres,
                                  size_t sphere_count, double base, int detail, qmat_skin_triangles *surface,
                                  qmat_envelope_grid *grid);

#endif
