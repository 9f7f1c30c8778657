/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/value.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/node.h"

/* One table per value type describes its content; freeing, counting, the binary form, the digest and the checks that
 * hold for every type come from it.
 *
 * The binary form, all numbers little-endian: "QMAT", u32 form version, text type name, then each row in the order of
 * its table: text row name, u8 element, u64 size, that many bytes. A text is a u32 size and its bytes. */

static const uint8_t MAGIC[4] = {'Q', 'M', 'A', 'T'};
enum { FORM_VERSION = 1, JSON_FLAGS = JSON_SORT_KEYS | JSON_COMPACT | JSON_REAL_PRECISION(17) };

/* The numbers are part of the binary form. */
typedef enum element {
  ELEMENT_U32 = 2,     /* array of uint32_t */
  ELEMENT_F64 = 3,     /* array of double */
  ELEMENT_TEXT = 4,    /* char *, NUL-terminated */
  ELEMENT_JSON = 5,    /* json_t *, an object */
  ELEMENT_BOOL = 6,    /* bool, one byte 0 or 1 */
  ELEMENT_ENUM = 7,    /* an enum, as u32 */
  ELEMENT_SIZE = 8,    /* size_t that is no row's count, as u64 */
  ELEMENT_PARTS = 9,   /* qmat_file_part array: u64 count, then per part text name, u64 size, bytes */
  ELEMENT_NUMBER = 10, /* one double */
  ELEMENT_ITEMS = 11,  /* qmat_value * array: per value the u64 size of its binary form, and its digest */
  ELEMENT_NAMES = 12   /* char * array: texts */
} element;

typedef struct row {
  const char *name;
  element element;
  size_t offset;
  size_t count_offset; /* arrays: where the count (size_t) stands */
  size_t components;   /* arrays: elements per count */
} row;

