/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_skin.h"

#include <math.h>
#include <string.h>

#include "core/geometry/triangle.h"
#include "core/node.h"
#include "io/draco.h"
#include "io/gltf/gltf_asset.h"
#include "io/gltf/gltf_compress.h"

enum { NORMAL_BITS = 10, ARRAY_BUFFER = 34962, ELEMENT_ARRAY_BUFFER = 34963 };

/* ---- the data ---- */

/* Writes 3 floats per vertex. QMAT_ERROR_GEOMETRY names the first vertex beyond single precision. */
static qmat_status single_positions(qmat_context *context, const qmat_mesh *skin, const double origin[3],
                                    float *positions) {
  for (size_t i = 0; i < 3 * skin->vertex_count; i++) {
    positions[i] = (float)(skin->positions[i] - origin[i % 3]);
    if (isfinite(positions[i])) continue;
    char number[32];
    qmat_format_number(skin->positions[i], number, sizeof number);
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "%s does not fit into single precision", number);
    qmat_fail_element(context, "vertex", (int64_t)(i / 3));
    return qmat_fail_field(context, "skin");
  }
  return QMAT_OK;
}

/* Writes unit normals, weighted by facet area (a cross product is twice the area long). A vertex with a zero sum gets
 * the z axis because glTF requires unit length. `sums` is scratch memory, 3 zeroed doubles per vertex. */
static void area_normals(const qmat_mesh *skin, double *sums, float *normals) {
  for (size_t t = 0; t < skin->triangle_count; t++) {
    const uint32_t *corner = skin->triangles + 3 * t;
    double normal[3];
    qmat_triangle_normal(skin->positions + 3 * (size_t)corner[0], skin->positions + 3 * (size_t)corner[1],
                         skin->positions + 3 * (size_t)corner[2], normal);
    for (int k = 0; k < 3; k++) {
      for (int axis = 0; axis < 3; axis++) sums[3 * (size_t)corner[k] + (size_t)axis] += normal[axis];
    }
  }
  for (size_t i = 0; i < skin->vertex_count; i++) {
    const double *sum = sums + 3 * i;
    /* Scaling first keeps the squares in range for tiny and huge models. */
    double largest = fmax(fabs(sum[0]), fmax(fabs(sum[1]), fabs(sum[2])));
    float *normal = normals + 3 * i;
    normal[0] = normal[1] = 0;
    normal[2] = 1;
    if (!(largest > 0) || !isfinite(largest)) continue;
    double x = sum[0] / largest, y = sum[1] / largest, z = sum[2] / largest;
    double length = sqrt(x * x + y * y + z * z);
    normal[0] = (float)(x / length);
    normal[1] = (float)(y / length);
    normal[2] = (float)(z / length);
  }
}

/* Appends what is given of the vertices after positions, normals and indices. Joints start at a multiple of 4. */
static void put_vertex_data(size_t vertex_count, const qmat_gltf_vertex_data *more, qmat_gltf_skin *data,
                            qmat_writer *buffer) {
  if (more->colours) {
    data->sizes[QMAT_GLTF_SKIN_COLOURS] = 4 * vertex_count;
    qmat_put_bytes(buffer, more->colours, 4 * vertex_count);
  }
  if (!more->joints) return;
  qmat_gltf_pad(buffer, 0);
  for (size_t i = 0; i < 4 * vertex_count; i++) qmat_put_u16(buffer, (uint16_t)more->joints[i]);
  for (size_t i = 0; i < 4 * vertex_count; i++) qmat_put_f32(buffer, (float)more->weights[i]);
  data->sizes[QMAT_GLTF_SKIN_JOINTS] = 8 * vertex_count;
  data->sizes[QMAT_GLTF_SKIN_WEIGHTS] = 16 * vertex_count;
}

static void put_plain_skin(const qmat_mesh *skin, const float *positions, const float *normals,
                           const qmat_gltf_vertex_data *more, qmat_gltf_skin *data, qmat_writer *buffer) {
  size_t count = 3 * skin->vertex_count;
  data->vertex_count = skin->vertex_count;
  data->index_count = 3 * skin->triangle_count;
  /* The largest value of an index type means "restart", so 16 bits suffice for 65535 vertices. */
  data->wide = skin->vertex_count > 65535;
  for (int k = 0; k < 3; k++) data->min[k] = data->max[k] = positions[k];
  for (size_t i = 0; i < count; i++) {
    data->min[i % 3] = fminf(data->min[i % 3], positions[i]);
    data->max[i % 3] = fmaxf(data->max[i % 3], positions[i]);
    qmat_put_f32(buffer, positions[i]);
  }
  for (size_t i = 0; i < count; i++) qmat_put_f32(buffer, normals[i]);
  for (size_t i = 0; i < data->index_count; i++) {
    if (data->wide) {
      qmat_put_u32(buffer, skin->triangles[i]);
    } else {
      qmat_put_u16(buffer, (uint16_t)skin->triangles[i]);
    }
  }
  data->sizes[0] = data->sizes[1] = count * sizeof(float);
  data->sizes[2] = data->index_count * (data->wide ? 4 : 2);
  put_vertex_data(skin->vertex_count, more, data, buffer);
  for (int i = 1; i < QMAT_GLTF_SKIN_VIEWS; i++) {
    data->offsets[i] = data->offsets[i - 1] + data->sizes[i - 1];
    if (i == QMAT_GLTF_SKIN_JOINTS) data->offsets[i] = (data->offsets[i] + 3) / 4 * 4;
  }
}

