/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/hull_outside.h"

#include <math.h>
#include <string.h>

#include "core/geometry/convex_polygon.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector.h"

/* Facets between two looks whether the run is cancelled; the most corners of a triangle that was cut three times. */
enum { SLICE = 4096, MOST_CORNERS = 9 };

/* A point is over a triangle where it is inside of the planes through its sides by more than this. */
static const double rounding = 1e-9;

/* The largest distance outside of a solid over triangles. A search ends where it exceeds the limit. It misses distances
 * that are below `least`, or above what is found by at most `slack`, or by at most the reach of triangles that are not
 * divided. */
typedef struct search {
  const qmat_surface *solid;
  double limit, least, slack, reach;
  double found;
} search;

static void search_triangle(search *s, double corners[3][3], int halvings);

typedef struct plane {
  double normal[3], offset;
} plane;

static double height(const plane *p, const double *point) {
  return qmat_dot(p->normal, point) - p->offset;
}

/* The planes at right angles to a triangle of the solid through its sides, which look away from it, and its own plane.
 * False where it has no area. */
static bool make_planes(const qmat_surface *solid, uint32_t triangle, plane sides[3], plane *own) {
  const double *positions = qmat_surface_positions(solid), *corners[3];
  const uint32_t *ids = &qmat_surface_mesh(solid)->triangles[3 * (size_t)triangle];
  double along[3][3];
  for (int i = 0; i < 3; i++) corners[i] = &positions[3 * (size_t)ids[i]];
  for (int i = 0; i < 3; i++) qmat_subtract(corners[(i + 1) % 3], corners[i], along[i]);
  qmat_cross(along[0], along[1], own->normal);
  if (!(qmat_dot(own->normal, own->normal) > 0)) return false;
  qmat_normalize(own->normal);
  own->offset = qmat_dot(own->normal, corners[0]);
  for (int i = 0; i < 3; i++) {
    qmat_cross(along[i], own->normal, sides[i].normal);
    qmat_normalize(sides[i].normal);
    sides[i].offset = qmat_dot(sides[i].normal, corners[i]);
  }
  return true;
}

/* Searches what of a piece of a facet is not over the triangle of the solid that is nearest to its centre, if what is
 * over it is at most `enough` from it: a point over a triangle is as far from it as from its plane. Otherwise, and
 * where the centre is not over it, this does nothing and returns false. */
static bool search_around(search *s, double corners[3][3], const double centre[3], uint32_t nearest, double enough,
                          int halvings) {
  plane sides[3], own;
  double over[MOST_CORNERS][3], around[3][MOST_CORNERS][3];
  int count = 3, counts[3];
  if (!make_planes(s->solid, nearest, sides, &own)) return false;
  for (int i = 0; i < 3; i++)
    if (height(&sides[i], centre) > -rounding) return false;
  memcpy(over, corners, 3 * sizeof over[0]);
  for (int i = 0; i < 3; i++) {
    double rest[MOST_CORNERS][3], inward[MOST_CORNERS], outward[MOST_CORNERS];
    for (int k = 0; k < count; k++) inward[k] = -(outward[k] = height(&sides[i], over[k]));
    counts[i] = qmat_convex_polygon_cut(over, inward, count, around[i]);
    count = qmat_convex_polygon_cut(over, outward, count, rest);
    memcpy(over, rest, sizeof over);
  }
  for (int i = 0; i < count; i++)
    if (fabs(height(&own, over[i])) > enough) return false;
  for (int i = 0; i < 3; i++)
    for (int k = 2; k < counts[i] && !(s->found > s->limit); k++) {
      double piece[3][3];
      memcpy(piece[0], around[i][0], sizeof piece[0]);
      memcpy(piece[1], around[i][k - 1], sizeof piece[1]);
      memcpy(piece[2], around[i][k], sizeof piece[2]);
      search_triangle(s, piece, halvings);
    }
  return true;
}

