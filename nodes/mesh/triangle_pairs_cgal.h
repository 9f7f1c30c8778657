/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_TRIANGLE_PAIRS_CGAL_H
#define QMAT_NODES_MESH_TRIANGLE_PAIRS_CGAL_H

#include <functional>
#include <vector>

#include "nodes/mesh/union_mesh_cgal.h"

namespace qmat {

/* Boxes that are swept along an axis rather than divided further. CGAL's default, 10, takes up to twice as long. */
constexpr std::ptrdiff_t kSweptBoxes = 2000;

/* Whether a pair of triangles counts, the smaller id first. */
using PairTest = std::function<bool(uint32_t a, uint32_t b)>;

/* The pairs of the triangles whose bounding boxes meet and that pass the test, the smaller id first, in no order. The
 * test is called once for each, from all threads. */
std::vector<Pair> choose_box_pairs(const UnionMesh &mesh, const std::vector<uint32_t> &triangles, const PairTest &test);

}  // namespace qmat

#endif
