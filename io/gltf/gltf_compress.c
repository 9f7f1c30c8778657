/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_compress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/arena.h"
#include "io/bytes.h"
#include "io/draco.h"
#include "io/draco_draco.h"
#include "io/gltf/gltf_asset.h"

enum { LEAST_POSITION_BITS = 14, NORMAL_BITS = 10, TEXCOORD_BITS = 12, COLOR_BITS = 8, OTHER_BITS = 12 };
enum { MOST_ATTRIBUTES = 24 };

/* Why a primitive is not compressed. */
typedef enum obstacle {
  OBSTACLE_NONE,
  OBSTACLE_COMPRESSED,
  OBSTACLE_NO_TRIANGLES,
  OBSTACLE_TARGETS,
  OBSTACLE_SHARED,
  OBSTACLE_SPARSE,
  OBSTACLE_OUTSIDE,
  OBSTACLE_QUANTISED,
  OBSTACLE_DATA,
  OBSTACLE_REFUSED,
  OBSTACLE_COUNT
} obstacle;

static const char *const obstacle_texts[OBSTACLE_COUNT] = {
    [OBSTACLE_COMPRESSED] = "already compressed",
    [OBSTACLE_NO_TRIANGLES] = "no indexed triangles",
    [OBSTACLE_TARGETS] = "morph targets",
    [OBSTACLE_SHARED] = "the data are also used by something else",
    [OBSTACLE_SPARSE] = "the data are sparse",
    [OBSTACLE_OUTSIDE] = "the data are outside the binary chunk",
    [OBSTACLE_QUANTISED] = "positions or normals are already quantised (KHR_mesh_quantization)",
    [OBSTACLE_DATA] = "the data are invalid or unsupported",
    [OBSTACLE_REFUSED] = "Draco cannot encode the data",
};

/* The location and layout of an accessor's numbers in the chunk. */
typedef struct accessor_view {
  size_t count, components, width, stride; /* width: bytes per component */
  json_int_t type;                         /* componentType */
  const uint8_t *bytes;
} accessor_view;

typedef struct compressor {
  qmat_context *context;
  json_t *root;
  const uint8_t *chunk;
  size_t size;
  double error;
  const json_t **users; /* per accessor: the first primitive that uses it */
  bool *shared;         /* per accessor: other geometry, morph targets, skins or animations use it too */
  size_t accessor_count;
  double *moved;     /* per accessor: bound on the movement of these positions; -1: not compressed */
  bool *fresh;       /* per primitive, counted over all meshes: compressed in this call */
  qmat_writer blobs; /* the compressed data, each padded to 4 bytes */
  json_t *new_views; /* their buffer views; offsets count from the start of `blobs` */
  qmat_gltf_compressed *result;
  size_t left[OBSTACLE_COUNT];
} compressor;

/* ---- reading the JSON ---- */

/* A whole number from 0, also if written as 3.0; else -1. whole() gives `missing` if the object lacks the key. */
static json_int_t whole_of(const json_t *value) {
  const double number = json_number_value(value);
  return json_is_number(value) && number >= 0 && number < 0x1p53 && number == floor(number) ? (json_int_t)number : -1;
}

static json_int_t whole(const json_t *object, const char *key, json_int_t missing) {
  const json_t *value = json_object_get(object, key);
  return value ? whole_of(value) : missing;
}

static const json_t *member(const json_t *root, const char *key, json_int_t index) {
  return index < 0 ? NULL : json_array_get(json_object_get(root, key), (size_t)index);
}

