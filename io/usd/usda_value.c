/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usda_value.h"

#include <math.h>
#include <string.h>

#define FAIL(...) qmat_scan_fail(&p->scanner, __VA_ARGS__)

#define TYPE(name, type, components) \
  { name, QMAT_USD_##type, components, 0, false }
#define WITH_VECTORS(name, type) \
  TYPE(name, type, 1), TYPE(name "2", type, 2), TYPE(name "3", type, 3), TYPE(name "4", type, 4)
#define IN_PRECISIONS(name, components) \
  TYPE(name "h", HALF, components), TYPE(name "f", FLOAT, components), TYPE(name "d", DOUBLE, components)
#define MATRIX(name, rows) \
  { name, QMAT_USD_DOUBLE, (rows) * (rows), rows, false }

static const qmat_usda_type types[] = {TYPE("bool", BOOL, 1),
                                       TYPE("uchar", UCHAR, 1),
                                       TYPE("uint", UINT, 1),
                                       TYPE("int64", INT64, 1),
                                       TYPE("uint64", UINT64, 1),
                                       TYPE("timecode", TIMECODE, 1),
                                       TYPE("string", STRING, 1),
                                       TYPE("pathExpression", STRING, 1),
                                       TYPE("token", TOKEN, 1),
                                       TYPE("asset", ASSET, 1),
                                       TYPE("dictionary", DICTIONARY, 1),
                                       WITH_VECTORS("int", INT),
                                       WITH_VECTORS("half", HALF),
                                       WITH_VECTORS("float", FLOAT),
                                       WITH_VECTORS("double", DOUBLE),
                                       IN_PRECISIONS("point3", 3),
                                       IN_PRECISIONS("vector3", 3),
                                       IN_PRECISIONS("normal3", 3),
                                       IN_PRECISIONS("color3", 3),
                                       IN_PRECISIONS("color4", 4),
                                       IN_PRECISIONS("texCoord2", 2),
                                       IN_PRECISIONS("texCoord3", 3),
                                       IN_PRECISIONS("quat", 4),
                                       MATRIX("matrix2d", 2),
                                       MATRIX("matrix3d", 3),
                                       MATRIX("matrix4d", 4),
                                       MATRIX("frame4d", 4)};

/* ---- lists ---- */

/* Takes one item and appends it to `list`. */
typedef qmat_status take_item(qmat_usda *p, const void *data, qmat_usda_list *list);

enum { ITEMS_PER_REPORT = 65536 };

/* One item, or with `is_array` any number in []. */
static qmat_status take_items(qmat_usda *p, bool is_array, take_item *take, const void *data, qmat_usda_list *list) {
  if (!is_array) return take(p, data, list);
  qmat_status status = qmat_usda_expect(p, '[');
  for (size_t i = 1; status == QMAT_OK && !qmat_usda_accept(p, ']'); i++) {
    status = take(p, data, list);
    if (status == QMAT_OK && i % ITEMS_PER_REPORT == 0) status = qmat_progress(p->layer->context, 0, 0, "items");
    if (status == QMAT_OK && !qmat_usda_accept(p, ',') && qmat_usda_peek(p) != ']')
      status = qmat_usda_expected(p, "',' or ']'");
  }
  return status;
}

/* Copies a list into the layer's memory, and the pointer to it into the pointer at `kept_at`. */
static qmat_status keep_list(qmat_usda *p, const qmat_usda_list *list, size_t size, void *kept_at) {
  void *kept = qmat_usd_alloc(p->layer, list->count, size);
  if (!kept) return qmat_usd_layer_error(p->layer);
  if (list->count > 0) memcpy(kept, list->items, list->count * size);
  memcpy(kept_at, &kept, sizeof kept);
  return QMAT_OK;
}

/* ---- numbers ---- */

static qmat_status push_number(qmat_usda *p, qmat_usd_type type, double number, int64_t integer) {
  if (qmat_usd_is_integer(type)) return qmat_usda_push(p, &p->numbers, &integer, sizeof integer);
  const double rounded = qmat_usd_round(type, number);
  return qmat_usda_push(p, &p->numbers, &rounded, sizeof rounded);
}

static const struct {
  int64_t least, most;
} ranges[] = {
    [QMAT_USD_BOOL] = {0, 1},
    [QMAT_USD_UCHAR] = {0, UINT8_MAX},
    [QMAT_USD_INT] = {INT32_MIN, INT32_MAX},
    [QMAT_USD_UINT] = {0, UINT32_MAX},
    [QMAT_USD_INT64] = {INT64_MIN, INT64_MAX},
    [QMAT_USD_UINT64] = {0, INT64_MAX},
};

/* Parses the text from `text` to `end` as a whole number of the type; false when it is none. A uint64 from 2^63 on
 * becomes the negative number of the same bits. */
static bool read_integer(const char *text, const char *end, qmat_usd_type type, int64_t *integer) {
  bool negative = *text == '-';
  if (*text == '-' || *text == '+') text++;
  uint64_t value = 0;
  if (text == end) return false;
  for (; text < end; text++) {
    if (*text < '0' || *text > '9') return false;
    if (__builtin_mul_overflow(value, 10, &value) || __builtin_add_overflow(value, (uint64_t)(*text - '0'), &value))
      return false;
  }
  if (type == QMAT_USD_UINT64 && !negative) {
    *integer = (int64_t)value;
    return true;
  }
  if (value > (uint64_t)INT64_MAX + (negative ? 1 : 0)) return false;
  *integer = negative ? (int64_t)(0 - value) : (int64_t)value;
  return *integer >= ranges[type].least && *integer <= ranges[type].most;
}

/* One component of a value. */
static qmat_status take_number(qmat_usda *p, qmat_usd_type type) {
  const char c = qmat_usda_peek(p);
  qmat_scanner *scanner = &p->scanner;
  if (type == QMAT_USD_BOOL && qmat_usda_is_name_start(c)) {
    static const struct {
      const char *word;
      int64_t truth;
    } words[] = {{"true", 1}, {"false", 0}, {"yes", 1}, {"no", 0}, {"on", 1}, {"off", 0}, {"True", 1}, {"False", 0}};
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
      if (qmat_usda_accept_word(p, words[i].word)) return push_number(p, type, 0, words[i].truth);
    }
    return qmat_usda_expected(p, "true or false");
  }
  if (type == QMAT_USD_UCHAR && qmat_usda_at_string(p)) { /* a character */
    const char *text;
    qmat_status status = qmat_usda_take_string(p, &text);
    return status == QMAT_OK ? push_number(p, type, 0, (uint8_t)text[0]) : status;
  }
  double number;
  const char *end = scanner->at < scanner->end ? qmat_scan_double(scanner->at, scanner->end, &number) : NULL;
  if (!end || (end < scanner->end && qmat_usda_is_name_part(*end) && *end != ':'))
    return qmat_usda_expected(p, "a number");
  int64_t integer = 0;
  if (qmat_usd_is_integer(type) && !read_integer(scanner->at, end, type, &integer)) {
    if (type != QMAT_USD_BOOL && fabs(number) < 0x1p53 && number == floor(number) &&
        number >= (double)ranges[type].least && number <= (double)ranges[type].most) {
      integer = (int64_t)number;
    } else {
      return FAIL("this is not a whole number, or out of the range of its type");
    }
  }
  scanner->at = end;
  return push_number(p, type, number, integer);
}

