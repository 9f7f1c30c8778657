/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/neighbourhood_fit.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "nodes/simplify/fit_steps.h"

enum { VARIABLES = 4 * QMAT_NEIGHBOURHOOD_SPHERES };

/* A slab or loose cone of the neighbourhood, prepared with the spheres of the newest step, and a ball around it. */
typedef struct qmat_fit_primitive {
  uint32_t vertices[3]; /* the third QMAT_NONE: a cone */
  int moving[3];        /* the index of each corner in the fit, or -1 */
  qmat_primitive primitive;
  qmat_primitive_ball ball;
} fit_primitive;

typedef struct qmat_fit_target {
  double point[3];
  double slack; /* the largest allowed F minus `threshold`; for a border, `threshold` minus the allowed depth */
  qmat_target_kind kind;
  uint32_t nearest; /* the nearest primitive, of the newest step */
} fit_target;

void qmat_neighbourhood_fit_uninit(qmat_neighbourhood_fit *fit) {
  qmat_free(fit->primitives);
  qmat_free(fit->targets);
  *fit = (qmat_neighbourhood_fit){.count = 0};
}

static int moving_index(const qmat_neighbourhood_fit *fit, uint32_t vertex) {
  for (int i = 0; i < fit->count; i++)
    if (fit->vertices[i] == vertex) return i;
  return -1;
}

static bool has_corner(const fit_primitive *item, uint32_t vertex) {
  return item->vertices[0] == vertex || item->vertices[1] == vertex || item->vertices[2] == vertex;
}

/* Adds a simplex with its corners after the collapse, unless it degenerates or is part of an added one. */
static qmat_status add_primitive(qmat_context *context, qmat_neighbourhood_fit *fit, const qmat_collapse *collapse,
                                 const uint32_t *vertices, int count) {
  uint32_t corners[3] = {QMAT_NONE, QMAT_NONE, QMAT_NONE};
  for (int k = 0; k < count; k++) {
    corners[k] = vertices[k] == collapse->removed ? collapse->kept : vertices[k];
    for (int j = 0; j < k; j++)
      if (corners[j] == corners[k]) return QMAT_OK;
  }
  for (size_t i = 0; i < fit->primitive_count; i++) {
    int shared = 0;
    for (int k = 0; k < count; k++) shared += has_corner(&fit->primitives[i], corners[k]);
    if (shared == count) return QMAT_OK; /* the same, or an edge of a slab */
  }
  if (qmat_grow((void **)&fit->primitives, &fit->primitive_capacity, fit->primitive_count + 1, sizeof *fit->primitives))
    return qmat_fail_memory(context, "the fit of a neighbourhood");
  fit_primitive *item = &fit->primitives[fit->primitive_count++];
  for (int k = 0; k < 3; k++) {
    item->vertices[k] = corners[k];
    item->moving[k] = corners[k] == QMAT_NONE ? -1 : moving_index(fit, corners[k]);
  }
  return QMAT_OK;
}

static qmat_status add_star(qmat_context *context, qmat_neighbourhood_fit *fit, const qmat_complex *complex,
                            const qmat_collapse *collapse, uint32_t vertex, int corners) {
  size_t count;
  const uint32_t *at = corners == 3 ? qmat_complex_triangles_at(complex, vertex, &count)
                                    : qmat_complex_edges_at(complex, vertex, &count);
  const uint32_t *rows = corners == 3 ? complex->triangles : complex->edges;
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < count && status == QMAT_OK; i++)
    status = add_primitive(context, fit, collapse, &rows[(size_t)corners * at[i]], corners);
  return status;
}

qmat_status qmat_neighbourhood_fit_add(qmat_context *context, qmat_neighbourhood_fit *fit, const double *point,
                                       qmat_target_kind kind, double limit) {
  if (qmat_grow((void **)&fit->targets, &fit->target_capacity, fit->target_count + 1, sizeof *fit->targets))
    return qmat_fail_memory(context, "the fit of a neighbourhood");
  fit_target *target = &fit->targets[fit->target_count++];
  *target =
      (fit_target){.kind = kind, .slack = kind == QMAT_TARGET_BORDER ? fit->threshold - limit : limit - fit->threshold};
  memcpy(target->point, point, sizeof target->point);
  return QMAT_OK;
}

