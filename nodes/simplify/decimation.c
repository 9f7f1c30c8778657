/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/decimation.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "nodes/simplify/collapse_attempt.h"
#include "nodes/simplify/collapse_commit.h"
#include "nodes/simplify/cost_rows.h"
#include "nodes/simplify/lookahead.h"
#include "nodes/simplify/point_repair.h"
#include "nodes/simplify/rising_threshold.h"

/* Progress interval, in cost evaluations and in attempts. The last attempts test thousands of points each. */
enum { COSTS_A_REPORT = 256, ATTEMPTS_A_REPORT = 16 };

static qmat_status fill_heap(qmat_decimation *s) {
  const size_t count = s->complex.edge_count;
  s->failed_points = qmat_arena_alloc(&s->context->arena, count, sizeof *s->failed_points);
  s->stale = qmat_arena_alloc(&s->context->arena, count, sizeof *s->stale);
  s->needed = qmat_arena_alloc(&s->context->arena, count, sizeof *s->needed);
  s->fitted_errors = qmat_arena_calloc(&s->context->arena, count, sizeof *s->fitted_errors);
  s->converged = qmat_arena_calloc(&s->context->arena, s->complex.vertex_count, sizeof *s->converged);
  if (!s->failed_points || !s->stale || !s->needed || !s->fitted_errors || !s->converged)
    return qmat_fail_memory(s->context, "the heap of edges");
  qmat_status status = qmat_edge_heap_init(s->context, &s->heap, &s->complex);
  if (status != QMAT_OK) return status;
  for (size_t e = 0; e < count; e++) {
    s->failed_points[e] = QMAT_NONE;
    s->needed[e] = 0;
  }
  if (qmat_cost_row_of(&s->rules)->takes_preview) { /* serial: all costs use the same preview */
    for (size_t e = 0; e < count && status == QMAT_OK; e++) {
      if (e % COSTS_A_REPORT == 0) status = qmat_progress(s->context, e, count, "costs");
      if (status == QMAT_OK) status = qmat_decimation_set_cost(s, (uint32_t)e);
    }
  } else {
    const int threads = qmat_threads(s->context);
#pragma omp parallel for num_threads(threads) schedule(static)
    for (size_t e = 0; e < count; e++) qmat_decimation_set_cost(s, (uint32_t)e);
  }
  qmat_edge_heap_fill(&s->heap, s->locked);
  return status;
}

qmat_status qmat_decimation_init(qmat_decimation *s, const qmat_constraint_points *constraints, const double *depths) {
  qmat_context *context = s->context;
  const qmat_complex *c = &s->complex;
  s->constraints = constraints;
  double *limits = qmat_arena_alloc(&context->arena, constraints->count, sizeof *limits);
  if (!limits) return qmat_fail_memory(context, "the simplification");
  if (!s->quadrics) {
    s->quadrics = qmat_arena_calloc(&context->arena, c->vertex_count, sizeof *s->quadrics);
    if (!s->quadrics) return qmat_fail_memory(context, "the simplification");
    if (s->rules.published)
      qmat_medial_quadrics_add_published(c, s->quadrics);
    else
      qmat_medial_quadrics_add(c, s->quadrics);
    if (s->rules.features == QMAT_FEATURES_SHARP) {
      const qmat_status status = qmat_crease_guard_init(context, c, s->sheet_vertices, &s->creases);
      if (status != QMAT_OK) return status;
    }
  }
  /* Surface points with a larger initial distance must not get worse. */
  const double limit = s->rules.share * s->rules.limit;
  for (size_t i = 0; i < constraints->count; i++)
    limits[i] = i < constraints->surface_count ? fmax(limit, constraints->distances[i])
                                               : constraints->inner_limits[i - constraints->surface_count];
  qmat_status status =
      qmat_surface_to_envelope_init(context, &s->surface_tracker, constraints->count, constraints->points, limits,
                                    constraints->witnesses, constraints->weights, c->vertex_count);
  if (status == QMAT_OK) status = fill_heap(s);
  if (status != QMAT_OK) return status;
  s->threshold = limit;
  status = qmat_envelope_to_surface_init(context, &s->envelope_tracker, s->surface, c, depths,
                                         !qmat_decimation_is_two_sided(s) ? INFINITY
                                         : qmat_decimation_in_order(s)    ? s->rules.finest
                                                                          : s->rules.limit);
  s->envelope_tracker.sheet_vertices = s->sheet_vertices;
  if (qmat_decimation_is_two_sided(s)) s->envelope_tracker.limit = limit;
  if (status != QMAT_OK || !qmat_decimation_in_order(s)) return status;
  return qmat_rising_threshold_start(s);
}

void qmat_decimation_uninit(qmat_decimation *s) {
  qmat_collapse_uninit(&s->collapse);
  qmat_sphere_fit_uninit(&s->fit);
  qmat_neighbourhood_fit_uninit(&s->neighbourhood);
  qmat_free(s->saved);
  qmat_surface_to_envelope_uninit(&s->surface_tracker);
  qmat_envelope_to_surface_uninit(&s->envelope_tracker);
  qmat_complex_uninit(&s->complex);
}

static bool may_continue(const qmat_decimation *s) {
  const size_t live = s->complex.live_vertices;
  return live > 1 && !(s->rules.vertices > 0 && live <= s->rules.vertices);
}

static qmat_status report_progress(const qmat_decimation *s) {
  const size_t initial = s->complex.vertex_count;
  return qmat_progress(s->context, initial - s->complex.live_vertices, initial, "collapses");
}