#define ARRAY(type, field, kind, count, components) \
  { #field, ELEMENT_##kind, offsetof(type, field), offsetof(type, count), components }
#define SCALAR(type, field, kind) \
  { #field, ELEMENT_##kind, offsetof(type, field), 0, 0 }
#define END \
  { NULL, ELEMENT_U32, 0, 0, 0 }

static const row scene_rows[] = {SCALAR(qmat_scene, name, TEXT),
                                 SCALAR(qmat_scene, format, TEXT),
                                 SCALAR(qmat_scene, meters_per_unit, NUMBER),
                                 SCALAR(qmat_scene, is_z_up, BOOL),
                                 ARRAY(qmat_scene, parts, PARTS, part_count, 1),
                                 ARRAY(qmat_scene, meshes, U32, mesh_count, 1),
                                 END};
static const row mesh_rows[] = {ARRAY(qmat_mesh, positions, F64, vertex_count, 3),
                                ARRAY(qmat_mesh, triangles, U32, triangle_count, 3),
                                SCALAR(qmat_mesh, closed, BOOL),
                                SCALAR(qmat_mesh, oriented, BOOL),
                                SCALAR(qmat_mesh, deviation, NUMBER),
                                ARRAY(qmat_mesh, cage.surface_faces, U32, cage.surface_count, 1),
                                ARRAY(qmat_mesh, cage.schemes, U32, cage.surface_count, 1),
                                ARRAY(qmat_mesh, cage.boundaries, U32, cage.surface_count, 1),
                                ARRAY(qmat_mesh, cage.positions, F64, cage.vertex_count, 3),
                                ARRAY(qmat_mesh, cage.face_sizes, U32, cage.face_count, 1),
                                ARRAY(qmat_mesh, cage.corners, U32, cage.corner_count, 1),
                                ARRAY(qmat_mesh, cage.holes, U32, cage.hole_count, 1),
                                ARRAY(qmat_mesh, cage.creases, U32, cage.crease_count, 2),
                                ARRAY(qmat_mesh, cage.crease_sharpness, F64, cage.crease_count, 1),
                                ARRAY(qmat_mesh, cage.sharp_vertices, U32, cage.sharp_count, 1),
                                ARRAY(qmat_mesh, cage.vertex_sharpness, F64, cage.sharp_count, 1),
                                END};
static const row field_rows[] = {ARRAY(qmat_field, values, F64, count, 1), SCALAR(qmat_field, domain, ENUM),
                                 SCALAR(qmat_field, unit, TEXT), END};
static const row samples_rows[] = {
    ARRAY(qmat_samples, positions, F64, count, 3), ARRAY(qmat_samples, facets, U32, count, 1),
    ARRAY(qmat_samples, barycentrics, F64, count, 3), SCALAR(qmat_samples, vertex_count, SIZE), END};
static const row medial_rows[] = {ARRAY(qmat_medial, spheres, F64, sphere_count, 4),
                                  ARRAY(qmat_medial, edges, U32, edge_count, 2),
                                  ARRAY(qmat_medial, triangles, U32, triangle_count, 3),
                                  ARRAY(qmat_medial, region_offsets, U32, region_offset_count, 1),
                                  ARRAY(qmat_medial, region_samples, U32, region_sample_count, 1),
                                  END};
static const row chain_rows[] = {
    ARRAY(qmat_chain, spheres, F64, sphere_count, 4),     ARRAY(qmat_chain, edges, U32, edge_count, 2),
    ARRAY(qmat_chain, triangles, U32, triangle_count, 3), ARRAY(qmat_chain, owners, U32, sample_count, 1),
    ARRAY(qmat_chain, ends, U32, collapse_count, 2),      ARRAY(qmat_chain, merged, F64, collapse_count, 4),
    ARRAY(qmat_chain, errors, F64, collapse_count, 1),    END};
static const row report_rows[] = {SCALAR(qmat_report, root, JSON), END};
static const row file_rows[] = {SCALAR(qmat_file, format, TEXT), ARRAY(qmat_file, parts, PARTS, part_count, 1), END};
static const row failure_rows[] = {SCALAR(qmat_failure, reason, TEXT), END};
static const row list_rows[] = {ARRAY(qmat_list, items, ITEMS, count, 1), ARRAY(qmat_list, names, NAMES, count, 1),
                                END};

static qmat_status check_scene(qmat_context *context, const qmat_value *value);
static qmat_status check_mesh(qmat_context *context, const qmat_value *value);
static qmat_status check_field(qmat_context *context, const qmat_value *value);
static qmat_status check_samples(qmat_context *context, const qmat_value *value);
static qmat_status check_medial(qmat_context *context, const qmat_value *value);
static qmat_status check_chain(qmat_context *context, const qmat_value *value);
static qmat_status check_report(qmat_context *context, const qmat_value *value);
static qmat_status check_file(qmat_context *context, const qmat_value *value);
static qmat_status check_failure(qmat_context *context, const qmat_value *value);
static qmat_status check_list(qmat_context *context, const qmat_value *value);

typedef struct value_type {
  const char *name;
  size_t size;
  const row *rows;
  qmat_status (*check)(qmat_context *context, const qmat_value *value); /* what the content means */
} value_type;

static const value_type value_types[QMAT_VALUE_TYPE_COUNT] = {
    [QMAT_SCENE] = {"scene", sizeof(qmat_scene), scene_rows, check_scene},
    [QMAT_MESH] = {"mesh", sizeof(qmat_mesh), mesh_rows, check_mesh},
    [QMAT_FIELD] = {"field", sizeof(qmat_field), field_rows, check_field},
    [QMAT_SAMPLES] = {"samples", sizeof(qmat_samples), samples_rows, check_samples},
    [QMAT_MEDIAL] = {"medial", sizeof(qmat_medial), medial_rows, check_medial},
    [QMAT_CHAIN] = {"chain", sizeof(qmat_chain), chain_rows, check_chain},
    [QMAT_REPORT] = {"report", sizeof(qmat_report), report_rows, check_report},
    [QMAT_FILE] = {"file", sizeof(qmat_file), file_rows, check_file},
    [QMAT_FAILURE] = {"failure", sizeof(qmat_failure), failure_rows, check_failure},
    [QMAT_LIST] = {"list", sizeof(qmat_list), list_rows, check_list},
};

_Static_assert(sizeof(double) == 8 && sizeof(qmat_domain) == 4, "the sizes that the binary form takes for granted");

static const row *rows_of(const qmat_value *value) {
  return value_types[value->type].rows;
}

static bool is_array(const row *r) {
  return r->components > 0;
}

/* Bytes of one element in memory; 0 for what is not a flat array. */
static size_t element_size(element kind) {
  switch (kind) {
    case ELEMENT_U32:
      return 4;
    case ELEMENT_F64:
      return 8;
    case ELEMENT_PARTS:
      return sizeof(qmat_file_part);
    case ELEMENT_ITEMS:
    case ELEMENT_NAMES:
      return sizeof(void *);
    default:
      return 0;
  }
}

static const void *slot(const qmat_value *value, size_t offset) {
  return (const char *)value + offset;
}

static void *mutable_slot(qmat_value *value, size_t offset) {
  return (char *)value + offset;
}

/* The pointer that a row describes: its array, text or JSON. */
static void *pointer_of(const qmat_value *value, const row *r) {
  void *pointer;
  memcpy(&pointer, slot(value, r->offset), sizeof pointer);
  return pointer;
}

static void set_pointer(qmat_value *value, const row *r, void *pointer) {
  memcpy(mutable_slot(value, r->offset), &pointer, sizeof pointer);
}

static size_t count_of(const qmat_value *value, const row *r) {
  return *(const size_t *)slot(value, r->count_offset);
}

static bool has_pointer(const row *r) {
  return is_array(r) || r->element == ELEMENT_TEXT || r->element == ELEMENT_JSON;
}

/* Making and freeing. */

static void *value_new(qmat_value_type type) {
  qmat_value *value = qmat_calloc(1, value_types[type].size);
  if (!value) return NULL;
  value->type = type;
  atomic_init(&value->references, 1);
  return value;
}

qmat_scene *qmat_scene_new(void) {
  return value_new(QMAT_SCENE);
}

qmat_mesh *qmat_mesh_new(void) {
  return value_new(QMAT_MESH);
}

qmat_field *qmat_field_new(void) {
  return value_new(QMAT_FIELD);
}

qmat_samples *qmat_samples_new(void) {
  return value_new(QMAT_SAMPLES);
}

qmat_medial *qmat_medial_new(void) {
  return value_new(QMAT_MEDIAL);
}

qmat_chain *qmat_chain_new(void) {
  return value_new(QMAT_CHAIN);
}

qmat_report *qmat_report_new(void) {
  qmat_report *report = value_new(QMAT_REPORT);
  if (!report) return NULL;
  report->root = json_object();
  if (!report->root) {
    qmat_value_release(&report->base);
    return NULL;
  }
  return report;
}

qmat_file *qmat_file_new(void) {
  return value_new(QMAT_FILE);
}

qmat_failure *qmat_failure_new(void) {
  return value_new(QMAT_FAILURE);
}

qmat_list *qmat_list_new(size_t count) {
  qmat_list *list = value_new(QMAT_LIST);
  if (!list) return NULL;
  list->items = qmat_calloc(count, sizeof *list->items);
  list->names = qmat_calloc(count, sizeof *list->names);
  if (list->items && list->names) {
    list->count = count;
    return list;
  }
  qmat_value_release(&list->base);
  return NULL;
}

size_t qmat_value_count(const qmat_value *value) {
  if (!value) return 0;
  return value->type == QMAT_LIST ? ((const qmat_list *)value)->count : 1;
}

const qmat_value *qmat_value_at(const qmat_value *value, size_t index) {
  return value->type == QMAT_LIST ? ((const qmat_list *)value)->items[index] : value;
}

qmat_value_type qmat_value_item_type(const qmat_value *value) {
  size_t index = 0;
  while (index + 1 < qmat_value_count(value) && qmat_value_at(value, index)->type == QMAT_FAILURE) index++;
  return qmat_value_at(value, index)->type;
}

const char *qmat_value_failure(const qmat_value *value) {
  return value->type == QMAT_FAILURE ? ((const qmat_failure *)value)->reason : NULL;
}

qmat_value *qmat_failure_of_error(qmat_context *context) {
  qmat_error error = context->error;
  char reason[2048];
  error.node_id[0] = error.file[0] = '\0';
  qmat_error_format(&error, reason, sizeof reason);
  for (char *c = reason; !qmat_is_utf8(reason) && *c != '\0'; c++) {
    if ((unsigned char)*c >= 0x80) *c = '?';
  }
  qmat_failure *failure = qmat_failure_new();
  if (failure) failure->reason = qmat_strdup(reason);
  if (!failure || !failure->reason) {
    qmat_fail_memory(context, "the reason of a failure");
  } else if (qmat_value_seal(context, &failure->base) == QMAT_OK) {
    return &failure->base;
  }
  if (failure) qmat_value_release(&failure->base);
  return NULL;
}

char *qmat_strdup(const char *text) {
  const size_t size = strlen(text) + 1;
  char *copy = qmat_alloc(size, 1);
  if (copy) memcpy(copy, text, size);
  return copy;
}

qmat_value *qmat_value_retain(const qmat_value *value) {
  qmat_value *shared = (qmat_value *)value; /* the count of readers is the one part of a sealed value that changes */
  if (shared) atomic_fetch_add_explicit(&shared->references, 1, memory_order_relaxed);
  return shared;
}

void qmat_value_release(qmat_value *value) {
  if (!value || atomic_fetch_sub_explicit(&value->references, 1, memory_order_acq_rel) != 1) return;
  for (const row *r = rows_of(value); r->name != NULL; r++) {
    if (!has_pointer(r)) continue;
    void *pointer = pointer_of(value, r);
    if (r->element == ELEMENT_JSON) {
      json_decref(pointer);
      continue;
    }
    if (r->element == ELEMENT_PARTS && pointer) {
      const qmat_file_part *parts = pointer;
      for (size_t i = 0; i < count_of(value, r); i++) {
        qmat_free(parts[i].name);
        qmat_free(parts[i].bytes);
      }
    }
    for (size_t i = 0; r->element == ELEMENT_ITEMS && pointer && i < count_of(value, r); i++)
      qmat_value_release(((qmat_value **)pointer)[i]);
    for (size_t i = 0; r->element == ELEMENT_NAMES && pointer && i < count_of(value, r); i++)
      qmat_free(((char **)pointer)[i]);
    qmat_free(pointer);
  }
  qmat_free(value);
}

const char *qmat_value_type_name(qmat_value_type type) {
  return (unsigned)type < QMAT_VALUE_TYPE_COUNT ? value_types[type].name : "unknown";
}

/* Writing the binary form: into a hash, into memory, or nowhere, to learn its size. */

typedef struct sink {
  qmat_hasher *hasher;
  uint8_t *bytes;
  size_t used;
} sink;

static void put(sink *to, const void *bytes, size_t size) {
  if (size == 0) return;
  if (to->hasher) qmat_hasher_add(to->hasher, bytes, size);
  if (to->bytes) memcpy(to->bytes + to->used, bytes, size);
  to->used += size;
}

static void encode_u32(uint8_t *to, uint32_t number) {
  for (int i = 0; i < 4; i++) to[i] = (uint8_t)(number >> (8 * i));
}

static void encode_u64(uint8_t *to, uint64_t number) {
  for (int i = 0; i < 8; i++) to[i] = (uint8_t)(number >> (8 * i));
}

static uint32_t decode_u32(const uint8_t *from) {
  uint32_t number = 0;
  for (int i = 0; i < 4; i++) number |= (uint32_t)from[i] << (8 * i);
  return number;
}

static uint64_t decode_u64(const uint8_t *from) {
  uint64_t number = 0;
  for (int i = 0; i < 8; i++) number |= (uint64_t)from[i] << (8 * i);
  return number;
}

static void put_u32(sink *to, uint32_t number) {
  uint8_t bytes[4];
  encode_u32(bytes, number);
  put(to, bytes, sizeof bytes);
}

static void put_u64(sink *to, uint64_t number) {
  uint8_t bytes[8];
  encode_u64(bytes, number);
  put(to, bytes, sizeof bytes);
}

static void put_text(sink *to, const char *text) {
  const size_t length = strlen(text);
  put_u32(to, (uint32_t)length);
  put(to, text, length);
}

static void put_array(sink *to, element kind, const void *array, size_t length) {
  enum { CHUNK = 512 };
  const size_t size = element_size(kind);
  if (!to->hasher && !to->bytes) {
    to->used += length * size;
    return;
  }
  uint8_t bytes[CHUNK * 8];
  for (size_t start = 0; start < length; start += CHUNK) {
    const size_t count = length - start < CHUNK ? length - start : CHUNK;
    if (kind == ELEMENT_U32) {
      const uint32_t *numbers = (const uint32_t *)array + start;
      for (size_t i = 0; i < count; i++) encode_u32(bytes + 4 * i, numbers[i]);
    } else {
      const double *numbers = (const double *)array + start;
      for (size_t i = 0; i < count; i++) {
        uint64_t bits;
        memcpy(&bits, &numbers[i], sizeof bits);
        encode_u64(bytes + 8 * i, bits);
      }
    }
    put(to, bytes, count * size);
  }
}

static int put_json(const char *text, size_t size, void *to) {
  put(to, text, size);
  return 0;
}

static bool write_rows(sink *to, const qmat_value *value);

/* The bytes of one row's content. False when the JSON cannot be written. */
static bool write_content(sink *to, const qmat_value *value, const row *r) {
  const void *place = slot(value, r->offset);
  switch (r->element) {
    case ELEMENT_U32:
    case ELEMENT_F64:
      put_array(to, r->element, pointer_of(value, r), count_of(value, r) * r->components);
      return true;
    case ELEMENT_TEXT: {
      const char *text = pointer_of(value, r);
      put(to, text, strlen(text));
      return true;
    }
    case ELEMENT_JSON:
      return json_dump_callback(pointer_of(value, r), put_json, to, JSON_FLAGS) == 0;
    case ELEMENT_BOOL:
      put(to, *(const bool *)place ? "\1" : "\0", 1);
      return true;
    case ELEMENT_ENUM:
      put_u32(to, *(const uint32_t *)place);
      return true;
    case ELEMENT_SIZE:
      put_u64(to, *(const size_t *)place);
      return true;
    case ELEMENT_NUMBER:
      put_array(to, ELEMENT_F64, place, 1);
      return true;
    case ELEMENT_PARTS: {
      const qmat_file_part *parts = pointer_of(value, r);
      const size_t count = count_of(value, r);
      put_u64(to, count);
      for (size_t i = 0; i < count; i++) {
        put_text(to, parts[i].name);
        put_u64(to, parts[i].size);
        put(to, parts[i].bytes, parts[i].size);
      }
      return true;
    }
    case ELEMENT_ITEMS: {
      qmat_value *const *items = pointer_of(value, r);
      for (size_t i = 0; i < count_of(value, r); i++) {
        sink size = {0};
        if (!write_rows(&size, items[i])) return false;
        put_u64(to, size.used);
        put(to, items[i]->digest.bytes, sizeof items[i]->digest.bytes);
      }
      return true;
    }
    case ELEMENT_NAMES: {
      char *const *names = pointer_of(value, r);
      for (size_t i = 0; i < count_of(value, r); i++) put_text(to, names[i]);
      return true;
    }
  }
  return false;
}

static bool write_rows(sink *to, const qmat_value *value) {
  put(to, MAGIC, sizeof MAGIC);
  put_u32(to, FORM_VERSION);
  put_text(to, value_types[value->type].name);
  for (const row *r = rows_of(value); r->name != NULL; r++) {
    sink size = {0};
    if (!write_content(&size, value, r)) return false;
    put_text(to, r->name);
    const uint8_t kind = (uint8_t)r->element;
    put(to, &kind, 1);
    put_u64(to, size.used);
    if (!write_content(to, value, r)) return false;
  }
  return true;
}

size_t qmat_value_bytes(const qmat_value *value) {
  size_t bytes = 0;
  for (const row *r = rows_of(value); r->name != NULL; r++) {
    if (!has_pointer(r) || pointer_of(value, r) == NULL) continue;
    if (r->element == ELEMENT_PARTS) {
      const qmat_file_part *parts = pointer_of(value, r);
      for (size_t i = 0; i < count_of(value, r); i++) bytes += parts[i].size;
    } else if (r->element == ELEMENT_ITEMS || r->element == ELEMENT_NAMES) {
      for (size_t i = 0; r->element == ELEMENT_ITEMS && i < count_of(value, r); i++) {
        const qmat_value *item = ((qmat_value *const *)pointer_of(value, r))[i];
        if (item) bytes += qmat_value_bytes(item);
      }
    } else {
      sink size = {0};
      write_content(&size, value, r);
      bytes += size.used;
    }
  }
  return bytes;
}

qmat_status qmat_value_serialize(qmat_context *context, const qmat_value *value, uint8_t **bytes, size_t *size) {
  *bytes = NULL;
  *size = 0;
  if (!value->sealed) {
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "a %s was to be serialized before it was sealed",
                     qmat_value_type_name(value->type));
  }
  sink to = {0};
  if (!write_rows(&to, value)) return qmat_fail_memory(context, "the text of a report");
  to.bytes = qmat_alloc(to.used, 1);
  if (!to.bytes) return qmat_fail_memory(context, "the binary form of a value");
  to.used = 0;
  if (!write_rows(&to, value)) {
    qmat_free(to.bytes);
    return qmat_fail_memory(context, "the text of a report");
  }
  *bytes = to.bytes;
  *size = to.used;
  return QMAT_OK;
}

/* Sealing. */

/* What must hold before the content can be walked at all; only a mistake in a node can break it. */
static qmat_status check_rows(qmat_context *context, const qmat_value *value) {
  const char *type = qmat_value_type_name(value->type);
  for (const row *r = rows_of(value); r->name != NULL; r++) {
    if (!has_pointer(r)) continue;
    const void *pointer = pointer_of(value, r);
    if (!is_array(r)) {
      if (pointer) continue;
      qmat_fail(context, QMAT_ERROR_INTERNAL, "the %s of a %s is not set", r->name, type);
      return qmat_fail_field(context, r->name);
    }
    const size_t count = count_of(value, r);
    if (count > SIZE_MAX / (8 * r->components * element_size(r->element)) || (count > 0 && !pointer)) {
      qmat_fail(context, QMAT_ERROR_INTERNAL, "a %s counts %zu %s but holds none", type, count, r->name);
      return qmat_fail_field(context, r->name);
    }
    for (size_t i = 0; (r->element == ELEMENT_ITEMS || r->element == ELEMENT_NAMES) && i < count; i++) {
      if (((void *const *)pointer)[i] != NULL) continue;
      qmat_fail(context, QMAT_ERROR_INTERNAL, "an item of a list is missing or has no name");
      return qmat_fail_element(context, "item", (int64_t)i);
    }
    if (r->element != ELEMENT_PARTS) continue;
    const qmat_file_part *parts = pointer;
    for (size_t i = 0; i < count; i++) {
      if (!parts[i].name || (parts[i].size > 0 && !parts[i].bytes)) {
        qmat_fail(context, QMAT_ERROR_INTERNAL, "a part of a %s has no name or no bytes", type);
        return qmat_fail_element(context, "part", (int64_t)i);
      }
    }
  }
  return QMAT_OK;
}

qmat_status qmat_value_seal(qmat_context *context, qmat_value *value) {
  if (value->sealed) {
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "a %s was sealed twice", qmat_value_type_name(value->type));
  }
  qmat_status status = check_rows(context, value);
  if (status == QMAT_OK) status = value_types[value->type].check(context, value);
  if (status != QMAT_OK) return status;

  qmat_hasher hasher;
  status = qmat_hasher_init(&hasher);
  if (status != QMAT_OK) return qmat_fail(context, status, "OpenSSL cannot start a SHA-256");
  sink to = {.hasher = &hasher};
  const bool written = write_rows(&to, value);
  status = qmat_hasher_finish(&hasher, &value->digest);
  if (!written) return qmat_fail_memory(context, "the text of a report");
  if (status != QMAT_OK) return qmat_fail(context, status, "OpenSSL failed within a SHA-256");
  value->sealed = true;
  return QMAT_OK;
}

