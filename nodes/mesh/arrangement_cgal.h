/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_ARRANGEMENT_CGAL_H
#define QMAT_NODES_MESH_ARRANGEMENT_CGAL_H

#include <vector>

#include "nodes/mesh/union_mesh_cgal.h"

namespace qmat {

/* A piece of a triangle, or of several coplanar triangles that overlap there. */
struct Piece {
  uint32_t source; /* the triangle that it is cut from; the first of those that overlap in a plane */
  Corners corners; /* vertices of the arrangement, the smallest first */
  int layers;      /* the triangles there that face this way minus those that face the other way; not below 0 */
};

/* Whether two triangles have more in common than the corners and edges that they share by index. */
bool do_meet(const UnionMesh &mesh, uint32_t a, uint32_t b);

/* Triangles cut along their intersections into pieces that meet only along whole edges. The vertices are those of the
 * mesh, then those on cuts. */
struct Arrangement {
  std::vector<Piece> pieces;
  std::vector<Piece> cancelled; /* faces where the triangles of a plane cancel: of 0 layers */
  size_t cut_count = 0;         /* triangles that are cut, or overlap others */
  std::vector<bool> overlaps;   /* per triangle of the mesh: others of its plane lie on it, or on those */
  std::vector<Point> points;    /* per vertex; those of mesh vertices are set only where triangles meet */
};

/* Cuts `triangles` (sorted) where the sorted `pairs` of them meet, in exact arithmetic. Throws UnionRefused. */
Arrangement arrange(const UnionMesh &mesh, const std::vector<uint32_t> &triangles, const std::vector<Pair> &pairs);

}  // namespace qmat

#endif
