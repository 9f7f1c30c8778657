/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_write.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/json_text.h"
#include "core/node.h"
#include "io/base64.h"
#include "io/bytes.h"
#include "io/draco.h"

#define NORMAL_BITS 10
#define DATA_URI "data:application/octet-stream;base64,"

enum { UNSIGNED_SHORT = 5123, UNSIGNED_INT = 5125, FLOAT = 5126, ARRAY_BUFFER = 34962, ELEMENT_ARRAY_BUFFER = 34963 };

/* ---- the medial mesh as text ---- */

typedef struct medial_text {
  char *base64;
  int position_bits, radius_bits;
  double loss; /* as measured */
} medial_text;

/* Encodes, decodes, and measures what was lost. */
static qmat_status encode_and_measure(qmat_context *context, const qmat_medial *medial, medial_text *text,
                                      uint8_t **bytes, size_t *size) {
  qmat_medial *decoded = NULL;
  qmat_status status = qmat_draco_encode_medial(context, medial, text->position_bits, text->radius_bits, bytes, size);
  if (status != QMAT_OK) return status;
  status = qmat_draco_decode_medial(context, *bytes, *size, &decoded);
  if (status == QMAT_OK &&
      (decoded->sphere_count != medial->sphere_count || decoded->edge_count != medial->edge_count ||
       decoded->triangle_count != medial->triangle_count)) {
    status = qmat_fail(context, QMAT_ERROR_INTERNAL, "Draco gave back another medial mesh than it was given");
  }
  if (status == QMAT_OK) text->loss = qmat_draco_medial_loss(medial, decoded);
  if (decoded) qmat_value_release(&decoded->base);
  return status;
}

static qmat_status make_medial_text(qmat_context *context, const qmat_medial *medial, const qmat_gltf_options *options,
                                    medial_text *text) {
  double position_range, radius_range, allowed = options->quantisation;
  bool choose_position = options->position_bits == 0, choose_radius = options->radius_bits == 0;
  qmat_draco_medial_ranges(medial, &position_range, &radius_range);
  *text = (medial_text){.position_bits = options->position_bits, .radius_bits = options->radius_bits};
  if (choose_position) text->position_bits = qmat_draco_bits_for(3, position_range, allowed / 2);
  if (choose_radius) text->radius_bits = qmat_draco_bits_for(1, radius_range, allowed / 2);

  uint8_t *bytes = NULL;
  size_t size = 0;
  qmat_status status = encode_and_measure(context, medial, text, &bytes, &size);
  /* The bound leaves out rounding to single precision, which a few more bits may make up for. */
  for (int tries = 0; tries < 3 && status == QMAT_OK && text->loss > allowed; tries++) {
    bool more_position = choose_position && text->position_bits < 30,
         more_radius = choose_radius && text->radius_bits < 30;
    if (!more_position && !more_radius) break;
    text->position_bits += more_position;
    text->radius_bits += more_radius;
    qmat_free(bytes);
    status = encode_and_measure(context, medial, text, &bytes, &size);
  }
  if (status == QMAT_OK) {
    text->base64 = qmat_base64_encode(bytes, size);
    if (!text->base64) status = qmat_fail_memory(context, "the medial mesh as text");
  }
  qmat_free(bytes);
  return status;
}

/* Sets object[key] and takes the value over; false when memory is short. */
static bool set(json_t *object, const char *key, json_t *value) {
  return value && json_object_set_new(object, key, value) == 0;
}

static bool set_count(json_t *object, const char *key, size_t count) {
  return set(object, key, json_integer((json_int_t)count));
}