static qmat_status fail_element(qmat_context *context, const char *kind, size_t element) {
  return qmat_fail_element(context, kind, (int64_t)element);
}

/* Every number of an array is finite; names the first group of `components` that is not. */
static qmat_status check_finite(qmat_context *context, const double *numbers, size_t count, size_t components,
                                const char *kind, const char *what) {
  for (size_t i = 0; i < count * components; i++) {
    if (isfinite(numbers[i])) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the %s is not finite", what);
    return fail_element(context, kind, i / components);
  }
  return QMAT_OK;
}

static qmat_status check_u32_count(qmat_context *context, size_t count, const char *what) {
  if (count <= UINT32_MAX) return QMAT_OK;
  return qmat_fail(context, QMAT_ERROR_MEMORY, "%zu %s are more than 32-bit indices can name", count, what);
}

size_t qmat_utf8_length(const char *text) {
  const unsigned char *bytes = (const unsigned char *)text, first = bytes[0];
  const size_t length = first < 0x80                    ? 1
                        : first >= 0xC2 && first < 0xE0 ? 2
                        : first >= 0xE0 && first < 0xF0 ? 3
                        : first >= 0xF0 && first < 0xF5 ? 4
                                                        : 0;
  for (size_t i = 1; i < length; i++) {
    if ((bytes[i] & 0xC0) != 0x80) return 0;
  }
  /* Longer than need be, surrogates, beyond U+10FFFF. */
  if ((first == 0xE0 && bytes[1] < 0xA0) || (first == 0xED && bytes[1] > 0x9F) || (first == 0xF0 && bytes[1] < 0x90) ||
      (first == 0xF4 && bytes[1] > 0x8F)) {
    return 0;
  }
  return length;
}

