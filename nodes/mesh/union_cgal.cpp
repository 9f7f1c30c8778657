/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/union_cgal.h"

#include <CGAL/Box_intersection_d/Box_with_info_d.h>
#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Constrained_triangulation_face_base_2.h>
#include <CGAL/Constrained_triangulation_plus_2.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <CGAL/box_intersection_d.h>

#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>
#include <exception>
#include <map>
#include <memory>
#include <new>
#include <utility>
#include <vector>

#include "core/disjoint_sets.h"

namespace {

using Inexact = CGAL::Exact_predicates_inexact_constructions_kernel;
using Exact = CGAL::Exact_predicates_exact_constructions_kernel;
using Point = Exact::Point_3;
using Number = Exact::FT;

constexpr uint32_t kNone = UINT32_MAX;

struct Id {
  uint32_t value = kNone;
};
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<Id, Exact>;
/* How many triangles of a plane lie somewhere, and how many more of them turn left than right. */
struct Cover {
  int count = 0, layers = 0;
  bool is_known = false;
};
using FaceBase =
    CGAL::Constrained_triangulation_face_base_2<Exact, CGAL::Triangulation_face_base_with_info_2<Cover, Exact>>;
using Delaunay =
    CGAL::Constrained_Delaunay_triangulation_2<Exact, CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>,
                                               CGAL::Exact_intersections_tag>;
using Plane = CGAL::Constrained_triangulation_plus_2<Delaunay>; /* crossings are computed from whole segments */

using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 3, uint32_t>;
using Pair = std::pair<uint32_t, uint32_t>;
using Corners = std::array<uint32_t, 3>;

/* Thrown through CGAL to leave it. */
struct Stopped {
  qmat_status status;
};

/* The parts that cannot be united say why. */
struct Refused {
  const char *why;
};

/* A piece of a triangle, or of several that lie on each other. */
struct Piece {
  uint32_t source; /* the first triangle that it is cut from */
  Corners corners;
  int layers; /* how many more triangles there turn this way than the other; above 0 */
};

struct Edge {
  uint32_t low, high, piece;
  bool rises;
  bool operator<(const Edge &other) const {
    return std::tie(low, high, piece, rises) < std::tie(other.low, other.high, other.piece, other.rises);
  }
  bool is_same(const Edge &other) const {
    return low == other.low && high == other.high;
  }
};

std::vector<Edge> sorted_edges(const std::vector<Piece> &pieces) {
  std::vector<Edge> edges;
  edges.reserve(3 * pieces.size());
  for (size_t i = 0; i < pieces.size(); i++) {
    for (size_t k = 0; k < 3; k++) {
      const uint32_t a = pieces[i].corners[k], b = pieces[i].corners[(k + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), static_cast<uint32_t>(i), a < b});
    }
  }
  std::sort(edges.begin(), edges.end());
  return edges;
}

class Union {
 public:
  Union(qmat_context *context, const qmat_shells &mesh)
      : context_(context), mesh_(mesh), clusters_(new_sets(mesh.triangle_count)), active_(mesh.triangle_count, false) {}

  void make(qmat_united *united) {
    find_meeting_shells();
    find_swallowed_shells();
    if (active_count_ == 0) return;
    find_pairs();
    number_vertices();
    for (size_t i = 0; i < pairs_.size(); i++) {
      if (i % 64 == 0) go_on(i, pairs_.size(), "pairs of triangles");
      meet(pairs_[i].first, pairs_[i].second);
    }
    cut_triangles();
    find_patches();
    choose_pieces();
    copy_out(united);
  }

 private:
  qmat_context *context_;
  const qmat_shells &mesh_;
  uint32_t *clusters_;       /* disjoint sets of shells, by their triangles */
  std::vector<bool> active_; /* per shell: it is cut, or may be left out */
  size_t active_count_ = 0;
  std::vector<Pair> pairs_;   /* of triangles of active shells that meet */
  std::vector<bool> is_flat_; /* per triangle: its corners are on a line */

  /* Vertices: those of the mesh, then those on cuts. */
  std::vector<Point> points_;
  std::vector<bool> known_; /* whether points_ has it */
  std::map<Point, uint32_t> ids_;
  std::vector<uint32_t> same_; /* per vertex of the mesh: the first one in its place */

  /* What cuts a triangle: points where both ends are the same. */
  struct Cut {
    uint32_t triangle, from, to;
  };
  std::vector<Cut> cuts_;
  std::vector<Piece> pieces_;
  std::vector<uint32_t> patch_of_; /* per piece: its leader */
  std::vector<bool> changed_;      /* per cluster, by its leader */
  size_t cut_count_ = 0;

