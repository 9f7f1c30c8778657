/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usdc_value.h"

#include <math.h>
#include <string.h>

#include "io/usd/usdc_pack.h"
#include "io/usd/usdc_types.h"

static qmat_status fail(const qmat_usdc *c, const char *what) {
  return qmat_usd_layer_fail(c->layer, what);
}

static qmat_status fail_unknown(const qmat_usdc *c) {
  return fail(c, "a value has an unknown type");
}

#define MISSING_TEXT "a value refers to a missing token or string"

static unsigned type_of(uint64_t rep) {
  return rep >> 48 & 0xFF;
}

static bool is_plain(unsigned type) {
  return type < QMAT_USDC_PLAIN_TYPES && qmat_usdc_plain_types[type].components > 0;
}

static qmat_status seek(const qmat_usdc *c, uint64_t rep, qmat_byte_reader *reader) {
  const uint64_t offset = rep & QMAT_USDC_REP_PAYLOAD;
  if (offset >= c->size) return qmat_usdc_fail_short(c);
  *reader = (qmat_byte_reader){.bytes = c->bytes, .size = c->size, .at = (size_t)offset};
  return QMAT_OK;
}

/* ---- texts ---- */

static qmat_status take_text(const qmat_usdc *c, qmat_byte_reader *reader, qmat_usd_type type, const char **text) {
  const uint32_t index = qmat_take_u32(reader);
  if (reader->failed) return qmat_usdc_fail_short(c);
  /* An asset is a string in arrays, but a token where it is single. */
  *text = type == QMAT_USD_PATH    ? qmat_usdc_path_text(c, index)
          : type == QMAT_USD_TOKEN ? qmat_usdc_token(c, index)
                                   : qmat_usdc_string(c, index);
  if (*text) return QMAT_OK;
  return type == QMAT_USD_PATH ? qmat_usd_layer_error(c->layer) : fail(c, MISSING_TEXT);
}

