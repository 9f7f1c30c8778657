/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_POLYGON_H
#define QMAT_IO_POLYGON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { QMAT_LARGEST_CONCAVE_POLYGON = 10000 };

/* Triangulates a polygon in space into count - 2 triangles of the same orientation. A convex polygon becomes
 * the fan of its first corner, as in viewers and engines: where it is not planar, the fan is the surface that they
 * show. A concave one, and one whose fan has an empty triangle, is clipped ear by ear, the best shape first. Works in
 * the plane of the polygon's area vector. Non-planar and self-intersecting polygons are triangulated, too. `points`: 3
 * * count coordinates, count >= 3. `ids`: the vertex of each corner; corners at one vertex do not block each other.
 * `flat` (3 * count) and `links` (8 * count) are scratch. `triangles`: 3 * (count - 2) corner numbers below count.
 * False, and no triangles, for a concave polygon with more than QMAT_LARGEST_CONCAVE_POLYGON corners: the cost is
 * quadratic. Deterministic, one thread; no allocation. */
bool qmat_polygon_triangulate(const double *points, const uint32_t *ids, size_t count, double *flat, uint32_t *links,
                              uint32_t *triangles);

#endif
