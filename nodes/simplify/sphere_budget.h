/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_SPHERE_BUDGET_H
#define QMAT_NODES_SIMPLIFY_SPHERE_BUDGET_H

#include "nodes/simplify/simplification.h"

/* Finds the least epsilon at which a simplification ends with at most its `params.vertices` (> 0) spheres, by runs of
 * all passes at several epsilons, to within 4 %. It is at least params.finest.
 * Where none is enough, the run at the largest one counts. The simplification is prepared; `best` gets the result and
 * `*epsilon` the bound that it was made for, both in the unit frame. Statuses, threads and memory are those of
 * qmat_simplification_run; about ten runs, at most 19. */
qmat_status qmat_simplification_run_to_count(const qmat_simplification *simplification, qmat_simplified *best,
                                             double *epsilon);

#endif
