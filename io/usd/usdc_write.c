/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usdc_write.h"

#include <math.h>
#include <string.h>

#include "io/usd/usda.h"
#include "io/usd/usdc_pack.h"
#include "io/usd/usdc_types.h"

enum { VERSION = 8, CONTENTS_OFFSET_AT = 16, HEADER_BYTES = 88, ALIGNMENT = 8 };

/* A growing list of integers, as the tables have them. */
typedef struct integers {
  int32_t *items;
  size_t count, capacity;
} integers;

/* A path: that of a spec, or one that a value names. */
typedef struct path_node {
  uint32_t parent, first_child, last_child, next; /* QMAT_NO_ID: none */
  int32_t element;                                /* its token; negative for properties */
} path_node;

typedef struct crate {
  qmat_context *context;
  qmat_writer *out;
  qmat_status status;
  const char **tokens;
  size_t token_count, token_capacity;
  qmat_key_table token_numbers;  /* by the hash of the text; counts up where two texts share one */
  qmat_key_table string_numbers; /* by the number of the token */
  integers strings;              /* tokens */
  integers field_names, field_sets, spec_paths, spec_sets, spec_types;
  uint64_t *field_reps;
  size_t rep_count, rep_capacity;
  path_node *paths;
  size_t path_count, path_capacity;
  qmat_key_table path_numbers; /* by parent and element */
} crate;

static void fail_memory(crate *c) {
  if (c->status == QMAT_OK) c->status = qmat_fail_memory(c->context, "the crate");
}

static void fail_unsupported(crate *c, const char *what) {
  if (c->status == QMAT_OK)
    c->status = qmat_fail(c->context, QMAT_ERROR_INTERNAL, "a crate is not written with %s", what);
}

static void push(crate *c, integers *list, uint32_t item) {
  if (c->status == QMAT_OK && qmat_grow((void **)&list->items, &list->capacity, list->count + 1, sizeof *list->items))
    fail_memory(c);
  if (c->status == QMAT_OK) list->items[list->count++] = (int32_t)item;
}

/* ---- tokens, strings and paths ---- */

static uint32_t token_of(crate *c, const char *text) {
  uint64_t key = qmat_hash_mix(strlen(text));
  for (const char *at = text; *at; at++) key = (key ^ (uint8_t)*at) * UINT64_C(0x100000001b3);
  for (key >>= 1;; key++) {
    const uint32_t known = qmat_key_table_id(&c->token_numbers, key);
    if (known == QMAT_NO_ID) break;
    if (strcmp(c->tokens[known], text) == 0) return known;
  }
  if (c->status != QMAT_OK) return 0;
  qmat_key_slot *slot = qmat_key_table_add(&c->token_numbers, key);
  if (!slot || c->token_count >= INT32_MAX ||
      qmat_grow((void **)&c->tokens, &c->token_capacity, c->token_count + 1, sizeof *c->tokens)) {
    fail_memory(c);
    return 0;
  }
  slot->id = (uint32_t)c->token_count;
  c->tokens[c->token_count++] = text;
  return slot->id;
}

static uint32_t string_of(crate *c, const char *text) {
  const uint32_t token = token_of(c, text), known = qmat_key_table_id(&c->string_numbers, token);
  if (known != QMAT_NO_ID || c->status != QMAT_OK) return known;
  qmat_key_slot *slot = qmat_key_table_add(&c->string_numbers, token);
  if (!slot) {
    fail_memory(c);
    return 0;
  }
  slot->id = (uint32_t)c->strings.count;
  push(c, &c->strings, token);
  return slot->id;
}

/* The number of a path below `parent`. */
static uint32_t path_below(crate *c, uint32_t parent, const char *name, bool is_property) {
  const uint32_t token = token_of(c, name);
  const uint64_t key = (uint64_t)parent << 32 | (uint64_t)token << 1 | is_property;
  const uint32_t known = qmat_key_table_id(&c->path_numbers, key);
  if (known != QMAT_NO_ID || c->status != QMAT_OK) return known;
  qmat_key_slot *slot = qmat_key_table_add(&c->path_numbers, key);
  if (!slot || qmat_grow((void **)&c->paths, &c->path_capacity, c->path_count + 1, sizeof *c->paths)) {
    fail_memory(c);
    return 0;
  }
  slot->id = (uint32_t)c->path_count;
  path_node *above = &c->paths[parent];
  *(above->first_child == QMAT_NO_ID ? &above->first_child : &c->paths[above->last_child].next) = slot->id;
  above->last_child = slot->id;
  c->paths[c->path_count++] = (path_node){.parent = parent,
                                          .first_child = QMAT_NO_ID,
                                          .last_child = QMAT_NO_ID,
                                          .next = QMAT_NO_ID,
                                          .element = is_property ? -(int32_t)token : (int32_t)token};
  return slot->id;
}

