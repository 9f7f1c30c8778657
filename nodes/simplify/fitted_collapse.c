/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/fitted_collapse.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "nodes/simplify/collapse_test.h"

qmat_status qmat_decimation_try_fitted(qmat_decimation *s, uint32_t edge, const qmat_candidates *c, double sphere[4],
                                       qmat_collapse_outcome *result) {
  const double hopeless = qmat_give_up_ratios[0] * s->threshold;
  double errors[QMAT_MOST_CANDIDATES], before, error = INFINITY, needed;
  int least = 0;
  s->fit.keeps_radius = qmat_decimation_is_of_sheet(s, s->collapse.kept);
  qmat_status status = qmat_sphere_fit_gather(s->context, &s->fit, &s->surface_tracker, &s->collapse,
                                              s->constraints->surface_count, QMAT_FITTED_POINTS);
  for (int i = 0; i < c->count && status == QMAT_OK; i++) {
    const double enough = i > 0 ? qmat_larger(errors[least], qmat_test_ratio * s->threshold) : hopeless;
    status = qmat_sphere_fit_error(s->context, &s->fit, &s->surface_tracker, &s->complex, &s->collapse, c->spheres[i],
                                   enough, &errors[i]);
    if (errors[i] < errors[least]) least = i;
  }
  memcpy(sphere, c->spheres[least], sizeof c->spheres[least]);
  s->refusal = QMAT_REFUSED_BY_NOTHING;
  if (status == QMAT_OK && errors[least] <= hopeless)
    status = qmat_sphere_fit_run(s->context, &s->fit, &s->surface_tracker, &s->complex, &s->collapse, s->threshold,
                                 sphere, &before, &error);
  s->fitted_errors[edge] = error;
  memcpy(s->fitted, sphere, sizeof s->fitted);
  if (status == QMAT_OK && error <= qmat_test_ratio * s->threshold)
    status = qmat_decimation_test_sphere(s, sphere, QMAT_NONE, result, &needed);
  for (int i = 0; i < c->count && status == QMAT_OK && *result != QMAT_COLLAPSE_ALLOWED; i++) {
    if (!(errors[i] <= qmat_test_ratio * s->threshold)) continue;
    memcpy(sphere, c->spheres[i], sizeof c->spheres[i]);
    status = qmat_decimation_test_sphere(s, sphere, QMAT_NONE, result, &needed);
  }
  return status;
}

typedef struct qmat_neighbourhood_state {
  double *at, value;
} neighbourhood_state;

static qmat_status save(qmat_decimation *s, double *values, size_t count) {
  if (qmat_grow((void **)&s->saved, &s->saved_capacity, s->saved_count + count, sizeof *s->saved))
    return qmat_fail_memory(s->context, "the fit of a neighbourhood");
  for (size_t i = 0; i < count; i++) s->saved[s->saved_count++] = (neighbourhood_state){&values[i], values[i]};
  return QMAT_OK;
}

/* Saves a sphere and the bounds of its star. */
static qmat_status save_star(qmat_decimation *s, uint32_t vertex) {
  qmat_status status = save(s, &s->complex.spheres[4 * (size_t)vertex], 4);
  if (status == QMAT_OK) status = save(s, &s->envelope_tracker.depths[vertex], 1);
  size_t count;
  const uint32_t *at = qmat_complex_edges_at(&s->complex, vertex, &count);
  for (size_t i = 0; i < count && status == QMAT_OK; i++) status = save(s, &s->envelope_tracker.edge_bounds[at[i]], 1);
  at = qmat_complex_triangles_at(&s->complex, vertex, &count);
  for (size_t i = 0; i < count && status == QMAT_OK; i++)
    status = save(s, &s->envelope_tracker.triangle_bounds[at[i]], 1);
  return status;
}

void qmat_decimation_restore_neighbourhood(qmat_decimation *s) {
  for (size_t i = 0; i < s->saved_count; i++) *s->saved[i].at = s->saved[i].value;
}

