/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/ordered_collapse.h"

#include "nodes/simplify/rising_threshold.h"
#include "nodes/simplify/thresholds.h"

/* With QMAT_EXCEED_STOP the threshold rises within the collapses, with QMAT_EXCEED_RAISE when none is left. */
static qmat_status collapse_in_order(qmat_decimation *run) {
  bool ended = run->threshold > run->rules.limit; /* even the lowest threshold exceeds the limit */
  qmat_status status = qmat_decimation_collapse_edges(run, &ended);
  while (run->rules.on_exceed == QMAT_EXCEED_RAISE && status == QMAT_OK && !ended && run->complex.live_edges > 0 &&
         qmat_rising_threshold_raise(run)) {
    qmat_rising_threshold_queue(run);
    status = qmat_decimation_collapse_edges(run, &ended);
  }
  return status;
}

qmat_status qmat_ordered_collapses_run(qmat_context *context, const qmat_simplify_params *params,
                                       const qmat_value *const inputs[], qmat_ordered_collapses *o) {
  const qmat_samples *samples = (const qmat_samples *)inputs[2];
  const qmat_medial *medial = (const qmat_medial *)inputs[3];
  *o = (qmat_ordered_collapses){.params = *params};
  qmat_simplify_apply_compatibility(&o->params);
  qmat_decimation *run = &o->decimation;
  qmat_status status = qmat_simplify_prepare(context, &o->params, inputs, &o->surface, &o->initial);
  if (status != QMAT_OK) return status;
  run->context = context;
  run->surface = o->surface;
  run->sheet_vertices = medial->sheet_sphere_count;
  run->rules = qmat_simplify_rules(&o->params, &o->initial, 0);
  status = qmat_complex_init(context, &run->complex, medial, o->initial.spheres);
  if (status == QMAT_OK)
    status = qmat_constraint_points_make(context, o->surface, samples, medial, &run->complex,
                                         qmat_constraint_error * o->params.finest, QMAT_MOST_CONSTRAINT_POINTS,
                                         run->rules.error == QMAT_ERROR_TWO_SIDED, &o->constraints);
  if (status == QMAT_OK) status = qmat_decimation_init(run, &o->constraints, o->initial.depths);
  return status == QMAT_OK ? collapse_in_order(run) : status;
}

void qmat_ordered_collapses_uninit(qmat_ordered_collapses *o) {
  qmat_decimation_uninit(&o->decimation);
  qmat_surface_free(o->surface);
}
