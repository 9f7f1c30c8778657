/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/triangle_pairs_cgal.h"

#include <CGAL/Box_intersection_d/Box_with_info_d.h>
#include <CGAL/box_intersection_d.h>
#include <omp.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <numeric>

namespace qmat {
namespace {

/* The bounding boxes of triangles, in layers between cuts across the longest axis: a sweep of each finds all pairs, on
 * all threads. A box is in every layer that it reaches. */
class Layers {
 public:
  Layers(const UnionMesh &mesh, const std::vector<uint32_t> &triangles) {
    choose_cuts(mesh, triangles);
    std::vector<size_t> sizes = sizes_of(mesh, triangles);
    if (std::accumulate(sizes.begin(), sizes.end(), size_t{0}) > 2 * triangles.size()) { /* long ones */
      cuts_.clear();
      sizes = {triangles.size()};
    }
    boxes_.resize(sizes.size());
    for (size_t i = 0; i < sizes.size(); i++) boxes_[i].reserve(sizes[i]);
    for (const uint32_t t : triangles) {
      const Box box = box_of(mesh, t);
      for (size_t i = layer_of(box.min_coord(axis_)); i <= layer_of(box.max_coord(axis_)); i++)
        boxes_[i].push_back(box);
    }
  }

  size_t count() const {
    return boxes_.size();
  }

  /* Calls `visit` with the pairs of a layer, the smaller id first. Those that meet in several are of the first. */
  template <class Visit>
  void sweep(size_t layer, const Visit &visit) {
    const auto visit_boxes = [&](const Box &a, const Box &b) {
      if (layer_of(std::max(a.min_coord(axis_), b.min_coord(axis_))) != layer) return;
      visit(std::min(a.info(), b.info()), std::max(a.info(), b.info()));
    };
    CGAL::box_self_intersection_d(boxes_[layer].begin(), boxes_[layer].end(), visit_boxes, kSweptBoxes);
  }

 private:
  using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 3, uint32_t>;
  static constexpr size_t kLayerBoxes = 50000, kSamplesOfLayer = 64;

  int axis_ = 0;
  std::vector<double> cuts_;
  std::vector<std::vector<Box>> boxes_; /* per layer */

  static Box box_of(const UnionMesh &mesh, uint32_t triangle) {
    double low[3], high[3];
    const uint32_t *c = mesh.corners(triangle);
    for (size_t k = 0; k < 3; k++) {
      const double x = mesh.position(c[0])[k], y = mesh.position(c[1])[k], z = mesh.position(c[2])[k];
      low[k] = std::min({x, y, z});
      high[k] = std::max({x, y, z});
    }
    return {low, high, triangle};
  }

  size_t layer_of(double place) const {
    return static_cast<size_t>(std::upper_bound(cuts_.begin(), cuts_.end(), place) - cuts_.begin());
  }

  /* Cuts between equal numbers of some of the boxes. */
  void choose_cuts(const UnionMesh &mesh, const std::vector<uint32_t> &triangles) {
    const size_t count = triangles.size() / kLayerBoxes + 1, samples = kSamplesOfLayer * count;
    if (count == 1) return;
    std::array<std::vector<double>, 3> places;
    for (size_t i = 0; i < samples; i++) {
      const double *p = mesh.position(*mesh.corners(triangles[i * (triangles.size() / samples)]));
      for (size_t k = 0; k < 3; k++) places[k].push_back(p[k]);
    }
    for (std::vector<double> &along : places) std::sort(along.begin(), along.end());
    const auto length = [&](size_t k) { return places[k].back() - places[k].front(); };
    for (size_t k = 1; k < 3; k++)
      if (length(k) > length(static_cast<size_t>(axis_))) axis_ = static_cast<int>(k);
    for (size_t i = 1; i < count; i++) cuts_.push_back(places[static_cast<size_t>(axis_)][kSamplesOfLayer * i]);
  }

  std::vector<size_t> sizes_of(const UnionMesh &mesh, const std::vector<uint32_t> &triangles) const {
    std::vector<size_t> sizes(cuts_.size() + 1);
    for (const uint32_t t : triangles) {
      const Box box = box_of(mesh, t);
      for (size_t i = layer_of(box.min_coord(axis_)); i <= layer_of(box.max_coord(axis_)); i++) sizes[i]++;
    }
    return sizes;
  }
};

}  // namespace

std::vector<Pair> choose_box_pairs(const UnionMesh &mesh, const std::vector<uint32_t> &triangles,
                                   const PairTest &test) {
  Layers layers(mesh, triangles);
  std::vector<std::vector<Pair>> chosen(layers.count());
  std::atomic<bool> has_failed{false};
  std::exception_ptr failure;
#pragma omp parallel for num_threads(mesh.threads()) schedule(dynamic, 1)
  for (size_t i = 0; i < layers.count(); i++) {
    size_t seen = 0;
    const auto visit = [&](uint32_t a, uint32_t b) {
      if (++seen % 4096 == 0) {
        if (omp_get_thread_num() == 0) mesh.progress(seen, 0, "pairs of triangles");
        if (has_failed) throw UnionStopped{QMAT_CANCELLED};
      }
      if (test(a, b)) chosen[i].emplace_back(a, b);
    };
    try {
      if (!has_failed) layers.sweep(i, visit);
    } catch (...) {
#pragma omp critical(qmat_box_pairs)
      if (!has_failed.exchange(true)) failure = std::current_exception();
    }
  }
  if (failure) std::rethrow_exception(failure);
  std::vector<Pair> all = std::move(chosen[0]);
  for (size_t i = 1; i < layers.count(); i++) all.insert(all.end(), chosen[i].begin(), chosen[i].end());
  return all;
}

}  // namespace qmat
