/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_THICKNESS_H
#define QMAT_CORE_GEOMETRY_THICKNESS_H

#include "core/value.h"

/* Whether the thickness (per facet) and the samples are of this mesh: their counts fit, every facet is one of its own,
 * and the first samples are its vertices. QMAT_ERROR_GEOMETRY names the field "thickness" or "samples". Cost: linear.
 */
qmat_status qmat_thickness_check(qmat_context *context, const qmat_mesh *mesh, const qmat_field *thickness,
                                 const qmat_samples *samples);

/* The threshold theta of eq. 8 in the field's unit: `ratio` times the area-free mean of the facets' thickness. */
double qmat_thickness_threshold(const qmat_field *thickness, double ratio);

/* The thickness at each sample: a vertex takes the minimum of its facets, an added sample its facet's value.
 * `out` holds samples->count doubles. */
void qmat_thickness_of_samples(const qmat_mesh *mesh, const qmat_field *thickness, const qmat_samples *samples,
                               double *out);

#endif
