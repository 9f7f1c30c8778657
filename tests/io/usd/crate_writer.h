/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_TESTS_IO_USD_CRATE_WRITER_H
#define QMAT_TESTS_IO_USD_CRATE_WRITER_H

/* Writes a layer as a crate of a given version, with all of its ways to store values: inlined, shared, packed as
 * differences, as whole numbers and as a table. For small layers: names are looked for one by one. */

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <lz4.h>

#include "io/usd/usdc.h"
#include "tests/io/files.h"

enum { CRATE_MOST = 512, CRATE_HEADER = 88 };

typedef struct crate_node { /* of the tree of paths */
  const char *element;
  bool is_property;
  int parent, first_child, last_child, next;
} crate_node;

typedef struct crate_writer {
  int version;
  qmat_writer body;
  size_t token_count, string_count, node_count, field_count, set_length, spec_count;
  char *tokens[CRATE_MOST];
  uint32_t strings[CRATE_MOST], field_names[4 * CRATE_MOST], sets[8 * CRATE_MOST];
  uint64_t field_reps[4 * CRATE_MOST];
  crate_node nodes[CRATE_MOST];
  uint32_t spec_paths[CRATE_MOST], spec_sets[CRATE_MOST], spec_types[CRATE_MOST];
} crate_writer;

static inline uint32_t crate_token(crate_writer *w, const char *text) {
  for (size_t i = 0; i < w->token_count; i++) {
    if (strcmp(w->tokens[i], text) == 0) return (uint32_t)i;
  }
  assert_true(w->token_count < CRATE_MOST);
  w->tokens[w->token_count] = strdup(text);
  return (uint32_t)w->token_count++;
}

static inline uint32_t crate_string(crate_writer *w, const char *text) {
  uint32_t token = crate_token(w, text);
  for (size_t i = 0; i < w->string_count; i++) {
    if (w->strings[i] == token) return (uint32_t)i;
  }
  assert_true(w->string_count < CRATE_MOST);
  w->strings[w->string_count] = token;
  return (uint32_t)w->string_count++;
}

static inline int crate_path_child(crate_writer *w, int parent, const char *element, bool is_property) {
  for (int i = parent < 0 ? -1 : w->nodes[parent].first_child; i >= 0; i = w->nodes[i].next) {
    if (w->nodes[i].is_property == is_property && strcmp(w->nodes[i].element, element) == 0) return i;
  }
  assert_true(w->node_count < CRATE_MOST);
  const int made = (int)w->node_count++;
  w->nodes[made] = (crate_node){w->tokens[crate_token(w, element)], is_property, parent, -1, -1, -1};
  if (parent >= 0) {
    crate_node *above = &w->nodes[parent];
    if (above->last_child >= 0) {
      w->nodes[above->last_child].next = made;
    } else {
      above->first_child = made;
    }
    above->last_child = made;
  }
  return made;
}

/* The number of a path like "/a/b.c"; UINT32_MAX, which no path has, for "". */
static inline uint32_t crate_path(crate_writer *w, const char *path) {
  int at = 0;
  if (!*path) return UINT32_MAX;
  while (*path) {
    const bool is_property = *path++ == '.';
    char name[256];
    const size_t length = strcspn(path, is_property ? "" : "/.");
    assert_true(length < sizeof name);
    memcpy(name, path, length);
    name[length] = '\0';
    if (length > 0) at = crate_path_child(w, at, name, is_property);
    path += length;
  }
  return (uint32_t)at;
}

static inline void crate_put_u64(qmat_writer *to, uint64_t number) {
  qmat_put_u32(to, (uint32_t)number);
  qmat_put_u32(to, (uint32_t)(number >> 32));
}

static inline void crate_put_lz4(qmat_writer *to, const void *bytes, size_t size, bool with_size) {
  const int most = LZ4_compressBound((int)size);
  char *packed = malloc((size_t)most + 1);
  assert_non_null(packed);
  packed[0] = 0; /* one block */
  const int got = LZ4_compress_default(bytes, packed + 1, (int)size, most);
  assert_true(got > 0);
  if (with_size) crate_put_u64(to, (uint64_t)got + 1);
  qmat_put_bytes(to, packed, (size_t)got + 1);
  free(packed);
}

