/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_DESCRIPTOR_EPSILON_H
#define QMAT_NODES_DESCRIPTOR_EPSILON_H

/* The epsilon, in diagonals, that nodes of meshes and medial.simplify compute with where their own is 0 (no bound). For
 * a number of spheres it is the first one tried, and the largest one that medial.refine refines for. */
#define QMAT_DEFAULT_EPSILON 0.01

/* The least epsilon, in diagonals, that is tried for a number of spheres. */
#define QMAT_FINEST_EPSILON 0.0025

#endif