/* The number of an absolute path: "/prim/prim.property". `layer` keeps copies of its names. */
static uint32_t path_of(crate *c, qmat_usd_layer *layer, const char *text) {
  uint32_t at = 0;
  if (text[0] != '/' || strpbrk(text, "{[")) fail_unsupported(c, "a path that is missing or relative, or has variants");
  for (const char *name = text; *name && name[1] && c->status == QMAT_OK;) {
    const bool is_property = *name == '.';
    const size_t length = is_property ? strlen(name + 1) : strcspn(name + 1, "/.");
    const char *copy = qmat_usd_copy(layer, name + 1, length);
    if (!copy) fail_memory(c);
    if (copy) at = path_below(c, at, copy, is_property);
    name += length + 1;
  }
  return at;
}

/* ---- values ---- */

static uint64_t rep_of(unsigned type, uint64_t payload) {
  return (uint64_t)type << 48 | payload;
}

/* The place of what is written next. */
static uint64_t next_place(crate *c) {
  while (c->out->size % ALIGNMENT != 0 && !c->out->failed) qmat_put_u8(c->out, 0);
  return c->out->size;
}

static uint16_t half_bits(double number) {
  const uint16_t sign = signbit(number) ? 1 << 15 : 0;
  const double size = fabs(number);
  if (isnan(number)) return sign | 0x7e00;
  if (size == INFINITY) return sign | 0x7c00;
  if (size < ldexp(1, -14)) return sign | (uint16_t)ldexp(size, 24);
  int exponent;
  const double fraction = frexp(size, &exponent); /* 0.5 to 1 */
  return sign | (uint16_t)((exponent + 14) << 10) | (uint16_t)(ldexp(fraction, 11) - 1024);
}

static void put_number(qmat_writer *out, qmat_usd_type type, double number) {
  if (type == QMAT_USD_HALF)
    qmat_put_u16(out, half_bits(number));
  else if (type == QMAT_USD_FLOAT)
    qmat_put_f32(out, (float)number);
  else
    qmat_put_f64(out, number);
}

static void put_integer(qmat_writer *out, qmat_usd_type type, int64_t number) {
  switch (qmat_usdc_component_bytes[type]) {
    case 1:
      qmat_put_u8(out, (uint8_t)number);
      break;
    case 4:
      qmat_put_u32(out, (uint32_t)number);
      break;
    default:
      qmat_put_u64(out, (uint64_t)number);
  }
}

/* The elements of a value, one after the other. A quaternion has its real part last. */
static void put_elements(crate *c, const qmat_usd_value *v, bool is_quaternion) {
  const size_t width = v->components;
  for (size_t i = 0; i < v->count * width; i++) {
    const size_t turned = is_quaternion ? i - i % 4 + (i + 1) % 4 : i;
    if (qmat_usd_is_integer(v->type))
      put_integer(c->out, v->type, v->integers[i]);
    else if (qmat_usd_is_number(v->type))
      put_number(c->out, v->type, v->numbers[turned]);
    else
      qmat_put_u32(c->out, v->type == QMAT_USD_TOKEN ? token_of(c, v->texts[i]) : string_of(c, v->texts[i]));
  }
}

/* The number of a plain type; `type_name` of the attribute, or "", tells quaternions and matrices from vectors. */
static unsigned plain_type_of(const qmat_usd_value *v, const char *type_name) {
  const bool is_quaternion = strncmp(type_name, "quat", 4) == 0;
  const bool is_matrix = strncmp(type_name, "matrix", 6) == 0 || strncmp(type_name, "frame", 5) == 0;
  for (unsigned t = 0; t < QMAT_USDC_PLAIN_TYPES; t++) {
    const qmat_usdc_plain_type *p = &qmat_usdc_plain_types[t];
    if (p->components > 0 && p->type == v->type && p->components == v->components &&
        p->is_quaternion == is_quaternion && (p->rows > 0) == is_matrix)
      return t;
  }
  return 0;
}

