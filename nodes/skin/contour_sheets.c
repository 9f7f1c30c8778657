/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/eigen.h"
#include "nodes/skin/contour.h"

/* Vertices keep this far from the sides of their cells, in cells: no two vertices meet. */
static const double INSET = 0.005;
/* In directions that are flatter than this share of the most curved one, a sheet's vertex stays at the mean of its
 * crossings. */
static const double FLAT_EIGENVALUE = 0.05;
enum { BOX_STEPS = 16, PROJECTION_STEPS = 4 };

/* Each closed chain of traces on the faces of one cell bounds a sheet. */
qmat_status qmat_contour_find_sheets(qmat_contour *c) {
  size_t slots = 0, cell_capacity = 0, first_capacity = 0, filled = 0;
  for (size_t i = 0; i < c->crossing_count; i++) slots += c->crossings[i].count;
  c->items = qmat_alloc(slots, sizeof *c->items);
  if (!c->items) return qmat_fail_memory(c->context, "surface vertices");
  for (size_t i = 0; i < c->crossing_count; i++) {
    for (int j = 0; j < c->crossings[i].count; j++) {
      if (c->crossings[i].vertices[j] != QMAT_NO_ID) continue;
      uint32_t cell = c->crossings[i].cells[j];
      if (qmat_grow((void **)&c->sheet_cells, &cell_capacity, c->sheet_count + 1, sizeof *c->sheet_cells) ||
          qmat_grow((void **)&c->sheet_items, &first_capacity, c->sheet_count + 2, sizeof *c->sheet_items)) {
        return qmat_fail_memory(c->context, "surface vertices");
      }
      c->sheet_cells[c->sheet_count] = cell;
      c->sheet_items[c->sheet_count] = filled;
      qmat_crossing *x = &c->crossings[i];
      int slot = j, leave = j; /* cell j lies between faces j - 1 and j */
      while (x->vertices[slot] == QMAT_NO_ID) {
        if (filled == slots) return qmat_fail(c->context, QMAT_ERROR_INTERNAL, "a sheet of the surface does not close");
        x->vertices[slot] = (uint32_t)c->sheet_count;
        c->items[filled++] = (uint32_t)(x - c->crossings);
        uint32_t partner = x->partners[leave];
        x = &c->crossings[partner / 4];
        int face = (int)(partner % 4);
        if (x->cells[face] == cell) {
          slot = face;
          leave = face == 0 ? x->count - 1 : face - 1;
        } else {
          slot = leave = face + 1 == x->count ? 0 : face + 1;
          if (x->cells[slot] != cell)
            return qmat_fail(c->context, QMAT_ERROR_INTERNAL, "a sheet of the surface leaves its cell");
        }
      }
      c->sheet_items[++c->sheet_count] = filled;
    }
  }
  c->vertex_count = c->sheet_count;
  return QMAT_OK;
}

/* The region of a cell where its vertices may lie. */
static void inner_box(const qmat_contour *c, const qmat_cell *cell, double low[3], double high[3]) {
  for (int k = 0; k < 3; k++) {
    low[k] = c->cells.origin[k] + c->cells.finest * (cell->at[k] + INSET * cell->size);
    high[k] = c->cells.origin[k] + c->cells.finest * (cell->at[k] + (1 - INSET) * cell->size);
  }
}

static bool into_box(const double low[3], const double high[3], double point[3]) {
  bool moved = false;
  for (int k = 0; k < 3; k++) {
    double x = fmin(fmax(point[k], low[k]), high[k]);
    moved = moved || x != point[k];
    point[k] = x;
  }
  return moved;
}

/* Places the vertex of a sheet: the point of its cell nearest to the tangent planes at its crossings, then moved along
 * the gradient onto the surface. */