static qmat_status put_draco_skin(qmat_context *context, const qmat_mesh *skin, const float *positions,
                                  const float *normals, double allowed, qmat_gltf_skin *data, qmat_writer *buffer) {
  double range = 0;
  float low[3], high[3];
  for (int k = 0; k < 3; k++) low[k] = high[k] = positions[k];
  for (size_t i = 0; i < 3 * skin->vertex_count; i++) {
    low[i % 3] = fminf(low[i % 3], positions[i]);
    high[i % 3] = fmaxf(high[i % 3], positions[i]);
  }
  for (int k = 0; k < 3; k++) range = fmax(range, (double)high[k] - (double)low[k]);
  qmat_draco_skin packed;
  qmat_status status =
      qmat_draco_encode_mesh(context, positions, normals, skin->vertex_count, skin->triangles, skin->triangle_count,
                             qmat_draco_bits_for(3, range, allowed), NORMAL_BITS, &packed);
  if (status != QMAT_OK) return status;
  data->compressed = true;
  data->vertex_count = packed.vertex_count;
  data->index_count = 3 * (size_t)packed.triangle_count;
  data->wide = packed.vertex_count > 65535;
  data->position_id = packed.position_id;
  data->normal_id = packed.normal_id;
  memcpy(data->min, packed.min, sizeof data->min);
  memcpy(data->max, packed.max, sizeof data->max);
  data->sizes[0] = packed.size;
  qmat_put_bytes(buffer, packed.bytes, packed.size);
  qmat_draco_skin_uninit(&packed);
  return QMAT_OK;
}

qmat_status qmat_gltf_skin_put(qmat_context *context, const qmat_mesh *skin, const double origin[3],
                               const qmat_gltf_vertex_data *more, double moved, qmat_gltf_skin *data,
                               qmat_writer *buffer) {
  float *positions = qmat_alloc(skin->vertex_count, 3 * sizeof *positions);
  float *normals = qmat_alloc(skin->vertex_count, 3 * sizeof *normals);
  double *sums = qmat_calloc(skin->vertex_count, 3 * sizeof *sums);
  qmat_status status = positions && normals && sums ? single_positions(context, skin, origin, positions)
                                                    : qmat_fail_memory(context, "the skin");
  if (status == QMAT_OK) {
    area_normals(skin, sums, normals);
    if (skin->deviation > 0) data->error = skin->deviation + moved;
    if (moved > 0) {
      status = put_draco_skin(context, skin, positions, normals, moved, data, buffer);
    } else {
      put_plain_skin(skin, positions, normals, more, data, buffer);
    }
    qmat_gltf_pad(buffer, 0);
    if (status == QMAT_OK && buffer->failed) status = qmat_fail_memory(context, "the skin");
  }
  qmat_free(sums);
  qmat_free(normals);
  qmat_free(positions);
  return status;
}

/* ---- the JSON ---- */

/* json_pack fails on a NULL argument and frees the others, so one check at the end suffices. */

/* The attribute of each view; NULL: it has the indices. */
static const char *const attributes[QMAT_GLTF_SKIN_VIEWS] = {"POSITION", "NORMAL",   NULL,
                                                             "COLOR_0",  "JOINTS_0", "WEIGHTS_0"};

static bool has_view(const qmat_gltf_skin *data, int view) {
  return data->compressed ? view <= QMAT_GLTF_SKIN_INDICES : data->sizes[view] > 0;
}

/* Adds the buffer views of a skin whose data start at `offset`. `*first` gets the number of the first view. */
static bool add_views(json_t *root, const qmat_gltf_skin *data, json_int_t buffer, size_t offset, json_int_t *first) {
  for (int i = 0; i < (data->compressed ? 1 : QMAT_GLTF_SKIN_VIEWS); i++) {
    if (!has_view(data, i)) continue;
    json_int_t number;
    json_t *view = json_pack("{s:I, s:I, s:I}", "buffer", buffer, "byteOffset", (json_int_t)(offset + data->offsets[i]),
                             "byteLength", (json_int_t)data->sizes[i]);
    if (view && !data->compressed &&
        !qmat_gltf_set(view, "target", json_integer(attributes[i] ? ARRAY_BUFFER : ELEMENT_ARRAY_BUFFER))) {
      json_decref(view);
      view = NULL;
    }
    if (!qmat_gltf_add(root, "bufferViews", view, &number)) return false;
    if (i == 0) *first = number;
  }
  return true;
}

