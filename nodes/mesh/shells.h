/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_SHELLS_H
#define QMAT_NODES_MESH_SHELLS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define QMAT_NO_SHELL UINT32_MAX

/* Where blocks were moved to, and how to bring points back. */
typedef struct qmat_block_frame {
  bool is_turned; /* false: they are where they were given */
  double axes[3][3], centre[3];
  double shift; /* along the first axis */
} qmat_block_frame;

/* A mesh divided into shells and patches. A shell is connected across edges, a patch across edges of two triangles. */
typedef struct qmat_shells {
  size_t vertex_count, triangle_count;
  const double *positions;   /* 3 * vertex_count, finite */
  const uint32_t *triangles; /* 3 * triangle_count */
  /* triangle_count: the triangle that names its shell. QMAT_NO_SHELL: the triangle stays as it is and bounds nothing.
   * At each edge of a shell as many triangles run one way as the other. */
  const uint32_t *shells;
  const uint32_t *patches; /* triangle_count: the triangle that names its patch */
  const uint8_t *reaches;  /* triangle_count: 0 if no triangle of another patch is near */
  const uint8_t *crosses;  /* triangle_count: 1 if the triangle crosses another of its patch */
  double longest_fold;     /* >= 0, in the unit of the positions: longer folds of a shell in itself are united */
  /* The vertices where the result has them; NULL: as in `positions`. Then new ones are brought back from the frame of
   * their triangle: frames[frame_of[triangle]]. */
  const double *given;
  const qmat_block_frame *frames;
  const uint32_t *frame_of;
} qmat_shells;

#endif
