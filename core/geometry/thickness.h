/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_THICKNESS_H
#define QMAT_CORE_GEOMETRY_THICKNESS_H

#include "core/value.h"

/* Checks that the thickness has one value for each facet of this mesh. QMAT_ERROR_GEOMETRY names the field "thickness".
 */
qmat_status qmat_thickness_check_field(qmat_context *context, const qmat_mesh *mesh, const qmat_field *thickness);

/* Checks that the thickness (per facet) and the samples belong to this mesh: their counts match, every facet id exists,
 * and the first samples are the mesh's vertices. QMAT_ERROR_GEOMETRY names the field "thickness" or "samples". Cost:
 * linear. */
qmat_status qmat_thickness_check(qmat_context *context, const qmat_mesh *mesh, const qmat_field *thickness,
                                 const qmat_samples *samples);

/* The threshold theta of eq. 8 in the field's unit: `ratio` times the mean thickness of the facets of solids, not
 * weighted by area; 0 without any. `thickness` has a value for each facet of the mesh. */
double qmat_thickness_threshold(const qmat_mesh *mesh, const qmat_field *thickness, double ratio);

/* The thickness at each sample: the minimum of its facets at a vertex, its facet's value at any other sample. `out` has
 * samples->count doubles. */
void qmat_thickness_of_samples(const qmat_mesh *mesh, const qmat_field *thickness, const qmat_samples *samples,
                               double *out);

#endif
