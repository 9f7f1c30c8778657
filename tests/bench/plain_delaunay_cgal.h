/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_TESTS_BENCH_PLAIN_DELAUNAY_CGAL_H
#define QMAT_TESTS_BENCH_PLAIN_DELAUNAY_CGAL_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The seconds of CGAL's 3D Delaunay triangulation of `count` points (3 doubles each), called as in its manual: once
 * with the whole range, exact predicates, one thread. Negative when it fails. */
double qmat_plain_delaunay_seconds(const double *points, size_t count);

#ifdef __cplusplus
}
#endif

#endif
