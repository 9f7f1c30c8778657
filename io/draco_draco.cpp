/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <string>
#include <utility>

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#endif
#include <draco/compression/decode.h>
#include <draco/compression/expert_encode.h>
#include <draco/core/varint_decoding.h>
#include <draco/mesh/mesh.h>
#include <draco/metadata/metadata_decoder.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

extern "C" {
#include "core/arena.h"
}
#include "io/draco_draco.h"

struct qmat_draco_mesh {
  std::unique_ptr<draco::Mesh> mesh;
};

namespace {

/* Draco's entropy coder stores many equal values in few bytes, so the counts have no exact bound. We allow kFreeCount
 * faces and points, plus kCountPerByte of each per byte of data. */
constexpr uint64_t kFreeCount = 1u << 16;
constexpr uint64_t kCountPerByte = 1024;

/* Draco's entropy coder counts symbols in a table of 2^(bits + 1) numbers: 4 GiB for 30 bits. Above this number of
 * bits, where the low bits are mostly noise, values are stored without entropy coding. */
constexpr int kMostCodedBits = 20;

/* Converts the current exception to a status. Call it in a catch block. */
qmat_status caught(qmat_context *context, const char *what) {
  try {
    throw;
  } catch (const std::bad_alloc &) {
    return qmat_fail_memory(context, what);
  } catch (const std::exception &e) {
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "%s: %s", what, e.what());
  } catch (...) {
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "%s: an unknown exception", what);
  }
}

/* Reads the counts in the header and rejects counts that are too large for the size of the data. */
qmat_status check_header(qmat_context *context, const uint8_t *bytes, size_t size) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char *>(bytes), size);
  char magic[5];
  uint8_t major = 0, minor = 0, type = 0, method = 0;
  uint16_t flags = 0;
  if (!buffer.Decode(magic, sizeof magic) || std::memcmp(magic, "DRACO", sizeof magic) != 0)
    return qmat_fail(context, QMAT_ERROR_FORMAT, "not Draco data: it does not start with \"DRACO\"");
  if (!buffer.Decode(&major) || !buffer.Decode(&minor) || !buffer.Decode(&type) || !buffer.Decode(&method) ||
      !buffer.Decode(&flags)) {
    return qmat_fail(context, QMAT_ERROR_FORMAT, "Draco data ends within its header");
  }
  if (major != 2 || minor != 2) {
    return qmat_fail(context, QMAT_ERROR_FORMAT, "Draco bitstream version %u.%u is not supported; glTF asks for 2.2",
                     major, minor);
  }
  if (type != draco::TRIANGULAR_MESH)
    return qmat_fail(context, QMAT_ERROR_FORMAT, "Draco data holds a point cloud, not a triangle mesh");
  if (method != draco::MESH_SEQUENTIAL_ENCODING && method != draco::MESH_EDGEBREAKER_ENCODING)
    return qmat_fail(context, QMAT_ERROR_FORMAT, "Draco data has the unknown mesh encoding %u", method);
  buffer.set_bitstream_version(draco::kDracoMeshBitstreamVersion);
  if (flags & METADATA_FLAG_MASK) {
    draco::GeometryMetadata metadata;
    draco::MetadataDecoder decoder;
    if (!decoder.DecodeGeometryMetadata(&buffer, &metadata))
      return qmat_fail(context, QMAT_ERROR_FORMAT, "the metadata in the Draco data is damaged");
  }
  uint32_t faces = 0, points = 0;
  bool read;
  if (method == draco::MESH_SEQUENTIAL_ENCODING) {
    read = draco::DecodeVarint(&faces, &buffer) && draco::DecodeVarint(&points, &buffer);
  } else {
    uint8_t traversal = 0;
    read = buffer.Decode(&traversal) && draco::DecodeVarint(&points, &buffer) && draco::DecodeVarint(&faces, &buffer);
  }
  if (!read) return qmat_fail(context, QMAT_ERROR_FORMAT, "Draco data ends within its header");
  uint64_t most = kFreeCount + kCountPerByte * static_cast<uint64_t>(size);
  if (faces > most || points > most) {
    return qmat_fail(context, QMAT_ERROR_FORMAT, "%zu bytes of Draco data cannot hold %u points and %u faces", size,
                     points, faces);
  }
  if (points == 0 || faces == 0) return qmat_fail(context, QMAT_ERROR_FORMAT, "Draco data holds no faces");
  return QMAT_OK;
}

