/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/skin/skin_collapse_cgal.h"

#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Edge_collapse_visitor_base.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_cost.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_placement.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include <algorithm>
#include <array>
#include <exception>
#include <new>
#include <vector>

#include "core/arena.h"
#include "core/geometry/triangle.h"

namespace {

namespace SMS = CGAL::Surface_mesh_simplification;
using Kernel = CGAL::Simple_cartesian<double>;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Vertex = Mesh::Vertex_index;
using Placement = boost::optional<Kernel::Point_3>;

/* Over the surface, of flips: a flip may make the sliver beside it one that can be flipped. */
constexpr int MOST_PASSES = 16;

struct Cancelled : std::exception {};

/* What the callbacks of CGAL share, which copies them. */
struct Collapses {
  Mesh mesh;
  const qmat_skin_judge *judge = nullptr;
  size_t most = 0;
  bool pending = false; /* the judge has accepted a collapse */
  std::vector<uint32_t> removed, faces;
  std::vector<std::array<Vertex, 2>> sides; /* of the faces that are kept, opposite to the new vertex */
  std::vector<double> before, after;
};

void put(std::vector<double> &list, const Kernel::Point_3 &point) {
  for (int k = 0; k < 3; k++) list.push_back(point[k]);
}

/* Adds the faces around `centre`; those that have `other` too vanish. */
void add_faces(Collapses &c, Vertex centre, Vertex other, const Kernel::Point_3 &place, bool with_removed) {
  for (const auto h : CGAL::halfedges_around_target(centre, c.mesh)) {
    const Vertex a = c.mesh.target(c.mesh.next(h)), b = c.mesh.source(h);
    const auto face = static_cast<uint32_t>(static_cast<size_t>(c.mesh.face(h)));
    if (a == other || b == other) {
      if (with_removed) c.removed.push_back(face);
      continue;
    }
    c.faces.push_back(face);
    c.sides.push_back({a, b});
    put(c.before, c.mesh.point(centre));
    put(c.after, place);
    for (const Vertex v : {a, b}) {
      put(c.before, c.mesh.point(v));
      put(c.after, c.mesh.point(v));
    }
  }
}

struct Filter {
  Collapses *collapses;
  template <class Profile>
  Placement operator()(const Profile &profile, const Placement &place) const {
    if (!place) return place;
    Collapses &c = *collapses;
    c.removed.clear();
    c.faces.clear();
    c.sides.clear();
    c.before.clear();
    c.after.clear();
    add_faces(c, profile.v0(), profile.v1(), *place, true);
    add_faces(c, profile.v1(), profile.v0(), *place, false);
    c.removed.insert(c.removed.end(), c.faces.begin(), c.faces.end());
    const qmat_skin_star star = {c.removed.size() - c.faces.size(), c.faces.size(), c.removed.data(), c.before.data(),
                                 c.after.data()};
    c.pending = c.judge->accepts(c.judge->user, &star);
    return c.pending ? place : Placement();
  }
};

struct Stop {
  const Collapses *collapses;
  template <class Cost, class Profile>
  bool operator()(const Cost &, const Profile &, size_t /*initial*/, size_t edges) const {
    if (!collapses->judge->goes_on(collapses->judge->user)) throw Cancelled();
    return 2 * edges <= 3 * collapses->most;
  }
};

/* Euler operations may pass a face's id on to a neighbour, so the ids are found again. */
struct Visitor : SMS::Edge_collapse_visitor_base<Mesh> {
  Collapses *collapses = nullptr;
  void OnCollapsed(const Profile &, Vertex vertex) {
    Collapses &c = *collapses;
    if (!c.pending) return; /* an edge of length 0, which is not asked for */
    c.pending = false;
    for (const auto h : CGAL::halfedges_around_target(vertex, c.mesh)) {
      const std::array<Vertex, 2> side = {c.mesh.target(c.mesh.next(h)), c.mesh.source(h)};
      const auto found = std::find(c.sides.begin(), c.sides.end(), side);
      if (found != c.sides.end())
        c.faces[static_cast<size_t>(found - c.sides.begin())] =
            static_cast<uint32_t>(static_cast<size_t>(c.mesh.face(h)));
    }
    c.judge->collapsed(c.judge->user, c.faces.data());
  }
};

qmat_longest_side longest_side(const Mesh &mesh, Vertex a, Vertex b, Vertex c) {
  double corners[3][3];
  const Vertex ids[3] = {a, b, c};
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) corners[i][k] = mesh.point(ids[i])[k];
  return qmat_triangle_longest_side(corners[0], corners[1], corners[2]);
}

/* The height over the longest side, as a share of that. */
double height_share(const qmat_longest_side &side) {
  return side.length > 0 ? side.height / side.length : 0;
}