static uint64_t put_array(crate *c, const qmat_usd_value *v, unsigned type) {
  const uint64_t rep = rep_of(type, 0) | QMAT_USDC_REP_ARRAY;
  if (v->count == 0) return rep;
  const uint64_t place = next_place(c);
  qmat_put_u64(c->out, v->count);
  if ((v->type != QMAT_USD_INT && v->type != QMAT_USD_UINT) || v->components > 1 ||
      v->count < QMAT_USDC_FEWEST_PACKED) {
    put_elements(c, v, qmat_usdc_plain_types[type].is_quaternion);
    return rep | place;
  }
  int32_t *items = qmat_alloc(v->count, sizeof *items);
  if (!items) fail_memory(c);
  for (size_t i = 0; items && i < v->count; i++) items[i] = (int32_t)(uint32_t)v->integers[i];
  if (items) qmat_usdc_put_integers(c->out, items, v->count);
  qmat_free(items);
  return rep | place | QMAT_USDC_REP_PACKED;
}

static uint64_t put_plain(crate *c, const qmat_usd_value *v, const char *type_name) {
  const unsigned type = plain_type_of(v, type_name);
  if (type == 0) fail_unsupported(c, "a value of an unknown type");
  if (type == 0 || v->is_array) return type == 0 ? 0 : put_array(c, v, type);
  if (v->type == QMAT_USD_ASSET) return rep_of(type, token_of(c, v->texts[0])) | QMAT_USDC_REP_INLINED;
  if (v->components > 1 || qmat_usdc_component_bytes[v->type] > 4) {
    const uint64_t place = next_place(c);
    put_elements(c, v, qmat_usdc_plain_types[type].is_quaternion);
    return rep_of(type, place);
  }
  qmat_writer *const out = c->out;
  qmat_writer four = {0};
  c->out = &four;
  put_elements(c, v, false);
  c->out = out;
  uint64_t payload = 0;
  for (size_t i = 0; i < four.size; i++) payload |= (uint64_t)four.bytes[i] << (8 * i);
  if (four.failed) fail_memory(c);
  qmat_writer_uninit(&four);
  return rep_of(type, payload) | QMAT_USDC_REP_INLINED;
}

static uint64_t put_value(crate *c, qmat_usd_layer *layer, const char *field, const char *type_name,
                          const qmat_usd_value *v);

static uint64_t put_dictionary(crate *c, qmat_usd_layer *layer, const qmat_usd_value *v) {
  uint64_t *reps = qmat_alloc(v->count, sizeof *reps);
  if (!reps) fail_memory(c);
  if (!reps) return 0;
  for (size_t i = 0; i < v->count; i++) reps[i] = put_value(c, layer, "", "", v->entries[i].value);
  const uint64_t place = next_place(c);
  qmat_put_u64(c->out, v->count);
  for (size_t i = 0; i < v->count; i++) {
    qmat_put_u32(c->out, string_of(c, v->entries[i].name));
    qmat_put_u64(c->out, 8); /* the distance of the representation */
    qmat_put_u64(c->out, reps[i]);
  }
  qmat_free(reps);
  return rep_of(QMAT_USDC_DICTIONARY, place);
}

static void put_reference(crate *c, qmat_usd_layer *layer, const qmat_usd_reference *r, bool is_payload) {
  qmat_put_u32(c->out, string_of(c, r->asset));
  qmat_put_u32(c->out, path_of(c, layer, r->path));
  qmat_put_f64(c->out, r->offset);
  qmat_put_f64(c->out, r->scale);
  if (!is_payload) qmat_put_u64(c->out, 0); /* no custom data */
}