/* Decodes the data. Checks that every corner is a valid point and that every point has a value of every attribute. */
qmat_status decode(qmat_context *context, const uint8_t *bytes, size_t size, std::unique_ptr<draco::Mesh> &mesh) {
  qmat_status status = check_header(context, bytes, size);
  if (status != QMAT_OK) return status;
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char *>(bytes), size);
  draco::Decoder decoder;
  auto result = decoder.DecodeMeshFromBuffer(&buffer);
  if (!result.ok()) {
    return qmat_fail(context, QMAT_ERROR_FORMAT, "Draco cannot decode the data: %s",
                     result.status().error_msg_string().c_str());
  }
  mesh = std::move(result).value();
  if (!mesh) return qmat_fail(context, QMAT_ERROR_FORMAT, "Draco cannot decode the data");
  const uint32_t points = mesh->num_points();
  if (points == 0 || mesh->num_faces() == 0) return qmat_fail(context, QMAT_ERROR_FORMAT, "Draco data holds no faces");
  for (uint32_t f = 0; f < mesh->num_faces(); f++) {
    for (const draco::PointIndex &corner : mesh->face(draco::FaceIndex(f))) {
      if (corner.value() >= points) {
        qmat_fail(context, QMAT_ERROR_FORMAT, "a corner is point %u, but the Draco data have %u points", corner.value(),
                  points);
        return qmat_fail_element(context, "face", f);
      }
    }
  }
  for (int32_t a = 0; a < mesh->num_attributes(); a++) {
    const draco::PointAttribute *attribute = mesh->attribute(a);
    const int64_t width = attribute->num_components() * draco::DataTypeLength(attribute->data_type());
    bool sound = width > 0 && attribute->buffer() != nullptr && attribute->byte_offset() == 0 &&
                 attribute->byte_stride() >= width &&
                 (attribute->is_mapping_identity() || attribute->indices_map_size() >= points);
    const uint64_t held =
        sound ? attribute->buffer()->data_size() / static_cast<uint64_t>(attribute->byte_stride()) : 0;
    for (uint32_t p = 0; sound && p < points; p++) sound = attribute->mapped_index(draco::PointIndex(p)).value() < held;
    if (!sound) {
      qmat_fail(context, QMAT_ERROR_FORMAT, "some points have no value of this attribute in the Draco data");
      return qmat_fail_element(context, "attribute", static_cast<int64_t>(attribute->unique_id()));
    }
  }
  return QMAT_OK;
}

template <typename T>
void copy_values(const draco::Mesh &mesh, const draco::PointAttribute &attribute, size_t components, double *values) {
  const uint8_t *data = attribute.buffer()->data();
  for (uint32_t p = 0; p < mesh.num_points(); p++) {
    const size_t index = attribute.mapped_index(draco::PointIndex(p)).value();
    const uint8_t *from = data + index * static_cast<size_t>(attribute.byte_stride());
    for (size_t c = 0; c < components; c++) {
      T value;
      std::memcpy(&value, from + c * sizeof value, sizeof value);
      values[p * components + c] = static_cast<double>(value);
    }
  }
}

/* Copies an attribute's values; false for an unsupported data type. */
bool attribute_values(const draco::Mesh &mesh, const draco::PointAttribute &attribute, double *values) {
  const size_t components = attribute.num_components();
  switch (attribute.data_type()) {
    case draco::DT_INT8:
      copy_values<int8_t>(mesh, attribute, components, values);
      return true;
    case draco::DT_UINT8:
      copy_values<uint8_t>(mesh, attribute, components, values);
      return true;
    case draco::DT_INT16:
      copy_values<int16_t>(mesh, attribute, components, values);
      return true;
    case draco::DT_UINT16:
      copy_values<uint16_t>(mesh, attribute, components, values);
      return true;
    case draco::DT_INT32:
      copy_values<int32_t>(mesh, attribute, components, values);
      return true;
    case draco::DT_UINT32:
      copy_values<uint32_t>(mesh, attribute, components, values);
      return true;
    case draco::DT_FLOAT32:
      copy_values<float>(mesh, attribute, components, values);
      return true;
    case draco::DT_FLOAT64:
      copy_values<double>(mesh, attribute, components, values);
      return true;
    default:
      return false;
  }
}

