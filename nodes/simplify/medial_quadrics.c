/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/medial_quadrics.h"

#include <math.h>

#include "core/geometry/triangle.h"
#include "core/geometry/vector.h"

/* The weight of the planes that keep rims and tips in place, as a share of the weight of a slab. */
static const double boundary_weight = 0.01;

double qmat_stability_ratio(const double a[4], const double b[4]) {
  const double length = qmat_point_distance(a, b);
  const double hyperbolic = length - fabs(a[3] - b[3]);
  return length > 0 && hyperbolic > 0 ? hyperbolic / length : 0;
}

/* Adds the tangent plane of a rim edge's cone on the side that faces away from `inner`, a corner of its triangle. */
static void add_rim(const qmat_complex *c, uint32_t edge, const double *inner, qmat_quadric *quadrics) {
  const uint32_t *ends = &c->edges[2 * (size_t)edge];
  const double *a = &c->spheres[4 * (size_t)ends[0]], *b = &c->spheres[4 * (size_t)ends[1]];
  const double length = qmat_point_distance(a, b), change = b[3] - a[3];
  if (!(length > fabs(change))) return;
  double axis[3], away[3], along = 0, size = 0, n[3];
  for (int k = 0; k < 3; k++) {
    axis[k] = (b[k] - a[k]) / length;
    away[k] = a[k] - inner[k];
    along += away[k] * axis[k];
  }
  for (int k = 0; k < 3; k++) {
    away[k] -= along * axis[k];
    size += away[k] * away[k];
  }
  if (!(size > 0)) return;
  const double cosine = -change / length, sine = sqrt(1 - cosine * cosine) / sqrt(size);
  for (int k = 0; k < 3; k++) n[k] = cosine * axis[k] + sine * away[k];
  const double gamma = qmat_stability_ratio(a, b), weight = boundary_weight * gamma * gamma;
  for (int e = 0; e < 2; e++) qmat_quadric_add_plane(&quadrics[ends[e]], n, e ? b : a, weight);
}

/* Adds the plane at the tip of a chain, perpendicular to its last cone. */
static void add_tip(const qmat_complex *c, uint32_t vertex, uint32_t edge, qmat_quadric *quadrics) {
  const double *tip = &c->spheres[4 * (size_t)vertex];
  const double *base = &c->spheres[4 * (size_t)qmat_complex_other_end(c, edge, vertex)];
  const double length = qmat_point_distance(tip, base);
  if (!(length > 0)) return;
  double n[3];
  for (int k = 0; k < 3; k++) n[k] = (tip[k] - base[k]) / length;
  const double gamma = qmat_stability_ratio(tip, base);
  qmat_quadric_add_plane(&quadrics[vertex], n, tip, boundary_weight * gamma * gamma);
}

/* Adds each slab to its corners, and each rim with the opposite corner of its triangle. */
static void add_slabs(const qmat_complex *c, qmat_quadric *quadrics,
                      void (*add_rim_of)(const qmat_complex *c, uint32_t edge, const double *inner,
                                         qmat_quadric *quadrics)) {
  for (size_t t = 0; t < c->triangle_count; t++) {
    const uint32_t *corners = &c->triangles[3 * t];
    const double *m[3];
    for (int k = 0; k < 3; k++) m[k] = &c->spheres[4 * (size_t)corners[k]];
    qmat_quadric slab = {.c = 0};
    if (qmat_quadric_add_slab(&slab, m[0], m[1], m[2], 1))
      for (int k = 0; k < 3; k++) qmat_quadric_add(&quadrics[corners[k]], &slab);
    for (int k = 0; k < 3; k++) {
      const uint32_t side = c->triangle_edges[3 * t + (size_t)k];
      if (c->edge_triangles[side] == 1) add_rim_of(c, side, m[k], quadrics);
    }
  }
}