/* `count` components in brackets, or rows of them in brackets. */
static qmat_status take_tuple(qmat_usda *p, const qmat_usda_type *shape, unsigned count, bool in_rows) {
  if (count == 1 && !in_rows) return take_number(p, shape->type);
  qmat_status status = qmat_usda_expect(p, '(');
  unsigned items = in_rows ? shape->rows : count;
  for (unsigned i = 0; i < items && status == QMAT_OK; i++) {
    if (i > 0) status = qmat_usda_expect(p, ',');
    if (status == QMAT_OK)
      status = in_rows ? take_tuple(p, shape, count / shape->rows, false) : take_number(p, shape->type);
  }
  if (status == QMAT_OK) qmat_usda_accept(p, ',');
  return status == QMAT_OK ? qmat_usda_expect(p, ')') : status;
}

static qmat_status take_element(qmat_usda *p, const void *data, qmat_usda_list *list) {
  const qmat_usda_type *type = data;
  (void)list; /* p->numbers */
  return take_tuple(p, type, type->components, type->rows > 0);
}

/* ---- values ---- */

static qmat_status take_text(qmat_usda *p, const void *data, qmat_usda_list *list) {
  const qmat_usd_type type = *(const qmat_usd_type *)data;
  const char *text;
  qmat_status status = type == QMAT_USD_ASSET  ? qmat_usda_take_asset(p, &text)
                       : type == QMAT_USD_PATH ? qmat_usda_take_path(p, &text)
                                               : qmat_usda_take_string(p, &text);
  return status == QMAT_OK ? qmat_usda_push(p, list, &text, sizeof text) : status;
}