/* Differences in two bits and as many bytes as they need; the commonest is 1 here, which rows of indices have. */
static inline void crate_put_integers(qmat_writer *to, const int64_t *integers, size_t count, unsigned width) {
  qmat_writer codes = {0}, differences = {0}, all = {0};
  const int64_t common = 1;
  int64_t before = 0;
  uint8_t code = 0;
  for (size_t i = 0; i < count; i++) {
    const int64_t d = width == 4 ? (int32_t)((uint32_t)integers[i] - (uint32_t)before)
                                 : (int64_t)((uint64_t)integers[i] - (uint64_t)before);
    before = integers[i];
    unsigned kind = 3;
    if (d == common) {
      kind = 0;
    } else if (width == 4 ? d == (int8_t)d : d == (int16_t)d) {
      kind = 1;
    } else if (width == 4 ? d == (int16_t)d : d == (int32_t)d) {
      kind = 2;
    }
    code = (uint8_t)(code | kind << (2 * (i % 4)));
    if (i % 4 == 3 || i + 1 == count) {
      qmat_put_u8(&codes, code);
      code = 0;
    }
    const unsigned bytes = kind == 0 ? 0 : width >> (3 - kind);
    for (unsigned k = 0; k < bytes; k++) qmat_put_u8(&differences, (uint8_t)((uint64_t)d >> (8 * k)));
  }
  for (unsigned k = 0; k < width; k++) qmat_put_u8(&all, (uint8_t)((uint64_t)common >> (8 * k)));
  qmat_put_bytes(&all, codes.bytes, codes.size);
  qmat_put_bytes(&all, differences.bytes, differences.size);
  crate_put_lz4(to, all.bytes, all.size, true);
  qmat_writer_uninit(&codes);
  qmat_writer_uninit(&differences);
  qmat_writer_uninit(&all);
}

static inline void crate_put_u32s(qmat_writer *to, const uint32_t *numbers, size_t count) {
  int64_t *wide = calloc(count + 1, sizeof *wide);
  assert_non_null(wide);
  for (size_t i = 0; i < count; i++) wide[i] = (int32_t)numbers[i];
  crate_put_integers(to, wide, count, 4);
  free(wide);
}

/* The tables of a crate. */
typedef struct crate_tables {
  size_t token_count, token_bytes, string_count, field_count, set_length, path_count, spec_count;
  const char *tokens; /* each with a zero byte */
  const uint32_t *strings, *field_names, *sets, *indices, *elements, *jumps, *spec_paths, *spec_sets, *spec_types;
  const uint64_t *field_reps;
} crate_tables;

/* Writes the tables after the values in `body`, which begins with CRATE_HEADER bytes of room, and the header. */
static inline void crate_put_tables(qmat_writer *body, int version, const crate_tables *t) {
  static const char *const names[] = {"TOKENS", "STRINGS", "FIELDS", "FIELDSETS", "PATHS", "SPECS"};
  size_t starts[7];
  starts[0] = body->size;
  crate_put_u64(body, t->token_count);
  crate_put_u64(body, t->token_bytes);
  crate_put_lz4(body, t->tokens, t->token_bytes, true);
  starts[1] = body->size;
  crate_put_u64(body, t->string_count);
  for (size_t i = 0; i < t->string_count; i++) qmat_put_u32(body, t->strings[i]);
  starts[2] = body->size;
  crate_put_u64(body, t->field_count);
  crate_put_u32s(body, t->field_names, t->field_count);
  crate_put_lz4(body, t->field_reps, t->field_count * 8, true);
  starts[3] = body->size;
  crate_put_u64(body, t->set_length);
  crate_put_u32s(body, t->sets, t->set_length);
  starts[4] = body->size;
  crate_put_u64(body, t->path_count);
  crate_put_u64(body, t->path_count);
  crate_put_u32s(body, t->indices, t->path_count);
  crate_put_u32s(body, t->elements, t->path_count);
  crate_put_u32s(body, t->jumps, t->path_count);
  starts[5] = body->size;
  crate_put_u64(body, t->spec_count);
  crate_put_u32s(body, t->spec_paths, t->spec_count);
  crate_put_u32s(body, t->spec_sets, t->spec_count);
  crate_put_u32s(body, t->spec_types, t->spec_count);
  starts[6] = body->size;
  crate_put_u64(body, 6);
  for (size_t i = 0; i < 6; i++) {
    char name[16] = "";
    strcpy(name, names[i]);
    qmat_put_bytes(body, name, sizeof name);
    crate_put_u64(body, starts[i]);
    crate_put_u64(body, starts[i + 1] - starts[i]);
  }
  assert_false(body->failed);
  memcpy(body->bytes, "PXR-USDC", 8);
  body->bytes[9] = (uint8_t)version;
  for (int i = 0; i < 8; i++) body->bytes[16 + i] = (uint8_t)(starts[6] >> (8 * i));
}

