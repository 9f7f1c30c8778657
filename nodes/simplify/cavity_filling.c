/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/cavity_filling.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/medial_build.h"
#include "core/geometry/medial_distance.h"
#include "nodes/measure/envelope_to_surface.h"
#include "nodes/simplify/thresholds.h"

/* Distances a new sphere may protrude, as shares of epsilon. The first with a cone within epsilon is used. */
static const double protruding_shares[] = {0.9, 0.6, 0.3, 0};
enum { SHARES = sizeof protruding_shares / sizeof *protruding_shares };

/* Cones to this many of the nearest spheres are tried. */
enum { MOST_NEIGHBOURS = 8 };

typedef struct {
  double depth;
  size_t place;
} cavity;

static int compare_depths(const void *a, const void *b) {
  const cavity *x = a, *y = b;
  if (x->depth != y->depth) return x->depth > y->depth ? -1 : 1;
  return x->place < y->place ? -1 : x->place > y->place;
}

/* The nearest spheres to a point, nearest first. */
static size_t find_nearest(const double *spheres, size_t count, const double *place,
                           uint32_t nearest[MOST_NEIGHBOURS]) {
  double distances[MOST_NEIGHBOURS];
  size_t found = 0;
  for (size_t i = 0; i < count; i++) {
    const double distance = qmat_sphere_distance(&spheres[4 * i], place);
    size_t at = found;
    while (at > 0 && distances[at - 1] > distance) at--;
    if (at == MOST_NEIGHBOURS) continue;
    if (found < MOST_NEIGHBOURS) found++;
    for (size_t k = found - 1; k > at; k--) {
      distances[k] = distances[k - 1];
      nearest[k] = nearest[k - 1];
    }
    distances[at] = distance;
    nearest[at] = (uint32_t)i;
  }
  return found;
}

static bool is_covered(const double *spheres, size_t count, const double *place) {
  for (size_t i = 0; i < count; i++)
    if (qmat_sphere_distance(&spheres[4 * i], place) < 0) return true;
  return false;
}

/* Finds the new sphere at a point and the sphere to join it to. False if no cone is within epsilon. */
static bool fit_sphere(const qmat_surface *surface, const double *spheres, size_t count, const double *place,
                       double depth, double epsilon, double sphere[4], uint32_t *neighbour) {
  uint32_t nearest[MOST_NEIGHBOURS];
  const size_t found = find_nearest(spheres, count, place, nearest);
  memcpy(sphere, place, 3 * sizeof *place);
  for (int p = 0; p < SHARES; p++) {
    sphere[3] = depth + protruding_shares[p] * epsilon;
    for (size_t n = 0; n < found; n++) {
      const double *const ends[2] = {sphere, &spheres[4 * (size_t)nearest[n]]};
      *neighbour = nearest[n];
      if (qmat_envelope_to_surface_bound(surface, ends, 2, qmat_least_reported * epsilon,
                                         qmat_error_tolerance * epsilon) <= epsilon)
        return true;
    }
  }
  return false;
}

/* Appends `more` spheres, each joined to one of the others. */
static qmat_status extend(qmat_context *context, qmat_medial *medial, const double *spheres, const uint32_t *neighbours,
                          size_t more) {
  const size_t before = medial->sphere_count, count = before + more;
  uint32_t *edges = qmat_arena_alloc(&context->arena, medial->edge_count + more, 2 * sizeof *edges);
  double *all = qmat_alloc(count, 4 * sizeof *all);
  const bool has_regions = medial->region_offsets != NULL;
  uint32_t *offsets = has_regions ? qmat_alloc(count + 1, sizeof *offsets) : NULL;
  if (!edges || !all || (has_regions && !offsets)) {
    qmat_free(all);
    qmat_free(offsets);
    return qmat_fail_memory(context, "the medial mesh");
  }
  if (medial->edge_count) memcpy(edges, medial->edges, 2 * medial->edge_count * sizeof *edges);
  for (size_t i = 0; i < more; i++) {
    edges[2 * (medial->edge_count + i)] = neighbours[i];
    edges[2 * (medial->edge_count + i) + 1] = (uint32_t)(before + i);
  }
  medial->sphere_count = count;
  const qmat_status status = qmat_medial_set_simplices(context, medial, edges, medial->edge_count + more,
                                                       medial->triangles, medial->triangle_count);
  if (status != QMAT_OK) {
    medial->sphere_count = before;
    qmat_free(all);
    qmat_free(offsets);
    return status;
  }
  memcpy(all, spheres, 4 * count * sizeof *all);
  qmat_free(medial->spheres);
  medial->spheres = all;
  if (!has_regions) return QMAT_OK;
  memcpy(offsets, medial->region_offsets, (before + 1) * sizeof *offsets);
  for (size_t i = before; i < count; i++) offsets[i + 1] = offsets[before];
  qmat_free(medial->region_offsets);
  medial->region_offsets = offsets;
  medial->region_offset_count = count + 1;
  return QMAT_OK;
}

qmat_status qmat_cavities_fill(qmat_context *context, const qmat_surface *surface, const double *places, size_t count,
                               double epsilon, qmat_medial *medial, size_t *added) {
  const size_t before = medial->sphere_count;
  *added = 0;
  cavity *cavities = qmat_arena_alloc(&context->arena, count, sizeof *cavities);
  double *spheres = qmat_arena_alloc(&context->arena, before + count, 4 * sizeof *spheres);
  uint32_t *neighbours = qmat_arena_alloc(&context->arena, count, sizeof *neighbours);
  if (!cavities || !spheres || !neighbours) return qmat_fail_memory(context, "the medial mesh");
  if (before) memcpy(spheres, medial->spheres, 4 * before * sizeof *spheres);
  for (size_t i = 0; i < count; i++) cavities[i] = (cavity){-qmat_surface_signed_distance(surface, &places[3 * i]), i};
  if (count) qsort(cavities, count, sizeof *cavities, compare_depths);
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < count && status == QMAT_OK; i++) {
    status = qmat_progress(context, i, count, "cavities");
    const double *place = &places[3 * cavities[i].place];
    double *sphere = &spheres[4 * (before + *added)];
    if (!(cavities[i].depth > 0) || is_covered(&spheres[4 * before], *added, place)) continue;
    if (fit_sphere(surface, spheres, before + *added, place, cavities[i].depth, epsilon, sphere, &neighbours[*added]))
      ++*added;
  }
  if (status == QMAT_OK && *added > 0) status = extend(context, medial, spheres, neighbours, *added);
  if (status != QMAT_OK) *added = 0;
  return status;
}
