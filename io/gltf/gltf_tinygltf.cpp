/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream> /* tiny_gltf.h needs it but does not include it under TINYGLTF_NO_FS */
#include <limits>
#include <map>
#include <memory>
#include <new>
#include <string>
#include <vector>

/* tinygltf only converts the checked JSON to its model. It handles no buffers, files, Draco data or images: its own
 * Draco code ignores failures, overruns its stack on attributes of more than 4 components, and leaves the second of two
 * primitives that share a buffer view empty. Debian's libtinygltf has no Draco. The namespace is renamed because
 * libdraco exports another copy of tinygltf. */
#define tinygltf qmat_tinygltf
#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#define TINYGLTF_NO_FS
#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif
#include <tiny_gltf.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

#include "core/geometry/joint_weights.h"
#include "io/draco_draco.h"
#include "io/gltf/gltf_tinygltf.h"
#include "io/placement.h"
#include "io/stretch.h"

namespace {

using Matrix = std::array<double, 16>; /* column-major, as in glTF */

/* Thrown after the error is recorded in the context. */
struct Failed {
  qmat_status status;
};

void must(qmat_status status) {
  if (status != QMAT_OK) throw Failed{status};
}

/* A primitive as stored: local positions, triangles and joint weights. */
struct Shape {
  std::vector<double> positions;
  std::vector<uint32_t> corners;
  size_t sets = 0;             /* number of sets; each has 4 joints per vertex */
  std::vector<double> joints;  /* 4 * vertices per set, one set after the other */
  std::vector<double> weights; /* the same */
};

constexpr Matrix kIdentity = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

Matrix multiply(const Matrix &a, const Matrix &b) {
  Matrix product{};
  for (size_t column = 0; column < 4; column++) {
    for (size_t row = 0; row < 4; row++) {
      double sum = 0;
      for (size_t k = 0; k < 4; k++) sum += a[4 * k + row] * b[4 * column + k];
      product[4 * column + row] = sum;
    }
  }
  return product;
}

/* Adds weight * (m * point) to `to`. */
void add_transformed(const Matrix &m, const double *point, double weight, double *to) {
  for (size_t row = 0; row < 3; row++)
    to[row] += weight * (m[row] * point[0] + m[4 + row] * point[1] + m[8 + row] * point[2] + m[12 + row]);
}

bool mirrors(const Matrix &m) {
  return m[0] * (m[5] * m[10] - m[9] * m[6]) - m[4] * (m[1] * m[10] - m[9] * m[2]) +
             m[8] * (m[1] * m[6] - m[5] * m[2]) <
         0;
}

Matrix local_matrix(const qmat_tinygltf::Node &node) {
  Matrix m = kIdentity;
  if (node.matrix.size() == 16) {
    std::copy(node.matrix.begin(), node.matrix.end(), m.begin());
    return m;
  }
  if (node.rotation.size() == 4) {
    double axes[3][3];
    qmat_placement_turn(node.rotation.data(), axes);
    for (size_t k = 0; k < 3; k++)
      for (size_t row = 0; row < 3; row++) m[4 * k + row] = axes[k][row];
  }
  for (size_t k = 0; k < 3; k++) {
    const double scale = node.scale.size() == 3 ? node.scale[k] : 1;
    for (size_t row = 0; row < 3; row++) m[4 * k + row] *= scale;
    if (node.translation.size() == 3) m[12 + k] = node.translation[k];
  }
  return m;
}

template <typename T>
double load(const uint8_t *from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return static_cast<double>(value);
}

double component_at(const uint8_t *from, int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return load<int8_t>(from);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return load<uint8_t>(from);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return load<int16_t>(from);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return load<uint16_t>(from);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return load<uint32_t>(from);
    default:
      return load<float>(from);
  }
}

/* The integer that means 1 in a normalised type; 0 for types that cannot be normalised. */
double normalised_one(int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return 127;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return 255;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return 32767;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return 65535;
    default:
      return 0;
  }
}

class Reader {
 public:
  Reader(qmat_context *context, const qmat_tinygltf::Model &model, const qmat_gltf_bytes *buffers, size_t most,
         qmat_gltf_sink *sink, void *user, qmat_gltf_counts *counts)
      : context_(context), model_(model), buffers_(buffers), most_(most), sink_(sink), user_(user), counts_(counts) {}

