/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_SOUP_H
#define QMAT_IO_SOUP_H

#include <stddef.h>
#include <stdint.h>

#include "core/value.h"

enum { QMAT_CAGE_ARRAYS = 11 };

/* What a mesh file holds before it is a mesh: polygons in the file's own order, unchecked. Every reader fills one; all
 * checking, welding and triangulating is done once, in qmat_soup_to_mesh. A zeroed soup is empty and valid. */
typedef struct qmat_soup {
  size_t vertex_count, vertex_capacity;
  double *positions; /* 3 * vertex_count: x y z */
  size_t facet_count, facet_end_capacity, facet_ordinal_capacity, facet_line_capacity;
  size_t *facet_ends;       /* facet f has corners[f > 0 ? facet_ends[f - 1] : 0 .. facet_ends[f]) */
  uint32_t *facet_ordinals; /* what the file calls facet f, from 0 */
  int *facet_lines;         /* the line where it stands, from 1; 0: the format has no lines */
  size_t corner_count, corner_capacity;
  uint32_t *corners; /* corner_count vertex numbers */
  qmat_cage cage;    /* of formats that have subdivision surfaces: goes into the mesh as it is */
  size_t cage_capacities[QMAT_CAGE_ARRAYS];
} qmat_soup;

/* What a reader does with facets that name a vertex twice and facets that repeat another one's vertices. */
typedef enum qmat_defects { QMAT_DEFECTS_REFUSE, QMAT_DEFECTS_DROP } qmat_defects;

typedef struct qmat_read_options {
  qmat_defects defects;
} qmat_read_options;

/* Makes room for that many more. A reader calls it with counts that it has checked against the size of its file.
 * QMAT_ERROR_MEMORY. */
qmat_status qmat_soup_reserve(qmat_context *context, qmat_soup *soup, size_t vertices, size_t facets, size_t corners);

/* Adds `count` vertices, 3 doubles each. They need not be finite: qmat_soup_to_mesh says so with the vertex's number.
 * QMAT_ERROR_MEMORY, also beyond 2^32 - 1 vertices; QMAT_CANCELLED. */
qmat_status qmat_soup_add_vertices(qmat_context *context, qmat_soup *soup, const double *positions, size_t count);

/* Adds a facet of `count` corners. Indices need not be in range: qmat_soup_to_mesh says so with the facet's number.
 * `ordinal` is what the file calls it, from 0; `line` is 0 where the format has none. QMAT_ERROR_MEMORY,
 * QMAT_CANCELLED.
 */
qmat_status qmat_soup_add_facet(qmat_context *context, qmat_soup *soup, const uint32_t *corners, size_t count,
                                uint32_t ordinal, int line);

/* Adds the surfaces of `cage`, which counts its own vertices and faces from 0, behind those that are there.
 * QMAT_ERROR_MEMORY, also beyond 2^32 - 1 vertices or faces. */
qmat_status qmat_soup_add_cage(qmat_context *context, qmat_soup *soup, const qmat_cage *cage);

/* Takes all surfaces out of the cage. */
void qmat_soup_clear_cage(qmat_soup *soup);

/* Frees the arrays; the soup is empty and usable again. */
void qmat_soup_uninit(qmat_soup *soup);

/* Makes a sealed triangle mesh of the soup: checks it, drops defects when told to, welds vertices of equal position,
 * triangulates polygons (vertices and triangles stay in the file's order), and gives it one orientation, outward where
 * it is closed. `path` names the file in errors; `report` (a JSON object, may be NULL) gains these keys:
 *   vertices_read, facets_read, facets_dropped_as_defects, polygons_triangulated, vertices_welded,
 *   facets_collapsed_by_welding, triangles_repeated_by_welding, opposite_facets (pairs), vertices_unreferenced,
 *   vertices, triangles, border_edges, nonmanifold_edges, components (joined by vertices), inward_components (closed
 *   ones that enclose a negative volume: cavities), euler_characteristic: whole numbers;
 *   flipped: how many triangles were turned over; closed, oriented: booleans.
 * Orientation: a part of the surface whose triangles disagree is made to agree and to enclose a positive volume; parts
 * that agree stay as they are, unless the closed ones together enclose a negative volume: then those are turned over.
 * QMAT_ERROR_FORMAT: a facet with fewer than 3 corners or an index that is out of range; QMAT_ERROR_GEOMETRY: no facet,
 * a coordinate that is not finite, a defect that is not to be dropped, or nothing left; both name the element. `*mesh`
 * is NULL on failure; the caller releases it. Deterministic, one thread. Cost: linear, but for concave polygons:
 * quadratic in their corners, of which one may have 10000. */
qmat_status qmat_soup_to_mesh(qmat_context *context, const qmat_soup *soup, const char *path,
                              const qmat_read_options *options, qmat_mesh **mesh, json_t *report);

#endif
