/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_RUN_RUN_SUMMARY_H
#define QMAT_GRAPHS_RUN_RUN_SUMMARY_H

#include "graphs/run/run.h"

/* In how far the spheres that a step made describe its mesh. Fractions are of the bounding-box diagonal. */
typedef struct qmat_run_summary {
  size_t step;
  uint64_t spheres;
  size_t triangles;                                         /* of the mesh that they describe; 0: not known */
  size_t meshes;                                            /* that they describe, each within its own diagonal */
  size_t failures;                                          /* meshes of the scene that could not be described */
  double epsilon, surface_to_envelope, envelope_to_surface; /* of several meshes the largest */
  bool evaluated; /* by a node that tells whether the errors are certified; the second is then of the boundary */
  bool certified, estimate;
} qmat_run_summary;

/* The summary of the last step that made or read a medial mesh and made a report with the numbers "spheres", "epsilon",
 * "surface_to_envelope" and "envelope_to_surface"; false when there is none. A report with "certified" makes it
 * evaluated. */
bool qmat_run_summarise(const qmat_run *run, qmat_run_summary *summary);

#endif
