/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_SAMPLE_THINNING_H
#define QMAT_NODES_INITIAL_SAMPLE_THINNING_H

#include "core/geometry/surface.h"

/* Finds samples that stand for others nearby. A sample stands for another that is nearer than that one's radius when
 * both normals look the same way and each lies within `detail` of the other's tangent plane; so what is left out is
 * told by its neighbours to about that depth, and two sides of a sheet, or of a crease, never stand for each other.
 * Earlier samples go before later ones: stand_ins[i] becomes i, or the smaller id of the sample that stands for sample
 * i.
 *
 * `points` and `normals` hold 3 doubles a sample (unit frame; one with a zero normal stands for itself alone), `radii`
 * one, at most `largest` (> 0). QMAT_ERROR_MEMORY, QMAT_CANCELLED. One thread. Cost: linear in `count` where the radii
 * change slowly over the surface; about 0.3 microseconds a sample. */
qmat_status qmat_samples_thin(qmat_context *context, const double *points, const double *normals, const double *radii,
                              size_t count, double largest, double detail, uint32_t *stand_ins);

/* The same for the samples of a solid's surface: they may be a quarter of the thickness away from what stands for them,
 * and 1 % of the diagonal at most, but always `detail`; with a detail of 0 every sample stands for itself. `points` (3
 * doubles a sample) are in the unit frame, `thickness` (one a sample) in model units. `reaches` (one a sample, unit
 * frame; NULL: none) are further bounds of that distance. Statuses and threads as above. */
qmat_status qmat_stand_ins_find(qmat_context *context, const qmat_surface *surface, const qmat_samples *samples,
                                const double *points, const double *thickness, double detail, const double *reaches,
                                uint32_t *stand_ins);

#endif
