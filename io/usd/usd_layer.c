/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_layer.h"

#include <math.h>
#include <string.h>

#include "io/bytes.h"

#define FREE_BYTES ((size_t)1 << 24)
#define BYTES_PER_BYTE 256
#define CHUNK_SIZE ((size_t)16 << 10)
#define ALIGNMENT 16

qmat_status qmat_usd_layer_init(qmat_context *context, qmat_usd_layer *layer, const char *path, size_t size) {
  *layer = (qmat_usd_layer){.context = context, .path = path, .allowance = FREE_BYTES + BYTES_PER_BYTE * size};
  layer->path = qmat_usd_copy(layer, path, strlen(path));
  if (!layer->path) return qmat_usd_layer_error(layer);
  layer->root = qmat_usd_alloc(layer, 1, sizeof *layer->root);
  if (!layer->root) return qmat_usd_layer_error(layer);
  layer->root->name = "";
  return QMAT_OK;
}

qmat_status qmat_usd_layer_fail(const qmat_usd_layer *layer, const char *what) {
  return qmat_fail_file(layer->context, QMAT_ERROR_FORMAT, layer->path, "%s", what);
}

qmat_status qmat_usd_layer_fail_memory(const qmat_usd_layer *layer) {
  qmat_fail_memory(layer->context, "a USD layer");
  return qmat_fail_at(layer->context, layer->path, 0, 0);
}

qmat_status qmat_usd_layer_error(const qmat_usd_layer *layer) {
  return layer->context->error.status;
}

void qmat_usd_layer_uninit(qmat_usd_layer *layer) {
  qmat_key_table_uninit(&layer->specs);
  qmat_arena_uninit(&layer->arena);
  *layer = (qmat_usd_layer){0};
}

