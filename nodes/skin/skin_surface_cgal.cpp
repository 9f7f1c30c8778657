/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/skin/skin_surface_cgal.h"

#include "nodes/skin/rising_allocator.h"
/* CGAL's hook; rising_allocator.h says why. Before the first CGAL header. */
#define CGAL_ALLOCATOR(T) qmat::RisingAllocator<T>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polyhedron_3.h>
#include <CGAL/Skin_surface_3.h>
#include <CGAL/Skin_surface_polyhedral_items_3.h>
#include <CGAL/mesh_skin_surface_3.h>
#include <CGAL/subdivide_skin_surface_mesh_3.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <new>
#include <numeric>
#include <system_error>
#include <thread>
#include <unordered_map>
#include <vector>

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Traits = CGAL::Skin_surface_traits_3<Kernel>;
using Skin = CGAL::Skin_surface_3<Traits>;
using Polyhedron = CGAL::Polyhedron_3<Kernel, CGAL::Skin_surface_polyhedral_items_3<Skin>>;
using Triangle = std::array<uint32_t, 3>;

/* CGAL finds points on the skin to 1e-4 of a unit, so it gets a larger copy. The scale is a power of two, so that no
 * digit changes. */
constexpr double kScale = 1024;

struct Soup {
  std::vector<std::array<double, 3>> positions;
  std::vector<Triangle> triangles;
};

/* CGAL's order follows addresses. Here vertices are numbered by position, triangles start at their smallest vertex, and
 * are sorted. */
Soup sorted_soup(const Polyhedron &polyhedron) {
  std::vector<Polyhedron::Vertex_const_handle> vertices;
  for (auto v = polyhedron.vertices_begin(); v != polyhedron.vertices_end(); v++) vertices.push_back(v);
  const auto position = [](Polyhedron::Vertex_const_handle v) {
    return std::array<double, 3>{v->point().x() / kScale, v->point().y() / kScale, v->point().z() / kScale};
  };
  std::stable_sort(vertices.begin(), vertices.end(),
                   [&](const auto &a, const auto &b) { return position(a) < position(b); });
  Soup soup;
  std::unordered_map<const void *, uint32_t> ids;
  for (const auto &v : vertices) {
    ids.emplace(&*v, static_cast<uint32_t>(soup.positions.size()));
    soup.positions.push_back(position(v));
  }
  for (auto f = polyhedron.facets_begin(); f != polyhedron.facets_end(); f++) {
    Triangle t;
    auto h = f->facet_begin();
    for (uint32_t &id : t) id = ids.at(&*(h++)->vertex());
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    soup.triangles.push_back(t);
  }
  std::sort(soup.triangles.begin(), soup.triangles.end());
  return soup;
}

