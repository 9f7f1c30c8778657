/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The union of shells: which shells change, which pieces of the arrangement bound the union, and how they are rounded.
 */
#include "nodes/mesh/union_cgal.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <map>
#include <new>
#include <tuple>
#include <vector>

#include "core/geometry/vector.h"
#include "nodes/mesh/arrangement_cgal.h"
#include "nodes/mesh/triangle_pairs_cgal.h"
#include "nodes/mesh/union_mesh_cgal.h"
#include "nodes/mesh/winding_number_cgal.h"

namespace qmat {
namespace {

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
  Union(qmat_context *context, const qmat_shells &shells)
      : mesh_(context, shells),
        winding_numbers_(mesh_),
        clusters_(mesh_.new_sets(mesh_.triangle_count())),
        active_(mesh_.triangle_count()) {}

  void make(qmat_united *united) {
    find_meeting_shells();
    find_swallowed_shells();
    if (active_count_ == 0) return;
    std::vector<uint32_t> triangles;
    for (uint32_t t = 0; t < mesh_.triangle_count(); t++)
      if (is_active(t)) triangles.push_back(t);
    arrangement_ = arrange(mesh_, triangles, find_pairs(triangles));
    changed_.resize(mesh_.triangle_count());
    for (const Piece &face : arrangement_.cancelled) changed_[cluster_of(face.source)] = true;
    find_regions();
    choose_pieces();
    copy_out(united);
  }

 private:
  UnionMesh mesh_;
  WindingNumbers winding_numbers_;
  Arrangement arrangement_;
  std::vector<Piece> &pieces_ = arrangement_.pieces;
  uint32_t *clusters_;       /* disjoint sets of shells that meet, by their triangles */
  std::vector<bool> active_; /* per shell: it is cut, or may be left out */
  size_t active_count_ = 0;
  std::vector<uint32_t> region_of_; /* per piece: the first piece of its region */
  std::vector<bool> changed_;       /* per cluster, by its leader */
  std::vector<qmat_fate> fates_;    /* per triangle */

  uint32_t cluster_of(uint32_t triangle) const {
    return qmat_set_leader(clusters_, mesh_.shell(triangle));
  }
  uint32_t cluster_of_any(uint32_t triangle) const {
    return mesh_.has_shell(triangle) ? cluster_of(triangle) : triangle;
  }
  bool is_active(uint32_t triangle) const {
    return mesh_.has_shell(triangle) && active_[mesh_.shell(triangle)];
  }
  void activate(uint32_t triangle) {
    const uint32_t shell = mesh_.shell(triangle);
    active_count_ += !active_[shell];
    active_[shell] = true;
  }

  /* ---- the shells that may change ---- */

  void find_meeting_shells() {
    for (uint32_t t = 0; t < mesh_.triangle_count(); t++)
      if (mesh_.has_shell(t) && mesh_.crosses(t)) activate(t);
    std::vector<uint32_t> triangles;
    for (uint32_t t = 0; t < mesh_.triangle_count(); t++)
      if (mesh_.has_shell(t) && mesh_.reaches(t) && !mesh_.is_flat(t)) triangles.push_back(t);
    const auto meet = [&](uint32_t a, uint32_t b) { return mesh_.patch(a) != mesh_.patch(b) && do_meet(mesh_, a, b); };
    for (const Pair &pair : choose_box_pairs(mesh_, triangles, meet)) {
      qmat_sets_join(clusters_, mesh_.shell(pair.first), mesh_.shell(pair.second));
      activate(pair.first);
      activate(pair.second);
    }
  }

  /* Activates shells that meet no other shell but lie where the winding number of the others is not 0. */
  void find_swallowed_shells() {
    std::vector<bool> tested(mesh_.triangle_count());
    for (uint32_t t = 0; t < mesh_.triangle_count(); t++) {
      const uint32_t shell = mesh_.shell(t);
      if (shell == QMAT_NO_SHELL || active_[shell] || tested[shell] || mesh_.is_flat(t)) continue;
      mesh_.progress(t, mesh_.triangle_count(), "triangles");
      tested[shell] = true;
      const uint32_t *c = mesh_.corners(t);
      const Point corner[3] = {mesh_.exact(c[0]), mesh_.exact(c[1]), mesh_.exact(c[2])};
      if (winding_numbers_.before(corner, 0, shell) != 0) activate(t);
    }
  }

