/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usdc_value.h"

#include <string.h>

#include "core/hash.h"
#include "io/usd/usdc_plain.h"

/* The other types, by their number in the file. */
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
  CRATE_PATH_EXPRESSION = 57
} crate_type;

static qmat_status fail(const qmat_usdc_values *v, const char *what) {
  return qmat_usd_layer_fail(v->crate->layer, what);
}

static qmat_status fail_short(const qmat_usdc_values *v) {
  return qmat_usdc_fail_short(v->crate);
}

static qmat_status fail_unknown(const qmat_usdc_values *v) {
  return fail(v, "a value has an unknown type");
}

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
  if (reader->failed || qmat_bytes_left(reader) / 8 < count) return fail_short(v);
  qmat_usd_field *entries = qmat_usd_alloc(layer, count, sizeof *entries);
  if (!entries) return qmat_usd_layer_error(layer);
  for (uint64_t i = 0; i < count; i++) {
    uint64_t rep;
    qmat_status status = qmat_usdc_take_text(v->crate, reader, QMAT_USD_STRING, &entries[i].name);
    if (status == QMAT_OK && of_strings) {
      const char *text;
      qmat_usd_value *entry = qmat_usd_alloc(layer, 1, sizeof *entry);
      if (!entry) return qmat_usd_layer_error(layer);
      status = qmat_usdc_take_text(v->crate, reader, QMAT_USD_STRING, &text);
      if (status == QMAT_OK) status = qmat_usd_make_text(layer, QMAT_USD_STRING, text, entry);
      entries[i].value = entry;
    } else if (status == QMAT_OK) {
      status = take_rep(reader, &rep) ? qmat_usdc_value(v, rep, &entries[i].value) : fail_short(v);
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
  qmat_status status = qmat_usdc_take_text(v->crate, reader, QMAT_USD_STRING, &reference->asset);
  if (status == QMAT_OK) status = qmat_usdc_take_text(v->crate, reader, QMAT_USD_PATH, &reference->path);
  if (status == QMAT_OK && (!is_payload || v->crate->version >= 8)) {
    reference->offset = qmat_take_f64(reader);
    reference->scale = qmat_take_f64(reader);
  }
  return status == QMAT_OK && !is_payload ? take_dictionary(v, reader, false, &custom_data) : status;
}

static qmat_status take_references(qmat_usdc_values *v, qmat_byte_reader *reader, bool is_payload, uint64_t count,
                                   qmat_usd_value *value) {
  if (reader->failed || qmat_bytes_left(reader) / 8 < count) return fail_short(v);
  qmat_usd_reference *references = qmat_usd_alloc(v->crate->layer, count, sizeof *references);
  if (!references) return qmat_usd_layer_error(v->crate->layer);
  for (uint64_t i = 0; i < count; i++) {
    qmat_status status = take_reference(v, reader, is_payload, &references[i]);
    if (status != QMAT_OK) return status;
  }
  *value = (qmat_usd_value){
      .type = QMAT_USD_REFERENCE, .is_array = true, .components = 1, .count = count, .references = references};
  return reader->failed ? fail_short(v) : QMAT_OK;
}

static qmat_status take_list(qmat_usdc_values *v, qmat_byte_reader *reader, crate_type type, uint64_t count,
                             qmat_usd_value *list) {
  const qmat_usdc *c = v->crate;
  switch (type) {
    case CRATE_TOKEN_LIST_OP:
      return qmat_usdc_take_texts(c, reader, QMAT_USD_TOKEN, count, list);
    case CRATE_STRING_LIST_OP:
      return qmat_usdc_take_texts(c, reader, QMAT_USD_STRING, count, list);
    case CRATE_PATH_LIST_OP:
      return qmat_usdc_take_texts(c, reader, QMAT_USD_PATH, count, list);
    case CRATE_REFERENCE_LIST_OP:
      return take_references(v, reader, false, count, list);
    case CRATE_PAYLOAD_LIST_OP:
      return take_references(v, reader, true, count, list);
    case CRATE_INT_LIST_OP:
      return qmat_usdc_take_elements(c, reader, QMAT_USDC_INT, count, list);
    case CRATE_INT64_LIST_OP:
      return qmat_usdc_take_elements(c, reader, QMAT_USDC_INT64, count, list);
    case CRATE_UINT_LIST_OP:
      return qmat_usdc_take_elements(c, reader, QMAT_USDC_UINT, count, list);
    default:
      return qmat_usdc_take_elements(c, reader, QMAT_USDC_UINT64, count, list);
  }
}

static qmat_status take_list_op(qmat_usdc_values *v, qmat_byte_reader *reader, crate_type type, qmat_usd_value *value) {
  /* The lists in their order in the file, and the bits of the header that announce them. */
  static const struct {
    uint8_t bit;
    qmat_usd_edit edit;
  } lists[] = {{1, QMAT_USD_EXPLICIT}, {2, QMAT_USD_ADDED},   {5, QMAT_USD_PREPENDED},
               {6, QMAT_USD_APPENDED}, {3, QMAT_USD_DELETED}, {4, QMAT_USD_ORDERED}};
  qmat_usd_list_op *op = qmat_usd_alloc(v->crate->layer, 1, sizeof *op);
  if (!op) return qmat_usd_layer_error(v->crate->layer);
  *value = (qmat_usd_value){.type = QMAT_USD_LIST_OP, .components = 1, .count = 1, .list_op = op};
  const uint8_t header = qmat_take_u8(reader);
  op->is_explicit = header & 1;
  for (size_t i = 0; i < sizeof lists / sizeof lists[0]; i++) {
    const uint64_t count = header >> lists[i].bit & 1 ? qmat_take_u64(reader) : 0;
    qmat_status status = take_list(v, reader, type, count, &op->lists[lists[i].edit]);
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

static qmat_status take_samples(qmat_usdc_values *v, qmat_byte_reader *reader, qmat_usd_value *value) {
  qmat_usd_layer *layer = v->crate->layer;
  const qmat_usd_value *times;
  uint64_t rep, count;
  if (!take_rep(reader, &rep)) return fail_short(v);
  qmat_status status = qmat_usdc_value(v, rep, &times);
  if (status != QMAT_OK) return status;
  if (!take_rep(reader, &count) || qmat_bytes_left(reader) / 8 < count) return fail_short(v);
  if (times->type != QMAT_USD_DOUBLE || !times->is_array || times->components != 1 || times->count != count) {
    return fail(v, "the numbers of times and values of samples differ");
  }
  qmat_usd_samples *samples = qmat_usd_alloc(layer, 1, sizeof *samples);
  const qmat_usd_value **values = samples ? qmat_usd_alloc(layer, count, sizeof *values) : NULL;
  if (!values) return qmat_usd_layer_error(layer);
  for (uint64_t i = 0; i < count && status == QMAT_OK; i++) {
    status = qmat_usdc_value(v, qmat_take_u64(reader), &values[i]);
  }
  *samples = (qmat_usd_samples){.count = count, .times = times->numbers, .values = values};
  *value = (qmat_usd_value){.type = QMAT_USD_TIME_SAMPLES, .components = 1, .count = 1, .samples = samples};
  return status;
}

/* A payload outside a list is the explicit list of it. */
static qmat_status take_payload(qmat_usdc_values *v, qmat_byte_reader *reader, qmat_usd_value *value) {
  qmat_usd_list_op *op = qmat_usd_alloc(v->crate->layer, 1, sizeof *op);
  if (!op) return qmat_usd_layer_error(v->crate->layer);
  for (int i = 0; i < QMAT_USD_EDIT_COUNT; i++) {
    op->lists[i] = (qmat_usd_value){.type = QMAT_USD_REFERENCE, .is_array = true, .components = 1};
  }
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
  if (choice >= count) return fail(v, "a specifier, permission or variability is unknown");
  return qmat_usd_make_text(v->crate->layer, QMAT_USD_TOKEN, choices[choice], value);
}

/* A value in the 64 bits of its representation. */
static qmat_status read_inlined(const qmat_usdc_values *v, uint64_t rep, qmat_usd_value *value) {
  static const char *const specifiers[] = {"def", "over", "class"}, *const permissions[] = {"public", "private"},
                           *const variabilities[] = {"varying", "uniform", "uniform"};
  switch ((crate_type)qmat_usdc_type_of(rep)) {
    case CRATE_SPECIFIER:
      return read_choice(v, rep, specifiers, 3, value);
    case CRATE_PERMISSION:
      return read_choice(v, rep, permissions, 2, value);
    case CRATE_VARIABILITY:
      return read_choice(v, rep, variabilities, 3, value);
    case CRATE_VALUE_BLOCK:
      *value = (qmat_usd_value){.type = QMAT_USD_BLOCK};
      return QMAT_OK;
    case CRATE_DICTIONARY:
    case CRATE_VARIANT_SELECTION_MAP:
      *value = (qmat_usd_value){.type = QMAT_USD_DICTIONARY, .components = 1};
      return QMAT_OK;
    default:
      return fail_unknown(v);
  }
}

static bool is_always_inlined(crate_type type) {
  return type == CRATE_SPECIFIER || type == CRATE_PERMISSION || type == CRATE_VARIABILITY || type == CRATE_VALUE_BLOCK;
}

static qmat_status read_value(qmat_usdc_values *v, uint64_t rep, qmat_usd_value *value) {
  const qmat_usdc *c = v->crate;
  const crate_type type = (crate_type)qmat_usdc_type_of(rep);
  qmat_byte_reader reader;
  if (qmat_usdc_is_plain(type)) return qmat_usdc_read_plain(c, rep, value);
  if (rep & QMAT_USDC_INLINED || is_always_inlined(type)) return read_inlined(v, rep, value);
  qmat_status status = qmat_usdc_seek(c, rep, &reader);
  if (status != QMAT_OK) return status;
  switch (type) {
    case CRATE_DICTIONARY:
    case CRATE_VARIANT_SELECTION_MAP:
      return take_dictionary(v, &reader, type == CRATE_VARIANT_SELECTION_MAP, value);
    case CRATE_TOKEN_LIST_OP:
    case CRATE_STRING_LIST_OP:
    case CRATE_PATH_LIST_OP:
    case CRATE_REFERENCE_LIST_OP:
    case CRATE_INT_LIST_OP:
    case CRATE_INT64_LIST_OP:
    case CRATE_UINT_LIST_OP:
    case CRATE_UINT64_LIST_OP:
    case CRATE_PAYLOAD_LIST_OP:
      return take_list_op(v, &reader, type, value);
    case CRATE_PATH_VECTOR:
      return qmat_usdc_take_texts(c, &reader, QMAT_USD_PATH, qmat_take_u64(&reader), value);
    case CRATE_TOKEN_VECTOR:
      return qmat_usdc_take_texts(c, &reader, QMAT_USD_TOKEN, qmat_take_u64(&reader), value);
    case CRATE_STRING_VECTOR:
      return qmat_usdc_take_texts(c, &reader, QMAT_USD_STRING, qmat_take_u64(&reader), value);
    case CRATE_DOUBLE_VECTOR:
      return qmat_usdc_take_elements(c, &reader, QMAT_USDC_DOUBLE, qmat_take_u64(&reader), value);
    case CRATE_LAYER_OFFSET_VECTOR:
      return qmat_usdc_take_elements(c, &reader, QMAT_USDC_DOUBLE2, qmat_take_u64(&reader), value);
    case CRATE_TIME_SAMPLES:
      return take_samples(v, &reader, value);
    case CRATE_PAYLOAD:
      return take_payload(v, &reader, value);
    case CRATE_VALUE:
    case CRATE_UNREGISTERED_VALUE: {
      const qmat_usd_value *inner;
      uint64_t inner_rep;
      if (!take_rep(&reader, &inner_rep)) return fail_short(v);
      status = qmat_usdc_value(v, inner_rep, &inner);
      if (status == QMAT_OK) *value = *inner;
      return status;
    }
    case CRATE_PATH_EXPRESSION: {
      const char *text;
      status = qmat_usdc_take_text(c, &reader, QMAT_USD_STRING, &text);
      return status == QMAT_OK ? qmat_usd_make_text(c->layer, QMAT_USD_STRING, text, value) : status;
    }
    case CRATE_UNREGISTERED_VALUE_LIST_OP:
      return qmat_usd_make_text(c->layer, QMAT_USD_UNREAD, "list of values of unknown types", value);
    default:
      return fail_unknown(v);
  }
}

/* ---- known values ---- */

static qmat_usdc_known *find_known(const qmat_usdc_values *v, uint64_t rep) {
  size_t slot = qmat_hash_mix(rep) & (v->known_slots - 1);
  while (v->known[slot].rep != 0 && v->known[slot].rep != rep) slot = (slot + 1) & (v->known_slots - 1);
  return &v->known[slot];
}

static bool grow_known(qmat_usdc_values *v) {
  const size_t count = v->known_slots ? 2 * v->known_slots : 256, older_count = v->known_slots;
  qmat_usdc_known *older = v->known, *fresh = qmat_calloc(count, sizeof *fresh);
  if (!fresh) return false;
  v->known = fresh;
  v->known_slots = count;
  for (size_t i = 0; i < older_count; i++) {
    if (older[i].rep != 0) *find_known(v, older[i].rep) = older[i];
  }
  qmat_free(older);
  return true;
}

qmat_status qmat_usdc_value(qmat_usdc_values *v, uint64_t rep, const qmat_usd_value **value) {
  qmat_usd_layer *layer = v->crate->layer;
  if (rep == 0) return fail_unknown(v);
  if (2 * v->known_count >= v->known_slots && !grow_known(v)) return qmat_usd_layer_fail_memory(layer);
  qmat_usdc_known *known = find_known(v, rep);
  if (known->rep == rep) {
    *value = known->value;
    return known->value ? QMAT_OK : fail(v, "a value contains itself");
  }
  if (v->depth >= QMAT_USD_DEEPEST) return fail(v, "values are nested too deep");
  *known = (qmat_usdc_known){.rep = rep};
  v->known_count++;
  qmat_usd_value *made = qmat_usd_alloc(layer, 1, sizeof *made);
  if (!made) return qmat_usd_layer_error(layer);
  v->depth++;
  qmat_status status = read_value(v, rep, made);
  v->depth--;
  if (status != QMAT_OK) return status;
  find_known(v, rep)->value = made; /* the table may have grown */
  *value = made;
  return QMAT_OK;
}
