/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/sample_spacing.h"

#include <math.h>
#include <string.h>

#include "core/geometry/half_edges.h"
#include "core/geometry/triangle.h"
#include "core/hash.h"

/* The distance between the rows of a regular triangular pattern, in spacings. */
static const double row_height = 0.86602540378443864676;
/* The range of a point's random displacement, in steps along its row and in rows. */
static const double displacement = 0.2;
/* A side that is longer than a number of spacings by rounding alone has no further point. */
static const double rounding = 1e-9;

qmat_status qmat_side_points_count(qmat_context *context, const qmat_mesh *mesh, const double *positions,
                                   const double *spacings, uint32_t *counts) {
  bool any = false;
  for (size_t i = 0; i < 3 * mesh->triangle_count; i++) {
    const size_t next = i % 3 == 2 ? i - 2 : i + 1;
    const double length =
        qmat_point_distance(&positions[3 * (size_t)mesh->triangles[i]], &positions[3 * (size_t)mesh->triangles[next]]);
    counts[i] = (uint32_t)fmax(ceil(length / spacings[i / 3] - rounding) - 1, 0);
    any |= counts[i] > 0;
  }
  if (!any) return QMAT_OK;
  qmat_half_edges sides;
  const qmat_status status =
      qmat_half_edges_sort(context, mesh->vertex_count, mesh->triangle_count, mesh->triangles, &sides);
  for (size_t first = 0, last; status == QMAT_OK && first < sides.count; first = last) {
    last = qmat_edge_last(&sides, first);
    while (first < last && counts[sides.order[first]] == 0) first++;
    for (size_t i = first + 1; i < last; i++) {
      uint32_t *own = &counts[sides.order[first]], *other = &counts[sides.order[i]];
      *own = *other > *own ? *other : *own;
      *other = 0;
    }
  }
  return status;
}

void qmat_side_points_fill(int side, uint32_t count, double *barycentrics) {
  for (uint32_t i = 0; i < count; i++) {
    const double t = (i + 1.0) / (count + 1.0);
    barycentrics[3 * i + (uint32_t)side] = 1 - t;
    barycentrics[3 * i + (uint32_t)(side + 1) % 3] = t;
    barycentrics[3 * i + (uint32_t)(side + 2) % 3] = 0;
  }
}

/* The rows of a triangle, parallel to its longest side. */
typedef struct rows {
  qmat_longest_side side;
  uint64_t count; /* of rows, without the longest side and the opposite corner */
} rows;

static rows find_rows(const double *a, const double *b, const double *c, double spacing) {
  rows r = {qmat_triangle_longest_side(a, b, c), 0};
  if (r.side.length > spacing) r.count = (uint64_t)fmax(ceil(r.side.height / (row_height * spacing)) - 1, 0);
  return r;
}

/* The height of a row as a share of the triangle's height. */
static double row_place(const rows *r, uint64_t row) {
  return (double)(row + 1) / (double)(r->count + 1);
}

static uint64_t row_points(const rows *r, uint64_t row, double spacing) {
  return (uint64_t)fmax(floor(r->side.length * (1 - row_place(r, row)) / spacing + 0.5), 1);
}

uint64_t qmat_row_points_count(const double *a, const double *b, const double *c, double spacing) {
  const rows r = find_rows(a, b, c, spacing);
  uint64_t count = 0;
  for (uint64_t row = 0; row < r.count; row++) count += row_points(&r, row, spacing);
  return count;
}

void qmat_row_points_fill(const double *a, const double *b, const double *c, double spacing, uint64_t key,
                          uint64_t wanted, double *barycentrics) {
  const rows r = find_rows(a, b, c, spacing);
  const uint64_t all = qmat_row_points_count(a, b, c, spacing);
  uint64_t index = 0, picked = 0;
  for (uint64_t row = 0; row < r.count; row++) {
    const uint64_t points = row_points(&r, row, spacing);
    for (uint64_t i = 0; i < points; i++, index++) {
      /* Point `index` is taken when the running share of wanted points passes a whole number. */
      if (picked >= wanted || (double)(index + 1) * (double)wanted < (double)(picked + 1) * (double)all) continue;
      const double x = displacement * (qmat_hash_unit(qmat_hash3(key, index, 0)) - 0.5);
      const double y = displacement * (qmat_hash_unit(qmat_hash3(key, index, 1)) - 0.5);
      const double up = row_place(&r, row) + y / (double)(r.count + 1);
      const double t = ((double)i + 0.5 + x) / (double)points;
      double *weights = &barycentrics[3 * picked++];
      weights[r.side.base] = (1 - up) * (1 - t);
      weights[(r.side.base + 1) % 3] = (1 - up) * t;
      weights[(r.side.base + 2) % 3] = 1 - weights[r.side.base] - weights[(r.side.base + 1) % 3];
    }
  }
}
