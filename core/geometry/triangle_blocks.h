/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_TRIANGLE_BLOCKS_H
#define QMAT_CORE_GEOMETRY_TRIANGLE_BLOCKS_H

#include <stddef.h>
#include <stdint.h>

#include "core/context.h"

struct RTCDeviceTy;

/* Triangles in blocks of eight, prepared for nearest-triangle queries. Embree finds the blocks; a disc around each
 * triangle decides whether it needs an exact test. Blocks are immutable after qmat_triangle_blocks_new, so any number
 * of threads may query them at once. */
typedef struct qmat_triangle_blocks qmat_triangle_blocks;

/* Builds the blocks. `positions` (3 doubles per vertex) and `triangles` (3 * count vertex ids) are borrowed and must
 * outlive them; their bounding box is about 1 wide. Degenerate triangles are allowed. Free
 * `*blocks` with qmat_triangle_blocks_free before the device, also after a failure. QMAT_ERROR_MEMORY; a failure of
 * Embree is in the device's error state. Cost: O(n log n) on all threads, about 60 bytes per triangle. */
qmat_status qmat_triangle_blocks_new(qmat_context *context, struct RTCDeviceTy *device, const double *positions,
                                     const uint32_t *triangles, size_t count, qmat_triangle_blocks **blocks);
/* NULL is allowed. */
void qmat_triangle_blocks_free(qmat_triangle_blocks *blocks);

/* The distance to the nearest triangle in double precision. `closest` (3 doubles) receives the closest point and
 * `triangle` its triangle, the smallest of equally close ones; both may be NULL. A point farther than `limit`
 * (INFINITY: no limit) gives INFINITY and leaves both unset. Beyond 10,000 box widths every triangle is tested. */
double qmat_triangle_blocks_distance(const qmat_triangle_blocks *blocks, const double point[3], double limit,
                                     double *closest, uint32_t *triangle);

/* The distance to one triangle, by its number. */
double qmat_triangle_blocks_distance_to(const qmat_triangle_blocks *blocks, uint32_t triangle, const double point[3]);

/* An upper bound of r - d over a simplex of `count` (1 to 3) spheres (4 doubles each), where d is the distance to the
 * triangles and r the radius between the spheres: at least `lowest`. INFINITY where it is above `limit` or hard to
 * find. It is exact, up to `lowest`, where the triangles nearby lie on the boundary of a convex set: r less the
 * distance to a plane is linear. `*failed` is UINT32_MAX, or what a failed search left there: its triangle is tried
 * first, and the answer is the same. Cost: a visit to each 64 triangles within reach of the spheres; a failure costs
 * few visits.
 */
double qmat_triangle_blocks_excess(const qmat_triangle_blocks *blocks, const double *const spheres[], int count,
                                   double lowest, double limit, uint32_t *failed);

#endif
