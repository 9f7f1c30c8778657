/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/solid_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/sheets.h"
#include "core/side_by_side.h"
#include "nodes/colliders/extreme_points.h"
#include "nodes/colliders/solid_cubes.h"

/* Half the edge of the cubes between two parts, and of the largest ones. */
static const double smallest = 1.0 / 512 * (1 + 1e-3), largest = 0.5 / QMAT_SOLID_CELLS * (1 + 1e-3);

/* So many points of a cell are reduced: at once, and when it ends. */
enum { MANY_IN_CELL = 512, FEW_IN_CELL = 128 };

/* The corners of the cubes in a cell are on a grid, so many along an axis. */
enum { GRID = 5, GRID_POINTS = GRID * GRID * GRID };

/* The points that one shape has so far, and its cells with theirs. */
typedef struct heap {
  uint32_t shape;
  qmat_point_heap hull;
  size_t cell_count, cell_capacity, point_count, point_capacity;
  qmat_solid_cell *cells;
  double *cell_points;
  size_t limit;              /* of points of the last cell, before they are reduced */
  bool has[GRID_POINTS];     /* the last cell's corners of cubes */
  double at[GRID_POINTS][3]; /* their places */
} heap;

typedef struct region {
  heap *heaps;
  size_t count, capacity;
  bool failed;
} region;

/* What the search fills. */
typedef struct gathered {
  heap *heaps;         /* one per shape */
  size_t solid_count;  /* the triangles from here on are sheets */
  double reach;        /* of the octahedra around the points of sheets */
  _Atomic size_t done; /* shapes whose points are reduced */
} gathered;

static heap *find_heap(region *r, uint32_t shape) {
  for (size_t i = 0; i < r->count; i++)
    if (r->heaps[i].shape == shape) return &r->heaps[i];
  if (qmat_grow((void **)&r->heaps, &r->capacity, r->count + 1, sizeof *r->heaps) != 0) return NULL;
  r->heaps[r->count] = (heap){.shape = shape};
  return &r->heaps[r->count++];
}

static bool add_cells(heap *h, const qmat_solid_cell *cells, size_t cell_count, const double *points, size_t count) {
  if (qmat_grow((void **)&h->cells, &h->cell_capacity, h->cell_count + cell_count, sizeof *h->cells) != 0 ||
      qmat_grow((void **)&h->cell_points, &h->point_capacity, 3 * (h->point_count + count), sizeof *points) != 0)
    return false;
  if (cell_count > 0) memcpy(&h->cells[h->cell_count], cells, cell_count * sizeof *cells);
  if (count > 0) memcpy(&h->cell_points[3 * h->point_count], points, 3 * count * sizeof *points);
  h->cell_count += cell_count;
  h->point_count += count;
  return true;
}

/* Drops points of the last cell, where there are many. */
static bool reduce_cell(heap *h, size_t many) {
  qmat_solid_cell *last = h->cell_count > 0 ? &h->cells[h->cell_count - 1] : NULL;
  if (!last || last->count <= many) return true;
  size_t count = last->count;
  h->point_count -= count;
  if (qmat_extreme_points_keep(&h->cell_points[3 * h->point_count], &count, qmat_solid_dropped) != QMAT_OK)
    return false;
  h->point_count += count;
  last->count = (uint32_t)count;
  h->limit = 2 * count > MANY_IN_CELL ? 2 * count : MANY_IN_CELL;
  return true;
}

/* Whether the cell has corners on both sides of this one along an axis. */
static bool is_between(const heap *h, int i) {
  for (int axis = 0, step = 1; axis < 3; axis++, step *= GRID) {
    const int place = i / step % GRID;
    bool before = false, after = false;
    for (int k = 0; k < place; k++) before = before || h->has[i - (place - k) * step];
    for (int k = place + 1; k < GRID; k++) after = after || h->has[i + (k - place) * step];
    if (before && after) return true;
  }
  return false;
}