static inline uint16_t crate_half(double number) {
  for (uint32_t bits = 0; bits < 0x7C00; bits++) {
    const double size = bits < 1024 ? ldexp(bits, -24) : ldexp(1024 + (bits & 1023), (int)(bits >> 10) - 25);
    if (size == fabs(number)) return (uint16_t)(bits | (signbit(number) ? 0x8000 : 0));
  }
  return signbit(number) ? 0xFC00 : 0x7C00;
}

static inline void crate_put_component(qmat_writer *to, const qmat_usd_value *value, size_t i) {
  const int64_t integer = qmat_usd_is_integer(value->type) ? value->integers[i] : 0;
  switch (value->type) {
    case QMAT_USD_BOOL:
    case QMAT_USD_UCHAR:
      qmat_put_u8(to, (uint8_t)integer);
      break;
    case QMAT_USD_INT:
    case QMAT_USD_UINT:
      qmat_put_u32(to, (uint32_t)integer);
      break;
    case QMAT_USD_INT64:
    case QMAT_USD_UINT64:
      crate_put_u64(to, (uint64_t)integer);
      break;
    case QMAT_USD_HALF:
      qmat_put_u16(to, crate_half(value->numbers[i]));
      break;
    case QMAT_USD_FLOAT:
      qmat_put_f32(to, (float)value->numbers[i]);
      break;
    default:
      qmat_put_f64(to, value->numbers[i]);
      break;
  }
}

static inline uint64_t crate_rep(unsigned type, uint64_t flags, uint64_t payload) {
  return flags | (uint64_t)type << 48 | payload;
}
#define CRATE_ARRAY ((uint64_t)1 << 63)
#define CRATE_INLINED ((uint64_t)1 << 62)
#define CRATE_PACKED ((uint64_t)1 << 61)

/* The number of a plain type in the file. */
static inline unsigned crate_plain_type(const qmat_usd_value *value, bool is_quaternion) {
  static const uint8_t singles[] = {
      [QMAT_USD_BOOL] = 1,   [QMAT_USD_UCHAR] = 2,     [QMAT_USD_INT] = 3,     [QMAT_USD_UINT] = 4,
      [QMAT_USD_INT64] = 5,  [QMAT_USD_UINT64] = 6,    [QMAT_USD_HALF] = 7,    [QMAT_USD_FLOAT] = 8,
      [QMAT_USD_DOUBLE] = 9, [QMAT_USD_TIMECODE] = 56, [QMAT_USD_STRING] = 10, [QMAT_USD_TOKEN] = 11,
      [QMAT_USD_ASSET] = 12};
  const unsigned order = value->type == QMAT_USD_DOUBLE  ? 0
                         : value->type == QMAT_USD_FLOAT ? 1
                         : value->type == QMAT_USD_HALF  ? 2
                                                         : 3;
  if (value->components == 1) return singles[value->type];
  if (value->components == 9) return 14;
  if (value->components == 16) return 15;
  if (is_quaternion) return 16 + order;
  return 19 + 4 * (value->components - 2u) + order;
}

