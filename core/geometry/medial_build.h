/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_MEDIAL_BUILD_H
#define QMAT_CORE_GEOMETRY_MEDIAL_BUILD_H

#include "core/value.h"

/* Gives an unsealed medial mesh its edges and triangles in the order that the type asks for: ids rising within an edge
 * and a triangle, rows sorted, no row twice, no row that names a sphere twice, and every edge of every triangle.
 * medial->sphere_count is set before. `edges` holds 2 * edge_count ids, `triangles` 3 * triangle_count, in any order;
 * each may be NULL with count 0, and may be the medial mesh's own array, which is replaced. The medial mesh owns the
 * new arrays. QMAT_ERROR_GEOMETRY names the first row with an id that is out of range, QMAT_ERROR_MEMORY; the medial
 * mesh is then unchanged. Cost: linear in rows and spheres (counting sorts). */
qmat_status qmat_medial_set_simplices(qmat_context *context, qmat_medial *medial, const uint32_t *edges,
                                      size_t edge_count, const uint32_t *triangles, size_t triangle_count);

#endif
