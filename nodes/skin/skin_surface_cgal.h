/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SKIN_SKIN_SURFACE_CGAL_H
#define QMAT_NODES_SKIN_SKIN_SURFACE_CGAL_H

#include "core/context.h"
#include "nodes/skin/skin_triangles.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Makes the skin surface (Edelsbrunner 1999) of `count` balls (4 doubles each: centre, radius > 0; none inside another)
 * with CGAL. The balls are grown by 1 / sqrt(shrink) before the skin shrinks them by sqrt(shrink), so that a single
 * ball keeps its radius. 0 < shrink < 1: near 1 the skin is the union of the balls, near 0 their convex hull. Each of
 * `subdivisions` steps makes four times as many triangles, with new vertices on the skin. `surface` gets new arrays
 * that the caller frees, with vertices and triangles sorted by position; NULL on failure. QMAT_ERROR_MEMORY,
 * QMAT_CANCELLED; QMAT_ERROR_DEPENDENCY with CGAL's text; QMAT_ERROR_GEOMETRY when the skin is not closed. CGAL runs in
 * one thread of its own; the caller's reports progress. 3 to 15 milliseconds a ball (balls in a line are the slowest).
 * Meant for sizes around 1: points lie on the skin to about 1e-7. */
qmat_status qmat_skin_surface(qmat_context *context, const double *balls, size_t count, double shrink, int subdivisions,
                              qmat_skin_triangles *surface);

#ifdef __cplusplus
}
#endif

#endif
