/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/hull_split.h"

#include <string.h>

#include "nodes/colliders/extreme_points.h"

enum { DIRECTIONS = QMAT_EXTREME_DIRECTIONS, ROOM = 2 * DIRECTIONS };

/* Points that are the farthest along some direction, and more before these are found. */
typedef struct few_points {
  size_t count;
  double at[3 * ROOM];
} few_points;

/* The points of the cells before each plane, and of those from it on. */
typedef struct sides {
  few_points before[QMAT_SOLID_CELLS + 1], from[QMAT_SOLID_CELLS + 1];
} sides;

static void add(few_points *all, const double *points, size_t count) {
  while (count > 0) {
    const size_t some = count < ROOM - all->count ? count : ROOM - all->count;
    memcpy(&all->at[3 * all->count], points, 3 * some * sizeof *points);
    all->count += some;
    points += 3 * some;
    count -= some;
    if (all->count == ROOM) all->count = qmat_extreme_points_first(all->at, all->count, DIRECTIONS);
  }
}

/* The columns of the hull; none where there is no hull. */
static qmat_status make_columns(few_points *points, qmat_hull_columns *columns) {
  if (points->count > DIRECTIONS) points->count = qmat_extreme_points_first(points->at, points->count, DIRECTIONS);
  return qmat_hull_columns_around(points->at, points->count, columns);
}

static void fill_sides(const qmat_solid_part *parts, const qmat_hull_pieces *hull, int axis, sides *s) {
  memset(s, 0, sizeof *s);
  few_points *slabs = s->before + 1;
  for (size_t i = 0; i < hull->count; i++) {
    const qmat_solid_part *part = &parts[hull->pieces[i].part];
    const double *at = part->cell_points;
    for (size_t c = 0; c < part->cell_count; at += 3 * (size_t)part->cells[c++].count)
      if (qmat_part_piece_has(&hull->pieces[i], &part->cells[c]))
        add(&slabs[part->cells[c].at[axis]], at, part->cells[c].first);
  }
  for (int i = QMAT_SOLID_CELLS - 1; i >= 0; i--) {
    s->from[i] = s->from[i + 1];
    add(&s->from[i], slabs[i].at, slabs[i].count);
  }
  for (int i = 1; i <= QMAT_SOLID_CELLS; i++) add(&s->before[i], s->before[i - 1].at, s->before[i - 1].count);
}

typedef struct search {
  sides *sides;
  int axis;
  double whole;
  const qmat_hull_columns **others;
  size_t other_count;
  qmat_cell_plane *best;
} search;

static qmat_status try_plane(search *s, int at) {
  qmat_hull_columns before, from = {0};
  qmat_status status = make_columns(&s->sides->before[at], &before);
  if (status == QMAT_OK) status = make_columns(&s->sides->from[at], &from);
  if (status == QMAT_OK && before.z && from.z) {
    double gain = s->whole - qmat_hull_columns_beyond(&before, s->others, s->other_count);
    s->others[s->other_count] = &before;
    gain -= qmat_hull_columns_beyond(&from, s->others, s->other_count + 1);
    if (gain > s->best->gain) *s->best = (qmat_cell_plane){s->axis, at, gain};
  }
  qmat_hull_columns_free(&before);
  qmat_hull_columns_free(&from);
  return status;
}

qmat_status qmat_hull_split_find(const qmat_solid_part *parts, const qmat_hull_pieces *hull,
                                 const qmat_hull_columns **others, size_t other_count, qmat_cell_plane planes[3]) {
  search s = {.sides = qmat_alloc(1, sizeof *s.sides), .others = others, .other_count = other_count};
  qmat_status status = s.sides ? QMAT_OK : QMAT_ERROR_MEMORY;
  for (int axis = 0; axis < 3; axis++) planes[axis] = (qmat_cell_plane){.axis = axis};
  for (s.axis = 0; s.axis < 3 && status == QMAT_OK; s.axis++) {
    s.best = &planes[s.axis];
    fill_sides(parts, hull, s.axis, s.sides);
    int low = 1, end = QMAT_SOLID_CELLS;
    while (low < end && s.sides->before[low].count == 0) low++;
    while (end > low && s.sides->from[end - 1].count == 0) end--;
    qmat_hull_columns whole;
    status = make_columns(&s.sides->from[0], &whole);
    s.whole = whole.z ? qmat_hull_columns_beyond(&whole, others, other_count) : 0;
    qmat_hull_columns_free(&whole);
    for (int at = low; at < end && status == QMAT_OK; at++) status = try_plane(&s, at);
  }
  qmat_free(s.sides);
  return status;
}
