/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/arrangement_cgal.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Constrained_triangulation_face_base_2.h>
#include <CGAL/Constrained_triangulation_plus_2.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "nodes/mesh/triangle_separation.h"

namespace qmat {
namespace {

struct Id {
  uint32_t value = kNone;
};
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<Id, Exact>;
/* The triangles of a plane over a face: how many there are, and how many more turn left than right. */
struct LayerCount {
  int count = 0, layers = 0;
  bool is_known = false;
};
using FaceBase =
    CGAL::Constrained_triangulation_face_base_2<Exact, CGAL::Triangulation_face_base_with_info_2<LayerCount, Exact>>;
using Delaunay =
    CGAL::Constrained_Delaunay_triangulation_2<Exact, CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>,
                                               CGAL::Exact_intersections_tag>;
using Triangulation = CGAL::Constrained_triangulation_plus_2<Delaunay>; /* computes crossings from whole segments */

/* The next vertex after `from` along the edges that lead straight to `to`. */
Triangulation::Vertex_handle next_vertex(const Triangulation &plane, Triangulation::Vertex_handle from,
                                         Triangulation::Vertex_handle to) {
  auto around = plane.incident_vertices(from);
  const auto first = around;
  do {
    if (plane.is_infinite(around)) continue;
    if (CGAL::orientation(from->point(), to->point(), around->point()) == CGAL::COLLINEAR &&
        CGAL::collinear_are_ordered_along_line(from->point(), around->point(), to->point()))
      return around;
  } while (++around != first);
  throw UnionRefused{"an edge is lost"};
}

class Cutter {
 public:
  Cutter(const UnionMesh &mesh, Arrangement &out)
      : mesh_(mesh), out_(out), planes_(mesh.new_sets(mesh.triangle_count())) {}

  void make(const std::vector<uint32_t> &triangles, const std::vector<Pair> &pairs) {
    out_.points.resize(mesh_.vertex_count());
    known_.resize(mesh_.vertex_count());
    same_.resize(mesh_.vertex_count());
    for (uint32_t v = 0; v < mesh_.vertex_count(); v++) same_[v] = v;
    for (const Pair &pair : pairs)
      for (size_t k = 0; k < 3; k++) {
        know(mesh_.corners(pair.first)[k]);
        know(mesh_.corners(pair.second)[k]);
      }
    for (size_t i = 0; i < pairs.size(); i++) {
      if (i % 64 == 0) mesh_.progress(i, pairs.size(), "pairs of triangles");
      meet(pairs[i].first, pairs[i].second);
    }
    cut_triangles(triangles);
  }

 private:
  struct Cut { /* a segment that cuts a triangle; a point where both ends are equal */
    uint32_t triangle, from, to;
  };
  const UnionMesh &mesh_;
  Arrangement &out_;
  uint32_t *planes_;        /* disjoint sets of triangles that overlap in a plane */
  std::vector<bool> known_; /* per vertex of the mesh: whether it has an exact point */
  std::map<Point, uint32_t> ids_;
  std::vector<uint32_t> same_; /* per vertex of the mesh: the first known vertex at the same point */
  std::vector<Cut> cuts_;

  /* ---- exact points ---- */

  void know(uint32_t vertex) {
    if (known_[vertex]) return;
    known_[vertex] = true;
    out_.points[vertex] = mesh_.exact(vertex);
    same_[vertex] = ids_.emplace(out_.points[vertex], vertex).first->second;
  }

  uint32_t id_of(const Point &point) {
    const auto found = ids_.emplace(point, static_cast<uint32_t>(out_.points.size()));
    if (found.second) {
      if (out_.points.size() >= kNone) throw std::bad_alloc();
      out_.points.push_back(point);
    }
    return found.first->second;
  }

  Exact::Triangle_3 exact_triangle(uint32_t triangle) const {
    const uint32_t *c = mesh_.corners(triangle);
    return {out_.points[c[0]], out_.points[c[1]], out_.points[c[2]]};
  }

  /* ---- planes ---- */

  /* A projection of a plane along an axis, such that the triangle that spans it turns left. */
  struct View {
    int right, up, depth;
    Exact::Point_2 flatten(const Point &p) const {
      return {p[right], p[up]};
    }
    Inexact::Point_2 flatten(const double *p) const {
      return {p[right], p[up]};
    }
  };

  CGAL::Orientation turn_of(uint32_t triangle, const View &view) const {
    const uint32_t *c = mesh_.corners(triangle);
    return CGAL::orientation(view.flatten(mesh_.position(c[0])), view.flatten(mesh_.position(c[1])),
                             view.flatten(mesh_.position(c[2])));
  }

