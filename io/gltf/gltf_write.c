/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_write.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/triangle.h"
#include "core/json_text.h"
#include "core/node.h"
#include "io/base64.h"
#include "io/bytes.h"
#include "io/draco.h"
#include "io/gltf/gltf_asset.h"
#include "io/gltf/gltf_compress.h"

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

/* An error of what qmat_data decodes to: no point of the solid moves by more than the loss. */
static double with_loss(double error, const medial_text *text, const qmat_gltf_options *options) {
  return options->diagonal > 0 ? nextafter(error + nextafter(text->loss / options->diagonal, INFINITY), INFINITY)
                               : error;
}

/* What is said of the medial mesh; NULL when memory is short. */
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
  } errors[] = {{"qmat_epsilon", options->epsilon},
                {"qmat_error_out", with_loss(options->error_out, text, options)},
                {"qmat_error_in", with_loss(options->error_in, text, options)}};
  bool any = false;
  for (size_t i = 0; i < sizeof errors / sizeof *errors && done; i++) {
    if (!isfinite(errors[i].value)) continue;
    done = set(extras, errors[i].key, json_real(errors[i].value));
    any = true;
  }
  if (any) done = done && set(extras, "qmat_error_unit", json_string("diagonal"));
  if (options->certified != QMAT_CERTIFICATE_UNKNOWN) {
    const bool within =
        options->diagonal == 0 || (errors[1].value <= options->epsilon && errors[2].value <= options->epsilon);
    done = done && set(extras, "qmat_certified", json_boolean(within && options->certified == QMAT_CERTIFICATE_YES));
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

/* Unit normals, the sum of the facets' area vectors (cross products, whose length is twice the area). Vertices whose
 * sum vanishes get the z axis: glTF asks for unit length everywhere. `sums` is scratch of 3 doubles a vertex, zeroed.
 */
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
} skin_data;

static void pad(qmat_writer *writer, uint8_t with) {
  while (!writer->failed && writer->size % 4 != 0) qmat_put_u8(writer, with);
}

static void put_plain_skin(const qmat_mesh *skin, const float *positions, const float *normals, skin_data *data,
                           qmat_writer *buffer) {
  size_t count = 3 * skin->vertex_count;
  data->vertex_count = skin->vertex_count;
  data->index_count = 3 * skin->triangle_count;
  /* The largest index of a type means "restart", so 65535 vertices still fit. */
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
}

