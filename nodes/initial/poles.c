/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/poles.h"

#include <string.h>

#include "core/disjoint_sets.h"
#include "nodes/initial/circumsphere.h"

static const size_t cells_per_report = 65536;

/* The Voronoi diagram of the points, and the two poles of each site as tetrahedra. */
typedef struct {
  qmat_context *context;
  const double *points;
  size_t site_count;
  const qmat_tetrahedra *cells;
  double *spheres;          /* 4 per tetrahedron; undefined without a leader */
  uint32_t *leaders;        /* per tetrahedron: the one that stands for its Voronoi vertex, or QMAT_NO_TETRAHEDRON */
  uint32_t *first, *second; /* per site: a leader, or QMAT_NO_TETRAHEDRON */
} voronoi_cells;

/* Circumcentres; those of neighbours that nearly coincide get one leader. */
static qmat_status find_vertices(voronoi_cells *v, double merge) {
  const size_t count = v->cells->count;
  qmat_arena *arena = &v->context->arena;
  v->spheres = qmat_arena_alloc(arena, count, 4 * sizeof *v->spheres);
  v->leaders = qmat_arena_alloc(arena, count, sizeof *v->leaders);
  uint8_t *flat = qmat_arena_alloc(arena, count, sizeof *flat);
  uint32_t *sets = qmat_sets_new(v->context, count);
  if (!v->spheres || !v->leaders || !flat || !sets) return qmat_fail_memory(v->context, "the Voronoi vertices");
  for (size_t i = 0; i < count; i++) {
    const uint32_t *corners = &v->cells->corners[4 * i];
    const double *p[4];
    for (int k = 0; k < 4; k++) p[k] = &v->points[3 * (size_t)corners[k]];
    flat[i] = !qmat_circumsphere(p, INFINITY, &v->spheres[4 * i]) || !(v->spheres[4 * i + 3] < INFINITY);
  }
  for (size_t i = 0; i < count; i++) {
    if (i % cells_per_report == 0) {
      const qmat_status status = qmat_progress(v->context, i, count, "Voronoi vertices");
      if (status != QMAT_OK) return status;
    }
    for (size_t k = 0; k < 4 && !flat[i]; k++) {
      const uint32_t j = v->cells->neighbours[4 * i + k];
      if (j == QMAT_NO_TETRAHEDRON || j < i || flat[j]) continue;
      const uint32_t a = qmat_set_leader(sets, (uint32_t)i), b = qmat_set_leader(sets, j);
      if (qmat_point_distance(&v->spheres[4 * (size_t)a], &v->spheres[4 * (size_t)b]) <= merge)
        qmat_sets_join(sets, a, b);
    }
  }
  for (size_t i = 0; i < count; i++) v->leaders[i] = flat[i] ? QMAT_NO_TETRAHEDRON : qmat_set_leader(sets, (uint32_t)i);
  return QMAT_OK;
}

/* Whether the Voronoi vertex `a` is farther from a site than `b`; a smaller id decides between equal ones. */
static bool is_farther(const voronoi_cells *v, const double *site, uint32_t a, uint32_t b) {
  if (b == QMAT_NO_TETRAHEDRON) return true;
  const double x = qmat_point_distance(site, &v->spheres[4 * (size_t)a]);
  const double y = qmat_point_distance(site, &v->spheres[4 * (size_t)b]);
  return x > y || (x == y && a < b);
}

/* The cosine of the angle at the site between two Voronoi vertices. */
static double cosine_at(const voronoi_cells *v, const double *site, uint32_t a, uint32_t b) {
  double to_a[3], to_b[3];
  qmat_subtract(&v->spheres[4 * (size_t)a], site, to_a);
  qmat_subtract(&v->spheres[4 * (size_t)b], site, to_b);
  const double lengths = sqrt(qmat_dot(to_a, to_a)) * sqrt(qmat_dot(to_b, to_b));
  return lengths > 0 ? qmat_dot(to_a, to_b) / lengths : 1;
}

/* The second pole is on the other side of the site; `feature_sizes` get the lower bounds that the sampling constant
 * gives. */