  /* All pairs of triangles that meet within a cluster, including pairs within one shell. */
  std::vector<Pair> find_pairs(const std::vector<uint32_t> &triangles) {
    std::vector<uint32_t> clusters(mesh_.triangle_count()); /* to find a leader changes the sets */
    for (const uint32_t t : triangles) clusters[t] = cluster_of(t);
    std::vector<Pair> pairs = choose_box_pairs(mesh_, triangles, [&](uint32_t a, uint32_t b) {
      if (clusters[a] != clusters[b] || (mesh_.is_flat(a) && mesh_.is_flat(b))) return false;
      return mesh_.is_flat(a) || mesh_.is_flat(b) || do_meet(mesh_, a, b);
    });
    std::sort(pairs.begin(), pairs.end());
    return pairs;
  }

  /* ---- the pieces that bound the union ---- */

  /* Regions: pieces connected across edges of exactly two pieces. The winding numbers in front of a region and behind
   * it are constant. */
  void find_regions() {
    uint32_t *leaders = mesh_.new_sets(pieces_.size());
    const std::vector<Edge> edges = sorted_edges(pieces_);
    for (size_t first = 0, last; first < edges.size(); first = last) {
      for (last = first + 1; last < edges.size() && edges[first].is_same(edges[last]);) last++;
      const Edge &a = edges[first], &b = edges[last - 1];
      if (last - first == 2 && a.rises != b.rises && pieces_[a.piece].layers == pieces_[b.piece].layers)
        qmat_sets_join(leaders, a.piece, b.piece);
    }
    region_of_.resize(pieces_.size());
    for (uint32_t i = 0; i < pieces_.size(); i++) region_of_[i] = qmat_set_leader(leaders, i);
  }

  /* A vertex up to rounding, without the cost of its exact place (see `rounded`). */
  std::array<double, 3> near_point(uint32_t vertex) const {
    const Point &at = arrangement_.points[vertex];
    if (vertex >= mesh_.vertex_count())
      return {CGAL::to_double(at.x()), CGAL::to_double(at.y()), CGAL::to_double(at.z())};
    const double *p = mesh_.position(vertex);
    return {p[0], p[1], p[2]};
  }

  double distance(uint32_t a, uint32_t b) const {
    return qmat_point_distance(near_point(a).data(), near_point(b).data());
  }

  /* Whether a vertex is farther than the longest fold from all of these. */
  bool is_far(uint32_t vertex, const std::vector<uint32_t> &from) const {
    const std::array<double, 3> p = near_point(vertex);
    return std::none_of(from.begin(), from.end(), [&](uint32_t other) {
      return qmat_point_distance(p.data(), near_point(other).data()) <= mesh_.longest_fold();
    });
  }

  bool is_large(const Corners &c) const {
    return std::max({distance(c[0], c[1]), distance(c[1], c[2]), distance(c[2], c[0])}) > 2 * mesh_.longest_fold();
  }

  /* The winding number in front of a piece. */
  int winding_before(const Piece &piece) {
    Point corner[3];
    for (size_t k = 0; k < 3; k++) {
      const uint32_t id = piece.corners[k];
      corner[k] = id < mesh_.vertex_count() ? mesh_.exact(id) : arrangement_.points[id];
    }
    return winding_numbers_.before(corner, piece.layers, QMAT_NO_SHELL);
  }

  /* Sets `has_wall` for the clusters in which triangles cancel with the inside on both sides: blocks that touch. */
  void find_walls(std::vector<bool> &has_wall) {
    for (size_t i = 0; i < arrangement_.cancelled.size(); i++) {
      if (i % 64 == 0) mesh_.progress(i, arrangement_.cancelled.size(), "pieces");
      const Piece &face = arrangement_.cancelled[i];
      const uint32_t cluster = cluster_of(face.source);
      if (!has_wall[cluster]) has_wall[cluster] = winding_before(face) > 0;
    }
  }

