/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/point_repair.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "nodes/simplify/collapse_commit.h"
#include "nodes/simplify/fitted_collapse.h"

/* The number of the newest constraint point `i`: those on the surface first. */
static size_t newest_point(const qmat_decimation *s, size_t i) {
  return i < s->newest_surface_count ? s->constraints->surface_count - s->newest_surface_count + i
                                     : s->constraints->count - s->newest_inner_count + i - s->newest_surface_count;
}

/* Whether a point exceeds its limit, as far as the star of its witness shows. */
static qmat_status exceeds(qmat_decimation *s, size_t point, bool *answer) {
  const uint32_t owner = qmat_surface_to_envelope_owner(&s->surface_tracker, point);
  const double *sphere = &s->complex.spheres[4 * (size_t)owner];
  qmat_status status = qmat_complex_preview_move(s->context, &s->complex, owner, &s->collapse);
  if (status == QMAT_OK)
    status = qmat_surface_to_envelope_prepare(s->context, &s->surface_tracker, &s->complex, &s->collapse, sphere);
  if (status != QMAT_OK) return status;
  double foot[4], share;
  uint32_t nearest = QMAT_NONE;
  *answer = qmat_surface_to_envelope_star_foot(&s->surface_tracker, &s->complex, &s->collapse, sphere,
                                               &s->surface_tracker.points[3 * point], &nearest, foot,
                                               &share) > s->surface_tracker.limits[point];
  return QMAT_OK;
}

void qmat_failed_places_uninit(qmat_failed_places *failed) {
  qmat_free(failed->points);
  *failed = (qmat_failed_places){0};
}

static qmat_status add_failed(qmat_context *context, qmat_failed_places *failed, const double *point) {
  if (qmat_grow((void **)&failed->points, &failed->capacity, failed->count + 1, 3 * sizeof *failed->points))
    return qmat_fail_memory(context, "repairs");
  memcpy(&failed->points[3 * failed->count++], point, 3 * sizeof *point);
  return QMAT_OK;
}

/* Whether several places within epsilon of a point have failed. */
static bool is_near_failed(const qmat_decimation *s, const double *point) {
  const qmat_failed_places *failed = s->failed_places;
  int near = 0;
  for (size_t i = 0; i < failed->count && near < QMAT_MOST_FAILED_REPAIRS; i++)
    near += qmat_point_distance(&failed->points[3 * i], point) < s->threshold;
  return near == QMAT_MOST_FAILED_REPAIRS;
}

/* Tries the spheres of the witness alone, then each with its neighbours. */
static qmat_status repair_point(qmat_decimation *s, size_t point) {
  bool is_beyond;
  qmat_status status = exceeds(s, point, &is_beyond);
  const double *place = &s->surface_tracker.points[3 * point];
  if (status != QMAT_OK || !is_beyond || is_near_failed(s, place)) return status;
  uint32_t vertices[3];
  for (size_t k = 0; k < 3; k++) vertices[k] = s->surface_tracker.witnesses[3 * point + k];
  for (int i = 0; i < 6; i++) {
    const uint32_t vertex = vertices[i % 3];
    if (vertex == QMAT_NONE || qmat_crease_guard_is_feature(&s->creases, vertex) ||
        qmat_decimation_is_protected(s, vertex))
      continue;
    qmat_collapse_outcome result;
    status = qmat_decimation_try_move(s, vertex, point, i < 3, &result);
    if (status != QMAT_OK) return status;
    if (result == QMAT_COLLAPSE_ALLOWED) {
      s->moves++;
      return qmat_decimation_accept(s, s->neighbourhood.spheres[0]);
    }
  }
  return add_failed(s->context, s->failed_places, place);
}

qmat_status qmat_decimation_repair(qmat_decimation *s) {
  const size_t count = s->newest_surface_count + s->newest_inner_count;
  s->fitting = true;
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < count && status == QMAT_OK; i++) {
    status = qmat_progress(s->context, i, count, "repairs");
    if (status == QMAT_OK) status = repair_point(s, newest_point(s, i));
  }
  return status;
}

qmat_status qmat_decimation_drop_exceeded(qmat_decimation *s, qmat_constraint_points *constraints) {
  for (size_t i = 0; i < s->newest_surface_count + s->newest_inner_count; i++) {
    const size_t point = newest_point(s, i);
    bool is_beyond;
    const qmat_status status = exceeds(s, point, &is_beyond);
    if (status != QMAT_OK) return status;
    if (!is_beyond) continue;
    s->surface_tracker.limits[point] = INFINITY;
    if (i < s->newest_surface_count)
      constraints->distances[point] = INFINITY;
    else
      constraints->inner_limits[point - constraints->surface_count] = INFINITY;
  }
  return QMAT_OK;
}
