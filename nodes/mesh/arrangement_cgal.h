/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_ARRANGEMENT_CGAL_H
#define QMAT_NODES_MESH_ARRANGEMENT_CGAL_H

#include <CGAL/Box_intersection_d/Box_with_info_d.h>
#include <CGAL/box_intersection_d.h>

#include <algorithm>
#include <map>
#include <vector>

#include "nodes/mesh/union_mesh_cgal.h"

namespace qmat {

/* A piece of a triangle, or of several coplanar triangles that overlap there. */
struct Piece {
  uint32_t source; /* the first triangle that it is cut from */
  Corners corners; /* vertices of the arrangement, the smallest first */
  int layers;      /* above 0: the triangles there that face this way minus those that face the other way */
};

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
  CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const Box &a, const Box &b) {
    if (++seen % 4096 == 0) mesh.progress(seen, 0, "pairs of triangles");
    visit(std::min(a.info(), b.info()), std::max(a.info(), b.info()));
  });
}

/* Cuts triangles along their intersections, in exact arithmetic, into pieces that meet only along whole edges. */
class Arrangement {
 public:
  explicit Arrangement(const UnionMesh &mesh) : mesh_(mesh) {}

  /* Cuts `triangles` (sorted) where the sorted pairs of them meet. Throws UnionRefused. */
  void make(const std::vector<uint32_t> &triangles, const std::vector<Pair> &pairs);

  std::vector<Piece> pieces;       /* in the order of their first triangle's plane */
  std::vector<uint32_t> cancelled; /* triangles in whose plane other triangles cancel */
  size_t cut_count = 0;            /* triangles that are cut, or overlap others */

  /* The vertices: those of the mesh, then those on cuts. */
  size_t vertex_count() const {
    return points_.size();
  }
  Point exact(uint32_t vertex) const {
    return vertex < mesh_.vertex_count() ? mesh_.exact(vertex) : points_[vertex];
  }
  std::array<double, 3> rounded(uint32_t vertex) const;

 private:
  struct View;
  struct Cut { /* a segment that cuts a triangle; a point where both ends are equal */
    uint32_t triangle, from, to;
  };

  void know(uint32_t vertex);
  uint32_t id_of(const Point &point);
  Exact::Triangle_3 exact_triangle(uint32_t triangle) const;
  CGAL::Orientation turn_of(uint32_t triangle, const View &view) const;
  View view_of(uint32_t triangle) const;
  bool is_beside(uint32_t triangle, uint32_t other, const View &view, CGAL::Orientation turn) const;
  bool do_overlap(uint32_t a, uint32_t b) const;
  void add_cut(uint32_t triangle, uint32_t from, uint32_t to);
  void meet(uint32_t a, uint32_t b);
  Point lift(uint32_t triangle, const View &view, const Exact::Point_2 &seen) const;
  void add_piece(uint32_t source, Corners corners, int layers);
  template <class Plane, class VertexOf>
  void count_layers(Plane &plane, const std::vector<uint32_t> &group, const View &view, const VertexOf &vertex) const;
  template <class Plane>
  void cut_plane(const std::vector<uint32_t> &group, const std::vector<Cut> &cuts, Plane &plane);
  void cut_plane(const std::vector<uint32_t> &group, const std::vector<Cut> &cuts);
  void cut_triangles(const std::vector<uint32_t> &triangles);

  const UnionMesh &mesh_;
  std::vector<Point> points_;
  std::vector<bool> known_; /* per vertex of the mesh: whether points_ has it */
  std::map<Point, uint32_t> ids_;
  std::vector<uint32_t> same_; /* per vertex of the mesh: the first known vertex at the same point */
  uint32_t *planes_ = nullptr; /* disjoint sets of triangles that overlap in a plane */
  std::vector<Cut> cuts_;
};

}  // namespace qmat

#endif
