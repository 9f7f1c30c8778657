/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Algorithm 1: which tetrahedra give a medial vertex, and which sphere. */
#include "nodes/initial/medial_vertices.h"

#include <math.h>
#include <string.h>

#include "core/disjoint_sets.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector.h"
#include "nodes/initial/circumsphere.h"
#include "nodes/initial/sample_thinning.h"

/* The centre of the inscribed sphere: the corners weighted by the areas of the facets opposite them. */
static void incentre(const double *const p[4], double centre[3]) {
  double total = 0, sum[3] = {0, 0, 0};
  for (int k = 0; k < 4; k++) {
    const double *a = p[(k + 1) & 3], *b = p[(k + 2) & 3], *c = p[(k + 3) & 3];
    double ab[3], ac[3], n[3];
    qmat_subtract(b, a, ab);
    qmat_subtract(c, a, ac);
    qmat_cross(ab, ac, n);
    const double area = sqrt(qmat_dot(n, n));
    for (int i = 0; i < 3; i++) sum[i] += area * p[k][i];
    total += area;
  }
  for (int i = 0; i < 3; i++) centre[i] = total > 0 ? sum[i] / total : 0.25 * (p[0][i] + p[1][i] + p[2][i] + p[3][i]);
}

void qmat_medial_vertex_incentre(const qmat_dual_complex *d, size_t cell, double centre[3]) {
  const double *p[4];
  for (size_t k = 0; k < 4; k++) p[k] = &d->points[3 * (size_t)d->cells.corners[4 * cell + k]];
  incentre(p, centre);
}

static bool deep_inside(const qmat_surface *surface, const double *point) {
  return qmat_surface_inside(surface, point) &&
         !(qmat_surface_distance(surface, point, qmat_least_depth, NULL, NULL) <= qmat_least_depth);
}

double qmat_dual_edge_outside(const qmat_dual_complex *d, uint32_t a, uint32_t b, double least, double limit) {
  double middle[3];
  for (size_t k = 0; k < 3; k++) middle[k] = 0.5 * (d->points[3 * (size_t)a + k] + d->points[3 * (size_t)b + k]);
  const double distance = qmat_surface_distance(d->surface, middle, limit, NULL, NULL);
  return distance <= least || qmat_surface_inside(d->surface, middle) ? 0 : distance;
}

/* Whether a tetrahedron connects two solids through the outside. The incentre of such a needle can
 * still be inside, between the samples and a surface that bulges past them. */
static bool spans_gap(const qmat_dual_complex *d, const uint32_t *corners) {
  const double tolerance = d->thinning_tolerance;
  for (int a = 0; a < 3 && d->solids; a++)
    for (int b = a + 1; b < 4; b++)
      if (qmat_dual_solid_of_point(d, corners[a]) != qmat_dual_solid_of_point(d, corners[b]) &&
          qmat_dual_edge_outside(d, corners[a], corners[b], tolerance, tolerance) > 0)
        return true;
  return false;
}

/* Of the radius of a circumsphere: more than the rounding of one that is well conditioned. */
static const double rounding_of_radius = 1e-6;

/* Whether a computed circumsphere goes through all corners and is empty, as the exact one of a Delaunay tetrahedron
 * does and is. Where the corners are nearly on a circle, rounding puts the centre anywhere near the circle's axis, also
 * into another part of the solid. */
static bool is_delaunay_sphere(const qmat_dual_complex *d, size_t cell, const double sphere[4]) {
  const uint32_t *corners = &d->cells.corners[4 * cell];
  const double tolerance = rounding_of_radius * sphere[3];
  for (size_t k = 0; k < 4; k++) {
    if (fabs(qmat_point_distance(sphere, &d->points[3 * (size_t)corners[k]]) - sphere[3]) > tolerance) return false;
    const uint32_t next = d->cells.neighbours[4 * cell + k];
    for (size_t i = 0; next != QMAT_NO_TETRAHEDRON && i < 4; i++) {
      const uint32_t corner = d->cells.corners[4 * (size_t)next + i];
      if (corner == corners[0] || corner == corners[1] || corner == corners[2] || corner == corners[3]) continue;
      if (qmat_point_distance(sphere, &d->points[3 * (size_t)corner]) < sphere[3] - tolerance) return false;
    }
  }
  return true;
}

/* The least length of a surface sliver, in reaches of samples that represent others. Delaunay neighbours among the
 * samples that stay are at most two reaches apart, unless the samples of a narrow facet represent those of its
 * neighbours. */
static const double least_sliver_length = 6;

/* Whether a tetrahedron is a sliver on the surface: its corners are samples of a piece that is flat up to the thinning
 * tolerance, and one of its edges is long. The samples of a cylinder with many narrow facets make thousands, since
 * those of an edge that is not triangulated stick out of the facets between its neighbours. */