static uint64_t put_list_op(crate *c, qmat_usd_layer *layer, const char *field, const qmat_usd_list_op *op) {
  const bool is_payload = strcmp(field, "payload") == 0;
  const qmat_usd_type items = op->lists[QMAT_USD_EXPLICIT].type;
  const unsigned type = items == QMAT_USD_TOKEN       ? QMAT_USDC_TOKEN_LIST_OP
                        : items == QMAT_USD_STRING    ? QMAT_USDC_STRING_LIST_OP
                        : items == QMAT_USD_PATH      ? QMAT_USDC_PATH_LIST_OP
                        : items != QMAT_USD_REFERENCE ? 0
                        : is_payload                  ? QMAT_USDC_PAYLOAD_LIST_OP
                                                      : QMAT_USDC_REFERENCE_LIST_OP;
  if (type == 0) fail_unsupported(c, "a list of an unknown type");
  const uint64_t place = next_place(c);
  uint8_t header = op->is_explicit;
  for (size_t i = 0; i < QMAT_USD_EDIT_COUNT; i++)
    if (op->lists[qmat_usdc_lists[i].edit].count > 0) header |= (uint8_t)(1 << qmat_usdc_lists[i].bit);
  qmat_put_u8(c->out, header);
  for (size_t i = 0; i < QMAT_USD_EDIT_COUNT; i++) {
    const qmat_usd_value *list = &op->lists[qmat_usdc_lists[i].edit];
    if (list->count > 0) qmat_put_u64(c->out, list->count);
    for (size_t k = 0; k < list->count && c->status == QMAT_OK; k++) {
      if (items == QMAT_USD_REFERENCE)
        put_reference(c, layer, &list->references[k], is_payload);
      else
        qmat_put_u32(c->out, items == QMAT_USD_PATH    ? path_of(c, layer, list->texts[k])
                             : items == QMAT_USD_TOKEN ? token_of(c, list->texts[k])
                                                       : string_of(c, list->texts[k]));
    }
  }
  return rep_of(type, place);
}

/* ---- fields ---- */

/* Fields that have a type of their own, whatever their value looks like in text. */
static const struct {
  const char *name;
  uint8_t type;
} typed_fields[] = {
    {"specifier", QMAT_USDC_SPECIFIER},
    {"variability", QMAT_USDC_VARIABILITY},
    {"permission", QMAT_USDC_PERMISSION},
    {"subLayers", QMAT_USDC_STRING_VECTOR},
    {"subLayerOffsets", QMAT_USDC_LAYER_OFFSET_VECTOR},
    {"primOrder", QMAT_USDC_TOKEN_VECTOR},
    {"propertyOrder", QMAT_USDC_TOKEN_VECTOR},
    {"typeName", QMAT_USDC_TOKEN},
    {"defaultPrim", QMAT_USDC_TOKEN},
    {"upAxis", QMAT_USDC_TOKEN},
    {"kind", QMAT_USDC_TOKEN},
    {"interpolation", QMAT_USDC_TOKEN},
    {"colorSpace", QMAT_USDC_TOKEN},
    {"elementSize", QMAT_USDC_INT},
    {"metersPerUnit", QMAT_USDC_DOUBLE},
    {"kilogramsPerUnit", QMAT_USDC_DOUBLE},
    {"startTimeCode", QMAT_USDC_DOUBLE},
    {"endTimeCode", QMAT_USDC_DOUBLE},
    {"timeCodesPerSecond", QMAT_USDC_DOUBLE},
    {"framesPerSecond", QMAT_USDC_DOUBLE},
};

/* The number of a word in a short list. */
static uint64_t choice_of(crate *c, const qmat_usd_value *v, const char *const *choices) {
  const char *text = qmat_usd_text(v);
  for (uint64_t i = 0; text && choices[i]; i++)
    if (strcmp(text, choices[i]) == 0) return i;
  fail_unsupported(c, "an unknown specifier, permission or variability");
  return 0;
}

static uint64_t put_vector(crate *c, const qmat_usd_value *v, unsigned type) {
  const uint64_t place = next_place(c);
  qmat_put_u64(c->out, v->count);
  put_elements(c, v, false);
  return rep_of(type, place);
}