static qmat_status take_texts(qmat_usda *p, qmat_usd_type type, bool is_array, qmat_usd_value *value) {
  qmat_usda_list texts = {0};
  qmat_status status = take_items(p, is_array, take_text, &type, &texts);
  *value = (qmat_usd_value){.type = type, .is_array = is_array, .components = 1, .count = texts.count};
  if (status == QMAT_OK) status = keep_list(p, &texts, sizeof(const char *), &value->texts);
  qmat_free(texts.items);
  return status;
}

qmat_status qmat_usda_take_names(qmat_usda *p, qmat_usd_value *value) {
  return take_texts(p, QMAT_USD_STRING, qmat_usda_peek(p) == '[', value);
}

static qmat_status take_dictionary(qmat_usda *p, qmat_usd_value *value);

qmat_status qmat_usda_take_typed(qmat_usda *p, const qmat_usda_type *type, qmat_usd_value *value) {
  if (type->type == QMAT_USD_UNREAD) return qmat_usda_skip(p, type->name, value);
  if (qmat_usda_accept_word(p, "None")) {
    *value = (qmat_usd_value){.type = QMAT_USD_BLOCK};
    return QMAT_OK;
  }
  if (type->type == QMAT_USD_DICTIONARY) return take_dictionary(p, value);
  if (qmat_usd_is_text(type->type)) return take_texts(p, type->type, type->is_array, value);
  p->numbers.count = 0;
  qmat_status status = take_items(p, type->is_array, take_element, type, &p->numbers);
  if (status != QMAT_OK) return status;
  *value = (qmat_usd_value){.type = type->type,
                            .is_array = type->is_array,
                            .components = type->components,
                            .count = p->numbers.count / type->components};
  return keep_list(p, &p->numbers, 8, &value->numbers);
}

qmat_status qmat_usda_take_type(qmat_usda *p, qmat_usda_type *type) {
  size_t length;
  const char *text = qmat_usda_peek_name(p, &length);
  if (length == 0) return qmat_usda_expected(p, "the name of a type");
  *type = (qmat_usda_type){.type = QMAT_USD_UNREAD};
  for (size_t i = 0; i < sizeof types / sizeof types[0]; i++) {
    if (qmat_is_word(text, length, types[i].name)) *type = types[i];
  }
  p->scanner.at += length;
  if (p->scanner.at[0] == '[' && p->scanner.at[1] == ']') {
    type->is_array = true;
    p->scanner.at += 2;
    length += 2;
  }
  type->name = qmat_usd_copy(p->layer, text, length);
  return type->name ? QMAT_OK : qmat_usd_layer_error(p->layer);
}

