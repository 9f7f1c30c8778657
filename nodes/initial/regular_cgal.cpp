/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/regular_cgal.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Regular_triangulation_3.h>
#include <CGAL/Regular_triangulation_vertex_base_3.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>

#include "nodes/initial/regular_insert_cgal.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <exception>
#include <new>
#include <vector>

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Sphere = Kernel::Weighted_point_3;
using PowerTriangulation =
    CGAL::Regular_triangulation_3<Kernel, CGAL::Triangulation_data_structure_3<RegularVertexBase, RegularCellBase>>;

constexpr size_t kSimplicesPerReport = 65536;

/* Copies the simplices, whose ids ascend, in lexicographic order. */
template <size_t N>
qmat_status copy_sorted(qmat_context *context, Simplices<N> &simplices, size_t count, uint32_t **copy) {
  const qmat_status status = sort_in_groups(
      context, simplices, count, [](const auto &ids) { return ids[0]; },
      [](const auto &a, const auto &b) { return a < b; });
  if (status != QMAT_OK) return status;
  *copy = static_cast<uint32_t *>(qmat_arena_alloc(&context->arena, simplices.size(), N * sizeof(uint32_t)));
  if (!*copy) return qmat_fail_memory(context, "the power diagram");
  if (!simplices.empty()) std::memcpy(*copy, simplices.data(), simplices.size() * N * sizeof(uint32_t));
  return QMAT_OK;
}

qmat_status collect(qmat_context *context, const PowerTriangulation &triangulation, size_t count,
                    qmat_regular_simplices *found) {
  Simplices<2> edges;
  Simplices<3> triangles;
  qmat_status status;
  size_t done = 0;
  for (auto edge = triangulation.finite_edges_begin(); edge != triangulation.finite_edges_end(); edge++) {
    if (done++ % kSimplicesPerReport == 0 && (status = qmat_progress(context, 0, 0, "edges")) != QMAT_OK) return status;
    const uint32_t a = edge->first->vertex(edge->second)->info().value;
    const uint32_t b = edge->first->vertex(edge->third)->info().value;
    edges.push_back({std::min(a, b), std::max(a, b)});
  }
  for (auto facet = triangulation.finite_facets_begin(); facet != triangulation.finite_facets_end(); facet++) {
    if (done++ % kSimplicesPerReport == 0 && (status = qmat_progress(context, 0, 0, "facets")) != QMAT_OK)
      return status;
    std::array<uint32_t, 3> ids;
    for (int k = 0, n = 0; k < 4; k++)
      if (k != facet->second) ids[static_cast<size_t>(n++)] = facet->first->vertex(k)->info().value;
    std::sort(ids.begin(), ids.end());
    triangles.push_back(ids);
  }
  found->edge_count = edges.size();
  found->triangle_count = triangles.size();
  status = copy_sorted(context, edges, count, &found->edges);
  if (status == QMAT_OK) status = copy_sorted(context, triangles, count, &found->triangles);
  if (status != QMAT_OK) return status;
  found->hidden = static_cast<uint8_t *>(qmat_arena_alloc(&context->arena, count, 1));
  if (!found->hidden) return qmat_fail_memory(context, "the power diagram");
  std::memset(found->hidden, 1, count);
  for (auto vertex = triangulation.finite_vertices_begin(); vertex != triangulation.finite_vertices_end(); vertex++)
    found->hidden[vertex->info().value] = 0;
  return QMAT_OK;
}

}  // namespace

qmat_status qmat_regular_simplices_find(qmat_context *context, const double *spheres, size_t count,
                                        qmat_regular_simplices *simplices) {
  *simplices = {};
  if (count >= UINT32_MAX)
    return qmat_fail(context, QMAT_ERROR_MEMORY, "%zu spheres are too many for a triangulation", count);
  try {
    std::vector<Sphere> sites;
    sites.reserve(count);
    for (size_t i = 0; i < count; i++) {
      const double *s = spheres + 4 * i;
      sites.emplace_back(Kernel::Point_3(s[0], s[1], s[2]), s[3] * s[3]);
    }
    PowerTriangulation triangulation;
    const qmat_status status = insert_spheres(context, sites, triangulation);
    return status == QMAT_OK ? collect(context, triangulation, count, simplices) : status;
  } catch (const std::bad_alloc &) {
    return qmat_fail_memory(context, "the power diagram");
  } catch (const std::exception &failure) {
    return qmat_fail(context, QMAT_ERROR_DEPENDENCY, "CGAL: %s", failure.what());
  } catch (...) {
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "the power diagram failed in an unknown way");
  }
}
