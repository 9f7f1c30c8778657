/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <string.h>

#include "nodes/skin/contour.h"

/* The longest boundary of a cell's face, in finest cells; and the steps of the search for a zero. */
enum { LONGEST_FACE = 4 * 64, CROSSING_STEPS = 24 };

/* The cell that covers the block of `size` finest cells at `at`, itself at least that large, or QMAT_NO_ID. */
static uint32_t find_cell(const qmat_contour *c, const uint32_t at[3], uint32_t size) {
  for (; size <= c->cells.base; size *= 2) {
    uint32_t place[3] = {at[0] & ~(size - 1), at[1] & ~(size - 1), at[2] & ~(size - 1)};
    uint32_t cell = qmat_key_table_id(&c->cell_table, qmat_cell_key(place, size));
    if (cell != QMAT_NO_ID) return cell;
  }
  return QMAT_NO_ID;
}

/* The four quarters around an edge, counter-clockwise about its axis; a large cell may fill two of them. */
static void quarters_around(const qmat_contour *c, const uint32_t at[3], unsigned axis, uint32_t size,
                            uint32_t quarters[4]) {
  static const unsigned below[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (int q = 0; q < 4; q++) {
    uint32_t place[3] = {at[0], at[1], at[2]};
    place[(axis + 1) % 3] -= below[q][0] * size;
    place[(axis + 2) % 3] -= below[q][1] * size;
    quarters[q] = find_cell(c, place, size);
  }
}

/* Assigns each crossing to one cell: the first of the smallest cells around its edge. The smallest cell has the edge
 * undivided. */
static qmat_status assign_crossings(qmat_contour *c) {
  size_t count = c->cells.count;
  c->owned_edges = qmat_calloc(count, sizeof *c->owned_edges);
  c->first_crossing = qmat_alloc(count + 1, sizeof *c->first_crossing);
  if (!c->owned_edges || !c->first_crossing) return qmat_fail_memory(c->context, "surface cells");
  bool broken = false;
#pragma omp parallel for num_threads(c->threads) schedule(dynamic, 256) reduction(|| : broken)
  for (size_t i = 0; i < count; i++) {
    const qmat_cell *cell = &c->cells.cells[i];
    unsigned owned = 0;
    for (unsigned e = 0; e < 12; e++) {
      unsigned lower, upper;
      qmat_cell_edge_ends(e, &lower, &upper);
      if (c->split_edges[i] >> e & 1) continue;
      if (qmat_contour_inside(c, c->cell_corners[8 * i + lower]) ==
          qmat_contour_inside(c, c->cell_corners[8 * i + upper]))
        continue;
      uint32_t at[3], quarters[4];
      qmat_cell_edge_at(cell, e, at);
      quarters_around(c, at, e / 4, cell->size, quarters);
      bool first = true;
      for (int q = 0; q < 4; q++) {
        if (quarters[q] == QMAT_NO_ID)
          broken = true;
        else if (quarters[q] < i && c->cells.cells[quarters[q]].size == cell->size)
          first = false;
      }
      if (first) owned |= 1u << e;
    }
    c->owned_edges[i] = (uint16_t)owned;
  }
  if (broken) return qmat_fail(c->context, QMAT_ERROR_INTERNAL, "a crossing of the envelope's surface lies in no cell");
  size_t total = 0;
  for (size_t i = 0; i < count; i++) {
    c->first_crossing[i] = total;
    total += (size_t)__builtin_popcount(c->owned_edges[i]);
  }
  c->first_crossing[count] = c->crossing_count = total;
  if (total > UINT32_MAX / 8) return qmat_fail_memory(c->context, "surface vertices");
  return QMAT_OK;
}

/* Finds the zero of F between two points of opposite sign by regula falsi with the Illinois weights. */
static void find_zero(const qmat_contour *c, const qmat_cell *cell, const double from[3], double f_from,
                      const double to[3], double f_to, double position[3], double normal[3]) {
  double low = 0, high = 1, f_low = f_from, f_high = f_to, tolerance = 1e-6 * c->cells.finest * cell->size;
  int last = 0;
  for (int step = 0; step < CROSSING_STEPS; step++) {
    double t = low + (high - low) * (f_low / (f_low - f_high));
    if (!(t > low && t < high)) t = 0.5 * (low + high);
    for (int k = 0; k < 3; k++) position[k] = from[k] + t * (to[k] - from[k]);
    double f = qmat_cell_gradient(&c->cells, cell, position, normal);
    if (fabs(f) <= tolerance) return;
    if ((f < 0) == (f_low < 0)) {
      low = t, f_low = f;
      if (last == -1) f_high *= 0.5;
      last = -1;
    } else {
      high = t, f_high = f;
      if (last == 1) f_low *= 0.5;
      last = 1;
    }
  }
}

static uint32_t face_name(const qmat_contour *c, uint32_t a, uint32_t b, unsigned axis) {
  const qmat_cell *first = &c->cells.cells[a], *second = &c->cells.cells[b];
  bool a_below = first->at[axis] < second->at[axis];
  if (first->size < second->size || (first->size == second->size && a_below)) return a * 8 + axis * 2 + a_below;
  return b * 8 + axis * 2 + !a_below;
}

static void fill_crossing(qmat_contour *c, size_t cell_id, unsigned e, qmat_crossing *x) {
  const qmat_cell *cell = &c->cells.cells[cell_id];
  unsigned lower, upper, axis = e / 4;
  qmat_cell_edge_ends(e, &lower, &upper);
  *x = (qmat_crossing){.lower = c->cell_corners[8 * cell_id + lower],
                       .upper = c->cell_corners[8 * cell_id + upper],
                       .axis = (uint8_t)axis,
                       .between = {QMAT_NO_ID, QMAT_NO_ID, QMAT_NO_ID, QMAT_NO_ID},
                       .vertices = {QMAT_NO_ID, QMAT_NO_ID, QMAT_NO_ID, QMAT_NO_ID}};
  x->inside_below = qmat_contour_inside(c, x->lower);
  uint32_t at[3], to[3], quarters[4];
  qmat_cell_edge_at(cell, e, at);
  quarters_around(c, at, axis, cell->size, quarters);
  for (unsigned q = 0; q < 4; q++) {
    uint32_t a = quarters[q], b = quarters[(q + 1) % 4];
    if (a == b) continue;
    /* Quarters 0 and 1, and 2 and 3, differ along the next axis; the others along the one after. */
    x->cells[x->count] = a;
    x->faces[x->count++] = face_name(c, a, b, (axis + 1 + (q & 1)) % 3);
  }
  double from_point[3], to_point[3];
  memcpy(to, at, sizeof to);
  to[axis] += cell->size;
  qmat_contour_point(c, at, from_point);
  qmat_contour_point(c, to, to_point);
  find_zero(c, cell, from_point, c->values[x->lower], to_point, c->values[x->upper], x->position, x->normal);
}

qmat_status qmat_contour_find_crossings(qmat_contour *c) {
  qmat_status status = assign_crossings(c);
  if (status != QMAT_OK) return status;
  c->crossings = qmat_alloc(c->crossing_count, sizeof *c->crossings);
  c->crossing_at = qmat_alloc(3 * c->corner_count, sizeof *c->crossing_at);
  if (!c->crossings || !c->crossing_at) return qmat_fail_memory(c->context, "surface vertices");
  memset(c->crossing_at, 0xff, 3 * c->corner_count * sizeof *c->crossing_at);
#pragma omp parallel for num_threads(c->threads) schedule(dynamic, 128)
  for (size_t i = 0; i < c->cells.count; i++) {
    size_t next = c->first_crossing[i];
    for (unsigned e = 0; e < 12; e++) {
      if (!(c->owned_edges[i] >> e & 1)) continue;
      qmat_crossing *x = &c->crossings[next];
      fill_crossing(c, i, e, x);
      c->crossing_at[3 * (size_t)x->lower + x->axis] = (uint32_t)next++;
    }
  }
  return QMAT_OK;
}

/* The corners around a face in order, with the axis and direction of the step to the next one. */
typedef struct face_walk {
  int count;
  uint32_t corners[LONGEST_FACE];
  uint8_t axes[LONGEST_FACE];
  bool up[LONGEST_FACE];
} face_walk;

/* Appends the corners from `from` to `to` without `to`. */
static void walk_side(const qmat_contour *c, face_walk *walk, const uint32_t from[3], const uint32_t to[3],
                      unsigned axis) {
  bool up = from[axis] < to[axis];
  uint32_t length = up ? to[axis] - from[axis] : from[axis] - to[axis];
  if (length > 1) {
    uint32_t middle[3] = {from[0], from[1], from[2]};
    middle[axis] = up ? from[axis] + length / 2 : from[axis] - length / 2;
    if (qmat_key_table_id(&c->corner_table, qmat_corner_key(middle)) != QMAT_NO_ID) {
      walk_side(c, walk, from, middle, axis);
      walk_side(c, walk, middle, to, axis);
      return;
    }
  }
  walk->corners[walk->count] = qmat_key_table_id(&c->corner_table, qmat_corner_key(from));
  walk->axes[walk->count] = (uint8_t)axis;
  walk->up[walk->count++] = up;
}

static void walk_face(const qmat_contour *c, uint32_t face, face_walk *walk) {
  uint32_t id = face / 8;
  const qmat_cell *cell = &c->cells.cells[id];
  unsigned axis = face % 8 / 2, high = face & 1, b = (axis + 1) % 3, d = (axis + 2) % 3;
  static const unsigned corners[5][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}};
  walk->count = 0;
  for (int s = 0; s < 4; s++) {
    unsigned from = high << axis | corners[s][0] << b | corners[s][1] << d;
    unsigned to = high << axis | corners[s + 1][0] << b | corners[s + 1][1] << d;
    unsigned along = s & 1 ? d : b, lower = from & to;
    unsigned e = along * 4 + (lower >> ((along + 1) % 3) & 1) + 2 * (lower >> ((along + 2) % 3) & 1);
    if (c->split_edges[id] >> e & 1) {
      uint32_t start[3], end[3];
      for (unsigned j = 0; j < 3; j++) {
        start[j] = cell->at[j] + (from >> j & 1) * cell->size;
        end[j] = cell->at[j] + (to >> j & 1) * cell->size;
      }
      walk_side(c, walk, start, end, along);
    } else {
      walk->corners[walk->count] = c->cell_corners[8 * (size_t)id + from];
      walk->axes[walk->count] = (uint8_t)along;
      walk->up[walk->count++] = from < to;
    }
  }
}

