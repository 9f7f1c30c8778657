/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/part_pieces.h"

#include <string.h>

#include "nodes/colliders/extreme_points.h"

/* Coarse points are dropped so far outside of the hull of the others. */
static const double coarse_dropped = 4e-4;

qmat_part_piece qmat_part_whole(uint32_t part) {
  return (qmat_part_piece){.part = part, .end = {QMAT_SOLID_CELLS, QMAT_SOLID_CELLS, QMAT_SOLID_CELLS}};
}

static bool is_whole(const qmat_part_piece *piece) {
  const qmat_part_piece whole = qmat_part_whole(piece->part);
  return memcmp(piece->low, whole.low, sizeof whole.low) == 0 && memcmp(piece->end, whole.end, sizeof whole.end) == 0;
}

bool qmat_part_piece_has(const qmat_part_piece *piece, const qmat_solid_cell *cell) {
  for (int k = 0; k < 3; k++)
    if (cell->at[k] < piece->low[k] || cell->at[k] >= piece->end[k]) return false;
  return true;
}

qmat_status qmat_hull_pieces_points(const qmat_solid_part *parts, const qmat_hull_pieces *hull, bool coarse,
                                    double **points, size_t *count) {
  const double tolerance = coarse ? coarse_dropped : qmat_solid_dropped;
  qmat_point_heap all = {0};
  bool done = true;
  for (size_t i = 0; i < hull->count && done; i++) {
    const qmat_part_piece *piece = &hull->pieces[i];
    const qmat_solid_part *part = &parts[piece->part];
    if (!coarse && is_whole(piece)) {
      done = qmat_point_heap_add(&all, part->points, part->count, tolerance);
      continue;
    }
    const double *at = part->cell_points;
    for (size_t c = 0; c < part->cell_count && done; at += 3 * (size_t)part->cells[c++].count)
      if (qmat_part_piece_has(piece, &part->cells[c]))
        done = qmat_point_heap_add(&all, at, coarse ? part->cells[c].first : part->cells[c].count, tolerance);
  }
  if (done) done = qmat_extreme_points_keep(all.points, &all.count, tolerance) == QMAT_OK;
  if (!done) qmat_free(all.points);
  *points = done ? all.points : NULL;
  *count = done ? all.count : 0;
  return done ? QMAT_OK : QMAT_ERROR_MEMORY;
}

qmat_status qmat_hull_pieces_split(const qmat_hull_pieces *hull, qmat_cell_plane plane, qmat_hull_pieces halves[2]) {
  for (int h = 0; h < 2; h++) {
    halves[h] = (qmat_hull_pieces){.pieces = qmat_alloc(hull->count, sizeof *halves[h].pieces), .shape = hull->shape};
    for (size_t i = 0; halves[h].pieces && i < hull->count; i++) {
      qmat_part_piece piece = hull->pieces[i];
      uint8_t *limit = h == 0 ? &piece.end[plane.axis] : &piece.low[plane.axis];
      if (h == 0 ? *limit > plane.at : *limit < plane.at) *limit = (uint8_t)plane.at;
      if (piece.low[plane.axis] < piece.end[plane.axis]) halves[h].pieces[halves[h].count++] = piece;
    }
  }
  if (halves[0].pieces && halves[1].pieces) return QMAT_OK;
  for (int h = 0; h < 2; h++) {
    qmat_free(halves[h].pieces);
    halves[h] = (qmat_hull_pieces){0};
  }
  return QMAT_ERROR_MEMORY;
}

qmat_status qmat_hull_pieces_join(const qmat_hull_pieces *a, const qmat_hull_pieces *b, qmat_hull_pieces *joint) {
  *joint = (qmat_hull_pieces){.count = a->count + b->count, .shape = a->shape};
  joint->pieces = qmat_alloc(joint->count, sizeof *joint->pieces);
  if (!joint->pieces) return QMAT_ERROR_MEMORY;
  memcpy(joint->pieces, a->pieces, a->count * sizeof *a->pieces);
  memcpy(&joint->pieces[a->count], b->pieces, b->count * sizeof *b->pieces);
  return QMAT_OK;
}