static uint64_t put_typed(crate *c, const qmat_usd_value *v, unsigned type) {
  static const char *const specifiers[] = {"def", "over", "class", NULL},
                           *const permissions[] = {"public", "private", NULL},
                           *const variabilities[] = {"varying", "uniform", NULL};
  const double number = qmat_usd_number(v, NAN);
  const bool is_integer = fabs(number) < 0x1p31;
  const int64_t integer = is_integer ? (int64_t)number : 0;
  qmat_usd_value changed = *v;
  switch (type) {
    case QMAT_USDC_SPECIFIER:
      return rep_of(type, choice_of(c, v, specifiers)) | QMAT_USDC_REP_INLINED;
    case QMAT_USDC_PERMISSION:
      return rep_of(type, choice_of(c, v, permissions)) | QMAT_USDC_REP_INLINED;
    case QMAT_USDC_VARIABILITY:
      return rep_of(type, choice_of(c, v, variabilities)) | QMAT_USDC_REP_INLINED;
    case QMAT_USDC_TOKEN:
    case QMAT_USDC_TOKEN_VECTOR:
      changed.type = QMAT_USD_TOKEN;
      if (!qmat_usd_is_text(v->type)) fail_unsupported(c, "a field that is no text");
      return type == QMAT_USDC_TOKEN ? put_plain(c, &changed, "") : put_vector(c, &changed, type);
    case QMAT_USDC_INT:
    case QMAT_USDC_DOUBLE:
      if (isnan(number) || (type == QMAT_USDC_INT && !is_integer)) fail_unsupported(c, "a field that is no number");
      changed.type = type == QMAT_USDC_INT ? QMAT_USD_INT : QMAT_USD_DOUBLE;
      if (type == QMAT_USDC_INT)
        changed.integers = &integer;
      else
        changed.numbers = &number;
      return put_plain(c, &changed, "");
    default:
      return put_vector(c, v, type);
  }
}

static uint64_t put_value(crate *c, qmat_usd_layer *layer, const char *field, const char *type_name,
                          const qmat_usd_value *v) {
  if (c->status != QMAT_OK) return 0;
  for (size_t i = 0; i < sizeof typed_fields / sizeof *typed_fields; i++)
    if (strcmp(field, typed_fields[i].name) == 0) return put_typed(c, v, typed_fields[i].type);
  switch (v->type) {
    case QMAT_USD_BLOCK:
      return rep_of(QMAT_USDC_VALUE_BLOCK, 0) | QMAT_USDC_REP_INLINED;
    case QMAT_USD_DICTIONARY:
      return put_dictionary(c, layer, v);
    case QMAT_USD_LIST_OP:
      return put_list_op(c, layer, field, v->list_op);
    default: /* other fields of an attribute have types of their own */
      return put_plain(c, v, strcmp(field, "default") == 0 ? type_name : "");
  }
}

static void add_field(crate *c, const char *name, uint64_t rep) {
  push(c, &c->field_sets, (uint32_t)c->rep_count);
  push(c, &c->field_names, token_of(c, name));
  if (c->status == QMAT_OK && qmat_grow((void **)&c->field_reps, &c->rep_capacity, c->rep_count + 1, sizeof(uint64_t)))
    fail_memory(c);
  if (c->status == QMAT_OK) c->field_reps[c->rep_count++] = rep;
}

/* ---- specs ---- */

static bool is_property(const qmat_usd_spec *spec) {
  return spec->kind == QMAT_USD_ATTRIBUTE || spec->kind == QMAT_USD_RELATIONSHIP;
}

/* The field that lists the children of a spec: its prims or its properties. */
static void add_children(crate *c, const qmat_usd_spec *spec, bool properties) {
  size_t count = 0;
  for (const qmat_usd_spec *child = spec->first_child; child; child = child->next)
    count += is_property(child) == properties;
  if (count == 0) return;
  const uint64_t place = next_place(c);
  qmat_put_u64(c->out, count);
  for (const qmat_usd_spec *child = spec->first_child; child; child = child->next)
    if (is_property(child) == properties) qmat_put_u32(c->out, token_of(c, child->name));
  add_field(c, properties ? "properties" : "primChildren", rep_of(QMAT_USDC_TOKEN_VECTOR, place));
}

