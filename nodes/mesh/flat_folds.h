/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_FLAT_FOLDS_H
#define QMAT_NODES_MESH_FLAT_FOLDS_H

#include "core/context.h"

/* The triangles of a mesh whose flat faces are not folded. */
typedef struct qmat_flat_folds {
  size_t triangle_count;
  uint32_t *triangles;  /* in the context's arena; NULL if no face is triangulated again */
  const uint8_t *stays; /* per given triangle, beside `triangles`: whether it is one of them. These come first, in their
                           order */
  size_t faces;         /* that are triangulated again */
  double distance;      /* the most that a corner of theirs is out of its plane, in the unit of the positions */
  size_t failed;        /* folded faces that stay as they are, since nothing that the border bounds fills it */
  uint32_t place;       /* a vertex of the first of these */
} qmat_flat_folds;

/* Triangulates folded flat faces again, such as a concave polygon that is given as the fan of a corner that does not
 * see all of it: some of its triangles are turned over, lie outside of the polygon, and cancel what others have too
 * much. A face is a set of triangles in a plane, connected across edges of two triangles. It is folded where two
 * triangles lie on the same side of their edge, both more than `longest_fold` high above it. Its border, the edges that
 * its triangles use more in one direction than in the other, is filled by its winding number. The border stays, and
 * with it what is closed; so does every vertex. A face that has no border (a card of two sides) and one whose vertices
 * its border does not enclose (a leaf of two sides on a solid) stay as they are. `positions`: 3 * vertex_count, finite;
 * `triangles`: 3 * triangle_count, below 2^32. Corners are up to `tolerance` away from the plane. QMAT_ERROR_MEMORY,
 * QMAT_ERROR_DEPENDENCY, QMAT_CANCELLED. One thread. Cost: linear, and n log n in the corners of each folded face. */
qmat_status qmat_unfold_flat_faces(qmat_context *context, size_t vertex_count, const double *positions,
                                   size_t triangle_count, const uint32_t *triangles, double tolerance,
                                   double longest_fold, qmat_flat_folds *folds);

#endif