static inline uint64_t crate_value(crate_writer *w, const qmat_usd_value *value, const char *type_name);

static inline void crate_put_text(crate_writer *w, qmat_usd_type type, const char *text) {
  qmat_put_u32(&w->body, type == QMAT_USD_PATH    ? crate_path(w, text)
                         : type == QMAT_USD_TOKEN ? crate_token(w, text)
                                                  : crate_string(w, text));
}

/* A value behind the distance to its representation. */
static inline void crate_put_nested(crate_writer *w, const qmat_usd_value *value) {
  const size_t start = w->body.size;
  crate_put_u64(&w->body, 0);
  const uint64_t rep = crate_value(w, value, "");
  const uint64_t distance = w->body.size - start;
  for (int i = 0; i < 8; i++) w->body.bytes[start + (size_t)i] = (uint8_t)(distance >> (8 * i));
  crate_put_u64(&w->body, rep);
}

static inline void crate_put_dictionary(crate_writer *w, const qmat_usd_value *value, bool of_strings) {
  crate_put_u64(&w->body, value->count);
  for (size_t i = 0; i < value->count; i++) {
    qmat_put_u32(&w->body, crate_string(w, value->entries[i].name));
    if (of_strings) {
      crate_put_text(w, QMAT_USD_STRING, value->entries[i].value->texts[0]);
    } else {
      crate_put_nested(w, value->entries[i].value);
    }
  }
}

static inline void crate_put_list(crate_writer *w, const qmat_usd_value *list, bool is_payload) {
  crate_put_u64(&w->body, list->count);
  for (size_t i = 0; i < list->count; i++) {
    if (list->type != QMAT_USD_REFERENCE) {
      crate_put_text(w, list->type, list->texts[i]);
      continue;
    }
    const qmat_usd_reference *reference = &list->references[i];
    qmat_put_u32(&w->body, crate_string(w, reference->asset));
    qmat_put_u32(&w->body, crate_path(w, reference->path));
    if (!is_payload || w->version >= 8) {
      qmat_put_f64(&w->body, reference->offset);
      qmat_put_f64(&w->body, reference->scale);
    }
    if (!is_payload) crate_put_u64(&w->body, 0); /* customData */
  }
}

static inline uint64_t crate_list_op(crate_writer *w, const qmat_usd_value *value, bool is_payload) {
  static const int bits[] = {1, 2, 5, 6, 3, 4}; /* of the lists in our order, which is the file's */
  const qmat_usd_list_op *op = value->list_op;
  const qmat_usd_type type = op->lists[0].type;
  const size_t start = w->body.size;
  if (is_payload && w->version < 8 && op->is_explicit && op->lists[0].count == 1) {
    qmat_put_u32(&w->body, crate_string(w, op->lists[0].references[0].asset));
    qmat_put_u32(&w->body, crate_path(w, op->lists[0].references[0].path));
    return crate_rep(47, 0, start);
  }
  uint8_t header = op->is_explicit;
  for (int i = 0; i < QMAT_USD_EDIT_COUNT; i++) {
    if (op->lists[i].count > 0) header = (uint8_t)(header | 1 << bits[i]);
  }
  qmat_put_u8(&w->body, header);
  for (int i = 0; i < QMAT_USD_EDIT_COUNT; i++) {
    if (op->lists[i].count > 0) crate_put_list(w, &op->lists[i], is_payload);
  }
  return crate_rep(type == QMAT_USD_TOKEN    ? 32
                   : type == QMAT_USD_STRING ? 33
                   : type == QMAT_USD_PATH   ? 34
                   : is_payload              ? 55
                                             : 35,
                   0, start);
}

