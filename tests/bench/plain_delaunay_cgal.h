/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_TESTS_BENCH_PLAIN_DELAUNAY_CGAL_H
#define QMAT_TESTS_BENCH_PLAIN_DELAUNAY_CGAL_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Seconds that CGAL takes for the 3D Delaunay triangulation of `count` points (3 doubles each) as its manual has it:
 * one call with the whole range, exact predicates, one thread. Negative when it fails. */
double qmat_plain_delaunay_seconds(const double *points, size_t count);

#ifdef __cplusplus
}
#endif

#endif
