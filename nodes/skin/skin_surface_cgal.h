/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SKIN_SKIN_SURFACE_CGAL_H
#define QMAT_NODES_SKIN_SKIN_SURFACE_CGAL_H

#include "core/context.h"
#include "nodes/skin/skin_triangles.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The skin surface (Edelsbrunner 1999) of `count` balls (4 doubles each: centre, radius > 0; none inside another), by
 * CGAL. The balls are grown by 1 / sqrt(shrink) before the skin shrinks them by sqrt(shrink), so that the skin wraps
 * them: a single ball keeps its radius. 0 < shrink < 1; towards 1 the skin is the union of the balls, towards 0 their
 * convex hull. `subdivisions` steps refine the mesh, each to four times as many triangles, new vertices on the skin.
 * `surface` gets new arrays, vertices and triangles sorted by position, that the caller frees; on failure both are
 * NULL. QMAT_ERROR_MEMORY; QMAT_ERROR_DEPENDENCY with CGAL's text; QMAT_ERROR_GEOMETRY when the skin is not closed;
 * QMAT_CANCELLED. CGAL runs in one thread of its own, progress is reported from the caller's. 3 to 15 milliseconds a
 * ball (in line they are the slowest). Sizes are meant to be around 1: points lie on the skin to about 1e-7. */
qmat_status qmat_skin_surface(qmat_context *context, const double *balls, size_t count, double shrink, int subdivisions,
                              qmat_skin_triangles *surface);

#ifdef __cplusplus
}
#endif

#endif