  View view_of(uint32_t triangle) const {
    const uint32_t *c = mesh_.corners(triangle);
    std::array<double, 3> size;
    std::array<int, 3> axes = {0, 1, 2};
    for (int k = 0; k < 3; k++) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      const double *p = mesh_.position(c[0]), *q = mesh_.position(c[1]), *r = mesh_.position(c[2]);
      const double area = std::fabs((q[i] - p[i]) * (r[j] - p[j]) - (q[j] - p[j]) * (r[i] - p[i]));
      size[static_cast<size_t>(k)] = area > 0 ? area : 0; /* it may have overflowed */
    }
    std::stable_sort(axes.begin(), axes.end(),
                     [&](int a, int b) { return size[static_cast<size_t>(a)] > size[static_cast<size_t>(b)]; });
    for (const int k : axes) {
      const View view = {(k + 1) % 3, (k + 2) % 3, k};
      const auto turn = turn_of(triangle, view);
      if (turn == CGAL::LEFT_TURN) return view;
      if (turn == CGAL::RIGHT_TURN) return {view.up, view.right, k};
    }
    throw UnionRefused{"a triangle has no plane"};
  }

  /* Whether some edge of `other` separates it from a triangle. In this view `other` turns as `turn` says. */
  bool is_beside(uint32_t triangle, uint32_t other, const View &view, CGAL::Orientation turn) const {
    const uint32_t *c = mesh_.corners(triangle), *d = mesh_.corners(other);
    for (size_t k = 0; k < 3; k++) {
      const Inexact::Point_2 from = view.flatten(mesh_.position(d[k])),
                             to = view.flatten(mesh_.position(d[(k + 1) % 3]));
      bool is_separated = true;
      for (size_t i = 0; i < 3; i++)
        is_separated = is_separated && CGAL::orientation(from, to, view.flatten(mesh_.position(c[i]))) != turn;
      if (is_separated) return true;
    }
    return false;
  }

  /* Whether two triangles are coplanar and have area in common. */
  bool do_overlap(uint32_t a, uint32_t b) const {
    const uint32_t *c = mesh_.corners(a);
    for (size_t k = 0; k < 3; k++)
      if (!CGAL::coplanar(mesh_.inexact(c[0]), mesh_.inexact(c[1]), mesh_.inexact(c[2]),
                          mesh_.inexact(mesh_.corners(b)[k])))
        return false;
    const View view = view_of(a);
    return !is_beside(b, a, view, CGAL::LEFT_TURN) && !is_beside(a, b, view, turn_of(b, view));
  }

  /* ---- intersections ---- */

  void add_cut(uint32_t triangle, uint32_t from, uint32_t to) {
    if (!mesh_.is_flat(triangle)) cuts_.push_back({triangle, from, to});
  }

  void meet(uint32_t a, uint32_t b) {
    if (mesh_.is_flat(a) || mesh_.is_flat(b)) { /* corners of a flat triangle can split the edges of the other */
      const uint32_t flat = mesh_.is_flat(a) ? a : b, other = mesh_.is_flat(a) ? b : a;
      const Exact::Triangle_3 triangle = exact_triangle(other);
      for (size_t k = 0; k < 3; k++) {
        const uint32_t vertex = mesh_.corners(flat)[k];
        if (triangle.has_on(out_.points[vertex])) add_cut(other, same_[vertex], same_[vertex]);
      }
      return;
    }
    if (do_overlap(a, b)) {
      qmat_sets_join(planes_, a, b);
      return;
    }
    const auto common = CGAL::intersection(exact_triangle(a), exact_triangle(b));
    if (!common) return;
    uint32_t from = kNone, to = kNone;
    if (const auto *point = boost::get<Point>(&*common)) {
      from = to = id_of(*point);
    } else if (const auto *segment = boost::get<Exact::Segment_3>(&*common)) {
      from = id_of(segment->source());
      to = id_of(segment->target());
    } else {
      throw UnionRefused{"triangles that do not overlap have an area in common"};
    }
    add_cut(a, from, to);
    add_cut(b, from, to);
  }

  /* ---- cutting ---- */

  /* The point of a triangle's plane with that projection. */
  Point lift(uint32_t triangle, const View &view, const Exact::Point_2 &seen) const {
    const uint32_t *c = mesh_.corners(triangle);
    const Exact::Vector_3 normal = CGAL::normal(out_.points[c[0]], out_.points[c[1]], out_.points[c[2]]);
    const Point &a = out_.points[c[0]];
    std::array<Exact::FT, 3> p;
    const auto at = [&](int k) -> Exact::FT & { return p[static_cast<size_t>(k)]; };
    at(view.right) = seen.x();
    at(view.up) = seen.y();
    at(view.depth) =
        a[view.depth] - ((seen.x() - a[view.right]) * normal[view.right] + (seen.y() - a[view.up]) * normal[view.up]) /
                            normal[view.depth];
    return {p[0], p[1], p[2]};
  }