  /* A shell that meets only itself stays where all vertices that it hides are near the border of their region, and no
   * hidden piece is large: its union would leave crumbs. A shell with walls inside does not stay. */
  void leave_short_folds(const std::vector<int8_t> &kept) {
    std::vector<size_t> shells(mesh_.triangle_count());
    for (uint32_t t = 0; t < mesh_.triangle_count(); t++) shells[cluster_of_any(t)] += mesh_.shell(t) == t;
    std::vector<bool> is_kept(arrangement_.points.size()), has_long_fold(mesh_.triangle_count());
    find_walls(has_long_fold);
    std::vector<Pair> hidden; /* region, vertex */
    for (size_t i = 0; i < pieces_.size(); i++) {
      const uint32_t cluster = cluster_of(pieces_[i].source);
      const Corners &corners = pieces_[i].corners;
      if (kept[region_of_[i]]) {
        for (const uint32_t corner : corners) is_kept[corner] = true;
      } else if (shells[cluster] == 1 && !has_long_fold[cluster]) {
        for (const uint32_t corner : corners) hidden.emplace_back(region_of_[i], corner);
        has_long_fold[cluster] = is_large(corners);
      }
    }
    std::sort(hidden.begin(), hidden.end());
    hidden.erase(std::unique(hidden.begin(), hidden.end()), hidden.end());
    std::vector<uint32_t> border;
    for (size_t first = 0, last; first < hidden.size(); first = last) {
      const uint32_t region = hidden[first].first, cluster = cluster_of(pieces_[region].source);
      border.clear();
      for (last = first; last < hidden.size() && hidden[last].first == region; last++)
        if (is_kept[hidden[last].second]) border.push_back(hidden[last].second);
      for (size_t i = first; i < last && !has_long_fold[cluster]; i++) {
        if (i % 64 == 0) mesh_.progress(i, hidden.size(), "hidden vertices");
        if (!is_kept[hidden[i].second] && is_far(hidden[i].second, border)) has_long_fold[cluster] = true;
      }
    }
    for (uint32_t t = 0; t < mesh_.triangle_count(); t++)
      if (shells[t] == 1 && !has_long_fold[t]) changed_[t] = false;
  }

  /* Keeps the pieces with the inside behind them and the outside in front, each once. */
  void choose_pieces() {
    std::vector<int8_t> kept(pieces_.size(), -1); /* per region; -1: not known */
    for (uint32_t i = 0; i < pieces_.size(); i++) {
      if (i % 64 == 0) mesh_.progress(i, pieces_.size(), "pieces");
      int8_t &keeps = kept[region_of_[i]];
      const Piece &piece = pieces_[i];
      if (keeps < 0) {
        const int before = winding_before(piece);
        keeps = before <= 0 && before + piece.layers > 0;
      }
      if (!keeps || piece.layers != 1) changed_[cluster_of(piece.source)] = true;
    }
    leave_short_folds(kept);
    size_t count = 0;
    fates_.resize(mesh_.triangle_count());
    for (size_t i = 0; i < pieces_.size(); i++) {
      const bool keeps = kept[region_of_[i]];
      if (!changed_[cluster_of(pieces_[i].source)]) continue;
      qmat_fate &fate = fates_[pieces_[i].source];
      if (!arrangement_.overlaps[pieces_[i].source]) fate = std::max(fate, keeps ? QMAT_FATE_SHOWN : QMAT_FATE_HIDDEN);
      if (keeps) pieces_[count++] = pieces_[i];
    }
    pieces_.resize(count);
  }

  /* ---- rounding ---- */

  /* The nearest doubles. They must not come from an interval, whose width depends on the computations before. */
  std::array<double, 3> rounded(uint32_t vertex) const {
    if (vertex < mesh_.vertex_count()) return near_point(vertex);
    const auto &p = CGAL::exact(arrangement_.points[vertex]);
    return {CGAL::to_double(p.x()), CGAL::to_double(p.y()), CGAL::to_double(p.z())};
  }