draco::GeometryAttribute::Type type_of(qmat_draco_meaning meaning) {
  switch (meaning) {
    case QMAT_DRACO_POSITION:
      return draco::GeometryAttribute::POSITION;
    case QMAT_DRACO_NORMAL:
      return draco::GeometryAttribute::NORMAL;
    case QMAT_DRACO_COLOR:
      return draco::GeometryAttribute::COLOR;
    case QMAT_DRACO_TEXCOORD:
      return draco::GeometryAttribute::TEX_COORD;
    default:
      return draco::GeometryAttribute::GENERIC;
  }
}

draco::DataType data_type_of(qmat_draco_number number) {
  switch (number) {
    case QMAT_DRACO_INT8:
      return draco::DT_INT8;
    case QMAT_DRACO_UINT8:
      return draco::DT_UINT8;
    case QMAT_DRACO_INT16:
      return draco::DT_INT16;
    case QMAT_DRACO_UINT16:
      return draco::DT_UINT16;
    default:
      return draco::DT_FLOAT32;
  }
}

/* Whether Draco can quantise an attribute. It works in single precision: neither the largest range of a component nor
 * the number of steps divided by it may overflow. Draco 1.5 does not check this and writes outside its tables. */
bool can_quantise(const qmat_draco_attribute &given, size_t point_count) {
  const float *values = static_cast<const float *>(given.values);
  const size_t components = static_cast<size_t>(given.components);
  float range = 0;
  for (size_t k = 0; k < components; k++) {
    float low = values[k], high = values[k];
    for (size_t i = 0; i < point_count; i++) {
      const float value = values[components * i + k];
      if (!std::isfinite(value)) return false;
      low = std::min(low, value);
      high = std::max(high, value);
    }
    range = std::max(range, high - low);
  }
  const bool is_direction = given.meaning == QMAT_DRACO_NORMAL; /* not divided by its range */
  return is_direction || range == 0 || (std::isfinite(range) && std::isfinite(std::ldexp(1.0F, given.bits) / range));
}

qmat_status encode(qmat_context *context, const qmat_draco_attribute *attributes, size_t attribute_count,
                   uint32_t point_count, const uint32_t *faces, uint32_t face_count, bool keep_order, uint8_t **bytes,
                   size_t *size) {
  draco::Mesh mesh;
  mesh.set_num_points(point_count);
  for (size_t a = 0; a < attribute_count; a++) {
    const qmat_draco_attribute &given = attributes[a];
    auto attribute = std::make_unique<draco::PointAttribute>();
    const draco::DataType type = data_type_of(given.number);
    attribute->Init(type_of(given.meaning), static_cast<int8_t>(given.components), type, false, point_count);
    attribute->buffer()->Write(
        0, given.values,
        static_cast<size_t>(given.components) * point_count * static_cast<size_t>(draco::DataTypeLength(type)));
    mesh.AddAttribute(std::move(attribute));
  }
  mesh.SetNumFaces(face_count);
  for (uint32_t f = 0; f < face_count; f++) {
    const uint32_t *corner = faces + 3 * static_cast<size_t>(f);
    mesh.SetFace(draco::FaceIndex(f),
                 {draco::PointIndex(corner[0]), draco::PointIndex(corner[1]), draco::PointIndex(corner[2])});
  }

  draco::ExpertEncoder encoder(mesh);
  encoder.SetEncodingMethod(keep_order ? draco::MESH_SEQUENTIAL_ENCODING : draco::MESH_EDGEBREAKER_ENCODING);
  encoder.SetSpeedOptions(3, 3);
  for (size_t a = 0; a < attribute_count; a++) {
    if (attributes[a].number != QMAT_DRACO_FLOAT) continue;
    encoder.SetAttributeQuantization(static_cast<int32_t>(a), attributes[a].bits);
    if (attributes[a].bits > kMostCodedBits) encoder.SetUseBuiltInAttributeCompression(false);
  }
  draco::EncoderBuffer buffer;
  const draco::Status result = encoder.EncodeToBuffer(&buffer);
  if (!result.ok())
    return qmat_fail(context, QMAT_ERROR_DEPENDENCY, "Draco cannot encode: %s", result.error_msg_string().c_str());
  *bytes = static_cast<uint8_t *>(qmat_alloc(buffer.size(), 1));
  if (!*bytes) return qmat_fail_memory(context, "Draco data");
  std::memcpy(*bytes, buffer.data(), buffer.size());
  *size = buffer.size();
  return QMAT_OK;
}

}  // namespace