static inline uint64_t crate_array(crate_writer *w, const qmat_usd_value *value, unsigned type, bool is_quaternion) {
  if (value->count == 0) return crate_rep(type, CRATE_ARRAY, 0);
  const size_t start = w->body.size, total = value->count * value->components;
  if (w->version < 7) {
    qmat_put_u32(&w->body, (uint32_t)value->count);
  } else {
    crate_put_u64(&w->body, value->count);
  }
  if (qmat_usd_is_text(value->type)) {
    for (size_t i = 0; i < value->count; i++) crate_put_text(w, value->type, value->texts[i]);
    return crate_rep(type, CRATE_ARRAY, start);
  }
  const bool is_wide = value->type == QMAT_USD_INT64 || value->type == QMAT_USD_UINT64,
             is_whole = is_wide || value->type == QMAT_USD_INT || value->type == QMAT_USD_UINT,
             is_real = qmat_usd_is_number(value->type) && value->type != QMAT_USD_TIMECODE;
  if (value->components == 1 && value->count >= 16 && is_whole) {
    crate_put_integers(&w->body, value->integers, value->count, is_wide ? 8 : 4);
    return crate_rep(type, CRATE_ARRAY | CRATE_PACKED, start);
  }
  if (value->components == 1 && value->count >= 16 && is_real) {
    int64_t numbers[CRATE_MOST];
    size_t known = 0, first[CRATE_MOST];
    bool whole = true;
    for (size_t i = 0; i < value->count; i++) {
      size_t k = 0;
      while (k < known && value->numbers[first[k]] != value->numbers[i]) k++;
      if (k == known) first[known++] = i;
      whole = whole && value->numbers[i] == floor(value->numbers[i]) && fabs(value->numbers[i]) < 1e9;
    }
    if (whole || known <= value->count / 4) {
      qmat_put_u8(&w->body, whole ? 'i' : 't');
      for (size_t i = 0; i < value->count; i++) {
        size_t k = 0;
        while (value->numbers[first[k]] != value->numbers[i]) k++;
        numbers[i] = whole ? (int64_t)value->numbers[i] : (int64_t)k;
      }
      if (!whole) qmat_put_u32(&w->body, (uint32_t)known);
      for (size_t k = 0; k < known && !whole; k++) crate_put_component(&w->body, value, first[k]);
      crate_put_integers(&w->body, numbers, value->count, 4);
      return crate_rep(type, CRATE_ARRAY | CRATE_PACKED, start);
    }
  }
  for (size_t i = 0; i < total; i++) {
    /* The real part of a quaternion comes last. */
    crate_put_component(&w->body, value, is_quaternion ? i - i % 4 + (i % 4 + 1) % 4 : i);
  }
  return crate_rep(type, CRATE_ARRAY, start);
}

static inline uint64_t crate_single(crate_writer *w, const qmat_usd_value *value, unsigned type, bool is_quaternion) {
  const unsigned components = value->components, rows = components == 16 ? 4 : components == 9 ? 3 : type == 13 ? 2 : 0;
  if (qmat_usd_is_text(value->type)) {
    const char *text = value->texts[0];
    return crate_rep(type, CRATE_INLINED,
                     value->type == QMAT_USD_STRING ? crate_string(w, text) : crate_token(w, text));
  }
  uint64_t payload = 0;
  bool bytes = components > 1 && !is_quaternion, is_float = false;
  for (unsigned i = 0; i < components; i++) {
    const double x = qmat_usd_is_integer(value->type) ? (double)value->integers[i] : value->numbers[i];
    const bool off = rows > 0 && i / rows != i % rows;
    bytes = bytes && x == (double)(int8_t)fmax(-128, fmin(127, x)) && !(off && x != 0);
    if (bytes && !off) payload |= (uint64_t)(uint8_t)(int8_t)x << (8 * (rows > 0 ? i / rows : i));
    is_float = components == 1 && x == (double)(float)x;
  }
  if (bytes) return crate_rep(type, CRATE_INLINED, payload);
  qmat_writer inlined = {0};
  bool fits = false;
  if (components == 1) {
    const bool is_wide = value->type == QMAT_USD_INT64 || value->type == QMAT_USD_UINT64;
    if (value->type == QMAT_USD_DOUBLE) {
      fits = is_float;
      qmat_put_f32(&inlined, (float)value->numbers[0]);
    } else if (is_wide) {
      fits = value->integers[0] >= 0 && value->integers[0] <= INT32_MAX;
      qmat_put_u32(&inlined, (uint32_t)value->integers[0]);
    } else if (value->type != QMAT_USD_TIMECODE) {
      fits = true;
      crate_put_component(&inlined, value, 0);
    }
  }
  payload = 0;
  for (size_t i = 0; i < inlined.size && i < 4; i++) payload |= (uint64_t)inlined.bytes[i] << (8 * i);
  qmat_writer_uninit(&inlined);
  if (fits) return crate_rep(type, CRATE_INLINED, payload);
  const size_t start = w->body.size;
  for (size_t i = 0; i < components; i++) {
    crate_put_component(&w->body, value, is_quaternion ? (i + 1) % 4 : i);
  }
  return crate_rep(type, 0, start);
}

