/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/ball_union_cgal.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Regular_triangulation_3.h>
#include <CGAL/Regular_triangulation_vertex_base_3.h>
#include <CGAL/Triangulation_cell_base_with_info_3.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>

#include "nodes/initial/regular_insert_cgal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <exception>
#include <new>
#include <vector>

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Ball = Kernel::Weighted_point_3;
using Point = Kernel::Point_3;
using Vector = Kernel::Vector_3;

/* Whether a tetrahedron belongs to the dual shape, and which of its facets are singular. */
struct CellInfo {
  bool in_shape = false;
  std::array<bool, 4> is_singular = {false, false, false, false};
};

using BallCellBase = CGAL::Triangulation_cell_base_with_info_3<CellInfo, Kernel, RegularCellBase>;
using BallTriangulation =
    CGAL::Regular_triangulation_3<Kernel, CGAL::Triangulation_data_structure_3<RegularVertexBase, BallCellBase>>;
using Cell = BallTriangulation::Cell_handle;

constexpr size_t kSimplicesPerReport = 2048;

/* The corners of a box around all balls, without weight: the triangulation is three-dimensional, and no simplex of
 * balls is on its hull. */
constexpr double kBoxReach = 8;
constexpr size_t kBoxCorners = 8;

struct Corner {
  std::array<uint32_t, 3> balls;
  std::array<double, 3> point;
};

}  // namespace

struct qmat_ball_union {
  BallTriangulation triangulation;
  size_t count = 0;
};

