/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The binary form of USD, the "crate": tables of tokens, paths, fields and specs, packed with LZ4, and values that the
 * fields point to. Source of the layout: OpenUSD, pxr/usd/sdf/crateFile. */
#include <math.h>
#include <string.h>

#include <lz4.h>

#include "core/hash.h"
#include "io/usd/usd.h"

enum { OLDEST_VERSION = 6, NEWEST_VERSION = 10, TOC_OFFSET_AT = 16, SECTION_BYTES = 32, MOST_SECTIONS = 64 };
/* LZ4 makes of a byte at most 255, and a little more of a block. */
enum { LZ4_RATIO = 255, LZ4_BLOCK_SLACK = 64 };
/* Arrays with fewer elements are never packed. */
enum { FEWEST_PACKED = 16 };
#define NO_FIELD UINT32_MAX

/* What stands in a value's 64 bits. */
#define REP_ARRAY ((uint64_t)1 << 63)
#define REP_INLINED ((uint64_t)1 << 62)
#define REP_PACKED ((uint64_t)1 << 61)
#define REP_PAYLOAD (((uint64_t)1 << 48) - 1)

typedef enum crate_type {
  CRATE_DICTIONARY = 31,
  CRATE_TOKEN_LIST_OP,
  CRATE_STRING_LIST_OP,
  CRATE_PATH_LIST_OP,
  CRATE_REFERENCE_LIST_OP,
  CRATE_INT_LIST_OP,
  CRATE_INT64_LIST_OP,
  CRATE_UINT_LIST_OP,
  CRATE_UINT64_LIST_OP,
  CRATE_PATH_VECTOR,
  CRATE_TOKEN_VECTOR,
  CRATE_SPECIFIER,
  CRATE_PERMISSION,
  CRATE_VARIABILITY,
  CRATE_VARIANT_SELECTION_MAP,
  CRATE_TIME_SAMPLES,
  CRATE_PAYLOAD,
  CRATE_DOUBLE_VECTOR,
  CRATE_LAYER_OFFSET_VECTOR,
  CRATE_STRING_VECTOR,
  CRATE_VALUE_BLOCK,
  CRATE_VALUE,
  CRATE_UNREGISTERED_VALUE,
  CRATE_UNREGISTERED_VALUE_LIST_OP,
  CRATE_PAYLOAD_LIST_OP,
  CRATE_TIME_CODE,
  CRATE_PATH_EXPRESSION
} crate_type;

/* The types whose elements are numbers or texts, by their number in the file. */
static const struct {
  qmat_usd_type type;
  uint8_t components, rows; /* rows: of a matrix, else 0 */
  bool is_quaternion;       /* stored with the real part last */
} plain_types[] = {
    [1] = {QMAT_USD_BOOL, 1, 0, false},
    [2] = {QMAT_USD_UCHAR, 1, 0, false},
    [3] = {QMAT_USD_INT, 1, 0, false},
    [4] = {QMAT_USD_UINT, 1, 0, false},
    [5] = {QMAT_USD_INT64, 1, 0, false},
    [6] = {QMAT_USD_UINT64, 1, 0, false},
    [7] = {QMAT_USD_HALF, 1, 0, false},
    [8] = {QMAT_USD_FLOAT, 1, 0, false},
    [9] = {QMAT_USD_DOUBLE, 1, 0, false},
    [10] = {QMAT_USD_STRING, 1, 0, false},
    [11] = {QMAT_USD_TOKEN, 1, 0, false},
    [12] = {QMAT_USD_ASSET, 1, 0, false},
    [13] = {QMAT_USD_DOUBLE, 4, 2, false},
    [14] = {QMAT_USD_DOUBLE, 9, 3, false},
    [15] = {QMAT_USD_DOUBLE, 16, 4, false},
    [16] = {QMAT_USD_DOUBLE, 4, 0, true},
    [17] = {QMAT_USD_FLOAT, 4, 0, true},
    [18] = {QMAT_USD_HALF, 4, 0, true},
    [19] = {QMAT_USD_DOUBLE, 2, 0, false},
    [20] = {QMAT_USD_FLOAT, 2, 0, false},
    [21] = {QMAT_USD_HALF, 2, 0, false},
    [22] = {QMAT_USD_INT, 2, 0, false},
    [23] = {QMAT_USD_DOUBLE, 3, 0, false},
    [24] = {QMAT_USD_FLOAT, 3, 0, false},
    [25] = {QMAT_USD_HALF, 3, 0, false},
    [26] = {QMAT_USD_INT, 3, 0, false},
    [27] = {QMAT_USD_DOUBLE, 4, 0, false},
    [28] = {QMAT_USD_FLOAT, 4, 0, false},
    [29] = {QMAT_USD_HALF, 4, 0, false},
    [30] = {QMAT_USD_INT, 4, 0, false},
    [CRATE_TIME_CODE] = {QMAT_USD_TIMECODE, 1, 0, false},
};

/* The bytes of one component in the file. */
static const uint8_t component_bytes[QMAT_USD_TYPE_COUNT] = {
    [QMAT_USD_BOOL] = 1,   [QMAT_USD_UCHAR] = 1, [QMAT_USD_INT] = 4,   [QMAT_USD_UINT] = 4,   [QMAT_USD_INT64] = 8,
    [QMAT_USD_UINT64] = 8, [QMAT_USD_HALF] = 2,  [QMAT_USD_FLOAT] = 4, [QMAT_USD_DOUBLE] = 8, [QMAT_USD_TIMECODE] = 8,
    [QMAT_USD_STRING] = 4, [QMAT_USD_TOKEN] = 4, [QMAT_USD_ASSET] = 4, [QMAT_USD_PATH] = 4,
};

typedef struct section {
  const uint8_t *bytes;
  size_t size;
} section;

typedef struct crate_path {
  uint32_t parent;     /* UINT32_MAX: of the root, and of paths that the table leaves out */
  const char *element; /* the name, or "{set=variant}", or "[target]"; NULL: of paths that the table leaves out */
  bool is_property;
  qmat_usd_spec *spec;
  const char *text; /* made when it is asked for */
} crate_path;

/* A value that has been read, or (NULL) is being read. */
typedef struct known_value {
  uint64_t rep; /* 0: free */
  const qmat_usd_value *value;
} known_value;

typedef struct crate {
  qmat_context *context;
  qmat_usd_layer *layer;
  const uint8_t *bytes;
  size_t size;
  int version; /* the 8 of 0.8.0 */
  int depth;
  size_t token_count, string_count, field_count, field_set_length, path_count;
  const char **tokens;
  uint32_t *strings; /* tokens */
  uint32_t *field_names;
  uint64_t *field_reps;
  uint32_t *field_sets; /* numbers of fields, each set ended by NO_FIELD */
  crate_path *paths;
  uint32_t *path_order; /* parents before children */
  size_t path_order_count;
  known_value *known;
  size_t known_count, known_slots;
  qmat_arena scratch;
} crate;

/* ---- errors ---- */

static qmat_status fail(const crate *c, const char *what) {
  qmat_fail(c->context, QMAT_ERROR_FORMAT, "%s", what);
  return qmat_fail_at(c->context, c->layer->path, 0, 0);
}