static qmat_status put_draco_skin(qmat_context *context, const qmat_mesh *skin, const float *positions,
                                  const float *normals, double allowed, skin_data *data, qmat_writer *buffer) {
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

static qmat_status make_skin(qmat_context *context, const qmat_mesh *skin, const qmat_gltf_options *options,
                             skin_data *data, qmat_writer *buffer) {
  float *positions = qmat_alloc(skin->vertex_count, 3 * sizeof *positions);
  float *normals = qmat_alloc(skin->vertex_count, 3 * sizeof *normals);
  double *sums = qmat_calloc(skin->vertex_count, 3 * sizeof *sums);
  qmat_status status =
      positions && normals && sums ? single_positions(context, skin, positions) : qmat_fail_memory(context, "the skin");
  if (status == QMAT_OK) {
    area_normals(skin, sums, normals);
    if (options->compress_skin) {
      status = put_draco_skin(context, skin, positions, normals, options->quantisation, data, buffer);
    } else {
      put_plain_skin(skin, positions, normals, data, buffer);
    }
    pad(buffer, 0);
    if (status == QMAT_OK && buffer->failed) status = qmat_fail_memory(context, "the skin");
  }
  qmat_free(sums);
  qmat_free(normals);
  qmat_free(positions);
  return status;
}

/* ---- JSON ---- */

/* NULL is carried through json_pack, which fails on it and frees the rest, so that one check at the end is enough. */

/* An asset on its way: new, or one that was read. */
typedef struct document {
  json_t *root;
  bool binary;
  qmat_gltf_asset asset;           /* that was read; else empty */
  qmat_gltf_compressed compressed; /* its meshes, where they are to be; then its chunk is the asset's */
  qmat_writer data;                /* what is added to its buffers */
  bool in_chunk;                   /* that goes into the GLB's chunk, not into a buffer with a URI */
  size_t data_start;               /* behind the bytes of the asset's own chunk, 0: in another buffer */
  json_int_t buffer;               /* the number of the buffer */
  json_int_t material;             /* of skins; -1: there is none yet */
} document;

/* root[key] as an array, made when it is not there; NULL when memory is short or it is something else. */
static json_t *array_of(json_t *object, const char *key) {
  json_t *array = json_object_get(object, key);
  if (!array && set(object, key, json_array())) array = json_object_get(object, key);
  return json_is_array(array) ? array : NULL;
}

/* Adds a member to root[key] and tells its number; false when memory is short. Takes the member over. */
static bool add(json_t *root, const char *key, json_t *member, json_int_t *number) {
  json_t *array = array_of(root, key);
  if (number) *number = (json_int_t)json_array_size(array);
  if (array && member) return json_array_append_new(array, member) == 0;
  json_decref(member);
  return false;
}

/* Adds the buffer views of a skin whose data start at `offset`; `*first` is the number of the first. */
static bool add_views(document *document, const skin_data *data, size_t offset, json_int_t *first) {
  static const int targets[3] = {ARRAY_BUFFER, ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER};
  for (int i = 0; i < (data->compressed ? 1 : 3); i++) {
    json_int_t number;
    json_t *view = json_pack("{s:I, s:I, s:I}", "buffer", document->buffer, "byteOffset", (json_int_t)offset,
                             "byteLength", (json_int_t)data->sizes[i]);
    if (view && !data->compressed && !set(view, "target", json_integer(targets[i]))) {
      json_decref(view);
      view = NULL;
    }
    if (!add(document->root, "bufferViews", view, &number)) return false;
    if (i == 0) *first = number;
    offset += data->sizes[i];
  }
  return true;
}

/* Adds positions, normals and indices, in this order. */
static bool add_accessors(json_t *root, const skin_data *data, json_int_t first_view, json_int_t *first) {
  json_t *position =
      json_pack("{s:i, s:I, s:s, s:[f,f,f], s:[f,f,f]}", "componentType", FLOAT, "count",
                (json_int_t)data->vertex_count, "type", "VEC3", "min", (double)data->min[0], (double)data->min[1],
                (double)data->min[2], "max", (double)data->max[0], (double)data->max[1], (double)data->max[2]);
  json_t *normal =
      json_pack("{s:i, s:I, s:s}", "componentType", FLOAT, "count", (json_int_t)data->vertex_count, "type", "VEC3");
  json_t *indices = json_pack("{s:i, s:I, s:s}", "componentType", data->wide ? UNSIGNED_INT : UNSIGNED_SHORT, "count",
                              (json_int_t)data->index_count, "type", "SCALAR");
  json_t *accessors[3] = {position, normal, indices};
  bool done = true;
  for (int i = 0; i < 3; i++) {
    json_int_t number;
    if (accessors[i] && !data->compressed) done = set(accessors[i], "bufferView", json_integer(first_view + i)) && done;
    done = add(root, "accessors", accessors[i], &number) && done;
    if (i == 0) *first = number;
  }
  return done;
}

static bool add_material(document *document) {
  if (document->material >= 0) return true;
  json_t *material = json_pack("{s:s, s:{s:[f,f,f,f], s:f, s:f}}", "name", "skin", "pbrMetallicRoughness",
                               "baseColorFactor", 0.75, 0.72, 0.65, 1.0, "metallicFactor", 0.0, "roughnessFactor", 0.6);
  return add(document->root, "materials", material, &document->material);
}

/* Adds everything that a skin needs; `name` may be NULL. */
static bool add_skin(document *document, const skin_data *data, size_t offset, const char *name, bool mark,
                     json_int_t *mesh_number) {
  json_int_t view = 0, accessor = 0;
  json_t *root = document->root;
  if (!add_material(document) || !add_views(document, data, offset, &view) ||
      !add_accessors(root, data, view, &accessor))
    return false;
  json_t *primitive = json_pack("{s:{s:I, s:I}, s:I, s:I}", "attributes", "POSITION", accessor, "NORMAL", accessor + 1,
                                "indices", accessor + 2, "material", document->material);
  bool done = true;
  if (primitive && data->compressed) {
    json_t *extension = json_pack("{s:{s:I, s:{s:I, s:I}}}", QMAT_GLTF_DRACO, "bufferView", view, "attributes",
                                  "POSITION", (json_int_t)data->position_id, "NORMAL", (json_int_t)data->normal_id);
    done = set(primitive, "extensions", extension) && qmat_gltf_require_extension(root, QMAT_GLTF_DRACO);
  }
  json_t *mesh = json_pack("{s:[o]}", "primitives", primitive);
  if (mesh && name) done = set(mesh, "name", json_string(name)) && done;
  if (mesh && mark) done = set(mesh, "extras", json_pack("{s:b}", QMAT_GLTF_SKIN_MARK, 1)) && done;
  return add(root, "meshes", mesh, mesh_number) && done;
}

/* The bytes of `data` as a data URI; NULL when memory is short. */
static json_t *data_uri(const uint8_t *bytes, size_t size) {
  char *base64 = qmat_base64_encode(bytes, size);
  json_t *uri = base64 ? json_sprintf("%s%s", DATA_URI, base64) : NULL;
  qmat_free(base64);
  return uri;
}

/* ---- what is added to nodes ---- */

/* Sets the extras, in place of those that an earlier run left. */
static bool set_extras(json_t *node, const json_t *extras) {
  json_t *own = json_object_get(node, "extras");
  const char *key;
  json_t *value;
  void *next;
  if (!own) { /* json_copy would lose keys in a shortage of memory and say nothing */
    own = json_object();
    if (!set(node, "extras", own)) return false;
  }
  json_object_foreach_safe(own, next, key, value) {
    if (strncmp(key, "qmat_", 5) == 0) json_object_del(own, key);
  }
  return json_object_update(own, (json_t *)(uintptr_t)extras) == 0;
}

/* Adds a child to a node, which is named so that people find it. */
static bool add_child(json_t *root, json_t *node, json_t *child, const char *what) {
  const char *name = json_string_value(json_object_get(node, "name"));
  json_int_t number;
  bool done = child && (!name || set(child, "name", json_sprintf("%s %s", name, what)));
  done = add(root, "nodes", child, &number) && done;
  return done && add(node, "children", json_integer(number), NULL);
}

/* Puts a medial mesh, and its skin, on every node that carries the mesh. */
static bool add_to_carriers(document *document, json_int_t mesh, const json_t *extras, json_int_t skin) {
  json_t *nodes = json_object_get(document->root, "nodes");
  const size_t count = json_array_size(nodes);
  bool done = true;
  for (size_t i = 0; i < count && done; i++) {
    json_t *node = json_array_get(nodes, i), *own = json_object_get(node, "extras");
    if (qmat_gltf_mesh_of(node) != mesh) continue;
    if (own && !json_is_object(own)) {
      done = add_child(document->root, node, json_pack("{s:O}", "extras", extras), "medial mesh");
    } else {
      done = set_extras(node, extras);
    }
    if (done && skin >= 0) done = add_child(document->root, node, json_pack("{s:I}", "mesh", skin), "skin");
  }
  return done;
}

/* A node of its own for the one medial mesh of all: of a new asset its first, else one that is added to its scene. */
static bool add_node(json_t *root, const json_t *extras, json_int_t skin, const char *name) {
  json_t *node = json_object();
  bool done = node != NULL;
  if (name) done = done && set(node, "name", json_string(name));
  if (skin >= 0) done = done && set(node, "mesh", json_integer(skin));
  done = done && set_extras(node, extras);
  json_int_t number;
  if (!add(root, "nodes", node, &number) || !done) return false;
  const json_t *scenes = json_object_get(root, "scenes"), *chosen = json_object_get(root, "scene");
  json_t *scene = json_array_get(scenes, json_is_number(chosen) ? (size_t)json_number_value(chosen) : 0);
  return !scene || add(scene, "nodes", json_integer(number), NULL); /* without scenes every root is shown */
}

/* ---- the document ---- */

static qmat_status open_document(qmat_context *context, const qmat_scene *scene, bool binary, document *document) {
  document->binary = document->in_chunk = binary;
  document->material = -1;
  if (!scene) {
    document->root = json_pack("{s:{s:s, s:s}, s:i, s:[{}]}", "asset", "version", "2.0", "generator",
                               "qmat " QMAT_VERSION, "scene", 0, "scenes");
    return document->root ? QMAT_OK : qmat_fail_memory(context, "a glTF file");
  }
  const qmat_file_part *main_part = &scene->parts[0];
  qmat_status status = qmat_gltf_asset_init(context, main_part->bytes, main_part->size, scene->name, &document->asset);
  if (status != QMAT_OK) return status;
  document->root = json_incref(document->asset.root);
  const json_t *buffers = json_object_get(document->root, "buffers");
  const bool has_chunk =
      document->asset.chunk && json_array_size(buffers) > 0 && !json_object_get(json_array_get(buffers, 0), "uri");
  if (has_chunk) {
    document->data_start = (document->asset.chunk_size + 3) / 4 * 4;
  } else {
    document->buffer = (json_int_t)json_array_size(buffers);
    document->in_chunk = binary && document->buffer == 0 && !document->asset.chunk;
  }
  return QMAT_OK;
}

static void close_document(document *document) {
  qmat_writer_uninit(&document->data);
  json_decref(document->root);
  qmat_gltf_asset_uninit(&document->asset);
  qmat_gltf_compressed_uninit(&document->compressed);
}

/* Compresses the asset's own meshes; `report` gains what came of it. */
static qmat_status compress_meshes(qmat_context *context, const qmat_scene *scene, const qmat_gltf_addition *additions,
                                   size_t count, document *document, json_t *report) {
  json_t *notes = json_array();
  if (!notes) return qmat_fail_memory(context, "the report");
  qmat_status status = QMAT_OK;
  if (scene->mesh_count == 0 || document->data_start == 0) {
    const char *why = scene->mesh_count == 0 ? "they are described as one" : "their data are in no binary chunk";
    if (json_array_append_new(notes, json_sprintf("the meshes are left as they are: %s", why)) != 0)
      status = qmat_fail_memory(context, "the report");
  } else {
    double error = 1;
    for (size_t i = 0; i < count; i++) {
      const qmat_gltf_options *options = &additions[i].options;
      if (additions[i].medial && options->diagonal > 0) error = fmin(error, options->quantisation / options->diagonal);
    }
    status = qmat_gltf_compress(context, document->root, document->asset.chunk, document->asset.chunk_size, error,
                                notes, &document->compressed);
  }
  if (status == QMAT_OK && document->compressed.chunk) {
    document->asset.chunk = document->compressed.chunk;
    document->asset.chunk_size = document->data_start = document->compressed.chunk_size;
  }
  if (status == QMAT_OK && report) {
    bool done = set(report, "draco_primitives", json_integer((json_int_t)document->compressed.primitives));
    if (json_array_size(notes) > 0) done = json_object_set(report, "warnings", notes) == 0 && done;
    if (!done) status = qmat_fail_memory(context, "the report");
  }
  json_decref(notes);
  return status;
}

/* The options of a mesh whose surface has been moved: what is certified stays so where that can be. */
static qmat_gltf_options options_after(const qmat_gltf_options *options, double moved) {
  qmat_gltf_options after = *options;
  if (!(moved > 0 && options->diagonal > 0)) return after;
  after.error_out += moved / options->diagonal;
  after.error_in += moved / options->diagonal;
  const double left = (options->epsilon - fmax(after.error_out, after.error_in)) * options->diagonal;
  if (options->certified == QMAT_CERTIFICATE_YES && left > 0 && left < options->quantisation) after.quantisation = left;
  return after;
}

/* Adds one medial mesh and its skin. */
static qmat_status add_medial(qmat_context *context, const qmat_scene *scene, size_t index,
                              const qmat_gltf_addition *addition, document *document) {
  const bool is_moved = scene && document->compressed.moved && scene->mesh_count > 0;
  const qmat_gltf_options after =
      options_after(&addition->options, is_moved ? document->compressed.moved[scene->meshes[index]] : 0);
  const qmat_gltf_options *options = &after;
  /* A file's name need not be UTF-8, JSON must. */
  const char *name = options->name && options->name[0] && qmat_is_utf8(options->name) ? options->name : NULL;
  const bool has_skin = addition->skin && addition->skin->triangle_count > 0;
  const bool of_mesh = scene && scene->mesh_count > 0;
  const size_t offset = document->data_start + document->data.size;
  medial_text text = {0};
  skin_data data = {0};
  json_int_t skin = -1;
  qmat_status status = make_medial_text(context, addition->medial, options, &text);
  if (status == QMAT_OK && has_skin) status = make_skin(context, addition->skin, options, &data, &document->data);
  json_t *extras = status == QMAT_OK ? make_extras(addition->medial, &text, options) : NULL;
  bool done = extras && (!has_skin || add_skin(document, &data, offset, name, scene != NULL, &skin));
  if (done && of_mesh) {
    done = add_to_carriers(document, scene->meshes[index], extras, skin);
  } else if (done) {
    done = add_node(document->root, extras, skin, name);
  }
  if (status == QMAT_OK && !done) status = qmat_fail_memory(context, "a glTF file");
  json_decref(extras);
  qmat_free(text.base64);
  return status;
}

/* Says in the JSON where the data are that were added, or that were in a chunk which the file will not have. */
static bool place_data(const document *document) {
  const size_t size = document->data.size;
  json_t *buffers = json_object_get(document->root, "buffers"), *first = json_array_get(buffers, 0);
  if (document->data_start > 0) { /* behind what the GLB's chunk has */
    if (size > 0 && !set(first, "byteLength", json_integer((json_int_t)(document->data_start + size)))) return false;
    if (document->binary) return true;
    qmat_writer all = {0};
    qmat_put_bytes(&all, document->asset.chunk, document->asset.chunk_size);
    pad(&all, 0);
    qmat_put_bytes(&all, document->data.bytes, size);
    const bool done = !all.failed && set(first, "uri", data_uri(all.bytes, all.size));
    qmat_writer_uninit(&all);
    return done;
  }
  if (size == 0) return true;
  json_t *buffer = json_pack("{s:I}", "byteLength", (json_int_t)size);
  bool done = buffer != NULL;
  if (done && !document->in_chunk) done = set(buffer, "uri", data_uri(document->data.bytes, size));
  return add(document->root, "buffers", buffer, NULL) && done;
}

/* ---- the file ---- */

static void put_chunk_head(qmat_writer *out, size_t size, const char *type) {
  qmat_put_u32(out, (uint32_t)size);
  qmat_put_bytes(out, type, 4);
}

static qmat_status put_glb(qmat_context *context, const document *document, const char *json, qmat_writer *out) {
  const qmat_gltf_asset *asset = &document->asset;
  const bool data_is_chunk = document->data.size > 0 && document->in_chunk;
  const size_t json_size = (strlen(json) + 3) / 4 * 4, kept = asset->chunk ? (asset->chunk_size + 3) / 4 * 4 : 0;
  const size_t chunk_size = kept + (data_is_chunk ? document->data.size : 0);
  const bool has_chunk = asset->chunk || data_is_chunk;
  const uint64_t total = 12 + 8 + (uint64_t)json_size + (has_chunk ? 8 + chunk_size : 0) + asset->more_size;
  if (total > UINT32_MAX) {
    return qmat_fail(context, QMAT_ERROR_MEMORY, "a .glb file of %llu bytes is beyond the format's 4 GiB",
                     (unsigned long long)total);
  }
  qmat_put_text(out, "glTF");
  qmat_put_u32(out, 2);
  qmat_put_u32(out, (uint32_t)total);
  put_chunk_head(out, json_size, "JSON");
  qmat_put_text(out, json);
  pad(out, ' ');
  if (has_chunk) {
    put_chunk_head(out, chunk_size, "BIN");
    if (asset->chunk) qmat_put_bytes(out, asset->chunk, asset->chunk_size);
    pad(out, 0);
    if (data_is_chunk) qmat_put_bytes(out, document->data.bytes, document->data.size);
  }
  if (asset->more_size > 0) qmat_put_bytes(out, asset->more, asset->more_size);
  return QMAT_OK;
}

static qmat_status put_file(qmat_context *context, const document *document, qmat_writer *out) {
  size_t flags = JSON_REAL_PRECISION(17) | (document->binary ? JSON_COMPACT : JSON_INDENT(2));
  char *json = qmat_json_text(document->root, flags, NULL);
  if (!json) return qmat_fail_memory(context, "a glTF file");
  qmat_status status = QMAT_OK;
  if (document->binary) {
    status = put_glb(context, document, json, out);
  } else {
    qmat_put_text(out, json);
    qmat_put_u8(out, '\n');
  }
  qmat_free(json);
  return status;
}

/* Parts of their own for the files that the asset refers to. */
static bool copy_parts(const qmat_scene *scene, qmat_file *file) {
  for (size_t i = 1; scene && i < scene->part_count; i++) {
    const qmat_file_part *part = &scene->parts[i];
    file->parts[i] = (qmat_file_part){.name = qmat_strdup(part->name), .bytes = qmat_alloc(part->size, 1)};
    if (!file->parts[i].name || !file->parts[i].bytes) return false;
    memcpy(file->parts[i].bytes, part->bytes, part->size);
    file->parts[i].size = part->size;
  }
  return true;
}

static qmat_status make_file(qmat_context *context, const qmat_scene *scene, const document *document,
                             qmat_file **file) {
  const size_t part_count = scene ? scene->part_count : 1;
  qmat_writer out = {0};
  qmat_file *made = qmat_file_new();
  if (made) {
    made->format = qmat_strdup(document->binary ? "glb" : "gltf");
    made->parts = qmat_calloc(part_count, sizeof *made->parts);
    if (made->parts) made->part_count = part_count;
  }
  qmat_status status = QMAT_OK;
  if (!made || !made->format || !made->parts || !copy_parts(scene, made))
    status = qmat_fail_memory(context, "a glTF file");
  if (status == QMAT_OK) status = put_file(context, document, &out);
  if (status == QMAT_OK) status = qmat_writer_to_part(context, &out, made, 0, "");
  if (status == QMAT_OK) status = qmat_value_seal(context, &made->base);
  if (status == QMAT_OK) {
    *file = made;
  } else if (made) {
    qmat_value_release(&made->base);
  }
  qmat_writer_uninit(&out);
  return status;
}

/* `scene` NULL: an asset of its own. */
static qmat_status write_document(qmat_context *context, const qmat_scene *scene, const qmat_gltf_addition *additions,
                                  size_t count, bool draco_meshes, json_t *report, qmat_file **file) {
  document document = {0};
  *file = NULL;
  qmat_status status = open_document(context, scene, additions[0].options.binary, &document);
  if (status == QMAT_OK && draco_meshes) status = compress_meshes(context, scene, additions, count, &document, report);
  for (size_t i = 0; i < count && status == QMAT_OK; i++)
    if (additions[i].medial) status = add_medial(context, scene, i, &additions[i], &document);
  if (status == QMAT_OK && !place_data(&document)) status = qmat_fail_memory(context, "a glTF file");
  if (status == QMAT_OK) status = make_file(context, scene, &document, file);
  close_document(&document);
  return status;
}

qmat_status qmat_gltf_write(qmat_context *context, const qmat_medial *medial, const qmat_mesh *skin,
                            const qmat_gltf_options *options, qmat_file **file) {
  const qmat_gltf_addition addition = {.medial = medial, .skin = skin, .options = *options};
  return write_document(context, NULL, &addition, 1, false, NULL, file);
}

qmat_status qmat_gltf_enrich(qmat_context *context, const qmat_scene *scene, const qmat_gltf_addition *additions,
                             size_t count, bool draco_meshes, json_t *report, qmat_file **file) {
  return write_document(context, scene, additions, count, draco_meshes, report, file);
}
