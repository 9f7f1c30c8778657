/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/convex_hull_cgal.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Regular_triangulation_3.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>

#include "core/geometry/reserve_cells_cgal.h"

#include <algorithm>
#include <array>
#include <exception>
#include <new>
#include <vector>

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase =
    CGAL::Triangulation_vertex_base_with_info_3<uint32_t, Kernel, CGAL::Regular_triangulation_vertex_base_3<Kernel>>;
using CellBase = CGAL::Regular_triangulation_cell_base_3<Kernel, CGAL::Triangulation_cell_base_3<Kernel>,
                                                         CGAL::Discard_hidden_points>;
using Regular = CGAL::Regular_triangulation_3<Kernel, CGAL::Triangulation_data_structure_3<VertexBase, CellBase>>;

/* The hull is the border of a regular triangulation of the points and of their centre. The centre is so heavy that it
 * hides most of what is inside, and most cells join a facet to it: a tenth of the time of a Delaunay triangulation.
 * CGAL's perturbation makes the border unique where four points are in one plane. CGAL's convex_hull_3 goes by
 * addresses of memory there, so its triangles differ between runs. */
struct qmat_hull_points {
  Regular triangulation;
};

/* The weight of the centre, in squares of the distance to the farthest point. */
static const double weight_of_centre = 1000;

static const uint32_t centre_id = UINT32_MAX;

static Regular::Weighted_point weighted(const double *p, double weight) {
  return {Kernel::Point_3(p[0], p[1], p[2]), weight};
}

static void insert_centre(Regular &triangulation, const double *points, size_t count) {
  double centre[3] = {0, 0, 0}, farthest = 0;
  for (size_t i = 0; i < 3 * count; i++) centre[i % 3] += points[i] / static_cast<double>(count);
  for (size_t i = 0; i < count; i++) {
    double square = 0;
    for (size_t k = 0; k < 3; k++) square += (points[3 * i + k] - centre[k]) * (points[3 * i + k] - centre[k]);
    farthest = std::max(farthest, square);
  }
  triangulation.insert(weighted(centre, weight_of_centre * farthest))->info() = centre_id;
}

/* The facets of the border; none where the centre is one of its points: the points are in a plane, up to rounding. */
static std::vector<std::array<uint32_t, 3>> facets_of(const Regular &triangulation) {
  std::vector<Regular::Cell_handle> outside;
  std::vector<std::array<uint32_t, 3>> facets;
  if (triangulation.dimension() < 3) return facets;
  triangulation.incident_cells(triangulation.infinite_vertex(), std::back_inserter(outside));
  for (const auto cell : outside) {
    const auto inside = cell->neighbor(cell->index(triangulation.infinite_vertex()));
    const int opposite = inside->index(cell);
    std::array<uint32_t, 3> row{};
    for (int k = 0; k < 3; k++)
      row[static_cast<size_t>(2 - k)] = inside->vertex(Regular::vertex_triple_index(opposite, k))->info();
    if (std::find(row.begin(), row.end(), centre_id) != row.end()) return {};
    std::rotate(row.begin(), std::min_element(row.begin(), row.end()), row.end());
    facets.push_back(row);
  }
  std::sort(facets.begin(), facets.end());
  return facets;
}

qmat_status qmat_growing_hull_of(qmat_growing_hull *hull, const double *points, size_t count, uint32_t *triangles,
                                 size_t *triangle_count) {
  try {
    if (hull->inserted == nullptr) {
      hull->inserted = new qmat_hull_points;
      insert_centre(hull->inserted->triangulation, points, count);
    }
    Regular &triangulation = hull->inserted->triangulation;
    for (; hull->count < count; hull->count++) {
      qmat_reserve_cells(triangulation);
      const auto vertex = triangulation.insert(weighted(&points[3 * hull->count], 0));
      if (vertex != nullptr) vertex->info() = static_cast<uint32_t>(hull->count);
    }
    const auto facets = facets_of(triangulation);
    if (facets.empty() || facets.size() > 2 * count) {
      qmat_growing_hull_uninit(hull); /* further points get another centre */
      return QMAT_ERROR_GEOMETRY;
    }
    for (const auto &row : facets) triangles = std::copy(row.begin(), row.end(), triangles);
    *triangle_count = facets.size();
    return QMAT_OK;
  } catch (const std::bad_alloc &) {
    return QMAT_ERROR_MEMORY;
  } catch (const std::exception &) {
    return QMAT_ERROR_GEOMETRY;
  }
}

void qmat_growing_hull_uninit(qmat_growing_hull *hull) {
  delete hull->inserted;
  *hull = {nullptr, 0};
}

qmat_status qmat_convex_hull(const double *points, size_t count, uint32_t *triangles, size_t *triangle_count) {
  qmat_growing_hull hull = {nullptr, 0};
  const qmat_status status = qmat_growing_hull_of(&hull, points, count, triangles, triangle_count);
  qmat_growing_hull_uninit(&hull);
  return status;
}