/* Finds the other end of the surface's trace on a face. A trace separates one run of inside corners from the rest: the
 * walk follows the run from the crossing to its end. Both cells at the face find the same trace. */
static bool find_partner(qmat_contour *c, size_t id, int slot) {
  qmat_crossing *x = &c->crossings[id];
  face_walk walk;
  walk_face(c, x->faces[slot], &walk);
  int start = -1, changes = 0;
  for (int i = 0; i < walk.count; i++) {
    int next = i + 1 < walk.count ? i + 1 : 0;
    changes += qmat_contour_inside(c, walk.corners[i]) != qmat_contour_inside(c, walk.corners[next]);
    uint32_t lower = walk.corners[walk.up[i] ? i : next];
    if (lower == x->lower && walk.axes[i] == x->axis) start = i;
  }
  if (start < 0) return false;
  x->shared[slot] = changes > 2;
  /* Step i goes from corner i to the next; walk away from the outside end. */
  int i = start, step = qmat_contour_inside(c, walk.corners[start]) ? walk.count - 1 : 1, other = -1;
  for (int moves = 0; moves < walk.count; moves++) {
    i = (i + step) % walk.count;
    int next = (i + 1) % walk.count;
    if (qmat_contour_inside(c, walk.corners[i]) != qmat_contour_inside(c, walk.corners[next])) {
      other = i;
      break;
    }
  }
  if (other < 0 || other == start) return false;
  uint32_t lower = walk.corners[walk.up[other] ? other : (other + 1) % walk.count];
  uint32_t partner = c->crossing_at[3 * (size_t)lower + walk.axes[other]];
  if (partner == QMAT_NO_ID) return false;
  const qmat_crossing *y = &c->crossings[partner];
  for (int j = 0; j < y->count; j++) {
    if (y->faces[j] != x->faces[slot]) continue;
    x->partners[slot] = partner * 4 + (uint32_t)j;
    return true;
  }
  return false;
}

qmat_status qmat_contour_find_partners(qmat_contour *c) {
  bool broken = false;
#pragma omp parallel for num_threads(c->threads) schedule(dynamic, 256) reduction(|| : broken)
  for (size_t i = 0; i < c->crossing_count; i++) {
    for (int j = 0; j < c->crossings[i].count; j++) broken = !find_partner(c, i, j) || broken;
  }
  if (broken) return qmat_fail(c->context, QMAT_ERROR_INTERNAL, "a trace of the envelope's surface has no end");
  return QMAT_OK;
}