static size_t components_of(const char *type) {
  static const char *const names[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
  for (size_t i = 0; type && i < 4; i++)
    if (strcmp(type, names[i]) == 0) return i + 1;
  return 0;
}

/* Locates an accessor's numbers. False unless they are dense, uncompressed and inside the chunk. */
static bool view_accessor(const compressor *c, json_int_t index, accessor_view *view) {
  const json_t *accessor = member(c->root, "accessors", index);
  const json_t *buffer_view = member(c->root, "bufferViews", whole(accessor, "bufferView", -1));
  if (!accessor || !buffer_view || json_object_get(accessor, "sparse") || json_object_get(accessor, "extensions") ||
      json_object_get(buffer_view, "extensions") || whole(buffer_view, "buffer", -1) != 0)
    return false;
  const json_int_t count = whole(accessor, "count", -1), offset = whole(accessor, "byteOffset", 0),
                   start = whole(buffer_view, "byteOffset", 0), length = whole(buffer_view, "byteLength", -1),
                   stride = whole(buffer_view, "byteStride", 0), most = (json_int_t)c->size;
  view->type = whole(accessor, "componentType", -1);
  view->width = qmat_gltf_component_size(view->type);
  view->components = components_of(json_string_value(json_object_get(accessor, "type")));
  const json_int_t wide = (json_int_t)(view->width * view->components);
  if (wide == 0 || count < 1 || count > most || offset < 0 || start < 0 || length < 0 || start > most ||
      length > most - start || stride < 0 || (stride > 0 && (stride < wide || stride > 252)))
    return false;
  view->count = (size_t)count;
  view->stride = (size_t)(stride > 0 ? stride : wide);
  if (offset > length || (json_int_t)view->stride * (count - 1) + wide > length - offset) return false;
  view->bytes = c->chunk + start + offset;
  return true;
}

/* Why view_accessor, or what it found, does not do. */
static obstacle data_obstacle(const compressor *c, json_int_t index) {
  const json_t *accessor = member(c->root, "accessors", index);
  const json_t *view = member(c->root, "bufferViews", whole(accessor, "bufferView", -1));
  if (json_object_get(accessor, "sparse")) return OBSTACLE_SPARSE;
  if (json_object_get(view, "extensions")) return OBSTACLE_COMPRESSED;
  return view && whole(view, "buffer", -1) > 0 ? OBSTACLE_OUTSIDE : OBSTACLE_DATA;
}

/* ---- users of accessors ---- */

/* Whether both objects have equal members `key`, or neither has one. */
static bool agree(const json_t *a, const json_t *b, const char *key) {
  const json_t *first = json_object_get(a, key), *second = json_object_get(b, key);
  return first && second ? json_equal(first, second) : first == second;
}

static bool same_geometry(const json_t *a, const json_t *b) {
  return agree(a, b, "attributes") && agree(a, b, "indices") && agree(a, b, "mode") && !json_object_get(a, "targets") &&
         !json_object_get(b, "targets");
}

/* `primitive` is NULL for morph targets, skins and animations. */
static void note_user(compressor *c, const json_t *accessor, const json_t *primitive) {
  const json_int_t index = whole_of(accessor);
  if (index < 0 || (size_t)index >= c->accessor_count) return;
  if (!primitive || (c->users[index] && !same_geometry(c->users[index], primitive))) c->shared[index] = true;
  if (!c->users[index]) c->users[index] = primitive;
}

static void note_users(compressor *c) {
  size_t i, k;
  const char *name;
  json_t *mesh, *primitive, *item, *value;
  json_array_foreach(json_object_get(c->root, "meshes"), i, mesh) {
    json_array_foreach(json_object_get(mesh, "primitives"), k, primitive) {
      size_t target;
      note_user(c, json_object_get(primitive, "indices"), primitive);
      json_object_foreach(json_object_get(primitive, "attributes"), name, value) note_user(c, value, primitive);
      json_array_foreach(json_object_get(primitive, "targets"), target, item) {
        json_object_foreach(item, name, value) note_user(c, value, NULL);
      }
    }
  }
  json_array_foreach(json_object_get(c->root, "skins"), i, item)
      note_user(c, json_object_get(item, "inverseBindMatrices"), NULL);
  json_array_foreach(json_object_get(c->root, "animations"), i, item) {
    json_array_foreach(json_object_get(item, "samplers"), k, value) {
      note_user(c, json_object_get(value, "input"), NULL);
      note_user(c, json_object_get(value, "output"), NULL);
    }
  }
}

/* ---- one primitive ---- */

/* Draco's input for one primitive. */
typedef struct packing {
  size_t attribute_count, vertex_count, triangle_count;
  const char *names[MOST_ATTRIBUTES];
  json_int_t accessors[MOST_ATTRIBUTES], indices;
  qmat_draco_attribute attributes[MOST_ATTRIBUTES];
  void *values[MOST_ATTRIBUTES]; /* owned */
  uint32_t *corners;             /* owned */
  size_t position;               /* index of POSITION among the attributes */
  double moved;
} packing;

static void packing_uninit(packing *p) {
  for (size_t i = 0; i < p->attribute_count; i++) qmat_free(p->values[i]);
  qmat_free(p->corners);
}

static bool starts_with(const char *text, const char *start) {
  return strncmp(text, start, strlen(start)) == 0;
}

/* The largest extent of any component. `*largest` gets the largest absolute value. */
static double range_of(const float *values, size_t count, size_t components, double *largest) {
  double range = 0;
  *largest = 0;
  for (size_t k = 0; k < components; k++) {
    double low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < count; i++) {
      low = fmin(low, (double)values[components * i + k]);
      high = fmax(high, (double)values[components * i + k]);
    }
    range = fmax(range, high - low);
    *largest = fmax(*largest, fmax(fabs(low), fabs(high)));
  }
  return range;
}