/* The node's extras; NULL when memory is short. */
static json_t *make_extras(const qmat_medial *medial, const medial_text *text, const qmat_gltf_options *options) {
  json_t *extras = json_object();
  bool done =
      extras && set(extras, "qmat_version", json_string(QMAT_VERSION)) &&
      set(extras, "qmat_data_format", json_string("draco")) && set(extras, "qmat_data", json_string(text->base64)) &&
      set_count(extras, "qmat_vertices", medial->sphere_count) && set_count(extras, "qmat_edges", medial->edge_count) &&
      set_count(extras, "qmat_triangles", medial->triangle_count);
  const struct {
    const char *key;
    double value;
  } errors[] = {
      {"qmat_epsilon", options->epsilon}, {"qmat_error_out", options->error_out}, {"qmat_error_in", options->error_in}};
  bool any = false;
  for (size_t i = 0; i < sizeof errors / sizeof *errors && done; i++) {
    if (!isfinite(errors[i].value)) continue;
    done = set(extras, errors[i].key, json_real(errors[i].value));
    any = true;
  }
  if (any) done = done && set(extras, "qmat_error_unit", json_string("diagonal"));
  if (options->certified != QMAT_CERTIFICATE_UNKNOWN) {
    done = done && set(extras, "qmat_certified", json_boolean(options->certified == QMAT_CERTIFICATE_YES));
  }
  done = done && set(extras, "qmat_quantisation", json_real(text->loss)) &&
         set(extras, "qmat_quantisation_unit", json_string("model")) &&
         set_count(extras, "qmat_position_bits", (size_t)text->position_bits) &&
         set_count(extras, "qmat_radius_bits", (size_t)text->radius_bits) &&
         set(extras, "qmat_frame", json_string("node"));
  if (done) return extras;
  json_decref(extras);
  return NULL;
}

/* ---- the skin ---- */

/* Writes 3 floats a vertex; QMAT_ERROR_GEOMETRY names the first that does not fit. */
static qmat_status single_positions(qmat_context *context, const qmat_mesh *skin, float *positions) {
  for (size_t i = 0; i < 3 * skin->vertex_count; i++) {
    positions[i] = (float)skin->positions[i];
    if (isfinite(positions[i])) continue;
    char number[32];
    qmat_format_number(skin->positions[i], number, sizeof number);
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "%s does not fit into single precision", number);
    qmat_fail_element(context, "vertex", (int64_t)(i / 3));
    return qmat_fail_field(context, "skin");
  }
  return QMAT_OK;
}

static void cross(const double *a, const double *b, const double *c, double *normal) {
  double u[3], v[3];
  for (int k = 0; k < 3; k++) {
    u[k] = b[k] - a[k];
    v[k] = c[k] - a[k];
  }
  normal[0] = u[1] * v[2] - u[2] * v[1];
  normal[1] = u[2] * v[0] - u[0] * v[2];
  normal[2] = u[0] * v[1] - u[1] * v[0];
}

/* Unit normals, the sum of the facets' area vectors (cross products, whose length is twice the area). Vertices whose
 * sum vanishes get the z axis: glTF asks for unit length everywhere. `sums` is scratch of 3 doubles a vertex, zeroed.
 */
