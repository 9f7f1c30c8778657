/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/hull_columns.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "nodes/colliders/convex_hull_cgal.h"

enum { LINES = 256 };

/* Twice the area from which on a triangle is not vertical; lines so near to a triangle's side meet it. */
static const double least_area = 1e-14, beside = 1e-12;

/* The first line from a place on. */
static int line_from(double x) {
  return (int)fmax(ceil((x + 0.5) * LINES - 0.5), 0);
}

static double place_of(int line) {
  return (line + 0.5) / LINES - 0.5;
}

static double side_of(const double *p, const double *q, double x, double y) {
  return (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
}

static void find_range(const double *const *points, size_t count, int low[2], int end[2]) {
  for (int k = 0; k < 2; k++) {
    double least = INFINITY, most = -INFINITY;
    for (size_t i = 0; i < count; i++) {
      least = qmat_smaller(least, points[i][k]);
      most = qmat_larger(most, points[i][k]);
    }
    low[k] = line_from(least);
    end[k] = line_from(most);
    if (end[k] > LINES) end[k] = LINES;
    if (end[k] < low[k]) end[k] = low[k];
  }
}

static void add_triangle(qmat_hull_columns *c, const double *const p[3]) {
  const double area = side_of(p[0], p[1], p[2][0], p[2][1]);
  int low[2], end[2];
  if (!(fabs(area) > least_area)) return;
  find_range(p, 3, low, end);
  for (int i = low[0]; i < end[0]; i++)
    for (int j = low[1]; j < end[1]; j++) {
      const double x = place_of(i), y = place_of(j);
      const double a = side_of(p[1], p[2], x, y) / area, b = side_of(p[2], p[0], x, y) / area, rest = 1 - a - b;
      if (a < -beside || b < -beside || rest < -beside) continue;
      const double at = a * p[0][2] + b * p[1][2] + rest * p[2][2];
      double *z = &c->z[2 * ((size_t)(i - c->low[0]) * (size_t)c->count[1] + (size_t)(j - c->low[1]))];
      z[0] = qmat_smaller(z[0], at);
      z[1] = qmat_larger(z[1], at);
    }
}

qmat_status qmat_hull_columns_make(const double *points, const uint32_t *triangles, size_t triangle_count,
                                   qmat_hull_columns *c) {
  int low[2] = {LINES, LINES}, end[2] = {0, 0};
  for (int pass = 0; pass < 2; pass++) {
    for (size_t t = 0; t < triangle_count; t++) {
      const double *corners[3];
      int from[2], to[2];
      for (size_t k = 0; k < 3; k++) corners[k] = &points[3 * (size_t)triangles[3 * t + k]];
      if (pass > 0) {
        add_triangle(c, corners);
        continue;
      }
      find_range(corners, 3, from, to);
      for (int k = 0; k < 2; k++) {
        low[k] = from[k] < low[k] ? from[k] : low[k];
        end[k] = to[k] > end[k] ? to[k] : end[k];
      }
    }
    if (pass > 0) break;
    *c = (qmat_hull_columns){.low = {low[0], low[1]}};
    for (int k = 0; k < 2; k++) c->count[k] = end[k] > low[k] ? end[k] - low[k] : 0;
    const size_t lines = (size_t)c->count[0] * (size_t)c->count[1];
    c->z = qmat_alloc(lines, 2 * sizeof *c->z);
    if (!c->z) return QMAT_ERROR_MEMORY;
    for (size_t i = 0; i < lines; i++) {
      c->z[2 * i] = INFINITY;
      c->z[2 * i + 1] = -INFINITY;
    }
  }
  return QMAT_OK;
}

qmat_status qmat_hull_columns_around(const double *points, size_t count, qmat_hull_columns *columns) {
  size_t triangle_count;
  *columns = (qmat_hull_columns){0};
  if (count < 4) return QMAT_OK;
  uint32_t *triangles = qmat_alloc(count, 6 * sizeof *triangles);
  if (!triangles) return QMAT_ERROR_MEMORY;
  qmat_status status = qmat_convex_hull(points, count, triangles, &triangle_count);
  if (status == QMAT_OK) status = qmat_hull_columns_make(points, triangles, triangle_count, columns);
  qmat_free(triangles);
  return status == QMAT_ERROR_GEOMETRY ? QMAT_OK : status;
}

void qmat_hull_columns_free(qmat_hull_columns *columns) {
  qmat_free(columns->z);
  *columns = (qmat_hull_columns){0};
}

bool qmat_hull_columns_meet(const qmat_hull_columns *a, const qmat_hull_columns *b) {
  for (int k = 0; k < 2; k++)
    if (a->low[k] >= b->low[k] + b->count[k] || b->low[k] >= a->low[k] + a->count[k]) return false;
  return true;
}

/* What a hull has of a line; NULL for none. */
static const double *column_at(const qmat_hull_columns *c, int i, int j) {
  i -= c->low[0];
  j -= c->low[1];
  if (i < 0 || j < 0 || i >= c->count[0] || j >= c->count[1]) return NULL;
  const double *z = &c->z[2 * ((size_t)i * (size_t)c->count[1] + (size_t)j)];
  return z[0] <= z[1] ? z : NULL;
}

double qmat_hull_columns_beyond(const qmat_hull_columns *of, const qmat_hull_columns *const *others, size_t count) {
  double sum = 0;
  for (int i = of->low[0]; i < of->low[0] + of->count[0]; i++)
    for (int j = of->low[1]; j < of->low[1] + of->count[1]; j++) {
      const double *z = column_at(of, i, j);
      if (!z) continue;
      for (double at = z[0]; at < z[1];) {
        /* From here either others go on to `covered`, or none does before `next`. */
        double covered = at, next = z[1];
        for (size_t k = 0; k < count; k++) {
          const double *other = column_at(others[k], i, j);
          if (!other || other[1] <= at) continue;
          if (other[0] <= at)
            covered = qmat_larger(covered, other[1]);
          else
            next = qmat_smaller(next, other[0]);
        }
        if (covered > at) {
          at = covered;
          continue;
        }
        sum += next - at;
        at = next;
      }
    }
  return sum / ((double)LINES * LINES);
}
