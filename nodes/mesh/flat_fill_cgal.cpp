/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/flat_fill_cgal.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <array>
#include <exception>
#include <map>
#include <new>
#include <utility>
#include <vector>

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

struct Winding {
  int number = 0;
  bool known = false;
};

using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<uint32_t, Kernel>;
using PlainFaceBase = CGAL::Triangulation_face_base_with_info_2<Winding, Kernel>;
using FaceBase = CGAL::Constrained_triangulation_face_base_2<Kernel, PlainFaceBase>;
using Structure = CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>;
using Triangulation =
    CGAL::Constrained_Delaunay_triangulation_2<Kernel, Structure, CGAL::No_constraint_intersection_tag>;
using Triangle = std::array<uint32_t, 3>;

constexpr uint32_t kInfinite = UINT32_MAX;

/* The sides, by their lower and higher end; 1 where they lead to the higher one, else -1. */
class Sides {
 public:
  Sides(const uint32_t *sides, size_t count) {
    for (size_t i = 0; i < 2 * count; i += 2)
      directions_[std::minmax(sides[i], sides[i + 1])] = sides[i] < sides[i + 1] ? 1 : -1;
  }

  /* 1 if a side leads from a to b, -1 if one leads from b to a, else 0. */
  int from(uint32_t a, uint32_t b) const {
    const auto found = directions_.find(std::minmax(a, b));
    return found == directions_.end() ? 0 : a < b ? found->second : -found->second;
  }

 private:
  std::map<std::pair<uint32_t, uint32_t>, int> directions_;
};

/* False if two points are one, or a side would not be an edge as it is. */
bool insert(const double *points, size_t count, const uint32_t *sides, size_t side_count, Triangulation &made) {
  std::vector<Triangulation::Vertex_handle> vertices;
  made.infinite_vertex()->info() = kInfinite;
  for (size_t i = 0; i < count; i++) {
    vertices.push_back(made.insert(Kernel::Point_2(points[2 * i], points[2 * i + 1])));
    if (made.number_of_vertices() != i + 1) return false;
    vertices.back()->info() = static_cast<uint32_t>(i);
  }
  if (made.dimension() != 2) return false;
  for (size_t i = 0; i < 2 * side_count; i += 2) {
    try {
      made.insert_constraint(vertices[sides[i]], vertices[sides[i + 1]]);
    } catch (const Triangulation::Intersection_of_constraints_exception &) {
      return false;
    }
  }
  for (size_t i = 0; i < 2 * side_count; i += 2)
    if (!made.is_edge(vertices[sides[i]], vertices[sides[i + 1]])) return false;
  return true;
}

/* Spreads winding numbers from the outside; one more on the left of a side. */
void find_windings(Triangulation &made, const Sides &sides) {
  std::vector<Triangulation::Face_handle> open{made.infinite_face()};
  open.back()->info().known = true;
  while (!open.empty()) {
    const Triangulation::Face_handle face = open.back();
    open.pop_back();
    for (int k = 0; k < 3; k++) {
      const Triangulation::Face_handle next = face->neighbor(k);
      if (next->info().known) continue;
      const int crossed = sides.from(face->vertex(made.ccw(k))->info(), face->vertex(made.cw(k))->info());
      next->info() = {face->info().number - crossed, true};
      open.push_back(next);
    }
  }
}

/* The triangles within, or none where they are wound in different ways. */
std::vector<Triangle> triangles_within(const Triangulation &made) {
  std::vector<Triangle> within;
  int all = 0;
  for (const auto &face : made.finite_face_handles()) {
    const int number = face->info().number;
    if (number == 0) continue;
    if (all == 0) all = number;
    if (number != all || (all != 1 && all != -1)) return {};
    Triangle t{face->vertex(0)->info(), face->vertex(1)->info(), face->vertex(2)->info()};
    if (all < 0) std::swap(t[1], t[2]);
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    within.push_back(t);
  }
  std::sort(within.begin(), within.end());
  return within;
}

}  // namespace

qmat_status qmat_fill_flat_polygons(qmat_context *context, const double *points, size_t count, const uint32_t *sides,
                                    size_t side_count, uint32_t *triangles, size_t *made) {
  *made = 0;
  try {
    Triangulation triangulation;
    if (!insert(points, count, sides, side_count, triangulation)) return QMAT_OK;
    find_windings(triangulation, Sides(sides, side_count));
    const std::vector<Triangle> within = triangles_within(triangulation);
    for (const Triangle &t : within) triangles = std::copy(t.begin(), t.end(), triangles);
    *made = within.size();
    return QMAT_OK;
  } catch (const std::bad_alloc &) {
    return qmat_fail_memory(context, "the flat faces");
  } catch (const std::exception &failure) {
    return qmat_fail(context, QMAT_ERROR_DEPENDENCY, "CGAL: %s", failure.what());
  } catch (...) {
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "triangulating flat faces failed in an unknown way");
  }
}
