/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_TRIANGLE_SEPARATION_H
#define QMAT_NODES_MESH_TRIANGLE_SEPARATION_H

/* A quick test for triangles that do not meet. Exact predicates are slow for triangles of one plane, and most
 * neighbours of a divided surface are such triangles. */
#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Whether two triangles are certain to have no more in common than their first `shared` corners (0 to 2), which are the
 * same points of both. Each of `a` and `b` is 3 pointers to points of 3 doubles, in any unit; the caller keeps them.
 * True is exact: a plane separates the other corners by more than rounding may change (for two shared corners: the
 * triangles turn to different sides of their edge). False says nothing. Takes constant time; safe on any thread. */
bool qmat_triangles_are_separate(const double *const a[3], const double *const b[3], int shared);

#ifdef __cplusplus
}
#endif

#endif
