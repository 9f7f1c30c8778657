/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_ARRANGEMENT_CGAL_H
#define QMAT_NODES_MESH_ARRANGEMENT_CGAL_H

#include <CGAL/Box_intersection_d/Box_with_info_d.h>
#include <CGAL/box_intersection_d.h>

#include <algorithm>
#include <vector>

#include "nodes/mesh/union_mesh_cgal.h"

namespace qmat {

/* A piece of a triangle, or of several coplanar triangles that overlap there. */
struct Piece {
  uint32_t source; /* the triangle that it is cut from; the first of those that overlap in a plane */
  Corners corners; /* vertices of the arrangement, the smallest first */
  int layers;      /* the triangles there that face this way minus those that face the other way; not below 0 */
};

/* Boxes that are swept along an axis rather than divided further. CGAL's default, 10, takes up to twice as long. */
constexpr std::ptrdiff_t kSweptBoxes = 2000;

/* Whether two triangles have more in common than the corners and edges that they share by index. */
bool do_meet(const UnionMesh &mesh, uint32_t a, uint32_t b);

/* Calls `visit` with all pairs of the triangles whose bounding boxes meet, the smaller id first, in no order. */
template <class Visit>
void for_each_box_pair(const UnionMesh &mesh, const std::vector<uint32_t> &triangles, const Visit &visit) {
  using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 3, uint32_t>;
  std::vector<Box> boxes;
  boxes.reserve(triangles.size());
  for (const uint32_t t : triangles) {
    double low[3], high[3];
    const uint32_t *c = mesh.corners(t);
    for (size_t k = 0; k < 3; k++) {
      const double x = mesh.position(c[0])[k], y = mesh.position(c[1])[k], z = mesh.position(c[2])[k];
      low[k] = std::min({x, y, z});
      high[k] = std::max({x, y, z});
    }
    boxes.push_back({low, high, t});
  }
  size_t seen = 0;
  const auto visit_boxes = [&](const Box &a, const Box &b) {
    if (++seen % 4096 == 0) mesh.progress(seen, 0, "pairs of triangles");
    visit(std::min(a.info(), b.info()), std::max(a.info(), b.info()));
  };
  CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), visit_boxes, kSweptBoxes);
}

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
