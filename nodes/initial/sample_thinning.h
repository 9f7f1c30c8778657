/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_SAMPLE_THINNING_H
#define QMAT_NODES_INITIAL_SAMPLE_THINNING_H

#include "core/geometry/surface.h"

/* The largest radius of a sample of a solid, in diagonals. */
static const double qmat_longest_reach = 0.01;

/* Whether the normals of two points agree, and each point is within `tolerance` of the other's tangent plane. Points
 * and normals have 3 doubles; a zero normal agrees with none. Thread-safe. */
bool qmat_samples_are_level(const double *point, const double *normal, const double *other, const double *other_normal,
                            double tolerance);

/* Finds samples that others nearby can represent. Sample a represents sample b if b's radius contains a and they
 * are level. A sample is thus left out only if the surface is
 * flat there up to about that tolerance, and the two sides of a thin sheet or a crease never represent each other.
 * Samples with smaller ids take precedence: representatives[i] becomes i, or the smaller id of its representative.
 *
 * `points` and `normals` hold 3 doubles per sample (unit frame; a sample with a zero normal represents only itself),
 * `radii` one per sample, at most `largest` (> 0). QMAT_ERROR_MEMORY, QMAT_CANCELLED. One thread. Cost: linear in
 * `count` if the radii change slowly over the surface; about 0.3 microseconds per sample. */
qmat_status qmat_samples_thin(qmat_context *context, const double *points, const double *normals, const double *radii,
                              size_t count, double largest, double tolerance, uint32_t *representatives);

/* The same for the samples of a solid's surface. The radius is a quarter of the thickness, at least `tolerance` and at
 * most `qmat_longest_reach`. With a tolerance of 0 every sample represents itself. `points` (3 doubles per sample) are
 * in the unit frame, `thickness` (one per sample) in model units. `reaches` (one per sample, unit frame; NULL: none)
 * bounds the radii further. Statuses and threads as above. */
qmat_status qmat_representatives_find(qmat_context *context, const qmat_surface *surface, const qmat_samples *samples,
                                      const double *points, const double *thickness, double tolerance,
                                      const double *reaches, uint32_t *representatives);

#endif