/* Adds a spec and those below it. Readers expect some fields of a property even where text leaves them out. */
static void add_spec(crate *c, qmat_usd_layer *layer, const qmat_usd_spec *spec, uint32_t path) {
  static const uint8_t types[] = {[QMAT_USD_ROOT] = QMAT_USDC_SPEC_PSEUDO_ROOT,
                                  [QMAT_USD_PRIM] = QMAT_USDC_SPEC_PRIM,
                                  [QMAT_USD_ATTRIBUTE] = QMAT_USDC_SPEC_ATTRIBUTE,
                                  [QMAT_USD_RELATIONSHIP] = QMAT_USDC_SPEC_RELATIONSHIP};
  if (spec->kind > QMAT_USD_RELATIONSHIP) fail_unsupported(c, "variants");
  if (c->status != QMAT_OK) return;
  push(c, &c->spec_paths, path);
  push(c, &c->spec_sets, (uint32_t)c->field_sets.count);
  push(c, &c->spec_types, types[spec->kind]);
  const char *type_name =
      spec->kind == QMAT_USD_ATTRIBUTE ? qmat_usd_text(qmat_usd_field_value(spec, "typeName")) : NULL;
  for (size_t i = 0; i < spec->field_count; i++)
    add_field(c, spec->fields[i].name,
              put_value(c, layer, spec->fields[i].name, type_name ? type_name : "", spec->fields[i].value));
  if (is_property(spec) && !qmat_usd_field_value(spec, "custom"))
    add_field(c, "custom", rep_of(QMAT_USDC_BOOL, 0) | QMAT_USDC_REP_INLINED);
  if (is_property(spec) && !qmat_usd_field_value(spec, "variability"))
    add_field(c, "variability", rep_of(QMAT_USDC_VARIABILITY, 0) | QMAT_USDC_REP_INLINED);
  add_children(c, spec, true);
  add_children(c, spec, false);
  push(c, &c->field_sets, UINT32_MAX);
  for (const qmat_usd_spec *child = spec->first_child; child && c->status == QMAT_OK; child = child->next)
    add_spec(c, layer, child, path_below(c, path, child->name, is_property(child)));
}

/* ---- tables ---- */

typedef struct path_rows {
  integers paths, elements, jumps;
} path_rows;

/* Adds a path and those below it, depth first. The jump of a row says which rows follow it, as usdc_tables.c reads it.
 */
static void add_rows(crate *c, uint32_t path, path_rows *rows) {
  const path_node *p = &c->paths[path];
  const size_t row = rows->paths.count;
  push(c, &rows->paths, path);
  push(c, &rows->elements, (uint32_t)p->element);
  push(c, &rows->jumps, p->next != QMAT_NO_ID ? 0 : (uint32_t)-2);
  if (p->first_child == QMAT_NO_ID || c->status != QMAT_OK) return;
  for (uint32_t child = p->first_child; child != QMAT_NO_ID && c->status == QMAT_OK; child = c->paths[child].next)
    add_rows(c, child, rows);
  if (c->status == QMAT_OK) rows->jumps.items[row] = p->next != QMAT_NO_ID ? (int32_t)(rows->paths.count - row) : -1;
}

static void put_tokens(crate *c) {
  size_t size = 0;
  for (size_t i = 0; i < c->token_count; i++) size += strlen(c->tokens[i]) + 1;
  char *all = qmat_alloc(size, 1), *at = all;
  if (!all) {
    fail_memory(c);
    return;
  }
  for (size_t i = 0; i < c->token_count; i++) {
    const size_t length = strlen(c->tokens[i]) + 1;
    memcpy(at, c->tokens[i], length);
    at += length;
  }
  qmat_put_u64(c->out, c->token_count);
  qmat_put_u64(c->out, size);
  qmat_usdc_put_packed(c->out, all, size);
  qmat_free(all);
}

static void put_strings(crate *c) {
  qmat_put_u64(c->out, c->strings.count);
  for (size_t i = 0; i < c->strings.count; i++) qmat_put_u32(c->out, (uint32_t)c->strings.items[i]);
}

static void put_fields(crate *c) {
  qmat_put_u64(c->out, c->rep_count);
  qmat_usdc_put_integers(c->out, c->field_names.items, c->rep_count);
  qmat_writer reps = {0};
  for (size_t i = 0; i < c->rep_count; i++) qmat_put_u64(&reps, c->field_reps[i]);
  if (reps.failed) fail_memory(c);
  if (!reps.failed) qmat_usdc_put_packed(c->out, reps.bytes, reps.size);
  qmat_writer_uninit(&reps);
}

static void put_field_sets(crate *c) {
  qmat_put_u64(c->out, c->field_sets.count);
  qmat_usdc_put_integers(c->out, c->field_sets.items, c->field_sets.count);
}

static void put_paths(crate *c) {
  path_rows rows = {0};
  add_rows(c, 0, &rows);
  qmat_put_u64(c->out, c->path_count);
  qmat_put_u64(c->out, rows.paths.count);
  qmat_usdc_put_integers(c->out, rows.paths.items, rows.paths.count);
  qmat_usdc_put_integers(c->out, rows.elements.items, rows.elements.count);
  qmat_usdc_put_integers(c->out, rows.jumps.items, rows.jumps.count);
  qmat_free(rows.paths.items);
  qmat_free(rows.elements.items);
  qmat_free(rows.jumps.items);
}

