/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/page/worst_places.h"

#include <math.h>
#include <string.h>

#include "nodes/measure/boundary_distance.h"
#include "nodes/measure/hausdorff_bound.h"

/* Places are looked for from this share of the error that is known to be attained. */
static const double share = 0.98;
static const double tolerance = 0.05;
/* Errors below this are rounding. */
static const double least_error = 1e-6;
/* Points no deeper in the envelope than this are on its boundary. */
static const double rounding = 1e-9;
/* Without a known error the envelope's samples give one. */
enum { SAMPLES = 20000 };

static void take(const double at[3], double error, qmat_worst_place *worst) {
  if (!(error > worst->error)) return; /* the first of equal ones stays */
  memcpy(worst->at, at, sizeof worst->at);
  worst->error = error;
}

static qmat_status find_on_surface(qmat_context *context, const qmat_shown *shown, const qmat_surface *surface,
                                   double known, qmat_worst_place *worst) {
  qmat_hausdorff_bound bound;
  const double from = fmax(share * known, least_error);
  const qmat_status status = qmat_hausdorff_bound_measure(context, surface, shown->envelope, from,
                                                          tolerance * shown->range, from, -INFINITY, &bound);
  for (size_t i = 0; status == QMAT_OK && i < bound.count; i++)
    take(&bound.points[3 * i], qmat_envelope_distance(shown->envelope, &bound.points[3 * i], NULL), worst);
  for (size_t i = 0; status == QMAT_OK && i < shown->display.vertex_count; i++)
    if (shown->display.errors[i] > least_error) take(&shown->display.positions[3 * i], shown->display.errors[i], worst);
  return status;
}

static qmat_status find_on_envelope(qmat_context *context, const qmat_shown *shown, const qmat_surface *surface,
                                    double known, qmat_worst_place *worst) {
  qmat_boundary_distance boundary;
  const double from = fmax(known > 0 ? share * known : 0.5 * shown->range, 10 * least_error);
  const qmat_status status = qmat_boundary_distance_measure(
      context, surface, shown->envelope, &shown->unit,
      &(qmat_boundary_request){.epsilon = from, .tolerance = tolerance, .sample_count = SAMPLES}, &boundary);
  for (size_t i = 0; status == QMAT_OK && i < boundary.far_count; i++) {
    const double *at = &boundary.far_points[3 * i];
    if (qmat_envelope_holds(shown->envelope, at, rounding)) continue;
    take(at, qmat_surface_distance(surface, at, INFINITY, NULL, NULL), worst);
  }
  qmat_boundary_distance_uninit(&boundary);
  return status;
}

qmat_status qmat_worst_places_find(qmat_context *context, const qmat_shown *shown, double out, double in,
                                   qmat_worst_place *of_surface, qmat_worst_place *of_envelope) {
  *of_surface = *of_envelope = (qmat_worst_place){.error = 0};
  qmat_surface *surface;
  qmat_status status = qmat_surface_new(context, shown->mesh, &surface);
  if (status != QMAT_OK) return status;
  status = find_on_surface(context, shown, surface, out > 0 ? out : 0, of_surface);
  if (status == QMAT_OK) status = find_on_envelope(context, shown, surface, in > 0 ? in : 0, of_envelope);
  qmat_surface_free(surface);
  return status;
}
