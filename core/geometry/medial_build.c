/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/medial_build.h"

#include <string.h>

#include "core/value_check.h"
#include "core/value_table.h"

enum { SIDES_A_REPORT = 3 << 16 };

#define MOST_ROWS ((size_t)1 << 40) /* keeps 3 * count and count * 12 bytes far from overflow */

static void put_ids_in_order(uint32_t *row, size_t width) {
  for (size_t i = 1; i < width; i++) {
    for (size_t j = i; j > 0 && row[j] < row[j - 1]; j--) {
      uint32_t swap = row[j];
      row[j] = row[j - 1];
      row[j - 1] = swap;
    }
  }
}

static bool is_degenerate(const uint32_t *row, size_t width) {
  for (size_t i = 1; i < width; i++) {
    if (row[i] == row[i - 1]) return true;
  }
  return false;
}

/* Sorts the rows lexicographically, by one stable counting sort per column from last to first, and drops repeats.
 * `swap` is as large as `rows`; `starts` has sphere_count + 1 elements. `*row_count` is the number of rows, and becomes
 * that of the rows left. */
static qmat_status sort_rows(qmat_context *context, uint32_t *rows, uint32_t *swap, size_t *starts, size_t *row_count,
                             size_t width, size_t sphere_count) {
  const size_t count = *row_count;
  uint32_t *from = rows, *to = swap;
  for (size_t column = width; column-- > 0;) {
    const qmat_status status = qmat_progress(context, width - column, width + 1, "sorted columns");
    if (status != QMAT_OK) return status;
    memset(starts, 0, (sphere_count + 1) * sizeof *starts);
    for (size_t i = 0; i < count; i++) starts[from[i * width + column] + 1]++;
    for (size_t i = 0; i < sphere_count; i++) starts[i + 1] += starts[i];
    for (size_t i = 0; i < count; i++) {
      size_t place = starts[from[i * width + column]]++;
      memcpy(to + place * width, from + i * width, width * sizeof *to);
    }
    uint32_t *turn = from;
    from = to;
    to = turn;
  }
  size_t kept = 0;
  for (size_t i = 0; i < count; i++) {
    const uint32_t *row = from + i * width;
    if (i > 0 && memcmp(row, row - width, width * sizeof *row) == 0) continue;
    if (from != rows || kept != i) memcpy(rows + kept * width, row, width * sizeof *row);
    kept++;
  }
  *row_count = kept;
  return QMAT_OK;
}

qmat_status qmat_medial_set_simplices(qmat_context *context, qmat_medial *medial, const uint32_t *edges,
                                      size_t edge_count, const uint32_t *triangles, size_t triangle_count) {
  size_t sphere_count = medial->sphere_count;
  if (edge_count > MOST_ROWS || triangle_count > MOST_ROWS || sphere_count > UINT32_MAX)
    return qmat_fail_memory(context, "the edges and triangles of a medial mesh");
  qmat_status status = qmat_check_ids(context, edges, 2 * edge_count, sphere_count, "edge", 2, "sphere");
  if (status != QMAT_OK) return status;
  status = qmat_check_ids(context, triangles, 3 * triangle_count, sphere_count, "triangle", 3, "sphere");
  if (status != QMAT_OK) return status;

  size_t all_edges = edge_count + 3 * triangle_count;
  size_t largest = 2 * all_edges > 3 * triangle_count ? 2 * all_edges : 3 * triangle_count;
  uint32_t *new_triangles = qmat_alloc(triangle_count, 3 * sizeof *new_triangles);
  uint32_t *new_edges = qmat_alloc(all_edges, 2 * sizeof *new_edges);
  uint32_t *swap = qmat_alloc(largest, sizeof *swap);
  size_t *starts = qmat_alloc(sphere_count + 2, sizeof *starts);
  if (!new_triangles || !new_edges || !swap || !starts) {
    status = qmat_fail_memory(context, "the edges and triangles of a medial mesh");
    goto done;
  }

  size_t new_triangle_count = 0;
  for (size_t i = 0; i < triangle_count; i++) {
    uint32_t *row = new_triangles + 3 * new_triangle_count;
    memcpy(row, triangles + 3 * i, 3 * sizeof *row);
    put_ids_in_order(row, 3);
    if (!is_degenerate(row, 3)) new_triangle_count++;
  }
  status = sort_rows(context, new_triangles, swap, starts, &new_triangle_count, 3, sphere_count);
  if (status != QMAT_OK) goto done;

  size_t new_edge_count = 0;
  for (size_t i = 0; i < edge_count; i++) {
    uint32_t *row = new_edges + 2 * new_edge_count;
    memcpy(row, edges + 2 * i, 2 * sizeof *row);
    put_ids_in_order(row, 2);
    if (!is_degenerate(row, 2)) new_edge_count++;
  }
  for (size_t i = 0; i < new_triangle_count; i++) {
    const uint32_t *t = new_triangles + 3 * i;
    const uint32_t sides[6] = {t[0], t[1], t[0], t[2], t[1], t[2]};
    memcpy(new_edges + 2 * new_edge_count, sides, sizeof sides);
    new_edge_count += 3;
  }
  status = sort_rows(context, new_edges, swap, starts, &new_edge_count, 2, sphere_count);
  if (status != QMAT_OK) goto done;

  qmat_free(medial->edges);
  qmat_free(medial->triangles);
  medial->edges = new_edges;
  medial->edge_count = new_edge_count;
  medial->triangles = new_triangles;
  medial->triangle_count = new_triangle_count;
  new_edges = NULL;
  new_triangles = NULL;

done:
  qmat_free(starts);
  qmat_free(swap);
  qmat_free(new_edges);
  qmat_free(new_triangles);
  return status;
}