/* Moves a sphere regardless of the threshold; its bounds stay valid. */
static qmat_status place(qmat_decimation *s, uint32_t vertex, const double *sphere, bool *inside) {
  qmat_envelope_to_surface *envelope_tracker = &s->envelope_tracker;
  const double limit = envelope_tracker->limit;
  bool kept;
  qmat_status status = qmat_complex_preview_move(s->context, &s->complex, vertex, &s->collapse);
  if (status != QMAT_OK) return status;
  envelope_tracker->limit = INFINITY;
  *inside = qmat_envelope_to_surface_test_sphere(envelope_tracker, &s->complex, &s->collapse, sphere);
  if (*inside) {
    status = qmat_envelope_to_surface_test(s->context, envelope_tracker, &s->complex, &s->collapse, sphere, &kept);
    if (status == QMAT_OK) qmat_envelope_to_surface_commit(envelope_tracker, &s->collapse);
  }
  envelope_tracker->limit = limit;
  if (status == QMAT_OK && *inside) status = qmat_complex_collapse(s->context, &s->complex, &s->collapse, sphere);
  return status;
}

/* Adds a constraint point to the targets, with a margin. */
static qmat_status add_point_target(qmat_decimation *s, size_t point) {
  return qmat_neighbourhood_fit_add(s->context, &s->neighbourhood, &s->surface_tracker.points[3 * point],
                                    qmat_decimation_is_inner(s, point) ? QMAT_TARGET_INSIDE : QMAT_TARGET_SURFACE,
                                    s->surface_tracker.limits[point] - qmat_target_margin * s->threshold);
}

/* Adds the place where the newest test failed to the targets; `*needed` is false where a fit cannot repair it. */
static qmat_status add_refused_target(qmat_decimation *s, const double *sphere, bool *needed) {
  const double *centre = s->refusal == QMAT_REFUSED_BY_SPHERE ? sphere : s->envelope_tracker.failed_place;
  *needed = true;
  if (s->refusal == QMAT_REFUSED_BY_SURFACE_TO_ENVELOPE) return add_point_target(s, s->surface_tracker.failed_point);
  double closest[3];
  uint32_t triangle;
  *needed = s->refusal != QMAT_REFUSED_BY_MIDPOINT && qmat_surface_inside(s->surface, centre);
  if (!*needed) return QMAT_OK;
  qmat_surface_distance(s->surface, centre, INFINITY, closest, &triangle);
  return qmat_neighbourhood_fit_add(s->context, &s->neighbourhood, closest, QMAT_TARGET_BORDER,
                                    (1 - qmat_target_margin) * s->threshold);
}

/* Previews the collapse of `edge`, or without one the move of the neighbourhood's first sphere. */
static qmat_status preview(qmat_decimation *s, uint32_t edge) {
  return edge != QMAT_NONE
             ? qmat_complex_preview(s->context, &s->complex, edge, &s->collapse)
             : qmat_complex_preview_move(s->context, &s->complex, s->neighbourhood.vertices[0], &s->collapse);
}

/* Tests a sphere of the neighbourhood, which is in place; number 0 is the sphere of the collapse. */
static qmat_status test_in_neighbourhood(qmat_decimation *s, uint32_t edge, int number, qmat_collapse_outcome *result) {
  double needed;
  const qmat_status status =
      number == 0 ? preview(s, edge)
                  : qmat_complex_preview_move(s->context, &s->complex, s->neighbourhood.vertices[number], &s->collapse);
  return status == QMAT_OK
             ? qmat_decimation_test_sphere(s, s->neighbourhood.spheres[number], QMAT_NONE, result, &needed)
             : status;
}

/* Places and tests the spheres of the neighbourhood. `*last_refused`, which a refusal updates, is tested first. The
 * collapse is tested last, so that it is the newest preview. */
static qmat_status test_neighbourhood(qmat_decimation *s, uint32_t edge, uint32_t removed, int *last_refused,
                                      qmat_collapse_outcome *result, bool *again) {
  qmat_neighbourhood_fit *neighbourhood = &s->neighbourhood;
  bool inside = true;
  qmat_status status = QMAT_OK;
  *result = QMAT_COLLAPSE_REFUSED;
  *again = false;
  for (int i = removed == QMAT_NONE ? 0 : -1; i < neighbourhood->count && status == QMAT_OK; i++) {
    status = place(s, i < 0 ? removed : neighbourhood->vertices[i], neighbourhood->spheres[i < 0 ? 0 : i], &inside);
    if (!inside) return status;
  }
  const int first = *last_refused;
  for (int i = 0; i <= neighbourhood->count && status == QMAT_OK; i++) {
    const int number = i == 0 ? first : i % neighbourhood->count;
    if (i > 0 && number == first && (number > 0 || neighbourhood->count == 1)) continue;
    status = test_in_neighbourhood(s, edge, number, result);
    if (status != QMAT_OK || *result == QMAT_COLLAPSE_ALLOWED) continue;
    *last_refused = number;
    return add_refused_target(s, neighbourhood->spheres[number], again);
  }
  return status;
}

