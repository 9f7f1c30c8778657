/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/simplification_state.h"

#include <math.h>

#include "nodes/descriptor/epsilon.h"
#include "nodes/measure/envelope_to_surface.h"

qmat_status qmat_simplification_measure_envelope(const qmat_simplification *s, const qmat_medial *unit,
                                                 qmat_medial_errors *errors) {
  const double epsilon = s->params.epsilon > 0 ? s->params.epsilon : QMAT_DEFAULT_EPSILON;
  const qmat_decimation *round = &s->rounds[s->newest];
  if (s->params.epsilon > 0 && s->params.error == QMAT_ERROR_TWO_SIDED) {
    errors->envelope_to_surface = qmat_envelope_to_surface_largest_bound(&round->envelope_tracker, &round->complex);
    if (!(errors->envelope_to_surface > epsilon)) return QMAT_OK;
  }
  return qmat_medial_envelope_bound_measure(s->context, s->surface, unit, qmat_error_tolerance * epsilon,
                                            qmat_least_reported * epsilon, errors);
}

qmat_status qmat_simplification_measure(const qmat_simplification *s, const qmat_medial *unit, bool only_within,
                                        qmat_medial_errors *errors) {
  const double epsilon = s->params.epsilon > 0 ? s->params.epsilon : QMAT_DEFAULT_EPSILON;
  const double tolerance = qmat_error_tolerance * epsilon, enough = qmat_least_reported * epsilon;
  const qmat_constraint_points *constraints = &s->round_constraints[s->newest];
  qmat_status status =
      qmat_medial_surface_bound_measure(s->context, s->surface, unit, constraints->points, constraints->surface_count,
                                        tolerance, enough, epsilon, errors);
  if (status != QMAT_OK || (only_within && errors->surface_to_envelope > epsilon)) return status;
  const bool two_sided = s->params.epsilon > 0 && s->params.error == QMAT_ERROR_TWO_SIDED;
  status = qmat_simplification_measure_envelope(s, unit, errors);
  return status == QMAT_OK && two_sided
             ? qmat_medial_boundary_measure(s->context, s->surface, unit, epsilon, only_within, errors)
             : status;
}

void qmat_simplification_uninit(qmat_simplification *s) {
  for (int i = 0; i < 3; i++) {
    qmat_decimation_uninit(&s->rounds[i]);
    qmat_arena_uninit(&s->round_memory[i]);
  }
  qmat_decimation_uninit(&s->dense);
  qmat_copy_depths_uninit(&s->depths);
  qmat_surface_free(s->surface);
}

bool qmat_simplified_is_better(const qmat_simplified *a, const qmat_simplified *b) {
  if (a->fault != b->fault) return a->fault < b->fault;
  if (a->has_right_topology != b->has_right_topology) return a->has_right_topology;
  return a->medial->sphere_count < b->medial->sphere_count;
}

void qmat_simplified_uninit(qmat_simplified *a) {
  qmat_value_release(a->medial ? &a->medial->base : NULL);
  *a = (qmat_simplified){.fault = INFINITY};
}