qmat_status qmat_neighbourhood_fit_start(qmat_context *context, qmat_neighbourhood_fit *fit,
                                         qmat_surface_to_envelope *tracker, const qmat_complex *complex,
                                         const qmat_collapse *collapse, const qmat_fit_request *request) {
  fit->threshold = request->threshold;
  fit->primitive_count = fit->target_count = 0;
  fit->worst = 0;
  fit->count = 1;
  fit->vertices[0] = collapse->kept;
  memcpy(fit->spheres[0], request->sphere, sizeof fit->spheres[0]);
  for (size_t i = 0; i < request->count && fit->count < QMAT_NEIGHBOURHOOD_SPHERES; i++) {
    fit->vertices[fit->count] = request->vertices[i];
    memcpy(fit->spheres[fit->count++], &complex->spheres[4 * (size_t)request->vertices[i]], 4 * sizeof(double));
  }
  qmat_status status = QMAT_OK;
  const int first_vertex = collapse->removed == QMAT_NONE ? 0 : -1;
  for (int corners = 3; corners >= 2; corners--)
    for (int i = first_vertex; i < fit->count && status == QMAT_OK; i++)
      status = add_star(context, fit, complex, collapse, i < 0 ? collapse->removed : fit->vertices[i], corners);
  size_t slots = first_vertex < 0 ? tracker->slot_counts[collapse->removed] : 0, first = 0;
  for (int i = 0; i < fit->count; i++) slots += tracker->slot_counts[fit->vertices[i]];
  const size_t stride = (slots + QMAT_FITTED_TARGETS - 1) / QMAT_FITTED_TARGETS;
  for (int i = first_vertex; i < fit->count && status == QMAT_OK; i++) {
    const uint32_t vertex = i < 0 ? collapse->removed : fit->vertices[i];
    const size_t length = tracker->slot_counts[vertex];
    const uint32_t *list;
    status = qmat_surface_to_envelope_slots(context, tracker, vertex, &list);
    size_t k = first;
    for (; k < length && status == QMAT_OK; k += stride) {
      const size_t point = list[k] / 3;
      if (point < request->surface_count &&
          qmat_surface_to_envelope_is_first(tracker, list[k], fit->vertices, fit->count) &&
          (first_vertex == 0 || qmat_surface_to_envelope_is_first(tracker, list[k], &collapse->removed, 1)))
        status = qmat_neighbourhood_fit_add(context, fit, &tracker->points[3 * point], QMAT_TARGET_SURFACE,
                                            tracker->limits[point]);
    }
    first = k - length;
  }
  return status;
}

static void prepare(qmat_neighbourhood_fit *fit, const qmat_complex *complex, double spheres[][4]) {
  for (size_t i = 0; i < fit->primitive_count; i++) {
    fit_primitive *item = &fit->primitives[i];
    const int corners = item->vertices[2] == QMAT_NONE ? 2 : 3;
    const double *at[3];
    for (int k = 0; k < corners; k++)
      at[k] = item->moving[k] >= 0 ? spheres[item->moving[k]] : &complex->spheres[4 * (size_t)item->vertices[k]];
    qmat_primitive_prepare(at, corners, &item->primitive, &item->ball);
  }
}

/* F at a target, and the weights of the corners of its nearest primitive. The search starts with the last one. */
static double find_foot(const qmat_neighbourhood_fit *fit, fit_target *target, double weights[3]) {
  uint32_t nearest = target->nearest;
  double best = qmat_primitive_foot(&fit->primitives[nearest].primitive, target->point, weights);
  for (uint32_t i = 0; i < fit->primitive_count; i++) {
    if (i == target->nearest) continue;
    const fit_primitive *item = &fit->primitives[i];
    double w[3];
    if (qmat_primitive_is_farther(&item->ball, target->point, best)) continue;
    const double f = qmat_primitive_foot_below(&item->primitive, target->point, best, w);
    if (!(f < best)) continue;
    best = f;
    nearest = i;
    memcpy(weights, w, sizeof w);
  }
  target->nearest = nearest;
  return best;
}

/* The error at a target with value F. It exceeds `threshold` in size where the target's condition fails. */
static double error_at(const fit_target *target, double f) {
  switch (target->kind) {
    case QMAT_TARGET_INSIDE:
      return qmat_larger(0, f - target->slack);
    case QMAT_TARGET_BORDER:
      return qmat_smaller(0, f - target->slack);
    default:
      return f > 0 ? qmat_larger(0, f - target->slack) : f;
  }
}

/* The normal equations of a step: symmetric, the lower triangle. */
typedef struct {
  double a[VARIABLES][VARIABLES], b[VARIABLES];
  int count;
} equations;

