/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usdc_plain.h"

#include <math.h>
#include <string.h>

#include "io/usd/usdc_pack.h"

enum { FEWEST_PACKED = 16 }; /* elements of an array: shorter ones are never packed */

/* Plain types by their number in the file. */
static const struct {
  qmat_usd_type type;
  uint8_t components, rows; /* rows: of a matrix; else 0 */
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
    [QMAT_USDC_TIME_CODE] = {QMAT_USD_TIMECODE, 1, 0, false},
};

/* The size of a component in the file. */
static const uint8_t component_bytes[QMAT_USD_TYPE_COUNT] = {
    [QMAT_USD_BOOL] = 1,   [QMAT_USD_UCHAR] = 1, [QMAT_USD_INT] = 4,   [QMAT_USD_UINT] = 4,   [QMAT_USD_INT64] = 8,
    [QMAT_USD_UINT64] = 8, [QMAT_USD_HALF] = 2,  [QMAT_USD_FLOAT] = 4, [QMAT_USD_DOUBLE] = 8, [QMAT_USD_TIMECODE] = 8,
    [QMAT_USD_STRING] = 4, [QMAT_USD_TOKEN] = 4, [QMAT_USD_ASSET] = 4, [QMAT_USD_PATH] = 4,
};

#define MISSING_TEXT "a value refers to a missing token or string"

static qmat_status fail(const qmat_usdc *c, const char *what) {
  return qmat_usd_layer_fail(c->layer, what);
}

unsigned qmat_usdc_type_of(uint64_t rep) {
  return rep >> 48 & 0xFF;
}

bool qmat_usdc_is_plain(unsigned type) {
  return type < sizeof plain_types / sizeof plain_types[0] && plain_types[type].components > 0;
}

qmat_status qmat_usdc_seek(const qmat_usdc *c, uint64_t rep, qmat_byte_reader *reader) {
  const uint64_t offset = rep & QMAT_USDC_PAYLOAD;
  if (offset >= c->size) return qmat_usdc_fail_short(c);
  *reader = (qmat_byte_reader){.bytes = c->bytes, .size = c->size, .at = (size_t)offset};
  return QMAT_OK;
}

/* ---- texts ---- */

qmat_status qmat_usdc_take_text(const qmat_usdc *c, qmat_byte_reader *reader, qmat_usd_type type, const char **text) {
  const uint32_t index = qmat_take_u32(reader);
  if (reader->failed) return qmat_usdc_fail_short(c);
  /* An asset is a string in arrays, but a token where it is single. */
  *text = type == QMAT_USD_PATH    ? qmat_usdc_path_text(c, index)
          : type == QMAT_USD_TOKEN ? qmat_usdc_token(c, index)
                                   : qmat_usdc_string(c, index);
  if (*text) return QMAT_OK;
  return type == QMAT_USD_PATH ? qmat_usd_layer_error(c->layer) : fail(c, MISSING_TEXT);
}

qmat_status qmat_usdc_take_texts(const qmat_usdc *c, qmat_byte_reader *reader, qmat_usd_type type, uint64_t count,
                                 qmat_usd_value *value) {
  if (reader->failed || qmat_bytes_left(reader) / 4 < count) return qmat_usdc_fail_short(c);
  const char **texts = qmat_usd_alloc(c->layer, count, sizeof *texts);
  if (!texts) return qmat_usd_layer_error(c->layer);
  for (uint64_t i = 0; i < count; i++) {
    qmat_status status = qmat_usdc_take_text(c, reader, type, &texts[i]);
    if (status != QMAT_OK) return status;
  }
  *value = (qmat_usd_value){.type = type, .is_array = true, .components = 1, .count = count, .texts = texts};
  return QMAT_OK;
}

/* ---- numbers ---- */

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