bool qmat_is_utf8(const char *text) {
  while (*text != '\0') {
    const size_t length = qmat_utf8_length(text);
    if (length == 0) return false;
    text += length;
  }
  return true;
}

/* These texts end up in JSON. */
static qmat_status check_utf8(qmat_context *context, const char *text, const char *what) {
  if (qmat_is_utf8(text)) return QMAT_OK;
  return qmat_fail(context, QMAT_ERROR_FORMAT, "the %s is not valid UTF-8", what);
}

bool qmat_is_part_name(const char *name) {
  if (strchr(name, '\\') != NULL || strlen(name) > 255) return false;
  for (const char *step = name;; step++) {
    const size_t length = strcspn(step, "/");
    if (length == 0 || (length == 1 && step[0] == '.') || (length == 2 && step[0] == '.' && step[1] == '.'))
      return false;
    step += length;
    if (*step == '\0') return true;
  }
}

static int compare_part_names(const void *a, const void *b) {
  const qmat_file_part *first = *(const qmat_file_part *const *)a, *second = *(const qmat_file_part *const *)b;
  const int order = strcmp(first->name, second->name);
  return order != 0 ? order : (first > second) - (first < second); /* equal names: by their place in the file */
}

/* The main part has no name, the others have different ones. */
static qmat_status check_parts(qmat_context *context, const qmat_file_part *parts, size_t part_count) {
  for (size_t i = 0; i < part_count; i++) {
    const char *name = parts[i].name;
    const qmat_status status = check_utf8(context, name, "name");
    if (status != QMAT_OK) return fail_element(context, "part", i);
    if ((name[0] == '\0') != (i == 0)) {
      qmat_fail(context, QMAT_ERROR_FORMAT, i == 0 ? "the main part has a name of its own" : "it has no name");
      return fail_element(context, "part", i);
    }
    if (i > 0 && !qmat_is_part_name(name)) {
      qmat_fail(context, QMAT_ERROR_FORMAT, "its name '%s' is no path below the main part's folder", name);
      return fail_element(context, "part", i);
    }
  }
  const qmat_file_part **sorted = qmat_alloc(part_count, sizeof *sorted);
  if (!sorted) return qmat_fail_memory(context, "the names of a file's parts");
  for (size_t i = 0; i < part_count; i++) sorted[i] = &parts[i];
  qsort(sorted, part_count, sizeof *sorted, compare_part_names);
  size_t repeated = SIZE_MAX;
  for (size_t i = 1; i < part_count; i++) {
    const size_t part = (size_t)(sorted[i] - parts);
    if (strcmp(sorted[i - 1]->name, sorted[i]->name) == 0 && part < repeated) repeated = part;
  }
  qmat_free(sorted);
  if (repeated == SIZE_MAX) return QMAT_OK;
  qmat_fail(context, QMAT_ERROR_FORMAT, "the name '%s' was given before", parts[repeated].name);
  return fail_element(context, "part", repeated);
}

