/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>

#include "nodes/skin/contour.h"

/* The id of the corner at `at`; a new corner has no owner. QMAT_NO_ID when memory is short. */
static uint32_t add_corner(qmat_contour *c, const uint32_t at[3]) {
  uint64_t key = qmat_corner_key(at);
  qmat_key_slot *slot = qmat_key_table_find(&c->corner_table, key);
  if (slot->key == key) return slot->id;
  if (qmat_grow((void **)&c->corners, &c->corner_capacity, c->corner_count + 1, sizeof *c->corners) ||
      qmat_grow((void **)&c->owners, &c->owner_capacity, c->corner_count + 1, sizeof *c->owners) ||
      !(slot = qmat_key_table_add(&c->corner_table, key))) {
    return QMAT_NO_ID;
  }
  slot->id = (uint32_t)c->corner_count;
  c->corners[c->corner_count] = key;
  c->owners[c->corner_count] = QMAT_NO_ID;
  return (uint32_t)c->corner_count++;
}

/* Adds the corners of halved cells, even where no child on that side contains surface. Without them a large cell's edge
 * could have a corner at a quarter but none at its middle. */
static qmat_status add_halved_cells(qmat_contour *c) {
  qmat_key_table seen = {0};
  qmat_status status = QMAT_OK;
  if (qmat_key_table_init(&seen, 64)) return qmat_fail_memory(c->context, "surface cells");
  uint32_t seen_count = 0;
  for (size_t i = 0; status == QMAT_OK && i < c->cells.count; i++) {
    const qmat_cell *cell = &c->cells.cells[i];
    for (uint32_t size = 2 * cell->size; size < c->cells.base; size *= 2) {
      uint32_t place[3] = {cell->at[0] & ~(size - 1), cell->at[1] & ~(size - 1), cell->at[2] & ~(size - 1)};
      uint64_t key = qmat_cell_key(place, size);
      if (qmat_key_table_id(&seen, key) != QMAT_NO_ID) break;
      qmat_key_slot *slot = qmat_key_table_add(&seen, key);
      if (slot) slot->id = seen_count++;
      bool full = !slot;
      for (unsigned k = 0; k < 8 && !full; k++) {
        uint32_t at[3];
        for (unsigned j = 0; j < 3; j++) at[j] = place[j] + (k >> j & 1) * size;
        full = add_corner(c, at) == QMAT_NO_ID;
      }
      if (full) {
        status = qmat_fail_memory(c->context, "cell corners");
        break;
      }
    }
  }
  qmat_key_table_uninit(&seen);
  return status;
}

qmat_status qmat_contour_number_corners(qmat_contour *c) {
  size_t count = c->cells.count;
  c->cell_corners = qmat_alloc(8 * count, sizeof *c->cell_corners);
  c->split_edges = qmat_calloc(count, sizeof *c->split_edges);
  /* A surface in n cells has about 2 n corners. */
  if (!c->cell_corners || !c->split_edges || qmat_key_table_init(&c->cell_table, count) ||
      qmat_key_table_init(&c->corner_table, 2 * count)) {
    return qmat_fail_memory(c->context, "surface cells");
  }
  for (size_t i = 0; i < count; i++) {
    const qmat_cell *cell = &c->cells.cells[i];
    for (unsigned k = 0; k < 8; k++) {
      uint32_t at[3];
      for (unsigned j = 0; j < 3; j++) at[j] = cell->at[j] + (k >> j & 1) * cell->size;
      uint32_t corner = add_corner(c, at);
      if (corner == QMAT_NO_ID) return qmat_fail_memory(c->context, "cell corners");
      c->cell_corners[8 * i + k] = corner;
      if (c->owners[corner] == QMAT_NO_ID) c->owners[corner] = (uint32_t)i;
    }
    uint64_t key = qmat_cell_key(cell->at, cell->size);
    qmat_key_slot *slot = qmat_key_table_add(&c->cell_table, key);
    if (!slot) return qmat_fail_memory(c->context, "surface cells");
    slot->id = (uint32_t)i;
  }
  return c->cells.refined_count > 0 ? add_halved_cells(c) : QMAT_OK;
}

/* Gives the corners inside an edge of a cell an owner, whose list of primitives is valid there. */
static void own_inner_corners(qmat_contour *c, size_t cell, const uint32_t from[3], uint32_t length, unsigned axis) {
  if (length < 2) return;
  uint32_t middle[3] = {from[0], from[1], from[2]};
  middle[axis] += length / 2;
  uint32_t corner = qmat_key_table_id(&c->corner_table, qmat_corner_key(middle));
  if (corner == QMAT_NO_ID) return;
  if (c->owners[corner] == QMAT_NO_ID) c->owners[corner] = (uint32_t)cell;
  own_inner_corners(c, cell, from, length / 2, axis);
  own_inner_corners(c, cell, middle, length / 2, axis);
}

qmat_status qmat_contour_find_split_edges(qmat_contour *c) {
  if (c->cells.refined_count == 0) return QMAT_OK;
#pragma omp parallel for num_threads(c->threads) schedule(dynamic, 512)
  for (size_t i = 0; i < c->cells.count; i++) {
    const qmat_cell *cell = &c->cells.cells[i];
    for (unsigned e = 0; cell->size > 1 && e < 12; e++) {
      uint32_t at[3];
      qmat_cell_edge_at(cell, e, at);
      at[e / 4] += cell->size / 2;
      if (qmat_key_table_id(&c->corner_table, qmat_corner_key(at)) == QMAT_NO_ID) continue;
      c->split_edges[i] = (uint16_t)(c->split_edges[i] | 1u << e);
    }
  }
  for (size_t i = 0; i < c->cells.count; i++) {
    for (unsigned e = 0; c->split_edges[i] && e < 12; e++) {
      uint32_t at[3];
      if (!(c->split_edges[i] >> e & 1)) continue;
      qmat_cell_edge_at(&c->cells.cells[i], e, at);
      own_inner_corners(c, i, at, c->cells.cells[i].size, e / 4);
    }
  }
  return QMAT_OK;
}

qmat_status qmat_contour_evaluate_corners(qmat_contour *c) {
  c->values = qmat_alloc(c->corner_count, sizeof *c->values);
  if (!c->values) return qmat_fail_memory(c->context, "cell corners");
#pragma omp parallel for num_threads(c->threads) schedule(dynamic, 512)
  for (size_t i = 0; i < c->corner_count; i++) {
    uint32_t at[3];
    double point[3];
    c->values[i] = INFINITY;
    if (c->owners[i] == QMAT_NO_ID) continue; /* touches no cell of the surface */
    qmat_corner_at(c->corners[i], at);
    qmat_contour_point(c, at, point);
    c->values[i] = qmat_cell_distance(&c->cells, &c->cells.cells[c->owners[i]], point);
  }
  return QMAT_OK;
}
