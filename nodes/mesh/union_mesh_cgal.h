/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_UNION_MESH_CGAL_H
#define QMAT_NODES_MESH_UNION_MESH_CGAL_H

/* The mesh whose shells are united, for the C++ files of the union, with CGAL's kernels. */
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <array>
#include <new>
#include <utility>
#include <vector>

#include "core/disjoint_sets.h"
#include "nodes/mesh/shells.h"

namespace qmat {

using Inexact = CGAL::Exact_predicates_inexact_constructions_kernel;
using Exact = CGAL::Exact_predicates_exact_constructions_kernel;
using Point = Exact::Point_3;
using Pair = std::pair<uint32_t, uint32_t>;
using Corners = std::array<uint32_t, 3>;

constexpr uint32_t kNone = UINT32_MAX;

/* A status on its way through CGAL. */
struct UnionStopped {
  qmat_status status;
};

/* The shells cannot be united. */
struct UnionRefused {
  const char *why; /* a literal */
};

class UnionMesh {
 public:
  UnionMesh(qmat_context *context, const qmat_shells &shells) : context_(context), shells_(shells) {
    is_flat_.resize(triangle_count());
    for (uint32_t t = 0; t < triangle_count(); t++) {
      const uint32_t *c = corners(t);
      is_flat_[t] = has_shell(t) && CGAL::collinear(inexact(c[0]), inexact(c[1]), inexact(c[2]));
    }
  }

  size_t vertex_count() const {
    return shells_.vertex_count;
  }
  uint32_t triangle_count() const {
    return static_cast<uint32_t>(shells_.triangle_count);
  }
  const uint32_t *corners(uint32_t triangle) const {
    return shells_.triangles + 3 * static_cast<size_t>(triangle);
  }
  const double *position(uint32_t vertex) const {
    return shells_.positions + 3 * static_cast<size_t>(vertex);
  }
  uint32_t shell(uint32_t triangle) const {
    return shells_.shells[triangle];
  }
  bool has_shell(uint32_t triangle) const {
    return shell(triangle) != QMAT_NO_SHELL;
  }
  uint32_t patch(uint32_t triangle) const {
    return shells_.patches[triangle];
  }
  bool reaches(uint32_t triangle) const {
    return shells_.reaches[triangle] != 0;
  }
  bool crosses(uint32_t triangle) const {
    return shells_.crosses[triangle] != 0;
  }
  double longest_fold() const {
    return shells_.longest_fold;
  }

  /* Where the result has a vertex that the union has at `p`, on a piece of a triangle. */
  std::array<double, 3> brought_back(uint32_t vertex, uint32_t triangle, const std::array<double, 3> &p) const {
    if (!shells_.given) return p;
    if (vertex < vertex_count()) {
      const double *given = shells_.given + 3 * static_cast<size_t>(vertex);
      return {given[0], given[1], given[2]};
    }
    const qmat_block_frame &frame = shells_.frames[shells_.frame_of[triangle]];
    if (!frame.is_turned) return p;
    std::array<double, 3> back;
    for (size_t k = 0; k < 3; k++)
      back[k] =
          frame.centre[k] + (p[0] - frame.shift) * frame.axes[0][k] + p[1] * frame.axes[1][k] + p[2] * frame.axes[2][k];
    return back;
  }

  /* Whether the corners are collinear; false without a shell. */
  bool is_flat(uint32_t triangle) const {
    return is_flat_[triangle];
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

  int threads() const {
    return qmat_threads(context_);
  }

  /* Disjoint sets in the context's arena. */
  uint32_t *new_sets(size_t count) const {
    uint32_t *sets = qmat_sets_new(context_, count);
    if (!sets) throw std::bad_alloc();
    return sets;
  }

  /* Reports progress; throws UnionStopped when the run is cancelled. */
  void progress(size_t done, size_t total, const char *unit) const {
    const qmat_status status = qmat_progress(context_, done, total, unit);
    if (status != QMAT_OK) throw UnionStopped{status};
  }

 private:
  qmat_context *context_;
  const qmat_shells &shells_;
  std::vector<bool> is_flat_; /* per triangle */
};

}  // namespace qmat

#endif
