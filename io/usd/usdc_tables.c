/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usdc_tables.h"

#include <string.h>

#include "io/usd/usdc_pack.h"

enum { CONTENTS_OFFSET_AT = 16, SECTION_BYTES = 32, MOST_SECTIONS = 64 };

static qmat_status fail(const qmat_usdc *c, const char *what) {
  return qmat_usd_layer_fail(c->layer, what);
}

qmat_status qmat_usdc_fail_short(const qmat_usdc *c) {
  return fail(c, "a value or table does not fit into the file");
}

/* ---- reading ---- */

/* Finds a table and takes its count of rows. */
static qmat_status open_table(const qmat_usdc *c, const char *name, qmat_byte_reader *table, uint64_t *count) {
  qmat_byte_reader reader = {.bytes = c->bytes, .size = c->size, .at = CONTENTS_OFFSET_AT};
  const uint64_t contents = qmat_take_u64(&reader);
  if (contents >= c->size) return qmat_usdc_fail_short(c);
  reader.at = (size_t)contents;
  const uint64_t sections = qmat_take_u64(&reader);
  if (reader.failed || sections > MOST_SECTIONS || qmat_bytes_left(&reader) / SECTION_BYTES < sections)
    return qmat_usdc_fail_short(c);
  for (uint64_t i = 0; i < sections; i++) {
    const uint8_t *title = qmat_take_bytes(&reader, 16);
    const uint64_t start = qmat_take_u64(&reader), size = qmat_take_u64(&reader);
    if (!title || strncmp((const char *)title, name, 16) != 0) continue;
    if (start > c->size || size > c->size - start) return qmat_usdc_fail_short(c);
    *table = (qmat_byte_reader){.bytes = c->bytes + start, .size = (size_t)size};
    *count = qmat_take_u64(table);
    return table->failed ? qmat_usdc_fail_short(c) : QMAT_OK;
  }
  return qmat_fail_file(c->layer->context, QMAT_ERROR_FORMAT, c->layer->path, "the file has no table %s", name);
}

/* Takes packed indices into the scratch memory. */
static qmat_status take_indices(qmat_usdc *c, qmat_byte_reader *table, size_t count, uint32_t **indices) {
  /* Each index takes at least two bits. */
  if (count / 4 > qmat_usdc_largest_unpacked(qmat_bytes_left(table)) || count > c->layer->allowance / sizeof(int64_t))
    return fail(c, "a table is longer than the file justifies");
  int64_t *wide = qmat_alloc(count, sizeof *wide);
  *indices = qmat_arena_alloc(&c->scratch, count, sizeof **indices);
  qmat_status status = wide && *indices ? qmat_usdc_take_integers(c->layer, table, count, 4, wide)
                                        : qmat_usd_layer_fail_memory(c->layer);
  for (size_t i = 0; i < count && status == QMAT_OK; i++) (*indices)[i] = (uint32_t)wide[i];
  qmat_free(wide);
  return status;
}

static qmat_status read_tokens(qmat_usdc *c) {
  qmat_byte_reader table;
  uint64_t count;
  qmat_status status = open_table(c, "TOKENS", &table, &count);
  if (status != QMAT_OK) return status;
  const uint64_t size = qmat_take_u64(&table), packed_size = qmat_take_u64(&table);
  const uint8_t *packed = qmat_take_bytes(&table, packed_size);
  if (!packed || size > qmat_usdc_largest_unpacked(packed_size) || count > size) return qmat_usdc_fail_short(c);
  char *text = qmat_usd_alloc(c->layer, size + 1, 1); /* ends in a zero, whatever the file says */
  const char **tokens = text ? qmat_usd_alloc(c->layer, count, sizeof *tokens) : NULL;
  if (!tokens) return qmat_usd_layer_error(c->layer);
  size_t made;
  status = qmat_usdc_unpack(c->layer, packed, packed_size, text, size, &made);
  if (status != QMAT_OK) return status;
  const char *at = text, *end = text + made;
  for (uint64_t i = 0; i < count; i++) {
    if (at >= end) return fail(c, "the table TOKENS has fewer tokens than its count");
    tokens[i] = at;
    at += strlen(at) + 1;
  }
  c->tokens = tokens;
  c->token_count = count;
  return QMAT_OK;
}

static qmat_status read_strings(qmat_usdc *c) {
  qmat_byte_reader table;
  uint64_t count;
  qmat_status status = open_table(c, "STRINGS", &table, &count);
  if (status != QMAT_OK) return status;
  if (qmat_bytes_left(&table) / 4 < count) return qmat_usdc_fail_short(c);
  c->strings = qmat_arena_alloc(&c->scratch, count, sizeof *c->strings);
  if (!c->strings) return qmat_usd_layer_fail_memory(c->layer);
  for (uint64_t i = 0; i < count; i++) {
    c->strings[i] = qmat_take_u32(&table);
    if (c->strings[i] >= c->token_count) return fail(c, "a string refers to a missing token");
  }
  c->string_count = count;
  return QMAT_OK;
}