qmat_status qmat_usdc_take_elements(const qmat_usdc *c, qmat_byte_reader *reader, unsigned number, uint64_t count,
                                    qmat_usd_value *value) {
  const qmat_usd_type type = plain_types[number].type;
  const unsigned components = plain_types[number].components;
  if (reader->failed || qmat_bytes_left(reader) / (component_bytes[type] * components) < count)
    return qmat_usdc_fail_short(c);
  void *memory = qmat_usd_alloc(c->layer, count, 8 * components);
  if (!memory) return qmat_usd_layer_error(c->layer);
  *value = (qmat_usd_value){.type = type, .is_array = true, .components = (uint8_t)components, .count = count};
  size_t total = count * components;
  if (qmat_usd_is_integer(type)) {
    int64_t *integers = memory;
    for (size_t i = 0; i < total; i++) integers[i] = take_integer(reader, type);
    value->integers = integers;
    return QMAT_OK;
  }
  double *numbers = memory;
  for (size_t i = 0; i < total; i++) numbers[i] = take_number(reader, type);
  if (plain_types[number].is_quaternion) {
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

static qmat_status take_packed_array(const qmat_usdc *c, qmat_byte_reader *reader, qmat_usd_type type, uint64_t count,
                                     qmat_usd_value *value) {
  if (reader->failed || count / 4 > qmat_usdc_largest_unpacked(qmat_bytes_left(reader))) return qmat_usdc_fail_short(c);
  void *memory = qmat_usd_alloc(c->layer, count, 8);
  if (!memory) return qmat_usd_layer_error(c->layer);
  *value = (qmat_usd_value){.type = type, .is_array = true, .components = 1, .count = count};
  qmat_status status;
  if (qmat_usd_is_integer(type)) {
    int64_t *integers = memory;
    status = qmat_usdc_take_integers(c->layer, reader, count, component_bytes[type], integers);
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
    if (!table) return qmat_usdc_fail_short(c);
  } else if (code != 'i') {
    return fail(c, "a packed array of numbers has an unknown encoding");
  }
  int64_t *integers = qmat_alloc(count, sizeof *integers);
  if (!integers) return qmat_usd_layer_fail_memory(c->layer);
  status = qmat_usdc_take_integers(c->layer, reader, count, 4, integers);
  double *numbers = memory;
  for (uint64_t i = 0; i < count && status == QMAT_OK; i++) {
    if (!table) {
      numbers[i] = (double)integers[i];
      continue;
    }
    uint32_t index = (uint32_t)integers[i];
    if (index >= known) {
      status = fail(c, "a packed array of numbers refers to a missing entry");
      break;
    }
    qmat_byte_reader entry = {.bytes = table + (size_t)index * component_bytes[type], .size = component_bytes[type]};
    numbers[i] = take_number(&entry, type);
  }
  qmat_free(integers);
  value->numbers = numbers;
  return status;
}

static qmat_status read_array(const qmat_usdc *c, uint64_t rep, qmat_usd_value *value) {
  const unsigned number = qmat_usdc_type_of(rep), components = plain_types[number].components;
  const qmat_usd_type type = plain_types[number].type;
  qmat_byte_reader reader;
  *value = (qmat_usd_value){.type = type, .is_array = true, .components = (uint8_t)components};
  if ((rep & QMAT_USDC_PAYLOAD) == 0) return QMAT_OK;
  qmat_status status = qmat_usdc_seek(c, rep, &reader);
  if (status != QMAT_OK) return status;
  const uint64_t count = c->version < 7 ? qmat_take_u32(&reader) : qmat_take_u64(&reader);
  if (qmat_usd_is_text(type)) return qmat_usdc_take_texts(c, &reader, type, count, value);
  const bool can_be_packed =
      components == 1 && type != QMAT_USD_BOOL && type != QMAT_USD_UCHAR && type != QMAT_USD_TIMECODE;
  return can_be_packed && rep & QMAT_USDC_PACKED && count >= FEWEST_PACKED
             ? take_packed_array(c, &reader, type, count, value)
             : qmat_usdc_take_elements(c, &reader, number, count, value);
}

/* ---- single values ---- */

/* The type of a single component in the low 32 bits of a representation. */
static qmat_usd_type inlined_type(qmat_usd_type type) {
  if (type == QMAT_USD_INT64) return QMAT_USD_INT;
  if (type == QMAT_USD_UINT64) return QMAT_USD_UINT;
  return type == QMAT_USD_DOUBLE || type == QMAT_USD_TIMECODE ? QMAT_USD_FLOAT : type;
}

static qmat_status read_inlined(const qmat_usdc *c, uint64_t rep, qmat_usd_value *value) {
  const unsigned number = qmat_usdc_type_of(rep), components = plain_types[number].components,
                 rows = plain_types[number].rows;
  const qmat_usd_type type = plain_types[number].type;
  const uint8_t bytes[4] = {rep & 0xFF, rep >> 8 & 0xFF, rep >> 16 & 0xFF, rep >> 24 & 0xFF};
  qmat_byte_reader reader = {.bytes = bytes, .size = sizeof bytes};
  if (qmat_usd_is_text(type)) {
    const char *text = type == QMAT_USD_STRING ? qmat_usdc_string(c, (uint32_t)rep) : qmat_usdc_token(c, (uint32_t)rep);
    return text ? qmat_usd_make_text(c->layer, type, text, value) : fail(c, MISSING_TEXT);
  }
  void *memory = qmat_usd_alloc(c->layer, components, 8);
  if (!memory) return qmat_usd_layer_error(c->layer);
  int64_t *integers = memory;
  double *numbers = memory;
  *value = (qmat_usd_value){.type = type, .components = (uint8_t)components, .count = 1};
  for (unsigned i = 0; i < components; i++) {
    /* Vectors are signed bytes; matrices are the signed bytes of their diagonal. */
    const int8_t byte = (int8_t)(rows == 0 ? bytes[i] : i / rows == i % rows ? bytes[i / rows] : 0);
    if (qmat_usd_is_integer(type)) {
      integers[i] = components > 1 ? byte : take_integer(&reader, inlined_type(type));
    } else {
      numbers[i] = components > 1 ? (double)byte : take_number(&reader, inlined_type(type));
    }
  }
  if (qmat_usd_is_integer(type)) {
    value->integers = integers;
  } else {
    value->numbers = numbers;
  }
  return QMAT_OK;
}

qmat_status qmat_usdc_read_plain(const qmat_usdc *c, uint64_t rep, qmat_usd_value *value) {
  const unsigned number = qmat_usdc_type_of(rep);
  const bool fits = component_bytes[plain_types[number].type] <= 4 && plain_types[number].components == 1;
  if (rep & QMAT_USDC_ARRAY) return read_array(c, rep, value);
  if (rep & QMAT_USDC_INLINED || fits) return read_inlined(c, rep, value);
  qmat_byte_reader reader;
  qmat_status status = qmat_usdc_seek(c, rep, &reader);
  if (status == QMAT_OK) status = qmat_usdc_take_elements(c, &reader, number, 1, value);
  value->is_array = false;
  return status;
}