  /* ---- small things ---- */

  uint32_t *new_sets(size_t count) {
    uint32_t *sets = qmat_sets_new(context_, count);
    if (!sets) throw std::bad_alloc();
    return sets;
  }

  void go_on(size_t done, size_t total, const char *unit) {
    const qmat_status status = qmat_progress(context_, done, total, unit);
    if (status != QMAT_OK) throw Stopped{status};
  }

  const uint32_t *corners(uint32_t triangle) const {
    return mesh_.triangles + 3 * static_cast<size_t>(triangle);
  }
  const double *position(uint32_t vertex) const {
    return mesh_.positions + 3 * static_cast<size_t>(vertex);
  }
  Inexact::Point_3 inexact(uint32_t vertex) const {
    const double *p = position(vertex);
    return {p[0], p[1], p[2]};
  }
  Inexact::Triangle_3 inexact_triangle(uint32_t triangle) const {
    const uint32_t *c = corners(triangle);
    return {inexact(c[0]), inexact(c[1]), inexact(c[2])};
  }
  Point exact(uint32_t vertex) const {
    const double *p = position(vertex);
    return {p[0], p[1], p[2]};
  }
  Exact::Triangle_3 exact_triangle(uint32_t triangle) const {
    const uint32_t *c = corners(triangle);
    return {points_[c[0]], points_[c[1]], points_[c[2]]};
  }
  uint32_t cluster_of(uint32_t triangle) const {
    return qmat_set_leader(clusters_, mesh_.shells[triangle]);
  }
  bool is_active(uint32_t triangle) const {
    return mesh_.shells[triangle] != QMAT_NO_SHELL && active_[mesh_.shells[triangle]];
  }
  void activate(uint32_t triangle) {
    const uint32_t shell = mesh_.shells[triangle];
    active_count_ += !active_[shell];
    active_[shell] = true;
  }

  /* ---- which triangles meet ---- */

  Box box_of(uint32_t triangle) const {
    double low[3], high[3];
    const uint32_t *c = corners(triangle);
    for (size_t k = 0; k < 3; k++) {
      const double x = position(c[0])[k], y = position(c[1])[k], z = position(c[2])[k];
      low[k] = std::min({x, y, z});
      high[k] = std::max({x, y, z});
    }
    return {low, high, triangle};
  }

  bool is_flat(uint32_t triangle) const {
    const uint32_t *c = corners(triangle);
    return CGAL::collinear(inexact(c[0]), inexact(c[1]), inexact(c[2]));
  }

  /* Whether two triangles have more in common than corners and edges that both name. */
  bool do_meet(uint32_t a, uint32_t b) const {
    Corners p, q; /* shared ones first */
    std::copy_n(corners(a), 3, p.begin());
    std::copy_n(corners(b), 3, q.begin());
    size_t shared = 0;
    for (size_t i = 0; i < 3; i++) {
      const auto found = std::find(q.begin() + static_cast<ptrdiff_t>(shared), q.end(), p[i]);
      if (found == q.end()) continue;
      std::swap(*found, q[shared]);
      std::swap(p[i], p[shared++]);
    }
    const auto point = [&](uint32_t vertex) { return inexact(vertex); };
    if (shared == 3) return true;
    if (shared == 2) {
      return CGAL::coplanar(point(p[0]), point(p[1]), point(p[2]), point(q[2])) &&
             CGAL::coplanar_orientation(point(p[0]), point(p[1]), point(p[2]), point(q[2])) == CGAL::POSITIVE;
    }
    const Inexact::Triangle_3 first = inexact_triangle(a), second = inexact_triangle(b);
    if (shared == 1) {
      return CGAL::do_intersect(Inexact::Segment_3(point(p[1]), point(p[2])), second) ||
             CGAL::do_intersect(Inexact::Segment_3(point(q[1]), point(q[2])), first);
    }
    return CGAL::do_intersect(first, second);
  }

