/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/copies.h"

#include <omp.h>

#include "nodes/simplify/decimation_resume.h"

void qmat_copy_depths_uninit(qmat_copy_depths *depths) {
  for (int i = 0; i < QMAT_MOST_COPIES - 1; i++) qmat_depth_lattice_uninit(&depths->lattices[i]);
}

/* What all copies start from. */
typedef struct start {
  const qmat_decimation *from;
  const qmat_medial *left;
  const qmat_extra_points *extra;
} start;

static void swap(qmat_depth_lattice *a, qmat_depth_lattice *b) {
  const qmat_depth_lattice lattice = *a;
  *a = *b;
  *b = lattice;
}

/* Runs one copy to its end. `lattice` is one of an earlier run, or empty. */
static qmat_status run_copy(const start *start, qmat_copy *copy, qmat_depth_lattice *lattice,
                            qmat_constraint_points *constraints, qmat_decimation *to) {
  qmat_status status = qmat_decimation_resume(start->from, start->left, start->extra, constraints, to);
  if (copy->shared->copies > 1) {
    status = qmat_copy_meet(copy, status);
    to->copy = copy;
  }
  if (status != QMAT_OK) return status;
  if (lattice->surface) swap(lattice, &to->envelope_tracker.lattice); /* known depths hold in every run */
  status = qmat_decimation_run(to);
  swap(lattice, &to->envelope_tracker.lattice);
  if (to->copy && !copy->has_left) status = qmat_copy_meet(copy, status);
  to->copy = NULL;
  return status;
}

/* Runs a copy that nobody sees. */
static qmat_status run_hidden(const start *start, qmat_copy *copy, qmat_depth_lattice *lattice,
                              const qmat_decimation *like, qmat_error *error) {
  const qmat_context *context = like->context;
  qmat_context own = {.threads = 1, .node_id = context->node_id, .node_type = context->node_type};
  qmat_decimation to = {.context = &own, .surface = like->surface, .rules = like->rules};
  qmat_constraint_points constraints;
  const qmat_status status = run_copy(start, copy, lattice, &constraints, &to);
  *error = own.error;
  qmat_decimation_uninit(&to);
  qmat_context_uninit(&own);
  return status;
}

qmat_status qmat_decimation_run_copies(const qmat_decimation *from, const qmat_medial *left,
                                       const qmat_extra_points *extra, qmat_depth_lattice *lattice,
                                       qmat_copy_depths *depths, qmat_constraint_points *constraints,
                                       qmat_decimation *to) {
  const start start = {.from = from, .left = left, .extra = extra};
  const int most = to->rules.repairs ? 1 : QMAT_MOST_COPIES; /* repairs share no attempts */
  const int threads = qmat_threads(to->context) < most ? qmat_threads(to->context) : most;
  qmat_lookahead shared;
  qmat_status statuses[QMAT_MOST_COPIES] = {QMAT_OK};
  qmat_error errors[QMAT_MOST_COPIES];
#pragma omp parallel num_threads(threads)
  {
    qmat_copy copy = {.shared = &shared, .number = omp_get_thread_num()};
#pragma omp single
    qmat_lookahead_init(&shared, omp_get_num_threads());
    const int i = copy.number;
    statuses[i] = i == 0 ? run_copy(&start, &copy, lattice, constraints, to)
                         : run_hidden(&start, &copy, &depths->lattices[i - 1], to, &errors[i]);
  }
  for (int i = 1; i < shared.copies && (statuses[0] == QMAT_OK || statuses[0] == QMAT_CANCELLED); i++)
    if (statuses[i] != QMAT_OK && statuses[i] != QMAT_CANCELLED) {
      to->context->error = errors[i];
      return statuses[i];
    }
  return statuses[0];
}
