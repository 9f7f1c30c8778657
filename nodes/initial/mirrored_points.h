/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_MIRRORED_POINTS_H
#define QMAT_NODES_INITIAL_MIRRORED_POINTS_H

#include "core/geometry/surface.h"

/* Points of the surface across thin walls and narrow gaps from samples. Both arrays live in the context's arena. */
typedef struct qmat_mirrored_points {
  size_t count;
  double *points;   /* 3 per point, unit frame */
  uint32_t *facets; /* per point: the facet on which it lies */
} qmat_mirrored_points;

/* Finds the points straight across the solid from samples, and straight across what is outside: walls thinner than a
 * quarter of the distance between samples, and gaps narrower than half of it. Triangulated with the samples, they make
 * the Delaunay tetrahedra fill a thin wall, and keep apart what a narrow gap separates: where the samples of the two
 * sides are not opposite each other, Voronoi cells of one side reach through the other one, as far as the square of the
 * distance between samples divided by twice the width.
 *
 * Rays start at the samples that are their own representatives, against and along the normal of each of their facets
 * and the mean of these normals, and go on through up to 16 such walls and gaps. Nothing is added where a sample lies
 * across already. `points` (unit frame) holds 3 doubles, `representatives` one number per sample; `closest` (unit
 * frame) is the least distance between samples. QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads; the result does not
 * depend on their number. Cost: about a microsecond per ray and wall. */
qmat_status qmat_mirrored_points_find(qmat_context *context, const qmat_surface *surface, const qmat_samples *samples,
                                      const double *points, const uint32_t *representatives, double closest,
                                      qmat_mirrored_points *mirrored);

#endif