/* Adds those corners of cubes to the last cell that may be vertices of its hull. */
static bool add_corners(heap *h) {
  double corners[GRID_POINTS][3];
  size_t count = 0;
  for (int i = 0; i < GRID_POINTS; i++)
    if (h->has[i] && !is_between(h, i)) memcpy(corners[count++], h->at[i], sizeof corners[0]);
  memset(h->has, 0, sizeof h->has);
  h->cells[h->cell_count - 1].count += (uint32_t)count;
  return add_cells(h, NULL, 0, corners[0], count);
}

/* Gives the points of the last cell to the hull. */
static bool end_cell(heap *h) {
  if (h->cell_count == 0) return true;
  if (!add_corners(h) || !reduce_cell(h, FEW_IN_CELL)) return false;
  qmat_solid_cell *last = &h->cells[h->cell_count - 1];
  double *points = &h->cell_points[3 * (h->point_count - last->count)];
  last->first = (uint32_t)qmat_extreme_points_first(points, last->count, QMAT_EXTREME_DIRECTIONS);
  return qmat_point_heap_add(&h->hull, points, last->count, qmat_solid_dropped);
}

/* Adds points of a cube. The cubes of a cell come one after the other. */
static bool add_points(heap *h, const qmat_solid_cube *c, const double *points, size_t count) {
  qmat_solid_cell cell = {.count = (uint32_t)count};
  for (int k = 0; k < 3; k++) cell.at[k] = (uint8_t)((c->centre[k] + 0.5) * QMAT_SOLID_CELLS);
  qmat_solid_cell *last = h->cell_count > 0 ? &h->cells[h->cell_count - 1] : NULL;
  if (!last || memcmp(last->at, cell.at, sizeof cell.at) != 0) {
    h->limit = MANY_IN_CELL;
    return end_cell(h) && add_cells(h, &cell, 1, points, count);
  }
  last->count += cell.count;
  return add_cells(h, NULL, 0, points, count) && reduce_cell(h, h->limit);
}

/* Remembers a corner of a cube of the last cell. */
static void add_corner(heap *h, const double corner[3]) {
  int i = 0;
  for (int k = 2; k >= 0; k--) {
    const double place = (corner[k] + 0.5) * QMAT_SOLID_CELLS - h->cells[h->cell_count - 1].at[k];
    i = GRID * i + (int)lround((GRID - 1) * place);
  }
  h->has[i] = true;
  memcpy(h->at[i], corner, sizeof h->at[i]);
}

/* Adds octahedra around points of a sheet. */
static bool add_octahedra(heap *h, const qmat_solid_cube *c, double points[][3], size_t count, double reach) {
  double corners[6 * QMAT_CUBE_MOST_CORNERS][3];
  for (size_t i = 0; i < 6 * count; i++) {
    memcpy(corners[i], points[i / 6], sizeof corners[i]);
    corners[i][i % 3] += i % 6 < 3 ? reach : -reach;
  }
  return add_points(h, c, corners[0], 6 * count);
}

/* Divides a cube that several shapes share, or gives it to the first. */
static bool visit(const qmat_cube_search *s, qmat_solid_cube *c) {
  region *r = s->region;
  const gathered *all = s->visitor->all;
  if (c->half > (c->candidate_count > 1 ? smallest : largest)) return true;
  heap *h = r->failed ? NULL : find_heap(r, c->candidates[0]);
  bool done = h != NULL;
  for (size_t f = 0; f < c->facet_count && done; f++) {
    double polygon[QMAT_CUBE_MOST_CORNERS][3];
    const size_t count = (size_t)qmat_cube_clip(s, c, c->facets[f], polygon);
    done = c->facets[f] < all->solid_count ? add_points(h, c, polygon[0], count)
                                           : add_octahedra(h, c, polygon, count, all->reach);
  }
  done = done && add_points(h, c, NULL, 0);
  for (int i = 0; i < 8 && done; i++) {
    double corner[3];
    if (c->facet_count > 0 && !qmat_cube_corner_counts(s, c, i)) continue;
    qmat_cube_corner(c, i, corner);
    add_corner(h, corner);
  }
  r->failed = !done;
  return false;
}