static void put_specs(crate *c) {
  qmat_put_u64(c->out, c->spec_paths.count);
  qmat_usdc_put_integers(c->out, c->spec_paths.items, c->spec_paths.count);
  qmat_usdc_put_integers(c->out, c->spec_sets.items, c->spec_sets.count);
  qmat_usdc_put_integers(c->out, c->spec_types.items, c->spec_types.count);
}

/* The tables, then the table of contents; its place goes into the header. */
static void put_tables(crate *c) {
  static const struct {
    char name[16];
    void (*put)(crate *c);
  } tables[] = {{"TOKENS", put_tokens},        {"STRINGS", put_strings}, {"FIELDS", put_fields},
                {"FIELDSETS", put_field_sets}, {"PATHS", put_paths},     {"SPECS", put_specs}};
  enum { TABLES = sizeof tables / sizeof *tables };
  uint64_t starts[TABLES + 1];
  for (size_t i = 0; i < TABLES && c->status == QMAT_OK; i++) {
    starts[i] = c->out->size;
    tables[i].put(c);
  }
  if (c->status != QMAT_OK) return;
  const uint64_t contents = starts[TABLES] = c->out->size;
  qmat_put_u64(c->out, TABLES);
  for (size_t i = 0; i < TABLES; i++) {
    qmat_put_bytes(c->out, tables[i].name, sizeof tables[i].name);
    qmat_put_u64(c->out, starts[i]);
    qmat_put_u64(c->out, starts[i + 1] - starts[i]);
  }
  for (int i = 0; i < 8 && !c->out->failed; i++) c->out->bytes[CONTENTS_OFFSET_AT + i] = (uint8_t)(contents >> (8 * i));
}

/* ---- files ---- */

static void crate_uninit(crate *c) {
  qmat_key_table_uninit(&c->token_numbers);
  qmat_key_table_uninit(&c->string_numbers);
  qmat_key_table_uninit(&c->path_numbers);
  integers *const lists[] = {&c->strings,    &c->field_names, &c->field_sets,
                             &c->spec_paths, &c->spec_sets,   &c->spec_types};
  for (size_t i = 0; i < sizeof lists / sizeof *lists; i++) qmat_free(lists[i]->items);
  qmat_free(c->tokens);
  qmat_free(c->field_reps);
  qmat_free(c->paths);
}

qmat_status qmat_usdc_write(qmat_context *context, qmat_usd_layer *layer, qmat_writer *out) {
  crate c = {.context = context, .out = out};
  if (qmat_key_table_init(&c.token_numbers, 0) || qmat_key_table_init(&c.string_numbers, 0) ||
      qmat_key_table_init(&c.path_numbers, 0) || qmat_grow((void **)&c.paths, &c.path_capacity, 1, sizeof *c.paths))
    fail_memory(&c);
  if (c.status == QMAT_OK) {
    const uint8_t header[HEADER_BYTES] = {'P', 'X', 'R', '-', 'U', 'S', 'D', 'C', 0, VERSION};
    qmat_put_bytes(out, header, sizeof header);
    token_of(&c, ";-)"); /* token 0, which cannot be negative, must be the name of nothing */
    c.paths[c.path_count++] =
        (path_node){.parent = QMAT_NO_ID, .first_child = QMAT_NO_ID, .last_child = QMAT_NO_ID, .next = QMAT_NO_ID};
    add_spec(&c, layer, layer->root, 0);
    put_tables(&c);
  }
  if (out->failed) fail_memory(&c);
  crate_uninit(&c);
  return c.status;
}

qmat_status qmat_usdc_of_text(qmat_context *context, qmat_writer *layer) {
  static const uint8_t end[16];
  qmat_put_bytes(layer, end, sizeof end);
  if (layer->failed) return qmat_fail_memory(context, "the crate");
  const qmat_bytes text = {.size = layer->size - sizeof end, .data = layer->bytes};
  qmat_usd_layer read = {0};
  qmat_writer made = {0};
  qmat_status status = qmat_usda_read(context, &text, "the text layer", &read);
  if (status == QMAT_OK) status = qmat_usdc_write(context, &read, &made);
  qmat_usd_layer_uninit(&read);
  qmat_writer_uninit(layer);
  *layer = made;
  return status;
}