static qmat_status check_scene(qmat_context *context, const qmat_value *value) {
  const qmat_scene *scene = (const qmat_scene *)value;
  const qmat_status status = check_utf8(context, scene->name, "name of the scene");
  if (status == QMAT_OK && !(scene->meters_per_unit >= 0 && isfinite(scene->meters_per_unit))) {
    return qmat_fail(context, QMAT_ERROR_GEOMETRY, "the unit of the scene is no length");
  }
  if (status != QMAT_OK) return status;
  const qmat_status of_format = check_utf8(context, scene->format, "format of the scene");
  return of_format != QMAT_OK ? of_format : check_parts(context, scene->parts, scene->part_count);
}

/* Every id of an array is below `count`; names the first group of `components` that is not. */
static qmat_status check_ids(qmat_context *context, const uint32_t *ids, size_t length, size_t count, const char *kind,
                             size_t components, const char *of) {
  for (size_t i = 0; i < length; i++) {
    if (ids[i] < count) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "it names %s %u of %zu", of, ids[i], count);
    return fail_element(context, kind, i / components);
  }
  return QMAT_OK;
}

static qmat_status check_sharpness(qmat_context *context, const double *sharpness, size_t count, const char *kind) {
  for (size_t i = 0; i < count; i++) {
    if (sharpness[i] >= 0 && isfinite(sharpness[i])) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "its sharpness is negative or not finite");
    return fail_element(context, kind, i);
  }
  return QMAT_OK;
}

static qmat_status check_cage(qmat_context *context, const qmat_cage *cage) {
  size_t faces = 0, corners = 0;
  qmat_status status = check_u32_count(context, cage->vertex_count, "vertices of a cage");
  if (status == QMAT_OK) status = check_u32_count(context, cage->face_count, "faces of a cage");
  if (status == QMAT_OK) {
    status = check_finite(context, cage->positions, cage->vertex_count, 3, "cage vertex", "position");
  }
  if (status == QMAT_OK) {
    status = check_ids(context, cage->schemes, cage->surface_count, QMAT_SCHEME_COUNT, "surface", 1, "scheme");
  }
  if (status == QMAT_OK) {
    status =
        check_ids(context, cage->boundaries, cage->surface_count, QMAT_BOUNDARY_COUNT, "surface", 1, "boundary rule");
  }
  if (status == QMAT_OK) {
    status = check_ids(context, cage->corners, cage->corner_count, cage->vertex_count, "cage corner", 1, "vertex");
  }
  if (status == QMAT_OK) {
    status = check_ids(context, cage->holes, cage->hole_count, cage->face_count, "hole", 1, "face");
  }
  if (status == QMAT_OK) {
    status = check_ids(context, cage->creases, 2 * cage->crease_count, cage->vertex_count, "crease", 2, "vertex");
  }
  if (status == QMAT_OK) {
    status =
        check_ids(context, cage->sharp_vertices, cage->sharp_count, cage->vertex_count, "sharp vertex", 1, "vertex");
  }
  if (status == QMAT_OK) status = check_sharpness(context, cage->crease_sharpness, cage->crease_count, "crease");
  if (status == QMAT_OK) status = check_sharpness(context, cage->vertex_sharpness, cage->sharp_count, "sharp vertex");
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < cage->surface_count; i++) faces += cage->surface_faces[i];
  for (size_t i = 0; i < cage->face_count; i++) corners += cage->face_sizes[i];
  if (faces == cage->face_count && corners == cage->corner_count) return QMAT_OK;
  return qmat_fail(context, QMAT_ERROR_GEOMETRY,
                   "a cage has %zu faces and %zu corners, but its parts add up to %zu and "
                   "%zu",
                   cage->face_count, cage->corner_count, faces, corners);
}

static qmat_status check_mesh(qmat_context *context, const qmat_value *value) {
  const qmat_mesh *mesh = (const qmat_mesh *)value;
  qmat_status status = check_u32_count(context, mesh->vertex_count, "vertices");
  if (status == QMAT_OK) status = check_u32_count(context, mesh->triangle_count, "facets");
  if (status == QMAT_OK) status = check_finite(context, mesh->positions, mesh->vertex_count, 3, "vertex", "position");
  if (status != QMAT_OK) return status;
  if (!(mesh->deviation >= 0 && isfinite(mesh->deviation))) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "it is no length");
    return qmat_fail_field(context, "deviation");
  }
  for (size_t i = 0; i < 3 * mesh->triangle_count; i++) {
    if (mesh->triangles[i] < mesh->vertex_count) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "corner %zu names vertex %u of %zu", i % 3, mesh->triangles[i],
              mesh->vertex_count);
    return fail_element(context, "facet", i / 3);
  }
  return check_cage(context, &mesh->cage);
}

static qmat_status check_field(qmat_context *context, const qmat_value *value) {
  const qmat_field *field = (const qmat_field *)value;
  if (field->domain != QMAT_PER_FACET && field->domain != QMAT_PER_VERTEX) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the domain of a field is neither facets nor vertices");
    return qmat_fail_field(context, "domain");
  }
  const char *kind = field->domain == QMAT_PER_FACET ? "facet" : "vertex";
  const qmat_status status = check_utf8(context, field->unit, "unit of the field");
  return status != QMAT_OK ? status : check_finite(context, field->values, field->count, 1, kind, "value");
}

static qmat_status check_samples(qmat_context *context, const qmat_value *value) {
  const qmat_samples *samples = (const qmat_samples *)value;
  qmat_status status = check_u32_count(context, samples->count, "samples");
  if (status != QMAT_OK) return status;
  if (samples->vertex_count > samples->count) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "%zu of %zu samples are said to be vertices", samples->vertex_count,
              samples->count);
    return qmat_fail_field(context, "vertex_count");
  }
  status = check_finite(context, samples->positions, samples->count, 3, "sample", "position");
  if (status == QMAT_OK) {
    status = check_finite(context, samples->barycentrics, samples->count, 3, "sample", "barycentric coordinate");
  }
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < samples->count; i++) {
    const double *weights = samples->barycentrics + 3 * i;
    const double sum = weights[0] + weights[1] + weights[2];
    if (fabs(sum - 1) <= 1e-9) continue;
    char number[32];
    qmat_format_number(sum, number, sizeof number);
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the barycentric coordinates sum to %s, not 1", number);
    return fail_element(context, "sample", i);
  }
  return QMAT_OK;
}

