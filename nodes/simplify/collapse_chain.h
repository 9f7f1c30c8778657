/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_COLLAPSE_CHAIN_H
#define QMAT_NODES_SIMPLIFY_COLLAPSE_CHAIN_H

#include "core/geometry/medial_complex.h"

/* Collapses in the order in which they were done, in the unit frame; the arrays are those of qmat_chain. */
typedef struct qmat_collapse_log {
  size_t count;
  uint32_t *ends;
  double *merged;
  double *errors;
  uint32_t *owners; /* per sample */
} qmat_collapse_log;

/* The share of an error limit that collapses may use at the constraint points; the margin covers the surface between
 * them. */
extern const double qmat_constraint_share;

/* The sphere that each of `sphere_count` initial spheres is merged into after `count` collapses (`ends`: 2 per
 * collapse, as in qmat_chain); itself where it is not merged. `roots`: sphere_count. Cost: linear. */
void qmat_collapse_roots(const uint32_t *ends, size_t count, size_t sphere_count, uint32_t *roots);

/* Sets the responsible regions of an unsealed medial mesh, whose sphere_count is set. `owners` (per sample) is a sphere
 * or QMAT_NONE. QMAT_ERROR_MEMORY. Cost: linear. */
qmat_status qmat_medial_set_regions(qmat_context *context, const uint32_t *owners, size_t sample_count,
                                    qmat_medial *medial);

/* The largest number of collapses of a chain that leave at least `vertices` spheres (0: any number) and errors up to
 * `epsilon` diagonals (0: any). Cost: logarithmic. */
size_t qmat_chain_length(const qmat_chain *chain, size_t vertices, double epsilon);

/* The medial mesh after the first `count` collapses of a chain, its spheres in the order of the initial one. `medial`
 * is new and unsealed. QMAT_ERROR_MEMORY. Cost: linear in the initial medial mesh. */
qmat_status qmat_chain_extract(qmat_context *context, const qmat_chain *chain, size_t count, qmat_medial *medial);

#endif
