/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_SOLID_CUBES_H
#define QMAT_NODES_COLLIDERS_SOLID_CUBES_H

#include "core/geometry/surface.h"
#include "nodes/colliders/shape_set.h"

/* A search of a solid by cubes that are divided into eight. All is in the unit frame. */

/* The corners of a triangle that is clipped to a cube, at most (six qmat_convex_polygon_cut); cubes of this depth are
 * not divided. The unit frame's box is cut into so many regions, which are searched independently. */
enum { QMAT_CUBE_MOST_CORNERS = 28, QMAT_CUBE_DEEPEST = 16, QMAT_CUBE_REGIONS = 4096 };

/* A cube that meets the solid, and what of the shapes and of the surface matters in it. */
typedef struct qmat_solid_cube {
  double centre[3], half, reach; /* reach: from the centre to the corners */
  int depth;
  const uint32_t
      *candidates;        /* the shapes that may be nearest to a point of the cube, the nearest to its centre first */
  const uint32_t *facets; /* the triangles of the surface that meet the cube; none: the cube is inside the solid */
  size_t candidate_count, facet_count, top;
  double nearest;       /* the distance of the centre to the first candidate */
  signed char known[8]; /* of corners: 1 or 0, -1 not known yet */
} qmat_solid_cube;

typedef struct qmat_cube_search {
  const qmat_surface *surface;
  const double *positions;
  const uint32_t *triangles;
  size_t solid_count;    /* the triangles from here on are sheets */
  double half_thickness; /* of sheets */
  const qmat_prepared_shape *shapes;
  const struct qmat_cube_visitor *visitor;
  uint32_t *stack; /* of candidates and facets, level by level */
  double *near;    /* distances of the candidates of one cube */
  size_t cubes;    /* searched so far in this region */
  void *region;
} qmat_cube_search;

/* What a search does. The space is divided into regions. `visit` and `finish` get the data of one region, `region_size`
 * bytes that are 0 at first, and run on any thread. `gather` gets those of all regions one after the other, in an order
 * that does not depend on threads, also after an error: it frees what they own. */
typedef struct qmat_cube_visitor {
  size_t region_size;
  bool (*visit)(const qmat_cube_search *search, qmat_solid_cube *cube); /* whether to divide the cube */
  void (*finish)(void *region);                                         /* after its last cube; may be NULL */
  qmat_status (*gather)(void *all, void *region);                       /* QMAT_OK or QMAT_ERROR_MEMORY */
  void *all;
  const bool *skipped; /* per region: whether it is not searched; NULL: all are */
  bool skips_covered;  /* cubes are not visited that the first candidate contains, and the sheets in them */
  const char *what;    /* for progress and errors: "regions searched" */
} qmat_cube_visitor;

/* How far the solid reaches around a facet: half the thickness of a sheet, or 0. */
static inline double qmat_cube_facet_reach(const qmat_cube_search *search, uint32_t facet) {
  return facet < search->solid_count ? 0 : search->half_thickness;
}

/* The convex polygon of a triangle in a cube; its number of corners. */
int qmat_cube_clip(const qmat_cube_search *search, const qmat_solid_cube *cube, uint32_t facet,
                   double polygon[QMAT_CUBE_MOST_CORNERS][3]);

/* A corner of the cube, 0 to 7. */
void qmat_cube_corner(const qmat_solid_cube *cube, int corner, double point[3]);

/* Whether a corner is inside the solid, or within 1e-6 of its surface. */
bool qmat_cube_corner_counts(const qmat_cube_search *search, qmat_solid_cube *cube, int corner);

/* Visits the cubes that meet the solid, from the largest down. QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads. */
qmat_status qmat_solid_cubes_search(qmat_context *context, const qmat_surface *surface, const qmat_shape_set *set,
                                    const qmat_cube_visitor *visitor);

#endif
