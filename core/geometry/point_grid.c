/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/point_grid.h"

#include <math.h>

enum { MOST_ALONG = 128 };
/* The mean number of points in a cell that has any, for points spread evenly over the six sides of a cube. */
static const double points_to_a_cell = 2;

static size_t cell_along(const qmat_point_grid *grid, size_t axis, double x) {
  const double cell = floor((x - grid->low[axis]) / grid->width);
  return cell > 0 ? (size_t)fmin(cell, (double)grid->along[axis] - 1) : 0;
}

static size_t cell_index(const qmat_point_grid *grid, const size_t cell[3]) {
  return (cell[0] * grid->along[1] + cell[1]) * grid->along[2] + cell[2];
}

static size_t cell_of(const qmat_point_grid *grid, const double *point) {
  size_t cell[3];
  for (size_t k = 0; k < 3; k++) cell[k] = cell_along(grid, k, point[k]);
  return cell_index(grid, cell);
}

qmat_status qmat_point_grid_init(qmat_context *context, const double *points, size_t count, qmat_point_grid *grid) {
  double high[3], extent = 0;
  *grid = (qmat_point_grid){.points = points};
  for (size_t k = 0; k < 3; k++) grid->low[k] = high[k] = points[k];
  for (size_t i = 0; i < 3 * count; i++) {
    grid->low[i % 3] = fmin(grid->low[i % 3], points[i]);
    high[i % 3] = fmax(high[i % 3], points[i]);
  }
  for (size_t k = 0; k < 3; k++) extent = fmax(extent, high[k] - grid->low[k]);
  const double most = fmin(fmax(ceil(sqrt((double)count / (6 * points_to_a_cell))), 1), MOST_ALONG);
  grid->width = extent > 0 ? extent / most : 1;
  size_t cells = 1;
  for (size_t k = 0; k < 3; k++) {
    grid->along[k] = (size_t)fmin(floor((high[k] - grid->low[k]) / grid->width) + 1, most);
    cells *= grid->along[k];
  }
  grid->starts = qmat_arena_calloc(&context->arena, cells + 2, sizeof *grid->starts);
  grid->items = qmat_arena_alloc(&context->arena, count, sizeof *grid->items);
  if (!grid->starts || !grid->items) return qmat_fail_memory(context, "a grid of points");
  for (size_t i = 0; i < count; i++) grid->starts[cell_of(grid, &points[3 * i]) + 2]++;
  for (size_t i = 0; i < cells; i++) grid->starts[i + 2] += grid->starts[i + 1];
  for (size_t i = 0; i < count; i++) grid->items[grid->starts[cell_of(grid, &points[3 * i]) + 1]++] = (uint32_t)i;
  return QMAT_OK;
}

/* The nearest point so far, and its squared distance. */
typedef struct {
  double square;
  uint32_t point;
} nearest_point;

static void search_cell(const qmat_point_grid *grid, size_t cell, const double *place, nearest_point *best) {
  for (uint32_t i = grid->starts[cell]; i < grid->starts[cell + 1]; i++) {
    const uint32_t point = grid->items[i];
    double square = 0;
    for (size_t k = 0; k < 3; k++) {
      const double d = grid->points[3 * (size_t)point + k] - place[k];
      square += d * d;
    }
    if (square < best->square || (square == best->square && point < best->point))
      *best = (nearest_point){square, point};
  }
}

/* Cells are a little larger than their width here: rounding may put a point beyond the side of its cell. */
static const double side_margin = 1e-9;

/* The square of a lower bound of the distance along an axis from `x`, which lies in cell `middle`, to the points of
 * cell `cell`. */
static double square_to_cell(const qmat_point_grid *grid, size_t axis, size_t middle, size_t cell, double x) {
  if (cell == middle) return 0;
  const double side = grid->low[axis] + grid->width * (double)(cell > middle ? cell : cell + 1);
  const double d = (cell > middle ? side - x : x - side) - side_margin * grid->width;
  return d > 0 ? d * d : 0;
}

/* Searches the cells whose largest offset from `middle` along an axis is `ring`, where they may have a nearer point.
 * Whether there is any such cell. */
static bool search_ring(const qmat_point_grid *grid, const size_t middle[3], size_t ring, const double *place,
                        nearest_point *best) {
  size_t first[3], last[3], cell[3];
  bool any = false;
  for (size_t k = 0; k < 3; k++) {
    first[k] = middle[k] > ring ? middle[k] - ring : 0;
    last[k] = middle[k] + ring < grid->along[k] ? middle[k] + ring : grid->along[k] - 1;
  }
  for (cell[0] = first[0]; cell[0] <= last[0]; cell[0]++) {
    const double square0 = square_to_cell(grid, 0, middle[0], cell[0], place[0]);
    if (square0 > best->square) continue;
    for (cell[1] = first[1]; cell[1] <= last[1]; cell[1]++) {
      const double square1 = square0 + square_to_cell(grid, 1, middle[1], cell[1], place[1]);
      if (square1 > best->square) continue;
      const bool on_side = cell[0] + ring == middle[0] || cell[0] == middle[0] + ring || cell[1] + ring == middle[1] ||
                           cell[1] == middle[1] + ring;
      for (cell[2] = first[2]; cell[2] <= last[2]; cell[2]++) {
        if (!on_side && cell[2] + ring != middle[2] && cell[2] != middle[2] + ring) continue;
        if (square1 + square_to_cell(grid, 2, middle[2], cell[2], place[2]) > best->square) continue;
        any = true;
        search_cell(grid, cell_index(grid, cell), place, best);
      }
    }
  }
  return any;
}

uint32_t qmat_point_grid_nearest(const qmat_point_grid *grid, const double place[3]) {
  size_t middle[3], rings = 1;
  for (size_t k = 0; k < 3; k++) {
    middle[k] = cell_along(grid, k, place[k]);
    if (grid->along[k] > rings) rings = grid->along[k];
  }
  nearest_point best = {INFINITY, UINT32_MAX};
  for (size_t ring = 0; ring < rings; ring++)
    if (!search_ring(grid, middle, ring, place, &best)) break; /* no cell farther away can have a nearer one */
  return best.point;
}

bool qmat_point_grid_has_within(const qmat_point_grid *grid, const double place[3], double reach) {
  size_t first[3], last[3], cell[3];
  for (size_t k = 0; k < 3; k++) {
    first[k] = cell_along(grid, k, place[k] - reach);
    last[k] = cell_along(grid, k, place[k] + reach);
  }
  nearest_point best = {INFINITY, UINT32_MAX};
  for (cell[0] = first[0]; cell[0] <= last[0]; cell[0]++)
    for (cell[1] = first[1]; cell[1] <= last[1]; cell[1]++)
      for (cell[2] = first[2]; cell[2] <= last[2]; cell[2]++) {
        search_cell(grid, cell_index(grid, cell), place, &best);
        if (best.square <= reach * reach) return true;
      }
  return false;
}