/* Turns all triangles around where they face inwards. */
void turn_outward(Soup &soup) {
  double volume = 0;
  for (const Triangle &t : soup.triangles) {
    const auto &a = soup.positions[t[0]], &b = soup.positions[t[1]], &c = soup.positions[t[2]];
    volume +=
        a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  if (volume >= 0) return;
  for (Triangle &t : soup.triangles) std::swap(t[1], t[2]);
}

qmat_status copy_out(qmat_context *context, const Soup &soup, qmat_skin_triangles *surface) {
  surface->positions = static_cast<double *>(qmat_alloc(3 * soup.positions.size(), sizeof(double)));
  surface->triangles = static_cast<uint32_t *>(qmat_alloc(3 * soup.triangles.size(), sizeof(uint32_t)));
  if (!surface->positions || !surface->triangles) {
    qmat_free(surface->positions);
    qmat_free(surface->triangles);
    *surface = {};
    return qmat_fail_memory(context, "surface triangles");
  }
  for (size_t i = 0; i < soup.positions.size(); i++)
    std::copy(soup.positions[i].begin(), soup.positions[i].end(), surface->positions + 3 * i);
  for (size_t i = 0; i < soup.triangles.size(); i++)
    std::copy(soup.triangles[i].begin(), soup.triangles[i].end(), surface->triangles + 3 * i);
  surface->vertex_count = soup.positions.size();
  surface->triangle_count = soup.triangles.size();
  return QMAT_OK;
}

qmat_status make_skin(qmat_context *context, const std::atomic<bool> &stop, const double *balls, size_t count,
                      double shrink, int subdivisions, qmat_skin_triangles *surface) {
  try {
    const qmat::RisingMemory memory(stop);
    std::vector<Skin::Weighted_point> weighted;
    weighted.reserve(count + 6);
    for (size_t i = 0; i < count; i++) {
      const double *b = balls + 4 * i;
      const double radius = kScale * b[3];
      weighted.emplace_back(Skin::Bare_point(kScale * b[0], kScale * b[1], kScale * b[2]), radius * radius);
    }
    /* The skin of a ball is undisturbed where no neighbour's radical plane comes within radius / shrink of it. CGAL's
     * own box around few balls comes closer: points without a ball push it out. */
    const double far = kScale * 8 / shrink;
    for (int side = -1; side <= 1; side += 2) {
      weighted.emplace_back(Skin::Bare_point(side * far, 0, 0), -1);
      weighted.emplace_back(Skin::Bare_point(0, side * 1.1 * far, 0), -1);
      weighted.emplace_back(Skin::Bare_point(0, 0, side * 1.2 * far), -1);
    }
    const bool grow_balls = true;
    const Skin skin(weighted.begin(), weighted.end(), shrink, grow_balls);
    Polyhedron polyhedron;
    CGAL::mesh_skin_surface_3(skin, polyhedron);
    if (subdivisions > 0) CGAL::subdivide_skin_surface_mesh_3(skin, polyhedron, subdivisions);
    if (!polyhedron.is_closed() || !polyhedron.is_pure_triangle())
      return qmat_fail(context, QMAT_ERROR_GEOMETRY, "CGAL's skin surface of %zu balls is not closed", count);
    Soup soup = sorted_soup(polyhedron);
    turn_outward(soup);
    return copy_out(context, soup, surface);
  } catch (const std::bad_alloc &) {
    return qmat_fail_memory(context, "the skin surface");
  } catch (const qmat::Stopped &) {
    return QMAT_CANCELLED;
  } catch (const std::exception &failure) {
    return qmat_fail(context, QMAT_ERROR_DEPENDENCY, "CGAL: %s", failure.what());
  } catch (...) {
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "the skin surface failed in an unknown way");
  }
}

}  // namespace

/* CGAL runs in a thread of its own while this one calls the progress function. CGAL's thread-local variables, which an
 * exception leaves in disorder, end with that thread. */
qmat_status qmat_skin_surface(qmat_context *context, const double *balls, size_t count, double shrink, int subdivisions,
                              qmat_skin_triangles *surface) {
  *surface = {};
  qmat_context inner = {};
  inner.node_id = context->node_id;
  inner.node_type = context->node_type;
  std::atomic<bool> stop{false};
  bool done = false;
  qmat_status made = QMAT_OK, status = QMAT_OK;
  std::mutex mutex;
  std::condition_variable ended;
  try {
    std::thread worker([&] {
      const qmat_status result = make_skin(&inner, stop, balls, count, shrink, subdivisions, surface);
      const std::lock_guard<std::mutex> lock(mutex);
      made = result;
      done = true;
      ended.notify_one();
    });
    std::unique_lock<std::mutex> lock(mutex);
    while (!done) {
      if (!ended.wait_for(lock, std::chrono::milliseconds(50), [&] { return done; }) && status == QMAT_OK) {
        lock.unlock();
        status = qmat_progress(context, 0, count, "balls");
        if (status != QMAT_OK) stop = true;
        lock.lock();
      }
    }
    lock.unlock();
    worker.join();
  } catch (const std::system_error &) {
    return qmat_fail_memory(context, "a thread for the skin surface");
  } catch (const std::bad_alloc &) {
    return qmat_fail_memory(context, "a thread for the skin surface");
  }
  if (status == QMAT_OK && made != QMAT_OK) context->error = inner.error;
  if (status == QMAT_OK) return made;
  qmat_free(surface->positions);
  qmat_free(surface->triangles);
  *surface = {};
  return status;
}
