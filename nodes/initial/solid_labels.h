/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_SOLID_LABELS_H
#define QMAT_NODES_INITIAL_SOLID_LABELS_H

#include "nodes/initial/dual_complex.h"

/* Sets `solids`: connected components of the surface bound one solid, and those of voids the solid around them. Reads
 * `mesh` and `surface`. QMAT_ERROR_MEMORY. One thread. Cost: linear, and a ray for each void. */
qmat_status qmat_solids_find(qmat_dual_complex *dual);

/* Keeps solids apart that are nearer to each other than samples are: where medial vertices in different solids are
 * adjacent, the tetrahedron of the smaller one is dropped. `*dropped` is the number of these. Reads `cells`, `spheres`
 * and `solids`, sets `solid_of`, changes `kinds`. QMAT_ERROR_MEMORY. All threads; the result does not depend on their
 * number. Cost: linear, and a distance for each tetrahedron with corners on several solids. */
qmat_status qmat_solids_part(qmat_dual_complex *dual, size_t *dropped);

#endif
