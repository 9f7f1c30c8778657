/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/facet_relaxation.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "core/geometry/triangle.h"
#include "core/geometry/vector.h"
#include "core/hash.h"

#define MOST_SITES (QMAT_MOST_FACET_SAMPLES + 3)
/* A cell starts with three corners, and each bisector adds at most one. */
#define MOST_CELL_CORNERS (MOST_SITES + 3)

typedef struct flat_point {
  double x, y;
} flat_point;

/* The corners of a facet in its plane, scaled to a longest edge of 1: the first at the origin, the second on the x
 * axis, the third above it. */
static void flatten(const double *a, const double *b, const double *c, flat_point corners[3]) {
  double ab[3], ac[3], normal[3];
  qmat_subtract(b, a, ab);
  qmat_subtract(c, a, ac);
  const double base = sqrt(qmat_dot(ab, ab));
  const double longest = fmax(fmax(base, sqrt(qmat_dot(ac, ac))), qmat_point_distance(c, b));
  const double along = qmat_dot(ab, ac) / base;
  corners[0] = (flat_point){0, 0};
  corners[1] = (flat_point){base / longest, 0};
  corners[2] = (flat_point){along / longest, 2 * qmat_triangle_area(a, b, c, normal) / base / longest};
}

/* Clips a convex polygon to the points nearer to `site` than to `other`; returns the number of corners. `in` and `out`
 * must not overlap. */
static size_t clip_by_bisector(const flat_point *in, size_t count, flat_point site, flat_point other, flat_point *out) {
  const flat_point normal = {other.x - site.x, other.y - site.y};
  const flat_point middle = {0.5 * (other.x + site.x), 0.5 * (other.y + site.y)};
  size_t kept = 0;
  /* Rounding can make a polygon slightly concave, so that the line crosses it more than twice; the bound keeps the
   * array safe. */
  for (size_t i = 0; i < count && kept + 2 <= MOST_CELL_CORNERS; i++) {
    const flat_point p = in[i], q = in[i + 1 < count ? i + 1 : 0];
    const double s = (p.x - middle.x) * normal.x + (p.y - middle.y) * normal.y;
    const double t = (q.x - middle.x) * normal.x + (q.y - middle.y) * normal.y;
    if (s <= 0) out[kept++] = p;
    if ((s < 0 && t > 0) || (s > 0 && t < 0)) {
      const double cut = s / (s - t);
      out[kept++] = (flat_point){p.x + cut * (q.x - p.x), p.y + cut * (q.y - p.y)};
    }
  }
  return kept;
}

/* The squared distance from a point to the farthest corner. */
static double squared_reach(const flat_point *polygon, size_t count, flat_point from) {
  double reach = 0;
  for (size_t i = 0; i < count; i++) {
    const double x = polygon[i].x - from.x, y = polygon[i].y - from.y;
    reach = fmax(reach, x * x + y * y);
  }
  return reach;
}

/* The centroid of a polygon; `otherwise` if it has no area. */
static flat_point polygon_centroid(const flat_point *polygon, size_t count, flat_point otherwise) {
  double area = 0, x = 0, y = 0;
  for (size_t i = 1; i + 1 < count; i++) {
    const flat_point u = {polygon[i].x - polygon[0].x, polygon[i].y - polygon[0].y};
    const flat_point v = {polygon[i + 1].x - polygon[0].x, polygon[i + 1].y - polygon[0].y};
    const double part = u.x * v.y - u.y * v.x;
    area += part;
    x += part * (u.x + v.x);
    y += part * (u.y + v.y);
  }
  if (!(area > 0)) return otherwise;
  return (flat_point){polygon[0].x + x / (3 * area), polygon[0].y + y / (3 * area)};
}

/* The centroid of a site's Voronoi cell within the facet (Tournois et al. 2010). Sites 0 to 2 are the corners. */
static flat_point cell_centroid(const flat_point *sites, size_t count, size_t index) {
  flat_point polygons[2][MOST_CELL_CORNERS];
  memcpy(polygons[0], sites, 3 * sizeof *sites);
  const flat_point site = sites[index];
  int current = 0;
  size_t corners = 3;
  double reach = squared_reach(polygons[0], corners, site);
  for (size_t i = 0; i < count; i++) {
    const double x = sites[i].x - site.x, y = sites[i].y - site.y, square = x * x + y * y;
    /* Coincident sites have no bisector. A site twice as far as the farthest corner cannot clip the cell. */
    if (i == index || square == 0 || square >= 4 * reach) continue;
    corners = clip_by_bisector(polygons[current], corners, site, sites[i], polygons[1 - current]);
    current = 1 - current;
    reach = squared_reach(polygons[current], corners, site);
  }
  return polygon_centroid(polygons[current], corners, site);
}

void qmat_facet_relaxation(const double *a, const double *b, const double *c, qmat_facet_relaxation_seed seed,
                           int64_t rounds, size_t count, double *barycentrics) {
  if (count == 1) {
    for (int k = 0; k < 3; k++) barycentrics[k] = 1.0 / 3;
    return;
  }
  flat_point sites[2][MOST_SITES], corners[3];
  flatten(a, b, c, corners);
  memcpy(sites[0], corners, sizeof corners);
  memcpy(sites[1], corners, sizeof corners);
  for (size_t i = 0; i < count; i++) {
    /* The square root makes the distribution uniform over the triangle. */
    const double u = sqrt(qmat_hash_unit(qmat_hash3(seed.value, seed.facet, 2 * i)));
    const double v = qmat_hash_unit(qmat_hash3(seed.value, seed.facet, 2 * i + 1));
    sites[0][3 + i] = (flat_point){u * (1 - v) * corners[1].x + u * v * corners[2].x, u * v * corners[2].y};
  }
  int current = 0;
  for (int64_t round = 0; round < rounds; round++) {
    for (size_t i = 3; i < 3 + count; i++) sites[1 - current][i] = cell_centroid(sites[current], 3 + count, i);
    current = 1 - current;
  }
  for (size_t i = 0; i < count; i++) {
    const flat_point site = sites[current][3 + i];
    double *weights = barycentrics + 3 * i;
    weights[2] = fmin(fmax(site.y / corners[2].y, 0), 1);
    weights[1] = fmin(fmax((site.x - weights[2] * corners[2].x) / corners[1].x, 0), 1 - weights[2]);
    weights[0] = 1 - weights[2] - weights[1];
  }
}