static qmat_status fail_memory(const crate *c) {
  qmat_fail_memory(c->context, "a USD layer");
  return qmat_fail_at(c->context, c->layer->path, 0, 0);
}

static qmat_status fail_short(const crate *c) {
  return fail(c, "the file ends within a value or a table, or an offset leads out of it");
}

static void *layer_alloc(const crate *c, size_t count, size_t size) {
  return qmat_usd_alloc(c->context, c->layer, count, size);
}

/* ---- unpacking ---- */

/* What `packed` bytes may become. */
static size_t largest_unpacked(size_t packed) {
  return packed > SIZE_MAX / LZ4_RATIO / 2 ? SIZE_MAX / 2 : packed * LZ4_RATIO + LZ4_BLOCK_SLACK;
}

/* LZ4 blocks behind a count: 0 stands for one block that takes all of the bytes, else each has its size before it. */
static qmat_status unpack(const crate *c, const uint8_t *packed, size_t size, uint8_t *bytes, size_t capacity,
                          size_t *made) {
  qmat_byte_reader reader = {.bytes = packed, .size = size};
  unsigned blocks = qmat_take_u8(&reader);
  *made = 0;
  for (unsigned i = 0; i < (blocks > 0 ? blocks : 1); i++) {
    size_t block_size = blocks > 0 ? qmat_take_u32(&reader) : qmat_bytes_left(&reader);
    const uint8_t *block = qmat_take_bytes(&reader, block_size);
    size_t room = capacity - *made;
    if (!block || block_size > LZ4_MAX_INPUT_SIZE) return fail(c, "a packed table or array does not fit into the file");
    int got = LZ4_decompress_safe((const char *)block, (char *)bytes + *made, (int)block_size,
                                  room < INT32_MAX ? (int)room : INT32_MAX);
    if (got < 0) return fail(c, "a packed table or array cannot be unpacked");
    *made += (size_t)got;
  }
  return QMAT_OK;
}

/* Takes `count` whole numbers of 4 or 8 bytes: each the difference from the one before, in two bits that say how many
 * bytes it has (none: the commonest difference). Written sign-extended. */
static qmat_status take_packed_integers(const crate *c, qmat_byte_reader *reader, size_t count, unsigned width,
                                        int64_t *integers) {
  uint64_t packed_size = qmat_take_u64(reader);
  const uint8_t *packed = packed_size <= SIZE_MAX ? qmat_take_bytes(reader, packed_size) : NULL;
  if (!packed) return fail_short(c);
  size_t codes_size = count / 4 + (count % 4 != 0), least = width + codes_size;
  if (least > largest_unpacked(packed_size)) return fail(c, "an array is longer than its packed bytes allow");
  size_t most = least + count * width;
  if (most > largest_unpacked(packed_size)) most = largest_unpacked(packed_size);
  uint8_t *bytes = qmat_alloc(most, 1);
  if (!bytes) return fail_memory(c);
  size_t size;
  qmat_status status = unpack(c, packed, packed_size, bytes, most, &size);
  if (status == QMAT_OK && size < least) status = fail_short(c);
  if (status == QMAT_OK) {
    qmat_byte_reader codes = {.bytes = bytes, .size = size}, differences = {.bytes = bytes, .size = size, .at = least};
    uint64_t common = width == 4 ? (uint64_t)(int32_t)qmat_take_u32(&codes) : qmat_take_u64(&codes), value = 0;
    for (size_t i = 0; i < count; i++) {
      uint64_t difference = common;
      switch (bytes[width + i / 4] >> (2 * (i % 4)) & 3) {
        case 1:
          difference = width == 4 ? (uint64_t)(int8_t)qmat_take_u8(&differences)
                                  : (uint64_t)(int16_t)qmat_take_u16(&differences);
          break;
        case 2:
          difference = width == 4 ? (uint64_t)(int16_t)qmat_take_u16(&differences)
                                  : (uint64_t)(int32_t)qmat_take_u32(&differences);
          break;
        case 3:
          difference = width == 4 ? (uint64_t)(int32_t)qmat_take_u32(&differences) : qmat_take_u64(&differences);
          break;
        default:
          break;
      }
      value += difference;
      integers[i] = width == 4 ? (int32_t)(uint32_t)value : (int64_t)value;
    }
    if (differences.failed) status = fail_short(c);
  }
  qmat_free(bytes);
  return status;
}

/* The same as indices, in the scratch memory. */
static qmat_status take_packed_indices(crate *c, qmat_byte_reader *reader, size_t count, uint32_t **indices) {
  /* Two bits each at least, and no more than the file justifies: refused before memory is taken. */
  if (count / 4 > largest_unpacked(qmat_bytes_left(reader)) || count > c->layer->allowance / sizeof(int64_t)) {
    return fail(c, "a table is longer than the file justifies");
  }
  int64_t *wide = qmat_alloc(count, sizeof *wide);
  *indices = qmat_arena_alloc(&c->scratch, count, sizeof **indices);
  qmat_status status = wide && *indices ? take_packed_integers(c, reader, count, 4, wide) : fail_memory(c);
  for (size_t i = 0; i < count && status == QMAT_OK; i++) (*indices)[i] = (uint32_t)wide[i];
  qmat_free(wide);
  return status;
}

/* ---- tables ---- */

static qmat_status find_section(const crate *c, const char *name, section *found) {
  qmat_byte_reader reader = {.bytes = c->bytes, .size = c->size, .at = TOC_OFFSET_AT};
  uint64_t toc = qmat_take_u64(&reader);
  if (toc >= c->size) return fail_short(c);
  reader.at = (size_t)toc;
  uint64_t count = qmat_take_u64(&reader);
  if (reader.failed || count > MOST_SECTIONS || qmat_bytes_left(&reader) / SECTION_BYTES < count) return fail_short(c);
  for (uint64_t i = 0; i < count; i++) {
    const uint8_t *title = qmat_take_bytes(&reader, 16);
    uint64_t start = qmat_take_u64(&reader), size = qmat_take_u64(&reader);
    if (!title || strncmp((const char *)title, name, 16) != 0) continue;
    if (start > c->size || size > c->size - start) return fail_short(c);
    *found = (section){.bytes = c->bytes + start, .size = (size_t)size};
    return QMAT_OK;
  }
  qmat_fail(c->context, QMAT_ERROR_FORMAT, "the file has no table %s", name);
  return qmat_fail_at(c->context, c->layer->path, 0, 0);
}

static qmat_byte_reader read_section(const section *from) {
  return (qmat_byte_reader){.bytes = from->bytes, .size = from->size};
}

static qmat_status read_tokens(crate *c) {
  section from;
  qmat_status status = find_section(c, "TOKENS", &from);
  if (status != QMAT_OK) return status;
  qmat_byte_reader reader = read_section(&from);
  uint64_t count = qmat_take_u64(&reader), size = qmat_take_u64(&reader), packed_size = qmat_take_u64(&reader);
  const uint8_t *packed = qmat_take_bytes(&reader, packed_size);
  if (!packed || size > largest_unpacked(packed_size) || count > size) return fail_short(c);
  char *text = layer_alloc(c, size + 1, 1);
  const char **tokens = text ? layer_alloc(c, count, sizeof *tokens) : NULL;
  if (!tokens) return c->context->error.status;
  size_t made;
  status = unpack(c, packed, packed_size, (uint8_t *)text, size, &made);
  if (status != QMAT_OK) return status;
  const char *at = text, *end = text + made;
  for (uint64_t i = 0; i < count; i++) {
    if (at >= end) return fail(c, "the table TOKENS has fewer tokens than it says");
    tokens[i] = at;
    at += strlen(at) + 1;
  }
  c->tokens = tokens;
  c->token_count = (size_t)count;
  return QMAT_OK;
}

