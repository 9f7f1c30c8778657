/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/convex_hull_cgal.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/convex_hull_3.h>

#include <algorithm>
#include <array>
#include <exception>
#include <map>
#include <new>
#include <vector>

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

qmat_status qmat_convex_hull(const double *points, size_t count, uint32_t *triangles, size_t *triangle_count) {
  try {
    std::vector<Kernel::Point_3> given;
    std::map<std::array<double, 3>, uint32_t> ids;
    given.reserve(count);
    for (size_t i = 0; i < count; i++) {
      const double *p = points + 3 * i;
      given.emplace_back(p[0], p[1], p[2]);
      ids.try_emplace({p[0], p[1], p[2]}, static_cast<uint32_t>(i));
    }
    CGAL::Surface_mesh<Kernel::Point_3> hull;
    CGAL::convex_hull_3(given.begin(), given.end(), hull);
    std::vector<std::array<uint32_t, 3>> faces;
    for (const auto face : hull.faces()) {
      std::array<uint32_t, 3> row{};
      size_t k = 0;
      for (const auto vertex : hull.vertices_around_face(hull.halfedge(face))) {
        const Kernel::Point_3 &p = hull.point(vertex);
        if (k == 3) return QMAT_ERROR_GEOMETRY;
        row[k++] = ids.at({p.x(), p.y(), p.z()});
      }
      std::rotate(row.begin(), std::min_element(row.begin(), row.end()), row.end());
      faces.push_back(row);
    }
    if (faces.size() < 4 || faces.size() > 2 * count) return QMAT_ERROR_GEOMETRY;
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
