/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/subdivision_osd.h"

#include <opensubdiv/far/error.h>
#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <mutex>
#include <vector>

namespace {

namespace Far = OpenSubdiv::Far;
namespace Sdc = OpenSubdiv::Sdc;

struct Point {
  double x[3];
  void Clear() {
    x[0] = x[1] = x[2] = 0;
  }
  void AddWithWeight(const Point &other, double weight) {
    for (int k = 0; k < 3; k++) x[k] += weight * other.x[k];
  }
};

double distance(const Point &a, const Point &b) {
  return std::hypot(a.x[0] - b.x[0], a.x[1] - b.x[1], a.x[2] - b.x[2]);
}

/* OpenSubdiv's first message, which it would print otherwise. Its callbacks are global, so they are set once. */
thread_local char message[256];

void keep_first(const char *text) {
  if (message[0] == 0) std::snprintf(message, sizeof message, "%s", text);
}

void capture_messages() {
  static std::once_flag once;
  std::call_once(once, [] {
    Far::SetErrorCallback([](Far::ErrorType, const char *text) { keep_first(text); });
    Far::SetWarningCallback(keep_first);
  });
  message[0] = 0;
}

Sdc::SchemeType scheme_of(const qmat_cage *cage) {
  if (cage->schemes[0] == QMAT_SCHEME_LOOP) return Sdc::SCHEME_LOOP;
  return cage->schemes[0] == QMAT_SCHEME_BILINEAR ? Sdc::SCHEME_BILINEAR : Sdc::SCHEME_CATMARK;
}

Sdc::Options options_of(const qmat_cage *cage) {
  Sdc::Options options;
  const uint32_t boundary = cage->boundaries[0];
  options.SetVtxBoundaryInterpolation(boundary == QMAT_BOUNDARY_NONE   ? Sdc::Options::VTX_BOUNDARY_NONE
                                      : boundary == QMAT_BOUNDARY_EDGE ? Sdc::Options::VTX_BOUNDARY_EDGE_ONLY
                                                                       : Sdc::Options::VTX_BOUNDARY_EDGE_AND_CORNER);
  return options;
}

std::vector<int> ints(const uint32_t *values, size_t count) {
  return std::vector<int>(values, values + count);
}

std::vector<float> sharpness(const double *values, size_t count) {
  std::vector<float> result(count);
  for (size_t i = 0; i < count; i++)
    result[i] = static_cast<float>(std::min<double>(values[i], Sdc::Crease::SHARPNESS_INFINITE));
  return result;
}

std::unique_ptr<Far::TopologyRefiner> refiner_of(const qmat_cage *cage) {
  const auto sizes = ints(cage->face_sizes, cage->face_count), corners = ints(cage->corners, cage->corner_count),
             creases = ints(cage->creases, 2 * cage->crease_count), holes = ints(cage->holes, cage->hole_count),
             sharp = ints(cage->sharp_vertices, cage->sharp_count);
  const auto crease_sharpness = sharpness(cage->crease_sharpness, cage->crease_count),
             vertex_sharpness = sharpness(cage->vertex_sharpness, cage->sharp_count);
  Far::TopologyDescriptor topology;
  topology.numVertices = static_cast<int>(cage->vertex_count);
  topology.numFaces = static_cast<int>(cage->face_count);
  topology.numVertsPerFace = sizes.data();
  topology.vertIndicesPerFace = corners.data();
  topology.numCreases = static_cast<int>(cage->crease_count);
  topology.creaseVertexIndexPairs = creases.data();
  topology.creaseWeights = crease_sharpness.data();
  topology.numCorners = static_cast<int>(cage->sharp_count);
  topology.cornerVertexIndices = sharp.data();
  topology.cornerWeights = vertex_sharpness.data();
  topology.numHoles = static_cast<int>(cage->hole_count);
  topology.holeIndices = holes.data();
  using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
  return std::unique_ptr<Far::TopologyRefiner>(
      Factory::Create(topology, Factory::Options(scheme_of(cage), options_of(cage))));
}

/* The limits of the vertices of the deepest level, and a bound of their error: limit masks treat semi-sharp edges as
 * infinitely sharp, but the true limit of such a vertex is within the hull of its neighbours. */
std::vector<Point> limits_of(const Far::TopologyRefiner &refiner, const qmat_cage *cage, double *unresolved) {
  const Far::PrimvarRefinerReal<double> primvar(refiner);
  std::vector<Point> points(cage->vertex_count), finer;
  for (size_t i = 0; i < cage->vertex_count; i++) std::copy_n(cage->positions + 3 * i, 3, points[i].x);
  const int depth = refiner.GetMaxLevel();
  for (int level = 1; level <= depth; level++) {
    finer.assign(static_cast<size_t>(refiner.GetLevel(level).GetNumVertices()), Point{});
    primvar.Interpolate(level, points, finer);
    points.swap(finer);
  }
  finer.assign(points.size(), Point{});
  primvar.Limit(points, finer);
  const Far::TopologyLevel &last = refiner.GetLevel(depth);
  for (int v = 0; v < last.GetNumVertices(); v++) {
    const auto edges = last.GetVertexEdges(v);
    bool semi_sharp = last.IsVertexSemiSharp(v);
    for (int k = 0; k < edges.size(); k++) semi_sharp = semi_sharp || last.IsEdgeSemiSharp(edges[k]);
    for (int k = 0; k < edges.size() && semi_sharp; k++) {
      for (const int end : {0, 1}) {
        const int other = last.GetEdgeVertices(edges[k])[end];
        *unresolved =
            std::max(*unresolved, distance(points[static_cast<size_t>(v)], points[static_cast<size_t>(other)]));
      }
    }
  }
  return finer;
}

/* The vertices of the deepest level that descend from those of `level`. */
std::vector<int> descendants(const Far::TopologyRefiner &refiner, int level) {
  std::vector<int> result(static_cast<size_t>(refiner.GetLevel(level).GetNumVertices()));
  for (size_t v = 0; v < result.size(); v++) {
    int vertex = static_cast<int>(v);
    for (int k = level; k < refiner.GetMaxLevel(); k++) vertex = refiner.GetLevel(k).GetVertexChildVertex(vertex);
    result[v] = vertex;
  }
  return result;
}

/* The faces that stand for one face of a cage: where quads are wanted, other polygons become fans. */
size_t fan_size(int corners, bool quads) {
  return quads && corners != 4 ? static_cast<size_t>(corners) : 1;
}

/* Adds the triangles between the edges of a face and the limit of its centre. */
void add_fan(const Far::TopologyLevel &coarse, int face, qmat_limit_level *limit) {
  const auto corners = coarse.GetFaceVertices(face), edges = coarse.GetFaceEdges(face);
  const auto centre = static_cast<uint32_t>(coarse.GetFaceChildVertex(face));
  for (int k = 0; k < corners.size(); k++) {
    uint32_t *ids = limit->faces + limit->face_stride * limit->face_count++;
    ids[0] = static_cast<uint32_t>(coarse.GetVertexChildVertex(corners[k]));
    ids[1] = static_cast<uint32_t>(coarse.GetVertexChildVertex(corners[(k + 1) % corners.size()]));
    ids[2] = ids[3] = centre;
    std::fill(ids + 4, ids + limit->face_stride, static_cast<uint32_t>(coarse.GetEdgeChildVertex(edges[k])));
  }
}

qmat_status fill(qmat_context *context, const Far::TopologyRefiner &refiner, const std::vector<Point> &limits,
                 int level, qmat_limit_level *limit) {
  const Far::TopologyLevel &coarse = refiner.GetLevel(level);
  const std::vector<int> places = descendants(refiner, level + 1);
  const int faces = coarse.GetNumFaces();
  const bool quads = refiner.GetSchemeType() != Sdc::SCHEME_LOOP;
  limit->face_size = quads ? 4 : 3;
  limit->face_stride = quads ? 9 : 6;
  limit->position_count = places.size();
  limit->positions = static_cast<double *>(qmat_alloc(places.size(), 3 * sizeof(double)));
  size_t most = 0;
  for (int f = 0; f < faces; f++) most += fan_size(coarse.GetFaceVertices(f).size(), quads);
  limit->faces = static_cast<uint32_t *>(qmat_alloc(most * limit->face_stride, sizeof(uint32_t)));
  if (!limit->positions || !limit->faces) return qmat_fail_memory(context, "the limit surface");
  for (size_t i = 0; i < places.size(); i++)
    std::copy_n(limits[static_cast<size_t>(places[i])].x, 3, limit->positions + 3 * i);
  const int size = static_cast<int>(limit->face_size);
  for (int f = 0; f < faces; f++) {
    if (coarse.IsFaceHole(f)) continue;
    const auto corners = coarse.GetFaceVertices(f), edges = coarse.GetFaceEdges(f);
    if (fan_size(corners.size(), quads) > 1) {
      add_fan(coarse, f, limit);
      continue;
    }
    uint32_t *ids = limit->faces + limit->face_stride * limit->face_count++;
    for (int k = 0; k < size; k++) {
      ids[k] = static_cast<uint32_t>(coarse.GetVertexChildVertex(corners[k]));
      ids[size + k] = static_cast<uint32_t>(coarse.GetEdgeChildVertex(edges[k]));
    }
    if (quads) ids[2 * size] = static_cast<uint32_t>(coarse.GetFaceChildVertex(f));
  }
  return QMAT_OK;
}

qmat_status make(qmat_context *context, const qmat_cage *cage, int level, int depth, qmat_limit_level *limit) {
  capture_messages();
  const std::unique_ptr<Far::TopologyRefiner> refiner = refiner_of(cage);
  if (!refiner) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "OpenSubdiv rejects the cage%s%s", message[0] ? ": " : "", message);
    return qmat_fail_field(context, "mesh");
  }
  const Far::TopologyLevel &base = refiner->GetLevel(0);
  for (size_t i = 0; i < cage->crease_count; i++) {
    const auto a = static_cast<int>(cage->creases[2 * i]), b = static_cast<int>(cage->creases[2 * i + 1]);
    if (base.FindEdge(a, b) < 0) limit->creases_without_edge++;
  }
  Far::TopologyRefiner::UniformOptions options(depth);
  options.fullTopologyInLastLevel = true;
  qmat_status status = qmat_progress(context, 0, 0, "levels");
  if (status != QMAT_OK) return status;
  refiner->RefineUniform(options);
  status = qmat_progress(context, 0, 0, "levels");
  if (status != QMAT_OK) return status;
  return fill(context, *refiner, limits_of(*refiner, cage, &limit->unresolved), level, limit);
}

}  // namespace