static bool is_surface_sliver(const qmat_dual_complex *d, const uint32_t *corners, const double *const p[4]) {
  const double *positions = qmat_surface_positions(d->surface);
  double normals[4][3], longest = 0;
  for (size_t a = 0; a < 4; a++)
    for (size_t b = 0; b < a; b++) longest = fmax(longest, qmat_point_distance(p[a], p[b]));
  if (longest < least_sliver_length * qmat_longest_reach) return false;
  for (size_t k = 0; k < 4; k++) {
    const uint32_t *ids = &d->mesh->triangles[3 * (size_t)d->facets[corners[k]]];
    (void)qmat_triangle_area(&positions[3 * (size_t)ids[0]], &positions[3 * (size_t)ids[1]],
                             &positions[3 * (size_t)ids[2]], normals[k]);
  }
  for (size_t a = 0; a < 4; a++)
    for (size_t b = 0; b < a; b++)
      if (!qmat_samples_are_level(p[a], normals[a], p[b], normals[b], d->thinning_tolerance)) return false;
  return true;
}

/* Algorithm 1 for one tetrahedron. With incentres "all" a tetrahedron belongs to the solid if its incentre is inside;
 * its medial vertex is still the circumcentre if that is inside too. */
static qmat_cell_kind select_medial_vertex(const qmat_dual_complex *d, size_t cell, double sphere[4]) {
  const uint32_t *corner = &d->cells.corners[4 * cell];
  const double *p[4];
  bool thin = true;
  for (int k = 0; k < 4; k++) {
    p[k] = &d->points[3 * (size_t)corner[k]];
    thin = thin && d->thin[corner[k]];
  }
  double centre[3];
  incentre(p, centre);
  const bool all = d->params->incentres == QMAT_INCENTRES_ALL;
  const bool in_solid = (all || thin) && deep_inside(d->surface, centre);
  if (all && (!in_solid || spans_gap(d, corner))) return QMAT_CELL_DROPPED;
  if (qmat_circumsphere(p, 0.5, sphere) && is_delaunay_sphere(d, cell, sphere)) {
    const double nearest = fmin(qmat_surface_distance(d->surface, sphere, sphere[3], NULL, NULL), sphere[3]);
    /* No surface comes between a circumcentre and an incentre that is nearer than the surface. */
    const bool is_beside = in_solid && qmat_point_distance(sphere, centre) < (1 - 1e-9) * nearest;
    if (nearest > qmat_least_depth && (is_beside || qmat_surface_inside(d->surface, sphere))) {
      if (d->params->radius == QMAT_RADIUS_DISTANCE) sphere[3] = nearest;
      return QMAT_CELL_CIRCUMCENTRE;
    }
  }
  if (!in_solid || is_surface_sliver(d, corner, p)) return QMAT_CELL_DROPPED;
  memcpy(sphere, centre, sizeof centre);
  sphere[3] = qmat_surface_distance(d->surface, centre, INFINITY, NULL, NULL);
  return QMAT_CELL_INCENTRE;
}

qmat_status qmat_medial_vertices_select(qmat_dual_complex *d) {
  qmat_context *context = d->context;
  const size_t count = d->cells.count, slice = 512; /* inside tests of an open surface are slow */
  d->kinds = qmat_arena_alloc(&context->arena, count, sizeof *d->kinds);
  d->spheres = qmat_arena_alloc(&context->arena, count, 4 * sizeof *d->spheres);
  if (!d->kinds || !d->spheres) return qmat_fail_memory(context, "medial vertices");
  qmat_status status = QMAT_OK;
  const int threads = qmat_threads(context);
  for (size_t first = 0; first < count && status == QMAT_OK; first += slice) {
    if ((status = qmat_progress(context, first, count, "tetrahedra")) != QMAT_OK) break;
    const size_t last = first + slice < count ? first + slice : count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 32)
    for (size_t cell = first; cell < last; cell++)
      d->kinds[cell] = (uint8_t)select_medial_vertex(d, cell, &d->spheres[4 * cell]);
  }
  return status;
}

/* Distances are between the first centres of the merged sets; a chain of close centres does not become one vertex. */
qmat_status qmat_medial_vertices_number(qmat_dual_complex *d) {
  const size_t count = d->cells.count;
  uint32_t *parent = qmat_sets_new(d->context, count);
  d->sphere_of = qmat_arena_alloc(&d->context->arena, count, sizeof *d->sphere_of);
  if (!parent || !d->sphere_of) return qmat_fail_memory(d->context, "medial vertices");
  for (size_t i = 0; i < count; i++) {
    if (!d->kinds[i]) continue;
    for (size_t k = 0; k < 4; k++) {
      const uint32_t j = d->cells.neighbours[4 * i + k];
      if (j == QMAT_NO_TETRAHEDRON || j < i || !d->kinds[j]) continue;
      const uint32_t a = qmat_set_leader(parent, (uint32_t)i), b = qmat_set_leader(parent, j);
      if (qmat_point_distance(&d->spheres[4 * (size_t)a], &d->spheres[4 * (size_t)b]) <= d->merge)
        qmat_sets_join(parent, a, b);
    }
  }
  uint32_t next = 0;
  for (size_t i = 0; i < count; i++) {
    d->sphere_of[i] = QMAT_NO_ID;
    if (!d->kinds[i]) continue;
    const uint32_t root = qmat_set_leader(parent, (uint32_t)i);
    d->sphere_of[i] = root == i ? next++ : d->sphere_of[root];
  }
  d->sphere_count = next;
  return QMAT_OK;
}
