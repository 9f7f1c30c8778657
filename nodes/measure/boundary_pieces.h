/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_BOUNDARY_PIECES_H
#define QMAT_NODES_MEASURE_BOUNDARY_PIECES_H

#include "core/geometry/medial_complex.h"
#include "nodes/measure/boundary_features.h"

/* In place of a feature's number: the piece is a cube of space. */
#define QMAT_CELL UINT32_MAX

/* Points that lie this deep in the envelope, in diagonals, count as its boundary too, for upper bounds: samples cannot
 * tell them apart, nor can a file in single precision. A search with `outside` (boundary_distance.h) takes 1e-6. */
#define QMAT_BOUNDARY_SKIN 1e-4

/* A piece of a feature's surface, or of space, that branch and bound halves. `at` depends on the kind: for a sphere
 * three unit vectors, the corners of a spherical triangle; for a cone side t from and to, then the angle from and to;
 * for a slab face three corners; for a cell its centre and half its side. */
typedef struct qmat_boundary_piece {
  double at[9];
  uint32_t feature;
  uint32_t near;  /* the caller's: a triangle of the surface near the piece, or QMAT_NONE */
  uint8_t wanted; /* the caller's: which bounds the piece still counts for */
} qmat_boundary_piece;

enum { QMAT_MOST_PIECES = 8 };

/* The pieces (at most QMAT_MOST_PIECES) that cover a feature; returns their number. */
size_t qmat_boundary_pieces_of_feature(const qmat_boundary_features *f, size_t feature, uint8_t wanted,
                                       qmat_boundary_piece pieces[]);

/* The cube around all spheres, and a little more than that. */
qmat_boundary_piece qmat_boundary_piece_of_space(const qmat_boundary_features *f, uint8_t wanted);

/* A ball that holds the piece: `middle` is a point of it, `*reach` the radius. False where the whole piece lies deeper
 * than QMAT_BOUNDARY_SKIN in the cone or slab to a neighbouring sphere, and so off the boundary. */
bool qmat_boundary_piece_ball(const qmat_boundary_features *f, const qmat_boundary_piece *p, double middle[3],
                              double *reach);

/* Points whose convex hull comes within `*bulge` of every point of the piece; returns their number, 0 for a cube. */
int qmat_boundary_piece_hull(const qmat_boundary_features *f, const qmat_boundary_piece *p, double points[4][3],
                             double *bulge);

/* How many pieces (2, 4 or 8) a piece is split into, and these; what is the caller's is the same. */
int qmat_boundary_piece_child_count(const qmat_boundary_features *f, const qmat_boundary_piece *p);
void qmat_boundary_piece_split(const qmat_boundary_features *f, const qmat_boundary_piece *p,
                               qmat_boundary_piece children[]);

#endif