static void choose_bits(const compressor *c, packing *p, size_t index) {
  qmat_draco_attribute *attribute = &p->attributes[index];
  const char *name = p->names[index];
  attribute->meaning = QMAT_DRACO_GENERIC;
  attribute->bits = OTHER_BITS;
  if (strcmp(name, "POSITION") == 0) {
    double largest;
    const double range = range_of(p->values[index], p->vertex_count, 3, &largest);
    const int bits = qmat_draco_bits_for(3, range, c->error * range);
    attribute->meaning = QMAT_DRACO_POSITION;
    attribute->bits = bits > LEAST_POSITION_BITS ? bits : LEAST_POSITION_BITS;
    /* Half a quantisation step along each axis, plus single-precision rounding. */
    p->moved = sqrt(3) * (range / 2 / (ldexp(1, attribute->bits) - 1) + ldexp(largest + range, -22));
    p->position = index;
  } else if (strcmp(name, "NORMAL") == 0 && attribute->number == QMAT_DRACO_FLOAT) {
    attribute->meaning = QMAT_DRACO_NORMAL;
    attribute->bits = NORMAL_BITS;
  } else if (starts_with(name, "TEXCOORD_")) {
    attribute->meaning = QMAT_DRACO_TEXCOORD;
    attribute->bits = TEXCOORD_BITS;
  } else if (starts_with(name, "COLOR_")) {
    attribute->meaning = QMAT_DRACO_COLOR;
    attribute->bits = COLOR_BITS;
  }
}

static bool draco_number_of(json_int_t type, qmat_draco_number *number) {
  static const qmat_draco_number numbers[] = {QMAT_DRACO_INT8, QMAT_DRACO_UINT8, QMAT_DRACO_INT16, QMAT_DRACO_UINT16};
  *number = type == QMAT_GLTF_FLOAT            ? QMAT_DRACO_FLOAT
            : type <= QMAT_GLTF_UNSIGNED_SHORT ? numbers[type - QMAT_GLTF_BYTE]
                                               : QMAT_DRACO_FLOAT;
  return type == QMAT_GLTF_FLOAT || type <= QMAT_GLTF_UNSIGNED_SHORT;
}

/* Copies an attribute's numbers, tightly packed. `*why` says why it cannot be compressed. */
static qmat_status take_attribute(compressor *c, packing *p, const char *name, const json_t *value, obstacle *why) {
  accessor_view view;
  qmat_draco_number number;
  const json_int_t index = whole_of(value);
  *why = data_obstacle(c, index);
  if (p->attribute_count == MOST_ATTRIBUTES || !view_accessor(c, index, &view) || !draco_number_of(view.type, &number))
    return QMAT_OK;
  const bool is_position = strcmp(name, "POSITION") == 0, is_normal = strcmp(name, "NORMAL") == 0;
  if ((is_position || is_normal) && view.components != 3) return QMAT_OK;
  if ((is_position || is_normal) && number != QMAT_DRACO_FLOAT) {
    if (*why == OBSTACLE_DATA) *why = OBSTACLE_QUANTISED;
    return QMAT_OK;
  }
  if (p->attribute_count > 0 && view.count != p->vertex_count) return QMAT_OK;
  *why = OBSTACLE_SHARED;
  if (c->shared[index]) return QMAT_OK;
  const size_t wide = view.width * view.components;
  uint8_t *values = qmat_alloc(view.count, wide);
  if (!values) return qmat_fail_memory(c->context, "the vertices of a mesh");
  for (size_t i = 0; i < view.count; i++) memcpy(values + i * wide, view.bytes + i * view.stride, wide);
  const size_t which = p->attribute_count++;
  p->vertex_count = view.count;
  p->names[which] = name;
  p->accessors[which] = index;
  p->values[which] = values;
  p->attributes[which] = (qmat_draco_attribute){.number = number, .components = (int)view.components, .values = values};
  *why = OBSTACLE_NONE;
  const float *floats = p->values[which];
  for (size_t i = 0; number == QMAT_DRACO_FLOAT && i < view.count * view.components; i++)
    if (!isfinite(floats[i])) *why = OBSTACLE_DATA;
  if (*why == OBSTACLE_NONE) choose_bits(c, p, which);
  return QMAT_OK;
}

