/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_MEDIAL_BUILD_H
#define QMAT_CORE_GEOMETRY_MEDIAL_BUILD_H

#include "core/value.h"

#define QMAT_NONE UINT32_MAX /* no id */

/* Sets the edges and triangles of an unsealed medial mesh in canonical order: ids ascend within a simplex, simplices
 * are sorted, repeated and degenerate ones are dropped, and every side of every triangle is among the edges.
 * medial->sphere_count must be set. `edges` has 2 * edge_count ids and `triangles` 3 * triangle_count, in any order;
 * each may be NULL with count 0, and may be the medial mesh's own array, which is replaced. The medial mesh owns the
 * new arrays. On QMAT_ERROR_MEMORY, QMAT_CANCELLED, or QMAT_ERROR_GEOMETRY (names the first simplex with an id out of
 * range), the medial mesh is unchanged. Cost: linear in simplices and spheres (counting sorts). */
qmat_status qmat_medial_set_simplices(qmat_context *context, qmat_medial *medial, const uint32_t *edges,
                                      size_t edge_count, const uint32_t *triangles, size_t triangle_count);

/* Finds the edge opposite each corner of each triangle of a medial mesh, whose simplices are in canonical order.
 * `sides` has room for 3 * triangle_count edge numbers: that of corner k of triangle t is sides[3 * t + k].
 * QMAT_ERROR_INTERNAL, with the triangle, where an edge is missing, and QMAT_CANCELLED. Cost: triangles times the
 * logarithm of edges. */
qmat_status qmat_medial_sides(qmat_context *context, const qmat_medial *medial, uint32_t *sides);

/* Renumbers `count` rows of `width` ids by `ids`, which has the new number of each id, or QMAT_NONE for one that goes.
 * Rows with such an id are left out. `kept` has room for all rows and may be `rows`. Returns how many rows it gets. */
size_t qmat_medial_renumber(const uint32_t *rows, size_t count, size_t width, const uint32_t *ids, uint32_t *kept);

/* An unsealed copy. NULL when memory is short. */
qmat_medial *qmat_medial_copy(const qmat_medial *medial);

#endif
