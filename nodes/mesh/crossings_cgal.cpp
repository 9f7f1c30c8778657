/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/crossings_cgal.h"

#include <exception>

#include "nodes/mesh/arrangement_cgal.h"
#include "nodes/mesh/triangle_pairs_cgal.h"
#include "nodes/mesh/union_mesh_cgal.h"

namespace {

/* Whether two triangles have an edge in common: they could only lie on each other. */
bool share_an_edge(const uint32_t *a, const uint32_t *b) {
  int shared = 0;
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) shared += a[i] == b[k];
  return shared > 1;
}

void find(qmat_context *context, const qmat_shells &shells, uint8_t *crosses) {
  const qmat::UnionMesh mesh(context, shells);
  std::vector<uint32_t> triangles;
  for (uint32_t t = 0; t < mesh.triangle_count(); t++)
    if (!mesh.is_flat(t)) triangles.push_back(t);
  qmat::choose_box_pairs(mesh, triangles, [&](uint32_t a, uint32_t b) {
    const bool are_known =
        __atomic_load_n(&crosses[a], __ATOMIC_RELAXED) && __atomic_load_n(&crosses[b], __ATOMIC_RELAXED);
    if (mesh.patch(a) != mesh.patch(b) || are_known) return false;
    if (share_an_edge(mesh.corners(a), mesh.corners(b)) || !qmat::do_meet(mesh, a, b)) return false;
    __atomic_store_n(&crosses[a], uint8_t{1}, __ATOMIC_RELAXED);
    __atomic_store_n(&crosses[b], uint8_t{1}, __ATOMIC_RELAXED);
    return false;
  });
}

}  // namespace

qmat_status qmat_find_crossings(qmat_context *context, const qmat_shells *shells, uint8_t *crosses) {
  try {
    find(context, *shells, crosses);
    return QMAT_OK;
  } catch (const qmat::UnionStopped &stopped) {
    return stopped.status;
  } catch (const std::bad_alloc &) {
    return qmat_fail_memory(context, "the crossings of the mesh");
  } catch (const std::exception &failure) {
    return qmat_fail(context, QMAT_ERROR_DEPENDENCY, "CGAL: %s", failure.what());
  } catch (...) {
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "finding crossings failed in an unknown way");
  }
}