  void read_scene() {
    find_globals();
    for (const qmat_tinygltf::Mesh &mesh : model_.meshes) shapes_.emplace_back(mesh.primitives.size());
    std::vector<int> stack(model_.scenes.at(0).nodes.rbegin(), model_.scenes[0].nodes.rend());
    size_t done = 0;
    while (!stack.empty()) {
      const size_t id = static_cast<size_t>(stack.back());
      stack.pop_back();
      const qmat_tinygltf::Node &node = model_.nodes[id];
      must(qmat_progress(context_, done++, model_.nodes.size(), "nodes"));
      if (node.mesh >= 0) place_mesh(node, globals_[id]);
      stack.insert(stack.end(), node.children.rbegin(), node.children.rend());
    }
  }

  void read_meshes(const uint32_t *meshes, size_t count, double *scales) {
    find_globals();
    for (which_ = 0; which_ < count; which_++) {
      must(qmat_progress(context_, which_, count, "meshes"));
      const qmat_tinygltf::Mesh &mesh = model_.meshes[meshes[which_]];
      scales[which_] = scale_of(meshes[which_]);
      const std::vector<double> &weights = weights_of(meshes[which_]);
      for (const qmat_tinygltf::Primitive &primitive : mesh.primitives) {
        if (primitive.attributes.empty()) {
          counts_->primitives_skipped++;
          continue;
        }
        counts_->primitives_read++;
        const std::unique_ptr<Shape> shape = read_shape(primitive);
        check_room(shape->positions.size() / 3, shape->corners.size() / 3);
        world_ = shape->positions;
        add_targets(primitive, weights, world_);
        find_joints(*shape, joint_count_of(meshes[which_]));
        emit(*shape);
      }
    }
  }

 private:
  /* Computes world transforms of all nodes, because joints may lie outside the scene. */
  void find_globals() {
    const size_t count = model_.nodes.size();
    globals_.assign(count, kIdentity);
    std::vector<int> parents(count, -1), order;
    for (size_t i = 0; i < count; i++) {
      for (const int child : model_.nodes[i].children) parents[static_cast<size_t>(child)] = static_cast<int>(i);
    }
    for (size_t i = 0; i < count; i++) {
      if (parents[i] < 0) order.push_back(static_cast<int>(i));
    }
    for (size_t at = 0; at < order.size(); at++) {
      const size_t id = static_cast<size_t>(order[at]);
      const Matrix local = local_matrix(model_.nodes[id]);
      globals_[id] = parents[id] < 0 ? local : multiply(globals_[static_cast<size_t>(parents[id])], local);
      order.insert(order.end(), model_.nodes[id].children.begin(), model_.nodes[id].children.end());
    }
  }

  [[noreturn]] void fail(const char *kind, size_t element) {
    throw Failed{qmat_fail_element(context_, kind, static_cast<int64_t>(element))};
  }

  void check_room(size_t vertices, size_t triangles) {
    if (vertices <= most_ - vertices_ && triangles <= most_ - triangles_) return;
    throw Failed{qmat_fail(context_, QMAT_ERROR_GEOMETRY,
                           "the meshes have more than %zu vertices or triangles, too many for the size of the asset",
                           most_)};
  }

  const uint8_t *view_bytes(int id) const {
    const qmat_tinygltf::BufferView &view = model_.bufferViews[static_cast<size_t>(id)];
    return buffers_[static_cast<size_t>(view.buffer)].bytes + view.byteOffset;
  }

  /* All numbers of an accessor. Normalised integers become fractions; with `fractions`, all integers do. */
  std::vector<double> accessor_values(int id, bool fractions) {
    const qmat_tinygltf::Accessor &accessor = model_.accessors[static_cast<size_t>(id)];
    const int type = accessor.componentType;
    const size_t components =
        static_cast<size_t>(qmat_tinygltf::GetNumComponentsInType(static_cast<uint32_t>(accessor.type)));
    const size_t width = static_cast<size_t>(qmat_tinygltf::GetComponentSizeInBytes(static_cast<uint32_t>(type)));
    std::vector<double> values(accessor.count * components);
    if (accessor.bufferView >= 0) {
      const size_t stride = model_.bufferViews[static_cast<size_t>(accessor.bufferView)].byteStride;
      const uint8_t *from = view_bytes(accessor.bufferView) + accessor.byteOffset;
      for (size_t i = 0; i < accessor.count; i++) {
        const uint8_t *element = from + i * (stride > 0 ? stride : components * width);
        for (size_t c = 0; c < components; c++) values[i * components + c] = component_at(element + c * width, type);
      }
    }
    if (accessor.sparse.isSparse) {
      const auto &sparse = accessor.sparse;
      const int index_type = sparse.indices.componentType;
      const size_t index_width =
          static_cast<size_t>(qmat_tinygltf::GetComponentSizeInBytes(static_cast<uint32_t>(index_type)));
      const uint8_t *indices = view_bytes(sparse.indices.bufferView) + sparse.indices.byteOffset;
      const uint8_t *from = view_bytes(sparse.values.bufferView) + sparse.values.byteOffset;
      for (size_t i = 0; i < static_cast<size_t>(sparse.count); i++) {
        const size_t element = static_cast<size_t>(component_at(indices + i * index_width, index_type));
        if (element >= accessor.count) {
          qmat_fail(context_, QMAT_ERROR_FORMAT, "sparse index %zu is %zu, but the element count is %zu", i, element,
                    accessor.count);
          fail("accessor", static_cast<size_t>(id));
        }
        for (size_t c = 0; c < components; c++)
          values[element * components + c] = component_at(from + (i * components + c) * width, type);
      }
    }
    normalise(accessor, fractions, values);
    return values;
  }