static qmat_status read_strings(crate *c) {
  section from;
  qmat_status status = find_section(c, "STRINGS", &from);
  if (status != QMAT_OK) return status;
  qmat_byte_reader reader = read_section(&from);
  uint64_t count = qmat_take_u64(&reader);
  if (reader.failed || qmat_bytes_left(&reader) / 4 < count) return fail_short(c);
  c->strings = qmat_arena_alloc(&c->scratch, (size_t)count, sizeof *c->strings);
  if (!c->strings) return fail_memory(c);
  for (uint64_t i = 0; i < count; i++) {
    c->strings[i] = qmat_take_u32(&reader);
    if (c->strings[i] >= c->token_count) return fail(c, "a string names a token that is not there");
  }
  c->string_count = (size_t)count;
  return QMAT_OK;
}

static qmat_status read_fields(crate *c) {
  section from;
  qmat_status status = find_section(c, "FIELDS", &from);
  if (status != QMAT_OK) return status;
  qmat_byte_reader reader = read_section(&from);
  uint64_t count = qmat_take_u64(&reader);
  if (reader.failed) return fail_short(c);
  status = take_packed_indices(c, &reader, count, &c->field_names);
  if (status != QMAT_OK) return status;
  uint64_t packed_size = qmat_take_u64(&reader);
  const uint8_t *packed = qmat_take_bytes(&reader, packed_size);
  if (!packed || count > largest_unpacked(packed_size) / 8) return fail_short(c);
  c->field_reps = qmat_arena_alloc(&c->scratch, (size_t)count, sizeof *c->field_reps);
  if (!c->field_reps) return fail_memory(c);
  size_t made;
  status = unpack(c, packed, packed_size, (uint8_t *)c->field_reps, (size_t)count * 8, &made);
  if (status != QMAT_OK) return status;
  if (made != count * 8) return fail_short(c);
  qmat_byte_reader reps = {.bytes = (const uint8_t *)c->field_reps, .size = made};
  for (uint64_t i = 0; i < count; i++) {
    c->field_reps[i] = qmat_take_u64(&reps); /* in place: the same bytes, in this machine's order */
    if (c->field_names[i] >= c->token_count) return fail(c, "a field names a token that is not there");
  }
  c->field_count = (size_t)count;
  return QMAT_OK;
}

static qmat_status read_field_sets(crate *c) {
  section from;
  qmat_status status = find_section(c, "FIELDSETS", &from);
  if (status != QMAT_OK) return status;
  qmat_byte_reader reader = read_section(&from);
  uint64_t count = qmat_take_u64(&reader);
  if (reader.failed) return fail_short(c);
  status = take_packed_indices(c, &reader, count, &c->field_sets);
  if (status != QMAT_OK) return status;
  for (uint64_t i = 0; i < count; i++) {
    if (c->field_sets[i] != NO_FIELD && c->field_sets[i] >= c->field_count) {
      return fail(c, "a set of fields names a field that is not there");
    }
  }
  if (count == 0 || c->field_sets[count - 1] != NO_FIELD) return fail(c, "the last set of fields does not end");
  c->field_set_length = (size_t)count;
  return QMAT_OK;
}

/* The paths stand in depth-first order; a jump says what follows one: > 0 a child, and a sibling so far on; 0 a
 * sibling; -1 a child; -2 neither. */
static qmat_status build_paths(crate *c, size_t count, const uint32_t *indices, const uint32_t *elements,
                               const uint32_t *jumps) {
  typedef struct pending {
    uint32_t at, parent;
  } pending;
  pending *stack = qmat_arena_alloc(&c->scratch, count + 1, sizeof *stack);
  bool *seen = qmat_arena_calloc(&c->scratch, count, sizeof *seen);
  c->path_order = qmat_arena_alloc(&c->scratch, count, sizeof *c->path_order);
  if (!stack || !seen || !c->path_order) return fail_memory(c);
  size_t waiting = 0;
  if (count > 0) stack[waiting++] = (pending){0, UINT32_MAX};
  while (waiting > 0) {
    const pending now = stack[--waiting];
    if (now.at >= count || seen[now.at]) return fail(c, "the table PATHS is no tree");
    seen[now.at] = true;
    const uint32_t path = indices[now.at];
    const int32_t element = (int32_t)elements[now.at], jump = (int32_t)jumps[now.at];
    const int64_t token = element < 0 ? -(int64_t)element : element;
    if (path >= c->path_count || c->paths[path].element) return fail(c, "the table PATHS is no tree");
    if (token >= (int64_t)c->token_count && now.parent != UINT32_MAX) {
      return fail(c, "a path names a token that is not there");
    }
    c->paths[path].parent = now.parent;
    c->paths[path].element = now.parent == UINT32_MAX ? "" : c->tokens[token];
    c->paths[path].is_property = element < 0;
    c->path_order[c->path_order_count++] = path;
    if (jump < -2 || (jump >= 0 && now.parent == UINT32_MAX)) return fail(c, "the table PATHS is no tree");
    /* Each node leaves one or two others, and `count` of them are the most that can be seen. */
    if (jump >= 0) stack[waiting++] = (pending){now.at + (jump > 0 ? (uint32_t)jump : 1), now.parent};
    if (jump > 0 || jump == -1) {
      if (waiting > count) return fail(c, "the table PATHS is no tree");
      stack[waiting++] = (pending){now.at + 1, path};
    }
  }
  return QMAT_OK;
}

static qmat_status read_paths(crate *c) {
  section from;
  qmat_status status = find_section(c, "PATHS", &from);
  if (status != QMAT_OK) return status;
  qmat_byte_reader reader = read_section(&from);
  uint64_t count = qmat_take_u64(&reader), encoded = qmat_take_u64(&reader);
  /* The empty path is counted, but not in the tree. */
  if (reader.failed || encoded > count || count - encoded > 1) return fail_short(c);
  uint32_t *indices, *elements, *jumps;
  status = take_packed_indices(c, &reader, encoded, &indices);
  if (status == QMAT_OK) status = take_packed_indices(c, &reader, encoded, &elements);
  if (status == QMAT_OK) status = take_packed_indices(c, &reader, encoded, &jumps);
  if (status != QMAT_OK) return status;
  c->paths = qmat_arena_calloc(&c->scratch, (size_t)count, sizeof *c->paths);
  if (!c->paths) return fail_memory(c);
  c->path_count = (size_t)count;
  for (size_t i = 0; i < c->path_count; i++) c->paths[i].parent = UINT32_MAX;
  return build_paths(c, (size_t)encoded, indices, elements, jumps);
}

/* ---- parts of values ---- */

static const char *token_at(const crate *c, uint32_t index) {
  return index < c->token_count ? c->tokens[index] : NULL;
}