static json_t *make_accessor(const qmat_gltf_skin *data, int view) {
  const json_int_t vertices = (json_int_t)data->vertex_count;
  switch (view) {
    case QMAT_GLTF_SKIN_POSITIONS:
      return json_pack("{s:i, s:I, s:s, s:[f,f,f], s:[f,f,f]}", "componentType", QMAT_GLTF_FLOAT, "count", vertices,
                       "type", "VEC3", "min", (double)data->min[0], (double)data->min[1], (double)data->min[2], "max",
                       (double)data->max[0], (double)data->max[1], (double)data->max[2]);
    case QMAT_GLTF_SKIN_NORMALS:
      return json_pack("{s:i, s:I, s:s}", "componentType", QMAT_GLTF_FLOAT, "count", vertices, "type", "VEC3");
    case QMAT_GLTF_SKIN_INDICES:
      return json_pack("{s:i, s:I, s:s}", "componentType",
                       data->wide ? QMAT_GLTF_UNSIGNED_INT : QMAT_GLTF_UNSIGNED_SHORT, "count",
                       (json_int_t)data->index_count, "type", "SCALAR");
    case QMAT_GLTF_SKIN_COLOURS:
      return json_pack("{s:i, s:b, s:I, s:s}", "componentType", QMAT_GLTF_UNSIGNED_BYTE, "normalized", 1, "count",
                       vertices, "type", "VEC4");
    default:
      return json_pack("{s:i, s:I, s:s}", "componentType",
                       view == QMAT_GLTF_SKIN_JOINTS ? QMAT_GLTF_UNSIGNED_SHORT : QMAT_GLTF_FLOAT, "count", vertices,
                       "type", "VEC4");
  }
}

/* Adds the accessors of the views, in their order, and refers to them in the primitive. */
static bool add_accessors(json_t *root, const qmat_gltf_skin *data, json_int_t first_view, json_t *primitive) {
  json_t *named = json_object_get(primitive, "attributes");
  bool done = true;
  json_int_t view = first_view;
  for (int i = 0; i < QMAT_GLTF_SKIN_VIEWS && done; i++) {
    if (!has_view(data, i)) continue;
    json_int_t number;
    json_t *accessor = make_accessor(data, i);
    if (accessor && !data->compressed) done = qmat_gltf_set(accessor, "bufferView", json_integer(view++));
    done = qmat_gltf_add(root, "accessors", accessor, &number) && done;
    done = done && (attributes[i] ? qmat_gltf_set(named, attributes[i], json_integer(number))
                                  : qmat_gltf_set(primitive, "indices", json_integer(number)));
  }
  return done;
}

static bool add_material(json_t *root, bool white, json_int_t *number) {
  if (*number >= 0) return true;
  json_t *material = json_pack("{s:s, s:{s:[f,f,f,f], s:f, s:f}}", "name", "skin", "pbrMetallicRoughness",
                               "baseColorFactor", white ? 1.0 : 0.75, white ? 1.0 : 0.72, white ? 1.0 : 0.65, 1.0,
                               "metallicFactor", 0.0, "roughnessFactor", 0.6);
  return qmat_gltf_add(root, "materials", material, number);
}

static json_t *extras_of(const qmat_gltf_skin *data, bool mark) {
  json_t *extras = json_object();
  bool done = extras && (!mark || json_object_set_new(extras, QMAT_GLTF_SKIN_MARK, json_true()) == 0);
  if (done && data->error > 0)
    done = json_object_set_new(extras, "qmat_skin_error", json_real(data->error)) == 0 &&
           json_object_set_new(extras, "qmat_skin_error_unit", json_string("model")) == 0;
  if (done) return extras;
  json_decref(extras);
  return NULL;
}

bool qmat_gltf_skin_add(json_t *root, const qmat_gltf_skin *data, json_int_t buffer, size_t offset,
                        json_int_t *material, const char *name, bool mark, json_int_t *mesh_number) {
  json_int_t view = 0;
  if (!add_material(root, data->sizes[QMAT_GLTF_SKIN_COLOURS] > 0, material) ||
      !add_views(root, data, buffer, offset, &view))
    return false;
  json_t *primitive = json_pack("{s:{}}", "attributes");
  bool done = primitive && add_accessors(root, data, view, primitive) &&
              qmat_gltf_set(primitive, "material", json_integer(*material));
  if (primitive && data->compressed) {
    json_t *extension = json_pack("{s:{s:I, s:{s:I, s:I}}}", QMAT_GLTF_DRACO, "bufferView", view, "attributes",
                                  "POSITION", (json_int_t)data->position_id, "NORMAL", (json_int_t)data->normal_id);
    done =
        done && qmat_gltf_set(primitive, "extensions", extension) && qmat_gltf_require_extension(root, QMAT_GLTF_DRACO);
  }
  json_t *mesh = json_pack("{s:[o]}", "primitives", primitive);
  if (mesh && name) done = qmat_gltf_set(mesh, "name", json_string(name)) && done;
  if (mesh && (mark || data->error > 0)) done = qmat_gltf_set(mesh, "extras", extras_of(data, mark)) && done;
  return qmat_gltf_add(root, "meshes", mesh, mesh_number) && done;
}
