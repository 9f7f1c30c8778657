/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/collapse_trial.h"

#include <math.h>
#include <string.h>

typedef qmat_simplification simplification;
typedef qmat_trial_tools tools;

qmat_trial_tools qmat_trial_tools_of(simplification *s) {
  return (tools){.context = s->context,
                 .complex = &s->complex,
                 .coverage = &s->coverage,
                 .protrusion = &s->protrusion,
                 .fit = &s->fit,
                 .collapse = &s->collapse};
}

qmat_status qmat_trial_candidates(const simplification *s, const tools *t, uint32_t edge, qmat_candidates *c) {
  if (s->rules.cost == QMAT_COST_PMAT) {
    qmat_candidates_find_larger(t->complex, s->quadrics, edge, c);
  } else if (s->rules.cost == QMAT_COST_HAUSDORFF) {
    const qmat_status status = qmat_complex_preview(t->context, t->complex, edge, t->collapse);
    if (status != QMAT_OK) return status;
    return qmat_hausdorff_candidates(t->context, t->coverage, t->complex, t->collapse, s->control->surface_count, c);
  } else if (s->rules.published) {
    qmat_candidates_find_published(t->complex, s->quadrics, edge, c);
  } else {
    qmat_candidates_find(t->complex, s->quadrics, edge, c);
  }
  return QMAT_OK;
}

static bool is_inner(const simplification *s, size_t point) {
  return point >= s->control->surface_count;
}

/* Whether the newest preview merges into a sharp feature. */
static bool merges_feature(const simplification *s, const qmat_collapse *collapse) {
  return qmat_crease_guard_is_feature(&s->creases, collapse->kept) ||
         qmat_crease_guard_is_feature(&s->creases, collapse->removed);
}

/* Whether the merged sphere and its edges lie inside the model; and whether the sphere protrudes no more than it may. A
 * sharp feature lies on the surface. */
static qmat_trial_outcome test_inside(const simplification *s, const tools *t, const double *sphere) {
  qmat_protrusion *protrusion = t->protrusion;
  const bool on_surface = merges_feature(s, t->collapse);
  const bool kept = qmat_protrusion_test_sphere(protrusion, t->complex, t->collapse, sphere) || on_surface;
  const bool inside = s->rules.published || on_surface || protrusion->sphere_depth > 0;
  if (!inside || (!kept && s->rules.on_exceed == QMAT_EXCEED_SKIP)) return QMAT_TRIAL_REFUSED;
  if (!s->rules.published && !qmat_protrusion_test_midpoints(protrusion, t->complex, t->collapse, sphere))
    return QMAT_TRIAL_REFUSED;
  const bool exceeded = !kept && sphere[3] - protrusion->sphere_depth > protrusion->limit;
  return exceeded ? QMAT_TRIAL_EXCEEDED : QMAT_TRIAL_DONE;
}

qmat_status qmat_trial_test_sphere(const simplification *s, const tools *t, const double sphere[4], uint32_t first,
                                   qmat_trial *trial, double *asked) {
  bool kept;
  t->coverage->found_count = 0;
  trial->outcome = test_inside(s, t, sphere);
  *asked = sphere[3] - t->protrusion->sphere_depth;
  if (trial->outcome != QMAT_TRIAL_DONE) {
    trial->refused_by_surface++;
    return QMAT_OK;
  }
  trial->outcome = QMAT_TRIAL_EXCEEDED;
  if (s->held < INFINITY) {
    const qmat_status status =
        qmat_coverage_test(t->context, t->coverage, t->complex, t->collapse, sphere, first, &kept);
    if (status != QMAT_OK) return status;
    if (!kept) {
      const uint32_t failed = t->coverage->failed_point;
      trial->refused_by_coverage++;
      *asked = fmax(s->held, is_inner(s, failed) ? -s->control->distances[failed] : t->coverage->failed_distance);
      return QMAT_OK;
    }
  }
  if (qmat_simplification_holds_protrusion(s)) {
    const qmat_status status = qmat_protrusion_test(t->context, t->protrusion, t->complex, t->collapse, sphere, &kept);
    if (status != QMAT_OK) return status;
    if (!kept) {
      trial->refused_by_protrusion++;
      *asked = t->protrusion->failed;
      return QMAT_OK;
    }
  }
  trial->outcome = QMAT_TRIAL_DONE;
  return QMAT_OK;
}

/* A sphere whose sampled error is this many times what is held is not worth a test. */
static const double worth_testing = 1.1;

/* The sphere of least error at the surface among the candidates, fitted to it; where that cannot be, one of those that
 * look good as they are. */
static qmat_status run_fitted(const simplification *s, const tools *t, const qmat_candidates *c, qmat_trial *trial) {
  double errors[QMAT_MOST_CANDIDATES], error = INFINITY, asked;
  int least = 0;
  qmat_status status = qmat_sphere_fit_gather(t->context, t->fit, t->coverage, t->collapse, s->control->surface_count);
  for (int i = 0; i < c->count && status == QMAT_OK; i++) {
    status = qmat_sphere_fit_error(t->context, t->fit, t->coverage, t->complex, t->collapse, c->spheres[i], &errors[i]);
    if (errors[i] < errors[least]) least = i;
  }
  double *sphere = trial->sphere;
  memcpy(sphere, c->spheres[least], sizeof c->spheres[least]);
  if (status == QMAT_OK)
    status = qmat_sphere_fit_run(t->context, t->fit, t->coverage, t->complex, t->collapse, s->held, sphere, &error);
  trial->fitted_error = error;
  if (status == QMAT_OK && error <= worth_testing * s->held)
    status = qmat_trial_test_sphere(s, t, sphere, QMAT_NONE, trial, &asked);
  for (int i = 0; i < c->count && status == QMAT_OK && trial->outcome != QMAT_TRIAL_DONE; i++) {
    if (!(errors[i] <= worth_testing * s->held)) continue;
    memcpy(sphere, c->spheres[i], sizeof c->spheres[i]);
    status = qmat_trial_test_sphere(s, t, sphere, QMAT_NONE, trial, &asked);
  }
  return status;
}

qmat_status qmat_trial_run(const simplification *s, const tools *t, const qmat_candidates *c, bool bound,
                           qmat_trial *trial) {
  *trial = (qmat_trial){
      .outcome = QMAT_TRIAL_REFUSED, .asked = INFINITY, .failed_point = s->failed_points[t->collapse->edge]};
  if (s->fitting && !bound) return run_fitted(s, t, c, trial);
  qmat_status status = QMAT_OK;
  bool exceeded = false;
  for (int i = 0; i < c->count && status == QMAT_OK && trial->outcome != QMAT_TRIAL_DONE; i++) {
    const size_t refused = trial->refused_by_coverage;
    double asked;
    memcpy(trial->sphere, c->spheres[i], sizeof c->spheres[i]);
    status = qmat_trial_test_sphere(s, t, trial->sphere, trial->failed_point, trial, &asked);
    if (status == QMAT_OK && trial->refused_by_coverage > refused) trial->failed_point = t->coverage->failed_point;
    if (trial->outcome != QMAT_TRIAL_EXCEEDED) continue;
    trial->asked = fmin(trial->asked, asked);
    exceeded = true;
  }
  if (exceeded && trial->outcome != QMAT_TRIAL_DONE) trial->outcome = QMAT_TRIAL_EXCEEDED;
  return status;
}
