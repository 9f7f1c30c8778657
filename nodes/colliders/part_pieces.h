/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_PART_PIECES_H
#define QMAT_NODES_COLLIDERS_PART_PIECES_H

#include "nodes/colliders/solid_parts.h"

/* The cells of a part between planes: those whose place is from `low` on and below `end` along each axis. */
typedef struct qmat_part_piece {
  uint32_t part;
  uint8_t low[3], end[3];
} qmat_part_piece;

/* What one hull is around. */
typedef struct qmat_hull_pieces {
  size_t count;
  qmat_part_piece *pieces; /* owned */
  uint32_t shape;          /* whose spheres the hull keeps */
} qmat_hull_pieces;

/* A plane across axis 0 to 2, before the cells of this place. */
typedef struct qmat_cell_plane {
  int axis, at;
  double gain; /* of volume, where hulls are divided by the plane; in the unit frame */
} qmat_cell_plane;

/* A whole part as a piece. */
qmat_part_piece qmat_part_whole(uint32_t part);

/* Whether the piece has a cell. */
bool qmat_part_piece_has(const qmat_part_piece *piece, const qmat_solid_cell *cell);

/* The points of pieces, in the unit frame: those of hulls to 1e-9, or, with `coarse`, only some of each cell, to about
 * 5e-4. The caller frees `*points`; it is NULL where there is none. QMAT_ERROR_MEMORY. */
qmat_status qmat_hull_pieces_points(const qmat_solid_part *parts, const qmat_hull_pieces *hull, bool coarse,
                                    double **points, size_t *count);

/* Divides pieces, which stay, by a plane; makes the pieces of two joint hulls. Free the new ones with
 * qmat_free(pieces). QMAT_ERROR_MEMORY. */
qmat_status qmat_hull_pieces_split(const qmat_hull_pieces *hull, qmat_cell_plane plane, qmat_hull_pieces halves[2]);
qmat_status qmat_hull_pieces_join(const qmat_hull_pieces *a, const qmat_hull_pieces *b, qmat_hull_pieces *joint);

#endif
