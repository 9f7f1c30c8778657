/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"

#include "nodes/skin/contour.h"

/* Triangles below this shape (area over the square of the longest side) are avoided. */
static const double POOR_SHAPE = 0.01, DEGENERATE_SHAPE = 1e-6;

/* The area over the square of the longest side; 0.433 for an equilateral triangle. */
static double triangle_shape(const double *a, const double *b, const double *d) {
  double u[3], v[3], longest = 0, w2 = 0, u2 = 0, v2 = 0;
  for (int k = 0; k < 3; k++) {
    u[k] = b[k] - a[k];
    v[k] = d[k] - a[k];
    u2 += u[k] * u[k];
    v2 += v[k] * v[k];
    w2 += (v[k] - u[k]) * (v[k] - u[k]);
  }
  longest = fmax(u2, fmax(v2, w2));
  double n[3];
  qmat_cross(u, v, n);
  return longest > 0 ? 0.5 * sqrt(qmat_dot(n, n)) / longest : 0;
}

enum cut { CUT_NONE, CUT_FIRST, CUT_SECOND, CUT_FAN };

static unsigned polygon_of(const qmat_crossing *x, uint32_t polygon[8]) {
  unsigned n = 0;
  for (unsigned j = 0; j < x->count; j++) {
    polygon[n++] = x->vertices[j];
    if (x->between[j] != QMAT_NO_ID) polygon[n++] = x->between[j];
  }
  return n;
}

/* How to cut the polygon of a crossing. A triangle stays. A quadrangle is cut along the diagonal nearer to the surface.
 * Other polygons, and those that would give a degenerate triangle, become a fan around the crossing. */
static enum cut choose_cut(const qmat_contour *c, const qmat_crossing *x) {
  uint32_t polygon[8];
  unsigned n = polygon_of(x, polygon);
  const double *p[4];
  for (unsigned i = 0; i < n && i < 4; i++) p[i] = c->positions + 3 * (size_t)polygon[i];
  if (n == 3) return triangle_shape(p[0], p[1], p[2]) > DEGENERATE_SHAPE ? CUT_NONE : CUT_FAN;
  if (n > 4 || x->count != 4) return CUT_FAN;
  uint32_t at[3], to[3];
  qmat_corner_at(c->corners[x->lower], at);
  qmat_corner_at(c->corners[x->upper], to);
  uint32_t length = to[x->axis] - at[x->axis];
  double shapes[2], errors[2];
  for (int d = 0; d < 2; d++) {
    const qmat_cell *a = &c->cells.cells[x->cells[d]], *b = &c->cells.cells[x->cells[d + 2]];
    shapes[d] = fmin(triangle_shape(p[d], p[d + 1], p[d + 2]), triangle_shape(p[d], p[d + 2], p[(d + 3) % 4]));
    /* Two cells both longer than the edge may face each other across the next edge too; the diagonal could then occur
     * twice. */
    if (a->size != length && b->size != length) shapes[d] = -1;
    double middle[3];
    for (int k = 0; k < 3; k++) middle[k] = 0.5 * (p[d][k] + p[d + 2][k]);
    const qmat_cell *smaller = a->size <= b->size ? a : b;
    errors[d] = fabs(qmat_cell_distance(&c->cells, smaller, middle));
  }
  double better = fmax(shapes[0], shapes[1]), worse = fmin(shapes[0], shapes[1]);
  if (!(better > DEGENERATE_SHAPE)) return CUT_FAN;
  if (worse < POOR_SHAPE) return shapes[0] >= shapes[1] ? CUT_FIRST : CUT_SECOND;
  /* Of equally near diagonals, the one with rounder triangles. */
  double margin = 0.01 * c->cells.finest * length;
  if (fabs(errors[0] - errors[1]) > margin) return errors[0] < errors[1] ? CUT_FIRST : CUT_SECOND;
  return shapes[0] >= shapes[1] ? CUT_FIRST : CUT_SECOND;
}

qmat_status qmat_contour_make_triangles(qmat_contour *c, qmat_skin_triangles *surface) {
  uint8_t *cuts = qmat_alloc(c->crossing_count, sizeof *cuts);
  size_t *first = qmat_alloc(c->crossing_count + 1, sizeof *first);
  qmat_status status = QMAT_OK;
  if (!cuts || !first) {
    status = qmat_fail_memory(c->context, "surface triangles");
    goto done;
  }
#pragma omp parallel for num_threads(c->threads) schedule(dynamic, 256)
  for (size_t i = 0; i < c->crossing_count; i++) cuts[i] = (uint8_t)choose_cut(c, &c->crossings[i]);
  size_t triangles = 0, fans = 0;
  for (size_t i = 0; i < c->crossing_count; i++) {
    uint32_t polygon[8];
    unsigned n = polygon_of(&c->crossings[i], polygon);
    first[i] = triangles;
    triangles += cuts[i] == CUT_FAN ? n : n - 2;
    fans += cuts[i] == CUT_FAN;
  }
  if (c->vertex_count + fans >= QMAT_NO_ID ||
      qmat_grow((void **)&c->positions, &c->vertex_capacity, 3 * (c->vertex_count + fans), sizeof *c->positions)) {
    status = qmat_fail_memory(c->context, "surface vertices");
    goto done;
  }
  surface->triangles = qmat_alloc(3 * triangles, sizeof *surface->triangles);
  if (!surface->triangles) {
    status = qmat_fail_memory(c->context, "surface triangles");
    goto done;
  }
  for (size_t i = 0; i < c->crossing_count; i++) {
    const qmat_crossing *x = &c->crossings[i];
    uint32_t polygon[8], *out = surface->triangles + 3 * first[i];
    unsigned n = polygon_of(x, polygon);
    /* The polygon turns about the edge's axis: outwards where the inside is below. */
    if (!x->inside_below) {
      for (unsigned j = 0; j < n / 2; j++) {
        uint32_t swap = polygon[j];
        polygon[j] = polygon[n - 1 - j];
        polygon[n - 1 - j] = swap;
      }
    }
    if (cuts[i] == CUT_FAN) {
      uint32_t centre = (uint32_t)c->vertex_count++;
      memcpy(c->positions + 3 * (size_t)centre, x->position, sizeof x->position);
      for (unsigned j = 0; j < n; j++) {
        *out++ = centre;
        *out++ = polygon[j];
        *out++ = polygon[(j + 1) % n];
      }
      continue;
    }
    /* The first diagonal joins polygon corners 0 and 2; turned around, these are 3 and 1. */
    unsigned start = n == 4 && (cuts[i] == CUT_FIRST) != x->inside_below ? 1 : 0;
    for (unsigned j = 1; j + 1 < n; j++) {
      *out++ = polygon[start];
      *out++ = polygon[(start + j) % n];
      *out++ = polygon[(start + j + 1) % n];
    }
  }
  surface->triangle_count = triangles;
  surface->vertex_count = c->vertex_count;
  surface->positions = c->positions;
  c->positions = NULL;
done:
  qmat_free(cuts);
  qmat_free(first);
  return status;
}
