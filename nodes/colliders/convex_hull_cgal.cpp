/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/convex_hull_cgal.h"

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>

#include "core/geometry/reserve_cells_cgal.h"

#include <algorithm>
#include <array>
#include <exception>
#include <new>
#include <vector>

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_3<uint32_t, Kernel>;
using Delaunay = CGAL::Delaunay_triangulation_3<Kernel, CGAL::Triangulation_data_structure_3<VertexBase>>;

/* The hull is the border of the Delaunay triangulation: CGAL's perturbation makes that unique where four points are in
 * one plane. CGAL's convex_hull_3 goes by addresses of memory there, so its triangles differ between runs. */
struct qmat_hull_points {
  Delaunay delaunay;
};

qmat_status qmat_growing_hull_of(qmat_growing_hull *hull, const double *points, size_t count, uint32_t *triangles,
                                 size_t *triangle_count) {
  try {
    if (hull->inserted == nullptr) hull->inserted = new qmat_hull_points;
    Delaunay &delaunay = hull->inserted->delaunay;
    for (; hull->count < count; hull->count++) {
      qmat_reserve_cells(delaunay);
      const double *p = points + 3 * hull->count;
      delaunay.insert(Kernel::Point_3(p[0], p[1], p[2]))->info() = static_cast<uint32_t>(hull->count);
    }
    if (delaunay.dimension() < 3) return QMAT_ERROR_GEOMETRY;
    std::vector<Delaunay::Cell_handle> outside;
    delaunay.incident_cells(delaunay.infinite_vertex(), std::back_inserter(outside));
    std::vector<std::array<uint32_t, 3>> faces;
    for (const auto cell : outside) {
      const auto inside = cell->neighbor(cell->index(delaunay.infinite_vertex()));
      const int opposite = inside->index(cell);
      std::array<uint32_t, 3> row{};
      for (int k = 0; k < 3; k++)
        row[static_cast<size_t>(2 - k)] = inside->vertex(Delaunay::vertex_triple_index(opposite, k))->info();
      std::rotate(row.begin(), std::min_element(row.begin(), row.end()), row.end());
      faces.push_back(row);
    }
    if (faces.size() > 2 * count) return QMAT_ERROR_GEOMETRY;
    std::sort(faces.begin(), faces.end());
    for (const auto &row : faces) triangles = std::copy(row.begin(), row.end(), triangles);
    *triangle_count = faces.size();
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
