/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_TETRAHEDRA_TOPOLOGY_H
#define QMAT_NODES_INITIAL_TETRAHEDRA_TOPOLOGY_H

#include "nodes/initial/dual_complex.h"

/* Gives the kept tetrahedra the loops and voids of the solid. All samples lie on the surface, so the dual is homotopy
 * equivalent to the interior of the kept tetrahedra. A sliver on the surface whose incentre is on the wrong side makes
 * a loop or a void; one that is missing where thin walls meet opens the void between them. This keeps or drops the
 * tetrahedra that are nearest to the surface until the Betti numbers are right, and reverts all that turn out not to
 * matter. */

typedef struct qmat_mended_tetrahedra {
  size_t kept, dropped; /* tetrahedra outside that are kept now, and inside that are dropped */
} qmat_mended_tetrahedra;

/* Changes `kinds`; a tetrahedron that is kept now has the sphere of a neighbour, or one around its incentre where no
 * neighbour has one. Nothing changes where the Betti numbers of the solid are not known, where they are right, or where
 * they would come out no nearer. Components stay (nodes/initial/dual_components.h joins them). Reads `cells` and
 * `points`. QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads for distances; the result does not depend on their number.
 * Cost: linear where nothing is wrong, else a distance for each tetrahedron beside the surface, and where a void is
 * missing a search through the tetrahedra outside for each that could close it. */
qmat_status qmat_tetrahedra_mend(qmat_dual_complex *dual, qmat_mended_tetrahedra *mended);

#endif
