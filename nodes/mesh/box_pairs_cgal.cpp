/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/box_pairs_cgal.h"

#include <CGAL/Box_intersection_d/Box_with_info_d.h>
#include <CGAL/box_intersection_d.h>

#include <exception>
#include <new>

#include "nodes/mesh/triangle_pairs_cgal.h"

namespace {

using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 3, uint32_t>;

std::vector<Box> boxes_of(const double *corners, size_t count) {
  std::vector<Box> boxes;
  boxes.reserve(count);
  for (size_t i = 0; i < count; i++) {
    const double *c = corners + 6 * i;
    double low[3] = {c[0], c[1], c[2]}, high[3] = {c[3], c[4], c[5]};
    boxes.push_back({low, high, static_cast<uint32_t>(i)});
  }
  return boxes;
}

}  // namespace

qmat_status qmat_find_box_pairs(qmat_context *context, const double *a, size_t a_count, const double *b, size_t b_count,
                                qmat_box_visit *visit, void *data) {
  size_t seen = 0;
  const auto visit_boxes = [&](const Box &first, const Box &second) {
    qmat_status status = ++seen % 4096 == 0 ? qmat_progress(context, seen, 0, "pairs of boxes") : QMAT_OK;
    const bool swaps = !b && second.info() < first.info();
    if (status == QMAT_OK)
      status = swaps ? visit(data, second.info(), first.info()) : visit(data, first.info(), second.info());
    if (status != QMAT_OK) throw qmat::UnionStopped{status};
  };
  try {
    std::vector<Box> from = boxes_of(a, a_count);
    if (!b) {
      CGAL::box_self_intersection_d(from.begin(), from.end(), visit_boxes, qmat::kSweptBoxes);
      return QMAT_OK;
    }
    std::vector<Box> to = boxes_of(b, b_count);
    CGAL::box_intersection_d(from.begin(), from.end(), to.begin(), to.end(), visit_boxes, qmat::kSweptBoxes);
    return QMAT_OK;
  } catch (const qmat::UnionStopped &stopped) {
    return stopped.status;
  } catch (const std::bad_alloc &) {
    return qmat_fail_memory(context, "the boxes of the mesh");
  } catch (const std::exception &failure) {
    return qmat_fail(context, QMAT_ERROR_DEPENDENCY, "CGAL: %s", failure.what());
  } catch (...) {
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "finding boxes that meet failed in an unknown way");
  }
}
