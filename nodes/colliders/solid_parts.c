/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/solid_parts.h"

#include <math.h>
#include <string.h>

#include "nodes/colliders/extreme_points.h"
#include "nodes/colliders/solid_cubes.h"

/* Half the edge of the cubes between two parts. */
static const double smallest = 1.0 / 512 * (1 + 1e-3);

/* So many points of a part are reduced. */
enum { MANY_POINTS = 4096 };

/* Points may be dropped so far outside of the hull of the others. */
static const double dropped = 1e-9;

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
    if (qmat_extreme_points_keep(h->points, &h->count, dropped) != QMAT_OK) return false;
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
    if (qmat_extreme_points_keep(r->heaps[i].points, &r->heaps[i].count, dropped) != QMAT_OK) r->failed = true;
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
  const int threads = qmat_threads(context);
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
  bool done = status == QMAT_OK;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1) reduction(&& : done)
  for (size_t i = 0; i < count; i++) {
    if (done && qmat_extreme_points_keep(all[i].points, &all[i].count, dropped) != QMAT_OK) done = false;
    (*parts)[i] = (qmat_solid_part){all[i].count, all[i].points};
  }
  return status != QMAT_OK || done ? status : qmat_fail_memory(context, "the parts of the solid");
}

void qmat_solid_parts_free(qmat_solid_part *parts, size_t count) {
  for (size_t i = 0; parts && i < count; i++) qmat_free(parts[i].points);
}
