/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/wrap_cgal.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>

#include <array>
#include <exception>
#include <new>
#include <vector>

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

/* The run was cancelled. */
struct Stopped {
  qmat_status status;
};

struct Visitor : CGAL::Alpha_wraps_3::internal::Wrapping_default_visitor {
  explicit Visitor(qmat_context *context) : context_(context) {}

  template <class Wrapper, class Gate>
  void before_facet_treatment(const Wrapper &, const Gate &) {
    const qmat_status status = qmat_progress(context_, ++seen_, 0, "facets of the wrap");
    if (status != QMAT_OK) throw Stopped{status};
  }

 private:
  qmat_context *context_;
  size_t seen_ = 0;
};

void copy_out(const Mesh &mesh, qmat_wrap *wrap) {
  wrap->positions = static_cast<double *>(qmat_alloc(3 * num_vertices(mesh), sizeof(double)));
  wrap->triangles = static_cast<uint32_t *>(qmat_alloc(3 * num_faces(mesh), sizeof(uint32_t)));
  if (!wrap->positions || !wrap->triangles) throw std::bad_alloc();
  std::vector<uint32_t> numbers(mesh.number_of_vertices() + mesh.number_of_removed_vertices());
  for (const auto v : mesh.vertices()) {
    numbers[v] = static_cast<uint32_t>(wrap->vertex_count);
    for (int k = 0; k < 3; k++) wrap->positions[3 * wrap->vertex_count + static_cast<size_t>(k)] = mesh.point(v)[k];
    wrap->vertex_count++;
  }
  for (const auto f : mesh.faces()) {
    uint32_t *corner = wrap->triangles + 3 * wrap->triangle_count++;
    for (const auto v : CGAL::vertices_around_face(mesh.halfedge(f), mesh)) *corner++ = numbers[v];
  }
}

}  // namespace

qmat_status qmat_wrap_triangles(qmat_context *context, const double *positions, size_t vertex_count,
                                const uint32_t *triangles, size_t triangle_count, double alpha, double offset,
                                qmat_wrap *wrap) {
  *wrap = {};
  qmat_status status = QMAT_OK;
  try {
    std::vector<Kernel::Point_3> points;
    std::vector<std::array<std::size_t, 3>> faces;
    points.reserve(vertex_count);
    faces.reserve(triangle_count);
    for (size_t i = 0; i < vertex_count; i++)
      points.emplace_back(positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]);
    for (size_t t = 0; t < triangle_count; t++) {
      const uint32_t *c = triangles + 3 * t;
      faces.push_back({c[0], c[1], c[2]});
    }
    Mesh mesh;
    Visitor visitor(context);
    CGAL::alpha_wrap_3(points, faces, alpha, offset, mesh, CGAL::parameters::default_values(),
                       CGAL::parameters::visitor(visitor));
    copy_out(mesh, wrap);
    return QMAT_OK;
  } catch (const Stopped &stopped) {
    status = stopped.status;
  } catch (const std::bad_alloc &) {
    status = qmat_fail_memory(context, "the wrap");
  } catch (const std::exception &failure) {
    status = qmat_fail(context, QMAT_ERROR_DEPENDENCY, "CGAL: %s", failure.what());
  } catch (...) {
    status = qmat_fail(context, QMAT_ERROR_INTERNAL, "the wrap failed in an unknown way");
  }
  qmat_free(wrap->positions);
  qmat_free(wrap->triangles);
  *wrap = {};
  return status;
}