static void finish(void *data) {
  region *r = data;
  for (size_t i = 0; i < r->count; i++) {
    heap *h = &r->heaps[i];
    if (!end_cell(h) || qmat_extreme_points_keep(h->hull.points, &h->hull.count, qmat_solid_dropped) != QMAT_OK)
      r->failed = true;
  }
}

static qmat_status gather(void *data, void *found) {
  const gathered *all = data;
  region *r = found;
  bool done = !r->failed;
  for (size_t i = 0; i < r->count; i++) {
    heap *from = &r->heaps[i], *to = &all->heaps[from->shape];
    done = done && qmat_point_heap_add(&to->hull, from->hull.points, from->hull.count, qmat_solid_dropped) &&
           add_cells(to, from->cells, from->cell_count, from->cell_points, from->point_count);
    qmat_free(from->hull.points);
    qmat_free(from->cells);
    qmat_free(from->cell_points);
  }
  qmat_free(r->heaps);
  return done ? QMAT_OK : QMAT_ERROR_MEMORY;
}

static qmat_status keep_points(void *data, qmat_context *context, size_t shape) {
  gathered *all = data;
  qmat_point_heap *hull = &all->heaps[shape].hull;
  qmat_status status = qmat_progress(context, 1, 0, "parts");
  if (status == QMAT_OK && qmat_extreme_points_keep(hull->points, &hull->count, qmat_solid_dropped) != QMAT_OK)
    status = qmat_fail_memory(context, "the parts of the solid");
  all->done++;
  return status;
}

qmat_status qmat_solid_parts_find(qmat_context *context, const qmat_surface *surface, const qmat_shape_set *set,
                                  double sheet_reach, qmat_solid_part **parts) {
  const size_t count = set->shape_count;
  const qmat_mesh *mesh = qmat_surface_mesh(surface);
  gathered all = {.heaps = qmat_arena_calloc(&context->arena, count, sizeof *all.heaps),
                  .solid_count = qmat_solid_triangle_count(mesh),
                  .reach = sheet_reach};
  *parts = qmat_arena_calloc(&context->arena, count, sizeof **parts);
  if (!all.heaps || !*parts) return qmat_fail_memory(context, "the parts of the solid");
  const qmat_cube_visitor visitor = {.region_size = sizeof(region),
                                     .visit = visit,
                                     .finish = finish,
                                     .gather = gather,
                                     .all = &all,
                                     .what = "regions divided"};
  qmat_status status = qmat_solid_cubes_search(context, surface, set, &visitor);
  if (status == QMAT_OK) status = qmat_run_side_by_side(context, count, keep_points, &all, &all.done, count, "parts");
  for (size_t i = 0; i < count; i++) {
    const heap *h = &all.heaps[i];
    (*parts)[i] = (qmat_solid_part){h->hull.count, h->cell_count, h->hull.points, h->cells, h->cell_points, 0};
  }
  return status;
}

/* A point of a joint, and the shape and the cell that it goes to. */
typedef struct given_point {
  double at[3];
  uint32_t shape; /* UINT32_MAX: the joint has none */
  uint8_t cell[3];
} given_point;

static int compare_points(const void *left, const void *right) {
  const given_point *a = left, *b = right;
  if (a->shape != b->shape) return a->shape < b->shape ? -1 : 1;
  const int order = memcmp(a->cell, b->cell, sizeof a->cell);
  return order != 0 ? order : memcmp(a->at, b->at, sizeof a->at);
}