static qmat_status read_fields(qmat_usdc *c) {
  qmat_byte_reader table;
  uint64_t count;
  qmat_status status = open_table(c, "FIELDS", &table, &count);
  if (status == QMAT_OK) status = take_indices(c, &table, count, &c->field_names);
  if (status != QMAT_OK) return status;
  const uint64_t packed_size = qmat_take_u64(&table);
  const uint8_t *packed = qmat_take_bytes(&table, packed_size);
  if (!packed || count > qmat_usdc_largest_unpacked(packed_size) / 8) return qmat_usdc_fail_short(c);
  c->field_reps = qmat_arena_alloc(&c->scratch, count, sizeof *c->field_reps);
  if (!c->field_reps) return qmat_usd_layer_fail_memory(c->layer);
  size_t made;
  status = qmat_usdc_unpack(c->layer, packed, packed_size, c->field_reps, count * 8, &made);
  if (status != QMAT_OK) return status;
  if (made != count * 8) return qmat_usdc_fail_short(c);
  qmat_byte_reader reps = {.bytes = (const uint8_t *)c->field_reps, .size = made};
  for (uint64_t i = 0; i < count; i++) {
    c->field_reps[i] = qmat_take_u64(&reps); /* in place: from little-endian to native order */
    if (c->field_names[i] >= c->token_count) return fail(c, "a field refers to a missing token");
  }
  c->field_count = count;
  return QMAT_OK;
}

static qmat_status read_field_sets(qmat_usdc *c) {
  qmat_byte_reader table;
  uint64_t count;
  qmat_status status = open_table(c, "FIELDSETS", &table, &count);
  if (status == QMAT_OK) status = take_indices(c, &table, count, &c->field_sets);
  if (status != QMAT_OK) return status;
  for (uint64_t i = 0; i < count; i++) {
    if (c->field_sets[i] != QMAT_USDC_NONE && c->field_sets[i] >= c->field_count)
      return fail(c, "a set of fields refers to a missing field");
  }
  if (count == 0 || c->field_sets[count - 1] != QMAT_USDC_NONE) return fail(c, "the last set of fields has no end");
  c->field_set_length = count;
  return QMAT_OK;
}

/* Rows are in depth-first order. The jump of a row says which rows follow it: > 0 the next one is its child, and its
 * sibling is so many rows on; 0 the next one is its sibling; -1 its child; -2 neither. */
static qmat_status build_paths(qmat_usdc *c, size_t count, const uint32_t *indices, const uint32_t *elements,
                               const uint32_t *jumps) {
  typedef struct pending {
    uint32_t at, parent;
  } pending;
  pending *stack = qmat_arena_alloc(&c->scratch, count + 1, sizeof *stack);
  bool *seen = qmat_arena_calloc(&c->scratch, count, sizeof *seen);
  c->path_order = qmat_arena_alloc(&c->scratch, count, sizeof *c->path_order);
  if (!stack || !seen || !c->path_order) return qmat_usd_layer_fail_memory(c->layer);
  size_t waiting = 0;
  if (count > 0) stack[waiting++] = (pending){0, QMAT_USDC_NONE};
  while (waiting > 0) {
    const pending now = stack[--waiting];
    const bool is_root = now.parent == QMAT_USDC_NONE;
    if (now.at >= count || seen[now.at]) return fail(c, "the table PATHS is not a tree");
    seen[now.at] = true;
    const uint32_t path = indices[now.at];
    const int32_t element = (int32_t)elements[now.at], jump = (int32_t)jumps[now.at];
    const int64_t token = element < 0 ? -(int64_t)element : element;
    if (path >= c->path_count || c->paths[path].element) return fail(c, "the table PATHS is not a tree");
    if (token >= (int64_t)c->token_count && !is_root) return fail(c, "a path refers to a missing token");
    const char *name = is_root ? "" : c->tokens[token];
    c->paths[path] = (qmat_usdc_path){
        .parent = now.parent,
        .element = name,
        .is_property = element < 0,
        .is_below_target = name[0] == '[' || (!is_root && c->paths[now.parent].is_below_target),
    };
    c->path_order[c->path_order_count++] = path;
    if (jump < -2 || (jump >= 0 && is_root)) return fail(c, "the table PATHS is not a tree");
    /* A row adds at most two others, and at most `count` rows can be seen. */
    if (jump >= 0) stack[waiting++] = (pending){now.at + (jump > 0 ? (uint32_t)jump : 1), now.parent};
    if (jump > 0 || jump == -1) {
      if (waiting > count) return fail(c, "the table PATHS is not a tree");
      stack[waiting++] = (pending){now.at + 1, path};
    }
  }
  return QMAT_OK;
}

