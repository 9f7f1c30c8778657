/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_PARTS_H
#define QMAT_NODES_MESH_PARTS_H

#include "core/context.h"

/* What a part of a mesh is taken for. */
typedef enum qmat_part_kind {
  QMAT_PART_CLOSED, /* a solid as it is */
  QMAT_PART_HOLES,  /* a solid with holes */
  QMAT_PART_OPEN,   /* a surface without volume */
  QMAT_PART_FLAT,   /* closed, but enclosing nothing */
  QMAT_PART_KIND_COUNT
} qmat_part_kind;

/* A closed path along border edges, in the direction in which a cap runs along it. */
typedef struct qmat_loop {
  uint32_t part;
  size_t first, count; /* vertices in loop_vertices */
  double length;
} qmat_loop;

typedef struct qmat_part {
  qmat_part_kind kind;
  size_t first_member, triangle_count;
  size_t first_loop, loop_count;
  double area, volume;   /* the volume with holes closed by cones */
  double filled;         /* share of the area at which the winding number is near 0 or 1 */
  size_t seam_triangles; /* of triangle_count: those that qmat_parts_find_with_seams adds */
  double seam_area;      /* theirs, of the area */
  double cap_area;       /* 0; for the caller that closes the borders */
} qmat_part;

/* A mesh divided into parts: triangles connected across edges. A piece that meets others at edges of more than two
 * triangles, and whose absence leaves less open, is a part of its own: a fin, or a wall inside. All memory is the
 * context's arena. */
typedef struct qmat_parts {
  size_t vertex_count, triangle_count;
  const double *positions;
  uint32_t *triangles; /* as given; pieces that disagree with their neighbours are turned */
  size_t turned;       /* triangles of these pieces */
  uint32_t *part_of;   /* triangle_count */
  size_t part_count;
  qmat_part *parts;
  uint32_t *members;     /* triangle_count: the triangles by part */
  size_t seam_count;     /* the last triangles, which qmat_parts_find_with_seams adds */
  size_t edges_split;    /* edges that it splits at vertices that lie on them */
  double split_distance; /* the largest between such a vertex and its edge */
  size_t loop_count;
  qmat_loop *loops; /* by part */
  uint32_t *loop_vertices;
  uint32_t *loop_thirds; /* per side of a loop: the corner opposite to it in a triangle there */
} qmat_parts;

/* Divides a mesh: `positions` (3 * vertex_count, finite), `triangles` (3 * triangle_count of three vertices each, at
 * most 2^32 / 3 triangles; copied). A part with holes is a solid where the generalised winding number along most of its
 * area is near 0 or 1: what is seen of the holes from there is little. QMAT_ERROR_MEMORY, QMAT_CANCELLED. One thread.
 * Cost: linear, and for open parts at most 256 times the border edges.
 * Source: Jacobson et al. 2013, Robust inside-outside segmentation using generalized winding numbers. */
qmat_status qmat_parts_find(qmat_context *context, size_t vertex_count, const double *positions, size_t triangle_count,
                            const uint32_t *triangles, qmat_parts *parts);

/* Whether a part is taken for a surface without volume. */
static inline bool qmat_part_is_sheet(const qmat_part *part) {
  return part->kind == QMAT_PART_OPEN || part->kind == QMAT_PART_FLAT;
}

/* Grows a box (the least x, y, z, then the largest; INFINITY and -INFINITY where it is empty) by the corners of a part.
 */
void qmat_part_grow_box(const qmat_parts *parts, size_t part, double box[6]);

/* The share of all directions in which the triangle abc is seen from a point, all 3 doubles; positive from its back.
 * Over a surface these sum up to its generalised winding number. Source: van Oosterom, Strackee 1983. */
double qmat_seen_share(const double *from, const double *a, const double *b, const double *c);

#endif
