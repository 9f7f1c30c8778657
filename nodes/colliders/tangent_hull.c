/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/tangent_hull.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "nodes/colliders/convex_hull_cgal.h"
#include "nodes/colliders/hull_vertices.h"

/* A round adds a plane at vertices that are farther out than this share of the farthest, unless its normal is within
 * this cosine of one that the round has added: that plane may serve both. */
static const double worth = 0.6, apart = 0.94;

static const double directions[6][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};

/* The shape that is being surrounded, or the cloud of points, and a point inside. */
typedef struct target {
  const double *cloud, *facets; /* NULL for a shape; 3 per point; 4 per facet of its hull: normal, reach */
  size_t point_count, facet_count;
  double margin; /* by which a cloud is surrounded farther out */
  const double *spheres;
  const uint32_t *ids;
  qmat_prepared_shape shape;
  double centre[3];
} target;

qmat_status qmat_tangent_hull_init(qmat_context *context, size_t most, qmat_tangent_hull *hull) {
  *hull = (qmat_tangent_hull){.most = most,
                              .normals = qmat_arena_alloc(&context->arena, most, 3 * sizeof *hull->normals),
                              .duals = qmat_arena_alloc(&context->arena, most, 3 * sizeof *hull->duals),
                              .points = qmat_arena_alloc(&context->arena, most, 3 * sizeof *hull->points),
                              .ways = qmat_arena_alloc(&context->arena, most, 4 * sizeof *hull->ways),
                              .triangles = qmat_arena_alloc(&context->arena, most, 6 * sizeof *hull->triangles)};
  if (hull->normals && hull->duals && hull->points && hull->ways && hull->triangles) return QMAT_OK;
  return qmat_fail_memory(context, "the hulls");
}

/* How far the shape or cloud reaches from its centre along a direction. */
static double reach(const target *t, const double normal[3]) {
  double most = 0;
  for (size_t i = 0; i < t->point_count; i++) {
    double to[3];
    qmat_subtract(&t->cloud[3 * i], t->centre, to);
    most = qmat_larger(most, qmat_dot(normal, to) + t->margin);
  }
  for (int k = 0; k < t->shape.count; k++) {
    const double *s = &t->spheres[4 * (size_t)t->ids[k]];
    double to[3];
    qmat_subtract(s, t->centre, to);
    most = fmax(most, qmat_dot(normal, to) + s[3]);
  }
  return most;
}

/* Adds the plane that touches the shape, by its dual: the normal over the distance from the centre. */
static void add_plane(qmat_tangent_hull *h, const target *t, const double normal[3]) {
  const double distance = reach(t, normal);
  memcpy(&h->normals[3 * h->plane_count], normal, 3 * sizeof *normal);
  for (int k = 0; k < 3; k++) h->duals[3 * h->plane_count + (size_t)k] = normal[k] / distance;
  h->plane_count++;
}

/* Six planes around the shape: along its axes, or for a slab the two that touch all of its spheres instead of those
 * along its normal. */
