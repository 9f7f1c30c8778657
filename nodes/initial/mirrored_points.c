/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/mirrored_points.h"

#include <math.h>
#include <string.h>

#include "core/geometry/point_grid.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector.h"
#include "core/geometry/vertex_facets.h"

/* Walls are thin, and gaps narrow, up to these shares of the distance between samples. */
static const double wall_share = 0.25, gap_share = 0.5;

/* A point is not added within this share of the width around a sample. */
static const double near_share = 0.25;

/* Normals with a larger cosine are one normal. */
static const double same_normal = 0.98;

/* The least cosine between a ray along a normal and the normal of the facet that it hits. Rays along the mean of
 * normals have none: in a narrow spike they meet the other side at any angle. */
static const double facing = 0.5;

/* Rays start this far (unit frame) beside their sample, where that lies on the side of a facet. What is narrower has no
 * inside that could be told from its surface. */
static const double inset = 1e-6;

/* Normals of a sample (with the mean one more), and walls and gaps that a ray crosses one after the other. */
enum { MOST_NORMALS = 7, MOST_LAYERS = 16, SAMPLES_A_SLICE = 256 };

/* Where a ray from a sample leaves the solid, or enters it again; `width` is that of the wall or gap before it. */
typedef struct crossing {
  double point[3], width;
  uint32_t facet;
} crossing;

/* Those of a sample. */
typedef struct crossings {
  size_t count;
  crossing items[2 * MOST_LAYERS * (MOST_NORMALS + 1)];
} crossings;

typedef struct mirror {
  const qmat_surface *surface;
  const qmat_mesh *mesh;
  const qmat_samples *samples;
  const double *points; /* 3 per sample */
  const uint32_t *representatives;
  qmat_vertex_facets around;
  double *apart; /* per facet: the distance between samples */
} mirror;

/* The different normals of the facets of a sample. */
typedef struct sample_normals {
  size_t count;
  double items[MOST_NORMALS][3];
  double inside[MOST_NORMALS][3]; /* towards the middle of a facet with this normal, no longer than `inset` */
  double apart;                   /* the largest distance between samples of the facets */
} sample_normals;

static qmat_status find_distances_between_samples(qmat_context *context, mirror *m, double closest) {
  const qmat_mesh *mesh = m->mesh;
  const double *positions = qmat_surface_positions(m->surface);
  uint32_t *added = qmat_arena_calloc(&context->arena, mesh->triangle_count, sizeof *added);
  m->apart = qmat_arena_alloc(&context->arena, mesh->triangle_count, sizeof *m->apart);
  if (!added || !m->apart) return qmat_fail_memory(context, "the distances between samples");
  for (size_t i = m->samples->vertex_count; i < m->samples->count; i++)
    if (m->samples->facets[i] < mesh->triangle_count) added[m->samples->facets[i]]++;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const double *corners[3];
    for (size_t k = 0; k < 3; k++) corners[k] = &positions[3 * (size_t)mesh->triangles[3 * t + k]];
    const qmat_longest_side longest = qmat_triangle_longest_side(corners[0], corners[1], corners[2]);
    double normal[3], apart = longest.length;
    const double area = qmat_triangle_area(corners[0], corners[1], corners[2], normal);
    if (added[t] > 0) apart = qmat_smaller(apart, sqrt(2 * area / added[t]));
    m->apart[t] = qmat_larger(apart, closest);
  }
  return QMAT_OK;
}