  static void normalise(const qmat_tinygltf::Accessor &accessor, bool fractions, std::vector<double> &values) {
    const double one = normalised_one(accessor.componentType);
    if (one == 0 || (!accessor.normalized && !fractions)) return;
    for (double &value : values) value = std::max(value / one, -1.0);
  }

  /* The vertex ids that the accessor lists, each below `vertices`. */
  std::vector<uint32_t> read_indices(int id, size_t vertices) {
    const qmat_tinygltf::Accessor &accessor = model_.accessors[static_cast<size_t>(id)];
    check_room(0, accessor.count / 3);
    const std::vector<double> values = accessor_values(id, false);
    std::vector<uint32_t> indices(values.size());
    for (size_t i = 0; i < values.size(); i++) {
      if (values[i] >= static_cast<double>(vertices)) {
        qmat_fail(context_, QMAT_ERROR_FORMAT, "index %zu is %.0f, but the vertex count is %zu", i, values[i],
                  vertices);
        fail("accessor", static_cast<size_t>(id));
      }
      indices[i] = static_cast<uint32_t>(values[i]);
    }
    return indices;
  }

  static void add_triangle(Shape &shape, uint32_t a, uint32_t b, uint32_t c) {
    shape.corners.insert(shape.corners.end(), {a, b, c});
  }

  static bool same_place(const Shape &shape, uint32_t a, uint32_t b) {
    return std::equal(&shape.positions[3 * size_t{a}], &shape.positions[3 * size_t{a}] + 3,
                      &shape.positions[3 * size_t{b}]);
  }

  /* Adds the triangles of a list, strip or fan, except degenerate triangles of strips. */
  static void add_triangles(Shape &shape, int mode, const std::vector<uint32_t> &v) {
    if (mode == TINYGLTF_MODE_TRIANGLES) {
      shape.corners.assign(v.begin(), v.end() - static_cast<std::ptrdiff_t>(v.size() % 3));
      return;
    }
    for (size_t i = 0; i + 2 < v.size(); i++) {
      if (mode == TINYGLTF_MODE_TRIANGLE_FAN) {
        add_triangle(shape, v[i + 1], v[i + 2], v[0]);
        continue;
      }
      const uint32_t a = v[i], b = v[i + 1 + i % 2], c = v[i + 2 - i % 2];
      if (!same_place(shape, a, b) && !same_place(shape, b, c) && !same_place(shape, a, c))
        add_triangle(shape, a, b, c);
    }
  }

  using DracoMesh = std::unique_ptr<qmat_draco_mesh, void (*)(qmat_draco_mesh *)>;

  DracoMesh open_draco(int view_id) {
    const qmat_tinygltf::BufferView &view = model_.bufferViews[static_cast<size_t>(view_id)];
    qmat_draco_mesh *mesh = nullptr;
    const qmat_status status = qmat_draco_mesh_new(context_, view_bytes(view_id), view.byteLength, &mesh);
    if (status != QMAT_OK) fail("bufferView", static_cast<size_t>(view_id));
    return DracoMesh(mesh, qmat_draco_mesh_free);
  }