  void add_piece(uint32_t source, Corners c, int layers) {
    if (layers < 0) {
      std::swap(c[1], c[2]);
      layers = -layers;
    }
    std::rotate(c.begin(), std::min_element(c.begin(), c.end()), c.end());
    out_.pieces.push_back({source, c, layers});
  }

  /* Counts the triangles of a plane over each face. The counts change across the triangles' edges only, so they spread
   * from the infinite face. */
  template <class VertexOf>
  void count_layers(Triangulation &plane, const std::vector<uint32_t> &group, const View &view,
                    const VertexOf &vertex) const {
    std::map<Pair, LayerCount> borders; /* left minus right of an edge, from the smaller id to the larger */
    const auto add = [](std::map<Pair, LayerCount> &at, uint32_t from, uint32_t to, int count, int layers) {
      const int sign = from < to ? 1 : -1;
      LayerCount &border = at[{std::min(from, to), std::max(from, to)}];
      border.count += sign * count;
      border.layers += sign * layers;
    };
    for (const uint32_t t : group) {
      const int turn = turn_of(t, view);
      for (size_t k = 0; k < 3; k++)
        add(borders, same_[mesh_.corners(t)[k]], same_[mesh_.corners(t)[(k + 1) % 3]], turn, 1);
    }
    std::map<Pair, LayerCount> steps; /* the same for the edges of the plane */
    for (const auto &[ends, border] : borders) {
      if (border.count == 0 && border.layers == 0) continue;
      const auto last = vertex(ends.second);
      for (auto at = vertex(ends.first); at != last;) {
        const auto next = next_vertex(plane, at, last);
        add(steps, at->info().value, next->info().value, border.count, border.layers);
        at = next;
      }
    }
    std::vector<Triangulation::Face_handle> found = {plane.infinite_face()};
    found[0]->info().is_known = true;
    while (!found.empty()) {
      const auto face = found.back();
      found.pop_back();
      for (int k = 0; k < 3; k++) {
        const auto other = face->neighbor(k);
        if (other->info().is_known) continue;
        const uint32_t a = face->vertex(Triangulation::ccw(k))->info().value,
                       b = face->vertex(Triangulation::cw(k))->info().value;
        const auto step = steps.find({std::min(a, b), std::max(a, b)}); /* the face is to the left from a to b */
        other->info() = face->info();
        if (step != steps.end()) {
          other->info().count -= a < b ? step->second.count : -step->second.count;
          other->info().layers -= a < b ? step->second.layers : -step->second.layers;
        }
        found.push_back(other);
      }
    }
  }

  /* Cuts the triangles of one plane; several of them overlap. */
  void cut_plane(const std::vector<uint32_t> &group, const std::vector<Cut> &cuts, Triangulation &plane) {
    const View view = view_of(group[0]);
    const size_t first_piece = out_.pieces.size();
    std::map<uint32_t, Triangulation::Vertex_handle> handles;
    size_t calls = 0;
    const auto vertex = [&](uint32_t id) {
      if (++calls % 256 == 0) mesh_.progress(calls, 0, "corners");
      const auto found = handles.find(id);
      if (found != handles.end()) return found->second;
      const auto handle = plane.insert(view.flatten(out_.points[id]));
      handle->info().value = id;
      handles.emplace(id, handle);
      return handle;
    };
    for (const uint32_t t : group)
      for (size_t k = 0; k < 3; k++) vertex(same_[mesh_.corners(t)[k]]);
    for (const Cut &cut : cuts) {
      vertex(cut.from);
      vertex(cut.to);
    }
    for (const uint32_t t : group)
      for (size_t k = 0; k < 3; k++)
        plane.insert_constraint(vertex(same_[mesh_.corners(t)[k]]), vertex(same_[mesh_.corners(t)[(k + 1) % 3]]));
    for (const Cut &cut : cuts)
      if (cut.from != cut.to) plane.insert_constraint(vertex(cut.from), vertex(cut.to));
    for (auto v = plane.finite_vertices_begin(); v != plane.finite_vertices_end(); v++)
      if (v->info().value == kNone) v->info().value = id_of(lift(group[0], view, v->point()));
    if (group.size() > 1) count_layers(plane, group, view, vertex);
    for (auto f = plane.finite_faces_begin(); f != plane.finite_faces_end(); f++) {
      const Corners c = {f->vertex(0)->info().value, f->vertex(1)->info().value, f->vertex(2)->info().value};
      const int layers = group.size() > 1 ? f->info().layers : 1;
      if (layers != 0)
        add_piece(group[0], c, layers);
      else if (f->info().count > 0)
        out_.cancelled.push_back({group[0], c, 0});
    }
    std::sort(out_.pieces.begin() + static_cast<ptrdiff_t>(first_piece), out_.pieces.end(),
              [](const Piece &a, const Piece &b) { return a.corners < b.corners; });
  }