/* The order of two rows of `width` indices, as of words in a dictionary. */
static int compare_indices(const uint32_t *a, const uint32_t *b, size_t width) {
  for (size_t i = 0; i < width; i++) {
    if (a[i] != b[i]) return a[i] < b[i] ? -1 : 1;
  }
  return 0;
}

/* Edges or triangles: every id names a sphere, ids rise within a row, and rows rise strictly. */
static qmat_status check_simplices(qmat_context *context, const uint32_t *rows, size_t count, size_t width,
                                   size_t sphere_count, const char *kind) {
  for (size_t i = 0; i < count; i++) {
    const uint32_t *ids = rows + width * i;
    for (size_t k = 0; k < width; k++) {
      if (ids[k] >= sphere_count) {
        qmat_fail(context, QMAT_ERROR_GEOMETRY, "it names sphere %u of %zu", ids[k], sphere_count);
        return fail_element(context, kind, i);
      }
      if (k > 0 && ids[k - 1] >= ids[k]) {
        qmat_fail(context, QMAT_ERROR_GEOMETRY, "its spheres %u and %u do not rise", ids[k - 1], ids[k]);
        return fail_element(context, kind, i);
      }
    }
    const int order = i == 0 ? -1 : compare_indices(ids - width, ids, width);
    if (order < 0) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, order == 0 ? "it repeats the %s before it" : "it sorts before the last %s",
              kind);
    return fail_element(context, kind, i);
  }
  return QMAT_OK;
}

static bool has_edge(const qmat_medial *medial, uint32_t low, uint32_t high) {
  const uint32_t wanted[2] = {low, high};
  size_t first = 0, last = medial->edge_count;
  while (first < last) {
    const size_t middle = first + (last - first) / 2;
    const int order = compare_indices(medial->edges + 2 * middle, wanted, 2);
    if (order == 0) return true;
    if (order < 0) {
      first = middle + 1;
    } else {
      last = middle;
    }
  }
  return false;
}

static qmat_status check_regions(qmat_context *context, const qmat_medial *medial) {
  if (medial->region_offset_count == 0) {
    if (!medial->region_offsets && medial->region_sample_count == 0) return QMAT_OK;
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "a medial mesh without region rows holds region data");
  }
  if (medial->region_offset_count != medial->sphere_count + 1) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "%zu spheres need %zu region offsets, not %zu", medial->sphere_count,
              medial->sphere_count + 1, medial->region_offset_count);
    return qmat_fail_field(context, "region_offsets");
  }
  const qmat_status status = check_u32_count(context, medial->region_sample_count, "region samples");
  if (status != QMAT_OK) return status;
  const uint32_t *offsets = medial->region_offsets;
  if (offsets[0] != 0) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the first region starts at %u, not 0", offsets[0]);
    return fail_element(context, "region", 0);
  }
  for (size_t i = 0; i < medial->sphere_count; i++) {
    if (offsets[i] <= offsets[i + 1]) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "it ends at %u, before its start at %u", offsets[i + 1], offsets[i]);
    return fail_element(context, "region", i);
  }
  if (offsets[medial->sphere_count] != medial->region_sample_count) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the regions end at %u of %zu samples", offsets[medial->sphere_count],
              medial->region_sample_count);
    return qmat_fail_field(context, "region_offsets");
  }
  return QMAT_OK;
}

/* Every number is finite, and no radius negative. */
static qmat_status check_spheres(qmat_context *context, const double *spheres, size_t count, const char *kind) {
  const qmat_status status = check_finite(context, spheres, count, 4, kind, "centre or radius");
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < count; i++) {
    if (spheres[4 * i + 3] >= 0) continue;
    char number[32];
    qmat_format_number(spheres[4 * i + 3], number, sizeof number);
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the radius %s is negative", number);
    return fail_element(context, kind, i);
  }
  return QMAT_OK;
}

static qmat_status check_medial(qmat_context *context, const qmat_value *value) {
  const qmat_medial *medial = (const qmat_medial *)value;
  qmat_status status = check_u32_count(context, medial->sphere_count, "spheres");
  if (status == QMAT_OK) status = check_u32_count(context, medial->edge_count, "edges");
  if (status == QMAT_OK) status = check_u32_count(context, medial->triangle_count, "triangles");
  if (status == QMAT_OK) status = check_spheres(context, medial->spheres, medial->sphere_count, "sphere");
  if (status != QMAT_OK) return status;
  status = check_simplices(context, medial->edges, medial->edge_count, 2, medial->sphere_count, "edge");
  if (status != QMAT_OK) return status;
  status = check_simplices(context, medial->triangles, medial->triangle_count, 3, medial->sphere_count, "triangle");
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < medial->triangle_count; i++) {
    const uint32_t *ids = medial->triangles + 3 * i;
    static const int sides[3][2] = {{0, 1}, {0, 2}, {1, 2}};
    for (int k = 0; k < 3; k++) {
      const uint32_t low = ids[sides[k][0]], high = ids[sides[k][1]];
      if (has_edge(medial, low, high)) continue;
      qmat_fail(context, QMAT_ERROR_GEOMETRY, "its side (%u, %u) is not among the edges", low, high);
      return fail_element(context, "triangle", i);
    }
  }
  return check_regions(context, medial);
}

/* Every collapse joins two spheres that are still there. */
static qmat_status check_ends(qmat_context *context, const qmat_chain *chain) {
  uint8_t *gone = qmat_calloc(chain->sphere_count, 1);
  if (!gone) return qmat_fail_memory(context, "the spheres of a chain");
  size_t i = 0;
  const char *fault = NULL;
  for (; i < chain->collapse_count; i++) {
    const uint32_t stays = chain->ends[2 * i], goes = chain->ends[2 * i + 1];
    if (stays >= chain->sphere_count || goes >= chain->sphere_count)
      fault = "it names a sphere that is not there";
    else if (stays == goes)
      fault = "it joins a sphere with itself";
    else if (gone[stays] || gone[goes])
      fault = "it names a sphere that went before";
    if (fault) break;
    gone[goes] = 1;
  }
  qmat_free(gone);
  if (!fault) return QMAT_OK;
  qmat_fail(context, QMAT_ERROR_GEOMETRY, "%s", fault);
  return fail_element(context, "collapse", i);
}