  /* An attribute's values: from the Draco data if `unique_ids` has its name, else from its accessor. */
  std::vector<double> attribute_values(const std::string &name, int accessor_id, const qmat_draco_mesh *draco,
                                       const std::map<std::string, int> &unique_ids, bool fractions) {
    const qmat_tinygltf::Accessor &accessor = model_.accessors[static_cast<size_t>(accessor_id)];
    if (draco && accessor.count != qmat_draco_mesh_point_count(draco)) {
      qmat_fail(context_, QMAT_ERROR_FORMAT, "has %zu elements, but the Draco data have %zu points", accessor.count,
                qmat_draco_mesh_point_count(draco));
      fail("accessor", static_cast<size_t>(accessor_id));
    }
    const auto unique_id = unique_ids.find(name);
    if (unique_id == unique_ids.end()) return accessor_values(accessor_id, fractions);
    const int components = qmat_tinygltf::GetNumComponentsInType(static_cast<uint32_t>(accessor.type));
    std::vector<double> values(accessor.count * static_cast<size_t>(components));
    const qmat_status status =
        qmat_draco_mesh_attribute(context_, draco, static_cast<uint32_t>(unique_id->second), components, values.data());
    if (status != QMAT_OK) fail("accessor", static_cast<size_t>(accessor_id));
    normalise(accessor, fractions, values);
    return values;
  }

  std::unique_ptr<Shape> read_shape(const qmat_tinygltf::Primitive &primitive) {
    auto shape = std::make_unique<Shape>();
    const int position = primitive.attributes.at("POSITION");
    DracoMesh draco(nullptr, qmat_draco_mesh_free);
    std::map<std::string, int> unique_ids;
    const auto extension = primitive.extensions.find("KHR_draco_mesh_compression");
    if (extension != primitive.extensions.end()) {
      draco = open_draco(extension->second.Get("bufferView").GetNumberAsInt());
      const qmat_tinygltf::Value &ids = extension->second.Get("attributes");
      for (const std::string &name : ids.Keys()) unique_ids[name] = ids.Get(name).GetNumberAsInt();
    }
    if (!draco) check_room(model_.accessors[static_cast<size_t>(position)].count, 0);
    shape->positions = attribute_values("POSITION", position, draco.get(), unique_ids, false);
    const size_t vertices = shape->positions.size() / 3;
    if (draco) {
      check_room(0, qmat_draco_mesh_face_count(draco.get()));
      shape->corners.resize(3 * qmat_draco_mesh_face_count(draco.get()));
      qmat_draco_mesh_faces(draco.get(), shape->corners.data());
    } else if (primitive.indices >= 0) {
      add_triangles(*shape, primitive.mode, read_indices(primitive.indices, vertices));
    } else {
      std::vector<uint32_t> all(vertices);
      for (size_t i = 0; i < vertices; i++) all[i] = static_cast<uint32_t>(i);
      add_triangles(*shape, primitive.mode, all);
    }
    for (;; shape->sets++) {
      const std::string number = std::to_string(shape->sets);
      const auto joints = primitive.attributes.find("JOINTS_" + number);
      const auto weights = primitive.attributes.find("WEIGHTS_" + number);
      if (joints == primitive.attributes.end() || weights == primitive.attributes.end()) break;
      const auto j = attribute_values(joints->first, joints->second, draco.get(), unique_ids, false);
      const auto w = attribute_values(weights->first, weights->second, draco.get(), unique_ids, true);
      shape->joints.insert(shape->joints.end(), j.begin(), j.end());
      shape->weights.insert(shape->weights.end(), w.begin(), w.end());
    }
    return shape;
  }

  void add_targets(const qmat_tinygltf::Primitive &primitive, const std::vector<double> &weights,
                   std::vector<double> &positions) {
    for (size_t t = 0; t < primitive.targets.size() && t < weights.size(); t++) {
      const auto target = primitive.targets[t].find("POSITION");
      if (weights[t] == 0 || target == primitive.targets[t].end()) continue;
      const std::vector<double> moves = accessor_values(target->second, false);
      for (size_t i = 0; i < positions.size(); i++) positions[i] += weights[t] * moves[i];
    }
  }

  /* The skinning matrix of each joint: world transform * inverse bind matrix. */
  std::vector<Matrix> joint_matrices(const qmat_tinygltf::Skin &skin) {
    std::vector<double> inverse;
    if (skin.inverseBindMatrices >= 0) inverse = accessor_values(skin.inverseBindMatrices, false);
    std::vector<Matrix> matrices;
    for (size_t i = 0; i < skin.joints.size(); i++) {
      Matrix bind = kIdentity;
      if (!inverse.empty()) std::copy_n(inverse.begin() + static_cast<std::ptrdiff_t>(16 * i), 16, bind.begin());
      matrices.push_back(multiply(globals_[static_cast<size_t>(skin.joints[i])], bind));
    }
    return matrices;
  }