qmat_status qmat_limit_level_make(qmat_context *context, const qmat_cage *cage, int level, int depth,
                                  qmat_limit_level *limit) {
  *limit = {};
  qmat_status status;
  try {
    status = make(context, cage, level, depth, limit);
  } catch (const std::bad_alloc &) {
    status = qmat_fail_memory(context, "the limit surface");
  } catch (const std::exception &failure) {
    status = qmat_fail(context, QMAT_ERROR_DEPENDENCY, "OpenSubdiv: %s", failure.what());
  } catch (...) {
    status = qmat_fail(context, QMAT_ERROR_INTERNAL, "the subdivision failed in an unknown way");
  }
  if (status != QMAT_OK) qmat_limit_level_uninit(limit);
  return status;
}

#define QMAT_TEXT(number) #number
#define QMAT_VERSION_TEXT(major, minor, patch) QMAT_TEXT(major) "." QMAT_TEXT(minor) "." QMAT_TEXT(patch)

const char *qmat_opensubdiv_version(void) {
  return QMAT_VERSION_TEXT(OPENSUBDIV_VERSION_MAJOR, OPENSUBDIV_VERSION_MINOR, OPENSUBDIV_VERSION_PATCH);
}

void qmat_limit_level_uninit(qmat_limit_level *limit) {
  qmat_free(limit->positions);
  qmat_free(limit->faces);
  *limit = {};
}
