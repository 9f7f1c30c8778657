/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_POLYGON_H
#define QMAT_IO_POLYGON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { QMAT_LARGEST_CONCAVE_POLYGON = 10000 };

/* Cuts a polygon in space into count - 2 triangles with its own orientation: the better diagonal of a quadrilateral,
 * the fan of the best-shaped triangles in a small convex polygon, best ear first otherwise. Works in the plane of the
 * polygon's area vector; polygons that are not planar or cross themselves are cut all the same.
 * `points`: 3 * count coordinates, count >= 3; `ids`: what vertex each corner is, so that corners at one vertex do not
 * block each other; `flat` (3 * count) and `links` (8 * count) are scratch; `triangles`: 3 * (count - 2) corner numbers
 * in 0 .. count - 1. False, with nothing written, for a concave polygon of more than QMAT_LARGEST_CONCAVE_POLYGON
 * corners, since its cost is quadratic. Deterministic; no allocation. */
bool qmat_polygon_triangulate(const double *points, const uint32_t *ids, size_t count, double *flat, uint32_t *links,
                              uint32_t *triangles);

#endif