static void area_normals(const qmat_mesh *skin, double *sums, float *normals) {
  for (size_t t = 0; t < skin->triangle_count; t++) {
    const uint32_t *corner = skin->triangles + 3 * t;
    double normal[3];
    cross(skin->positions + 3 * (size_t)corner[0], skin->positions + 3 * (size_t)corner[1],
          skin->positions + 3 * (size_t)corner[2], normal);
    for (int k = 0; k < 3; k++) {
      for (int axis = 0; axis < 3; axis++) sums[3 * (size_t)corner[k] + (size_t)axis] += normal[axis];
    }
  }
  for (size_t i = 0; i < skin->vertex_count; i++) {
    const double *sum = sums + 3 * i;
    /* Scaled first: areas of tiny or huge models leave the range of squares. */
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

/* What the JSON says of the skin, and its bytes. */
typedef struct skin_data {
  size_t vertex_count, index_count;
  float min[3], max[3];
  bool compressed, wide;           /* 32-bit indices */
  uint32_t position_id, normal_id; /* Draco's */
  size_t sizes[3];                 /* of the buffer views: positions, normals, indices; or Draco's data */
  qmat_writer buffer;
} skin_data;

static void pad(qmat_writer *writer, uint8_t with) {
  while (!writer->failed && writer->size % 4 != 0) qmat_put_u8(writer, with);
}

static void put_plain_skin(const qmat_mesh *skin, const float *positions, const float *normals, skin_data *data) {
  size_t count = 3 * skin->vertex_count;
  data->vertex_count = skin->vertex_count;
  data->index_count = 3 * skin->triangle_count;
  /* The largest index of a type means "restart", so 65535 vertices still fit. */
  data->wide = skin->vertex_count > 65535;
  for (int k = 0; k < 3; k++) data->min[k] = data->max[k] = positions[k];
  for (size_t i = 0; i < count; i++) {
    data->min[i % 3] = fminf(data->min[i % 3], positions[i]);
    data->max[i % 3] = fmaxf(data->max[i % 3], positions[i]);
    qmat_put_f32(&data->buffer, positions[i]);
  }
  for (size_t i = 0; i < count; i++) qmat_put_f32(&data->buffer, normals[i]);
  for (size_t i = 0; i < data->index_count; i++) {
    if (data->wide) {
      qmat_put_u32(&data->buffer, skin->triangles[i]);
    } else {
      qmat_put_u16(&data->buffer, (uint16_t)skin->triangles[i]);
    }
  }
  data->sizes[0] = data->sizes[1] = count * sizeof(float);
  data->sizes[2] = data->index_count * (data->wide ? 4 : 2);
}

static qmat_status put_draco_skin(qmat_context *context, const qmat_mesh *skin, const float *positions,
                                  const float *normals, double allowed, skin_data *data) {
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
  qmat_put_bytes(&data->buffer, packed.bytes, packed.size);
  qmat_draco_skin_uninit(&packed);
  return QMAT_OK;
}

static qmat_status make_skin(qmat_context *context, const qmat_mesh *skin, const qmat_gltf_options *options,
                             skin_data *data) {
  float *positions = qmat_alloc(skin->vertex_count, 3 * sizeof *positions);
  float *normals = qmat_alloc(skin->vertex_count, 3 * sizeof *normals);
  double *sums = qmat_calloc(skin->vertex_count, 3 * sizeof *sums);
  qmat_status status =
      positions && normals && sums ? single_positions(context, skin, positions) : qmat_fail_memory(context, "the skin");
  if (status == QMAT_OK) {
    area_normals(skin, sums, normals);
    if (options->compress_skin) {
      status = put_draco_skin(context, skin, positions, normals, options->quantisation, data);
    } else {
      put_plain_skin(skin, positions, normals, data);
    }
    pad(&data->buffer, 0);
    if (status == QMAT_OK && data->buffer.failed) status = qmat_fail_memory(context, "the skin");
  }
  qmat_free(sums);
  qmat_free(normals);
  qmat_free(positions);
  return status;
}

/* ---- JSON ---- */

/* NULL is carried through json_pack, which fails on it and frees the rest, so that one check at the end is enough. */

static json_t *make_accessors(const skin_data *data) {
  json_t *position =
      json_pack("{s:i, s:I, s:s, s:[f,f,f], s:[f,f,f]}", "componentType", FLOAT, "count",
                (json_int_t)data->vertex_count, "type", "VEC3", "min", (double)data->min[0], (double)data->min[1],
                (double)data->min[2], "max", (double)data->max[0], (double)data->max[1], (double)data->max[2]);
  json_t *normal =
      json_pack("{s:i, s:I, s:s}", "componentType", FLOAT, "count", (json_int_t)data->vertex_count, "type", "VEC3");
  json_t *indices = json_pack("{s:i, s:I, s:s}", "componentType", data->wide ? UNSIGNED_INT : UNSIGNED_SHORT, "count",
                              (json_int_t)data->index_count, "type", "SCALAR");
  json_t *accessors[3] = {position, normal, indices};
  for (int i = 0; i < 3 && !data->compressed; i++) {
    if (accessors[i] && !set(accessors[i], "bufferView", json_integer(i))) {
      json_decref(accessors[i]);
      accessors[i] = NULL;
    }
  }
  return json_pack("[o,o,o]", accessors[0], accessors[1], accessors[2]);
}

static json_t *make_views(const skin_data *data) {
  if (data->compressed) return json_pack("[{s:i, s:I}]", "buffer", 0, "byteLength", (json_int_t)data->sizes[0]);
  static const int targets[3] = {ARRAY_BUFFER, ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER};
  json_t *views = json_array();
  size_t offset = 0;
  for (int i = 0; i < 3 && views; i++) {
    json_t *view = json_pack("{s:i, s:I, s:I, s:i}", "buffer", 0, "byteOffset", (json_int_t)offset, "byteLength",
                             (json_int_t)data->sizes[i], "target", targets[i]);
    if (!view || json_array_append_new(views, view) != 0) {
      json_decref(views);
      return NULL;
    }
    offset += data->sizes[i];
  }
  return views;
}

static json_t *make_mesh(const skin_data *data) {
  json_t *primitive =
      json_pack("{s:{s:i, s:i}, s:i, s:i}", "attributes", "POSITION", 0, "NORMAL", 1, "indices", 2, "material", 0);
  if (primitive && data->compressed) {
    json_t *extension =
        json_pack("{s:{s:i, s:{s:I, s:I}}}", "KHR_draco_mesh_compression", "bufferView", 0, "attributes", "POSITION",
                  (json_int_t)data->position_id, "NORMAL", (json_int_t)data->normal_id);
    if (!set(primitive, "extensions", extension)) {
      json_decref(primitive);
      return NULL;
    }
  }
  return json_pack("{s:[o]}", "primitives", primitive);
}

/* Adds everything that a skin needs. `uri` is the buffer's, or NULL for the GLB's chunk. */
static bool add_skin(json_t *root, json_t *node, const skin_data *data, const char *name, const char *uri) {
  json_t *mesh = make_mesh(data);
  if (mesh && name && !set(mesh, "name", json_string(name))) {
    json_decref(mesh);
    return false;
  }
  json_t *material = json_pack("{s:s, s:{s:[f,f,f,f], s:f, s:f}}", "name", "skin", "pbrMetallicRoughness",
                               "baseColorFactor", 0.75, 0.72, 0.65, 1.0, "metallicFactor", 0.0, "roughnessFactor", 0.6);
  json_t *buffer = json_pack("{s:I}", "byteLength", (json_int_t)data->buffer.size);
  bool done = set(node, "mesh", json_integer(0));
  if (buffer && uri) done = set(buffer, "uri", json_string(uri)) && done;
  done = set(root, "meshes", json_pack("[o]", mesh)) && done;
  done = set(root, "materials", json_pack("[o]", material)) && done;
  done = set(root, "accessors", make_accessors(data)) && done;
  done = set(root, "bufferViews", make_views(data)) && done;
  done = set(root, "buffers", json_pack("[o]", buffer)) && done;
  if (data->compressed) {
    done = set(root, "extensionsUsed", json_pack("[s]", "KHR_draco_mesh_compression")) && done;
    done = set(root, "extensionsRequired", json_pack("[s]", "KHR_draco_mesh_compression")) && done;
  }
  return done;
}

/* The bytes of `data` as a data URI; NULL when memory is short. */
static char *data_uri(const qmat_writer *data) {
  char *base64 = qmat_base64_encode(data->bytes, data->size);
  char *uri = base64 ? qmat_alloc(strlen(base64) + sizeof DATA_URI, 1) : NULL;
  if (uri) {
    memcpy(uri, DATA_URI, sizeof DATA_URI - 1);
    strcpy(uri + sizeof DATA_URI - 1, base64);
  }
  qmat_free(base64);
  return uri;
}

/* The whole document; NULL when memory is short. */
static json_t *make_root(const qmat_medial *medial, const medial_text *text, const skin_data *skin,
                         const qmat_gltf_options *options) {
  /* A file's name need not be UTF-8, JSON must. */
  const char *name = options->name && options->name[0] && qmat_is_utf8(options->name) ? options->name : NULL;
  char *uri = skin && !options->binary ? data_uri(&skin->buffer) : NULL;
  json_t *node = json_object();
  json_t *root = json_pack("{s:{s:s, s:s}, s:i, s:[{s:[i]}]}", "asset", "version", "2.0", "generator",
                           "qmat " QMAT_VERSION, "scene", 0, "scenes", "nodes", 0);
  bool done = node && root && (!skin || options->binary || uri);
  if (done && name) done = set(node, "name", json_string(name));
  if (done && skin) done = add_skin(root, node, skin, name, uri);
  if (done) done = set(node, "extras", make_extras(medial, text, options));
  if (done) done = set(root, "nodes", json_pack("[O]", node));
  qmat_free(uri);
  json_decref(node);
  if (done) return root;
  json_decref(root);
  return NULL;
}

/* ---- the file ---- */

static qmat_status put_file(qmat_context *context, const json_t *root, const skin_data *skin, bool binary,
                            qmat_writer *out) {
  size_t flags = JSON_REAL_PRECISION(17) | (binary ? JSON_COMPACT : JSON_INDENT(2));
  char *json = qmat_json_text(root, flags, NULL);
  if (!json) return qmat_fail_memory(context, "a glTF file");
  if (!binary) {
    qmat_put_text(out, json);
    qmat_put_u8(out, '\n');
  } else {
    size_t json_size = (strlen(json) + 3) / 4 * 4;
    uint64_t total = 12 + 8 + json_size + (skin ? 8 + skin->buffer.size : 0);
    if (total > UINT32_MAX) {
      qmat_free(json);
      return qmat_fail(context, QMAT_ERROR_MEMORY, "a .glb file of %llu bytes is beyond the format's 4 GiB",
                       (unsigned long long)total);
    }
    qmat_put_text(out, "glTF");
    qmat_put_u32(out, 2);
    qmat_put_u32(out, (uint32_t)total);
    qmat_put_u32(out, (uint32_t)json_size);
    qmat_put_text(out, "JSON");
    qmat_put_text(out, json);
    pad(out, ' ');
    if (skin) {
      qmat_put_u32(out, (uint32_t)skin->buffer.size);
      qmat_put_bytes(out, "BIN", 4);
      qmat_put_bytes(out, skin->buffer.bytes, skin->buffer.size);
    }
  }
  qmat_free(json);
  return QMAT_OK;
}

qmat_status qmat_gltf_write(qmat_context *context, const qmat_medial *medial, const qmat_mesh *skin,
                            const qmat_gltf_options *options, qmat_file **file) {
  *file = NULL;
  bool has_skin = skin && skin->triangle_count > 0;
  medial_text text = {0};
  skin_data data = {0};
  json_t *root = NULL;
  qmat_writer out = {0};
  qmat_file *made = NULL;
  qmat_status status = make_medial_text(context, medial, options, &text);
  if (status == QMAT_OK && has_skin) status = make_skin(context, skin, options, &data);
  if (status != QMAT_OK) goto done;
  root = make_root(medial, &text, has_skin ? &data : NULL, options);
  made = qmat_file_new();
  if (made) {
    made->format = qmat_strdup(options->binary ? "glb" : "gltf");
    made->parts = qmat_calloc(1, sizeof *made->parts);
  }
  if (!root || !made || !made->format || !made->parts) {
    status = qmat_fail_memory(context, "a glTF file");
    goto done;
  }
  made->part_count = 1;
  status = put_file(context, root, has_skin ? &data : NULL, options->binary, &out);
  if (status == QMAT_OK) status = qmat_writer_to_part(context, &out, made, 0, "");
  if (status == QMAT_OK) status = qmat_value_seal(context, &made->base);
  if (status == QMAT_OK) {
    *file = made;
    made = NULL;
  }

done:
  if (made) qmat_value_release(&made->base);
  qmat_writer_uninit(&out);
  json_decref(root);
  qmat_writer_uninit(&data.buffer);
  qmat_free(text.base64);
  return status;
}