  /* The largest length that the nodes of a mesh, or its joints, make of a unit, to six digits. */
  /* The weights of the targets that the nodes with the mesh have; where these differ, those of the mesh. */
  const std::vector<double> &weights_of(size_t mesh) {
    const std::vector<double> &own = model_.meshes[mesh].weights, *common = nullptr;
    for (const qmat_tinygltf::Node &node : model_.nodes) {
      if (node.mesh != static_cast<int>(mesh)) continue;
      const std::vector<double> &weights = node.weights.empty() ? own : node.weights;
      if (!common) common = &weights;
      if (*common == weights) continue;
      counts_->meshes_of_several_weights++;
      return own;
    }
    return common ? *common : own;
  }

  double scale_of(size_t mesh) {
    double scale = 0;
    for (size_t i = 0; i < model_.nodes.size(); i++) {
      const qmat_tinygltf::Node &node = model_.nodes[i];
      if (node.mesh != static_cast<int>(mesh)) continue;
      if (node.skin < 0) {
        scale = std::max(scale, qmat_largest_stretch(globals_[i].data()));
        continue;
      }
      for (const Matrix &m : joint_matrices(model_.skins[static_cast<size_t>(node.skin)]))
        scale = std::max(scale, qmat_largest_stretch(m.data()));
    }
    return scale > 0 && std::isfinite(scale) ? qmat_rounded_stretch(scale) : 1;
  }

  /* The number of joints that every skin of the mesh has; 0: it has none. */
  size_t joint_count_of(size_t mesh) const {
    size_t least = 0;
    for (const qmat_tinygltf::Node &node : model_.nodes) {
      if (node.mesh != static_cast<int>(mesh) || node.skin < 0) continue;
      const size_t count = model_.skins[static_cast<size_t>(node.skin)].joints.size();
      least = least == 0 ? count : std::min(least, count);
    }
    return least;
  }

  /* The strongest joints of each vertex of all sets. Those that the skin does not have are left out, as in engines. */
  void find_joints(const Shape &shape, size_t joint_count) {
    joints_.clear();
    weights_.clear();
    if (shape.sets == 0 || joint_count == 0) return;
    const size_t vertices = shape.positions.size() / 3;
    joints_.resize(4 * vertices);
    weights_.resize(4 * vertices);
    std::vector<uint32_t> joints(4 * shape.sets);
    std::vector<double> weights(4 * shape.sets);
    for (size_t v = 0; v < vertices; v++) {
      for (size_t i = 0; i < joints.size(); i++) {
        const size_t from = 4 * (i / 4 * vertices + v) + i % 4;
        const bool exists = shape.joints[from] >= 0 && shape.joints[from] < static_cast<double>(joint_count);
        joints[i] = exists ? static_cast<uint32_t>(shape.joints[from]) : 0;
        weights[i] = exists ? shape.weights[from] : 0;
      }
      qmat_strongest_joints(joints.data(), weights.data(), joints.size(), &joints_[4 * v], &weights_[4 * v]);
    }
  }

  void apply_skin(const Shape &shape, size_t skin_id, const std::vector<double> &local) {
    const std::vector<Matrix> matrices = joint_matrices(model_.skins[skin_id]);
    const size_t vertices = local.size() / 3;
    for (size_t i = 0; i < vertices; i++) {
      double total = 0, sum[3] = {0, 0, 0};
      for (size_t s = 0; s < shape.sets; s++) {
        for (size_t k = 4 * (s * vertices + i); k < 4 * (s * vertices + i) + 4; k++) {
          if (shape.weights[k] == 0) continue;
          if (!(shape.joints[k] >= 0 && shape.joints[k] < static_cast<double>(matrices.size()))) {
            qmat_fail(context_, QMAT_ERROR_FORMAT, "vertex %zu of the mesh uses joint %.0f, but the joint count is %zu",
                      i, shape.joints[k], matrices.size());
            fail("skin", skin_id);
          }
          add_transformed(matrices[static_cast<size_t>(shape.joints[k])], &local[3 * i], shape.weights[k], sum);
          total += shape.weights[k];
        }
      }
      /* Quantised weights do not sum to exactly 1. A vertex without weights follows the first joint. */
      if (total == 0) {
        total = 1;
        add_transformed(matrices[0], &local[3 * i], total, sum);
      }
      for (size_t k = 0; k < 3; k++) world_[3 * i + k] = sum[k] / total;
    }
    mirrored_ = std::all_of(matrices.begin(), matrices.end(), mirrors);
  }