static void find_both(voronoi_cells *v, double sampling, double *feature_sizes) {
  const double near_the_surface = cos(2 * sampling);
  const size_t corners = 4 * v->cells->count;
  for (size_t i = 0; i < v->site_count; i++) v->first[i] = v->second[i] = QMAT_NO_TETRAHEDRON;
  for (size_t i = 0; i < corners; i++) {
    const uint32_t site = v->cells->corners[i], vertex = v->leaders[i / 4];
    if (site >= v->site_count || vertex == QMAT_NO_TETRAHEDRON) continue;
    if (is_farther(v, &v->points[3 * (size_t)site], vertex, v->first[site])) v->first[site] = vertex;
  }
  for (size_t i = 0; i < corners; i++) {
    const uint32_t site = v->cells->corners[i], vertex = v->leaders[i / 4];
    if (site >= v->site_count || vertex == QMAT_NO_TETRAHEDRON) continue;
    const double *at = &v->points[3 * (size_t)site];
    const double cosine = cosine_at(v, at, v->first[site], vertex);
    if (sampling < 1 && fabs(cosine) < near_the_surface) {
      const double length = qmat_point_distance(at, &v->spheres[4 * (size_t)vertex]);
      const double bound = length / sampling * (sqrt(1 - cosine * cosine) - sampling);
      if (bound > feature_sizes[site]) feature_sizes[site] = bound;
    }
    if (cosine <= 0 && is_farther(v, at, vertex, v->second[site])) v->second[site] = vertex;
  }
}

static void add_pole(const voronoi_cells *v, uint32_t vertex, uint32_t *ids, qmat_poles *poles) {
  if (ids[vertex] != QMAT_NO_POLE) return;
  memcpy(&poles->spheres[4 * poles->count], &v->spheres[4 * (size_t)vertex], 4 * sizeof *poles->spheres);
  ids[vertex] = (uint32_t)poles->count++;
}

/* Numbers the poles in the order of their sites, and pairs opposite ones. */
static void collect(const voronoi_cells *v, const double *feature_sizes, uint32_t *ids, qmat_poles *poles) {
  for (size_t i = 0; i < v->site_count; i++) {
    const uint32_t first = v->first[i], second = v->second[i];
    const double *site = &v->points[3 * i];
    if (first == QMAT_NO_TETRAHEDRON) continue;
    add_pole(v, first, ids, poles);
    if (second == QMAT_NO_TETRAHEDRON) continue;
    if (ids[second] == QMAT_NO_POLE && qmat_point_distance(site, &v->spheres[4 * (size_t)second]) < feature_sizes[i]) {
      poles->rejected++;
      continue;
    }
    add_pole(v, second, ids, poles);
    poles->pairs[2 * poles->pair_count] = ids[first];
    poles->pairs[2 * poles->pair_count + 1] = ids[second];
    poles->cosines[poles->pair_count++] = cosine_at(v, site, first, second);
  }
}

qmat_status qmat_poles_find(qmat_context *context, const double *points, size_t site_count,
                            const qmat_tetrahedra *cells, double sampling, double merge, qmat_poles *poles) {
  qmat_arena *arena = &context->arena;
  *poles = (qmat_poles){.spheres = qmat_arena_alloc(arena, 2 * site_count, 4 * sizeof *poles->spheres),
                        .at_box = qmat_arena_calloc(arena, 2 * site_count, sizeof *poles->at_box),
                        .of_cell = qmat_arena_alloc(arena, cells->count, sizeof *poles->of_cell),
                        .pairs = qmat_arena_alloc(arena, site_count, 2 * sizeof *poles->pairs),
                        .cosines = qmat_arena_alloc(arena, site_count, sizeof *poles->cosines)};
  voronoi_cells v = {.context = context,
                     .points = points,
                     .site_count = site_count,
                     .cells = cells,
                     .first = qmat_arena_alloc(arena, site_count, sizeof *v.first),
                     .second = qmat_arena_alloc(arena, site_count, sizeof *v.second)};
  double *feature_sizes = qmat_arena_calloc(arena, site_count, sizeof *feature_sizes);
  uint32_t *ids = qmat_arena_alloc(arena, cells->count, sizeof *ids); /* of the poles, per leader */
  if (!poles->spheres || !poles->at_box || !poles->of_cell || !poles->pairs || !poles->cosines || !v.first ||
      !v.second || !feature_sizes || !ids)
    return qmat_fail_memory(context, "the poles");
  const qmat_status status = find_vertices(&v, merge);
  if (status != QMAT_OK) return status;
  find_both(&v, sampling, feature_sizes);
  memset(ids, 0xff, cells->count * sizeof *ids);
  collect(&v, feature_sizes, ids, poles);
  for (size_t i = 0; i < cells->count; i++) {
    const uint32_t pole = v.leaders[i] == QMAT_NO_TETRAHEDRON ? QMAT_NO_POLE : ids[v.leaders[i]];
    poles->of_cell[i] = pole;
    if (pole == QMAT_NO_POLE) continue;
    for (size_t k = 0; k < 4; k++)
      if (cells->corners[4 * i + k] >= site_count) poles->at_box[pole] = 1;
  }
  return QMAT_OK;
}