static inline uint64_t crate_samples(crate_writer *w, const qmat_usd_samples *samples) {
  uint64_t reps[CRATE_MOST];
  const size_t start = w->body.size;
  crate_put_u64(&w->body, 8 + 8 + 8 * samples->count);
  const size_t times = w->body.size;
  crate_put_u64(&w->body, samples->count);
  for (size_t i = 0; i < samples->count; i++) qmat_put_f64(&w->body, samples->times[i]);
  crate_put_u64(&w->body, crate_rep(48, 0, times));
  const size_t second = w->body.size;
  crate_put_u64(&w->body, 0);
  for (size_t i = 0; i < samples->count; i++) reps[i] = crate_value(w, samples->values[i], "");
  const uint64_t distance = w->body.size - second;
  for (int i = 0; i < 8; i++) w->body.bytes[second + (size_t)i] = (uint8_t)(distance >> (8 * i));
  crate_put_u64(&w->body, samples->count);
  for (size_t i = 0; i < samples->count; i++) crate_put_u64(&w->body, reps[i]);
  return crate_rep(46, 0, start);
}

static inline uint64_t crate_value(crate_writer *w, const qmat_usd_value *value, const char *type_name) {
  const bool is_quaternion = strncmp(type_name, "quat", 4) == 0;
  size_t start;
  switch (value->type) {
    case QMAT_USD_BLOCK:
      return crate_rep(51, CRATE_INLINED, 0);
    case QMAT_USD_DICTIONARY:
      start = w->body.size;
      crate_put_dictionary(w, value, false);
      return crate_rep(31, 0, start);
    case QMAT_USD_TIME_SAMPLES:
      return crate_samples(w, value->samples);
    case QMAT_USD_LIST_OP:
      return crate_list_op(w, value, false);
    default:
      break;
  }
  unsigned type = crate_plain_type(value, is_quaternion);
  if (strncmp(type_name, "matrix2d", 8) == 0) type = 13;
  return value->is_array ? crate_array(w, value, type, is_quaternion) : crate_single(w, value, type, is_quaternion);
}

static inline uint64_t crate_field(crate_writer *w, const qmat_usd_spec *spec, const qmat_usd_field *field) {
  static const char *const choices[][4] = {{"specifier", "def", "over", "class"},
                                           {"variability", "varying", "uniform"}};
  const qmat_usd_value *value = field->value;
  const size_t start = w->body.size;
  for (unsigned i = 0; i < 2; i++) {
    for (unsigned k = 1; strcmp(field->name, choices[i][0]) == 0 && k < 4 && choices[i][k]; k++) {
      if (strcmp(value->texts[0], choices[i][k]) == 0) return crate_rep(i ? 44 : 42, CRATE_INLINED, k - 1);
    }
  }
  if (strcmp(field->name, "variantSelection") == 0) {
    crate_put_dictionary(w, value, true);
    return crate_rep(45, 0, start);
  }
  if (strcmp(field->name, "subLayers") == 0) {
    crate_put_list(w, value, false);
    return crate_rep(50, 0, start);
  }
  if (strcmp(field->name, "subLayerOffsets") == 0) {
    crate_put_u64(&w->body, value->count);
    for (size_t i = 0; i < 2 * value->count; i++) qmat_put_f64(&w->body, value->numbers[i]);
    return crate_rep(49, 0, start);
  }
  if (strcmp(field->name, "payload") == 0) return crate_list_op(w, value, true);
  const char *type_name = qmat_usd_text(qmat_usd_field_value(spec, "typeName"));
  return crate_value(w, value, strcmp(field->name, "default") == 0 && type_name ? type_name : "");
}