  void cut_plane(const std::vector<uint32_t> &group, const std::vector<Cut> &cuts) {
    auto plane = std::make_unique<Triangulation>();
    try {
      cut_plane(group, cuts, *plane);
    } catch (const std::bad_alloc &) {
      (void)plane.release(); /* CGAL cannot destroy constraints that it had no memory to list */
      throw;
    }
  }

  void cut_triangles(const std::vector<uint32_t> &triangles) {
    std::stable_sort(cuts_.begin(), cuts_.end(), [](const Cut &a, const Cut &b) { return a.triangle < b.triangle; });
    const auto cuts_of = [&](uint32_t t) {
      return std::equal_range(cuts_.begin(), cuts_.end(), Cut{t, 0, 0},
                              [](const Cut &a, const Cut &b) { return a.triangle < b.triangle; });
    };
    std::vector<Pair> members; /* a plane's leader, and a triangle in it */
    out_.overlaps.resize(mesh_.triangle_count());
    for (const uint32_t t : triangles)
      if (!mesh_.is_flat(t)) members.emplace_back(qmat_set_leader(planes_, t), t);
    std::sort(members.begin(), members.end());
    std::vector<uint32_t> group;
    std::vector<Cut> cuts;
    for (size_t i = 0; i < members.size(); i++) {
      if (i % 64 == 0) mesh_.progress(i, members.size(), "triangles");
      const uint32_t t = members[i].first;
      group.push_back(members[i].second);
      if (i + 1 < members.size() && members[i + 1].first == t) continue;
      for (const uint32_t member : group) {
        const auto own = cuts_of(member);
        cuts.insert(cuts.end(), own.first, own.second);
      }
      if (group.size() == 1 && cuts.empty()) {
        const uint32_t *c = mesh_.corners(t);
        add_piece(t, {same_[c[0]], same_[c[1]], same_[c[2]]}, 1);
      } else {
        out_.cut_count += group.size();
        for (const uint32_t member : group) out_.overlaps[member] = group.size() > 1;
        cut_plane(group, cuts);
      }
      group.clear();
      cuts.clear();
    }
  }
};

}  // namespace

bool do_meet(const UnionMesh &mesh, uint32_t a, uint32_t b) {
  Corners p, q; /* shared corners first */
  std::copy_n(mesh.corners(a), 3, p.begin());
  std::copy_n(mesh.corners(b), 3, q.begin());
  size_t shared = 0;
  for (size_t i = 0; i < 3; i++) {
    const auto found = std::find(q.begin() + static_cast<ptrdiff_t>(shared), q.end(), p[i]);
    if (found == q.end()) continue;
    std::swap(*found, q[shared]);
    std::swap(p[i], p[shared++]);
  }
  if (shared == 3) return true;
  const double *const first_corners[] = {mesh.position(p[0]), mesh.position(p[1]), mesh.position(p[2])};
  const double *const second_corners[] = {mesh.position(q[0]), mesh.position(q[1]), mesh.position(q[2])};
  if (qmat_triangles_are_separate(first_corners, second_corners, static_cast<int>(shared))) return false;
  const auto point = [&](uint32_t vertex) { return mesh.inexact(vertex); };
  if (shared == 2) {
    return CGAL::coplanar(point(p[0]), point(p[1]), point(p[2]), point(q[2])) &&
           CGAL::coplanar_orientation(point(p[0]), point(p[1]), point(p[2]), point(q[2])) == CGAL::POSITIVE;
  }
  const Inexact::Triangle_3 first = mesh.inexact_triangle(a), second = mesh.inexact_triangle(b);
  if (shared == 1) {
    return CGAL::do_intersect(Inexact::Segment_3(point(p[1]), point(p[2])), second) ||
           CGAL::do_intersect(Inexact::Segment_3(point(q[1]), point(q[2])), first);
  }
  return CGAL::do_intersect(first, second);
}

Arrangement arrange(const UnionMesh &mesh, const std::vector<uint32_t> &triangles, const std::vector<Pair> &pairs) {
  Arrangement arrangement;
  Cutter(mesh, arrangement).make(triangles, pairs);
  return arrangement;
}

}  // namespace qmat
