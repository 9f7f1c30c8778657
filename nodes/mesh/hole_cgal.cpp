/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/hole_cgal.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/utility.h>

#include <algorithm>
#include <exception>
#include <new>
#include <utility>
#include <vector>

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Polygon = std::vector<Kernel::Point_3>;
using Patch = std::vector<CGAL::Triple<int, int, int>>;

/* Polygons of at most this many sides are searched in full. CGAL's quicker search among Delaunay triangles takes the
 * first of equally good triangulations in an order that depends on where its memory is. */
constexpr size_t kMostCubic = 200;

/* Polygons whose corners are within this share of their size from a plane are triangulated in it. CGAL's default is a
 * share of the least side of the bounding box, which is rounding alone for the end of an upright prism. */
constexpr double kNearlyFlat = 0.01;

/* Whether a triangle runs along the polygon; a side of the polygon decides. */
bool runs_along(const Patch &patch, int count) {
  for (const auto &t : patch) {
    const int corners[3] = {t.first, t.second, t.third};
    for (int k = 0; k < 3; k++) {
      const int from = corners[k], to = corners[(k + 1) % 3];
      if (to == (from + 1) % count) return true;
      if (from == (to + 1) % count) return false;
    }
  }
  return true;
}

Patch triangulate(const Polygon &points, const Polygon &thirds) {
  Patch patch;
  if (points.size() > 3) {
    const bool is_long = points.size() > kMostCubic;
    const CGAL::Bbox_3 box = CGAL::bbox_3(points.begin(), points.end());
    const double size = std::max({box.x_span(), box.y_span(), box.z_span()});
    CGAL::Polygon_mesh_processing::triangulate_hole_polyline(
        points, thirds, std::back_inserter(patch),
        CGAL::parameters::use_2d_constrained_delaunay_triangulation(true)
            .threshold_distance(kNearlyFlat * size)
            .use_delaunay_triangulation(is_long)
            .do_not_use_cubic_algorithm(is_long));
  }
  if (patch.size() != points.size() - 2) {
    patch.clear();
    for (int i = 1; i + 1 < static_cast<int>(points.size()); i++) patch.emplace_back(0, i, i + 1);
  }
  return patch;
}

}  // namespace

qmat_status qmat_triangulate_hole(qmat_context *context, const double *points, const double *thirds, size_t count,
                                  uint32_t *triangles) {
  try {
    Polygon polygon, around;
    for (size_t i = 0; i < 3 * count; i += 3) {
      polygon.emplace_back(points[i], points[i + 1], points[i + 2]);
      around.emplace_back(thirds[i], thirds[i + 1], thirds[i + 2]);
    }
    const Patch patch = triangulate(polygon, around);
    const bool along = runs_along(patch, static_cast<int>(count));
    for (const auto &t : patch) {
      *triangles++ = static_cast<uint32_t>(t.first);
      *triangles++ = static_cast<uint32_t>(along ? t.second : t.third);
      *triangles++ = static_cast<uint32_t>(along ? t.third : t.second);
    }
    return QMAT_OK;
  } catch (const std::bad_alloc &) {
    return qmat_fail_memory(context, "the caps");
  } catch (const std::exception &failure) {
    return qmat_fail(context, QMAT_ERROR_DEPENDENCY, "CGAL: %s", failure.what());
  } catch (...) {
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "closing a border failed in an unknown way");
  }
}