static qmat_status take_corners(compressor *c, packing *p, const json_t *value, obstacle *why) {
  accessor_view view;
  p->indices = whole_of(value);
  *why = data_obstacle(c, p->indices);
  if (!view_accessor(c, p->indices, &view) || view.components != 1 || view.count % 3 != 0 ||
      (view.type != QMAT_GLTF_UNSIGNED_BYTE && view.type != QMAT_GLTF_UNSIGNED_SHORT &&
       view.type != QMAT_GLTF_UNSIGNED_INT))
    return QMAT_OK;
  *why = OBSTACLE_SHARED;
  if (c->shared[p->indices]) return QMAT_OK;
  p->corners = qmat_calloc(view.count, sizeof *p->corners);
  if (!p->corners) return qmat_fail_memory(c->context, "the triangles of a mesh");
  p->triangle_count = view.count / 3;
  *why = OBSTACLE_NONE;
  for (size_t i = 0; i < view.count; i++) {
    for (size_t k = 0; k < view.width; k++) p->corners[i] |= (uint32_t)view.bytes[i * view.stride + k] << (8 * k);
    if (p->corners[i] >= p->vertex_count) *why = OBSTACLE_DATA;
  }
  return QMAT_OK;
}

static qmat_status take_primitive(compressor *c, const json_t *primitive, packing *p, obstacle *why) {
  const json_t *indices = json_object_get(primitive, "indices"), *attributes = json_object_get(primitive, "attributes");
  *why = OBSTACLE_NONE;
  if (json_object_get(json_object_get(primitive, "extensions"), QMAT_GLTF_DRACO))
    *why = OBSTACLE_COMPRESSED;
  else if (json_object_get(primitive, "targets"))
    *why = OBSTACLE_TARGETS;
  else if (whole(primitive, "mode", 4) != 4 || !indices || !json_object_get(attributes, "POSITION"))
    *why = OBSTACLE_NO_TRIANGLES;
  const char *name;
  json_t *value;
  qmat_status status = QMAT_OK;
  json_object_foreach((json_t *)(uintptr_t)attributes, name, value) {
    if (*why == OBSTACLE_NONE && status == QMAT_OK) status = take_attribute(c, p, name, value, why);
  }
  if (status == QMAT_OK && *why == OBSTACLE_NONE) status = take_corners(c, p, indices, why);
  return status;
}

/* Updates the accessors to the decoded data. */
static qmat_status describe(compressor *c, const packing *p, const uint8_t *bytes, size_t size) {
  qmat_draco_mesh *mesh;
  qmat_status status = qmat_draco_mesh_new(c->context, bytes, size, &mesh);
  if (status != QMAT_OK) return status;
  const size_t points = qmat_draco_mesh_point_count(mesh), faces = qmat_draco_mesh_face_count(mesh);
  json_t *accessors = json_object_get(c->root, "accessors");
  double *positions = qmat_alloc(3 * points, sizeof *positions), low[3], high[3];
  if (!positions) status = qmat_fail_memory(c->context, "the positions of a mesh");
  if (status == QMAT_OK) status = qmat_draco_mesh_attribute(c->context, mesh, (uint32_t)p->position, 3, positions);
  bool done = true;
  for (size_t i = 0; i <= p->attribute_count && status == QMAT_OK; i++) {
    const bool is_index = i == p->attribute_count;
    json_t *accessor = json_array_get(accessors, (size_t)(is_index ? p->indices : p->accessors[i]));
    static const char *const gone[] = {"bufferView", "byteOffset", "min", "max"};
    for (size_t k = 0; k < sizeof gone / sizeof *gone; k++) json_object_del(accessor, gone[k]);
    done =
        json_object_set_new(accessor, "count", json_integer((json_int_t)(is_index ? 3 * faces : points))) == 0 && done;
    const json_int_t held = (json_int_t)json_number_value(json_object_get(accessor, "componentType"));
    const json_int_t needed = points > 65535 ? QMAT_GLTF_UNSIGNED_INT
                              : points > 255 ? QMAT_GLTF_UNSIGNED_SHORT
                                             : QMAT_GLTF_UNSIGNED_BYTE;
    if (is_index && held < needed) /* wider types have larger numbers */
      done = json_object_set_new(accessor, "componentType", json_integer(needed)) == 0 && done;
    if (is_index || i != p->position) continue;
    for (size_t k = 0; k < 3; k++) {
      low[k] = INFINITY;
      high[k] = -INFINITY;
      for (size_t v = 0; v < points; v++) {
        low[k] = fmin(low[k], positions[3 * v + k]);
        high[k] = fmax(high[k], positions[3 * v + k]);
      }
    }
    done = json_object_set_new(accessor, "min", json_pack("[f, f, f]", low[0], low[1], low[2])) == 0 && done;
    done = json_object_set_new(accessor, "max", json_pack("[f, f, f]", high[0], high[1], high[2])) == 0 && done;
  }
  qmat_free(positions);
  qmat_draco_mesh_free(mesh);
  return status == QMAT_OK && !done ? qmat_fail_memory(c->context, "a glTF file") : status;
}