void qmat_medial_quadrics_add(const qmat_complex *c, qmat_quadric *quadrics) {
  add_slabs(c, quadrics, add_rim);
  for (size_t e = 0; e < c->edge_count; e++) {
    if (c->edge_triangles[e]) continue;
    const uint32_t *ends = &c->edges[2 * e];
    qmat_quadric cone = {.c = 0};
    if (!qmat_quadric_add_cone(&cone, &c->spheres[4 * (size_t)ends[0]], &c->spheres[4 * (size_t)ends[1]], 2)) continue;
    for (int k = 0; k < 2; k++) qmat_quadric_add(&quadrics[ends[k]], &cone);
  }
  for (uint32_t v = 0; v < c->vertex_count; v++)
    if (c->vertex_edges.counts[v] == 1) add_tip(c, v, c->vertex_edges.items[c->vertex_edges.starts[v]], quadrics);
}

/* Adds the plane through a rim, perpendicular to its triangle; its normal `n` is as long as the rim. */
static void add_published_rim(const qmat_complex *c, uint32_t edge, const double *inner, qmat_quadric *quadrics) {
  const uint32_t *ends = &c->edges[2 * (size_t)edge];
  const double *a = &c->spheres[4 * (size_t)ends[0]], *b = &c->spheres[4 * (size_t)ends[1]];
  double normal[3], n[3], inwards = 0;
  if (!(qmat_triangle_area(a, b, inner, normal) > 0)) return;
  for (int k = 0; k < 3; k++) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    n[k] = normal[i] * (a[j] - b[j]) - normal[j] * (a[i] - b[i]);
    inwards += n[k] * (inner[k] - a[k]);
  }
  if (inwards > 0)
    for (int k = 0; k < 3; k++) n[k] = -n[k];
  const double gamma = qmat_stability_ratio(a, b), weight = boundary_weight * gamma * gamma;
  for (int e = 0; e < 2; e++) qmat_quadric_add_plane(&quadrics[ends[e]], n, e ? b : a, weight);
}

static void add_published_cone(const qmat_complex *c, uint32_t edge, qmat_quadric *quadrics) {
  const uint32_t *ends = &c->edges[2 * (size_t)edge];
  const double *m[2];
  double third[4], normals[2][3], along[3];
  for (int e = 0; e < 2; e++) m[e] = &c->spheres[4 * (size_t)ends[e]];
  for (int k = 0; k < 3; k++) {
    third[k] = m[0][k] + m[1][k];
    along[k] = m[0][k] - m[1][k];
  }
  third[3] = 0.5 * (m[0][3] + m[1][3]);
  if (!qmat_tangent_normals(m[0], m[1], third, normals)) return;
  for (int side = 0; side < 2; side++) {
    const double *n = normals[side];
    double across[3];
    for (int k = 0; k < 3; k++) across[k] = along[(k + 1) % 3] * n[(k + 2) % 3] - along[(k + 2) % 3] * n[(k + 1) % 3];
    for (int e = 0; e < 2; e++) {
      qmat_quadric_add_plane(&quadrics[ends[e]], n, m[e], 1);
      qmat_quadric_add_plane(&quadrics[ends[e]], across, m[e], 1);
    }
  }
}

static void add_published_tip(const qmat_complex *c, uint32_t vertex, uint32_t edge, qmat_quadric *quadrics) {
  const double *tip = &c->spheres[4 * (size_t)vertex];
  const double *base = &c->spheres[4 * (size_t)qmat_complex_other_end(c, edge, vertex)];
  double n[3];
  for (int k = 0; k < 3; k++) n[k] = tip[k] - base[k];
  const double gamma = qmat_stability_ratio(tip, base);
  qmat_quadric_add_plane(&quadrics[vertex], n, tip, boundary_weight * gamma * gamma);
}

void qmat_medial_quadrics_add_published(const qmat_complex *c, qmat_quadric *quadrics) {
  add_slabs(c, quadrics, add_published_rim);
  for (uint32_t e = 0; e < c->edge_count; e++)
    if (!c->edge_triangles[e]) add_published_cone(c, e, quadrics);
  for (uint32_t v = 0; v < c->vertex_count; v++)
    if (c->vertex_edges.counts[v] == 1)
      add_published_tip(c, v, c->vertex_edges.items[c->vertex_edges.starts[v]], quadrics);
}
