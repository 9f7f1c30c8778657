/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_SIMPLIFY_REPORT_H
#define QMAT_NODES_SIMPLIFY_SIMPLIFY_REPORT_H

#include "nodes/simplify/decimation_state.h"

/* What the report of medial.simplify tells of a run. Errors are in the unit frame, without the mesh's deviation. */
typedef struct qmat_simplify_figures {
  qmat_collapse_counts counts;
  size_t initial_spheres, constraint_points;
  size_t features;       /* sharp ones that are left */
  size_t wanted_spheres; /* 0: no such number */
  double crease_error, surface_to_envelope, envelope_to_surface;
  bool in_order;    /* then `threshold` applies, else rounds, filled, moves and divided */
  double threshold; /* of the last collapse */
  size_t rounds, filled, moves;
  size_t divided; /* spheres that divide walls and edges, so that part of them could be removed */
} qmat_simplify_figures;

/* Takes over what a decimation tells. */
void qmat_simplify_figures_of(const qmat_decimation *run, qmat_simplify_figures *figures);

/* Makes the report: the figures, the counts of `unit` (a medial mesh in the unit frame), its topology beside that of
 * the solid, and the handles that are lost. A number of spheres that is missed, and each lost handle, is a warning.
 * `epsilon` (0: none) and the mesh's `deviation`, in diagonals, are as given. The report is not sealed.
 * QMAT_ERROR_MEMORY. */
qmat_status qmat_simplify_report(qmat_context *context, const qmat_simplify_figures *figures, const qmat_medial *unit,
                                 const qmat_surface *surface, double epsilon, double deviation, qmat_report *report);

#endif