static const char *string_at(const crate *c, uint32_t index) {
  return index < c->string_count ? c->tokens[c->strings[index]] : NULL;
}

/* What stands between a path and its parent. */
static const char *separator(const crate *c, const crate_path *path) {
  const char *element = path->element;
  if (path->is_property) return ".";
  if (element[0] == '{' || element[0] == '[' || element[0] == '.') return "";
  const crate_path *parent = &c->paths[path->parent];
  return parent->element[0] == '{' ? "" : "/";
}

/* The text of a path; "" for the empty path; NULL with the error recorded. */
static const char *path_at(const crate *c, uint32_t index) {
  if (index >= c->path_count || !c->paths[index].element) return "";
  crate_path *path = &c->paths[index];
  if (path->text) return path->text;
  if (path->parent == UINT32_MAX) return path->text = "/";
  size_t length = 0;
  for (const crate_path *p = path; p->parent != UINT32_MAX; p = &c->paths[p->parent]) {
    length += strlen(p->element) + strlen(separator(c, p));
  }
  char *text = layer_alloc(c, length + 1, 1);
  if (!text) return NULL;
  char *at = text + length;
  for (const crate_path *p = path; p->parent != UINT32_MAX; p = &c->paths[p->parent]) {
    const char *parts[2] = {p->element, separator(c, p)};
    for (int i = 0; i < 2; i++) {
      at -= strlen(parts[i]);
      memcpy(at, parts[i], strlen(parts[i]));
    }
  }
  return path->text = text;
}

static double half_from_bits(uint16_t bits) {
  int exponent = bits >> 10 & 31;
  double fraction = bits & 1023;
  double size = exponent == 31  ? (fraction > 0 ? (double)NAN : (double)INFINITY)
                : exponent == 0 ? ldexp(fraction, -24)
                                : ldexp(1024 + fraction, exponent - 25);
  return bits >> 15 ? -size : size;
}

static int64_t take_integer(qmat_byte_reader *reader, qmat_usd_type type) {
  switch (type) {
    case QMAT_USD_BOOL:
      return qmat_take_u8(reader) != 0;
    case QMAT_USD_UCHAR:
      return qmat_take_u8(reader);
    case QMAT_USD_INT:
      return (int32_t)qmat_take_u32(reader);
    case QMAT_USD_UINT:
      return qmat_take_u32(reader);
    default:
      return (int64_t)qmat_take_u64(reader);
  }
}

static double take_number(qmat_byte_reader *reader, qmat_usd_type type) {
  if (type == QMAT_USD_HALF) return half_from_bits(qmat_take_u16(reader));
  if (type == QMAT_USD_FLOAT) return (double)qmat_take_f32(reader);
  return qmat_take_f64(reader);
}

/* A text by its index; in arrays, assets are strings, alone they are tokens. */
static const char *take_text(const crate *c, qmat_byte_reader *reader, qmat_usd_type type) {
  uint32_t index = qmat_take_u32(reader);
  if (reader->failed) return NULL;
  if (type == QMAT_USD_PATH) return path_at(c, index);
  return type == QMAT_USD_TOKEN ? token_at(c, index) : string_at(c, index);
}

static qmat_status take_texts(const crate *c, qmat_byte_reader *reader, qmat_usd_type type, uint64_t count,
                              qmat_usd_value *value) {
  if (reader->failed || qmat_bytes_left(reader) / 4 < count) return fail_short(c);
  const char **texts = layer_alloc(c, (size_t)count, sizeof *texts);
  if (!texts) return c->context->error.status;
  for (uint64_t i = 0; i < count; i++) {
    texts[i] = take_text(c, reader, type);
    if (!texts[i] && type == QMAT_USD_PATH) return c->context->error.status;
    if (!texts[i]) return fail(c, "a value names a token or a string that is not there");
  }
  *value = (qmat_usd_value){.type = type, .is_array = true, .components = 1, .count = (size_t)count, .texts = texts};
  return QMAT_OK;
}

static qmat_status take_elements(const crate *c, qmat_byte_reader *reader, unsigned crate, uint64_t count,
                                 qmat_usd_value *value) {
  const qmat_usd_type type = plain_types[crate].type;
  const unsigned components = plain_types[crate].components;
  if (reader->failed || qmat_bytes_left(reader) / (component_bytes[type] * components) < count) return fail_short(c);
  void *memory = layer_alloc(c, (size_t)count, 8 * components);
  if (!memory) return c->context->error.status;
  *value = (qmat_usd_value){.type = type, .is_array = true, .components = (uint8_t)components, .count = (size_t)count};
  size_t total = (size_t)count * components;
  if (qmat_usd_is_integer(type)) {
    int64_t *integers = memory;
    for (size_t i = 0; i < total; i++) integers[i] = take_integer(reader, type);
    value->integers = integers;
    return QMAT_OK;
  }
  double *numbers = memory;
  for (size_t i = 0; i < total; i++) numbers[i] = take_number(reader, type);
  if (plain_types[crate].is_quaternion) {
    for (double *q = numbers; q < numbers + total; q += 4) {
      double real = q[3];
      memmove(q + 1, q, 3 * sizeof *q);
      q[0] = real;
    }
  }
  value->numbers = numbers;
  return QMAT_OK;
}

/* ---- arrays ---- */

static qmat_status take_packed_array(const crate *c, qmat_byte_reader *reader, qmat_usd_type type, uint64_t count,
                                     qmat_usd_value *value) {
  if (reader->failed || count / 4 > largest_unpacked(qmat_bytes_left(reader))) return fail_short(c);
  void *memory = layer_alloc(c, (size_t)count, 8);
  if (!memory) return c->context->error.status;
  *value = (qmat_usd_value){.type = type, .is_array = true, .components = 1, .count = (size_t)count};
  qmat_status status;
  if (qmat_usd_is_integer(type)) {
    int64_t *integers = memory;
    status = take_packed_integers(c, reader, (size_t)count, component_bytes[type], integers);
    if (type == QMAT_USD_UINT) {
      for (uint64_t i = 0; i < count && status == QMAT_OK; i++) integers[i] = (uint32_t)integers[i];
    }
    value->integers = integers;
    return status;
  }
  char code = (char)qmat_take_u8(reader);
  uint32_t known = 0;
  const uint8_t *table = NULL;
  if (code == 't') {
    known = qmat_take_u32(reader);
    table = qmat_take_bytes(reader, (size_t)known * component_bytes[type]);
    if (!table) return fail_short(c);
  } else if (code != 'i') {
    return fail(c, "a packed array of numbers is of an unknown kind");
  }
  int64_t *integers = qmat_alloc((size_t)count, sizeof *integers);
  if (!integers) return fail_memory(c);
  status = take_packed_integers(c, reader, (size_t)count, 4, integers);
  double *numbers = memory;
  for (uint64_t i = 0; i < count && status == QMAT_OK; i++) {
    if (!table) {
      numbers[i] = (double)integers[i];
      continue;
    }
    uint32_t index = (uint32_t)integers[i];
    if (index >= known) {
      status = fail(c, "a packed array of numbers names an entry that is not there");
      break;
    }
    qmat_byte_reader entry = {.bytes = table + (size_t)index * component_bytes[type], .size = component_bytes[type]};
    numbers[i] = take_number(&entry, type);
  }
  qmat_free(integers);
  value->numbers = numbers;
  return status;
}

