/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_REGULAR_INSERT_CGAL_H
#define QMAT_NODES_INITIAL_REGULAR_INSERT_CGAL_H

/* What the adapters of CGAL's regular triangulation share; for them alone. */

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Hidden_point_memory_policy.h>
#include <CGAL/Regular_triangulation_cell_base_3.h>
#include <CGAL/Regular_triangulation_vertex_base_3.h>
#include <CGAL/Spatial_sort_traits_adapter_3.h>
#include <CGAL/Triangulation_cell_base_3.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>
#include <CGAL/property_map.h>
#include <CGAL/spatial_sort.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <vector>

#include "core/context.h"
#include "core/geometry/reserve_cells_cgal.h"

/* What a vertex knows of its sphere. */
constexpr uint32_t kNoSphereId = UINT32_MAX;
struct SphereId {
  uint32_t value = kNoSphereId;
};

using RegularVertexBase = CGAL::Triangulation_vertex_base_with_info_3<
    SphereId, CGAL::Exact_predicates_inexact_constructions_kernel,
    CGAL::Regular_triangulation_vertex_base_3<CGAL::Exact_predicates_inexact_constructions_kernel>>;

/* The base of cells. Hidden spheres are not kept: only the rest of the triangulation is asked for. */
using RegularCellBase = CGAL::Regular_triangulation_cell_base_3<
    CGAL::Exact_predicates_inexact_constructions_kernel,
    CGAL::Triangulation_cell_base_3<CGAL::Exact_predicates_inexact_constructions_kernel>, CGAL::Discard_hidden_points>;

/* Simplices of N vertices each. */
template <size_t N>
using Simplices = std::vector<std::array<uint32_t, N>>;

/* Inserts the spheres in a spatial order. A vertex gets the smallest id of the spheres that are equal to its own. */
template <class Triangulation>
qmat_status insert_spheres(qmat_context *context, const std::vector<typename Triangulation::Weighted_point> &spheres,
                           Triangulation &triangulation) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using PointMap = CGAL::Pointer_property_map<Kernel::Point_3>::const_type;
  constexpr size_t kSpheresPerReport = 1024;
  std::vector<Kernel::Point_3> centres;
  centres.reserve(spheres.size());
  for (const auto &sphere : spheres) centres.push_back(sphere.point());
  std::vector<size_t> order(spheres.size());
  std::iota(order.begin(), order.end(), size_t{0});
  CGAL::spatial_sort(order.begin(), order.end(),
                     CGAL::Spatial_sort_traits_adapter_3<Kernel, PointMap>(PointMap(centres.data())));
  typename Triangulation::Cell_handle hint;
  for (size_t i = 0; i < order.size(); i++) {
    if (i % kSpheresPerReport == 0) {
      const qmat_status status = qmat_progress(context, i, order.size(), "spheres");
      if (status != QMAT_OK) return status;
    }
    qmat_reserve_cells(triangulation);
    const auto vertex = triangulation.insert(spheres[order[i]], hint);
    if (vertex == typename Triangulation::Vertex_handle()) continue; /* hidden */
    const auto id = static_cast<uint32_t>(order[i]);
    uint32_t &known = vertex->info().value;
    if (known == kNoSphereId || id < known || spheres[known].weight() != spheres[id].weight()) known = id;
    hint = vertex->cell();
  }
  return QMAT_OK;
}

/* Sorts items in the order of `is_less`, whose first criterion is `first_of`: an id below `id_count`. The groups of
 * equal ids are small, so that it can be cancelled at any time. */
template <class Item, class FirstOf, class IsLess>
qmat_status sort_in_groups(qmat_context *context, std::vector<Item> &items, size_t id_count, const FirstOf &first_of,
                           const IsLess &is_less) {
  constexpr size_t kGroupsPerReport = 8192;
  std::vector<size_t> ends(id_count + 2);
  for (const Item &item : items) ends[first_of(item) + 2]++;
  for (size_t i = 0; i <= id_count; i++) ends[i + 1] += ends[i];
  std::vector<Item> sorted(items.size());
  for (const Item &item : items) sorted[ends[first_of(item) + 1]++] = item;
  for (size_t i = 0; i < id_count; i++) {
    if (i % kGroupsPerReport == 0) {
      const qmat_status status = qmat_progress(context, i, id_count, "spheres");
      if (status != QMAT_OK) return status;
    }
    std::sort(sorted.begin() + static_cast<std::ptrdiff_t>(ends[i]),
              sorted.begin() + static_cast<std::ptrdiff_t>(ends[i + 1]), is_less);
  }
  items.swap(sorted);
  return QMAT_OK;
}

#endif