namespace {

bool is_small(const BallTriangulation &t, const Cell &c, int i) {
  const auto compare = t.geom_traits().compare_weighted_squared_radius_3_object();
  const Ball &p = c->vertex((i + 1) & 3)->point(), &q = c->vertex((i + 2) & 3)->point(),
             &r = c->vertex((i + 3) & 3)->point();
  return compare(p, q, r, 0.0) != CGAL::LARGER;
}

/* The end of the dual Voronoi edge inside the three balls of a facet, on the side of its tetrahedron: the point where
 * their spheres meet. */
std::array<double, 3> corner_of(const Cell &cell, int facet) {
  std::array<const Ball *, 3> balls;
  for (int k = 0, n = 0; k < 4; k++)
    if (k != facet) balls[static_cast<size_t>(n++)] = &cell->vertex(k)->point();
  std::sort(balls.begin(), balls.end(), [](const Ball *a, const Ball *b) { return a->point() < b->point(); });
  const Point &o = balls[0]->point();
  const Vector u = balls[1]->point() - o, v = balls[2]->point() - o;
  const double a = 0.5 * (u * u + balls[0]->weight() - balls[1]->weight());
  const double b = 0.5 * (v * v + balls[0]->weight() - balls[2]->weight());
  Vector n = CGAL::cross_product(u, v);
  const double square = n * n;
  const Vector foot = (a * CGAL::cross_product(v, n) + b * CGAL::cross_product(n, u)) / square;
  if (n * (cell->vertex(facet)->point().point() - o) < 0) n = -n;
  const double height = std::sqrt(std::max(0.0, (balls[0]->weight() - foot * foot) / square));
  const Vector at = foot + height * n;
  return {o.x() + at.x(), o.y() + at.y(), o.z() + at.z()};
}

std::array<uint32_t, 3> balls_of(const Cell &cell, int facet) {
  std::array<uint32_t, 3> ids;
  for (int k = 0, n = 0; k < 4; k++)
    if (k != facet) ids[static_cast<size_t>(n++)] = cell->vertex(k)->info().value;
  std::sort(ids.begin(), ids.end());
  return ids;
}

qmat_status find_cells(qmat_context *context, BallTriangulation &t) {
  const auto compare = t.geom_traits().compare_weighted_squared_radius_3_object();
  size_t done = 0;
  for (auto c = t.finite_cells_begin(); c != t.finite_cells_end(); c++) {
    if (done++ % kSimplicesPerReport == 0) {
      const qmat_status status = qmat_progress(context, 0, 0, "balls");
      if (status != QMAT_OK) return status;
    }
    c->info().in_shape = compare(c->vertex(0)->point(), c->vertex(1)->point(), c->vertex(2)->point(),
                                 c->vertex(3)->point(), 0.0) != CGAL::LARGER;
  }
  return QMAT_OK;
}

/* A facet of the shape that has no tetrahedron of the shape on a side has a corner there. */
qmat_status find_corners(qmat_context *context, BallTriangulation &t, std::vector<Corner> &corners,
                         Simplices<3> &singular) {
  size_t done = 0;
  for (auto f = t.finite_facets_begin(); f != t.finite_facets_end(); f++) {
    if (done++ % kSimplicesPerReport == 0) {
      const qmat_status status = qmat_progress(context, 0, 0, "balls");
      if (status != QMAT_OK) return status;
    }
    const Cell cells[2] = {f->first, f->first->neighbor(f->second)};
    const int sides[2] = {f->second, t.mirror_index(f->first, f->second)};
    const bool in[2] = {cells[0]->info().in_shape, cells[1]->info().in_shape};
    if (in[0] && in[1]) continue;
    if (!in[0] && !in[1]) {
      if (t.is_infinite(cells[0]) || t.is_infinite(cells[1])) continue; /* of the box */
      if (!is_small(t, cells[0], sides[0]) || !t.is_Gabriel(*f)) continue;
      for (int k = 0; k < 2; k++) cells[k]->info().is_singular[static_cast<size_t>(sides[k])] = true;
      singular.push_back(balls_of(cells[0], sides[0]));
    }
    for (int k = 0; k < 2; k++)
      if (!in[k]) corners.push_back({balls_of(cells[k], sides[k]), corner_of(cells[k], sides[k])});
  }
  return QMAT_OK;
}

/* Whether a facet at the edge belongs to the shape. */
bool is_side(const BallTriangulation &t, const BallTriangulation::Edge &edge) {
  auto facet = t.incident_facets(edge);
  const auto first = facet;
  do {
    const BallTriangulation::Facet side = *facet;
    const Cell cell = side.first;
    if (cell->info().in_shape || cell->neighbor(side.second)->info().in_shape) return true;
    if (cell->info().is_singular[static_cast<size_t>(side.second)]) return true;
  } while (++facet != first);
  return false;
}

qmat_status find_edges(qmat_context *context, const BallTriangulation &t, size_t count, Simplices<2> &singular,
                       std::vector<uint8_t> &isolated) {
  const auto compare = t.geom_traits().compare_weighted_squared_radius_3_object();
  size_t done = 0;
  for (auto v = t.finite_vertices_begin(); v != t.finite_vertices_end(); v++) {
    if (done++ % kSimplicesPerReport == 0) {
      const qmat_status status = qmat_progress(context, 0, 0, "balls");
      if (status != QMAT_OK) return status;
    }
    if (v->info().value < count && t.is_Gabriel(v)) isolated[v->info().value] = 1;
  }
  for (auto e = t.finite_edges_begin(); e != t.finite_edges_end(); e++) {
    if (done++ % kSimplicesPerReport == 0) {
      const qmat_status status = qmat_progress(context, 0, 0, "balls");
      if (status != QMAT_OK) return status;
    }
    const auto a = e->first->vertex(e->second), b = e->first->vertex(e->third);
    std::array<uint32_t, 2> ids = {a->info().value, b->info().value};
    if (ids[0] >= count || ids[1] >= count) continue;
    const bool side = is_side(t, *e);
    if (!side && (compare(a->point(), b->point(), 0.0) == CGAL::LARGER || !t.is_Gabriel(*e))) continue;
    isolated[ids[0]] = isolated[ids[1]] = 0;
    if (side) continue;
    std::sort(ids.begin(), ids.end());
    singular.push_back(ids);
  }
  return QMAT_OK;
}

template <class T>
T *copy_to_arena(qmat_context *context, const void *from, size_t count, size_t each) {
  auto *copy = static_cast<T *>(qmat_arena_alloc(&context->arena, count, each * sizeof(T)));
  if (copy && count > 0) std::memcpy(copy, from, count * each * sizeof(T));
  return copy;
}

qmat_status collect(qmat_context *context, qmat_ball_union &u, qmat_ball_union_parts *parts) {
  std::vector<Corner> corners;
  Simplices<3> triangles;
  Simplices<2> edges;
  std::vector<uint8_t> isolated(u.count, 0);
  qmat_status status = find_cells(context, u.triangulation);
  if (status == QMAT_OK) status = find_corners(context, u.triangulation, corners, triangles);
  if (status == QMAT_OK) status = find_edges(context, u.triangulation, u.count, edges, isolated);
  if (status == QMAT_OK)
    status = sort_in_groups(
        context, corners, u.count + kBoxCorners, [](const Corner &corner) { return corner.balls[0]; },
        [](const Corner &a, const Corner &b) { return a.balls != b.balls ? a.balls < b.balls : a.point < b.point; });
  if (status != QMAT_OK) return status;
  std::sort(triangles.begin(), triangles.end());
  std::sort(edges.begin(), edges.end());
  parts->corner_count = corners.size();
  parts->edge_count = edges.size();
  parts->triangle_count = triangles.size();
  parts->corners = static_cast<double *>(qmat_arena_alloc(&context->arena, corners.size(), 3 * sizeof(double)));
  parts->corner_balls =
      static_cast<uint32_t *>(qmat_arena_alloc(&context->arena, corners.size(), 3 * sizeof(uint32_t)));
  parts->edges = copy_to_arena<uint32_t>(context, edges.data(), edges.size(), 2);
  parts->triangles = copy_to_arena<uint32_t>(context, triangles.data(), triangles.size(), 3);
  parts->isolated = copy_to_arena<uint8_t>(context, isolated.data(), isolated.size(), 1);
  if (!parts->corners || !parts->corner_balls || !parts->edges || !parts->triangles || !parts->isolated)
    return qmat_fail_memory(context, "the union of balls");
  for (size_t i = 0; i < corners.size(); i++)
    for (size_t k = 0; k < 3; k++) {
      parts->corners[3 * i + k] = corners[i].point[k];
      parts->corner_balls[3 * i + k] = corners[i].balls[k];
    }
  return QMAT_OK;
}

/* A point on a side that several tetrahedra share is in the shape if one of them is. */
bool contains(const BallTriangulation &t, const Point &point, Cell &hint) {
  BallTriangulation::Locate_type type;
  int i, j;
  const Cell cell = t.locate(Ball(point, 0), type, i, j, hint);
  hint = cell;
  if (cell == Cell() || type == BallTriangulation::OUTSIDE_CONVEX_HULL ||
      type == BallTriangulation::OUTSIDE_AFFINE_HULL)
    return false;
  if (cell->info().in_shape) return true;
  if (type == BallTriangulation::FACET) return cell->neighbor(i)->info().in_shape;
  if (type == BallTriangulation::EDGE) {
    auto at = t.incident_cells(cell, i, j);
    const auto first = at;
    do {
      if (at->info().in_shape) return true;
    } while (++at != first);
  }
  if (type == BallTriangulation::VERTEX) {
    std::vector<Cell> cells;
    t.incident_cells(cell->vertex(i), std::back_inserter(cells));
    return std::any_of(cells.begin(), cells.end(), [](const Cell &c) { return c->info().in_shape; });
  }
  return false;
}

/* Runs `work` and turns what it throws into an error. */
template <class Work>
qmat_status guarded(qmat_context *context, const Work &work) {
  try {
    return work();
  } catch (const std::bad_alloc &) {
    return qmat_fail_memory(context, "the union of balls");
  } catch (const std::exception &failure) {
    return qmat_fail(context, QMAT_ERROR_DEPENDENCY, "CGAL: %s", failure.what());
  } catch (...) {
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "the union of balls failed in an unknown way");
  }
}

}  // namespace

