/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_SAMPLE_SPACING_H
#define QMAT_NODES_INITIAL_SAMPLE_SPACING_H

#include "core/value.h"

/* Evenly spaced points on facets and edges that are long compared to a spacing. Coarse meshes need them, since their
 * vertices alone describe the surface poorly. All lengths are in the unit frame. */

/* Counts the points that each facet owns on its sides: counts[3 * t + k] between corner k and the next, so that
 * neighbouring points are at most as far apart as the spacing of each facet with that side. The first facet that asks
 * for points owns them. `positions` holds 3 doubles per vertex, `spacings` 1 and `counts` 3 numbers per facet.
 * QMAT_ERROR_MEMORY. Cost: linear. */
qmat_status qmat_side_points_count(qmat_context *context, const qmat_mesh *mesh, const double *positions,
                                   const double *spacings, uint32_t *counts);

/* Writes the barycentrics (3 each) of `count` evenly spaced points between corner `side` and the next. */
void qmat_side_points_fill(int side, uint32_t count, double *barycentrics);

/* The number of points in rows parallel to the longest side of the triangle abc (3 doubles each). 0 if the triangle is
 * not larger than the spacing. */
uint64_t qmat_row_points_count(const double *a, const double *b, const double *c, double spacing);

/* Writes the barycentrics (3 each) of `wanted` of these points, chosen evenly; at most qmat_row_points_count. Each
 * point is displaced slightly, at random from `key`, so that rows on parallel facets are not cospherical. */
void qmat_row_points_fill(const double *a, const double *b, const double *c, double spacing, uint64_t key,
                          uint64_t wanted, double *barycentrics);

#endif
