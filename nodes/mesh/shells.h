/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_SHELLS_H
#define QMAT_NODES_MESH_SHELLS_H

#include <stddef.h>
#include <stdint.h>

#define QMAT_NO_SHELL UINT32_MAX

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
} qmat_shells;

#endif