  void place_mesh(const qmat_tinygltf::Node &node, const Matrix &global) {
    const size_t mesh_id = static_cast<size_t>(node.mesh);
    const qmat_tinygltf::Mesh &mesh = model_.meshes[mesh_id];
    const std::vector<double> &weights = node.weights.empty() ? mesh.weights : node.weights;
    bool skinned = false;
    for (size_t p = 0; p < mesh.primitives.size(); p++) {
      const qmat_tinygltf::Primitive &primitive = mesh.primitives[p];
      if (primitive.attributes.empty()) {
        counts_->primitives_skipped++;
        continue;
      }
      counts_->primitives_read++;
      std::unique_ptr<Shape> &shape = shapes_[mesh_id][p];
      if (!shape) shape = read_shape(primitive);
      check_room(shape->positions.size() / 3, shape->corners.size() / 3);
      std::vector<double> local = shape->positions;
      add_targets(primitive, weights, local);
      world_.assign(local.size(), 0);
      if (node.skin >= 0 && shape->sets > 0) {
        apply_skin(*shape, static_cast<size_t>(node.skin), local);
        skinned = true;
      } else {
        for (size_t i = 0; i < local.size(); i += 3) add_transformed(global, &local[i], 1, &world_[i]);
        mirrored_ = mirrors(global);
      }
      emit(*shape);
    }
    counts_->meshes_placed++;
    if (skinned) counts_->meshes_skinned++;
  }

  void emit(const Shape &shape) {
    const std::vector<uint32_t> *corners = &shape.corners;
    if (mirrored_) {
      reversed_ = shape.corners;
      for (size_t i = 0; i + 2 < reversed_.size(); i += 3) std::swap(reversed_[i + 1], reversed_[i + 2]);
      corners = &reversed_;
    }
    must(sink_(user_, which_, world_.data(), world_.size() / 3, corners->data(), corners->size() / 3,
               joints_.empty() ? nullptr : joints_.data(), joints_.empty() ? nullptr : weights_.data()));
    vertices_ += world_.size() / 3;
    triangles_ += corners->size() / 3;
  }

  qmat_context *context_;
  const qmat_tinygltf::Model &model_;
  const qmat_gltf_bytes *buffers_;
  size_t most_;
  qmat_gltf_sink *sink_;
  void *user_;
  qmat_gltf_counts *counts_;
  std::vector<Matrix> globals_;
  std::vector<std::vector<std::unique_ptr<Shape>>> shapes_; /* by mesh and primitive, read when first placed */
  size_t which_ = 0;                                        /* index among the requested meshes */
  std::vector<double> world_;
  std::vector<uint32_t> reversed_, joints_; /* joints and weights: 4 a vertex, or empty */
  std::vector<double> weights_;
  bool mirrored_ = false; /* whether the transform mirrors: triangles are reversed */
  size_t vertices_ = 0, triangles_ = 0;
};

}  // namespace

qmat_status qmat_gltf_triangles(qmat_context *context, const char *text, size_t text_length,
                                const qmat_gltf_bytes *buffers, size_t most, const uint32_t *meshes, size_t mesh_count,
                                double *scales, qmat_gltf_sink *sink, void *user, qmat_gltf_counts *counts) {
  *counts = {};
  try {
    if (text_length > std::numeric_limits<unsigned int>::max()) return qmat_fail_memory(context, "the JSON of a glTF");
    qmat_tinygltf::Model model;
    qmat_tinygltf::TinyGLTF loader;
    std::string errors, warnings;
    if (!loader.LoadASCIIFromString(&model, &errors, &warnings, text, static_cast<unsigned int>(text_length), ""))
      return qmat_fail(context, QMAT_ERROR_DEPENDENCY, "tinygltf: %s", errors.c_str());
    Reader reader(context, model, buffers, most, sink, user, counts);
    if (meshes) {
      reader.read_meshes(meshes, mesh_count, scales);
    } else {
      reader.read_scene();
    }
    return QMAT_OK;
  } catch (const Failed &failed) {
    return failed.status;
  } catch (const std::bad_alloc &) {
    return qmat_fail_memory(context, "a glTF asset");
  } catch (const std::exception &e) {
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "reading glTF: %s", e.what());
  } catch (...) {
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "reading glTF: an unknown exception");
  }
}