/* A primitive's Draco extension. `view` counts from the first new buffer view. */
static json_t *make_extension(const packing *p, size_t view) {
  json_t *ids = json_object();
  bool done = ids != NULL;
  for (size_t i = 0; i < p->attribute_count; i++)
    done = done && json_object_set_new(ids, p->names[i], json_integer((json_int_t)i)) == 0;
  if (done) return json_pack("{s:I, s:o}", "bufferView", (json_int_t)view, "attributes", ids);
  json_decref(ids);
  return NULL;
}

static qmat_status pack(compressor *c, const packing *p, json_t **extension, obstacle *why) {
  uint8_t *bytes = NULL;
  size_t size = 0;
  *extension = NULL;
  qmat_status status = qmat_draco_encode(c->context, p->attributes, p->attribute_count, p->vertex_count, p->corners,
                                         p->triangle_count, false, &bytes, &size);
  if (status == QMAT_ERROR_DEPENDENCY) { /* for example, all triangles are degenerate */
    *why = OBSTACLE_REFUSED;
    return QMAT_OK;
  }
  if (status == QMAT_OK) status = describe(c, p, bytes, size);
  if (status == QMAT_OK) {
    json_t *view = json_pack("{s:i, s:I, s:I}", "buffer", 0, "byteOffset", (json_int_t)c->blobs.size, "byteLength",
                             (json_int_t)size);
    *extension = make_extension(p, json_array_size(c->new_views));
    qmat_put_bytes(&c->blobs, bytes, size);
    qmat_gltf_pad(&c->blobs, 0);
    if (!*extension || json_array_append_new(c->new_views, view) != 0 || c->blobs.failed)
      status = qmat_fail_memory(c->context, "a glTF file");
  }
  qmat_free(bytes);
  return status;
}

/* The accessor of a primitive's positions; -1: none. */
static json_int_t position_of(const compressor *c, const json_t *primitive) {
  const json_int_t position = whole(json_object_get(primitive, "attributes"), "POSITION", -1);
  return position < (json_int_t)c->accessor_count ? position : -1;
}

/* A primitive of the same geometry that is already compressed; NULL: none. */
static const json_t *find_twin(const compressor *c, const json_t *primitive) {
  const json_int_t position = position_of(c, primitive);
  return position >= 0 && c->moved[position] >= 0 && same_geometry(c->users[position], primitive) ? c->users[position]
                                                                                                  : NULL;
}