/* Skips a text, name or number, or everything up to the bracket that closes the one here. */
static qmat_status skip(qmat_usda *p) {
  const qmat_scanner start = p->scanner;
  int open = 0;
  do {
    const char *text;
    size_t length;
    qmat_status status = QMAT_OK;
    const char c = qmat_usda_peek(p);
    if (c == 0) return qmat_scan_fail(&start, "this value has no end");
    if (qmat_usda_at_string(p)) {
      status = qmat_usda_take_string(p, &text);
    } else if (c == '@') {
      status = qmat_usda_take_asset(p, &text);
    } else if (strchr("([{", c)) {
      open++;
      p->scanner.at++;
    } else if (strchr(")]}", c)) {
      if (--open < 0) return qmat_usda_expected(p, "a value");
      p->scanner.at++;
    } else {
      qmat_usda_peek_name(p, &length);
      if (length > 0) {
        p->scanner.at += length;
      } else {
        double number;
        const char *end = qmat_scan_double(p->scanner.at, p->scanner.end, &number);
        if (!end && open == 0) return qmat_usda_expected(p, "a value");
        p->scanner.at = end ? end : p->scanner.at + 1;
      }
    }
    if (status != QMAT_OK) return status;
  } while (open > 0);
  return QMAT_OK;
}

qmat_status qmat_usda_skip(qmat_usda *p, const char *kind, qmat_usd_value *value) {
  qmat_status status = skip(p);
  return status == QMAT_OK ? qmat_usd_make_text(p->layer, QMAT_USD_UNREAD, kind, value) : status;
}

/* TYPE NAME = VALUE */
static qmat_status take_entry(qmat_usda *p, qmat_usda_list *entries) {
  qmat_usda_type type;
  qmat_usd_field entry = {0};
  qmat_usd_value *value = qmat_usd_alloc(p->layer, 1, sizeof *value);
  if (!value) return qmat_usd_layer_error(p->layer);
  qmat_status status = qmat_usda_take_type(p, &type);
  if (status != QMAT_OK) return status;
  status = qmat_usda_at_string(p) ? qmat_usda_take_string(p, &entry.name)
                                  : qmat_usda_take_name(p, "the name of an entry", &entry.name);
  if (status == QMAT_OK) status = qmat_usda_expect(p, '=');
  if (status == QMAT_OK) status = qmat_usda_take_typed(p, &type, value);
  entry.value = value;
  return status == QMAT_OK ? qmat_usda_push(p, entries, &entry, sizeof entry) : status;
}

static qmat_status take_dictionary(qmat_usda *p, qmat_usd_value *value) {
  if (p->depth == QMAT_USD_DEEPEST) return FAIL("dictionaries are nested more than %d deep", QMAT_USD_DEEPEST);
  qmat_usda_list entries = {0};
  p->depth++;
  qmat_status status = qmat_usda_expect(p, '{');
  while (status == QMAT_OK && !qmat_usda_accept(p, '}')) {
    status = take_entry(p, &entries);
    while (status == QMAT_OK && (qmat_usda_accept(p, ';') || qmat_usda_accept(p, ','))) continue;
  }
  *value = (qmat_usd_value){.type = QMAT_USD_DICTIONARY, .components = 1, .count = entries.count};
  if (status == QMAT_OK) status = keep_list(p, &entries, sizeof(qmat_usd_field), &value->entries);
  qmat_free(entries.items);
  p->depth--;
  return status;
}

/* ---- values without a type ---- */

static qmat_status take_untyped_number(qmat_usda *p, qmat_usd_value *value) {
  double number;
  int64_t integer;
  const char *end = qmat_scan_double(p->scanner.at, p->scanner.end, &number);
  const bool whole = end && read_integer(p->scanner.at, end, QMAT_USD_INT64, &integer);
  const qmat_usda_type type = {.type = whole ? QMAT_USD_INT64 : QMAT_USD_DOUBLE, .components = 1};
  return qmat_usda_take_typed(p, &type, value);
}

/* An array, by its first item. */
static qmat_status take_untyped_array(qmat_usda *p, qmat_usd_value *value) {
  const qmat_scanner start = p->scanner;
  p->scanner.at++;
  const char c = qmat_usda_peek(p);
  p->scanner = start;
  if (c == '"' || c == '\'') return take_texts(p, QMAT_USD_STRING, true, value);
  if (c == '@') return take_texts(p, QMAT_USD_ASSET, true, value);
  if (c == '<') return take_texts(p, QMAT_USD_PATH, true, value);
  if (c == 0 || !strchr("-+.0123456789]", c)) return qmat_usda_skip(p, "list", value);
  const qmat_usda_type type = {.type = QMAT_USD_DOUBLE, .components = 1, .is_array = true};
  return qmat_usda_take_typed(p, &type, value);
}

