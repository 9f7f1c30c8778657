/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_DESCRIPTOR_EPSILON_H
#define QMAT_NODES_DESCRIPTOR_EPSILON_H

/* The epsilon, in diagonals, that tolerances are relative to where a node's own epsilon is 0: no bound. */
#define QMAT_DEFAULT_EPSILON 0.01

/* The least epsilon, in diagonals, that is tried for a number of spheres. */
#define QMAT_FINEST_EPSILON 0.0025

#endif