  /* Merges vertices that are equal after rounding, and drops the pieces that lose their area. */
  void merge_rounded() {
    std::vector<uint32_t> used;
    for (const Piece &piece : pieces_) used.insert(used.end(), piece.corners.begin(), piece.corners.end());
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    std::map<std::array<double, 3>, uint32_t> places;
    std::vector<uint32_t> merged(arrangement_.points.size());
    for (const uint32_t v : used) merged[v] = places.emplace(rounded(v), v).first->second;
    for (Piece &piece : pieces_) {
      for (uint32_t &corner : piece.corners) corner = merged[corner];
      Corners &c = piece.corners;
      piece.layers = c[0] != c[1] && c[1] != c[2] && c[2] != c[0];
      std::rotate(c.begin(), std::min_element(c.begin(), c.end()), c.end());
    }
    /* Two pieces with the same corners and opposite sides cancel. */
    std::map<Corners, size_t> seen;
    for (size_t i = 0; i < pieces_.size(); i++) {
      if (pieces_[i].layers == 0) continue;
      const Corners &c = pieces_[i].corners;
      const auto back = seen.find({c[0], c[2], c[1]});
      if (back != seen.end()) {
        pieces_[i].layers = pieces_[back->second].layers = 0;
        seen.erase(back);
      } else if (!seen.emplace(c, i).second) {
        throw UnionRefused{"triangles fall together when they are rounded"};
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
      if (balance != 0) throw UnionRefused{"their cuts do not close"};
    }
  }

  bool is_united(uint32_t triangle) const {
    return is_active(triangle) && changed_[cluster_of(triangle)];
  }

  void copy_out(qmat_united *united) {
    bool changed = false;
    for (uint32_t t = 0; t < mesh_.triangle_count(); t++) changed = changed || is_united(t);
    if (!changed) return;
    merge_rounded();
    check_edges();
    std::vector<uint32_t> triangles, source(arrangement_.points.size()); /* per vertex: a triangle there */
    std::vector<bool> counted(mesh_.triangle_count());
    united->is_cut = static_cast<uint8_t *>(qmat_calloc(mesh_.triangle_count(), 1));
    united->fates = static_cast<uint8_t *>(qmat_calloc(mesh_.triangle_count(), 1));
    if (!united->is_cut || !united->fates) throw std::bad_alloc();
    for (uint32_t t = 0; t < mesh_.triangle_count(); t++) united->fates[t] = is_united(t) ? fates_[t] : QMAT_FATE_SHOWN;
    size_t next = 0;
    for (uint32_t t = 0; t < mesh_.triangle_count(); t++) {
      if (is_united(t)) {
        united->is_cut[t] = true;
        for (; next < pieces_.size() && pieces_[next].source == t; next++) {
          const Corners &piece = pieces_[next].corners;
          triangles.insert(triangles.end(), piece.begin(), piece.end());
          for (const uint32_t v : piece) source[v] = t;
          if (std::is_permutation(piece.begin(), piece.end(), mesh_.corners(t))) united->is_cut[t] = false;
        }
        united->shells_united += !counted[mesh_.shell(t)];
        counted[mesh_.shell(t)] = true;
      } else {
        triangles.insert(triangles.end(), mesh_.corners(t), mesh_.corners(t) + 3);
      }
    }
    if (triangles.empty()) throw UnionRefused{"they leave nothing of each other"};
    std::vector<uint32_t> numbers(arrangement_.points.size(), kNone), used;
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
      const std::array<double, 3> p = mesh_.brought_back(used[i], source[used[i]], rounded(used[i]));
      std::copy(p.begin(), p.end(), united->positions + 3 * i);
    }
    for (size_t i = 0; i < triangles.size(); i++) united->triangles[i] = numbers[triangles[i]];
    united->vertex_count = used.size();
    united->triangle_count = triangles.size() / 3;
    united->cut_triangles = arrangement_.cut_count;
    united->changed = true;
  }
};

void release(qmat_united *united) {
  qmat_free(united->positions);
  qmat_free(united->triangles);
  qmat_free(united->is_cut);
  qmat_free(united->fates);
  *united = {};
}

}  // namespace
}  // namespace qmat

qmat_status qmat_unite_shells(qmat_context *context, const qmat_shells *shells, qmat_united *united) {
  *united = {};
  qmat_status status = QMAT_OK;
  try {
    qmat::Union(context, *shells).make(united);
    return QMAT_OK;
  } catch (const qmat::UnionRefused &refused) {
    qmat::release(united);
    united->why_not = refused.why;
    return QMAT_OK;
  } catch (const qmat::UnionStopped &stopped) {
    status = stopped.status;
  } catch (const std::bad_alloc &) {
    status = qmat_fail_memory(context, "the union of the parts");
  } catch (const std::exception &failure) {
    status = qmat_fail(context, QMAT_ERROR_DEPENDENCY, "CGAL: %s", failure.what());
  } catch (...) {
    status = qmat_fail(context, QMAT_ERROR_INTERNAL, "the union of the parts failed in an unknown way");
  }
  qmat::release(united);
  return status;
}
