/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_MEDIAL_VERTICES_H
#define QMAT_NODES_INITIAL_MEDIAL_VERTICES_H

#include "nodes/initial/dual_complex.h"

/* Points closer to the surface than this (unit frame) do not count as inside. Coplanar samples are coplanar only up to
 * rounding and make flat tetrahedra on the surface, whose side would depend on chance. */
static const double qmat_least_depth = 1e-8;

/* Algorithm 1: sets `kinds` and `spheres` of every tetrahedron. Long slivers between samples of one nearly flat
 * piece of the surface are dropped, unless their circumcentre is inside. Reads `points`, `thin`, `cells` and
 * `solids`. QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads; the result does not depend on their number. */
qmat_status qmat_medial_vertices_select(qmat_dual_complex *dual);

/* The centre (3 doubles, unit frame) of the sphere inscribed in a tetrahedron. Thread-safe. */
void qmat_medial_vertex_incentre(const qmat_dual_complex *dual, size_t cell, double centre[3]);

/* Merges adjacent medial vertices whose centres are no farther apart than `merge`, and numbers them in
 * the order of their first tetrahedron: sets `sphere_of` and `sphere_count`. QMAT_ERROR_MEMORY. One thread. */
qmat_status qmat_medial_vertices_number(qmat_dual_complex *dual);

/* How far the middle of the edge between two samples is outside of the solid (unit frame): 0 inside, INFINITY beyond
 * `limit`. At or below `least` the answer is any number up to that, which takes less time. Thread-safe. */
double qmat_dual_edge_outside(const qmat_dual_complex *dual, uint32_t a, uint32_t b, double least, double limit);

#endif
