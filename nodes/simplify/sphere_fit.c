/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/sphere_fit.h"

#include <math.h>
#include <string.h>

#include "core/geometry/quadric.h"
#include "core/geometry/vector.h"
#include "nodes/simplify/fit_steps.h"
#include "nodes/simplify/thresholds.h"

void qmat_sphere_fit_uninit(qmat_sphere_fit *fit) {
  qmat_free(fit->points);
  qmat_free(fit->nearest);
  *fit = (qmat_sphere_fit){0};
}

qmat_status qmat_sphere_fit_gather(qmat_context *context, qmat_sphere_fit *fit, qmat_surface_to_envelope *tracker,
                                   const qmat_collapse *collapse, size_t surface_count, size_t most) {
  if (qmat_grow((void **)&fit->points, &fit->capacity, most, sizeof *fit->points) ||
      qmat_grow((void **)&fit->nearest, &fit->nearest_capacity, most, sizeof *fit->nearest))
    return qmat_fail_memory(context, "the fit of a sphere");
  const uint32_t ends[2] = {collapse->kept, collapse->removed};
  size_t slots = 0, first = 0;
  for (int e = 0; e < 2 && ends[e] != QMAT_NONE; e++) slots += tracker->slot_counts[ends[e]];
  const size_t stride = (slots + most - 1) / most;
  fit->count = 0;
  for (int e = 0; e < 2 && ends[e] != QMAT_NONE; e++) {
    const size_t count = tracker->slot_counts[ends[e]];
    const uint32_t *list;
    const qmat_status status = qmat_surface_to_envelope_slots(context, tracker, ends[e], &list);
    if (status != QMAT_OK) return status;
    size_t i = first;
    for (; i < count; i += stride)
      if (list[i] / 3 < surface_count && qmat_surface_to_envelope_is_first(tracker, list[i], ends, 2))
        fit->points[fit->count++] = list[i] / 3;
    first = i - count;
  }
  for (size_t i = 0; i < fit->count; i++) fit->nearest[i] = QMAT_NONE;
  return QMAT_OK;
}

qmat_status qmat_sphere_fit_error(qmat_context *context, qmat_sphere_fit *fit, qmat_surface_to_envelope *tracker,
                                  const qmat_complex *complex, const qmat_collapse *collapse, const double sphere[4],
                                  double enough, double *error) {
  *error = 0;
  const qmat_status status = qmat_surface_to_envelope_prepare(context, tracker, complex, collapse, sphere);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < fit->count && *error <= enough; i++) {
    double foot[4], share;
    const double f = qmat_surface_to_envelope_star_foot(tracker, complex, collapse, sphere,
                                                        &tracker->points[3 * (size_t)fit->points[i]], &fit->nearest[i],
                                                        foot, &share);
    *error = qmat_larger(*error, fabs(f));
  }
  return QMAT_OK;
}

/* Adds weight times the square of the linearised F of a point whose foot moves with `share` of the sphere: a tangent
 * plane in the coordinates of the sphere. */
static void add_residual(qmat_quadric *sum, const double *point, const double *foot, double share, double f,
                         const double *sphere, double weight) {
  const double length = qmat_point_distance(point, foot);
  if (!(length > 0)) return;
  double n[3], tangent[4];
  /* F(x) ~ f - share (n . (x - sphere) + x.r - sphere.r) = -share times the signed distance to a plane at f / share. */
  for (int k = 0; k < 3; k++) n[k] = (point[k] - foot[k]) / length;
  memcpy(tangent, sphere, sizeof tangent);
  tangent[3] += f / share;
  qmat_quadric_add_plane(sum, n, tangent, weight * share * share);
}

static void add_damping(qmat_quadric *sum, const double *sphere) {
  const double weight = qmat_fit_damping * (sum->a[0] + sum->a[4] + sum->a[7]) / 3;
  static const int diagonal[4] = {0, 4, 7, 9};
  for (int k = 0; k < 4; k++) {
    sum->a[diagonal[k]] += weight;
    sum->b[k] -= 2 * weight * sphere[k];
    sum->c += weight * sphere[k] * sphere[k];
  }
}

qmat_status qmat_sphere_fit_run(qmat_context *context, qmat_sphere_fit *fit, qmat_surface_to_envelope *tracker,
                                const qmat_complex *complex, const qmat_collapse *collapse, double give_up_error,
                                double sphere[4], double *before, double *error) {
  double current[4], worst = 0, last_worst = INFINITY;
  memcpy(current, sphere, sizeof current);
  *before = *error = INFINITY;
  for (int step = 0;; step++) {
    const qmat_status status = qmat_surface_to_envelope_prepare(context, tracker, complex, collapse, current);
    if (status != QMAT_OK) return status;
    qmat_quadric sum = {.c = 0};
    last_worst = worst;
    worst = 0;
    /* The error at which the fit ends: the last step only has to lower it. */
    const double hopeless = step < QMAT_FIT_STEPS ? qmat_give_up_ratios[step] * give_up_error : *error;
    const double enough = *error >= hopeless ? hopeless : INFINITY;
    for (size_t i = 0; i < fit->count; i++) {
      const double *point = &tracker->points[3 * (size_t)fit->points[i]];
      double foot[4], share;
      const double f = qmat_surface_to_envelope_star_foot(tracker, complex, collapse, current, point, &fit->nearest[i],
                                                          foot, &share);
      worst = qmat_larger(worst, fabs(f));
      if (worst > enough) return QMAT_OK;
      if (step == QMAT_FIT_STEPS || !(share > 1e-3)) continue;
      const double weight = qmat_fit_weight(last_worst > 0 ? f / last_worst : 1, step);
      add_residual(&sum, point, foot, share, f, current, weight);
    }
    if (step == 0) *before = worst;
    if (worst < *error) {
      *error = worst;
      memcpy(sphere, current, sizeof current);
    }
    if (step == QMAT_FIT_STEPS) return QMAT_OK;
    add_damping(&sum, current);
    double next[4] = {0, 0, 0, current[3]};
    if (fit->keeps_radius ? !qmat_quadric_minimise_centre(&sum, next)
                          : !qmat_quadric_minimise(&sum, next) || !(next[3] > 0))
      return QMAT_OK;
    for (int k = 0; k < 4; k++) current[k] += qmat_fit_step_share(step) * (next[k] - current[k]);
  }
}
