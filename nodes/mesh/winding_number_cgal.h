/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_WINDING_NUMBER_CGAL_H
#define QMAT_NODES_MESH_WINDING_NUMBER_CGAL_H

#include <vector>

#include "nodes/mesh/union_mesh_cgal.h"

namespace qmat {

/* Winding numbers of the shells of a mesh, counted exactly along rays. The rays share a few directions; for each
 * direction the triangles are projected once and grouped into bounding boxes. */
class WindingNumbers {
 public:
  explicit WindingNumbers(const UnionMesh &mesh) : mesh_(mesh) {}

  /* The winding number in front of a triangle, given by its exact corners; behind it the number is larger by `layers`.
   * The shell `left_out` does not count. Throws UnionRefused if every ray hits an edge. */
  int before(const Point corner[3], int layers, uint32_t left_out);

 private:
  /* Least and largest of both projected coordinates. */
  using Bounds = std::array<double, 4>;
  struct Shadow {
    Bounds bounds;
    uint32_t triangle;
  };
  /* All triangles, projected along one direction. */
  struct View {
    std::array<double, 3> direction;
    double margin; /* a thousand times the rounding error of a projection */
    std::vector<Shadow> shadows;
    std::vector<Bounds> groups; /* the bounds of each kGroup shadows */

    std::array<double, 2> project(double x, double y, double z) const;
    bool contains(const Bounds &bounds, const std::array<double, 2> &at) const;
    void sort(size_t begin, size_t end, size_t axis);
    void group();
  };
  static constexpr size_t kGroup = 64;

  static Bounds joined(const Bounds &a, const Bounds &b);
  const View &view(size_t number);
  bool count_crossings(const View &from, const Point &origin, uint32_t left_out, int *winding) const;

  const UnionMesh &mesh_;
  std::vector<View> views_;
};

}  // namespace qmat

#endif