/* Adds weight times the square of the linearised error of a target. */
static void add_target(const qmat_neighbourhood_fit *fit, const qmat_complex *complex, double spheres[][4],
                       const fit_target *target, const double weights[3], double error, double weight, equations *e) {
  const fit_primitive *item = &fit->primitives[target->nearest];
  double foot[3] = {0, 0, 0}, row[12];
  int columns[12], count = 0;
  for (int k = 0; k < 3 && item->vertices[k] != QMAT_NONE; k++) {
    const double *at =
        item->moving[k] >= 0 ? spheres[item->moving[k]] : &complex->spheres[4 * (size_t)item->vertices[k]];
    for (int i = 0; i < 3; i++) foot[i] += weights[k] * at[i];
  }
  const double length = qmat_point_distance(target->point, foot);
  if (!(length > 0)) return;
  for (int k = 0; k < 3; k++) {
    if (item->moving[k] < 0 || !(weights[k] > 0)) continue;
    for (int i = 0; i < (fit->keeps_radii ? 3 : 4); i++) {
      columns[count] = 4 * item->moving[k] + i;
      row[count++] = i < 3 ? -weights[k] * (target->point[i] - foot[i]) / length : -weights[k];
    }
  }
  for (int i = 0; i < count; i++) {
    e->b[columns[i]] -= weight * error * row[i];
    for (int j = 0; j < count; j++)
      if (columns[j] <= columns[i]) e->a[columns[i]][columns[j]] += weight * row[i] * row[j];
  }
}

/* Solves by LDL'; b becomes the solution. */
static bool solve(equations *e) {
  const int n = e->count;
  double trace = 0;
  for (int i = 0; i < n; i++) trace += e->a[i][i];
  if (!(trace > 0)) return false;
  for (int i = 0; i < n; i++) e->a[i][i] += qmat_fit_damping * trace / n;
  for (int j = 0; j < n; j++) {
    double scaled[VARIABLES];
    for (int k = 0; k < j; k++) scaled[k] = e->a[j][k] * e->a[k][k];
    for (int i = j; i < n; i++) {
      double sum = e->a[i][j];
      for (int k = 0; k < j; k++) sum -= e->a[i][k] * scaled[k];
      e->a[i][j] = i == j ? sum : sum / e->a[j][j];
    }
    if (!(e->a[j][j] > 0)) return false;
  }
  for (int i = 0; i < n; i++)
    for (int k = 0; k < i; k++) e->b[i] -= e->a[i][k] * e->b[k];
  for (int i = 0; i < n; i++) e->b[i] /= e->a[i][i];
  for (int i = n - 1; i >= 0; i--)
    for (int k = i + 1; k < n; k++) e->b[i] -= e->a[k][i] * e->b[k];
  return true;
}

/* The first step of a fit that goes on with further targets. */
enum { FIRST_STEP_AGAIN = 1 };

/* A fit ends early when its error exceeds this multiple of the threshold after this many steps. */
enum { EARLY_EXIT_STEP = 3 };
static const double early_exit_ratio = 2;

void qmat_neighbourhood_fit_run(qmat_neighbourhood_fit *fit, const qmat_complex *complex, bool again, double *error) {
  double current[QMAT_NEIGHBOURHOOD_SPHERES][4];
  equations e;
  const size_t bytes = (size_t)fit->count * sizeof *current;
  memcpy(current, fit->spheres, bytes);
  *error = INFINITY;
  for (int step = again ? FIRST_STEP_AGAIN : 0; fit->primitive_count > 0; step++) {
    prepare(fit, complex, current);
    e.count = 4 * fit->count;
    for (int i = 0; i < e.count; i++) {
      memset(e.a[i], 0, (size_t)e.count * sizeof e.a[i][0]);
      e.b[i] = 0;
    }
    const double last_worst = fit->worst;
    double worst = 0;
    for (size_t i = 0; i < fit->target_count; i++) {
      fit_target *target = &fit->targets[i];
      double weights[3];
      const double wrong = error_at(target, find_foot(fit, target, weights));
      worst = qmat_larger(worst, fabs(wrong));
      if (step == QMAT_FIT_STEPS || wrong == 0) continue;
      const double weight = qmat_fit_weight(last_worst > 0 ? wrong / last_worst : 1, step);
      add_target(fit, complex, current, target, weights, wrong, weight, &e);
    }
    fit->worst = worst;
    if (worst < *error) {
      *error = worst;
      memcpy(fit->spheres, current, bytes);
    }
    if (step == QMAT_FIT_STEPS || (step >= EARLY_EXIT_STEP && *error > early_exit_ratio * fit->threshold) || !solve(&e))
      return;
    for (int i = 0; i < fit->count; i++) {
      for (int k = 0; k < 4; k++) current[i][k] += qmat_fit_step_share(step) * e.b[4 * i + k];
      if (!fit->keeps_radii && !(current[i][3] > 0)) return;
    }
  }
}
