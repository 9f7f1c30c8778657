/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_SOUP_H
#define QMAT_IO_SOUP_H

#include <stddef.h>
#include <stdint.h>

#include "core/value.h"

enum { QMAT_CAGE_ARRAYS = 11 };

/* The polygons of a mesh file, in file order and unchecked. Every reader fills a soup; qmat_soup_to_mesh checks, welds
 * and triangulates it. A zeroed soup is empty and valid. */
typedef struct qmat_soup {
  size_t vertex_count, vertex_capacity;
  double *positions; /* 3 * vertex_count: x y z */
  size_t facet_count, facet_end_capacity, facet_ordinal_capacity, facet_line_capacity;
  size_t *facet_ends;       /* facet f has corners[f > 0 ? facet_ends[f - 1] : 0 .. facet_ends[f]) */
  uint32_t *facet_ordinals; /* the number of facet f in the file, from 0 */
  int *facet_lines;         /* its line in the file, from 1; 0: the format has no lines */
  size_t corner_count, corner_capacity;
  uint32_t *corners;      /* corner_count vertex indices */
  double meters_per_unit; /* of the mesh; 0: unknown */
  /* The skin, as in qmat_mesh: of the first vertices; a vertex without one follows joint 0. 0: no skin. */
  size_t skinned_count, joint_capacity, weight_capacity;
  uint32_t *joints; /* 4 * skinned_count */
  double *weights;  /* 4 * skinned_count */
  qmat_cage cage;   /* subdivision surfaces, copied into the mesh unchanged */
  size_t cage_capacities[QMAT_CAGE_ARRAYS];
  double deviation; /* of the facets from the surface that they stand for, copied into the mesh; 0: exact */
} qmat_soup;

/* How to treat facets that have fewer than three different vertices, or the same vertices as an earlier facet. */
typedef enum qmat_defects { QMAT_DEFECTS_REFUSE, QMAT_DEFECTS_DROP } qmat_defects;

typedef struct qmat_read_options {
  qmat_defects defects;
  size_t segments;        /* sides of the polygons for circles of USD's round solids; 0: 64 */
  double meters_per_unit; /* of files that state no unit; 0: unknown */
} qmat_read_options;

/* Reserves room for that many additional elements. Readers check the counts against the file size before the call.
 * QMAT_ERROR_MEMORY. */
qmat_status qmat_soup_reserve(qmat_context *context, qmat_soup *soup, size_t vertices, size_t facets, size_t corners);

/* Adds `count` vertices, 3 doubles each. qmat_soup_to_mesh checks that they are finite.
 * QMAT_ERROR_MEMORY, also beyond 2^32 - 1 vertices; QMAT_CANCELLED. */
qmat_status qmat_soup_add_vertices(qmat_context *context, qmat_soup *soup, const double *positions, size_t count);

/* Gives the newest `count` vertices joints and weights, 4 each, as in qmat_mesh. QMAT_ERROR_MEMORY. */
qmat_status qmat_soup_add_skin(qmat_context *context, qmat_soup *soup, const uint32_t *joints, const double *weights,
                               size_t count);

/* Adds a facet of `count` corners. qmat_soup_to_mesh checks that the indices are in range. `ordinal` is the
 * facet's number in the file, from 0; `line` is 0 where the format has no lines. QMAT_ERROR_MEMORY, QMAT_CANCELLED. */
qmat_status qmat_soup_add_facet(qmat_context *context, qmat_soup *soup, const uint32_t *corners, size_t count,
                                uint32_t ordinal, int line);

/* Appends the surfaces of `cage`, whose vertices and faces are numbered from 0. QMAT_ERROR_MEMORY, also beyond
 * 2^32 - 1 vertices or faces. */
qmat_status qmat_soup_add_cage(qmat_context *context, qmat_soup *soup, const qmat_cage *cage);

/* Frees the arrays of the cage and empties it. */
void qmat_soup_clear_cage(qmat_soup *soup);

/* Frees the arrays; the soup is empty and usable again. */
void qmat_soup_uninit(qmat_soup *soup);

/* Makes a sealed triangle mesh of the soup: checks it, drops defects if the options say so, welds vertices of equal
 * position, triangulates polygons and orients the triangles, outward where the mesh is closed. Vertices and triangles
 * keep the file order. `path` names the file in errors. `report` (a JSON object, may be NULL) gains these keys:
 *   vertices_read, facets_read, facets_dropped_as_defects, polygons_triangulated, vertices_welded,
 *   facets_collapsed_by_welding, triangles_repeated_by_welding, opposite_facets (pairs), vertices_unreferenced,
 *   vertices, triangles, border_edges, nonmanifold_edges, components (connected by vertices), inward_components (closed
 *   ones that enclose a negative volume: cavities), euler_characteristic: whole numbers;
 *   flipped: number of flipped triangles; closed, oriented: booleans.
 * Orientation: see qmat_orient_triangles.
 * QMAT_ERROR_FORMAT: an index out of range. QMAT_ERROR_GEOMETRY: no facet, a coordinate that is not finite, a defect
 * with QMAT_DEFECTS_REFUSE, a concave polygon with more than QMAT_LARGEST_CONCAVE_POLYGON corners, or no triangle
 * remains. Errors name the vertex or facet at fault.
 * QMAT_CANCELLED.
 * `*mesh` is NULL on failure; the caller releases it. Deterministic, one thread. Cost: linear in the soup, quadratic in
 * the corners of a concave polygon. */
qmat_status qmat_soup_to_mesh(qmat_context *context, const qmat_soup *soup, const char *path,
                              const qmat_read_options *options, qmat_mesh **mesh, json_t *report);

#endif
