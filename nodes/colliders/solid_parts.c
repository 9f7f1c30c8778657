/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/solid_parts.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "nodes/colliders/convex_hull_cgal.h"
#include "nodes/colliders/solid_cubes.h"

/* Half the edge of the cubes between two parts. */
static const double smallest = 1.0 / 512 * (1 + 1e-3);

/* So many points of a part are reduced, by so many directions. */
enum { MANY_POINTS = 4096, DIRECTIONS = 64 };

/* Points are dropped only so far inside of a hull, because of rounding. */
static const double least_depth = 1e-9;

/* The points that one shape has so far. */
typedef struct heap {
  uint32_t shape;
  size_t count, capacity, limit; /* limit: of points, before they are reduced */
  double *points;
} heap;

typedef struct region {
  heap *heaps;
  size_t count, capacity;
  bool failed;
} region;

/* Drops points inside of the hull of those that reach farthest in some directions (Akl and Toussaint 1978). Points in a
 * plane stay. */
static qmat_status reduce(double *points, size_t *count) {
  double farthest[3 * DIRECTIONS], planes[4 * 2 * DIRECTIONS];
  uint32_t triangles[6 * DIRECTIONS];
  size_t plane_count, kept = 0;
  if (*count <= DIRECTIONS) return QMAT_OK;
  for (size_t d = 0; d < DIRECTIONS; d++) {
    double direction[3], most = -INFINITY;
    qmat_spread_direction(d, DIRECTIONS, direction);
    for (size_t i = 0; i < *count; i++) {
      const double height = qmat_dot(direction, &points[3 * i]);
      if (!(height > most)) continue;
      most = height;
      memcpy(&farthest[3 * d], &points[3 * i], 3 * sizeof *farthest);
    }
  }
  const qmat_status status = qmat_convex_hull(farthest, DIRECTIONS, triangles, &plane_count);
  if (status != QMAT_OK) return status == QMAT_ERROR_GEOMETRY ? QMAT_OK : status;
  for (size_t t = 0; t < plane_count; t++) {
    const double *corner = &farthest[3 * (size_t)triangles[3 * t]];
    double u[3], v[3], *plane = &planes[4 * t];
    qmat_subtract(&farthest[3 * (size_t)triangles[3 * t + 1]], corner, u);
    qmat_subtract(&farthest[3 * (size_t)triangles[3 * t + 2]], corner, v);
    qmat_cross(u, v, plane);
    qmat_normalize(plane);
    plane[3] = qmat_dot(plane, corner) - least_depth;
  }
  for (size_t i = 0; i < *count; i++) {
    bool is_inside = true;
    for (size_t t = 0; t < plane_count && is_inside; t++)
      is_inside = qmat_dot(&planes[4 * t], &points[3 * i]) < planes[4 * t + 3];
    if (!is_inside) memmove(&points[3 * kept++], &points[3 * i], 3 * sizeof *points);
  }
  *count = kept;
  return QMAT_OK;
}

static heap *find_heap(region *r, uint32_t shape) {
  for (size_t i = 0; i < r->count; i++)
    if (r->heaps[i].shape == shape) return &r->heaps[i];
  if (qmat_grow((void **)&r->heaps, &r->capacity, r->count + 1, sizeof *r->heaps) != 0) return NULL;
  r->heaps[r->count] = (heap){.shape = shape, .limit = MANY_POINTS};
  return &r->heaps[r->count++];
}

static bool add_points(heap *h, const double *points, size_t count) {
  if (count == 0) return true;
  if (h->count + count > h->limit) {
    if (reduce(h->points, &h->count) != QMAT_OK) return false;
    h->limit = 2 * (h->count + count) > MANY_POINTS ? 2 * (h->count + count) : MANY_POINTS;
  }
  if (qmat_grow((void **)&h->points, &h->capacity, 3 * (h->count + count), sizeof *h->points) != 0) return false;
  memcpy(&h->points[3 * h->count], points, 3 * count * sizeof *points);
  h->count += count;
  return true;
}

/* Divides a cube that several shapes share, or gives it to the first. */
static bool visit(const qmat_cube_search *s, qmat_solid_cube *c) {
  region *r = s->region;
  if (c->candidate_count > 1 && c->half > smallest) return true;
  heap *h = r->failed ? NULL : find_heap(r, c->candidates[0]);
  bool done = h != NULL;
  for (size_t f = 0; f < c->facet_count && done; f++) {
    double polygon[QMAT_CUBE_MOST_CORNERS][3];
    const int count = qmat_cube_clip(s, c, c->facets[f], polygon);
    done = add_points(h, polygon[0], (size_t)count);
  }
  for (int i = 0; i < 8 && done; i++) {
    double corner[3];
    if (c->facet_count > 0 && !qmat_cube_corner_counts(s, c, i)) continue;
    qmat_cube_corner(c, i, corner);
    done = add_points(h, corner, 1);
  }
  r->failed = !done;
  return false;
}

static void finish(void *data) {
  region *r = data;
  for (size_t i = 0; i < r->count; i++)
    if (reduce(r->heaps[i].points, &r->heaps[i].count) != QMAT_OK) r->failed = true;
}

static qmat_status gather(void *data, void *found) {
  heap *all = data;
  region *r = found;
  bool done = !r->failed;
  for (size_t i = 0; i < r->count; i++) {
    done = done && add_points(&all[r->heaps[i].shape], r->heaps[i].points, r->heaps[i].count);
    qmat_free(r->heaps[i].points);
  }
  qmat_free(r->heaps);
  return done ? QMAT_OK : QMAT_ERROR_MEMORY;
}

qmat_status qmat_solid_parts_find(qmat_context *context, const qmat_surface *surface, const qmat_shape_set *set,
                                  qmat_solid_part **parts) {
  const size_t count = set->shape_count;
  heap *all = qmat_arena_calloc(&context->arena, count, sizeof *all);
  *parts = qmat_arena_calloc(&context->arena, count, sizeof **parts);
  if (!all || !*parts) return qmat_fail_memory(context, "the parts of the solid");
  const qmat_cube_visitor visitor = {.region_size = sizeof(region),
                                     .visit = visit,
                                     .finish = finish,
                                     .gather = gather,
                                     .all = all,
                                     .what = "regions divided"};
  for (size_t i = 0; i < count; i++) all[i].limit = MANY_POINTS;
  qmat_status status = qmat_solid_cubes_search(context, surface, set, &visitor);
  for (size_t i = 0; i < count; i++) {
    if (status == QMAT_OK && reduce(all[i].points, &all[i].count) != QMAT_OK)
      status = qmat_fail_memory(context, "the parts of the solid");
    (*parts)[i] = (qmat_solid_part){all[i].count, all[i].points};
  }
  return status;
}

void qmat_solid_parts_free(qmat_solid_part *parts, size_t count) {
  for (size_t i = 0; parts && i < count; i++) qmat_free(parts[i].points);
}
