/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_MEDIAL_BUILD_H
#define QMAT_CORE_GEOMETRY_MEDIAL_BUILD_H

#include "core/value.h"

/* Sets the edges and triangles of an unsealed medial mesh in canonical order: ids ascend within a simplex, simplices
 * are sorted, repeated and degenerate ones are dropped, and every side of every triangle is among the edges.
 * medial->sphere_count must be set. `edges` has 2 * edge_count ids and `triangles` 3 * triangle_count, in any order;
 * each may be NULL with count 0, and may be the medial mesh's own array, which is replaced. The medial mesh owns the
 * new arrays. On QMAT_ERROR_MEMORY, QMAT_CANCELLED, or QMAT_ERROR_GEOMETRY (names the first simplex with an id out of
 * range), the medial mesh is unchanged. Cost: linear in simplices and spheres (counting sorts). */
qmat_status qmat_medial_set_simplices(qmat_context *context, qmat_medial *medial, const uint32_t *edges,
                                      size_t edge_count, const uint32_t *triangles, size_t triangle_count);

/* An unsealed copy. NULL when memory is short. */
qmat_medial *qmat_medial_copy(const qmat_medial *medial);

#endif
