/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_WRAP_CGAL_H
#define QMAT_NODES_MESH_WRAP_CGAL_H

#include "core/context.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct qmat_wrap {
  size_t vertex_count, triangle_count;
  double *positions;   /* 3 * vertex_count */
  uint32_t *triangles; /* 3 * triangle_count */
} qmat_wrap;

/* A closed, oriented surface without crossings around any triangles, which lie strictly inside of it. Its vertices are
 * `offset` (> 0) from them or farther; it enters no opening that a ball of radius `alpha` (> 0) cannot pass. The arrays
 * are the caller's (qmat_free). QMAT_ERROR_MEMORY, QMAT_ERROR_DEPENDENCY, QMAT_CANCELLED. One thread. Cost: 100
 * microseconds per triangle that is made, about as many as alpha squared goes into the area.
 * Source: Portaneri, Rouxel-Labbe, Hemmer, Cohen-Steiner, Alliez 2022, Alpha wrapping with an offset. */
qmat_status qmat_wrap_triangles(qmat_context *context, const double *positions, size_t vertex_count,
                                const uint32_t *triangles, size_t triangle_count, double alpha, double offset,
                                qmat_wrap *wrap);

#ifdef __cplusplus
}
#endif

#endif