static void search_triangle(search *s, double corners[3][3], int halvings) {
  double centre[3], reach = 0, to_triangle = 0;
  uint32_t nearest;
  for (int k = 0; k < 3; k++) centre[k] = (corners[0][k] + corners[1][k] + corners[2][k]) / 3;
  const double distance = qmat_surface_distance(s->solid, centre, INFINITY, NULL, &nearest);
  for (int i = 0; i < 3; i++) {
    reach = fmax(reach, qmat_point_distance(corners[i], centre));
    to_triangle = fmax(to_triangle, qmat_surface_distance_to_triangle(s->solid, corners[i], nearest));
  }
  double bound = fmin(to_triangle, distance + reach);
  if (distance > s->found) {
    if (qmat_surface_inside(s->solid, centre))
      bound = fmin(bound, reach - distance);
    else
      s->found = distance;
  }
  const double enough = fmax(s->found + s->slack, s->least);
  if (s->found > s->limit || halvings == 0 || reach <= s->reach || bound <= enough) return;
  if (search_around(s, corners, centre, nearest, enough, halvings)) return;
  double low[3][3], high[3][3];
  qmat_triangle_halve(corners[0], low[0], high[0]);
  search_triangle(s, low, halvings - 1);
  if (!(s->found > s->limit)) search_triangle(s, high, halvings - 1);
}

static void get_corners(const double *points, const uint32_t *ids, double corners[3][3]) {
  for (int i = 0; i < 3; i++) memcpy(corners[i], &points[3 * (size_t)ids[i]], sizeof corners[i]);
}

double qmat_joint_protrusion(const qmat_surface *solid, const double *points, size_t first, const uint32_t *triangles,
                             size_t triangle_count, double limit, int halvings) {
  search s = {.solid = solid, .limit = limit, .least = 0.5 * limit, .reach = 0.5 * limit};
  for (size_t t = 0; t < triangle_count && !(s.found > limit); t++) {
    const uint32_t *ids = &triangles[3 * t];
    double corners[3][3];
    int of_first = 0;
    for (int i = 0; i < 3; i++) of_first += ids[i] < first;
    get_corners(points, ids, corners);
    if (of_first % 3 != 0) search_triangle(&s, corners, halvings);
  }
  return s.found;
}

qmat_status qmat_hulls_protrusion(qmat_context *context, const qmat_surface *solid, const qmat_colliders *colliders,
                                  double *bound) {
  const int threads = qmat_threads(context);
  const size_t count = colliders->point_count;
  double *points = qmat_arena_alloc(&context->arena, count, 3 * sizeof *points), of_points = 0;
  if (!points) return qmat_fail_memory(context, "points of hulls");
  qmat_frame_to_unit(qmat_surface_frame(solid), colliders->points, count, points);
  for (size_t first = 0; first < count; first += SLICE) {
    const size_t end = count - first < SLICE ? count : first + SLICE;
    const qmat_status status = qmat_progress(context, first, count, "points of hulls measured");
    if (status != QMAT_OK) return status;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 256) reduction(max : of_points)
    for (size_t i = first; i < end; i++)
      of_points = fmax(of_points, qmat_surface_signed_distance(solid, &points[3 * i]));
  }
  double most = of_points;
  for (size_t first = 0; first < colliders->triangle_count; first += SLICE) {
    const size_t rest = colliders->triangle_count - first, end = first + (rest < SLICE ? rest : SLICE);
    const qmat_status status = qmat_progress(context, first, colliders->triangle_count, "facets of hulls measured");
    if (status != QMAT_OK) return status;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 64) reduction(max : most)
    for (size_t t = first; t < end; t++) {
      search s = {.solid = solid, .limit = INFINITY, .found = of_points};
      double corners[3][3];
      s.slack = s.reach = qmat_protrusion_slack;
      get_corners(points, &colliders->triangles[3 * t], corners);
      search_triangle(&s, corners, -1);
      most = fmax(most, s.found);
    }
  }
  *bound = most + qmat_protrusion_slack;
  return QMAT_OK;
}