void *qmat_usd_alloc(qmat_usd_layer *layer, size_t count, size_t size) {
  size_t bytes;
  if (__builtin_mul_overflow(count, size, &bytes) || bytes > layer->allowance) {
    qmat_usd_layer_fail(layer, "the values take more memory than a file of this size justifies");
    return NULL;
  }
  layer->allowance -= bytes;
  bytes = (bytes + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
  if (bytes <= layer->chunk_left) {
    uint8_t *memory = layer->chunk;
    layer->chunk += bytes;
    layer->chunk_left -= bytes;
    return memory;
  }
  void *memory;
  if (bytes >= CHUNK_SIZE / 4) {
    memory = qmat_arena_calloc(&layer->arena, bytes, 1);
  } else {
    memory = layer->chunk = qmat_arena_calloc(&layer->arena, CHUNK_SIZE, 1);
    layer->chunk_left = 0;
    if (memory) {
      layer->chunk += bytes;
      layer->chunk_left = CHUNK_SIZE - bytes;
    }
  }
  if (!memory) qmat_usd_layer_fail_memory(layer);
  return memory;
}

const char *qmat_usd_copy(qmat_usd_layer *layer, const char *text, size_t length) {
  char *copy = qmat_usd_alloc(layer, length + 1, 1);
  if (copy) memcpy(copy, text, length);
  return copy;
}

/* ---- specs ---- */

/* The spec, or NULL. `*key` receives its key, or the key under which it has to be added. The key is a hash of the
 * arguments; where another spec has the same hash, it counts up. */
static qmat_usd_spec *find_spec(const qmat_usd_layer *layer, const qmat_usd_spec *parent, qmat_usd_kind kind,
                                const char *name, uint64_t *key) {
  uint64_t hash = qmat_hash_mix((uint64_t)(uintptr_t)parent + (uint64_t)kind);
  for (const char *c = name; *c; c++) hash = (hash ^ (uint8_t)*c) * UINT64_C(0x100000001b3);
  for (*key = hash >> 1;; ++*key) {
    const qmat_key_slot *slot = qmat_key_table_find(&layer->specs, *key);
    if (slot->key != *key) return NULL;
    qmat_usd_spec *spec = slot->pointer;
    if (spec->parent == parent && spec->kind == kind && strcmp(spec->name, name) == 0) return spec;
  }
}

qmat_usd_spec *qmat_usd_child(const qmat_usd_layer *layer, const qmat_usd_spec *parent, qmat_usd_kind kind,
                              const char *name) {
  uint64_t key;
  return layer->specs.slots ? find_spec(layer, parent, kind, name, &key) : NULL;
}

qmat_usd_spec *qmat_usd_add_child(qmat_usd_layer *layer, qmat_usd_spec *parent, qmat_usd_kind kind, const char *name) {
  if (parent->depth >= QMAT_USD_DEEPEST) {
    qmat_fail_file(layer->context, QMAT_ERROR_FORMAT, layer->path, "prims are nested more than %d deep",
                   QMAT_USD_DEEPEST);
    return NULL;
  }
  qmat_usd_spec *spec = qmat_usd_alloc(layer, 1, sizeof *spec);
  if (!spec) return NULL;
  uint64_t key;
  qmat_key_slot *slot = NULL;
  if (layer->specs.slots || !qmat_key_table_init(&layer->specs, 0)) {
    find_spec(layer, parent, kind, name, &key);
    slot = qmat_key_table_add(&layer->specs, key);
  }
  if (!slot) {
    qmat_usd_layer_fail_memory(layer);
    return NULL;
  }
  slot->pointer = spec;
  spec->kind = kind;
  spec->name = name;
  spec->parent = parent;
  spec->depth = parent->depth + 1;
  if (parent->last_child) {
    parent->last_child->next = spec;
  } else {
    parent->first_child = spec;
  }
  parent->last_child = spec;
  return spec;
}

qmat_status qmat_usd_set_field(qmat_usd_layer *layer, qmat_usd_spec *spec, const char *name,
                               const qmat_usd_value *value) {
  qmat_usd_value *kept = qmat_usd_alloc(layer, 1, sizeof *kept);
  if (!kept) return qmat_usd_layer_error(layer);
  *kept = *value;
  for (size_t i = 0; i < spec->field_count; i++) {
    if (strcmp(spec->fields[i].name, name) != 0) continue;
    spec->fields[i].value = kept;
    return QMAT_OK;
  }
  if (spec->field_count == QMAT_USD_MOST_FIELDS) {
    qmat_fail(layer->context, QMAT_ERROR_FORMAT, "a spec has more than %d fields", QMAT_USD_MOST_FIELDS);
    return qmat_fail_at(layer->context, layer->path, spec->line, spec->column);
  }
  if (spec->field_count == spec->field_capacity) {
    size_t capacity = spec->field_capacity ? 2 * spec->field_capacity : 4;
    qmat_usd_field *fields = qmat_usd_alloc(layer, capacity, sizeof *fields);
    if (!fields) return qmat_usd_layer_error(layer);
    if (spec->field_count > 0) memcpy(fields, spec->fields, spec->field_count * sizeof *fields);
    spec->fields = fields;
    spec->field_capacity = capacity;
  }
  spec->fields[spec->field_count++] = (qmat_usd_field){.name = name, .value = kept};
  return QMAT_OK;
}

qmat_status qmat_usd_make_text(qmat_usd_layer *layer, qmat_usd_type type, const char *text, qmat_usd_value *value) {
  const char **texts = qmat_usd_alloc(layer, 1, sizeof *texts);
  if (!texts) return qmat_usd_layer_error(layer);
  *texts = text;
  *value = (qmat_usd_value){.type = type, .components = 1, .count = 1, .texts = texts};
  return QMAT_OK;
}

qmat_status qmat_usd_make_bool(qmat_usd_layer *layer, bool truth, qmat_usd_value *value) {
  int64_t *integers = qmat_usd_alloc(layer, 1, sizeof *integers);
  if (!integers) return qmat_usd_layer_error(layer);
  *integers = truth;
  *value = (qmat_usd_value){.type = QMAT_USD_BOOL, .components = 1, .count = 1, .integers = integers};
  return QMAT_OK;
}

/* ---- look-ups ---- */

const qmat_usd_value *qmat_usd_field_value(const qmat_usd_spec *spec, const char *name) {
  for (size_t i = 0; i < spec->field_count; i++) {
    if (strcmp(spec->fields[i].name, name) == 0) return spec->fields[i].value;
  }
  return NULL;
}

const qmat_usd_value *qmat_usd_entry(const qmat_usd_value *dictionary, const char *name) {
  if (!dictionary || dictionary->type != QMAT_USD_DICTIONARY) return NULL;
  for (size_t i = 0; i < dictionary->count; i++) {
    if (strcmp(dictionary->entries[i].name, name) == 0) return dictionary->entries[i].value;
  }
  return NULL;
}

bool qmat_usd_is_integer(qmat_usd_type type) {
  return type >= QMAT_USD_BOOL && type <= QMAT_USD_UINT64;
}

bool qmat_usd_is_number(qmat_usd_type type) {
  return type >= QMAT_USD_HALF && type <= QMAT_USD_TIMECODE;
}

bool qmat_usd_is_text(qmat_usd_type type) {
  return type >= QMAT_USD_STRING && type <= QMAT_USD_PATH;
}

const char *qmat_usd_original_of(const qmat_usd_layer *layer) {
  return qmat_usd_text(qmat_usd_entry(qmat_usd_field_value(layer->root, "customLayerData"), "qmat_original"));
}

double qmat_usd_codes_per_second(const qmat_usd_layer *layer) {
  const double frames = qmat_usd_number(qmat_usd_field_value(layer->root, "framesPerSecond"), 24),
               codes = qmat_usd_number(qmat_usd_field_value(layer->root, "timeCodesPerSecond"), frames);
  return codes > 0 && isfinite(codes) ? codes : 24;
}

static bool is_single(const qmat_usd_value *value) {
  return value && !value->is_array && value->count == 1 && value->components == 1;
}

const char *qmat_usd_text(const qmat_usd_value *value) {
  return is_single(value) && qmat_usd_is_text(value->type) ? value->texts[0] : NULL;
}

double qmat_usd_number(const qmat_usd_value *value, double otherwise) {
  if (!is_single(value)) return otherwise;
  if (qmat_usd_is_integer(value->type)) return (double)value->integers[0];
  return qmat_usd_is_number(value->type) ? value->numbers[0] : otherwise;
}

bool qmat_usd_truth(const qmat_usd_value *value, bool otherwise) {
  return qmat_usd_number(value, otherwise ? 1 : 0) != 0;
}

/* ---- numbers ---- */

/* Half precision has 11 significant bits and a least exponent of -14. */
static double round_to_half(double number) {
  if (!isfinite(number) || number == 0) return number;
  int exponent;
  frexp(number, &exponent);
  double step = ldexp(1, exponent - 11 < -24 ? -24 : exponent - 11);
  double rounded = rint(number / step) * step;
  return fabs(rounded) > 65504 ? copysign(INFINITY, number) : rounded;
}

double qmat_usd_round(qmat_usd_type type, double number) {
  if (type == QMAT_USD_FLOAT) return (double)(float)number;
  if (type == QMAT_USD_HALF) return round_to_half((double)(float)number);
  return number;
}