/* `number` counts primitives over all meshes. */
static qmat_status compress_primitive(compressor *c, json_t *primitive, size_t mesh, size_t number) {
  packing p = {0};
  obstacle why = OBSTACLE_NONE;
  json_t *extension = NULL;
  const json_t *twin = find_twin(c, primitive);
  qmat_status status = QMAT_OK;
  if (twin) {
    extension = json_deep_copy(json_object_get(json_object_get(twin, "extensions"), QMAT_GLTF_DRACO));
    if (!extension) return qmat_fail_memory(c->context, "a glTF file");
  } else {
    status = take_primitive(c, primitive, &p, &why);
    if (status == QMAT_OK && why == OBSTACLE_NONE) status = pack(c, &p, &extension, &why);
    if (extension) c->moved[position_of(c, primitive)] = p.moved;
  }
  if (extension) c->result->moved[mesh] = fmax(c->result->moved[mesh], c->moved[position_of(c, primitive)]);
  packing_uninit(&p);
  if (status == QMAT_OK && extension) {
    json_t *extensions = json_object_get(primitive, "extensions");
    if (!extensions && json_object_set_new(primitive, "extensions", json_object()) == 0)
      extensions = json_object_get(primitive, "extensions");
    if (json_object_set(extensions, QMAT_GLTF_DRACO, extension) != 0)
      status = qmat_fail_memory(c->context, "a glTF file");
    c->fresh[number] = true;
    c->result->primitives++;
  } else if (status == QMAT_OK) {
    c->result->left++;
    c->left[why]++;
  }
  json_decref(extension);
  return status;
}

/* ---- the chunk ---- */

/* Extensions that refer to data only in places that this file handles, or not at all. */
static bool is_harmless(const char *name) {
  static const char *const starts[] = {
      "KHR_materials_", "KHR_lights_punctual",   "KHR_texture_", "KHR_xmp",
      "EXT_texture_",   "KHR_animation_pointer", "KHR_node_",    "KHR_mesh_quantization",
      "KHR_physics_",   "KHR_implicit_shapes",   "OMI_physics_", QMAT_GLTF_DRACO};
  for (size_t i = 0; i < sizeof starts / sizeof *starts; i++)
    if (starts_with(name, starts[i])) return true;
  return false;
}

/* Calls `visit` for every object that may refer to an old buffer view. */
static void for_each_view(const compressor *c, void (*visit)(void *user, json_t *owner), void *user) {
  size_t i, k, number = 0;
  json_t *item, *primitive;
  json_array_foreach(json_object_get(c->root, "accessors"), i, item) {
    json_t *sparse = json_object_get(item, "sparse");
    visit(user, item);
    if (sparse) visit(user, json_object_get(sparse, "indices"));
    if (sparse) visit(user, json_object_get(sparse, "values"));
  }
  json_array_foreach(json_object_get(c->root, "images"), i, item) visit(user, item);
  json_array_foreach(json_object_get(c->root, "meshes"), i, item) {
    json_array_foreach(json_object_get(item, "primitives"), k, primitive) {
      json_t *extension = json_object_get(json_object_get(primitive, "extensions"), QMAT_GLTF_DRACO);
      if (!c->fresh[number++] && extension) visit(user, extension);
    }
  }
}

/* The old buffer views: used before, used after compression, and their new numbers. */
typedef struct view_table {
  size_t count;
  bool *was_used, *is_used;
  json_int_t *numbers; /* of the views that stay */
  bool failed;
} view_table;

static void mark(bool *used, size_t count, const json_t *owner) {
  const json_int_t view = whole(owner, "bufferView", -1);
  if (view >= 0 && (size_t)view < count) used[view] = true;
}

static void mark_before(void *user, json_t *owner) {
  view_table *table = user;
  mark(table->was_used, table->count, owner);
}

static void mark_after(void *user, json_t *owner) {
  view_table *table = user;
  mark(table->is_used, table->count, owner);
}

static void renumber(void *user, json_t *owner) {
  view_table *table = user;
  const json_int_t view = whole(owner, "bufferView", -1);
  if (view < 0 || (size_t)view >= table->count) return;
  if (json_object_set_new(owner, "bufferView", json_integer(table->numbers[view])) != 0) table->failed = true;
}

/* Sets the marks of a view's bytes in the chunk. */
static void mark_bytes(const compressor *c, const json_t *view, uint8_t *marks, uint8_t with) {
  const json_int_t start = whole(view, "byteOffset", 0), length = whole(view, "byteLength", -1),
                   most = (json_int_t)c->size;
  if (whole(view, "buffer", -1) != 0 || start < 0 || length < 0 || start > most || length > most - start) return;
  memset(marks + start, with, (size_t)length);
}

/* Removes unused bytes from the chunk, 4 at a time to preserve alignment, and appends the new data. For each 4 bytes,
 * `moved_by` gets the number of bytes removed before them. */