static qmat_status read_paths(qmat_usdc *c) {
  qmat_byte_reader table;
  uint64_t count;
  qmat_status status = open_table(c, "PATHS", &table, &count);
  if (status != QMAT_OK) return status;
  const uint64_t encoded = qmat_take_u64(&table);
  /* The empty path is counted, but is not in the tree. */
  if (table.failed || encoded > count || count - encoded > 1) return qmat_usdc_fail_short(c);
  uint32_t *indices, *elements, *jumps;
  status = take_indices(c, &table, encoded, &indices);
  if (status == QMAT_OK) status = take_indices(c, &table, encoded, &elements);
  if (status == QMAT_OK) status = take_indices(c, &table, encoded, &jumps);
  if (status != QMAT_OK) return status;
  c->paths = qmat_arena_calloc(&c->scratch, count, sizeof *c->paths);
  if (!c->paths) return qmat_usd_layer_fail_memory(c->layer);
  c->path_count = count;
  for (size_t i = 0; i < c->path_count; i++) c->paths[i].parent = QMAT_USDC_NONE;
  return build_paths(c, encoded, indices, elements, jumps);
}

static qmat_status read_specs(qmat_usdc *c) {
  qmat_byte_reader table;
  uint64_t count;
  uint32_t *paths, *sets, *types;
  qmat_status status = open_table(c, "SPECS", &table, &count);
  if (status == QMAT_OK) status = take_indices(c, &table, count, &paths);
  if (status == QMAT_OK) status = take_indices(c, &table, count, &sets);
  if (status == QMAT_OK) status = take_indices(c, &table, count, &types);
  if (status != QMAT_OK) return status;
  c->specs = qmat_arena_alloc(&c->scratch, count, sizeof *c->specs);
  if (!c->specs) return qmat_usd_layer_fail_memory(c->layer);
  for (uint64_t i = 0; i < count; i++) {
    c->specs[i] = (qmat_usdc_spec){.path = paths[i], .set = sets[i], .type = types[i]};
    if (paths[i] >= c->path_count) return fail(c, "a spec refers to a missing path");
    if (sets[i] >= c->field_set_length) return fail(c, "a spec refers to a missing set of fields");
  }
  c->spec_count = count;
  return QMAT_OK;
}

qmat_status qmat_usdc_read_tables(qmat_usdc *c) {
  qmat_status status = read_tokens(c);
  if (status == QMAT_OK) status = read_strings(c);
  if (status == QMAT_OK) status = read_fields(c);
  if (status == QMAT_OK) status = read_field_sets(c);
  if (status == QMAT_OK) status = read_paths(c);
  return status == QMAT_OK ? read_specs(c) : status;
}

/* ---- look-ups ---- */

const char *qmat_usdc_token(const qmat_usdc *c, uint32_t index) {
  return index < c->token_count ? c->tokens[index] : NULL;
}

const char *qmat_usdc_string(const qmat_usdc *c, uint32_t index) {
  return index < c->string_count ? c->tokens[c->strings[index]] : NULL;
}

/* What separates a path from its parent. */
static const char *separator(const qmat_usdc *c, const qmat_usdc_path *path) {
  const char *element = path->element;
  if (path->is_property) return ".";
  if (element[0] == '{' || element[0] == '[' || element[0] == '.') return "";
  return c->paths[path->parent].element[0] == '{' ? "" : "/";
}

const char *qmat_usdc_path_text(const qmat_usdc *c, uint32_t index) {
  if (index >= c->path_count || !c->paths[index].element) return "";
  qmat_usdc_path *path = &c->paths[index];
  if (path->text) return path->text;
  if (path->parent == QMAT_USDC_NONE) return path->text = "/";
  size_t length = 0;
  for (const qmat_usdc_path *p = path; p->parent != QMAT_USDC_NONE; p = &c->paths[p->parent])
    length += strlen(p->element) + strlen(separator(c, p));
  char *text = qmat_usd_alloc(c->layer, length + 1, 1);
  if (!text) return NULL;
  char *at = text + length;
  for (const qmat_usdc_path *p = path; p->parent != QMAT_USDC_NONE; p = &c->paths[p->parent]) {
    const char *parts[2] = {p->element, separator(c, p)};
    for (int i = 0; i < 2; i++) {
      at -= strlen(parts[i]);
      memcpy(at, parts[i], strlen(parts[i]));
    }
  }
  return path->text = text;
}