static qmat_status check_chain(qmat_context *context, const qmat_value *value) {
  const qmat_chain *chain = (const qmat_chain *)value;
  const qmat_medial initial = {.base.type = QMAT_MEDIAL,
                               .sphere_count = chain->sphere_count,
                               .edge_count = chain->edge_count,
                               .triangle_count = chain->triangle_count,
                               .spheres = chain->spheres,
                               .edges = chain->edges,
                               .triangles = chain->triangles};
  qmat_status status = check_medial(context, &initial.base);
  if (status == QMAT_OK) status = check_u32_count(context, chain->sample_count, "samples");
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < chain->sample_count; i++) {
    if (chain->owners[i] < chain->sphere_count || chain->owners[i] == UINT32_MAX) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "its owner is sphere %u of %zu", chain->owners[i], chain->sphere_count);
    return fail_element(context, "sample", i);
  }
  status = check_ends(context, chain);
  if (status == QMAT_OK) status = check_spheres(context, chain->merged, chain->collapse_count, "collapse");
  if (status == QMAT_OK) status = check_finite(context, chain->errors, chain->collapse_count, 1, "collapse", "error");
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < chain->collapse_count; i++) {
    if (chain->errors[i] >= (i == 0 ? 0 : chain->errors[i - 1])) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the error falls");
    return fail_element(context, "collapse", i);
  }
  return QMAT_OK;
}

static qmat_status check_report(qmat_context *context, const qmat_value *value) {
  const qmat_report *report = (const qmat_report *)value;
  if (json_is_object(report->root)) return QMAT_OK;
  return qmat_fail(context, QMAT_ERROR_INTERNAL, "the root of a report is not a JSON object");
}

static qmat_status check_file(qmat_context *context, const qmat_value *value) {
  const qmat_file *file = (const qmat_file *)value;
  if (file->part_count == 0) return qmat_fail(context, QMAT_ERROR_INTERNAL, "a file has no main part");
  return check_parts(context, file->parts, file->part_count);
}

static qmat_status check_failure(qmat_context *context, const qmat_value *value) {
  return check_utf8(context, ((const qmat_failure *)value)->reason, "reason");
}

static qmat_status check_list(qmat_context *context, const qmat_value *value) {
  const qmat_list *list = (const qmat_list *)value;
  if (list->count < 2)
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "a list has %zu items, not two or more", list->count);
  const qmat_value_type type = qmat_value_item_type(value);
  if (type == QMAT_FAILURE) return qmat_fail(context, QMAT_ERROR_INTERNAL, "a list has nothing but failures");
  for (size_t i = 0; i < list->count; i++) {
    const qmat_value *item = list->items[i];
    if (!item->sealed || item->type == QMAT_LIST || (item->type != type && item->type != QMAT_FAILURE)) {
      qmat_fail(context, QMAT_ERROR_INTERNAL, "it is a list, not sealed, or not of the type of the others");
      return fail_element(context, "item", i);
    }
    if (check_utf8(context, list->names[i], "name") != QMAT_OK) return fail_element(context, "item", i);
  }
  return QMAT_OK;
}

/* Reading the binary form. */

typedef struct reader {
  const uint8_t *bytes;
  size_t size, used;
  const qmat_value_source *items;
} reader;

static qmat_status fail_form(qmat_context *context, const reader *from, const char *what) {
  qmat_fail(context, QMAT_ERROR_FORMAT, "this is not the binary form of a value: %s", what);
  return fail_element(context, "byte", from->used);
}

/* The next `size` bytes, or NULL when fewer are left. */
static const uint8_t *take(reader *from, uint64_t size) {
  if (size > from->size - from->used) return NULL;
  const uint8_t *bytes = from->bytes + from->used;
  from->used += (size_t)size;
  return bytes;
}

static bool take_u32(reader *from, uint32_t *number) {
  const uint8_t *bytes = take(from, 4);
  if (bytes) *number = decode_u32(bytes);
  return bytes != NULL;
}

static bool take_u64(reader *from, uint64_t *number) {
  const uint8_t *bytes = take(from, 8);
  if (bytes) *number = decode_u64(bytes);
  return bytes != NULL;
}

/* Whether the next text is `wanted`. */
static bool take_word(reader *from, const char *wanted) {
  const size_t length = strlen(wanted);
  uint32_t size;
  if (!take_u32(from, &size) || size != length) return false;
  const uint8_t *bytes = take(from, size);
  return bytes != NULL && memcmp(bytes, wanted, length) == 0;
}

/* The next `size` bytes as a string of one's own. */
static qmat_status take_string(qmat_context *context, reader *from, uint64_t size, char **text) {
  const uint8_t *bytes = take(from, size);
  if (!bytes) return fail_form(context, from, "a text is longer than what is left");
  if (memchr(bytes, '\0', (size_t)size) != NULL) return fail_form(context, from, "a text holds a zero byte");
  char *copy = qmat_alloc((size_t)size + 1, 1);
  if (!copy) return qmat_fail_memory(context, "a text");
  memcpy(copy, bytes, (size_t)size);
  copy[size] = '\0';
  *text = copy;
  return QMAT_OK;
}

/* Whether a row before `r` has set the count that `r` uses. */
static bool shares_count(const row *rows, const row *r) {
  for (const row *earlier = rows; earlier < r; earlier++) {
    if (is_array(earlier) && earlier->count_offset == r->count_offset) return true;
  }
  return false;
}

static qmat_status read_array(qmat_context *context, reader *from, qmat_value *value, const row *r) {
  const size_t stride = element_size(r->element) * r->components;
  size_t *count = mutable_slot(value, r->count_offset);
  const size_t size = from->size;
  if (size % stride != 0) return fail_form(context, from, "an array ends within an element");
  if (shares_count(rows_of(value), r) && *count != size / stride) {
    return fail_form(context, from, "two arrays of one length differ in length");
  }
  if (size == 0) return QMAT_OK;
  void *array = qmat_alloc(size / stride, stride);
  if (!array) return qmat_fail_memory(context, r->name);
  set_pointer(value, r, array);
  *count = size / stride;
  const uint8_t *bytes = take(from, size);
  const size_t length = *count * r->components;
  if (r->element == ELEMENT_U32) {
    for (size_t i = 0; i < length; i++) ((uint32_t *)array)[i] = decode_u32(bytes + 4 * i);
  } else {
    for (size_t i = 0; i < length; i++) {
      const uint64_t bits = decode_u64(bytes + 8 * i);
      memcpy((double *)array + i, &bits, sizeof bits);
    }
  }
  return QMAT_OK;
}

static qmat_status read_parts(qmat_context *context, reader *from, qmat_value *value, const row *r) {
  uint64_t count;
  size_t *part_count = mutable_slot(value, r->count_offset);
  enum { LEAST_BYTES = 12 }; /* of a part: its two sizes */
  if (!take_u64(from, &count) || count > (from->size - from->used) / LEAST_BYTES) {
    return fail_form(context, from, "there are fewer parts than it says");
  }
  if (count == 0) return QMAT_OK;
  qmat_file_part *parts = qmat_calloc((size_t)count, sizeof *parts);
  if (!parts) return qmat_fail_memory(context, "the parts of a file");
  set_pointer(value, r, parts);
  *part_count = (size_t)count;
  for (size_t i = 0; i < count; i++) {
    uint32_t name_size;
    uint64_t size;
    if (!take_u32(from, &name_size)) return fail_form(context, from, "a part's name is missing");
    const qmat_status status = take_string(context, from, name_size, &parts[i].name);
    if (status != QMAT_OK) return status;
    const uint8_t *bytes = take_u64(from, &size) ? take(from, size) : NULL;
    if (!bytes) return fail_form(context, from, "a part is longer than what is left");
    parts[i].bytes = qmat_alloc((size_t)size, 1);
    if (!parts[i].bytes) return qmat_fail_memory(context, "the bytes of a file");
    parts[i].size = (size_t)size;
    if (size > 0) memcpy(parts[i].bytes, bytes, (size_t)size);
  }
  return QMAT_OK;
}