/* Starts the fit of the newest preview from `sphere`, jointly with its neighbours unless `alone`. */
static qmat_status start_fit(qmat_decimation *s, const double sphere[4], bool alone) {
  const qmat_collapse *c = &s->collapse;
  uint32_t others[QMAT_NEIGHBOURHOOD_SPHERES];
  size_t count = 0;
  for (size_t n = 0; !alone && n < c->neighbour_count && count < QMAT_NEIGHBOURHOOD_SPHERES; n++)
    if (!qmat_crease_guard_is_feature(&s->creases, c->neighbours[n]) &&
        !qmat_decimation_is_protected(s, c->neighbours[n]))
      others[count++] = c->neighbours[n];
  s->neighbourhood.keeps_radii = qmat_decimation_is_of_sheet(s, c->kept);
  const qmat_fit_request request = {sphere, others, count, s->constraints->surface_count, s->threshold};
  return qmat_neighbourhood_fit_start(s->context, &s->neighbourhood, &s->surface_tracker, &s->complex, c, &request);
}

/* Fits, places and tests the neighbourhood; the place of a refusal becomes a target of the next fit. If `*result`
 * allows it, the spheres are in place, and the collapse is the newest preview and test. Else nothing has changed. */
static qmat_status fit_and_test(qmat_decimation *s, uint32_t edge, qmat_collapse_outcome *result) {
  const uint32_t removed = s->collapse.removed;
  const bool is_move = edge == QMAT_NONE;
  qmat_status status = QMAT_OK;
  bool again = true;
  int last_refused = 0;
  const int most = is_move ? QMAT_MOST_MOVE_FITS : QMAT_MOST_FITS;
  for (int i = 0; i < most && again && status == QMAT_OK && *result != QMAT_COLLAPSE_ALLOWED; i++) {
    double error;
    /* The fits of a move go on with high weights. Those of a collapse do so every other time, and else start over. */
    qmat_neighbourhood_fit_run(&s->neighbourhood, &s->complex, is_move || i % 2 == 1, &error);
    if (!(error <= qmat_placement_ratio * s->threshold)) return status;
    s->saved_count = 0;
    if (removed != QMAT_NONE) status = save_star(s, removed);
    for (int k = 0; k < s->neighbourhood.count && status == QMAT_OK; k++)
      status = save_star(s, s->neighbourhood.vertices[k]);
    if (status == QMAT_OK) status = test_neighbourhood(s, edge, removed, &last_refused, result, &again);
    if (status == QMAT_OK && *result == QMAT_COLLAPSE_ALLOWED) return status;
    qmat_decimation_restore_neighbourhood(s);
    if (status == QMAT_OK) status = preview(s, edge);
  }
  return status;
}

static qmat_status try_neighbourhood(qmat_decimation *s, uint32_t edge, bool alone, qmat_collapse_outcome *result) {
  const qmat_status status = start_fit(s, s->fitted, alone);
  return status == QMAT_OK ? fit_and_test(s, edge, result) : status;
}

qmat_status qmat_decimation_try_neighbourhoods(qmat_decimation *s, uint32_t edge, qmat_collapse_outcome *result) {
  qmat_status status = QMAT_OK;
  if (s->refusal == QMAT_REFUSED_BY_MIDPOINT) return status;
  if (s->fitted_errors[edge] <= qmat_test_ratio * s->threshold) status = try_neighbourhood(s, edge, true, result);
  if (status == QMAT_OK && *result != QMAT_COLLAPSE_ALLOWED && s->collapse.neighbour_count < QMAT_COLLAPSE_SPHERES &&
      s->fitted_errors[edge] <= qmat_neighbourhood_ratio * s->threshold)
    status = try_neighbourhood(s, edge, false, result);
  return status;
}

qmat_status qmat_decimation_try_move(qmat_decimation *s, uint32_t vertex, size_t point, bool alone,
                                     qmat_collapse_outcome *result) {
  *result = QMAT_COLLAPSE_REFUSED;
  qmat_status status = qmat_complex_preview_move(s->context, &s->complex, vertex, &s->collapse);
  if (status == QMAT_OK) status = start_fit(s, &s->complex.spheres[4 * (size_t)vertex], alone);
  if (status == QMAT_OK) status = add_point_target(s, point);
  s->neighbourhood.worst = s->threshold; /* all errors are near it: the fit starts with high weights */
  return status == QMAT_OK ? fit_and_test(s, QMAT_NONE, result) : status;
}
