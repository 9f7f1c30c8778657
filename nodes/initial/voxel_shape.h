/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_VOXEL_SHAPE_H
#define QMAT_NODES_INITIAL_VOXEL_SHAPE_H

#include "core/geometry/surface.h"

/* The voxels whose centre is inside a solid. Voxel (x, y, z) is the cube between the lattice points (x, y, z) and
 * (x + 1, y + 1, z + 1); lattice point p is at origin + p * voxel in the unit frame. The bits are rows along x, with a
 * margin of one empty voxel on all sides. */
typedef struct qmat_voxel_shape {
  int32_t size[3];
  double origin[3], voxel;
  size_t row_words, count; /* count: voxels inside */
  uint64_t *bits;          /* in the context's arena */
} qmat_voxel_shape;

/* Voxelises the solid of a surface. The longest side of its box has 0.9 * 2^depth voxels (depth 2 to 9). Cells of an
 * octree that are farther from the surface than their voxels' centres are inside or outside as a whole.
 * QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads; the result does not depend on their number. Cost: an inside test for
 * each voxel near the surface. */
qmat_status qmat_voxel_shape_make(qmat_context *context, const qmat_surface *surface, int depth,
                                  qmat_voxel_shape *shape);

/* Whether a voxel is inside. Its coordinates are at least -1 and at most the size. */
static inline bool qmat_voxel_inside(const qmat_voxel_shape *shape, int32_t x, int32_t y, int32_t z) {
  const size_t row = (size_t)(z + 1) * (size_t)(shape->size[1] + 2) + (size_t)(y + 1), bit = (size_t)(x + 1);
  return shape->bits[row * shape->row_words + bit / 64] >> (bit % 64) & 1;
}

/* Lists the corners of the squares between voxels inside and outside, by z, y and x: 3 integers each, from 0 to the
 * size, in the context's arena. QMAT_ERROR_MEMORY, QMAT_CANCELLED. Cost: linear in the words of the bits. */
qmat_status qmat_voxel_boundary(qmat_context *context, const qmat_voxel_shape *shape, int32_t **points, size_t *count);

#endif