qmat_status qmat_decimation_collapse_edges(qmat_decimation *s, bool *ended) {
  for (size_t attempts = 0; s->heap.count > 0 && !*ended; attempts++) {
    const bool takes_long = s->rules.neighbourhoods || (s->copy && s->copy->ahead > 0);
    qmat_status status = takes_long || attempts % ATTEMPTS_A_REPORT == 0 ? report_progress(s) : QMAT_OK;
    if (status != QMAT_OK) return status;
    uint32_t edge = qmat_edge_heap_first(&s->heap);
    if (s->stale[edge]) {
      if ((status = qmat_decimation_set_cost(s, edge)) != QMAT_OK) return status;
      qmat_edge_heap_update(&s->heap, edge);
      continue;
    }
    *ended = !may_continue(s) || (s->rules.most_cost > 0 && s->heap.costs[edge] > s->rules.most_cost);
    if (*ended) return QMAT_OK;
    qmat_edge_heap_remove(&s->heap, edge);
    qmat_collapse_outcome result;
    double sphere[4];
    status = s->copy && s->copy->ahead > 0 ? qmat_lookahead_next(s, &edge, sphere, &result)
                                           : qmat_decimation_attempt(s, edge, sphere, &result);
    if (status != QMAT_OK) return status;
    if (s->copy) qmat_copy_note(s->copy, result == QMAT_COLLAPSE_ALLOWED);
    if (result == QMAT_COLLAPSE_ALLOWED) {
      s->counts.collapses++;
      if ((status = qmat_decimation_accept(s, sphere)) != QMAT_OK) return status;
    } else if (result == QMAT_COLLAPSE_EXCEEDS && s->rules.on_exceed == QMAT_EXCEED_STOP) {
      *ended = !qmat_rising_threshold_raise(s);
      qmat_edge_heap_update(&s->heap, edge);
    }
  }
  return QMAT_OK;
}

/* Fits every sphere to the surface where that lowers its largest error. Converged spheres, which did not move in their
 * last fit and whose neighbours have not moved since, are skipped. A fit uses at most `most` constraint points. */
static qmat_status refit(qmat_decimation *s, size_t most, size_t *moved) {
  *moved = 0;
  for (uint32_t v = 0; v < s->complex.vertex_count; v++) {
    if (!s->complex.vertex_alive[v] || s->converged[v] || qmat_decimation_is_protected(s, v) ||
        qmat_crease_guard_is_feature(&s->creases, v))
      continue;
    s->converged[v] = 1;
    s->fit.keeps_radius = qmat_decimation_is_of_sheet(s, v);
    qmat_status status = report_progress(s);
    if (status == QMAT_OK) status = qmat_complex_preview_move(s->context, &s->complex, v, &s->collapse);
    if (status == QMAT_OK)
      status = qmat_sphere_fit_gather(s->context, &s->fit, &s->surface_tracker, &s->collapse,
                                      s->constraints->surface_count, most);
    double sphere[4], before, after;
    memcpy(sphere, &s->complex.spheres[4 * (size_t)v], sizeof sphere);
    if (status == QMAT_OK)
      status = qmat_sphere_fit_run(s->context, &s->fit, &s->surface_tracker, &s->complex, &s->collapse, INFINITY,
                                   sphere, &before, &after);
    if (status != QMAT_OK) return status;
    if (!(before > 0 && after <= (1 - qmat_least_gain) * before)) continue;
    qmat_collapse_outcome result;
    double needed;
    status = qmat_decimation_test_sphere(s, sphere, QMAT_NONE, &result, &needed);
    if (status == QMAT_OK && result == QMAT_COLLAPSE_ALLOWED) {
      status = qmat_decimation_accept_alone(s, sphere);
      ++*moved;
    }
    if (status != QMAT_OK) return status;
  }
  s->moves += *moved;
  return QMAT_OK;
}

static void queue_all(qmat_decimation *s) {
  for (uint32_t e = 0; e < s->complex.edge_count; e++)
    if (s->complex.edge_alive[e] && s->heap.places[e] == QMAT_NONE) qmat_edge_heap_update(&s->heap, e);
}

qmat_status qmat_decimation_run(qmat_decimation *s) {
  if (s->rules.repairs) return qmat_decimation_repair(s);
  bool ended = s->threshold > s->rules.limit; /* even the lowest threshold exceeds the limit */
  qmat_status status = s->rules.neighbourhoods ? QMAT_OK : qmat_decimation_collapse_edges(s, &ended);
  if (status != QMAT_OK || ended || !(s->rules.limit < INFINITY)) return status;
  for (int i = 0; i < s->rules.refits && !ended; i++) {
    const size_t collapses = s->counts.collapses;
    size_t moved;
    s->fitting = true;
    if (i == 0) queue_all(s);
    status = qmat_decimation_collapse_edges(s, &ended);
    if (status != QMAT_OK || ended) return status;
    if ((i > 0 || s->rules.neighbourhoods) && s->counts.collapses == collapses) break;
    if ((status = refit(s, QMAT_FITTED_POINTS, &moved)) != QMAT_OK) return status;
  }
  /* The final refits lower the error itself. */
  size_t moved = s->rules.final_refit;
  for (int i = 0; i < s->rules.refits && moved > 0 && status == QMAT_OK; i++)
    status = refit(s, QMAT_FINAL_REFIT_POINTS, &moved);
  return status;
}