static bool rebuild_chunk(compressor *c, const view_table *table, size_t *moved_by) {
  const json_t *views = json_object_get(c->root, "bufferViews");
  const size_t words = (c->size + 3) / 4;
  uint8_t *gone = qmat_calloc(4 * words, 1);
  qmat_writer chunk = {0};
  bool done = gone != NULL;
  for (size_t i = 0; i < table->count && done; i++)
    if (table->was_used[i] && !table->is_used[i]) mark_bytes(c, json_array_get(views, i), gone, 1);
  for (size_t i = 0; i < table->count && done; i++)
    if (!table->was_used[i] || table->is_used[i]) mark_bytes(c, json_array_get(views, i), gone, 0);
  size_t taken = 0;
  for (size_t w = 0; w < words && done; w++) {
    moved_by[w] = taken;
    const uint8_t *word = gone + 4 * w;
    /* The last word may be incomplete. */
    const size_t held = 4 * w + 4 <= c->size ? 4 : c->size - 4 * w;
    if (held == 4 && word[0] && word[1] && word[2] && word[3]) {
      taken += 4;
    } else {
      qmat_put_bytes(&chunk, c->chunk + 4 * w, held);
    }
  }
  qmat_gltf_pad(&chunk, 0);
  size_t i;
  json_t *view;
  json_array_foreach(c->new_views, i, view) {
    const json_int_t offset = whole(view, "byteOffset", 0) + (json_int_t)chunk.size;
    done = done && json_object_set_new(view, "byteOffset", json_integer(offset)) == 0;
  }
  if (done) qmat_put_bytes(&chunk, c->blobs.bytes, c->blobs.size);
  qmat_free(gone);
  done = done && !chunk.failed;
  if (done) {
    c->result->chunk = chunk.bytes;
    c->result->chunk_size = chunk.size;
  } else {
    qmat_writer_uninit(&chunk);
  }
  return done;
}

/* Removes views that are no longer used, moves the others, and adds the new ones. */
static bool place_views(compressor *c, view_table *table, const size_t *moved_by) {
  json_t *views = json_object_get(c->root, "bufferViews"), *kept = json_array();
  bool done = kept != NULL;
  for (size_t i = 0; i < table->count && done; i++) {
    if (table->was_used[i] && !table->is_used[i]) continue;
    json_t *view = json_array_get(views, i);
    const json_int_t offset = whole(view, "byteOffset", 0);
    table->numbers[i] = (json_int_t)json_array_size(kept);
    const size_t moved =
        whole(view, "buffer", -1) == 0 && offset >= 0 && (size_t)offset < c->size ? moved_by[offset / 4] : 0;
    if (moved > 0) done = json_object_set_new(view, "byteOffset", json_integer(offset - (json_int_t)moved)) == 0;
    done = json_array_append(kept, view) == 0 && done;
  }
  const size_t first = json_array_size(kept);
  done = done && json_array_extend(kept, c->new_views) == 0;
  if (done) for_each_view(c, renumber, table);
  size_t i, k, number = 0;
  json_t *mesh, *primitive;
  json_array_foreach(json_object_get(c->root, "meshes"), i, mesh) {
    json_array_foreach(json_object_get(mesh, "primitives"), k, primitive) {
      if (!c->fresh[number++]) continue;
      json_t *extension = json_object_get(json_object_get(primitive, "extensions"), QMAT_GLTF_DRACO);
      const json_int_t view = whole(extension, "bufferView", 0) + (json_int_t)first;
      done = json_object_set_new(extension, "bufferView", json_integer(view)) == 0 && done;
    }
  }
  done = done && !table->failed && json_object_set(c->root, "bufferViews", kept) == 0;
  json_decref(kept);
  return done;
}

static qmat_status finish(compressor *c, view_table *table) {
  size_t *moved_by = qmat_alloc((c->size + 3) / 4, sizeof *moved_by);
  json_t *buffer = json_array_get(json_object_get(c->root, "buffers"), 0);
  for_each_view(c, mark_after, table);
  bool done = moved_by && rebuild_chunk(c, table, moved_by) && place_views(c, table, moved_by);
  done = done && json_object_set_new(buffer, "byteLength", json_integer((json_int_t)c->result->chunk_size)) == 0 &&
         qmat_gltf_require_extension(c->root, QMAT_GLTF_DRACO);
  qmat_free(moved_by);
  return done ? QMAT_OK : qmat_fail_memory(c->context, "a glTF file");
}

/* ---- the asset ---- */

