/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SKIN_ENVELOPE_SURFACE_H
#define QMAT_NODES_SKIN_ENVELOPE_SURFACE_H

#include "core/geometry/envelope.h"
#include "nodes/skin/envelope_cells.h"
#include "nodes/skin/skin_triangles.h"

/* The grid that was used. */
typedef struct qmat_envelope_grid {
  double base, finest;        /* cell sizes */
  double smallest_radius;     /* the floor of radii: thinner features would be missed by the finest cells */
  size_t cell_count;          /* cells that the surface crosses */
  size_t refined_cell_count;  /* those smaller than the base size */
  size_t raised_sphere_count; /* spheres whose radius was raised */
  bool is_too_fine;           /* the surface crosses more cells than the limit, and there is none */
} qmat_envelope_grid;

/* Makes the surface of an envelope by dual contouring (Ju et al. 2002) of F on the cells of an octree. Each surface
 * sheet in a cell has one vertex, where the tangent planes at its edge crossings meet best; each crossing has one
 * polygon. Cells may have several sheets (as in the dual marching cubes of Nielson 2004, here for neighbours of any
 * size), so that the surface is always a closed, oriented 2-manifold.
 *
 * `request` says how fine the cells are. Radii below 0.9 of the finest cell are raised to that, so that every primitive
 * gives a connected surface; single spheres of radius 0 are left out.
 *
 * There is no surface where it crosses more cells than `request` allows; a cell has about 1.3 triangles.
 *
 * `surface` gets new arrays that the caller frees, also after a failure, when they may be NULL. QMAT_ERROR_MEMORY,
 * QMAT_CANCELLED; QMAT_ERROR_GEOMETRY when there is no primitive or there are too many cells. Uses all threads; the
 * same bytes for any number of them. */
qmat_status qmat_envelope_surface(qmat_context *context, const qmat_envelope *envelope,
                                  const qmat_cell_request *request, qmat_skin_triangles *surface,
                                  qmat_envelope_grid *grid);

#endif
