/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_TESTS_IO_USD_USD_LAYERS_H
#define QMAT_TESTS_IO_USD_USD_LAYERS_H

/* Reading and comparing layers of USD. */

#include "io/usd/usda.h"
#include "io/usd/usdc.h"
#include "tests/io/files.h"

static inline qmat_status read_layer_text(qmat_context *context, const char *text, qmat_usd_layer *layer) {
  qmat_bytes bytes = memory_file(text, strlen(text));
  qmat_status status = qmat_usda_read(context, &bytes, "file", layer);
  free(bytes.data);
  return status;
}

/* Reads text or a crate. */
static inline qmat_status read_layer(qmat_context *context, const qmat_bytes *bytes, const char *path,
                                     qmat_usd_layer *layer) {
  return qmat_usdc_is_crate(bytes) ? qmat_usdc_read(context, bytes, path, layer)
                                   : qmat_usda_read(context, bytes, path, layer);
}

/* The layer of a text that must be good. */
static inline qmat_usd_layer good_layer(const char *text) {
  qmat_context context = {0};
  qmat_usd_layer layer = {0};
  if (read_layer_text(&context, text, &layer) != QMAT_OK) {
    char line[1024];
    qmat_error_format(&context.error, line, sizeof line);
    fail_msg("%s", line);
  }
  qmat_context_uninit(&context);
  return layer;
}

/* The spec at a path like "/World/mesh.points"; variants are not reached. */
static inline const qmat_usd_spec *spec_at(const qmat_usd_layer *layer, const char *path) {
  const qmat_usd_spec *spec = layer->root;
  char name[256];
  while (*path && spec) {
    bool property = *path++ == '.';
    size_t length = strcspn(path, property ? "" : "/.");
    assert_true(length < sizeof name);
    memcpy(name, path, length);
    name[length] = '\0';
    path += length;
    const qmat_usd_spec *parent = spec;
    spec = qmat_usd_child(layer, parent, property ? QMAT_USD_ATTRIBUTE : QMAT_USD_PRIM, name);
    if (!spec && property) spec = qmat_usd_child(layer, parent, QMAT_USD_RELATIONSHIP, name);
  }
  return spec;
}

static inline const qmat_usd_value *value_at(const qmat_usd_layer *layer, const char *path, const char *field) {
  const qmat_usd_spec *spec = spec_at(layer, path);
  if (!spec) fail_msg("there is no %s", path);
  const qmat_usd_value *value = qmat_usd_field_value(spec, field);
  if (!value) fail_msg("%s has no %s", path, field);
  return value;
}

static inline double component_of(const qmat_usd_value *value, size_t i) {
  return qmat_usd_is_integer(value->type) ? (double)value->integers[i] : value->numbers[i];
}

static inline bool equal_values(const qmat_usd_value *a, const qmat_usd_value *b);

static inline bool equal_references(const qmat_usd_reference *a, const qmat_usd_reference *b) {
  return strcmp(a->asset, b->asset) == 0 && strcmp(a->path, b->path) == 0 && a->offset == b->offset &&
         a->scale == b->scale;
}

/* Whether both say the same; metadata in text has no types, so that numbers are compared with numbers and texts with
 * texts. */
static inline bool equal_values(const qmat_usd_value *a, const qmat_usd_value *b) {
  if (a->count != b->count || a->is_array != b->is_array) return false;
  if (a->count == 0) return true;
  const bool numbers = qmat_usd_is_integer(a->type) || qmat_usd_is_number(a->type);
  if (numbers) {
    if (!qmat_usd_is_integer(b->type) && !qmat_usd_is_number(b->type)) return false;
    if (a->components != b->components) return false;
    for (size_t i = 0; i < a->count * a->components; i++) {
      double x = component_of(a, i), y = component_of(b, i);
      if (x != y && !(isnan(x) && isnan(y))) return false;
    }
    return true;
  }
  if (qmat_usd_is_text(a->type)) {
    if (!qmat_usd_is_text(b->type)) return false;
    for (size_t i = 0; i < a->count; i++) {
      if (strcmp(a->texts[i], b->texts[i]) != 0) return false;
    }
    return true;
  }
  if (a->type != b->type) return false;
  switch (a->type) {
    case QMAT_USD_REFERENCE:
      for (size_t i = 0; i < a->count; i++) {
        if (!equal_references(&a->references[i], &b->references[i])) return false;
      }
      return true;
    case QMAT_USD_DICTIONARY:
      for (size_t i = 0; i < a->count; i++) {
        const qmat_usd_value *other = qmat_usd_entry(b, a->entries[i].name);
        if (!other || !equal_values(a->entries[i].value, other)) return false;
      }
      return true;
    case QMAT_USD_LIST_OP:
      if (a->list_op->is_explicit != b->list_op->is_explicit) return false;
      for (int i = 0; i < QMAT_USD_EDIT_COUNT; i++) {
        if (!equal_values(&a->list_op->lists[i], &b->list_op->lists[i])) return false;
      }
      return true;
    case QMAT_USD_TIME_SAMPLES:
      if (a->samples->count != b->samples->count) return false;
      for (size_t i = 0; i < a->samples->count; i++) {
        if (a->samples->times[i] != b->samples->times[i]) return false;
        if (!equal_values(a->samples->values[i], b->samples->values[i])) return false;
      }
      return true;
    case QMAT_USD_BLOCK:
      return true;
    default:
      return false;
  }
}

/* Fields that may be left out where they say what holds anyway. */
static inline bool says_nothing(const qmat_usd_field *field) {
  if (strcmp(field->name, "custom") == 0) return !qmat_usd_truth(field->value, false);
  if (strcmp(field->name, "variability") == 0) return strcmp(qmat_usd_text(field->value), "varying") == 0;
  return false;
}

static inline size_t count_fields(const qmat_usd_spec *spec) {
  size_t count = 0;
  for (size_t i = 0; i < spec->field_count; i++) count += !says_nothing(&spec->fields[i]);
  return count;
}

static inline size_t count_children(const qmat_usd_spec *spec) {
  size_t count = 0;
  for (const qmat_usd_spec *child = spec->first_child; child; child = child->next) count++;
  return count;
}

/* Compares two specs and all below them, children by name; returns how many values were compared. The names of those
 * that differ, as "spec.field ", are added to `differences` of 1024 bytes. */
static inline size_t compare_specs(const qmat_usd_layer *a_layer, const qmat_usd_spec *a, const qmat_usd_layer *b_layer,
                                   const qmat_usd_spec *b, char *differences) {
  size_t compared = 0;
  for (size_t i = 0; i < a->field_count; i++) {
    if (says_nothing(&a->fields[i])) continue;
    const qmat_usd_value *other = qmat_usd_field_value(b, a->fields[i].name);
    if (!other) fail_msg("%s of %s is in one file only", a->fields[i].name, a->name);
    if (!equal_values(a->fields[i].value, other)) {
      size_t used = strlen(differences);
      snprintf(differences + used, 1024 - used, "%s.%s ", a->name, a->fields[i].name);
    }
    compared++;
  }
  if (count_fields(a) != count_fields(b)) {
    fail_msg("%s has %zu and %zu fields", a->name, count_fields(a), count_fields(b));
  }
  assert_int_equal(count_children(a), count_children(b));
  for (const qmat_usd_spec *child = a->first_child; child; child = child->next) {
    const qmat_usd_spec *other = qmat_usd_child(b_layer, b, child->kind, child->name);
    if (!other) fail_msg("%s below %s is in one file only", child->name, a->name);
    compared += compare_specs(a_layer, child, b_layer, other, differences);
  }
  return compared;
}

#endif
