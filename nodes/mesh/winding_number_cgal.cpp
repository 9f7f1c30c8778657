/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/winding_number_cgal.h"

#include <algorithm>
#include <cfloat>
#include <cmath>

namespace qmat {
namespace {

constexpr std::array<double, 4> kNoBounds = {INFINITY, -INFINITY, INFINITY, -INFINITY};

int sign_of(const Exact::FT &number) {
  return CGAL::sign(number);
}

}  // namespace

WindingNumbers::Bounds WindingNumbers::joined(const Bounds &a, const Bounds &b) {
  return {std::min(a[0], b[0]), std::max(a[1], b[1]), std::min(a[2], b[2]), std::max(a[3], b[3])};
}

std::array<double, 2> WindingNumbers::View::project(double x, double y, double z) const {
  return {direction[1] * x - direction[0] * y, direction[2] * x - direction[0] * z};
}

bool WindingNumbers::View::contains(const Bounds &b, const std::array<double, 2> &at) const {
  return at[0] >= b[0] - margin && at[0] <= b[1] + margin && at[1] >= b[2] - margin && at[1] <= b[3] + margin;
}

/* Brings neighbours together: halves the shadows at the median of alternating axes. */
void WindingNumbers::View::sort(size_t begin, size_t end, size_t axis) {
  if (end - begin <= kGroup) return;
  const size_t middle = begin + (end - begin + kGroup) / (2 * kGroup) * kGroup;
  const auto at = [&](size_t i) { return shadows.begin() + static_cast<ptrdiff_t>(i); };
  std::nth_element(at(begin), at(middle), at(end), [&](const Shadow &a, const Shadow &b) {
    return a.bounds[axis] + a.bounds[axis + 1] < b.bounds[axis] + b.bounds[axis + 1];
  });
  sort(begin, middle, 2 - axis);
  sort(middle, end, 2 - axis);
}

void WindingNumbers::View::group() {
  sort(0, shadows.size(), 0);
  for (size_t i = 0; i < shadows.size(); i++) {
    if (i % kGroup == 0) groups.push_back(kNoBounds);
    groups.back() = joined(groups.back(), shadows[i].bounds);
  }
}

const WindingNumbers::View &WindingNumbers::view(size_t number) {
  static const std::array<double, 3> directions[] = {{1009, 211, 379}, {313, 1021, -173}, {-241, 397, 1013},
                                                     {887, -641, 523}, {-571, 769, 607},  {983, 971, -227}};
  constexpr size_t kCount = sizeof directions / sizeof *directions;
  while (views_.size() <= number) {
    const size_t made = views_.size();
    View next;
    next.direction = directions[made % kCount];
    for (size_t k = 0; k < 3; k++) /* below 1, so that projections do not overflow */
      next.direction[k] = (next.direction[k] + static_cast<double>(2 * (made / kCount) * (k + 1))) / 8192;
    double largest = 0;
    for (uint32_t t = 0; t < mesh_.triangle_count(); t++) {
      if (!mesh_.has_shell(t) || mesh_.is_flat(t)) continue;
      Bounds bounds = kNoBounds;
      for (size_t k = 0; k < 3; k++) {
        const double *p = mesh_.position(mesh_.corners(t)[k]);
        const std::array<double, 2> at = next.project(p[0], p[1], p[2]);
        bounds = joined(bounds, {at[0], at[0], at[1], at[1]});
        for (size_t i = 0; i < 3; i++) largest = std::max(largest, std::fabs(p[i]));
      }
      next.shadows.push_back({bounds, t});
    }
    next.margin = 1e-12 * largest + DBL_MIN;
    next.group();
    views_.push_back(std::move(next));
  }
  return views_[number];
}

/* Counts how often the ray from `origin`, a point on no edge, leaves through a triangle minus how often it enters.
 * Triangles that contain the origin do not count. False: the ray hits an edge. */
bool WindingNumbers::count_crossings(const View &from, const Point &origin, uint32_t left_out, int *winding) const {
  const Exact::Vector_3 direction(from.direction[0], from.direction[1], from.direction[2]);
  const Point ahead = origin + direction;
  const std::array<double, 2> seen =
      from.project(CGAL::to_double(origin.x()), CGAL::to_double(origin.y()), CGAL::to_double(origin.z()));
  *winding = 0;
  for (size_t i = 0; i < from.shadows.size(); i++) {
    if (i % kGroup == 0 && !from.contains(from.groups[i / kGroup], seen)) {
      i += kGroup - 1;
      continue;
    }
    const uint32_t t = from.shadows[i].triangle;
    if (mesh_.shell(t) == left_out || !from.contains(from.shadows[i].bounds, seen)) continue;
    const uint32_t *c = mesh_.corners(t);
    const Point corner[3] = {mesh_.exact(c[0]), mesh_.exact(c[1]), mesh_.exact(c[2])};
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

int WindingNumbers::before(const Point corner[3], int layers, uint32_t left_out) {
  constexpr size_t kMostRays = 1000;
  const Point origin = CGAL::centroid(corner[0], corner[1], corner[2]);
  (void)origin.exact(); /* evaluates it, so that its doubles are the nearest ones */
  const Exact::Vector_3 normal = CGAL::normal(corner[0], corner[1], corner[2]);
  for (size_t number = 0; number < kMostRays; number++) {
    const View &from = view(number);
    const int heads = sign_of(normal * Exact::Vector_3(from.direction[0], from.direction[1], from.direction[2]));
    int winding;
    if (heads == 0 || !count_crossings(from, origin, left_out, &winding)) continue;
    return heads > 0 ? winding : winding - layers;
  }
  throw UnionRefused{"every ray hits an edge"};
}

}  // namespace qmat