static void add_normal(const mirror *m, const double *point, uint32_t facet, sample_normals *n) {
  const double *positions = qmat_surface_positions(m->surface), *corners[3];
  for (size_t k = 0; k < 3; k++) corners[k] = &positions[3 * (size_t)m->mesh->triangles[3 * (size_t)facet + k]];
  double normal[3], *inside = n->inside[n->count];
  if (n->count == MOST_NORMALS || !(qmat_triangle_area(corners[0], corners[1], corners[2], normal) > 0)) return;
  n->apart = qmat_larger(n->apart, m->apart[facet]);
  for (size_t i = 0; i < n->count; i++)
    if (qmat_dot(n->items[i], normal) > same_normal) return;
  for (size_t k = 0; k < 3; k++) inside[k] = (corners[0][k] + corners[1][k] + corners[2][k]) / 3 - point[k];
  const double scale = inset / qmat_larger(sqrt(qmat_dot(inside, inside)), inset);
  for (size_t k = 0; k < 3; k++) inside[k] *= scale;
  memcpy(n->items[n->count++], normal, sizeof normal);
}

/* The facets of a sample are those around its vertex, those with the side on which it lies, or the one around it. */
static void find_normals(const mirror *m, size_t sample, sample_normals *n) {
  const uint32_t facet = m->samples->facets[sample], *ids = &m->mesh->triangles[3 * (size_t)facet];
  const double *weights = &m->samples->barycentrics[3 * sample], *point = &m->points[3 * sample];
  const uint32_t *facets = m->around.facets;
  const size_t *offsets = m->around.offsets;
  n->count = 0;
  n->apart = 0;
  if (sample < m->samples->vertex_count) {
    for (size_t i = offsets[sample]; i < offsets[sample + 1]; i++) add_normal(m, point, facets[i], n);
    return;
  }
  add_normal(m, point, facet, n);
  for (size_t k = 0; k < 3; k++) {
    if (weights[k] > 0) continue;
    const uint32_t a = ids[(k + 1) % 3], b = ids[(k + 2) % 3];
    for (size_t i = offsets[a]; i < offsets[a + 1]; i++) {
      const uint32_t *other = &m->mesh->triangles[3 * (size_t)facets[i]];
      if (other[0] == b || other[1] == b || other[2] == b) add_normal(m, point, facets[i], n);
    }
  }
}

/* Follows a ray from `beside` the sample through walls and gaps, as long as they are thin. */
static void follow(const mirror *m, const double *sample, const double beside[3], const double direction[3],
                   bool inside, double apart, double least_cosine, crossings *found) {
  double length = 0;
  for (int layer = 0; layer < MOST_LAYERS; layer++, inside = !inside) {
    crossing *c = &found->items[found->count];
    double origin[3], normal[3];
    for (size_t k = 0; k < 3; k++) origin[k] = sample[k] + beside[k] + length * direction[k];
    const double widest = (inside ? wall_share : gap_share) * apart;
    if (!qmat_surface_cast(m->surface, origin, direction, inset, widest, &c->width, &c->facet, normal)) return;
    if (!((inside ? 1 : -1) * qmat_dot(direction, normal) > least_cosine)) return;
    length += c->width;
    for (size_t k = 0; k < 3; k++) c->point[k] = sample[k] + length * direction[k];
    found->count++;
  }
}

/* Casts rays against the normal through the solid, and along it through what is outside. */
static void cross(const mirror *m, const double *sample, const double beside[3], const double normal[3], double apart,
                  double least_cosine, crossings *found) {
  const double against[3] = {-normal[0], -normal[1], -normal[2]};
  follow(m, sample, beside, against, true, apart, least_cosine, found);
  follow(m, sample, beside, normal, false, apart, least_cosine, found);
}

static void find_crossings(const mirror *m, size_t sample, crossings *found) {
  found->count = 0;
  if (m->representatives[sample] != sample || m->samples->facets[sample] >= m->mesh->triangle_count) return;
  const double *point = &m->points[3 * sample];
  double mean[3] = {0, 0, 0};
  sample_normals n;
  find_normals(m, sample, &n);
  for (size_t i = 0; i < n.count; i++) {
    cross(m, point, n.inside[i], n.items[i], n.apart, facing, found);
    for (size_t k = 0; k < 3; k++) mean[k] += n.items[i][k];
  }
  const double length = sqrt(qmat_dot(mean, mean));
  if (n.count < 2 || !(length > inset)) return;
  for (size_t k = 0; k < 3; k++) mean[k] /= length;
  cross(m, point, (const double[3]){0, 0, 0}, mean, n.apart, 0, found);
}

