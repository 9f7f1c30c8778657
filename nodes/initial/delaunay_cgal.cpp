/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/delaunay_cgal.h"

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Delaunay_triangulation_cell_base_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Spatial_sort_traits_adapter_3.h>
#include <CGAL/Triangulation_cell_base_with_info_3.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>
#include <CGAL/property_map.h>
#include <CGAL/spatial_sort.h>

#include "core/geometry/reserve_cells_cgal.h"

#include <algorithm>
#include <array>
#include <exception>
#include <new>
#include <numeric>
#include <vector>

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_3<uint32_t, Kernel>;
using CellBase =
    CGAL::Triangulation_cell_base_with_info_3<uint32_t, Kernel, CGAL::Delaunay_triangulation_cell_base_3<Kernel>>;
using Triangulation =
    CGAL::Delaunay_triangulation_3<Kernel, CGAL::Triangulation_data_structure_3<VertexBase, CellBase>>;

constexpr size_t kPointsPerReport = 4096;

qmat_status triangulate(qmat_context *context, const std::vector<Point> &points, Triangulation &triangulation) {
  using PointMap = CGAL::Pointer_property_map<Point>::const_type;
  using SortTraits = CGAL::Spatial_sort_traits_adapter_3<Kernel, PointMap>;
  std::vector<size_t> order(points.size());
  std::iota(order.begin(), order.end(), size_t{0});
  CGAL::spatial_sort(order.begin(), order.end(), SortTraits(CGAL::make_property_map(points)));
  Triangulation::Cell_handle hint;
  for (size_t i = 0; i < order.size(); i++) {
    if (i % kPointsPerReport == 0) {
      const qmat_status status = qmat_progress(context, i, order.size(), "samples");
      if (status != QMAT_OK) return status;
    }
    const auto id = static_cast<uint32_t>(order[i]);
    qmat_reserve_cells(triangulation);
    const size_t before = triangulation.number_of_vertices();
    const auto vertex = triangulation.insert(points[order[i]], hint);
    const bool is_new = triangulation.number_of_vertices() > before;
    vertex->info() = is_new ? id : std::min(vertex->info(), id);
    hint = vertex->cell();
  }
  return QMAT_OK;
}

qmat_status collect(qmat_context *context, Triangulation &triangulation, qmat_tetrahedra *tetrahedra) {
  struct Cell {
    std::array<uint32_t, 4> sorted;
    Triangulation::Cell_handle handle;
  };
  std::vector<Cell> cells;
  cells.reserve(triangulation.number_of_finite_cells());
  for (auto cell = triangulation.all_cells_begin(); cell != triangulation.all_cells_end(); cell++) {
    cell->info() = QMAT_NO_TETRAHEDRON;
    if (triangulation.is_infinite(cell)) continue;
    std::array<uint32_t, 4> ids;
    for (size_t k = 0; k < 4; k++) ids[k] = cell->vertex(static_cast<int>(k))->info();
    std::sort(ids.begin(), ids.end());
    cells.push_back({ids, cell});
  }
  std::sort(cells.begin(), cells.end(), [](const Cell &a, const Cell &b) { return a.sorted < b.sorted; });
  tetrahedra->count = cells.size();
  tetrahedra->corners = static_cast<uint32_t *>(qmat_arena_alloc(&context->arena, cells.size(), 4 * sizeof(uint32_t)));
  tetrahedra->neighbours =
      static_cast<uint32_t *>(qmat_arena_alloc(&context->arena, cells.size(), 4 * sizeof(uint32_t)));
  if (!tetrahedra->corners || !tetrahedra->neighbours) return qmat_fail_memory(context, "tetrahedra");
  for (size_t i = 0; i < cells.size(); i++) cells[i].handle->info() = static_cast<uint32_t>(i);
  for (size_t i = 0; i < cells.size(); i++) {
    /* The order of CGAL's corners depends on the insertion history. Even permutations start every cell at its smallest
     * id, so that the result is the same in every run and with every compiler. */
    std::array<int, 4> corner = {0, 1, 2, 3};
    const auto id = [&](int k) { return cells[i].handle->vertex(k)->info(); };
    const auto first = std::min_element(corner.begin(), corner.end(), [&](int a, int b) { return id(a) < id(b); });
    static constexpr int kEven[4][4] = {{0, 1, 2, 3}, {1, 0, 3, 2}, {2, 0, 1, 3}, {3, 0, 2, 1}};
    const int *even = kEven[*first];
    int b = even[1], c = even[2], d = even[3];
    while (id(b) > id(c) || id(b) > id(d)) {
      const int t = b;
      b = c, c = d, d = t;
    }
    const int chosen[4] = {even[0], b, c, d};
    for (size_t k = 0; k < 4; k++) {
      tetrahedra->corners[4 * i + k] = id(chosen[k]);
      tetrahedra->neighbours[4 * i + k] = cells[i].handle->neighbor(chosen[k])->info();
    }
  }
  return QMAT_OK;
}

}  // namespace

qmat_status qmat_delaunay_tetrahedra(qmat_context *context, const double *points, size_t count,
                                     qmat_tetrahedra *tetrahedra) {
  *tetrahedra = {};
  if (count >= QMAT_NO_TETRAHEDRON)
    return qmat_fail(context, QMAT_ERROR_MEMORY, "%zu samples are too many for a triangulation", count);
  try {
    std::vector<Point> sites;
    sites.reserve(count);
    for (size_t i = 0; i < count; i++) sites.emplace_back(points[3 * i], points[3 * i + 1], points[3 * i + 2]);
    Triangulation triangulation;
    const qmat_status status = triangulate(context, sites, triangulation);
    if (status != QMAT_OK) return status;
    if (triangulation.dimension() < 3) {
      qmat_fail(context, QMAT_ERROR_GEOMETRY, "all %zu samples are coplanar, so they enclose no solid", count);
      return qmat_fail_field(context, "samples");
    }
    return collect(context, triangulation, tetrahedra);
  } catch (const std::bad_alloc &) {
    return qmat_fail_memory(context, "the Delaunay triangulation");
  } catch (const std::exception &failure) {
    return qmat_fail(context, QMAT_ERROR_DEPENDENCY, "CGAL: %s", failure.what());
  } catch (...) {
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "the Delaunay triangulation failed in an unknown way");
  }
}
