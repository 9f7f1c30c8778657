/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SKIN_CONTOUR_H
#define QMAT_NODES_SKIN_CONTOUR_H

#include "nodes/skin/envelope_cells.h"
#include "nodes/skin/skin_triangles.h"

/* Dual contouring in progress. envelope_surface.c runs the steps below in this order. */

/* An edge between two neighbouring corners where F changes sign, and the cells around it. Going around the edge
 * counter-clockwise as seen from its upper end, face i lies between cells i and i + 1. */
typedef struct qmat_crossing {
  uint32_t lower, upper; /* corner ids; the edge runs along the axis from lower to upper */
  uint8_t axis, count;   /* 3 or 4 cells */
  bool inside_below;     /* the lower corner is inside */
  uint32_t cells[4];
  uint32_t faces[4];    /* cell * 8 + side: the side of the smaller cell, of equal cells of the lower one */
  uint32_t partners[4]; /* crossing * 4 + face: the other end of the surface's trace on the face */
  uint32_t vertices[4]; /* of the surface, in each cell */
  uint32_t between[4];  /* an extra vertex on the trace, or QMAT_NO_ID */
  bool shared[4];       /* the face has more than one trace */
  double position[3], normal[3];
} qmat_crossing;

typedef struct qmat_contour {
  qmat_context *context;
  int threads;
  qmat_cells cells;
  qmat_key_table cell_table, corner_table;
  size_t corner_count, corner_capacity, owner_capacity;
  uint64_t *corners;      /* keys */
  uint32_t *owners;       /* a cell at each corner */
  double *values;         /* F at each corner */
  uint32_t *cell_corners; /* 8 per cell */
  uint16_t *split_edges;  /* per cell: bit e is set when a corner lies at the middle of edge e */
  uint16_t *owned_edges;  /* per cell: bit e is set when the cell owns the crossing there */
  size_t *first_crossing; /* per cell, and the total */
  size_t crossing_count;
  qmat_crossing *crossings;
  uint32_t *crossing_at; /* 3 per corner: the crossing of the edge that starts there along each axis */
  size_t vertex_count, vertex_capacity;
  size_t sheet_count; /* vertices of sheets; the others keep the surface a simplicial complex */
  uint32_t *sheet_cells;
  size_t *sheet_items; /* per sheet its first entry of items, and the total */
  uint32_t *items;     /* crossings */
  double *positions;
} qmat_contour;

static inline void qmat_corner_at(uint64_t key, uint32_t at[3]) {
  for (int k = 0; k < 3; k++) at[k] = (uint32_t)(key >> (19 * k)) & 0x7ffff;
}

static inline void qmat_contour_point(const qmat_contour *c, const uint32_t at[3], double point[3]) {
  for (int k = 0; k < 3; k++) point[k] = c->cells.origin[k] + c->cells.finest * at[k];
}

static inline bool qmat_contour_inside(const qmat_contour *c, uint32_t corner) {
  return c->values[corner] < 0;
}

/* Edge e of a cell runs along axis e / 4; bits 0 and 1 of e are its sides along the two next axes. */
static inline void qmat_cell_edge_ends(unsigned e, unsigned *lower, unsigned *upper) {
  unsigned a = e / 4, b = (a + 1) % 3, d = (a + 2) % 3;
  *lower = (e & 1) << b | (e >> 1 & 1) << d;
  *upper = *lower | 1u << a;
}

/* The lower end of edge e. */
static inline void qmat_cell_edge_at(const qmat_cell *cell, unsigned e, uint32_t at[3]) {
  unsigned lower, upper;
  qmat_cell_edge_ends(e, &lower, &upper);
  for (unsigned j = 0; j < 3; j++) at[j] = cell->at[j] + (lower >> j & 1) * cell->size;
}

/* The steps. Each returns QMAT_ERROR_MEMORY, or QMAT_ERROR_INTERNAL where the cells do not fit together, and uses all
 * threads where that pays; results do not depend on their number. */

/* Corners (contour_corners.c): gives ids to the corners of all cells, finds the edges of cells that smaller cells
 * divide, and evaluates F at every corner. */
qmat_status qmat_contour_number_corners(qmat_contour *c);
qmat_status qmat_contour_find_split_edges(qmat_contour *c);
qmat_status qmat_contour_evaluate_corners(qmat_contour *c);

/* Crossings (contour_crossings.c): finds the edges where F changes sign, and joins crossings in pairs by the trace of
 * the surface on each face. */
qmat_status qmat_contour_find_crossings(qmat_contour *c);
qmat_status qmat_contour_find_partners(qmat_contour *c);

/* Sheets (contour_sheets.c): collects the traces of each cell into closed sheets, places one vertex for each, and adds
 * vertices where two sheets would share more than one edge. */
qmat_status qmat_contour_find_sheets(qmat_contour *c);
qmat_status qmat_contour_place_sheets(qmat_contour *c);
qmat_status qmat_contour_part_doubled_edges(qmat_contour *c);

/* Triangles (contour_triangles.c): cuts the polygon of each crossing. `surface` gets arrays that the caller frees, also
 * after a failure. */
qmat_status qmat_contour_make_triangles(qmat_contour *c, qmat_skin_triangles *surface);

#endif
