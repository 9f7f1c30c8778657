/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/delaunay_cgal.h"

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Delaunay_triangulation_cell_base_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Simple_cartesian.h>
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

using RealKernel = CGAL::Exact_predicates_inexact_constructions_kernel;

/* With coordinates up to QMAT_LATTICE_MOST the largest determinant, that of coplanar points, has 62 bits. */
using LatticeKernel = CGAL::Simple_cartesian<int64_t>;

template <class Kernel>
using VertexBase = CGAL::Triangulation_vertex_base_with_info_3<uint32_t, Kernel>;
template <class Kernel>
using CellBase =
    CGAL::Triangulation_cell_base_with_info_3<uint32_t, Kernel, CGAL::Delaunay_triangulation_cell_base_3<Kernel>>;
template <class Kernel>
using Delaunay =
    CGAL::Delaunay_triangulation_3<Kernel, CGAL::Triangulation_data_structure_3<VertexBase<Kernel>, CellBase<Kernel>>>;

constexpr size_t kPointsPerReport = 4096, kCellsPerReport = 65536;

template <class Kernel>
qmat_status triangulate(qmat_context *context, const std::vector<typename Kernel::Point_3> &points,
                        Delaunay<Kernel> &triangulation) {
  using PointMap = typename CGAL::Pointer_property_map<typename Kernel::Point_3>::const_type;
  using SortTraits = CGAL::Spatial_sort_traits_adapter_3<Kernel, PointMap>;
  std::vector<size_t> order(points.size());
  std::iota(order.begin(), order.end(), size_t{0});
  CGAL::spatial_sort(order.begin(), order.end(), SortTraits(CGAL::make_property_map(points)));
  typename Delaunay<Kernel>::Cell_handle hint;
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

template <class Triangulation>
struct Cell {
  std::array<uint32_t, 4> sorted;
  typename Triangulation::Cell_handle handle;
};

/* The finite cells by their corner ids: a counting sort by the first, whose groups are small. */
template <class Triangulation>
qmat_status sort_cells(qmat_context *context, Triangulation &triangulation, size_t point_count,
                       std::vector<Cell<Triangulation>> &cells) {
  const size_t all = triangulation.number_of_cells();
  std::vector<size_t> ends(point_count + 2);
  std::vector<Cell<Triangulation>> found;
  found.reserve(triangulation.number_of_finite_cells());
  size_t seen = 0;
  qmat_status status;
  for (auto cell = triangulation.all_cells_begin(); cell != triangulation.all_cells_end(); cell++) {
    if (seen++ % kCellsPerReport == 0 && (status = qmat_progress(context, seen, all, "tetrahedra")) != QMAT_OK)
      return status;
    cell->info() = QMAT_NO_TETRAHEDRON;
    if (triangulation.is_infinite(cell)) continue;
    std::array<uint32_t, 4> ids;
    for (size_t k = 0; k < 4; k++) ids[k] = cell->vertex(static_cast<int>(k))->info();
    std::sort(ids.begin(), ids.end());
    found.push_back({ids, cell});
    ends[ids[0] + 2]++;
  }
  for (size_t i = 0; i <= point_count; i++) ends[i + 1] += ends[i];
  cells.resize(found.size());
  for (const auto &cell : found) cells[ends[cell.sorted[0] + 1]++] = cell;
  for (size_t i = 0; i < point_count; i++) {
    if (i % kCellsPerReport == 0 && (status = qmat_progress(context, i, point_count, "samples")) != QMAT_OK)
      return status;
    std::sort(cells.begin() + static_cast<std::ptrdiff_t>(ends[i]),
              cells.begin() + static_cast<std::ptrdiff_t>(ends[i + 1]),
              [](const auto &a, const auto &b) { return a.sorted < b.sorted; });
  }
  return QMAT_OK;
}

template <class Triangulation>
qmat_status collect(qmat_context *context, Triangulation &triangulation, size_t point_count,
                    qmat_tetrahedra *tetrahedra) {
  std::vector<Cell<Triangulation>> cells;
  qmat_status status = sort_cells(context, triangulation, point_count, cells);
  if (status != QMAT_OK) return status;
  tetrahedra->count = cells.size();
  tetrahedra->corners = static_cast<uint32_t *>(qmat_arena_alloc(&context->arena, cells.size(), 4 * sizeof(uint32_t)));
  tetrahedra->neighbours =
      static_cast<uint32_t *>(qmat_arena_alloc(&context->arena, cells.size(), 4 * sizeof(uint32_t)));
  if (!tetrahedra->corners || !tetrahedra->neighbours) return qmat_fail_memory(context, "tetrahedra");
  for (size_t i = 0; i < cells.size(); i++) cells[i].handle->info() = static_cast<uint32_t>(i);
  for (size_t i = 0; i < cells.size(); i++) {
    if (i % kCellsPerReport == 0 && (status = qmat_progress(context, i, cells.size(), "tetrahedra")) != QMAT_OK)
      return status;
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

template <class Kernel, class Number>
qmat_status tetrahedra_of(qmat_context *context, const Number *points, size_t count, qmat_tetrahedra *tetrahedra) {
  *tetrahedra = {};
  if (count >= QMAT_NO_TETRAHEDRON)
    return qmat_fail(context, QMAT_ERROR_MEMORY, "%zu samples are too many for a triangulation", count);
  try {
    std::vector<typename Kernel::Point_3> sites;
    sites.reserve(count);
    for (size_t i = 0; i < count; i++) sites.emplace_back(points[3 * i], points[3 * i + 1], points[3 * i + 2]);
    Delaunay<Kernel> triangulation;
    const qmat_status status = triangulate<Kernel>(context, sites, triangulation);
    if (status != QMAT_OK) return status;
    if (triangulation.dimension() < 3) {
      qmat_fail(context, QMAT_ERROR_GEOMETRY, "all %zu samples are coplanar, so they enclose no solid", count);
      return qmat_fail_field(context, "samples");
    }
    return collect(context, triangulation, count, tetrahedra);
  } catch (const std::bad_alloc &) {
    return qmat_fail_memory(context, "the Delaunay triangulation");
  } catch (const std::exception &failure) {
    return qmat_fail(context, QMAT_ERROR_DEPENDENCY, "CGAL: %s", failure.what());
  } catch (...) {
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "the Delaunay triangulation failed in an unknown way");
  }
}

}  // namespace

qmat_status qmat_delaunay_tetrahedra(qmat_context *context, const double *points, size_t count,
                                     qmat_tetrahedra *tetrahedra) {
  return tetrahedra_of<RealKernel>(context, points, count, tetrahedra);
}

qmat_status qmat_delaunay_lattice(qmat_context *context, const int32_t *points, size_t count,
                                  qmat_tetrahedra *tetrahedra) {
  return tetrahedra_of<LatticeKernel>(context, points, count, tetrahedra);
}