static void place_point(const qmat_shape_set *set, const qmat_prepared_shape *shapes, const double *point,
                        uint32_t joint, given_point *given) {
  size_t nearest = 0;
  memcpy(given->at, point, sizeof given->at);
  for (int k = 0; k < 3; k++)
    given->cell[k] = (uint8_t)fmin(fmax((point[k] + 0.5) * QMAT_SOLID_CELLS, 0), QMAT_SOLID_CELLS - 1);
  const double distance = qmat_shape_set_nearest_of_joint(set, shapes, joint, point, &nearest);
  given->shape = isfinite(distance) ? (uint32_t)nearest : UINT32_MAX;
}

/* Adds the points of one cell, as a further cell. */
static bool add_given(heap *h, const given_point *given, size_t count) {
  qmat_solid_cell cell = {.count = (uint32_t)count, .first = (uint32_t)count};
  memcpy(cell.at, given->cell, sizeof cell.at);
  for (size_t i = 0; i < count; i++)
    if (!qmat_point_heap_add(&h->hull, given[i].at, 1, qmat_solid_dropped) || !add_cells(h, NULL, 0, given[i].at, 1))
      return false;
  return add_cells(h, &cell, 1, NULL, 0);
}

/* Adds points to a part, which come cell by cell. */
static bool add_to_part(qmat_solid_part *part, const given_point *given, size_t count) {
  size_t before = 0;
  for (size_t c = 0; c < part->cell_count; c++) before += part->cells[c].count;
  heap h = {.hull = {.count = part->count, .capacity = 3 * part->count, .points = part->points},
            .cell_count = part->cell_count,
            .cell_capacity = part->cell_count,
            .point_count = before,
            .point_capacity = 3 * before,
            .cells = part->cells,
            .cell_points = part->cell_points};
  bool done = true;
  for (size_t i = 0, end; i < count && done; i = end) {
    for (end = i; end < count && memcmp(given[end].cell, given[i].cell, sizeof given->cell) == 0;) end++;
    done = add_given(&h, &given[i], end - i);
  }
  done = done && qmat_extreme_points_keep(h.hull.points, &h.hull.count, qmat_solid_dropped) == QMAT_OK;
  *part = (qmat_solid_part){h.hull.count, h.cell_count, h.hull.points, h.cells, h.cell_points, part->joint};
  return done;
}

qmat_status qmat_solid_parts_add_joints(qmat_context *context, const qmat_shape_set *set,
                                        const qmat_joint_points *points, qmat_solid_part *parts) {
  const size_t count = points->count;
  given_point *given = qmat_arena_calloc(&context->arena, count, sizeof *given);
  qmat_prepared_shape *shapes = qmat_arena_alloc(&context->arena, set->shape_count, sizeof *shapes);
  if (!given || !shapes) return qmat_fail_memory(context, "the parts of the solid");
  for (size_t i = 0; i < set->shape_count; i++) {
    qmat_shape_prepare(&shapes[i], set->spheres, &set->shapes[3 * i]);
    parts[i].joint = set->joints[set->shapes[3 * i]];
  }
  for (size_t i = 0; i < count; i++) {
    const qmat_status status = i % 1024 ? QMAT_OK : qmat_progress(context, i, count, "points");
    if (status != QMAT_OK) return status;
    place_point(set, shapes, &points->points[4 * i], points->joints[i], &given[i]);
  }
  qsort(given, count, sizeof *given, compare_points);
  bool done = true;
  for (size_t i = 0, end; i < count && given[i].shape != UINT32_MAX && done; i = end) {
    for (end = i; end < count && given[end].shape == given[i].shape;) end++;
    done = add_to_part(&parts[given[i].shape], &given[i], end - i);
  }
  return done ? QMAT_OK : qmat_fail_memory(context, "the parts of the solid");
}

void qmat_solid_parts_free(qmat_solid_part *parts, size_t count) {
  for (size_t i = 0; parts && i < count; i++) {
    qmat_free(parts[i].points);
    qmat_free(parts[i].cells);
    qmat_free(parts[i].cell_points);
  }
}