qmat_status qmat_draco_encode(qmat_context *context, const qmat_draco_attribute *attributes, size_t attribute_count,
                              size_t point_count, const uint32_t *faces, size_t face_count, bool keep_order,
                              uint8_t **bytes, size_t *size) {
  *bytes = nullptr;
  *size = 0;
  constexpr size_t most = std::numeric_limits<uint32_t>::max() / 3;
  if (point_count == 0 || face_count == 0)
    return qmat_fail(context, QMAT_ERROR_USAGE, "Draco cannot encode a mesh without faces");
  if (point_count > most || face_count > most) return qmat_fail_memory(context, "the faces of a Draco mesh");
  for (size_t a = 0; a < attribute_count; a++) {
    const int least = attributes[a].meaning == QMAT_DRACO_NORMAL ? 2 : 1;
    if (attributes[a].number != QMAT_DRACO_FLOAT) continue;
    if (attributes[a].bits < least || attributes[a].bits > 30)
      return qmat_fail(context, QMAT_ERROR_USAGE, "%d quantisation bits: must be %d to 30", attributes[a].bits, least);
    if (!can_quantise(attributes[a], point_count))
      return qmat_fail(context, QMAT_ERROR_DEPENDENCY,
                       "Draco cannot encode attribute %zu: its numbers are not finite, too large or too close together",
                       a);
  }
  try {
    return encode(context, attributes, attribute_count, static_cast<uint32_t>(point_count), faces,
                  static_cast<uint32_t>(face_count), keep_order, bytes, size);
  } catch (...) {
    return caught(context, "encoding with Draco");
  }
}

qmat_status qmat_draco_mesh_new(qmat_context *context, const uint8_t *bytes, size_t size, qmat_draco_mesh **mesh) {
  *mesh = nullptr;
  try {
    auto made = std::make_unique<qmat_draco_mesh>();
    const qmat_status status = decode(context, bytes, size, made->mesh);
    if (status == QMAT_OK) *mesh = made.release();
    return status;
  } catch (...) {
    return caught(context, "decoding a mesh with Draco");
  }
}

void qmat_draco_mesh_free(qmat_draco_mesh *mesh) {
  delete mesh;
}

size_t qmat_draco_mesh_point_count(const qmat_draco_mesh *mesh) {
  return mesh->mesh->num_points();
}

size_t qmat_draco_mesh_face_count(const qmat_draco_mesh *mesh) {
  return mesh->mesh->num_faces();
}

void qmat_draco_mesh_faces(const qmat_draco_mesh *mesh, uint32_t *corners) {
  for (uint32_t f = 0; f < mesh->mesh->num_faces(); f++) {
    const draco::Mesh::Face &face = mesh->mesh->face(draco::FaceIndex(f));
    for (size_t k = 0; k < 3; k++) corners[3 * static_cast<size_t>(f) + k] = face[k].value();
  }
}

bool qmat_draco_mesh_find(const qmat_draco_mesh *mesh, qmat_draco_meaning meaning, int components,
                          uint32_t *unique_id) {
  if (mesh->mesh->NumNamedAttributes(type_of(meaning)) != 1) return false;
  const draco::PointAttribute *attribute = mesh->mesh->GetNamedAttribute(type_of(meaning));
  if (attribute->num_components() != components || attribute->data_type() != draco::DT_FLOAT32) return false;
  *unique_id = attribute->unique_id();
  return true;
}

qmat_status qmat_draco_mesh_attribute(qmat_context *context, const qmat_draco_mesh *mesh, uint32_t unique_id,
                                      int components, double *values) {
  const draco::PointAttribute *attribute = mesh->mesh->GetAttributeByUniqueId(unique_id);
  if (!attribute) return qmat_fail(context, QMAT_ERROR_FORMAT, "the Draco data has no attribute with id %u", unique_id);
  if (attribute->num_components() != components) {
    return qmat_fail(context, QMAT_ERROR_FORMAT, "attribute %u of the Draco data has %d components instead of %d",
                     unique_id, attribute->num_components(), components);
  }
  if (!attribute_values(*mesh->mesh, *attribute, values)) {
    return qmat_fail(context, QMAT_ERROR_FORMAT, "attribute %u of the Draco data has an unsupported number type",
                     unique_id);
  }
  return QMAT_OK;
}