qmat_status qmat_medial_sides(qmat_context *context, const qmat_medial *medial, uint32_t *sides) {
  for (size_t i = 0; i < 3 * medial->triangle_count; i++) {
    if (i % SIDES_A_REPORT == SIDES_A_REPORT - 1) {
      const qmat_status status = qmat_progress(context, i / 3, medial->triangle_count, "triangles");
      if (status != QMAT_OK) return status;
    }
    const uint32_t *row = &medial->triangles[i - i % 3], side[2] = {row[i % 3 == 0], row[i % 3 == 2 ? 1 : 2]};
    const size_t edge = qmat_simplex_find(medial->edges, medial->edge_count, 2, side);
    if (edge == SIZE_MAX) {
      qmat_fail(context, QMAT_ERROR_INTERNAL, "the medial mesh lacks the edge %u %u", side[0], side[1]);
      return qmat_fail_element(context, "triangle", (int64_t)(i / 3));
    }
    sides[i] = (uint32_t)edge;
  }
  return QMAT_OK;
}

size_t qmat_medial_renumber(const uint32_t *rows, size_t count, size_t width, const uint32_t *ids, uint32_t *kept) {
  size_t kept_count = 0;
  for (size_t i = 0; i < count; i++) {
    bool whole = true;
    for (size_t k = 0; k < width; k++) {
      kept[width * kept_count + k] = ids[rows[width * i + k]];
      whole = whole && kept[width * kept_count + k] != QMAT_NONE;
    }
    kept_count += whole;
  }
  return kept_count;
}

qmat_medial *qmat_medial_copy(const qmat_medial *medial) {
  qmat_medial *copy = qmat_medial_new();
  if (!copy) return NULL;
  const qmat_value base = copy->base;
  bool bad = false;
  *copy = *medial;
  copy->base = base;
  for (const qmat_value_row *row = qmat_value_rows(&medial->base); row->name; row++) {
    if (!qmat_row_is_array(row)) continue;
    const void *from = qmat_row_pointer(&medial->base, row);
    const size_t count = qmat_row_count(&medial->base, row) * row->components;
    void *to = from ? qmat_alloc(count, qmat_row_element_size(row)) : NULL;
    bad |= from && !to;
    if (to && count > 0) memcpy(to, from, count * qmat_row_element_size(row));
    memcpy((char *)copy + row->offset, &to, sizeof to);
  }
  if (!bad) return copy;
  qmat_value_release(&copy->base);
  return NULL;
}