static qmat_status read_array(const crate *c, uint64_t rep, unsigned type, qmat_usd_value *value) {
  const uint64_t offset = rep & REP_PAYLOAD;
  const qmat_usd_type kind = plain_types[type].type;
  if (offset == 0) {
    *value = (qmat_usd_value){.type = kind, .is_array = true, .components = plain_types[type].components};
    return QMAT_OK;
  }
  if (offset >= c->size) return fail_short(c);
  qmat_byte_reader reader = {.bytes = c->bytes, .size = c->size, .at = (size_t)offset};
  uint64_t count = c->version < 7 ? qmat_take_u32(&reader) : qmat_take_u64(&reader);
  if (qmat_usd_is_text(kind)) return take_texts(c, &reader, kind, count, value);
  bool can_be_packed =
      plain_types[type].components == 1 && kind != QMAT_USD_BOOL && kind != QMAT_USD_UCHAR && kind != QMAT_USD_TIMECODE;
  if (can_be_packed && rep & REP_PACKED && count >= FEWEST_PACKED) {
    return take_packed_array(c, &reader, kind, count, value);
  }
  return take_elements(c, &reader, type, count, value);
}

/* ---- single values ---- */

/* A value that is in the 32 bits of its representation. */
static qmat_status read_inlined(const crate *c, uint32_t bits, unsigned type, qmat_usd_value *value) {
  const qmat_usd_type kind = plain_types[type].type;
  const unsigned components = plain_types[type].components, rows = plain_types[type].rows;
  *value = (qmat_usd_value){.type = kind, .components = (uint8_t)components, .count = 1};
  if (qmat_usd_is_text(kind)) {
    const char **text = layer_alloc(c, 1, sizeof *text);
    if (!text) return c->context->error.status;
    *text = kind == QMAT_USD_STRING ? string_at(c, bits) : token_at(c, bits);
    value->texts = text;
    return *text ? QMAT_OK : fail(c, "a value names a token or a string that is not there");
  }
  void *memory = layer_alloc(c, components, 8);
  if (!memory) return c->context->error.status;
  double *numbers = memory;
  int64_t *integers = memory;
  float single;
  memcpy(&single, &bits, sizeof single);
  if (qmat_usd_is_integer(kind)) {
    value->integers = integers;
  } else {
    value->numbers = numbers;
  }
  for (unsigned i = 0; i < components && components > 1; i++) {
    /* Vectors as signed bytes, matrices as their diagonals. */
    const bool is_off_diagonal = rows > 0 && i / rows != i % rows;
    const int8_t byte = (int8_t)(is_off_diagonal ? 0 : bits >> (8 * (rows > 0 ? i / rows : i)) & 0xFF);
    if (qmat_usd_is_integer(kind)) {
      integers[i] = byte;
    } else {
      numbers[i] = (double)byte;
    }
  }
  if (components > 1) return QMAT_OK;
  switch (kind) {
    case QMAT_USD_BOOL:
      integers[0] = (bits & 0xFF) != 0;
      break;
    case QMAT_USD_UCHAR:
      integers[0] = bits & 0xFF;
      break;
    case QMAT_USD_INT:
    case QMAT_USD_INT64:
      integers[0] = (int32_t)bits;
      break;
    case QMAT_USD_UINT:
    case QMAT_USD_UINT64:
      integers[0] = bits;
      break;
    case QMAT_USD_HALF:
      numbers[0] = half_from_bits((uint16_t)bits);
      break;
    default:
      numbers[0] = (double)single;
      break;
  }
  return QMAT_OK;
}

static bool is_always_inlined(qmat_usd_type type) {
  return qmat_usd_is_text(type) || (component_bytes[type] <= 4 && component_bytes[type] > 0);
}

static qmat_status read_plain(const crate *c, uint64_t rep, unsigned type, qmat_usd_value *value) {
  if (rep & REP_ARRAY) return read_array(c, rep, type, value);
  bool single = plain_types[type].components == 1;
  if (rep & REP_INLINED || (single && is_always_inlined(plain_types[type].type))) {
    return read_inlined(c, (uint32_t)rep, type, value);
  }
  const uint64_t offset = rep & REP_PAYLOAD;
  if (offset >= c->size) return fail_short(c);
  qmat_byte_reader reader = {.bytes = c->bytes, .size = c->size, .at = (size_t)offset};
  qmat_status status = take_elements(c, &reader, type, 1, value);
  value->is_array = false;
  return status;
}

/* ---- values that hold others ---- */

static qmat_status value_of(crate *c, uint64_t rep, const qmat_usd_value **value);

/* Where a distance leads from the place where it stands. */
static bool follow(qmat_byte_reader *reader) {
  const size_t start = reader->at;
  const int64_t distance = (int64_t)qmat_take_u64(reader);
  if (reader->failed || distance < -(int64_t)start || distance > (int64_t)(reader->size - start)) {
    reader->failed = true;
    return false;
  }
  reader->at = (size_t)((int64_t)start + distance);
  return true;
}

static qmat_status take_dictionary(crate *c, qmat_byte_reader *reader, bool of_strings, qmat_usd_value *value) {
  uint64_t count = qmat_take_u64(reader);
  if (reader->failed || qmat_bytes_left(reader) / 8 < count) return fail_short(c);
  qmat_usd_field *entries = layer_alloc(c, (size_t)count, sizeof *entries);
  if (!entries) return c->context->error.status;
  for (uint64_t i = 0; i < count; i++) {
    entries[i].name = take_text(c, reader, QMAT_USD_STRING);
    if (!entries[i].name) return fail(c, "a dictionary names a string that is not there");
    if (of_strings) {
      const char *text = take_text(c, reader, QMAT_USD_STRING);
      if (!text) return fail(c, "a dictionary names a string that is not there");
      entries[i].value = qmat_usd_text_value(c->context, c->layer, QMAT_USD_STRING, text);
      if (!entries[i].value) return c->context->error.status;
      continue;
    }
    uint64_t rep = follow(reader) ? qmat_take_u64(reader) : 0;
    if (reader->failed) return fail_short(c);
    qmat_status status = value_of(c, rep, &entries[i].value);
    if (status != QMAT_OK) return status;
  }
  *value = (qmat_usd_value){.type = QMAT_USD_DICTIONARY, .components = 1, .count = (size_t)count, .entries = entries};
  return QMAT_OK;
}

static qmat_status take_reference(crate *c, qmat_byte_reader *reader, bool is_payload, qmat_usd_reference *reference) {
  qmat_usd_value ignored;
  reference->asset = take_text(c, reader, QMAT_USD_STRING);
  if (!reference->asset) return fail(c, "a reference names a string that is not there");
  reference->path = take_text(c, reader, QMAT_USD_PATH);
  if (!reference->path) return reader->failed ? fail_short(c) : c->context->error.status;
  reference->scale = 1;
  if (!is_payload || c->version >= 8) {
    reference->offset = qmat_take_f64(reader);
    reference->scale = qmat_take_f64(reader);
  }
  return is_payload ? QMAT_OK : take_dictionary(c, reader, false, &ignored);
}

