/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_DUAL_COMPONENTS_H
#define QMAT_NODES_INITIAL_DUAL_COMPONENTS_H

#include "nodes/initial/dual_complex.h"

typedef struct qmat_dual_component_counts {
  size_t components, links;     /* components after linking, and the edges that link them */
  size_t specks, speck_spheres; /* dropped components, and their spheres */
} qmat_dual_component_counts;

/* Drops every component of the medial mesh whose samples larger components are responsible for too: slivers on the
 * surface. Then links the components that lie in the same solid by medial edges; the solid tears
 * apart where it is thinner than the samples are dense. An edge that would leave the solid by more than `link_limit` is
 * not made: the components then stay apart. Changes the simplices and the numbers of the medial vertices.
 * QMAT_ERROR_MEMORY, QMAT_CANCELLED. One thread. Cost: linear, and a sort of the pairs of spheres that share a sample;
 * at worst quadratic where components share none. */
qmat_status qmat_dual_components_join(qmat_dual_complex *dual, qmat_dual_component_counts *counts);

#endif