qmat_status qmat_usda_take_any(qmat_usda *p, qmat_usd_value *value) {
  size_t length;
  const char c = qmat_usda_peek(p);
  if (c == '"' || c == '\'') return take_texts(p, QMAT_USD_STRING, false, value);
  if (c == '@') return take_texts(p, QMAT_USD_ASSET, false, value);
  if (c == '<') return take_texts(p, QMAT_USD_PATH, false, value);
  if (c == '{') return take_dictionary(p, value);
  if (c == '(') return qmat_usda_skip(p, "tuple", value);
  if (c == '[') return take_untyped_array(p, value);
  const char *name = qmat_usda_peek_name(p, &length);
  if (length == 0 || qmat_is_word(name, length, "inf") || qmat_is_word(name, length, "nan"))
    return take_untyped_number(p, value);
  if (qmat_usda_accept_word(p, "None")) {
    *value = (qmat_usd_value){.type = QMAT_USD_BLOCK};
    return QMAT_OK;
  }
  if (qmat_usda_accept_word(p, "true")) return qmat_usd_make_bool(p->layer, true, value);
  if (qmat_usda_accept_word(p, "false")) return qmat_usd_make_bool(p->layer, false, value);
  const char *token;
  qmat_status status = qmat_usda_take_name(p, "a value", &token);
  return status == QMAT_OK ? qmat_usd_make_text(p->layer, QMAT_USD_TOKEN, token, value) : status;
}

/* ---- references and sublayers ---- */

/* (offset = 10; scale = 0.5; customData = {...}), which may be missing. */
static qmat_status take_layer_offset(qmat_usda *p, double *offset, double *scale) {
  *offset = 0;
  *scale = 1;
  if (!qmat_usda_accept(p, '(')) return QMAT_OK;
  qmat_status status = QMAT_OK;
  while (status == QMAT_OK && !qmat_usda_accept(p, ')')) {
    const char *name;
    qmat_usd_value value;
    status = qmat_usda_take_name(p, "offset or scale", &name);
    if (status == QMAT_OK) status = qmat_usda_expect(p, '=');
    if (status == QMAT_OK) status = qmat_usda_take_any(p, &value);
    if (status != QMAT_OK) break;
    if (strcmp(name, "offset") == 0) *offset = qmat_usd_number(&value, 0);
    if (strcmp(name, "scale") == 0) *scale = qmat_usd_number(&value, 1);
    while (qmat_usda_accept(p, ';') || qmat_usda_accept(p, ',')) continue;
  }
  return status;
}

static qmat_status take_reference(qmat_usda *p, const void *data, qmat_usda_list *list) {
  (void)data;
  qmat_usd_reference reference = {.asset = "", .path = "", .scale = 1};
  char c = qmat_usda_peek(p);
  if (c != '@' && c != '<') return qmat_usda_expected(p, "a reference @asset@ or <path>");
  qmat_status status = c == '@' ? qmat_usda_take_asset(p, &reference.asset) : QMAT_OK;
  if (status == QMAT_OK && qmat_usda_peek(p) == '<') status = qmat_usda_take_path(p, &reference.path);
  if (status == QMAT_OK) status = take_layer_offset(p, &reference.offset, &reference.scale);
  return status == QMAT_OK ? qmat_usda_push(p, list, &reference, sizeof reference) : status;
}

qmat_status qmat_usda_take_list(qmat_usda *p, qmat_usd_type type, qmat_usd_value *value) {
  const bool is_array = qmat_usda_peek(p) == '[';
  qmat_status status = QMAT_OK;
  *value = (qmat_usd_value){.type = type, .is_array = true, .components = 1};
  if (qmat_usda_accept_word(p, "None")) return QMAT_OK;
  if (type == QMAT_USD_REFERENCE) {
    qmat_usda_list references = {0};
    status = take_items(p, is_array, take_reference, NULL, &references);
    value->count = references.count;
    if (status == QMAT_OK) status = keep_list(p, &references, sizeof(qmat_usd_reference), &value->references);
    qmat_free(references.items);
    return status;
  }
  if (type == QMAT_USD_INT64)
    return qmat_usda_take_typed(p, &(qmat_usda_type){.type = type, .components = 1, .is_array = true}, value);
  status = type == QMAT_USD_BLOCK ? qmat_usda_take_any(p, value) : take_texts(p, type, is_array, value);
  value->is_array = true;
  return status;
}

