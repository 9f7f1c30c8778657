/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_HULL_VERTICES_H
#define QMAT_NODES_COLLIDERS_HULL_VERTICES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/context.h"

/* Whether to go on fitting a hull: QMAT_CANCELLED as of qmat_progress, else QMAT_OK, which it is for no context (NULL).
 */
static inline qmat_status qmat_hull_go_on(qmat_context *context) {
  return context ? qmat_progress(context, 1, 0, "hulls fitted") : QMAT_OK;
}

/* Keeps those of `count` points (3 doubles each) that are corners of the triangles of their hull (3 ids each), in their
 * order. Returns their number. `is_vertex` is scratch, one per point. Linear. */
size_t qmat_hull_vertices_keep(double *points, size_t count, const uint32_t *triangles, size_t triangle_count,
                               uint8_t *is_vertex);

/* Keeps those of `count` points (3 doubles each) that are farther than `distance` from every earlier one that is kept,
 * in their order. Returns their number. The hull loses no more than `distance` of any direction. Quadratic. */
size_t qmat_hull_vertices_apart(double *points, size_t count, double distance);

/* The box of points (3 doubles each), which is that of their hull; from infinity to -infinity for none. */
void qmat_hull_box(const double *points, size_t count, double low[3], double high[3]);

/* The plane of a triangle (3 ids of points): its unit normal, outward for a triangle of a hull, and its offset from the
 * origin. False for a triangle without an area. */
bool qmat_hull_plane(const double *points, const uint32_t *triangle, double plane[4]);

/* The volume within the triangles (3 ids of points each, one at least) of a closed surface. Linear. */
double qmat_hull_volume(const double *points, const uint32_t *triangles, size_t triangle_count);

#endif