static qmat_status read_items(qmat_context *context, reader *from, qmat_value *value, const row *r) {
  qmat_digest digest;
  const size_t count = from->size / (8 + sizeof digest.bytes);
  if (from->size % (8 + sizeof digest.bytes) != 0) return fail_form(context, from, "an item is cut short");
  qmat_value **items = qmat_calloc(count, sizeof *items);
  if (!items) return qmat_fail_memory(context, "the items of a list");
  set_pointer(value, r, items);
  *(size_t *)mutable_slot(value, r->count_offset) = count;
  for (size_t i = 0; i < count; i++) {
    uint64_t size = 0;
    take_u64(from, &size);
    memcpy(digest.bytes, take(from, sizeof digest.bytes), sizeof digest.bytes);
    items[i] = from->items != NULL ? from->items->find(from->items->user, &digest, size) : NULL;
    if (!items[i]) return fail_form(context, from, "an item is not at hand");
  }
  return QMAT_OK;
}

static qmat_status read_names(qmat_context *context, reader *from, qmat_value *value, const row *r) {
  const size_t count = count_of(value, r);
  char **names = qmat_calloc(count, sizeof *names);
  if (!names) return qmat_fail_memory(context, "the names of a list");
  set_pointer(value, r, names);
  for (size_t i = 0; i < count; i++) {
    uint32_t size;
    if (!take_u32(from, &size)) return fail_form(context, from, "there are fewer names than items");
    const qmat_status status = take_string(context, from, size, &names[i]);
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

static qmat_status read_json(qmat_context *context, reader *from, qmat_value *value, const row *r) {
  json_error_t error;
  const uint8_t *bytes = take(from, from->size);
  json_t *root = json_loadb((const char *)bytes, from->size, JSON_REJECT_DUPLICATES | JSON_ALLOW_NUL, &error);
  if (!json_is_object(root)) {
    json_decref(root);
    return fail_form(context, from, "a report is not a JSON object");
  }
  json_decref(pointer_of(value, r));
  set_pointer(value, r, root);
  return QMAT_OK;
}

/* `from` holds the content of the row and nothing else. */
static qmat_status read_content(qmat_context *context, reader *from, qmat_value *value, const row *r) {
  uint32_t small;
  uint64_t large;
  const uint8_t *byte;
  switch (r->element) {
    case ELEMENT_U32:
    case ELEMENT_F64:
      return read_array(context, from, value, r);
    case ELEMENT_TEXT:
      return take_string(context, from, from->size, mutable_slot(value, r->offset));
    case ELEMENT_JSON:
      return read_json(context, from, value, r);
    case ELEMENT_PARTS:
      return read_parts(context, from, value, r);
    case ELEMENT_ITEMS:
      return read_items(context, from, value, r);
    case ELEMENT_NAMES:
      return read_names(context, from, value, r);
    case ELEMENT_BOOL:
      byte = take(from, 1);
      if (!byte || *byte > 1) return fail_form(context, from, "a flag is neither 0 nor 1");
      *(bool *)mutable_slot(value, r->offset) = *byte == 1;
      return QMAT_OK;
    case ELEMENT_ENUM:
      if (!take_u32(from, &small)) return fail_form(context, from, "a choice is cut short");
      memcpy(mutable_slot(value, r->offset), &small, sizeof small);
      return QMAT_OK;
    case ELEMENT_SIZE:
      if (!take_u64(from, &large) || large > SIZE_MAX) return fail_form(context, from, "a count is cut short");
      *(size_t *)mutable_slot(value, r->offset) = (size_t)large;
      return QMAT_OK;
    case ELEMENT_NUMBER:
      if (!take_u64(from, &large)) return fail_form(context, from, "a number is cut short");
      memcpy(mutable_slot(value, r->offset), &large, sizeof large);
      return QMAT_OK;
  }
  return fail_form(context, from, "a row is of an unknown kind");
}

static qmat_status read_rows(qmat_context *context, reader *from, qmat_value *value) {
  for (const row *r = rows_of(value); r->name != NULL; r++) {
    if (!take_word(from, r->name)) return fail_form(context, from, "a row is missing");
    const uint8_t *kind = take(from, 1);
    if (!kind || *kind != (uint8_t)r->element) return fail_form(context, from, "a row is of another kind");
    uint64_t size;
    const uint8_t *bytes = take_u64(from, &size) ? take(from, size) : NULL;
    if (!bytes) return fail_form(context, from, "a row is longer than what is left");
    reader content = {bytes, (size_t)size, 0, from->items};
    const qmat_status status = read_content(context, &content, value, r);
    if (status != QMAT_OK) {
      if (status == QMAT_ERROR_FORMAT) fail_element(context, "byte", from->used - content.size + content.used);
      return qmat_fail_field(context, r->name);
    }
    if (content.used != content.size) return fail_form(context, from, "a row is longer than its content");
  }
  if (from->used != from->size) return fail_form(context, from, "bytes follow the last row");
  return QMAT_OK;
}

qmat_status qmat_value_deserialize(qmat_context *context, const uint8_t *bytes, size_t size,
                                   const qmat_value_source *items, qmat_value **value) {
  *value = NULL;
  reader from = {bytes, size, 0, items};
  const uint8_t *magic = take(&from, sizeof MAGIC);
  uint32_t version;
  if (!magic || memcmp(magic, MAGIC, sizeof MAGIC) != 0) {
    return fail_form(context, &from, "it does not start with QMAT");
  }
  if (!take_u32(&from, &version)) return fail_form(context, &from, "its version is missing");
  if (version != FORM_VERSION) {
    return qmat_fail(context, QMAT_ERROR_FORMAT, "the binary form has version %u; this qmat reads version %d", version,
                     FORM_VERSION);
  }
  const size_t name_start = from.used;
  int type = 0;
  while (type < QMAT_VALUE_TYPE_COUNT && !take_word(&from, value_types[type].name)) {
    from.used = name_start;
    type++;
  }
  if (type == QMAT_VALUE_TYPE_COUNT) return fail_form(context, &from, "its type is unknown");

  qmat_value *made = value_new((qmat_value_type)type);
  if (!made) return qmat_fail_memory(context, "a value");
  qmat_status status = read_rows(context, &from, made);
  if (status == QMAT_OK) {
    status = qmat_value_seal(context, made);
    /* Here the bytes are at fault, not a node or a model. */
    if (status == QMAT_ERROR_GEOMETRY || status == QMAT_ERROR_INTERNAL) {
      status = context->error.status = QMAT_ERROR_FORMAT;
    }
  }
  if (status != QMAT_OK) {
    qmat_value_release(made);
    return status;
  }
  *value = made;
  return QMAT_OK;
}
