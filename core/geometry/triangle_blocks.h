/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_TRIANGLE_BLOCKS_H
#define QMAT_CORE_GEOMETRY_TRIANGLE_BLOCKS_H

#include <stddef.h>
#include <stdint.h>

#include "core/context.h"

struct RTCDeviceTy;

/* Triangles, eight to a block, made ready for the question which of them is nearest: Embree finds the blocks, a disc
 * around each triangle tells which are worth an exact look. After qmat_triangle_blocks_new they are only read: any
 * number of threads may ask at once. */
typedef struct qmat_triangle_blocks qmat_triangle_blocks;

/* `positions` (3 doubles per vertex) and `triangles` (3 * count vertices) stay the caller's and have to live as long;
 * the box of all is about 1 wide. Degenerate triangles are allowed. Free with qmat_triangle_blocks_free before the
 * device, whose own error state tells when Embree fails. QMAT_ERROR_MEMORY. Cost: O(n log n) on all threads, about 60
 * bytes a triangle. */
qmat_status qmat_triangle_blocks_new(qmat_context *context, struct RTCDeviceTy *device, const double *positions,
                                     const uint32_t *triangles, size_t count, qmat_triangle_blocks **blocks);
void qmat_triangle_blocks_free(qmat_triangle_blocks *blocks);

/* The distance to the nearest triangle, in double precision. `closest` (3 doubles) and `triangle` (of equally close
 * ones the smallest) may be NULL. Points that are farther than `limit` (INFINITY: none) give INFINITY and leave both
 * unset. Beyond 10,000 box widths every triangle is looked at. */
double qmat_triangle_blocks_distance(const qmat_triangle_blocks *blocks, const double point[3], double limit,
                                     double *closest, uint32_t *triangle);

#endif
