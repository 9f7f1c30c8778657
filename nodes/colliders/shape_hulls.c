/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/shape_hulls.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "nodes/colliders/convex_hull_cgal.h"
#include "nodes/colliders/hull_vertices.h"
#include "nodes/colliders/tangent_hull.h"

/* Scratch of one hull: points in up to three copies of the directions. */
typedef struct hull {
  size_t point_count, triangle_count, used; /* used: points that are vertices of the hull */
  double *points;
  uint32_t *triangles, *names; /* names: the number of a point among those used, or QMAT_UNUSED */
} hull;

#define QMAT_UNUSED UINT32_MAX

/* Fewer do not surround a point. Those of three spheres are within every limit. */
enum { LEAST_DIRECTIONS = QMAT_LEAST_HULL_POINTS / 3 };

/* Finds the hull of the points. */
static qmat_status close_hull(hull *h) {
  const qmat_status status = qmat_convex_hull(h->points, h->point_count, h->triangles, &h->triangle_count);
  if (status != QMAT_OK) return status;
  memset(h->names, 0xff, h->point_count * sizeof *h->names);
  for (size_t i = 0; i < 3 * h->triangle_count; i++) h->names[h->triangles[i]] = 0;
  h->used = 0;
  for (size_t i = 0; i < h->point_count; i++)
    if (h->names[i] == 0) h->names[i] = (uint32_t)h->used++;
  return QMAT_OK;
}

/* The hull of `width` spheres, each replaced by n points on the sphere of `factor` times its radius. */
static qmat_status make_hull(hull *h, const double *spheres, const uint32_t *ids, int width, const size_t *n,
                             const double *factor) {
  h->point_count = 0;
  for (int s = 0; s < width; s++) {
    const double *sphere = &spheres[4 * (size_t)ids[s]];
    for (size_t i = 0; i < n[s]; i++) {
      double unit[3], *point = &h->points[3 * h->point_count++];
      qmat_spread_direction(i, n[s], unit);
      for (int k = 0; k < 3; k++) point[k] = sphere[k] + factor[s] * sphere[3] * unit[k];
    }
  }
  return close_hull(h);
}

/* What the radius of n directions must be multiplied by so that their hull contains the unit sphere. */
static qmat_status circumscribe(hull *h, size_t n, double *factor) {
  static const double unit[4] = {0, 0, 0, 1};
  static const uint32_t id = 0;
  static const double one = 1;
  const qmat_status status = make_hull(h, unit, &id, 1, &n, &one);
  double nearest = 1;
  for (size_t t = 0; t < h->triangle_count && status == QMAT_OK; t++) {
    double plane[4];
    if (qmat_hull_plane(h->points, &h->triangles[3 * t], plane)) nearest = fmin(nearest, plane[3]);
  }
  *factor = (1 + 1e-9) / nearest;
  return status;
}

/* As many directions, of at most `most`, as put their hull within about `error` of a sphere of this radius: n
 * directions leave it by 3.6 / n of the radius. */
static size_t directions_for(double radius, double error, size_t most) {
  const double n = ceil(3.6 * radius / error);
  return n > (double)most ? most : n > LEAST_DIRECTIONS ? (size_t)n : LEAST_DIRECTIONS;
}

/* The hull of a shape within the error, or the finest within the limit, of points on its spheres, or around them, so
 * that their hull contains the shape. */
static qmat_status fit_points(hull *h, const double *spheres, const uint32_t ids[3], size_t most, double error,
                              qmat_hull_side side, double *factors) {
  const int width = qmat_shape_width(ids);
  for (;; error *= 1.15) {
    size_t n[3], points = 0;
    double factor[3] = {1, 1, 1};
    for (int s = 0; s < width; s++) {
      n[s] = directions_for(spheres[4 * (size_t)ids[s] + 3], error, most);
      if (side == QMAT_HULL_OUTSIDE && factors[n[s]] == 0) {
        const qmat_status status = circumscribe(h, n[s], &factors[n[s]]);
        if (status != QMAT_OK) return status;
      }
      if (side == QMAT_HULL_OUTSIDE) factor[s] = factors[n[s]];
      points += n[s];
    }
    const qmat_status status = make_hull(h, spheres, ids, width, n, factor);
    if (status != QMAT_OK || h->used <= most || points <= LEAST_DIRECTIONS * (size_t)width) return status;
  }
}