/* Appends the asset to `list`, and its offset and scale to the list that `data` points to. */
static qmat_status take_sublayer(qmat_usda *p, const void *data, qmat_usda_list *list) {
  qmat_usda_list *const *offsets = data;
  const char *asset;
  double pair[2];
  qmat_status status = qmat_usda_take_asset(p, &asset);
  if (status == QMAT_OK) status = take_layer_offset(p, &pair[0], &pair[1]);
  if (status == QMAT_OK) status = qmat_usda_push(p, list, &asset, sizeof asset);
  return status == QMAT_OK ? qmat_usda_push(p, *offsets, pair, sizeof pair) : status;
}

qmat_status qmat_usda_take_sublayers(qmat_usda *p, qmat_usd_value *assets, qmat_usd_value *offsets) {
  qmat_usda_list names = {0}, pairs = {0}, *const pairs_at = &pairs;
  qmat_status status = take_items(p, true, take_sublayer, &pairs_at, &names);
  *assets = (qmat_usd_value){.type = QMAT_USD_STRING, .is_array = true, .components = 1, .count = names.count};
  *offsets = (qmat_usd_value){.type = QMAT_USD_DOUBLE, .is_array = true, .components = 2, .count = pairs.count};
  if (status == QMAT_OK) status = keep_list(p, &names, sizeof(const char *), &assets->texts);
  if (status == QMAT_OK) status = keep_list(p, &pairs, 2 * sizeof(double), &offsets->numbers);
  qmat_free(names.items);
  qmat_free(pairs.items);
  return status;
}

/* ---- samples over time ---- */

/* TIME: VALUE */
static qmat_status take_sample(qmat_usda *p, const qmat_usda_type *type, qmat_usda_list *times,
                               qmat_usda_list *values) {
  double time;
  const char *end = qmat_usda_peek(p) ? qmat_scan_double(p->scanner.at, p->scanner.end, &time) : NULL;
  if (!end) return qmat_usda_expected(p, "the time of a sample");
  p->scanner.at = end;
  qmat_usd_value *value = qmat_usd_alloc(p->layer, 1, sizeof *value);
  if (!value) return qmat_usd_layer_error(p->layer);
  qmat_status status = qmat_usda_expect(p, ':');
  if (status == QMAT_OK) status = qmat_usda_take_typed(p, type, value);
  if (status == QMAT_OK) status = qmat_usda_push(p, times, &time, sizeof time);
  if (status == QMAT_OK) status = qmat_usda_push(p, values, &value, sizeof value);
  if (status != QMAT_OK || qmat_usda_accept(p, ',') || qmat_usda_peek(p) == '}') return status;
  return qmat_usda_expected(p, "',' or '}'");
}

qmat_status qmat_usda_take_samples(qmat_usda *p, const qmat_usda_type *type, qmat_usd_value *value) {
  qmat_usda_list times = {0}, values = {0};
  qmat_usd_samples *samples = qmat_usd_alloc(p->layer, 1, sizeof *samples);
  if (!samples) return qmat_usd_layer_error(p->layer);
  qmat_status status = qmat_usda_expect(p, '{');
  while (status == QMAT_OK && !qmat_usda_accept(p, '}')) status = take_sample(p, type, &times, &values);
  samples->count = times.count;
  if (status == QMAT_OK) status = keep_list(p, &times, sizeof(double), &samples->times);
  if (status == QMAT_OK) status = keep_list(p, &values, sizeof(qmat_usd_value *), &samples->values);
  *value = (qmat_usd_value){.type = QMAT_USD_TIME_SAMPLES, .components = 1, .count = 1, .samples = samples};
  qmat_free(times.items);
  qmat_free(values.items);
  return status;
}