static qmat_status compress_meshes(compressor *c) {
  qmat_status status = QMAT_OK;
  size_t i, k, number = 0;
  json_t *mesh, *primitive;
  json_array_foreach(json_object_get(c->root, "meshes"), i, mesh) {
    json_array_foreach(json_object_get(mesh, "primitives"), k, primitive) {
      if (status == QMAT_OK) status = compress_primitive(c, primitive, i, number++);
    }
  }
  return status;
}

static size_t count_primitives(const json_t *root) {
  const json_t *meshes = json_object_get(root, "meshes");
  size_t count = 0;
  for (size_t i = 0; i < json_array_size(meshes); i++)
    count += json_array_size(json_object_get(json_array_get(meshes, i), "primitives"));
  return count;
}

static qmat_status add_notes(const compressor *c, json_t *notes) {
  for (size_t why = 0; why < OBSTACLE_COUNT; why++) {
    if (c->left[why] == 0) continue;
    const bool one = c->left[why] == 1;
    json_t *text =
        json_sprintf("%zu primitive%s unchanged: %s", c->left[why], one ? " is" : "s are", obstacle_texts[why]);
    if (json_array_append_new(notes, text) != 0) return qmat_fail_memory(c->context, "the report");
  }
  return QMAT_OK;
}

/* The first used extension that may refer to the data in an unknown way; NULL: none. */
static const char *find_unknown(const json_t *root) {
  const json_t *names = json_object_get(root, "extensionsUsed");
  for (size_t i = 0; i < json_array_size(names); i++) {
    const char *name = json_string_value(json_array_get(names, i));
    if (name && !is_harmless(name)) return name;
  }
  return NULL;
}

qmat_status qmat_gltf_compress(qmat_context *context, json_t *root, const uint8_t *chunk, size_t size, double error,
                               json_t *notes, qmat_gltf_compressed *compressed) {
  *compressed = (qmat_gltf_compressed){.mesh_count = json_array_size(json_object_get(root, "meshes"))};
  const char *unknown = find_unknown(root);
  if (unknown) {
    const int failed = json_array_append_new(
        notes, json_sprintf("the meshes are unchanged: the extension %s may refer to their data", unknown));
    return failed ? qmat_fail_memory(context, "the report") : QMAT_OK;
  }
  compressor c = {.context = context, .root = root, .chunk = chunk, .size = size, .error = error, .result = compressed};
  view_table table = {.count = json_array_size(json_object_get(root, "bufferViews"))};
  c.accessor_count = json_array_size(json_object_get(root, "accessors"));
  c.users = qmat_calloc(c.accessor_count, sizeof *c.users);
  c.shared = qmat_calloc(c.accessor_count, sizeof *c.shared);
  c.moved = qmat_alloc(c.accessor_count, sizeof *c.moved);
  c.fresh = qmat_calloc(count_primitives(root), sizeof *c.fresh);
  c.new_views = json_array();
  compressed->moved = qmat_calloc(compressed->mesh_count, sizeof *compressed->moved);
  table.was_used = qmat_calloc(table.count, sizeof *table.was_used);
  table.is_used = qmat_calloc(table.count, sizeof *table.is_used);
  table.numbers = qmat_calloc(table.count, sizeof *table.numbers);
  qmat_status status = QMAT_OK;
  if (!c.users || !c.shared || !c.moved || !c.fresh || !c.new_views || !compressed->moved || !table.was_used ||
      !table.is_used || !table.numbers)
    status = qmat_fail_memory(context, "a glTF file");
  if (status == QMAT_OK) {
    for (size_t i = 0; i < c.accessor_count; i++) c.moved[i] = -1;
    for_each_view(&c, mark_before, &table);
    note_users(&c);
    status = compress_meshes(&c);
  }
  if (status == QMAT_OK && compressed->primitives > 0) status = finish(&c, &table);
  if (status == QMAT_OK) status = add_notes(&c, notes);
  qmat_writer_uninit(&c.blobs);
  json_decref(c.new_views);
  qmat_free(c.users);
  qmat_free(c.shared);
  qmat_free(c.moved);
  qmat_free(c.fresh);
  qmat_free(table.was_used);
  qmat_free(table.is_used);
  qmat_free(table.numbers);
  return status;
}

void qmat_gltf_compressed_uninit(qmat_gltf_compressed *compressed) {
  qmat_free(compressed->chunk);
  qmat_free(compressed->moved);
  *compressed = (qmat_gltf_compressed){0};
}