static inline void crate_add_field(crate_writer *w, const char *name, uint64_t rep) {
  assert_true(w->field_count < 4 * CRATE_MOST && w->set_length + 2 < 8 * CRATE_MOST);
  w->field_names[w->field_count] = crate_token(w, name);
  w->field_reps[w->field_count] = rep;
  w->sets[w->set_length++] = (uint32_t)w->field_count++;
}

static inline void crate_add_spec(crate_writer *w, const qmat_usd_spec *spec, int path) {
  static const uint8_t types[] = {[QMAT_USD_ROOT] = 7,         [QMAT_USD_PRIM] = 6,         [QMAT_USD_ATTRIBUTE] = 1,
                                  [QMAT_USD_RELATIONSHIP] = 8, [QMAT_USD_VARIANT_SET] = 11, [QMAT_USD_VARIANT] = 10};
  assert_true(w->spec_count < CRATE_MOST);
  w->spec_paths[w->spec_count] = (uint32_t)path;
  w->spec_sets[w->spec_count] = (uint32_t)w->set_length;
  w->spec_types[w->spec_count++] = types[spec->kind];
  for (size_t i = 0; i < spec->field_count; i++) {
    if (spec->fields[i].value->type == QMAT_USD_UNREAD) continue;
    crate_add_field(w, spec->fields[i].name, crate_field(w, spec, &spec->fields[i]));
  }
  size_t prims = 0;
  for (const qmat_usd_spec *child = spec->first_child; child; child = child->next)
    prims += child->kind == QMAT_USD_PRIM;
  if (prims > 0) {
    const size_t start = w->body.size;
    crate_put_u64(&w->body, prims);
    for (const qmat_usd_spec *child = spec->first_child; child; child = child->next) {
      if (child->kind == QMAT_USD_PRIM) qmat_put_u32(&w->body, crate_token(w, child->name));
    }
    crate_add_field(w, "primChildren", crate_rep(41, 0, start));
  }
  w->sets[w->set_length++] = UINT32_MAX;
  /* Backwards, so that only the list above has the order. */
  const qmat_usd_spec *children[CRATE_MOST];
  size_t count = 0;
  for (const qmat_usd_spec *child = spec->first_child; child; child = child->next) children[count++] = child;
  while (count-- > 0) {
    const qmat_usd_spec *child = children[count];
    char element[512];
    int above = path;
    snprintf(element, sizeof element, "%s", child->name);
    if (child->kind == QMAT_USD_VARIANT_SET) snprintf(element, sizeof element, "{%s=}", child->name);
    if (child->kind == QMAT_USD_VARIANT) {
      snprintf(element, sizeof element, "{%s=%s}", spec->name, child->name);
      above = w->nodes[path].parent;
    }
    const bool is_property = child->kind == QMAT_USD_ATTRIBUTE || child->kind == QMAT_USD_RELATIONSHIP;
    crate_add_spec(w, child, crate_path_child(w, above, element, is_property));
  }
}

static inline void crate_order_paths(const crate_writer *w, int at, uint32_t *indices, uint32_t *elements,
                                     uint32_t *jumps, size_t *count) {
  const crate_node *node = &w->nodes[at];
  const size_t mine = (*count)++;
  indices[mine] = (uint32_t)at;
  const int32_t token = (int32_t)crate_token((crate_writer *)w, node->element);
  elements[mine] = (uint32_t)(node->is_property ? -token : token);
  for (int child = node->first_child; child >= 0; child = w->nodes[child].next) {
    crate_order_paths(w, child, indices, elements, jumps, count);
  }
  const bool has_child = node->first_child >= 0, has_sibling = node->next >= 0;
  jumps[mine] = (uint32_t)(has_child && has_sibling ? (int32_t)(*count - mine) : has_child ? -1 : has_sibling ? 0 : -2);
}