static qmat_status take_references(crate *c, qmat_byte_reader *reader, bool is_payload, uint64_t count,
                                   qmat_usd_value *value) {
  if (reader->failed || qmat_bytes_left(reader) / 8 < count) return fail_short(c);
  qmat_usd_reference *references = layer_alloc(c, (size_t)count, sizeof *references);
  if (!references) return c->context->error.status;
  for (uint64_t i = 0; i < count; i++) {
    qmat_status status = take_reference(c, reader, is_payload, &references[i]);
    if (status != QMAT_OK) return status;
  }
  *value = (qmat_usd_value){
      .type = QMAT_USD_REFERENCE, .is_array = true, .components = 1, .count = (size_t)count, .references = references};
  return reader->failed ? fail_short(c) : QMAT_OK;
}

static qmat_status take_list_op(crate *c, qmat_byte_reader *reader, unsigned type, qmat_usd_value *value) {
  /* The lists in their order in the file, and the bits that say that they are there. */
  static const struct {
    uint8_t bit;
    qmat_usd_edit edit;
  } lists[] = {{1, QMAT_USD_EXPLICIT}, {2, QMAT_USD_ADDED},   {5, QMAT_USD_PREPENDED},
               {6, QMAT_USD_APPENDED}, {3, QMAT_USD_DELETED}, {4, QMAT_USD_ORDERED}};
  qmat_usd_list_op *op = layer_alloc(c, 1, sizeof *op);
  if (!op) return c->context->error.status;
  *value = (qmat_usd_value){.type = QMAT_USD_LIST_OP, .components = 1, .count = 1, .list_op = op};
  const uint8_t header = qmat_take_u8(reader);
  op->is_explicit = header & 1;
  for (size_t i = 0; i < sizeof lists / sizeof lists[0]; i++) {
    qmat_usd_value *list = &op->lists[lists[i].edit];
    uint64_t count = header >> lists[i].bit & 1 ? qmat_take_u64(reader) : 0;
    qmat_status status;
    switch ((crate_type)type) {
      case CRATE_TOKEN_LIST_OP:
        status = take_texts(c, reader, QMAT_USD_TOKEN, count, list);
        break;
      case CRATE_STRING_LIST_OP:
        status = take_texts(c, reader, QMAT_USD_STRING, count, list);
        break;
      case CRATE_PATH_LIST_OP:
        status = take_texts(c, reader, QMAT_USD_PATH, count, list);
        break;
      case CRATE_REFERENCE_LIST_OP:
        status = take_references(c, reader, false, count, list);
        break;
      case CRATE_PAYLOAD_LIST_OP:
        status = take_references(c, reader, true, count, list);
        break;
      default: {
        static const uint8_t integers[] = {3, 5, 4, 6}; /* the plain types of the four lists of integers */
        status = take_elements(c, reader, integers[type - CRATE_INT_LIST_OP], count, list);
        break;
      }
    }
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

static qmat_status take_samples(crate *c, qmat_byte_reader *reader, qmat_usd_value *value) {
  const qmat_usd_value *times;
  uint64_t rep = follow(reader) ? qmat_take_u64(reader) : 0;
  if (reader->failed) return fail_short(c);
  qmat_status status = value_of(c, rep, &times);
  if (status != QMAT_OK) return status;
  uint64_t count = follow(reader) ? qmat_take_u64(reader) : 0;
  if (reader->failed || qmat_bytes_left(reader) / 8 < count) return fail_short(c);
  if (times->type != QMAT_USD_DOUBLE || !times->is_array || times->components != 1 || times->count != count) {
    return fail(c, "samples over time have other times than values");
  }
  qmat_usd_samples *samples = layer_alloc(c, 1, sizeof *samples);
  const qmat_usd_value **values = samples ? layer_alloc(c, (size_t)count, sizeof *values) : NULL;
  if (!values) return c->context->error.status;
  for (uint64_t i = 0; i < count && status == QMAT_OK; i++) status = value_of(c, qmat_take_u64(reader), &values[i]);
  *samples = (qmat_usd_samples){.count = (size_t)count, .times = times->numbers, .values = values};
  *value = (qmat_usd_value){.type = QMAT_USD_TIME_SAMPLES, .components = 1, .count = 1, .samples = samples};
  return status;
}

static qmat_status set_single(const crate *c, qmat_usd_type type, const char *text, qmat_usd_value *value) {
  const qmat_usd_value *made = qmat_usd_text_value(c->context, c->layer, type, text);
  if (!made) return c->context->error.status;
  *value = *made;
  return QMAT_OK;
}

/* A payload that stands alone is the explicit list of it. */
static qmat_status take_single_payload(crate *c, qmat_byte_reader *reader, qmat_usd_value *value) {
  qmat_usd_list_op *op = layer_alloc(c, 1, sizeof *op);
  if (!op) return c->context->error.status;
  for (int i = 0; i < QMAT_USD_EDIT_COUNT; i++) {
    op->lists[i] = (qmat_usd_value){.type = QMAT_USD_REFERENCE, .is_array = true, .components = 1};
  }
  op->is_explicit = true;
  *value = (qmat_usd_value){.type = QMAT_USD_LIST_OP, .components = 1, .count = 1, .list_op = op};
  qmat_status status = take_references(c, reader, true, 1, &op->lists[QMAT_USD_EXPLICIT]);
  if (status != QMAT_OK) return status;
  const qmat_usd_reference *payload = op->lists[QMAT_USD_EXPLICIT].references;
  if (!payload->asset[0] && !payload->path[0]) op->lists[QMAT_USD_EXPLICIT].count = 0;
  return QMAT_OK;
}

/* A text from a short list, by its number. */
static qmat_status set_choice(const crate *c, uint64_t rep, const char *const *choices, unsigned count,
                              qmat_usd_value *value) {
  uint32_t choice = (uint32_t)rep;
  if (choice >= count) return fail(c, "a specifier, permission or variability is unknown");
  return set_single(c, QMAT_USD_TOKEN, choices[choice], value);
}

static qmat_status read_value(crate *c, uint64_t rep, qmat_usd_value *value) {
  static const char *const specifiers[] = {"def", "over", "class"}, *const permissions[] = {"public", "private"},
                           *const variabilities[] = {"varying", "uniform", "uniform"};
  const unsigned type = rep >> 48 & 0xFF;
  if (type < sizeof plain_types / sizeof plain_types[0] && plain_types[type].components > 0) {
    return read_plain(c, rep, type, value);
  }
  if (type == CRATE_SPECIFIER) return set_choice(c, rep, specifiers, 3, value);
  if (type == CRATE_PERMISSION) return set_choice(c, rep, permissions, 2, value);
  if (type == CRATE_VARIABILITY) return set_choice(c, rep, variabilities, 3, value);
  if (type == CRATE_VALUE_BLOCK) {
    *value = (qmat_usd_value){.type = QMAT_USD_BLOCK};
    return QMAT_OK;
  }
  if (rep & REP_INLINED) {
    *value = (qmat_usd_value){
        .type = type == CRATE_DICTIONARY || type == CRATE_VARIANT_SELECTION_MAP ? QMAT_USD_DICTIONARY : QMAT_USD_BLOCK,
        .components = 1};
    return value->type == QMAT_USD_DICTIONARY ? QMAT_OK : fail(c, "a value is of an unknown kind");
  }
  const uint64_t offset = rep & REP_PAYLOAD;
  if (offset >= c->size) return fail_short(c);
  qmat_byte_reader reader = {.bytes = c->bytes, .size = c->size, .at = (size_t)offset};
  switch ((crate_type)type) {
    case CRATE_DICTIONARY:
    case CRATE_VARIANT_SELECTION_MAP:
      return take_dictionary(c, &reader, type == CRATE_VARIANT_SELECTION_MAP, value);
    case CRATE_TOKEN_LIST_OP:
    case CRATE_STRING_LIST_OP:
    case CRATE_PATH_LIST_OP:
    case CRATE_REFERENCE_LIST_OP:
    case CRATE_INT_LIST_OP:
    case CRATE_INT64_LIST_OP:
    case CRATE_UINT_LIST_OP:
    case CRATE_UINT64_LIST_OP:
    case CRATE_PAYLOAD_LIST_OP:
      return take_list_op(c, &reader, type, value);
    case CRATE_PATH_VECTOR:
      return take_texts(c, &reader, QMAT_USD_PATH, qmat_take_u64(&reader), value);
    case CRATE_TOKEN_VECTOR:
      return take_texts(c, &reader, QMAT_USD_TOKEN, qmat_take_u64(&reader), value);
    case CRATE_STRING_VECTOR:
      return take_texts(c, &reader, QMAT_USD_STRING, qmat_take_u64(&reader), value);
    case CRATE_DOUBLE_VECTOR:
      return take_elements(c, &reader, 9, qmat_take_u64(&reader), value);
    case CRATE_LAYER_OFFSET_VECTOR:
      return take_elements(c, &reader, 19, qmat_take_u64(&reader), value);
    case CRATE_TIME_SAMPLES:
      return take_samples(c, &reader, value);
    case CRATE_PAYLOAD:
      return take_single_payload(c, &reader, value);
    case CRATE_VALUE:
    case CRATE_UNREGISTERED_VALUE: {
      const qmat_usd_value *inner;
      uint64_t inner_rep = follow(&reader) ? qmat_take_u64(&reader) : 0;
      if (reader.failed) return fail_short(c);
      qmat_status status = value_of(c, inner_rep, &inner);
      if (status == QMAT_OK) *value = *inner;
      return status;
    }
    case CRATE_PATH_EXPRESSION: {
      const char *text = take_text(c, &reader, QMAT_USD_STRING);
      return text ? set_single(c, QMAT_USD_STRING, text, value)
                  : fail(c, "a value names a token or a string that is not there");
    }
    case CRATE_UNREGISTERED_VALUE_LIST_OP:
      return set_single(c, QMAT_USD_UNREAD, "list of values of unknown types", value);
    default:
      return fail(c, "a value is of an unknown kind");
  }
}

static known_value *find_known(const crate *c, uint64_t rep) {
  size_t slot = qmat_hash_mix(rep) & (c->known_slots - 1);
  while (c->known[slot].rep != 0 && c->known[slot].rep != rep) slot = (slot + 1) & (c->known_slots - 1);
  return &c->known[slot];
}

static bool grow_known(crate *c) {
  const size_t count = c->known_slots ? 2 * c->known_slots : 256, older_count = c->known_slots;
  known_value *older = c->known, *fresh = qmat_calloc(count, sizeof *fresh);
  if (!fresh) return false;
  c->known = fresh;
  c->known_slots = count;
  for (size_t i = 0; i < older_count; i++) {
    if (older[i].rep != 0) *find_known(c, older[i].rep) = older[i];
  }
  qmat_free(older);
  return true;
}

/* The value that a representation stands for; equal ones are read once. */
static qmat_status value_of(crate *c, uint64_t rep, const qmat_usd_value **value) {
  if (rep == 0) return fail(c, "a value is of an unknown kind");
  if (2 * c->known_count >= c->known_slots && !grow_known(c)) return fail_memory(c);
  known_value *known = find_known(c, rep);
  if (known->rep == rep) {
    *value = known->value;
    return known->value ? QMAT_OK : fail(c, "a value contains itself");
  }
  if (c->depth >= QMAT_USD_DEEPEST) return fail(c, "values are nested too deep");
  *known = (known_value){.rep = rep};
  c->known_count++;
  qmat_usd_value *made = layer_alloc(c, 1, sizeof *made);
  if (!made) return c->context->error.status;
  c->depth++;
  qmat_status status = read_value(c, rep, made);
  c->depth--;
  if (status != QMAT_OK) return status;
  find_known(c, rep)->value = made;
  *value = made;
  return QMAT_OK;
}

/* ---- specs ---- */

/* The fields of which a crate has its tree of specs, too. */
static bool says_what_the_tree_says(const char *name) {
  static const char *const names[] = {"properties",     "variantSetChildren", "variantChildren",
                                      "targetChildren", "connectionChildren", "mapperChildren"};
  for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
    if (strcmp(names[i], name) == 0) return true;
  }
  return false;
}

/* Puts the prims among the children into the order of the list; other children follow in the order they have. */
static void order_children(const crate *c, qmat_usd_spec *spec, const qmat_usd_value *names) {
  for (size_t i = 0; i < names->count; i++) {
    qmat_usd_spec *child = qmat_usd_child(c->layer, spec, QMAT_USD_PRIM, names->texts[i]);
    if (child) child->line = 1; /* it has a place in the list */
  }
  qmat_usd_spec *rest = NULL, **rest_end = &rest, *listed = NULL, **listed_end = &listed, *last = NULL;
  for (qmat_usd_spec *child = spec->first_child, *next; child; child = next) {
    next = child->next;
    if (child->line != 0) continue;
    *rest_end = child;
    rest_end = &child->next;
    last = child;
  }
  *rest_end = NULL;
  for (size_t i = 0; i < names->count; i++) {
    qmat_usd_spec *child = qmat_usd_child(c->layer, spec, QMAT_USD_PRIM, names->texts[i]);
    if (!child || child->line == 0) continue;
    child->line = 0;
    *listed_end = child;
    listed_end = &child->next;
    if (!rest) last = child;
  }
  *listed_end = rest;
  spec->first_child = listed;
  spec->last_child = last;
}

/* Reads the fields of one spec; `names` becomes the order of the prims below it, where there is one. */
static qmat_status read_spec_fields(crate *c, uint32_t set, qmat_usd_spec *spec, const qmat_usd_value **names) {
  if (set >= c->field_set_length) return fail(c, "a spec names a set of fields that is not there");
  size_t count = 0;
  while (c->field_sets[set + count] != NO_FIELD) count++;
  spec->fields = layer_alloc(c, count, sizeof *spec->fields);
  if (!spec->fields) return c->context->error.status;
  spec->field_capacity = count;
  for (size_t i = 0; i < count; i++) {
    const uint32_t field = c->field_sets[set + i];
    const char *name = c->tokens[c->field_names[field]];
    if (says_what_the_tree_says(name)) continue;
    const qmat_usd_value *value;
    qmat_status status = value_of(c, c->field_reps[field], &value);
    if (status != QMAT_OK) return status;
    if (strcmp(name, "primChildren") == 0) {
      if (value->is_array && qmat_usd_is_text(value->type)) *names = value;
      continue;
    }
    spec->fields[spec->field_count++] = (qmat_usd_field){.name = name, .value = value};
  }
  return QMAT_OK;
}

/* The kinds of specs in the file. */
enum {
  SPEC_ATTRIBUTE = 1,
  SPEC_PRIM = 6,
  SPEC_PSEUDO_ROOT = 7,
  SPEC_RELATIONSHIP = 8,
  SPEC_VARIANT = 10,
  SPEC_SET = 11
};

/* The child that a path stands for, made; also the set that a variant belongs to. NULL with the error recorded. */
static qmat_usd_spec *make_variant_spec(crate *c, qmat_usd_spec *parent, const char *element) {
  const char *equals = strchr(element, '='), *end = element + strlen(element) - 1;
  if (!equals || *end != '}') {
    fail(c, "a path of a variant is not of the form {set=variant}");
    return NULL;
  }
  const char *set_name = qmat_usd_copy(c->context, c->layer, element + 1, (size_t)(equals - element) - 1);
  const char *name = set_name ? qmat_usd_copy(c->context, c->layer, equals + 1, (size_t)(end - equals) - 1) : NULL;
  if (!name) return NULL;
  qmat_usd_spec *set = qmat_usd_child(c->layer, parent, QMAT_USD_VARIANT_SET, set_name);
  if (!set) set = qmat_usd_add_child(c->context, c->layer, parent, QMAT_USD_VARIANT_SET, set_name);
  if (!set || !*name) return set;
  return qmat_usd_add_child(c->context, c->layer, set, QMAT_USD_VARIANT, name);
}

/* Makes the spec of a path; `*spec` stays NULL for kinds that the tree does not hold: targets and connections. */
static qmat_status make_spec(crate *c, const crate_path *path, uint32_t type, qmat_usd_spec **spec) {
  *spec = NULL;
  if (path->parent == UINT32_MAX) {
    if (type != SPEC_PSEUDO_ROOT) return fail(c, "the root of the file is of another kind");
    *spec = c->layer->root;
    return QMAT_OK;
  }
  if (path->element[0] == '[' || path->element[0] == '.') return QMAT_OK;
  qmat_usd_spec *parent = c->paths[path->parent].spec;
  if (!parent) {
    for (const crate_path *p = path; p->parent != UINT32_MAX; p = &c->paths[p->parent]) {
      if (p->element[0] == '[') return QMAT_OK;
    }
    return fail(c, "a spec has no parent");
  }
  qmat_usd_kind kind = QMAT_USD_PRIM;
  bool matches = false;
  if (path->is_property) {
    kind = type == SPEC_RELATIONSHIP ? QMAT_USD_RELATIONSHIP : QMAT_USD_ATTRIBUTE;
    matches = type == SPEC_RELATIONSHIP || type == SPEC_ATTRIBUTE;
  } else if (path->element[0] == '{') {
    if (type != SPEC_VARIANT && type != SPEC_SET) return fail(c, "a spec is of another kind than its path says");
    *spec = make_variant_spec(c, parent, path->element);
    return *spec ? QMAT_OK : c->context->error.status;
  } else {
    matches = type == SPEC_PRIM;
  }
  if (!matches) return fail(c, "a spec is of another kind than its path says");
  if (qmat_usd_child(c->layer, parent, kind, path->element)) return fail(c, "two specs have one path");
  *spec = qmat_usd_add_child(c->context, c->layer, parent, kind, path->element);
  return *spec ? QMAT_OK : c->context->error.status;
}

static qmat_status read_specs(crate *c) {
  section from;
  qmat_status status = find_section(c, "SPECS", &from);
  if (status != QMAT_OK) return status;
  qmat_byte_reader reader = read_section(&from);
  uint64_t count = qmat_take_u64(&reader);
  if (reader.failed) return fail_short(c);
  uint32_t *paths, *sets, *types;
  status = take_packed_indices(c, &reader, count, &paths);
  if (status == QMAT_OK) status = take_packed_indices(c, &reader, count, &sets);
  if (status == QMAT_OK) status = take_packed_indices(c, &reader, count, &types);
  if (status != QMAT_OK) return status;
  uint32_t *row_of_path = qmat_arena_alloc(&c->scratch, c->path_count, sizeof *row_of_path);
  const qmat_usd_value **orders = qmat_arena_calloc(&c->scratch, c->path_count, sizeof *orders);
  if (!row_of_path || !orders) return fail_memory(c);
  memset(row_of_path, 0xFF, c->path_count * sizeof *row_of_path);
  for (uint64_t i = 0; i < count; i++) {
    if (paths[i] >= c->path_count) return fail(c, "a spec names a path that is not there");
    if (row_of_path[paths[i]] != UINT32_MAX) return fail(c, "two specs have one path");
    row_of_path[paths[i]] = (uint32_t)i;
  }
  for (size_t k = 0; k < c->path_order_count && status == QMAT_OK; k++) {
    const uint32_t path = c->path_order[k], row = row_of_path[path];
    if (row == UINT32_MAX) continue;
    qmat_usd_spec *spec;
    status = make_spec(c, &c->paths[path], types[row], &spec);
    c->paths[path].spec = spec;
    if (status == QMAT_OK && spec) status = read_spec_fields(c, sets[row], spec, &orders[path]);
  }
  for (size_t k = 0; k < c->path_order_count && status == QMAT_OK; k++) {
    const uint32_t path = c->path_order[k];
    if (orders[path]) order_children(c, c->paths[path].spec, orders[path]);
  }
  return status;
}

static qmat_status read_tables(crate *c) {
  if (c->size < TOC_OFFSET_AT + 8 || memcmp(c->bytes, "PXR-USDC", 8) != 0) {
    return fail(c, "a binary layer of USD begins with PXR-USDC");
  }
  const int major = c->bytes[8], minor = c->bytes[9];
  if (major != 0 || minor < OLDEST_VERSION || minor > NEWEST_VERSION) {
    qmat_fail(c->context, QMAT_ERROR_FORMAT, "the crate is of version %d.%d; 0.%d to 0.%d are read", major, minor,
              OLDEST_VERSION, NEWEST_VERSION);
    qmat_fail_at(c->context, c->layer->path, 0, 0);
    return qmat_fail_hint(c->context, "usdcat writes it as .usda");
  }
  c->version = minor;
  qmat_status status = read_tokens(c);
  if (status == QMAT_OK) status = read_strings(c);
  if (status == QMAT_OK) status = read_fields(c);
  if (status == QMAT_OK) status = read_field_sets(c);
  if (status == QMAT_OK) status = read_paths(c);
  return status == QMAT_OK ? read_specs(c) : status;
}

qmat_status qmat_usdc_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_usd_layer *layer) {
  crate c = {.context = context, .layer = layer, .bytes = bytes->data, .size = bytes->size};
  qmat_status status = qmat_usd_layer_init(context, layer, path, bytes->size);
  if (status == QMAT_OK) status = read_tables(&c);
  qmat_free(c.known);
  qmat_arena_uninit(&c.scratch);
  return status;
}