static void place_sheet(qmat_contour *c, size_t sheet) {
  const qmat_cell *cell = &c->cells.cells[c->sheet_cells[sheet]];
  size_t first = c->sheet_items[sheet], end = c->sheet_items[sheet + 1];
  double mean[3] = {0}, m[3][3] = {{0}}, diagonal[3][3], v[3][3], b[3] = {0}, *point = c->positions + 3 * sheet;
  double low[3], high[3];
  inner_box(c, cell, low, high);
  for (size_t i = first; i < end; i++) {
    for (int k = 0; k < 3; k++) mean[k] += c->crossings[c->items[i]].position[k];
  }
  for (int k = 0; k < 3; k++) mean[k] /= (double)(end - first);
  for (size_t i = first; i < end; i++) {
    const qmat_crossing *x = &c->crossings[c->items[i]];
    double offset = 0;
    for (int k = 0; k < 3; k++) offset += x->normal[k] * (x->position[k] - mean[k]);
    for (int k = 0; k < 3; k++) {
      b[k] += offset * x->normal[k];
      for (int l = 0; l < 3; l++) m[k][l] += x->normal[k] * x->normal[l];
    }
  }
  memcpy(diagonal, m, sizeof m);
  qmat_symmetric_eigen(diagonal, v);
  double largest = fmax(diagonal[0][0], fmax(diagonal[1][1], diagonal[2][2]));
  memcpy(point, mean, sizeof mean);
  for (int e = 0; e < 3; e++) {
    if (!(diagonal[e][e] > FLAT_EIGENVALUE * largest)) continue;
    double along = (v[0][e] * b[0] + v[1][e] * b[1] + v[2][e] * b[2]) / diagonal[e][e];
    for (int k = 0; k < 3; k++) point[k] += along * v[k][e];
  }
  if (into_box(low, high, point)) {
    /* The same least squares within the box, by projected Gauss-Seidel. In flat directions a weak pull keeps the point
     * at the mean. */
    double pull = 0.5 * FLAT_EIGENVALUE * largest;
    for (int step = 0; step < BOX_STEPS; step++) {
      for (int k = 0; k < 3; k++) {
        double rest = b[k];
        for (int l = 0; l < 3; l++) rest -= l == k ? 0 : m[k][l] * (point[l] - mean[l]);
        point[k] = fmin(fmax(mean[k] + rest / (m[k][k] + pull), low[k]), high[k]);
      }
    }
  }
  double tolerance = 1e-6 * c->cells.finest * cell->size;
  for (int step = 0; step < PROJECTION_STEPS; step++) {
    double gradient[3], f = qmat_cell_gradient(&c->cells, cell, point, gradient);
    if (fabs(f) <= tolerance) break;
    for (int k = 0; k < 3; k++) point[k] -= f * gradient[k];
    into_box(low, high, point);
  }
}

typedef struct trace {
  uint32_t low, high; /* sheets at its two sides */
  uint32_t slot;      /* crossing * 4 + face */
} trace;

static int by_sheets(const void *left, const void *right) {
  const trace *a = left, *b = right;
  if (a->low != b->low) return a->low < b->low ? -1 : 1;
  if (a->high != b->high) return a->high < b->high ? -1 : 1;
  return (a->slot > b->slot) - (a->slot < b->slot);
}

/* Two sheets that meet along several traces would share several edges. All traces but the first get a vertex of their
 * own. This happens only on faces with several traces. */
qmat_status qmat_contour_part_doubled_edges(qmat_contour *c) {
  trace *traces = NULL;
  size_t count = 0, capacity = 0, extra = 0;
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < c->crossing_count; i++) {
    const qmat_crossing *x = &c->crossings[i];
    for (uint32_t j = 0; j < x->count; j++) {
      uint32_t slot = (uint32_t)i * 4 + j;
      if (!x->shared[j] || x->partners[j] < slot) continue;
      if (qmat_grow((void **)&traces, &capacity, count + 1, sizeof *traces)) {
        status = qmat_fail_memory(c->context, "surface vertices");
        goto done;
      }
      uint32_t a = x->vertices[j], b = x->vertices[j + 1 == x->count ? 0 : j + 1];
      traces[count++] = (trace){.low = a < b ? a : b, .high = a < b ? b : a, .slot = slot};
    }
  }
  if (count == 0) goto done;
  qsort(traces, count, sizeof *traces, by_sheets);
  for (size_t i = 1; i < count; i++)
    extra += traces[i].low == traces[i - 1].low && traces[i].high == traces[i - 1].high;
  if (extra == 0) goto done;
  if (qmat_grow((void **)&c->positions, &c->vertex_capacity, 3 * (c->vertex_count + extra), sizeof *c->positions)) {
    status = qmat_fail_memory(c->context, "surface vertices");
    goto done;
  }
  for (size_t i = 1; i < count; i++) {
    if (traces[i].low != traces[i - 1].low || traces[i].high != traces[i - 1].high) continue;
    qmat_crossing *x = &c->crossings[traces[i].slot / 4];
    uint32_t partner = x->partners[traces[i].slot % 4];
    qmat_crossing *y = &c->crossings[partner / 4];
    for (int k = 0; k < 3; k++) c->positions[3 * c->vertex_count + (size_t)k] = 0.5 * (x->position[k] + y->position[k]);
    x->between[traces[i].slot % 4] = y->between[partner % 4] = (uint32_t)c->vertex_count++;
  }
done:
  qmat_free(traces);
  return status;
}

qmat_status qmat_contour_place_sheets(qmat_contour *c) {
  if (qmat_grow((void **)&c->positions, &c->vertex_capacity, 3 * c->sheet_count, sizeof *c->positions))
    return qmat_fail_memory(c->context, "surface vertices");
#pragma omp parallel for num_threads(c->threads) schedule(dynamic, 128)
  for (size_t i = 0; i < c->sheet_count; i++) place_sheet(c, i);
  return QMAT_OK;
}