static qmat_status take_texts(const qmat_usdc *c, qmat_byte_reader *reader, qmat_usd_type type, uint64_t count,
                              qmat_usd_value *value) {
  if (reader->failed || qmat_bytes_left(reader) / 4 < count) return qmat_usdc_fail_short(c);
  const char **texts = qmat_usd_alloc(c->layer, count, sizeof *texts);
  if (!texts) return qmat_usd_layer_error(c->layer);
  for (uint64_t i = 0; i < count; i++) {
    qmat_status status = take_text(c, reader, type, &texts[i]);
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

static qmat_status take_elements(const qmat_usdc *c, qmat_byte_reader *reader, unsigned number, uint64_t count,
                                 qmat_usd_value *value) {
  const qmat_usd_type type = qmat_usdc_plain_types[number].type;
  const unsigned components = qmat_usdc_plain_types[number].components;
  if (reader->failed || qmat_bytes_left(reader) / (qmat_usdc_component_bytes[type] * components) < count)
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
  if (qmat_usdc_plain_types[number].is_quaternion) {
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
    status = qmat_usdc_take_integers(c->layer, reader, count, qmat_usdc_component_bytes[type], integers);
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
    table = qmat_take_bytes(reader, (size_t)known * qmat_usdc_component_bytes[type]);
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
    qmat_byte_reader entry = {.bytes = table + (size_t)index * qmat_usdc_component_bytes[type],
                              .size = qmat_usdc_component_bytes[type]};
    numbers[i] = take_number(&entry, type);
  }
  qmat_free(integers);
  value->numbers = numbers;
  return status;
}

static qmat_status read_array(const qmat_usdc *c, uint64_t rep, qmat_usd_value *value) {
  const unsigned number = type_of(rep), components = qmat_usdc_plain_types[number].components;
  const qmat_usd_type type = qmat_usdc_plain_types[number].type;
  qmat_byte_reader reader;
  *value = (qmat_usd_value){.type = type, .is_array = true, .components = (uint8_t)components};
  if ((rep & QMAT_USDC_REP_PAYLOAD) == 0) return QMAT_OK;
  qmat_status status = seek(c, rep, &reader);
  if (status != QMAT_OK) return status;
  const uint64_t count = c->version < 7 ? qmat_take_u32(&reader) : qmat_take_u64(&reader);
  if (qmat_usd_is_text(type)) return take_texts(c, &reader, type, count, value);
  const bool can_be_packed =
      components == 1 && type != QMAT_USD_BOOL && type != QMAT_USD_UCHAR && type != QMAT_USD_TIMECODE;
  return can_be_packed && rep & QMAT_USDC_REP_PACKED && count >= QMAT_USDC_FEWEST_PACKED
             ? take_packed_array(c, &reader, type, count, value)
             : take_elements(c, &reader, number, count, value);
}

/* ---- single values ---- */

/* The type of a single component in the low 32 bits of a representation. */
static qmat_usd_type inlined_type(qmat_usd_type type) {
  if (type == QMAT_USD_INT64) return QMAT_USD_INT;
  if (type == QMAT_USD_UINT64) return QMAT_USD_UINT;
  return type == QMAT_USD_DOUBLE || type == QMAT_USD_TIMECODE ? QMAT_USD_FLOAT : type;
}

static qmat_status read_inlined(const qmat_usdc *c, uint64_t rep, qmat_usd_value *value) {
  const unsigned number = type_of(rep), components = qmat_usdc_plain_types[number].components,
                 rows = qmat_usdc_plain_types[number].rows;
  const qmat_usd_type type = qmat_usdc_plain_types[number].type;
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

static qmat_status read_plain(const qmat_usdc *c, uint64_t rep, qmat_usd_value *value) {
  const unsigned number = type_of(rep);
  const bool fits = qmat_usdc_component_bytes[qmat_usdc_plain_types[number].type] <= 4 &&
                    qmat_usdc_plain_types[number].components == 1;
  if (rep & QMAT_USDC_REP_ARRAY) return read_array(c, rep, value);
  if (rep & QMAT_USDC_REP_INLINED || fits) return read_inlined(c, rep, value);
  qmat_byte_reader reader;
  qmat_status status = seek(c, rep, &reader);
  if (status == QMAT_OK) status = take_elements(c, &reader, number, 1, value);
  value->is_array = false;
  return status;
}

/* ---- values that contain others ---- */

/* Takes the distance to a representation, follows it, and takes the representation. */
static bool take_rep(qmat_byte_reader *reader, uint64_t *rep) {
  const size_t start = reader->at;
  const int64_t distance = (int64_t)qmat_take_u64(reader);
  if (reader->failed || distance < -(int64_t)start || distance > (int64_t)(reader->size - start)) {
    reader->failed = true;
    return false;
  }
  reader->at = (size_t)((int64_t)start + distance);
  *rep = qmat_take_u64(reader);
  return !reader->failed;
}

static qmat_status take_dictionary(qmat_usdc_values *v, qmat_byte_reader *reader, bool of_strings,
                                   qmat_usd_value *value) {
  qmat_usd_layer *layer = v->crate->layer;
  const uint64_t count = qmat_take_u64(reader);
  if (reader->failed || qmat_bytes_left(reader) / 8 < count) return qmat_usdc_fail_short(v->crate);
  qmat_usd_field *entries = qmat_usd_alloc(layer, count, sizeof *entries);
  if (!entries) return qmat_usd_layer_error(layer);
  for (uint64_t i = 0; i < count; i++) {
    uint64_t rep;
    qmat_status status = take_text(v->crate, reader, QMAT_USD_STRING, &entries[i].name);
    if (status == QMAT_OK && of_strings) {
      const char *text;
      qmat_usd_value *entry = qmat_usd_alloc(layer, 1, sizeof *entry);
      if (!entry) return qmat_usd_layer_error(layer);
      status = take_text(v->crate, reader, QMAT_USD_STRING, &text);
      if (status == QMAT_OK) status = qmat_usd_make_text(layer, QMAT_USD_STRING, text, entry);
      entries[i].value = entry;
    } else if (status == QMAT_OK) {
      status = take_rep(reader, &rep) ? qmat_usdc_value(v, rep, &entries[i].value) : qmat_usdc_fail_short(v->crate);
    }
    if (status != QMAT_OK) return status;
  }
  *value = (qmat_usd_value){.type = QMAT_USD_DICTIONARY, .components = 1, .count = count, .entries = entries};
  return QMAT_OK;
}

static qmat_status take_reference(qmat_usdc_values *v, qmat_byte_reader *reader, bool is_payload,
                                  qmat_usd_reference *reference) {
  qmat_usd_value custom_data;
  reference->scale = 1;
  qmat_status status = take_text(v->crate, reader, QMAT_USD_STRING, &reference->asset);
  if (status == QMAT_OK) status = take_text(v->crate, reader, QMAT_USD_PATH, &reference->path);
  if (status == QMAT_OK && (!is_payload || v->crate->version >= 8)) {
    reference->offset = qmat_take_f64(reader);
    reference->scale = qmat_take_f64(reader);
  }
  return status == QMAT_OK && !is_payload ? take_dictionary(v, reader, false, &custom_data) : status;
}

static qmat_status take_references(qmat_usdc_values *v, qmat_byte_reader *reader, bool is_payload, uint64_t count,
                                   qmat_usd_value *value) {
  if (reader->failed || qmat_bytes_left(reader) / 8 < count) return qmat_usdc_fail_short(v->crate);
  qmat_usd_reference *references = qmat_usd_alloc(v->crate->layer, count, sizeof *references);
  if (!references) return qmat_usd_layer_error(v->crate->layer);
  for (uint64_t i = 0; i < count; i++) {
    qmat_status status = take_reference(v, reader, is_payload, &references[i]);
    if (status != QMAT_OK) return status;
  }
  *value = (qmat_usd_value){
      .type = QMAT_USD_REFERENCE, .is_array = true, .components = 1, .count = count, .references = references};
  return reader->failed ? qmat_usdc_fail_short(v->crate) : QMAT_OK;
}

static qmat_status take_list(qmat_usdc_values *v, qmat_byte_reader *reader, qmat_usdc_type type, uint64_t count,
                             qmat_usd_value *list) {
  const qmat_usdc *c = v->crate;
  switch (type) {
    case QMAT_USDC_TOKEN_LIST_OP:
      return take_texts(c, reader, QMAT_USD_TOKEN, count, list);
    case QMAT_USDC_STRING_LIST_OP:
      return take_texts(c, reader, QMAT_USD_STRING, count, list);
    case QMAT_USDC_PATH_LIST_OP:
      return take_texts(c, reader, QMAT_USD_PATH, count, list);
    case QMAT_USDC_REFERENCE_LIST_OP:
      return take_references(v, reader, false, count, list);
    case QMAT_USDC_PAYLOAD_LIST_OP:
      return take_references(v, reader, true, count, list);
    case QMAT_USDC_INT_LIST_OP:
      return take_elements(c, reader, QMAT_USDC_INT, count, list);
    case QMAT_USDC_INT64_LIST_OP:
      return take_elements(c, reader, QMAT_USDC_INT64, count, list);
    case QMAT_USDC_UINT_LIST_OP:
      return take_elements(c, reader, QMAT_USDC_UINT, count, list);
    default:
      return take_elements(c, reader, QMAT_USDC_UINT64, count, list);
  }
}

static qmat_status take_list_op(qmat_usdc_values *v, qmat_byte_reader *reader, qmat_usdc_type type,
                                qmat_usd_value *value) {
  qmat_usd_list_op *op = qmat_usd_alloc(v->crate->layer, 1, sizeof *op);
  if (!op) return qmat_usd_layer_error(v->crate->layer);
  *value = (qmat_usd_value){.type = QMAT_USD_LIST_OP, .components = 1, .count = 1, .list_op = op};
  const uint8_t header = qmat_take_u8(reader);
  op->is_explicit = header & 1;
  for (size_t i = 0; i < QMAT_USD_EDIT_COUNT; i++) {
    const uint64_t count = header >> qmat_usdc_lists[i].bit & 1 ? qmat_take_u64(reader) : 0;
    qmat_status status = take_list(v, reader, type, count, &op->lists[qmat_usdc_lists[i].edit]);
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

static qmat_status take_samples(qmat_usdc_values *v, qmat_byte_reader *reader, qmat_usd_value *value) {
  qmat_usd_layer *layer = v->crate->layer;
  const qmat_usd_value *times;
  uint64_t rep, count;
  if (!take_rep(reader, &rep)) return qmat_usdc_fail_short(v->crate);
  qmat_status status = qmat_usdc_value(v, rep, &times);
  if (status != QMAT_OK) return status;
  if (!take_rep(reader, &count) || qmat_bytes_left(reader) / 8 < count) return qmat_usdc_fail_short(v->crate);
  if (times->type != QMAT_USD_DOUBLE || !times->is_array || times->components != 1 || times->count != count)
    return fail(v->crate, "the numbers of times and values of samples differ");
  qmat_usd_samples *samples = qmat_usd_alloc(layer, 1, sizeof *samples);
  const qmat_usd_value **values = samples ? qmat_usd_alloc(layer, count, sizeof *values) : NULL;
  if (!values) return qmat_usd_layer_error(layer);
  for (uint64_t i = 0; i < count && status == QMAT_OK; i++)
    status = qmat_usdc_value(v, qmat_take_u64(reader), &values[i]);
  *samples = (qmat_usd_samples){.count = count, .times = times->numbers, .values = values};
  *value = (qmat_usd_value){.type = QMAT_USD_TIME_SAMPLES, .components = 1, .count = 1, .samples = samples};
  return status;
}

/* A payload outside a list is the explicit list of it. */
static qmat_status take_payload(qmat_usdc_values *v, qmat_byte_reader *reader, qmat_usd_value *value) {
  qmat_usd_list_op *op = qmat_usd_alloc(v->crate->layer, 1, sizeof *op);
  if (!op) return qmat_usd_layer_error(v->crate->layer);
  for (int i = 0; i < QMAT_USD_EDIT_COUNT; i++)
    op->lists[i] = (qmat_usd_value){.type = QMAT_USD_REFERENCE, .is_array = true, .components = 1};
  op->is_explicit = true;
  *value = (qmat_usd_value){.type = QMAT_USD_LIST_OP, .components = 1, .count = 1, .list_op = op};
  qmat_usd_value *list = &op->lists[QMAT_USD_EXPLICIT];
  qmat_status status = take_references(v, reader, true, 1, list);
  if (status == QMAT_OK && !list->references[0].asset[0] && !list->references[0].path[0]) list->count = 0;
  return status;
}

/* A token from a short list, by its number. */
static qmat_status read_choice(const qmat_usdc_values *v, uint64_t rep, const char *const *choices, unsigned count,
                               qmat_usd_value *value) {
  const uint32_t choice = (uint32_t)rep;
  if (choice >= count) return fail(v->crate, "a specifier, permission or variability is unknown");
  return qmat_usd_make_text(v->crate->layer, QMAT_USD_TOKEN, choices[choice], value);
}

/* A value without contents in the file. */
static qmat_status read_immediate(const qmat_usdc_values *v, uint64_t rep, qmat_usd_value *value) {
  static const char *const specifiers[] = {"def", "over", "class"}, *const permissions[] = {"public", "private"},
                           *const variabilities[] = {"varying", "uniform", "uniform"};
  switch ((qmat_usdc_type)type_of(rep)) {
    case QMAT_USDC_SPECIFIER:
      return read_choice(v, rep, specifiers, 3, value);
    case QMAT_USDC_PERMISSION:
      return read_choice(v, rep, permissions, 2, value);
    case QMAT_USDC_VARIABILITY:
      return read_choice(v, rep, variabilities, 3, value);
    case QMAT_USDC_VALUE_BLOCK:
      *value = (qmat_usd_value){.type = QMAT_USD_BLOCK};
      return QMAT_OK;
    case QMAT_USDC_DICTIONARY:
    case QMAT_USDC_VARIANT_SELECTION_MAP:
      *value = (qmat_usd_value){.type = QMAT_USD_DICTIONARY, .components = 1};
      return QMAT_OK;
    default:
      return fail_unknown(v->crate);
  }
}

static bool is_always_inlined(qmat_usdc_type type) {
  return type == QMAT_USDC_SPECIFIER || type == QMAT_USDC_PERMISSION || type == QMAT_USDC_VARIABILITY ||
         type == QMAT_USDC_VALUE_BLOCK;
}

static qmat_status read_value(qmat_usdc_values *v, uint64_t rep, qmat_usd_value *value) {
  const qmat_usdc *c = v->crate;
  const qmat_usdc_type type = (qmat_usdc_type)type_of(rep);
  qmat_byte_reader reader;
  if (is_plain(type)) return read_plain(c, rep, value);
  if (rep & QMAT_USDC_REP_INLINED || is_always_inlined(type)) return read_immediate(v, rep, value);
  qmat_status status = seek(c, rep, &reader);
  if (status != QMAT_OK) return status;
  switch (type) {
    case QMAT_USDC_DICTIONARY:
    case QMAT_USDC_VARIANT_SELECTION_MAP:
      return take_dictionary(v, &reader, type == QMAT_USDC_VARIANT_SELECTION_MAP, value);
    case QMAT_USDC_TOKEN_LIST_OP:
    case QMAT_USDC_STRING_LIST_OP:
    case QMAT_USDC_PATH_LIST_OP:
    case QMAT_USDC_REFERENCE_LIST_OP:
    case QMAT_USDC_INT_LIST_OP:
    case QMAT_USDC_INT64_LIST_OP:
    case QMAT_USDC_UINT_LIST_OP:
    case QMAT_USDC_UINT64_LIST_OP:
    case QMAT_USDC_PAYLOAD_LIST_OP:
      return take_list_op(v, &reader, type, value);
    case QMAT_USDC_PATH_VECTOR:
      return take_texts(c, &reader, QMAT_USD_PATH, qmat_take_u64(&reader), value);
    case QMAT_USDC_TOKEN_VECTOR:
      return take_texts(c, &reader, QMAT_USD_TOKEN, qmat_take_u64(&reader), value);
    case QMAT_USDC_STRING_VECTOR:
      return take_texts(c, &reader, QMAT_USD_STRING, qmat_take_u64(&reader), value);
    case QMAT_USDC_DOUBLE_VECTOR:
      return take_elements(c, &reader, QMAT_USDC_DOUBLE, qmat_take_u64(&reader), value);
    case QMAT_USDC_LAYER_OFFSET_VECTOR:
      return take_elements(c, &reader, QMAT_USDC_DOUBLE2, qmat_take_u64(&reader), value);
    case QMAT_USDC_TIME_SAMPLES:
      return take_samples(v, &reader, value);
    case QMAT_USDC_PAYLOAD:
      return take_payload(v, &reader, value);
    case QMAT_USDC_VALUE:
    case QMAT_USDC_UNREGISTERED_VALUE: {
      const qmat_usd_value *inner;
      uint64_t inner_rep;
      if (!take_rep(&reader, &inner_rep)) return qmat_usdc_fail_short(v->crate);
      status = qmat_usdc_value(v, inner_rep, &inner);
      if (status == QMAT_OK) *value = *inner;
      return status;
    }
    case QMAT_USDC_PATH_EXPRESSION: {
      const char *text;
      status = take_text(c, &reader, QMAT_USD_STRING, &text);
      return status == QMAT_OK ? qmat_usd_make_text(c->layer, QMAT_USD_STRING, text, value) : status;
    }
    case QMAT_USDC_UNREGISTERED_VALUE_LIST_OP:
      return qmat_usd_make_text(c->layer, QMAT_USD_UNREAD, "list of values of unknown types", value);
    default:
      return fail_unknown(v->crate);
  }
}

qmat_status qmat_usdc_value(qmat_usdc_values *v, uint64_t rep, const qmat_usd_value **value) {
  qmat_usd_layer *layer = v->crate->layer;
  if (rep == 0 || rep == QMAT_NO_KEY) return fail_unknown(v->crate);
  const qmat_key_slot *known = qmat_key_table_find(&v->known, rep);
  if (known->key == rep) {
    *value = known->pointer;
    return *value ? QMAT_OK : fail(v->crate, "a value contains itself");
  }
  if (v->depth >= QMAT_USD_DEEPEST) return fail(v->crate, "values are nested too deep");
  qmat_key_slot *added = qmat_key_table_add(&v->known, rep);
  if (!added) return qmat_usd_layer_fail_memory(layer);
  added->pointer = NULL; /* is being read */
  qmat_usd_value *made = qmat_usd_alloc(layer, 1, sizeof *made);
  if (!made) return qmat_usd_layer_error(layer);
  v->depth++;
  qmat_status status = read_value(v, rep, made);
  v->depth--;
  if (status != QMAT_OK) return status;
  qmat_key_table_find(&v->known, rep)->pointer = made;
  *value = made;
  return QMAT_OK;
}