/* Changes some numbers of a table. */
static inline void crate_damage(uint64_t seed, uint64_t table, uint32_t *numbers, size_t count) {
  if (qmat_hash3(seed, table, 100) % 8 != 0) return;
  for (uint64_t i = 0; i < 1 + qmat_hash3(seed, table, 0) % 2 && count > 0; i++) {
    const uint64_t random = qmat_hash3(seed, table, i + 1);
    uint32_t *number = &numbers[(random >> 32) % count];
    const uint32_t changed[] = {(uint32_t)random, (uint32_t)(random % (count + 1)), *number + 1,
                                *number - 1,      *number ^ 1u << (random % 32),    0,
                                UINT32_MAX,       numbers[random % count]};
    *number = changed[random >> 8 & 7];
  }
}

/* The layer as a crate of version 0.`version`. With a seed other than 0 some
 * numbers in its tables are wrong. The caller frees the writer. */
static inline qmat_writer write_damaged_crate(const qmat_usd_layer *layer, int version, uint64_t seed) {
  crate_writer *w = calloc(1, sizeof *w);
  assert_non_null(w);
  w->version = version;
  for (int i = 0; i < CRATE_HEADER; i++) qmat_put_u8(&w->body, 0);
  crate_token(w, ";-)"); /* so that no property has token 0, whose sign would be lost */
  crate_path_child(w, -1, "", false);
  crate_add_spec(w, layer->root, 0);

  static uint32_t indices[CRATE_MOST], elements[CRATE_MOST], jumps[CRATE_MOST];
  size_t path_count = 0;
  crate_order_paths(w, 0, indices, elements, jumps, &path_count);
  if (seed != 0) {
    crate_damage(seed, 0, w->strings, w->string_count);
    crate_damage(seed, 1, w->field_names, w->field_count);
    crate_damage(seed, 2, (uint32_t *)(void *)w->field_reps, 2 * w->field_count);
    crate_damage(seed, 3, w->sets, w->set_length);
    crate_damage(seed, 4, indices, path_count);
    crate_damage(seed, 5, elements, path_count);
    crate_damage(seed, 6, jumps, path_count);
    crate_damage(seed, 7, w->spec_paths, w->spec_count);
    crate_damage(seed, 8, w->spec_sets, w->spec_count);
    crate_damage(seed, 9, w->spec_types, w->spec_count);
  }
  qmat_writer text = {0};
  for (size_t i = 0; i < w->token_count; i++) qmat_put_bytes(&text, w->tokens[i], strlen(w->tokens[i]) + 1);
  const crate_tables tables = {.token_count = w->token_count,
                               .token_bytes = text.size,
                               .string_count = w->string_count,
                               .field_count = w->field_count,
                               .set_length = w->set_length,
                               .path_count = path_count,
                               .spec_count = w->spec_count,
                               .tokens = (const char *)text.bytes,
                               .strings = w->strings,
                               .field_names = w->field_names,
                               .sets = w->sets,
                               .indices = indices,
                               .elements = elements,
                               .jumps = jumps,
                               .spec_paths = w->spec_paths,
                               .spec_sets = w->spec_sets,
                               .spec_types = w->spec_types,
                               .field_reps = w->field_reps};
  crate_put_tables(&w->body, version, &tables);
  qmat_writer made = w->body;
  for (size_t i = 0; i < w->token_count; i++) free(w->tokens[i]);
  qmat_writer_uninit(&text);
  free(w);
  return made;
}

static inline qmat_writer write_crate(const qmat_usd_layer *layer, int version) {
  return write_damaged_crate(layer, version, 0);
}

#endif