qmat_status qmat_ball_union_new(qmat_context *context, const double *balls, size_t count, qmat_ball_union **balls_union,
                                qmat_ball_union_parts *parts) {
  *balls_union = nullptr;
  *parts = {};
  if (count >= UINT32_MAX - kBoxCorners) return qmat_fail(context, QMAT_ERROR_MEMORY, "%zu balls are too many", count);
  const qmat_status status = guarded(context, [&]() {
    *balls_union = new qmat_ball_union;
    (*balls_union)->count = count;
    std::vector<Ball> sites;
    sites.reserve(count + kBoxCorners);
    for (size_t i = 0; i < count; i++) {
      const double *s = balls + 4 * i;
      sites.emplace_back(Point(s[0], s[1], s[2]), s[3] * s[3]);
    }
    for (size_t i = 0; i < kBoxCorners; i++)
      sites.emplace_back(
          Point(i & 1 ? kBoxReach : -kBoxReach, i & 2 ? kBoxReach : -kBoxReach, i & 4 ? kBoxReach : -kBoxReach), 0);
    const qmat_status inserted = insert_spheres(context, sites, (*balls_union)->triangulation);
    return inserted == QMAT_OK ? collect(context, **balls_union, parts) : inserted;
  });
  if (status != QMAT_OK) {
    delete *balls_union;
    *balls_union = nullptr;
  }
  return status;
}

void qmat_ball_union_free(qmat_ball_union *balls_union) {
  delete balls_union;
}

qmat_status qmat_ball_union_contains(qmat_context *context, qmat_ball_union *balls_union, const double *points,
                                     size_t stride, size_t count, uint8_t *inside) {
  return guarded(context, [&]() {
    Cell hint;
    for (size_t i = 0; i < count; i++) {
      if (i % 4096 == 0) {
        const qmat_status status = qmat_progress(context, i, count, "Voronoi vertices");
        if (status != QMAT_OK) return status;
      }
      const double *p = points + stride * i;
      inside[i] = contains(balls_union->triangulation, Point(p[0], p[1], p[2]), hint);
    }
    return QMAT_OK;
  });
}