  /* Calls `visit` for all pairs of boxes that have a point in common, in no order. */
  template <class Visit>
  void for_each_pair(std::vector<Box> &boxes, const Visit &visit) {
    size_t seen = 0;
    CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const Box &a, const Box &b) {
      if (++seen % 4096 == 0) go_on(seen, 0, "pairs of triangles");
      visit(std::min(a.info(), b.info()), std::max(a.info(), b.info()));
    });
  }

  void find_meeting_shells() {
    is_flat_.resize(mesh_.triangle_count);
    std::vector<Box> boxes;
    for (uint32_t t = 0; t < mesh_.triangle_count; t++) {
      if (mesh_.shells[t] == QMAT_NO_SHELL) continue;
      is_flat_[t] = is_flat(t);
      if (mesh_.reaches[t] && !is_flat_[t]) boxes.push_back(box_of(t));
    }
    for_each_pair(boxes, [&](uint32_t a, uint32_t b) {
      if (mesh_.sheets[a] == mesh_.sheets[b] || !do_meet(a, b)) return;
      qmat_sets_join(clusters_, mesh_.shells[a], mesh_.shells[b]);
      activate(a);
      activate(b);
    });
  }

  /* All pairs that meet within the active shells, those that meet themselves included. */
  void find_pairs() {
    std::vector<Box> boxes;
    for (uint32_t t = 0; t < mesh_.triangle_count; t++)
      if (is_active(t)) boxes.push_back(box_of(t));
    for_each_pair(boxes, [&](uint32_t a, uint32_t b) {
      if (cluster_of(a) != cluster_of(b) || (is_flat_[a] && is_flat_[b])) return;
      if (is_flat_[a] || is_flat_[b] || do_meet(a, b)) pairs_.emplace_back(a, b);
    });
    std::sort(pairs_.begin(), pairs_.end());
  }

  /* ---- exact points ---- */

  void know(uint32_t vertex) {
    if (known_[vertex]) return;
    known_[vertex] = true;
    points_[vertex] = exact(vertex);
    same_[vertex] = ids_.emplace(points_[vertex], vertex).first->second;
  }

  void number_vertices() {
    points_.resize(mesh_.vertex_count);
    known_.resize(mesh_.vertex_count);
    same_.resize(mesh_.vertex_count);
    for (uint32_t v = 0; v < mesh_.vertex_count; v++) same_[v] = v;
    for (const Pair &pair : pairs_)
      for (size_t k = 0; k < 3; k++) {
        know(corners(pair.first)[k]);
        know(corners(pair.second)[k]);
      }
  }

  uint32_t id_of(const Point &point) {
    const auto found = ids_.emplace(point, static_cast<uint32_t>(points_.size()));
    if (found.second) {
      if (points_.size() >= kNone) throw std::bad_alloc();
      points_.push_back(point);
    }
    return found.first->second;
  }

  /* ---- planes ---- */

  /* A plane seen along an axis, from the side where the triangle that it is of turns left. */
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
    const uint32_t *c = corners(triangle);
    return CGAL::orientation(view.flatten(position(c[0])), view.flatten(position(c[1])), view.flatten(position(c[2])));
  }

  View view_of(uint32_t triangle) const {
    const uint32_t *c = corners(triangle);
    std::array<double, 3> size;
    std::array<int, 3> axes = {0, 1, 2};
    for (int k = 0; k < 3; k++) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      const double *p = position(c[0]), *q = position(c[1]), *r = position(c[2]);
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
    throw Refused{"a triangle has no plane"};
  }

  /* Whether a triangle has no area to the left of one of another's edges, all seen where that turns as `turn` says. */
  bool is_beside(uint32_t triangle, uint32_t other, const View &view, CGAL::Orientation turn) const {
    const uint32_t *c = corners(triangle), *d = corners(other);
    for (size_t k = 0; k < 3; k++) {
      const Inexact::Point_2 from = view.flatten(position(d[k])), to = view.flatten(position(d[(k + 1) % 3]));
      bool beside = true;
      for (size_t i = 0; i < 3; i++)
        beside = beside && CGAL::orientation(from, to, view.flatten(position(c[i]))) != turn;
      if (beside) return true;
    }
    return false;
  }

  /* Whether two triangles are in one plane and have some area of it in common. */
  bool do_overlap(uint32_t a, uint32_t b) const {
    const uint32_t *c = corners(a);
    for (size_t k = 0; k < 3; k++)
      if (!CGAL::coplanar(inexact(c[0]), inexact(c[1]), inexact(c[2]), inexact(corners(b)[k]))) return false;
    const View view = view_of(a);
    return !is_beside(b, a, view, CGAL::LEFT_TURN) && !is_beside(a, b, view, turn_of(b, view));
  }

  /* ---- where triangles meet ---- */

  uint32_t *planes_ = nullptr; /* disjoint sets of triangles that lie on each other */

  void add_cut(uint32_t triangle, uint32_t from, uint32_t to) {
    if (!is_flat_[triangle]) cuts_.push_back({triangle, from, to});
  }

  void meet(uint32_t a, uint32_t b) {
    if (!planes_) planes_ = new_sets(mesh_.triangle_count);
    if (is_flat_[a] || is_flat_[b]) { /* its corners may be on the other's edges, which then end at them */
      const uint32_t flat = is_flat_[a] ? a : b, other = is_flat_[a] ? b : a;
      const Exact::Triangle_3 triangle = exact_triangle(other);
      for (size_t k = 0; k < 3; k++) {
        const uint32_t vertex = corners(flat)[k];
        if (triangle.has_on(points_[vertex])) add_cut(other, same_[vertex], same_[vertex]);
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
      throw Refused{"triangles that do not overlap have an area in common"};
    }
    add_cut(a, from, to);
    add_cut(b, from, to);
  }

  /* ---- cutting ---- */

  /* The point of a triangle's plane that is seen there. */
  Point lift(uint32_t triangle, const View &view, const Exact::Point_2 &seen) const {
    const uint32_t *c = corners(triangle);
    const Exact::Vector_3 normal = CGAL::normal(points_[c[0]], points_[c[1]], points_[c[2]]);
    const Point &a = points_[c[0]];
    std::array<Number, 3> p;
    const auto at = [&](int k) -> Number & { return p[static_cast<size_t>(k)]; };
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
    pieces_.push_back({source, c, layers});
  }

  /* The vertex after `from` on the way to `to` along edges. */
  static Plane::Vertex_handle next_on_way(const Plane &plane, Plane::Vertex_handle from, Plane::Vertex_handle to) {
    auto around = plane.incident_vertices(from);
    const auto first = around;
    do {
      if (plane.is_infinite(around)) continue;
      if (CGAL::orientation(from->point(), to->point(), around->point()) == CGAL::COLLINEAR &&
          CGAL::collinear_are_ordered_along_line(from->point(), around->point(), to->point()))
        return around;
    } while (++around != first);
    throw Refused{"an edge is lost"};
  }

  /* Finds out how the triangles of a plane cover its faces: each has a number more to the left of its edges. */
  template <class VertexOf>
  void cover_faces(Plane &plane, const std::vector<uint32_t> &group, const View &view, const VertexOf &vertex) const {
    std::map<Pair, Cover> borders; /* left less right of an edge, from the smaller id to the larger */
    const auto add = [](std::map<Pair, Cover> &at, uint32_t from, uint32_t to, int count, int layers) {
      const int sign = from < to ? 1 : -1;
      Cover &border = at[{std::min(from, to), std::max(from, to)}];
      border.count += sign * count;
      border.layers += sign * layers;
    };
    for (const uint32_t t : group) {
      const int turn = turn_of(t, view);
      for (size_t k = 0; k < 3; k++) add(borders, same_[corners(t)[k]], same_[corners(t)[(k + 1) % 3]], turn, 1);
    }
    std::map<Pair, Cover> steps; /* the same of the plane's edges */
    for (const auto &[ends, border] : borders) {
      if (border.count == 0 && border.layers == 0) continue;
      const auto last = vertex(ends.second);
      for (auto at = vertex(ends.first); at != last;) {
        const auto next = next_on_way(plane, at, last);
        add(steps, at->info().value, next->info().value, border.count, border.layers);
        at = next;
      }
    }
    std::vector<Plane::Face_handle> found = {plane.infinite_face()};
    found[0]->info().is_known = true;
    while (!found.empty()) {
      const auto face = found.back();
      found.pop_back();
      for (int k = 0; k < 3; k++) {
        const auto other = face->neighbor(k);
        if (other->info().is_known) continue;
        const uint32_t a = face->vertex(Plane::ccw(k))->info().value, b = face->vertex(Plane::cw(k))->info().value;
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

  /* Cuts the triangles of one plane, which lie on each other where there are several. */
  void cut_plane(const std::vector<uint32_t> &group, const std::vector<Cut> &cuts) {
    auto plane = std::make_unique<Plane>();
    try {
      cut_plane(group, cuts, *plane);
    } catch (const std::bad_alloc &) {
      (void)plane.release(); /* CGAL cannot take apart constraints that it had no memory to list */
      throw;
    }
  }

  void cut_plane(const std::vector<uint32_t> &group, const std::vector<Cut> &cuts, Plane &plane) {
    const View view = view_of(group[0]);
    const size_t first_piece = pieces_.size();
    std::map<uint32_t, Plane::Vertex_handle> handles;
    size_t asked = 0;
    const auto vertex = [&](uint32_t id) {
      if (++asked % 256 == 0) go_on(asked, 0, "corners");
      const auto found = handles.find(id);
      if (found != handles.end()) return found->second;
      const auto handle = plane.insert(view.flatten(points_[id]));
      handle->info().value = id;
      handles.emplace(id, handle);
      return handle;
    };
    for (const uint32_t t : group)
      for (size_t k = 0; k < 3; k++) vertex(same_[corners(t)[k]]);
    for (const Cut &cut : cuts) {
      vertex(cut.from);
      vertex(cut.to);
    }
    for (const uint32_t t : group)
      for (size_t k = 0; k < 3; k++)
        plane.insert_constraint(vertex(same_[corners(t)[k]]), vertex(same_[corners(t)[(k + 1) % 3]]));
    for (const Cut &cut : cuts)
      if (cut.from != cut.to) plane.insert_constraint(vertex(cut.from), vertex(cut.to));
    for (auto v = plane.finite_vertices_begin(); v != plane.finite_vertices_end(); v++)
      if (v->info().value == kNone) v->info().value = id_of(lift(group[0], view, v->point()));
    if (group.size() > 1) cover_faces(plane, group, view, vertex);
    for (auto f = plane.finite_faces_begin(); f != plane.finite_faces_end(); f++) {
      const Corners c = {f->vertex(0)->info().value, f->vertex(1)->info().value, f->vertex(2)->info().value};
      const int layers = group.size() > 1 ? f->info().layers : 1;
      if (layers != 0)
        add_piece(group[0], c, layers);
      else if (f->info().count > 0)
        changed_[cluster_of(group[0])] = true;
    }
    std::sort(pieces_.begin() + static_cast<ptrdiff_t>(first_piece), pieces_.end(),
              [](const Piece &a, const Piece &b) { return a.corners < b.corners; });
  }

  void cut_triangles() {
    if (!planes_) planes_ = new_sets(mesh_.triangle_count);
    changed_.resize(mesh_.triangle_count);
    std::stable_sort(cuts_.begin(), cuts_.end(), [](const Cut &a, const Cut &b) { return a.triangle < b.triangle; });
    const auto cuts_of = [&](uint32_t t) {
      return std::equal_range(cuts_.begin(), cuts_.end(), Cut{t, 0, 0},
                              [](const Cut &a, const Cut &b) { return a.triangle < b.triangle; });
    };
    std::vector<Pair> members; /* a plane's leader, and a triangle in it */
    for (uint32_t t = 0; t < mesh_.triangle_count; t++)
      if (is_active(t) && !is_flat_[t]) members.emplace_back(qmat_set_leader(planes_, t), t);
    std::sort(members.begin(), members.end());
    std::vector<uint32_t> group;
    std::vector<Cut> cuts;
    for (size_t i = 0; i < members.size(); i++) {
      if (i % 64 == 0) go_on(i, members.size(), "triangles");
      const uint32_t t = members[i].first;
      group.push_back(members[i].second);
      if (i + 1 < members.size() && members[i + 1].first == t) continue;
      for (const uint32_t member : group) {
        const auto own = cuts_of(member);
        cuts.insert(cuts.end(), own.first, own.second);
      }
      if (group.size() == 1 && cuts.empty()) {
        const uint32_t *c = corners(t);
        add_piece(t, {same_[c[0]], same_[c[1]], same_[c[2]]}, 1);
      } else {
        cut_count_ += group.size();
        cut_plane(group, cuts);
      }
      group.clear();
      cuts.clear();
    }
  }

  /* ---- what lies on either side ---- */

  /* Pieces that are joined by edges of no other pieces have the same winding number before them, and behind. */
  void find_patches() {
    uint32_t *leaders = new_sets(pieces_.size());
    const std::vector<Edge> edges = sorted_edges(pieces_);
    for (size_t first = 0, last; first < edges.size(); first = last) {
      for (last = first + 1; last < edges.size() && edges[first].is_same(edges[last]);) last++;
      const Edge &a = edges[first], &b = edges[last - 1];
      if (last - first == 2 && a.rises != b.rises && pieces_[a.piece].layers == pieces_[b.piece].layers)
        qmat_sets_join(leaders, a.piece, b.piece);
    }
    patch_of_.resize(pieces_.size());
    for (uint32_t i = 0; i < pieces_.size(); i++) patch_of_[i] = qmat_set_leader(leaders, i);
  }

  /* Least and most right, least and most up. */
  using Bounds = std::array<double, 4>;
  static constexpr Bounds kNoBounds = {INFINITY, -INFINITY, INFINITY, -INFINITY};

  static Bounds joined(const Bounds &a, const Bounds &b) {
    return {std::min(a[0], b[0]), std::max(a[1], b[1]), std::min(a[2], b[2]), std::max(a[3], b[3])};
  }

  struct Shadow {
    Bounds bounds;
    uint32_t triangle;
  };

  /* All triangles as seen along a direction that is parallel to few. */
  struct Sight {
    std::array<double, 3> direction;
    double margin; /* what rounding moves is a thousandth of it */
    std::vector<Shadow> shadows;
    std::vector<Bounds> bundles; /* the bounds of so many shadows, those of neighbours */
    static constexpr size_t kBundle = 64;

    /* Across the direction. */
    std::array<double, 2> flatten(double x, double y, double z) const {
      return {direction[1] * x - direction[0] * y, direction[2] * x - direction[0] * z};
    }

    bool covers(const Bounds &b, const std::array<double, 2> &at) const {
      return at[0] >= b[0] - margin && at[0] <= b[1] + margin && at[1] >= b[2] - margin && at[1] <= b[3] + margin;
    }

    /* Brings neighbours together: halves at the middle of one axis and then the other. */
    void sort(size_t begin, size_t end, size_t axis) {
      if (end - begin <= kBundle) return;
      const size_t middle = begin + (end - begin + kBundle) / (2 * kBundle) * kBundle;
      const auto at = [&](size_t i) { return shadows.begin() + static_cast<ptrdiff_t>(i); };
      std::nth_element(at(begin), at(middle), at(end), [&](const Shadow &a, const Shadow &b) {
        return a.bounds[axis] + a.bounds[axis + 1] < b.bounds[axis] + b.bounds[axis + 1];
      });
      sort(begin, middle, 2 - axis);
      sort(middle, end, 2 - axis);
    }

    void bundle() {
      sort(0, shadows.size(), 0);
      for (size_t i = 0; i < shadows.size(); i++) {
        if (i % kBundle == 0) bundles.push_back(kNoBounds);
        bundles.back() = joined(bundles.back(), shadows[i].bounds);
      }
    }
  };
  std::vector<Sight> sights_;

  const Sight &sight(size_t number) {
    static const std::array<double, 3> directions[] = {{1009, 211, 379}, {313, 1021, -173}, {-241, 397, 1013},
                                                       {887, -641, 523}, {-571, 769, 607},  {983, 971, -227}};
    constexpr size_t kCount = sizeof directions / sizeof *directions;
    while (sights_.size() <= number) {
      const size_t made = sights_.size();
      Sight next;
      next.direction = directions[made % kCount];
      for (size_t k = 0; k < 3; k++) /* below one, so that nothing overflows */
        next.direction[k] = (next.direction[k] + static_cast<double>(2 * (made / kCount) * (k + 1))) / 8192;
      double largest = 0;
      for (uint32_t t = 0; t < mesh_.triangle_count; t++) {
        if (mesh_.shells[t] == QMAT_NO_SHELL || is_flat_[t]) continue;
        Bounds bounds = kNoBounds;
        for (size_t k = 0; k < 3; k++) {
          const double *p = position(corners(t)[k]);
          const std::array<double, 2> at = next.flatten(p[0], p[1], p[2]);
          bounds = joined(bounds, {at[0], at[0], at[1], at[1]});
          for (size_t i = 0; i < 3; i++) largest = std::max(largest, std::fabs(p[i]));
        }
        next.shadows.push_back({bounds, t});
      }
      next.margin = 1e-12 * largest + DBL_MIN;
      next.bundle();
      sights_.push_back(std::move(next));
    }
    return sights_[number];
  }

  /* How often the ray from a point that is on no triangle's edge leaves through a triangle more often than it enters;
   * triangles that the point lies on do not count, nor do those of one shell. False: the ray meets an edge. */
  bool count_crossings(const Sight &from, const Point &origin, uint32_t left_out, int *winding) const {
    const Exact::Vector_3 direction(from.direction[0], from.direction[1], from.direction[2]);
    const Point ahead = origin + direction;
    const std::array<double, 2> seen =
        from.flatten(CGAL::to_double(origin.x()), CGAL::to_double(origin.y()), CGAL::to_double(origin.z()));
    *winding = 0;
    for (size_t i = 0; i < from.shadows.size(); i++) {
      if (i % Sight::kBundle == 0 && !from.covers(from.bundles[i / Sight::kBundle], seen)) {
        i += Sight::kBundle - 1;
        continue;
      }
      const uint32_t t = from.shadows[i].triangle;
      if (mesh_.shells[t] == left_out || !from.covers(from.shadows[i].bounds, seen)) continue;
      const uint32_t *c = corners(t);
      const Point corner[3] = {exact(c[0]), exact(c[1]), exact(c[2])};
      int turns = 0, zeros = 0;
      for (size_t k = 0; k < 3; k++) {
        const int turn = CGAL::orientation(origin, ahead, corner[k], corner[(k + 1) % 3]);
        turns += turn;
        zeros += turn == 0;
      }
      const bool passes = zeros == 0 ? turns != 3 && turns != -3 : turns + zeros < 3 && turns - zeros > -3;
      if (passes) continue;
      if (zeros > 0) return false;
      const int side = CGAL::orientation(corner[0], corner[1], corner[2], origin); /* positive: before the triangle */
      const int heads = sign_of(CGAL::normal(corner[0], corner[1], corner[2]) * direction);
      if (side != 0 && side != heads) *winding += heads;
    }
    return true;
  }

  static int sign_of(const Number &number) {
    return CGAL::sign(number);
  }

  static Point exact_centroid(const Point &a, const Point &b, const Point &c) {
    const Point centre = CGAL::centroid(a, b, c);
    (void)centre.exact(); /* so that its doubles are near */
    return centre;
  }

  /* The winding numbers before a triangle (corners of exact points) and behind it, which differ by `layers`. */
  int winding_before(const Point corner[3], int layers, uint32_t left_out) {
    constexpr size_t kMostRays = 1000;
    const Point origin = exact_centroid(corner[0], corner[1], corner[2]);
    const Exact::Vector_3 normal = CGAL::normal(corner[0], corner[1], corner[2]);
    for (size_t number = 0; number < kMostRays; number++) {
      const Sight &from = sight(number);
      const int heads = sign_of(normal * Exact::Vector_3(from.direction[0], from.direction[1], from.direction[2]));
      int winding;
      if (heads == 0 || !count_crossings(from, origin, left_out, &winding)) continue;
      return heads > 0 ? winding : winding - layers;
    }
    throw Refused{"no ray passes between their edges"};
  }

  /* Shells that meet no other, but lie where the others wind: there they bound something else, or nothing. */
  void find_swallowed_shells() {
    std::vector<bool> asked(mesh_.triangle_count);
    for (uint32_t t = 0; t < mesh_.triangle_count; t++) {
      const uint32_t shell = mesh_.shells[t];
      if (shell == QMAT_NO_SHELL || active_[shell] || asked[shell] || is_flat_[t]) continue;
      go_on(t, mesh_.triangle_count, "triangles");
      asked[shell] = true;
      const Point corner[3] = {exact(corners(t)[0]), exact(corners(t)[1]), exact(corners(t)[2])};
      if (winding_before(corner, 0, shell) != 0) activate(t);
    }
  }

  /* Keeps the pieces with the inside behind and the outside before them, once each. */
  void choose_pieces() {
    std::vector<int8_t> kept(pieces_.size(), -1); /* per patch, by its leader; -1: not known */
    for (uint32_t i = 0; i < pieces_.size(); i++) {
      if (i % 64 == 0) go_on(i, pieces_.size(), "pieces");
      int8_t &keeps = kept[patch_of_[i]];
      const Piece &piece = pieces_[i];
      if (keeps < 0) {
        Point corner[3];
        for (size_t k = 0; k < 3; k++) {
          const uint32_t id = piece.corners[k];
          corner[k] = id < mesh_.vertex_count ? exact(id) : points_[id];
        }
        const int before = winding_before(corner, piece.layers, QMAT_NO_SHELL);
        keeps = before <= 0 && before + piece.layers > 0;
      }
      if (!keeps || piece.layers != 1) changed_[cluster_of(piece.source)] = true;
    }
    size_t count = 0;
    for (size_t i = 0; i < pieces_.size(); i++)
      if (kept[patch_of_[i]] && changed_[cluster_of(pieces_[i].source)]) pieces_[count++] = pieces_[i];
    pieces_.resize(count);
  }

  /* ---- rounding ---- */

  std::array<double, 3> rounded(uint32_t vertex) const {
    if (vertex < mesh_.vertex_count) return {position(vertex)[0], position(vertex)[1], position(vertex)[2]};
    const auto &p =
        CGAL::exact(points_[vertex]); /* the nearest doubles of what is known of it would depend on history */
    return {CGAL::to_double(p.x()), CGAL::to_double(p.y()), CGAL::to_double(p.z())};
  }

  /* Makes one vertex of those that fall together, and drops what loses its area by that. */
  void merge_rounded() {
    std::vector<uint32_t> used;
    for (const Piece &piece : pieces_) used.insert(used.end(), piece.corners.begin(), piece.corners.end());
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    std::map<std::array<double, 3>, uint32_t> places;
    std::vector<uint32_t> merged(points_.size());
    for (const uint32_t v : used) merged[v] = places.emplace(rounded(v), v).first->second;
    for (Piece &piece : pieces_) {
      for (uint32_t &corner : piece.corners) corner = merged[corner];
      Corners &c = piece.corners;
      piece.layers = c[0] != c[1] && c[1] != c[2] && c[2] != c[0];
      std::rotate(c.begin(), std::min_element(c.begin(), c.end()), c.end());
    }
    /* A triangle and its back cancel. */
    std::map<Corners, size_t> seen;
    for (size_t i = 0; i < pieces_.size(); i++) {
      if (pieces_[i].layers == 0) continue;
      const Corners &c = pieces_[i].corners;
      const auto back = seen.find({c[0], c[2], c[1]});
      if (back != seen.end()) {
        pieces_[i].layers = pieces_[back->second].layers = 0;
        seen.erase(back);
      } else if (!seen.emplace(c, i).second) {
        throw Refused{"triangles fall together when they are rounded"};
      }
    }
    pieces_.erase(std::remove_if(pieces_.begin(), pieces_.end(), [](const Piece &p) { return p.layers == 0; }),
                  pieces_.end());
  }

  void check_edges() const {
    const std::vector<Edge> edges = sorted_edges(pieces_);
    for (size_t first = 0, last; first < edges.size(); first = last) {
      int balance = 0;
      for (last = first; last < edges.size() && edges[first].is_same(edges[last]); last++)
        balance += edges[last].rises ? 1 : -1;
      if (balance != 0) throw Refused{"their cuts do not close"};
    }
  }

  void copy_out(qmat_united *united) {
    bool changed = false;
    for (uint32_t t = 0; t < mesh_.triangle_count; t++) changed = changed || (is_active(t) && changed_[cluster_of(t)]);
    if (!changed) return;
    merge_rounded();
    check_edges();
    std::vector<uint32_t> triangles;
    std::vector<bool> counted(mesh_.triangle_count);
    size_t next = 0;
    for (uint32_t t = 0; t < mesh_.triangle_count; t++) {
      if (is_active(t) && changed_[cluster_of(t)]) {
        for (; next < pieces_.size() && pieces_[next].source == t; next++)
          triangles.insert(triangles.end(), pieces_[next].corners.begin(), pieces_[next].corners.end());
        united->shells_united += !counted[mesh_.shells[t]];
        counted[mesh_.shells[t]] = true;
      } else {
        triangles.insert(triangles.end(), corners(t), corners(t) + 3);
      }
    }
    if (triangles.empty()) throw Refused{"they leave nothing of each other"};
    std::vector<uint32_t> numbers(points_.size(), kNone), used;
    for (const uint32_t v : triangles) numbers[v] = 0;
    for (uint32_t v = 0; v < numbers.size(); v++) {
      if (numbers[v] == kNone) continue;
      numbers[v] = static_cast<uint32_t>(used.size());
      used.push_back(v);
    }
    united->positions = static_cast<double *>(qmat_alloc(3 * used.size(), sizeof(double)));
    united->triangles = static_cast<uint32_t *>(qmat_alloc(triangles.size(), sizeof(uint32_t)));
    if (!united->positions || !united->triangles) throw std::bad_alloc();
    for (size_t i = 0; i < used.size(); i++) {
      const std::array<double, 3> p = rounded(used[i]);
      std::copy(p.begin(), p.end(), united->positions + 3 * i);
    }
    for (size_t i = 0; i < triangles.size(); i++) united->triangles[i] = numbers[triangles[i]];
    united->vertex_count = used.size();
    united->triangle_count = triangles.size() / 3;
    united->cut_triangles = cut_count_;
    united->changed = true;
  }
};

}  // namespace

qmat_status qmat_unite_shells(qmat_context *context, const qmat_shells *shells, qmat_united *united) {
  *united = {};
  qmat_status status = QMAT_OK;
  try {
    Union(context, *shells).make(united);
    return QMAT_OK;
  } catch (const Refused &refused) {
    united->why_not = refused.why;
    return QMAT_OK;
  } catch (const Stopped &stopped) {
    status = stopped.status;
  } catch (const std::bad_alloc &) {
    status = qmat_fail_memory(context, "the union of the parts");
  } catch (const std::exception &failure) {
    status = qmat_fail(context, QMAT_ERROR_DEPENDENCY, "CGAL: %s", failure.what());
  } catch (...) {
    status = qmat_fail(context, QMAT_ERROR_INTERNAL, "the union of the parts failed in an unknown way");
  }
  qmat_free(united->positions);
  qmat_free(united->triangles);
  *united = {};
  return status;
}
