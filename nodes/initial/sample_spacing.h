/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_SAMPLE_SPACING_H
#define QMAT_NODES_INITIAL_SAMPLE_SPACING_H

#include "core/value.h"

/* Even points on facets and edges that are long against a wanted spacing, for coarse meshes, whose few vertices say
 * little of where the surface is. All lengths are in the unit frame. */

/* How many points each facet owns on its sides: counts[3 * t + k] between corner k and the next, so that neighbouring
 * points are at most `spacing` apart. A side belongs to the first facet that has it. `positions` holds 3 doubles a
 * vertex, `counts` 3 a facet. QMAT_ERROR_MEMORY. Cost: O(n log n) in the number of long sides. */
qmat_status qmat_side_points_count(qmat_context *context, const qmat_mesh *mesh, const double *positions,
                                   double spacing, uint32_t *counts);

/* Writes the barycentrics (3 each) of `count` even points between corner `side` and the next. */
void qmat_side_points_fill(int side, uint32_t count, double *barycentrics);

/* How many points rows along the longest side put inside the triangle abc (3 doubles each). 0 where it is no larger
 * than the spacing asks for. */
uint64_t qmat_row_points_count(const double *a, const double *b, const double *c, double spacing);

/* Writes the barycentrics of `wanted` of these points, evenly picked; at most qmat_row_points_count of them. `key`
 * makes the small displacements that keep rows on parallel facets from lying on common spheres. */
void qmat_row_points_fill(const double *a, const double *b, const double *c, double spacing, uint64_t key,
                          uint64_t wanted, double *barycentrics);

#endif
