/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/solid_part.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"

/* A facet's plane, its normal and offset; a clipped triangle; the points found. */
typedef struct plane {
  double normal[3], offset;
} plane;

typedef struct clip {
  plane *planes;
  size_t plane_count;
  double low[3], high[3];
  double *polygons[2]; /* 3 doubles per corner: a plane adds one at most */
  double *part;
  size_t count, capacity;
} clip;

static qmat_status add_point(clip *c, const double point[3]) {
  if (qmat_grow((void **)&c->part, &c->capacity, 3 * (c->count + 1), sizeof *c->part)) return QMAT_ERROR_MEMORY;
  memcpy(&c->part[3 * c->count++], point, 3 * sizeof *point);
  return QMAT_OK;
}

static double height(const plane *p, const double point[3]) {
  return qmat_dot(p->normal, point) - p->offset;
}

/* Cuts off what is above a plane (Sutherland and Hodgman). The number of corners that are left. */
static size_t cut(const plane *p, const double *from, size_t count, double *to) {
  size_t left = 0;
  for (size_t i = 0; i < count; i++) {
    const double *a = &from[3 * i], *b = &from[3 * ((i + 1) % count)];
    const double above_a = height(p, a), above_b = height(p, b);
    if (above_a <= 0) memcpy(&to[3 * left++], a, 3 * sizeof *to);
    if ((above_a < 0 && above_b > 0) || (above_a > 0 && above_b < 0)) {
      const double share = above_a / (above_a - above_b);
      for (int k = 0; k < 3; k++) to[3 * left + (size_t)k] = a[k] + share * (b[k] - a[k]);
      left++;
    }
  }
  return left;
}

static bool misses_box(const clip *c, const double *corners) {
  for (int k = 0; k < 3; k++) {
    const double x = corners[k], y = corners[3 + k], z = corners[6 + k];
    if (fmin(fmin(x, y), z) > c->high[k] || fmax(fmax(x, y), z) < c->low[k]) return true;
  }
  return false;
}

static qmat_status clip_triangle(clip *c, const double corners[9]) {
  if (misses_box(c, corners)) return QMAT_OK;
  double *from = c->polygons[0], *to = c->polygons[1];
  size_t count = 3;
  memcpy(from, corners, 9 * sizeof *corners);
  for (size_t i = 0; i < c->plane_count && count > 0; i++) {
    count = cut(&c->planes[i], from, count, to);
    double *swap = from;
    from = to;
    to = swap;
  }
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < count && status == QMAT_OK; i++) status = add_point(c, &from[3 * i]);
  return status;
}

static void set_planes(clip *c, const double *points, const uint32_t *triangles, size_t triangle_count) {
  for (int k = 0; k < 3; k++) {
    c->low[k] = INFINITY;
    c->high[k] = -INFINITY;
  }
  for (size_t i = 0; i < triangle_count; i++) {
    const double *corners[3];
    for (int j = 0; j < 3; j++) {
      corners[j] = &points[3 * (size_t)triangles[3 * i + (size_t)j]];
      for (int k = 0; k < 3; k++) {
        c->low[k] = fmin(c->low[k], corners[j][k]);
        c->high[k] = fmax(c->high[k], corners[j][k]);
      }
    }
    plane *p = &c->planes[c->plane_count];
    double u[3], v[3];
    qmat_subtract(corners[1], corners[0], u);
    qmat_subtract(corners[2], corners[0], v);
    qmat_cross(u, v, p->normal);
    if (!(qmat_dot(p->normal, p->normal) > 0)) continue;
    qmat_normalize(p->normal);
    p->offset = qmat_dot(p->normal, corners[0]);
    c->plane_count++;
  }
}

/* Takes the vertices of the polyhedron that are inside the solid. */
static qmat_status add_vertices(clip *c, const qmat_surface *surface, const double *points, const uint32_t *triangles,
                                size_t triangle_count) {
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < 3 * triangle_count && status == QMAT_OK; i++) {
    const double *point = &points[3 * (size_t)triangles[i]];
    double unit[3];
    qmat_frame_to_unit(qmat_surface_frame(surface), point, 1, unit);
    if (qmat_surface_inside(surface, unit)) status = add_point(c, point);
  }
  return status;
}

qmat_status qmat_solid_part(const qmat_surface *surface, const double *points, const uint32_t *triangles,
                            size_t triangle_count, double **part, size_t *count) {
  const qmat_mesh *mesh = qmat_surface_mesh(surface);
  clip c = {.planes = qmat_alloc(triangle_count, sizeof *c.planes),
            .polygons = {qmat_alloc(triangle_count + 3, 3 * sizeof **c.polygons),
                         qmat_alloc(triangle_count + 3, 3 * sizeof **c.polygons)}};
  qmat_status status = c.planes && c.polygons[0] && c.polygons[1] ? QMAT_OK : QMAT_ERROR_MEMORY;
  if (status == QMAT_OK) set_planes(&c, points, triangles, triangle_count);
  for (size_t i = 0; i < mesh->triangle_count && status == QMAT_OK; i++) {
    double corners[9];
    for (size_t j = 0; j < 3; j++)
      memcpy(&corners[3 * j], &mesh->positions[3 * (size_t)mesh->triangles[3 * i + j]], 3 * sizeof *corners);
    status = clip_triangle(&c, corners);
  }
  if (status == QMAT_OK) status = add_vertices(&c, surface, points, triangles, triangle_count);
  qmat_free(c.planes);
  qmat_free(c.polygons[0]);
  qmat_free(c.polygons[1]);
  if (status != QMAT_OK) {
    qmat_free(c.part);
    return status;
  }
  *part = c.part;
  *count = c.count;
  return QMAT_OK;
}