/* The hull outside of a shape: by half-spaces that touch it, or by points where rounding spoils those. */
static qmat_status surround(hull *h, qmat_tangent_hull *tangent, const double *spheres, const uint32_t ids[3],
                            double error, double *factors) {
  qmat_status status = qmat_tangent_hull_fit(tangent, spheres, ids, error);
  if (status == QMAT_ERROR_GEOMETRY)
    return fit_points(h, spheres, ids, tangent->most, error, QMAT_HULL_OUTSIDE, factors);
  if (status != QMAT_OK) return status;
  h->point_count = tangent->point_count;
  memcpy(h->points, tangent->points, 3 * h->point_count * sizeof *h->points);
  return close_hull(h);
}

/* Appends the hull to the value's arrays, which have `room` for points and triangles. Most hulls have fewer than they
 * may have, so that the arrays grow with them. */
static qmat_status append(qmat_colliders *colliders, size_t room[2], size_t shape, const hull *h) {
  const size_t first = colliders->point_count;
  if (qmat_grow((void **)&colliders->points, &room[0], first + h->used, 3 * sizeof *colliders->points) != 0 ||
      qmat_grow((void **)&colliders->triangles, &room[1], colliders->triangle_count + h->triangle_count,
                3 * sizeof *colliders->triangles) != 0)
    return QMAT_ERROR_MEMORY;
  for (size_t i = 0; i < h->point_count; i++)
    if (h->names[i] != QMAT_UNUSED)
      memcpy(&colliders->points[3 * (first + h->names[i])], &h->points[3 * i], 3 * sizeof *h->points);
  for (size_t i = 0; i < 3 * h->triangle_count; i++)
    colliders->triangles[3 * colliders->triangle_count + i] = (uint32_t)first + h->names[h->triangles[i]];
  colliders->point_count += h->used;
  colliders->triangle_count += h->triangle_count;
  colliders->hull_ends[2 * shape] = (uint32_t)colliders->point_count;
  colliders->hull_ends[2 * shape + 1] = (uint32_t)colliders->triangle_count;
  return QMAT_OK;
}

qmat_status qmat_shape_hulls(qmat_context *context, qmat_colliders *colliders, size_t most_points, double error,
                             qmat_hull_side side) {
  const size_t room = 3 * most_points, count = colliders->shape_count;
  hull h = {.points = qmat_arena_alloc(&context->arena, room, 3 * sizeof *h.points),
            .triangles = qmat_arena_alloc(&context->arena, room, 6 * sizeof *h.triangles),
            .names = qmat_arena_alloc(&context->arena, room, sizeof *h.names)};
  double *factors = qmat_arena_calloc(&context->arena, most_points + 1, sizeof *factors); /* 0: not known */
  size_t value_room[2] = {0, 0};
  colliders->hull_ends = qmat_alloc(count, 2 * sizeof *colliders->hull_ends);
  if (!h.points || !h.triangles || !h.names || !factors || !colliders->hull_ends)
    return qmat_fail_memory(context, "the hulls");
  qmat_tangent_hull tangent;
  qmat_status status = qmat_tangent_hull_init(context, most_points, &tangent);
  for (size_t i = 0; i < count && status == QMAT_OK; i++) {
    status = qmat_progress(context, i, count, "hulls");
    if (status != QMAT_OK) return status;
    const uint32_t *ids = &colliders->shapes[3 * i];
    status = side == QMAT_HULL_OUTSIDE ? surround(&h, &tangent, colliders->spheres, ids, error, factors)
                                       : fit_points(&h, colliders->spheres, ids, most_points, error, side, factors);
    if (status == QMAT_OK) status = append(colliders, value_room, i, &h);
    if (status == QMAT_ERROR_GEOMETRY) {
      qmat_fail(context, status, "it has no hull");
      return qmat_fail_element(context, "shape", (int64_t)i);
    }
  }
  return status == QMAT_ERROR_MEMORY ? qmat_fail_memory(context, "the hulls") : status;
}