/* Flips the longest side of a sliver, unless a new face would be as flat or turn over. */
bool flip_sliver(Mesh &mesh, Mesh::Face_index face) {
  Mesh::Halfedge_index h = mesh.halfedge(face);
  const qmat_longest_side side = longest_side(mesh, mesh.source(h), mesh.target(h), mesh.target(mesh.next(h)));
  const double least = height_share(side);
  if (least > QMAT_SKIN_SLIVER) return false;
  for (int i = 0; i < side.base; i++) h = mesh.next(h);
  const Vertex a = mesh.source(h), b = mesh.target(h), c = mesh.target(mesh.next(h));
  const Vertex d = mesh.target(mesh.next(mesh.opposite(h)));
  if (c == d || mesh.halfedge(c, d).is_valid() || height_share(longest_side(mesh, c, a, d)) <= least ||
      height_share(longest_side(mesh, d, b, c)) <= least)
    return false;
  const Kernel::Vector_3 normal = CGAL::normal(mesh.point(b), mesh.point(a), mesh.point(d));
  if (!(normal * CGAL::normal(mesh.point(c), mesh.point(a), mesh.point(d)) > 0) ||
      !(normal * CGAL::normal(mesh.point(d), mesh.point(b), mesh.point(c)) > 0))
    return false;
  CGAL::Euler::flip_edge(h, mesh);
  return true;
}

bool read_mesh(const qmat_skin_triangles &surface, Mesh &mesh) {
  for (size_t v = 0; v < surface.vertex_count; v++) {
    const double *p = surface.positions + 3 * v;
    mesh.add_vertex(Kernel::Point_3(p[0], p[1], p[2]));
  }
  for (size_t t = 0; t < surface.triangle_count; t++) {
    const uint32_t *row = surface.triangles + 3 * t;
    if (mesh.add_face(Vertex(row[0]), Vertex(row[1]), Vertex(row[2])) == Mesh::null_face()) return false;
  }
  return CGAL::is_closed(mesh);
}

qmat_status write_mesh(Mesh &mesh, qmat_skin_triangles *surface) {
  mesh.collect_garbage();
  qmat_skin_triangles made = {mesh.number_of_vertices(), mesh.number_of_faces(), nullptr, nullptr};
  made.positions = static_cast<double *>(qmat_alloc(3 * made.vertex_count, sizeof(double)));
  made.triangles = static_cast<uint32_t *>(qmat_alloc(3 * made.triangle_count, sizeof(uint32_t)));
  if (!made.positions || !made.triangles) {
    qmat_free(made.positions);
    qmat_free(made.triangles);
    return QMAT_ERROR_MEMORY;
  }
  double *p = made.positions;
  for (const Vertex v : mesh.vertices())
    for (int k = 0; k < 3; k++) *p++ = mesh.point(v)[k];
  uint32_t *row = made.triangles;
  for (const auto f : mesh.faces())
    for (const Vertex v : CGAL::vertices_around_face(mesh.halfedge(f), mesh))
      *row++ = static_cast<uint32_t>(static_cast<size_t>(v));
  qmat_free(surface->positions);
  qmat_free(surface->triangles);
  *surface = made;
  return QMAT_OK;
}

}  // namespace

qmat_status qmat_skin_flip_slivers(qmat_skin_triangles *surface) {
  try {
    Mesh mesh;
    if (!read_mesh(*surface, mesh)) return QMAT_ERROR_GEOMETRY;
    bool any = true;
    for (int pass = 0; pass < MOST_PASSES && any; pass++) {
      any = false;
      for (const auto face : mesh.faces()) any = flip_sliver(mesh, face) || any;
    }
    return write_mesh(mesh, surface);
  } catch (const std::bad_alloc &) {
    return QMAT_ERROR_MEMORY;
  } catch (const std::exception &) {
    return QMAT_ERROR_GEOMETRY;
  }
}

qmat_status qmat_skin_collapse(qmat_skin_triangles *surface, size_t most, const qmat_skin_judge *judge) {
  try {
    Collapses c;
    c.judge = judge;
    c.most = most;
    if (!read_mesh(*surface, c.mesh)) return QMAT_ERROR_GEOMETRY;
    Visitor visitor;
    visitor.collapses = &c;
    SMS::edge_collapse(c.mesh, Stop{&c},
                       CGAL::parameters::get_cost(SMS::LindstromTurk_cost<Mesh>())
                           .get_placement(SMS::LindstromTurk_placement<Mesh>())
                           .filter(Filter{&c})
                           .visitor(visitor));
    return write_mesh(c.mesh, surface);
  } catch (const Cancelled &) {
    return QMAT_CANCELLED;
  } catch (const std::bad_alloc &) {
    return QMAT_ERROR_MEMORY;
  } catch (const std::exception &) {
    return QMAT_ERROR_GEOMETRY;
  }
}