/* Makes room for one more point. */
static qmat_status reserve(qmat_context *context, qmat_mirrored_points *mirrored, size_t *room) {
  size_t of_facets = *room, needed = mirrored->count + 1;
  const int bad = qmat_arena_grow(&context->arena, (void **)&mirrored->facets, &of_facets, needed, sizeof(uint32_t)) ||
                  qmat_arena_grow(&context->arena, (void **)&mirrored->points, room, needed, 3 * sizeof(double));
  return bad ? qmat_fail_memory(context, "mirrored points") : QMAT_OK;
}

/* Adds the crossings of a sample that lie near no sample and no other one of them. */
static qmat_status add_crossings(qmat_context *context, const qmat_point_grid *known, const crossings *found,
                                 qmat_mirrored_points *mirrored, size_t *room) {
  const size_t first = mirrored->count;
  for (size_t i = 0; i < found->count; i++) {
    const crossing *c = &found->items[i];
    const double near = qmat_larger(near_share * c->width, 2 * inset);
    bool is_near = qmat_point_grid_has_within(known, c->point, near);
    for (size_t k = first; k < mirrored->count && !is_near; k++)
      is_near = qmat_point_distance(&mirrored->points[3 * k], c->point) <= near;
    if (is_near) continue;
    const qmat_status status = reserve(context, mirrored, room);
    if (status != QMAT_OK) return status;
    memcpy(&mirrored->points[3 * mirrored->count], c->point, sizeof c->point);
    mirrored->facets[mirrored->count++] = c->facet;
  }
  return QMAT_OK;
}

/* The samples that are triangulated. */
static qmat_status find_known(qmat_context *context, const mirror *m, qmat_point_grid *known) {
  double *points = qmat_arena_alloc(&context->arena, m->samples->count, 3 * sizeof *points);
  if (!points) return qmat_fail_memory(context, "samples");
  size_t count = 0;
  for (size_t i = 0; i < m->samples->count; i++)
    if (m->representatives[i] == i) memcpy(&points[3 * count++], &m->points[3 * i], 3 * sizeof *points);
  return qmat_point_grid_init(context, points, count, known);
}

qmat_status qmat_mirrored_points_find(qmat_context *context, const qmat_surface *surface, const qmat_samples *samples,
                                      const double *points, const uint32_t *representatives, double closest,
                                      qmat_mirrored_points *mirrored) {
  mirror m = {surface, qmat_surface_mesh(surface), samples, points, representatives, {NULL, NULL}, NULL};
  *mirrored = (qmat_mirrored_points){.count = 0};
  qmat_point_grid known;
  qmat_status status = find_known(context, &m, &known);
  if (status == QMAT_OK) status = qmat_vertex_facets_find(context, m.mesh, &m.around);
  if (status == QMAT_OK) status = find_distances_between_samples(context, &m, closest);
  if (status != QMAT_OK) return status;
  const size_t slice = samples->count < SAMPLES_A_SLICE ? samples->count : SAMPLES_A_SLICE;
  crossings *found = qmat_arena_alloc(&context->arena, slice, sizeof *found);
  if (!found) return qmat_fail_memory(context, "mirrored points");
  const int threads = qmat_threads(context);
  size_t room = 0;
  for (size_t first = 0; first < samples->count; first += slice) {
    const size_t left = samples->count - first, count = left < slice ? left : slice;
    if ((status = qmat_progress(context, first, samples->count, "samples")) != QMAT_OK) return status;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 64)
    for (size_t i = 0; i < count; i++) find_crossings(&m, first + i, &found[i]);
    for (size_t i = 0; i < count && status == QMAT_OK; i++)
      status = add_crossings(context, &known, &found[i], mirrored, &room);
  }
  return status;
}