static void start(qmat_tangent_hull *h, target *t) {
  double x[3] = {1, 0, 0}, y[3] = {0, 1, 0}, z[3] = {0, 0, 1}, tilt[3] = {0};
  const double *s[3];
  for (int k = 0; k < 3; k++) s[k] = &t->spheres[4 * (size_t)t->ids[k]];
  if (t->shape.count > 1) {
    qmat_subtract(s[1], s[0], x);
    qmat_normalize(x);
    const int least = fabs(x[0]) <= fabs(x[1]) && fabs(x[0]) <= fabs(x[2]) ? 0 : fabs(x[1]) <= fabs(x[2]) ? 1 : 2;
    double other[3] = {least == 0, least == 1, least == 2};
    if (t->shape.count == 3) qmat_subtract(s[2], s[0], other);
    qmat_cross(x, other, z);
    qmat_normalize(z);
    qmat_cross(z, x, y);
    if (t->shape.count == 3) {
      /* tilt . (s[k] - s[0]) = s[0].r - s[k].r in the plane of x and y */
      tilt[0] = (s[0][3] - s[1][3]) / qmat_point_distance(s[0], s[1]);
      tilt[1] = (s[0][3] - s[2][3] - tilt[0] * qmat_dot(x, other)) / qmat_dot(y, other);
    }
  }
  const double square = 1 - tilt[0] * tilt[0] - tilt[1] * tilt[1], rise = sqrt(fmax(square, 0));
  const double along[6][3] = {
      {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {tilt[0], tilt[1], rise}, {tilt[0], tilt[1], -rise}};
  h->plane_count = 0;
  for (int i = 0; i < 6; i++) {
    double normal[3];
    for (int k = 0; k < 3; k++) normal[k] = along[i][0] * x[k] + along[i][1] * y[k] + along[i][2] * z[k];
    qmat_normalize(normal);
    add_plane(h, t, normal);
  }
}

/* Fills the vertices from the facets of the hull of the duals; those of more than three planes once. */
static qmat_status meet(qmat_tangent_hull *h) {
  size_t count;
  const qmat_status status = qmat_convex_hull(h->duals, h->plane_count, h->triangles, &count);
  if (status != QMAT_OK) return status;
  h->point_count = 0;
  for (size_t i = 0; i < count; i++) {
    const double *p = &h->duals[3 * (size_t)h->triangles[3 * i]];
    double u[3], v[3], *point = &h->points[3 * h->point_count];
    qmat_subtract(&h->duals[3 * (size_t)h->triangles[3 * i + 1]], p, u);
    qmat_subtract(&h->duals[3 * (size_t)h->triangles[3 * i + 2]], p, v);
    qmat_cross(u, v, point);
    const double over = qmat_dot(p, point);
    if (!(over > 0)) return QMAT_ERROR_GEOMETRY;
    for (int k = 0; k < 3; k++) point[k] /= over;
    const double near = 1e-9 * sqrt(qmat_dot(point, point));
    bool known = false;
    for (size_t j = 0; j < h->point_count && !known; j++) known = qmat_point_distance(&h->points[3 * j], point) < near;
    if (!known) h->point_count++;
  }
  return QMAT_OK;
}

/* How far a vertex is outside; `way` receives the normal of the plane that would cut it off. */
static double outside_by(const target *t, const double *vertex, double way[3]) {
  if (t->cloud) {
    double most = -INFINITY;
    for (size_t i = 0; i < t->facet_count; i++) {
      const double *facet = &t->facets[4 * i], away = qmat_dot(facet, vertex) - facet[3];
      if (!(away > most)) continue;
      most = away;
      memcpy(way, facet, 3 * sizeof *way);
    }
    return most;
  }
  double point[3], medial[4];
  for (int k = 0; k < 3; k++) point[k] = vertex[k] + t->centre[k];
  const double away = qmat_shape_medial(&t->shape, t->spheres, t->ids, point, medial);
  qmat_subtract(point, medial, way);
  qmat_normalize(way);
  return away;
}

/* Adds planes where vertices are far out. How many. */
static size_t refine(qmat_tangent_hull *h, const target *t, double error, size_t most_planes) {
  const size_t before = h->plane_count;
  double farthest = -INFINITY;
  for (size_t i = 0; i < h->point_count; i++) {
    h->ways[4 * i + 3] = outside_by(t, &h->points[3 * i], &h->ways[4 * i]);
    farthest = qmat_larger(farthest, h->ways[4 * i + 3]);
  }
  while (h->plane_count < most_planes) {
    double best = error;
    const double *normal = NULL;
    for (size_t i = 0; i < h->point_count; i++) {
      const double *way = &h->ways[4 * i], away = way[3];
      if (!(away > best) || away < worth * farthest) continue;
      bool served = false;
      for (size_t j = before; j < h->plane_count && !served; j++) served = qmat_dot(way, &h->normals[3 * j]) > apart;
      if (served) continue;
      best = away;
      normal = way;
    }
    if (!normal) break;
    add_plane(h, t, normal);
  }
  return h->plane_count - before;
}

/* Moves the vertices to their places, and out by what rounding leaves them inside of the shape. */
static qmat_status finish(qmat_tangent_hull *h, const target *t) {
  size_t count;
  const qmat_status status = qmat_convex_hull(h->points, h->point_count, h->triangles, &count);
  if (status != QMAT_OK) return status;
  double factor = 1;
  for (size_t i = 0; i < count; i++) {
    double plane[4];
    if (qmat_hull_plane(h->points, &h->triangles[3 * i], plane)) factor = fmax(factor, reach(t, plane) / plane[3]);
  }
  if (!(factor < 1.001)) return QMAT_ERROR_GEOMETRY;
  for (size_t i = 0; i < 3 * h->point_count; i++) h->points[i] = t->centre[i % 3] + factor * (1 + 1e-12) * h->points[i];
  return QMAT_OK;
}

/* Adds planes until none is worth it. */
static qmat_status surround(qmat_tangent_hull *hull, const target *t, double error) {
  const size_t most_planes = hull->most / 2 + 2; /* they meet in 2 planes - 4 vertices at most */
  qmat_status status = meet(hull);
  while (status == QMAT_OK && refine(hull, t, error, most_planes) > 0) {
    status = qmat_hull_go_on(hull->context);
    if (status == QMAT_OK) status = meet(hull);
  }
  return status == QMAT_OK ? finish(hull, t) : status;
}

qmat_status qmat_tangent_hull_fit(qmat_tangent_hull *hull, const double *spheres, const uint32_t ids[3], double error) {
  target t = {.spheres = spheres, .ids = ids};
  qmat_shape_prepare(&t.shape, spheres, ids);
  for (int s = 0; s < t.shape.count; s++)
    for (int k = 0; k < 3; k++) t.centre[k] += spheres[4 * (size_t)ids[s] + (size_t)k] / t.shape.count;
  start(hull, &t);
  return surround(hull, &t, error);
}

/* The planes of the facets of the cloud's hull, from the centre of its points: `t->facets`. */
static qmat_status find_facets(const qmat_tangent_hull *hull, target *t, uint32_t *triangles, double *facets) {
  size_t count;
  qmat_status status = qmat_convex_hull(t->cloud, t->point_count, triangles, &count);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < t->point_count; i++)
    for (int k = 0; k < 3; k++) t->centre[k] += t->cloud[3 * i + (size_t)k] / (double)t->point_count;
  for (size_t i = 0; i < count && status == QMAT_OK; i++) {
    double *facet = &facets[4 * t->facet_count];
    if (!qmat_hull_plane(t->cloud, &triangles[3 * i], facet)) continue;
    facet[3] = reach(t, facet);
    t->facet_count++;
    status = qmat_hull_go_on(hull->context);
  }
  t->facets = facets;
  return status;
}

qmat_status qmat_tangent_hull_fit_points(qmat_tangent_hull *hull, const double *points, size_t count, double margin,
                                         double error) {
  target t = {.cloud = points, .point_count = count, .margin = margin};
  uint32_t *triangles = qmat_alloc(count, 6 * sizeof *triangles);
  double *facets = qmat_alloc(count, 8 * sizeof *facets);
  qmat_status status = triangles && facets ? QMAT_OK : QMAT_ERROR_MEMORY;
  if (status == QMAT_OK) status = count < 4 ? QMAT_ERROR_GEOMETRY : find_facets(hull, &t, triangles, facets);
  if (status == QMAT_OK) {
    hull->plane_count = 0;
    for (int i = 0; i < 6; i++) add_plane(hull, &t, directions[i]);
    status = surround(hull, &t, error);
  }
  qmat_free(triangles);
  qmat_free(facets);
  return status;
}
