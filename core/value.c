/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/value.h"

#include <math.h>
#include <string.h>

#include "core/value_table.h"

qmat_value *qmat_value_new(qmat_value_type type) {
  qmat_value *value = qmat_calloc(1, qmat_value_layouts[type].size);
  if (!value) return NULL;
  value->type = type;
  atomic_init(&value->references, 1);
  for (const qmat_value_row *row = qmat_value_rows(value); row->name; row++) {
    if (row->kind != QMAT_ROW_JSON) continue;
    json_t *root = json_object();
    memcpy((char *)value + row->offset, &root, sizeof root);
    if (root) continue;
    qmat_value_release(value);
    return NULL;
  }
  return value;
}

#define CONSTRUCTOR(NAME, name)                        \
  qmat_##name *qmat_##name##_new(void) {               \
    return (qmat_##name *)qmat_value_new(QMAT_##NAME); \
  }
QMAT_VALUE_TYPES(CONSTRUCTOR)

qmat_list *qmat_list_new(size_t count) {
  qmat_list *list = (qmat_list *)qmat_value_new(QMAT_LIST);
  if (!list) return NULL;
  list->items = qmat_calloc(count, sizeof *list->items);
  list->names = qmat_calloc(count, sizeof *list->names);
  if (list->items && list->names) {
    list->count = count;
    return list;
  }
  qmat_value_release(&list->base);
  return NULL;
}

size_t qmat_value_count(const qmat_value *value) {
  if (!value) return 0;
  return value->type == QMAT_LIST ? ((const qmat_list *)value)->count : 1;
}

const qmat_value *qmat_value_at(const qmat_value *value, size_t index) {
  return value->type == QMAT_LIST ? ((const qmat_list *)value)->items[index] : value;
}

qmat_value_type qmat_value_item_type(const qmat_value *value) {
  size_t index = 0;
  while (index + 1 < qmat_value_count(value) && qmat_value_at(value, index)->type == QMAT_FAILURE) index++;
  return qmat_value_at(value, index)->type;
}

const char *qmat_value_failure(const qmat_value *value) {
  return value->type == QMAT_FAILURE ? ((const qmat_failure *)value)->reason : NULL;
}

qmat_value *qmat_failure_of_error(qmat_context *context) {
  qmat_error error = context->error;
  char reason[2048];
  error.node_id[0] = error.file[0] = '\0';
  qmat_error_format(&error, reason, sizeof reason);
  qmat_repair_utf8(reason);
  qmat_failure *failure = qmat_failure_new();
  if (failure) failure->reason = qmat_strdup(reason);
  if (!failure || !failure->reason) {
    qmat_fail_memory(context, "the reason of a failure");
  } else if (qmat_value_seal(context, &failure->base) == QMAT_OK) {
    return &failure->base;
  }
  if (failure) qmat_value_release(&failure->base);
  return NULL;
}

qmat_value *qmat_value_retain(const qmat_value *value) {
  qmat_value *shared = (qmat_value *)value; /* only the reference count of a sealed value ever changes */
  if (shared) atomic_fetch_add_explicit(&shared->references, 1, memory_order_relaxed);
  return shared;
}

static void free_row(const qmat_value *value, const qmat_value_row *row) {
  void *pointer = qmat_row_pointer(value, row);
  if (!pointer) return;
  if (row->kind == QMAT_ROW_JSON) {
    json_decref(pointer);
    return;
  }
  const size_t count = qmat_row_is_array(row) ? qmat_row_count(value, row) : 0;
  for (size_t i = 0; row->kind == QMAT_ROW_PARTS && i < count; i++) {
    qmat_free(((qmat_file_part *)pointer)[i].name);
    qmat_free(((qmat_file_part *)pointer)[i].bytes);
  }
  for (size_t i = 0; row->kind == QMAT_ROW_ITEMS && i < count; i++) qmat_value_release(((qmat_value **)pointer)[i]);
  for (size_t i = 0; row->kind == QMAT_ROW_NAMES && i < count; i++) qmat_free(((char **)pointer)[i]);
  qmat_free(pointer);
}

static void free_kept(qmat_value *value) {
  for (int i = 0; i < 2; i++) {
    qmat_kept *kept = atomic_load(&value->kept[i]);
    if (kept) kept->free(kept);
  }
}

void qmat_value_release(qmat_value *value) {
  if (!value || atomic_fetch_sub_explicit(&value->references, 1, memory_order_acq_rel) != 1) return;
  free_kept(value);
  for (const qmat_value_row *row = qmat_value_rows(value); row->name; row++) {
    if (qmat_row_has_pointer(row)) free_row(value, row);
  }
  qmat_free(value);
}

const char *qmat_value_type_name(qmat_value_type type) {
  return (unsigned)type < QMAT_VALUE_TYPE_COUNT ? qmat_value_layouts[type].name : "unknown";
}

const char *qmat_value_type_phrase(qmat_value_type type) {
#define QMAT_PHRASE(NAME, name) [QMAT_##NAME] = "a " #name,
  static const char *const phrases[QMAT_VALUE_TYPE_COUNT] = {QMAT_VALUE_TYPES(QMAT_PHRASE)[QMAT_LIST] = "a list"};
#undef QMAT_PHRASE
  if (type == QMAT_MEDIAL) return "a medial mesh";
  if (type == QMAT_SAMPLES) return "a set of samples";
  if (type == QMAT_COLLIDERS) return "a set of colliders";
  return (unsigned)type < QMAT_VALUE_TYPE_COUNT ? phrases[type] : "unknown";
}

bool qmat_value_array_at(const qmat_value *value, size_t index, qmat_value_array *array) {
  for (const qmat_value_row *row = qmat_value_rows(value); row->name; row++) {
    const bool is_ids = row->kind == QMAT_ROW_U32;
    if ((!is_ids && row->kind != QMAT_ROW_F64) || index-- > 0) continue;
    const void *data = qmat_row_pointer(value, row);
    *array = (qmat_value_array){row->name, qmat_row_count(value, row), row->components, is_ids ? NULL : data,
                                is_ids ? data : NULL};
    return true;
  }
  return false;
}

const qmat_value_count_row *qmat_value_count_rows(qmat_value_type type) {
  return qmat_value_layouts[type].counts;
}

void qmat_value_counts(const qmat_value *value, size_t counts[QMAT_MOST_COUNTS]) {
  memset(counts, 0, QMAT_MOST_COUNTS * sizeof *counts);
  for (size_t i = 0; i < qmat_value_count(value); i++) {
    const qmat_value *item = qmat_value_at(value, i);
    const qmat_value_count_row *rows = qmat_value_count_rows(item->type);
    for (size_t k = 0; rows[k].name; k++) counts[k] += *(const size_t *)((const char *)item + rows[k].offset);
  }
}

double qmat_mesh_diagonal(const qmat_mesh *mesh) {
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t i = 0; i < 3 * mesh->triangle_count; i++) {
    const double *vertex = mesh->positions + 3 * (size_t)mesh->triangles[i];
    for (size_t k = 0; k < 3; k++) {
      low[k] = fmin(low[k], vertex[k]);
      high[k] = fmax(high[k], vertex[k]);
    }
  }
  return mesh->triangle_count > 0 ? hypot(hypot(high[0] - low[0], high[1] - low[1]), high[2] - low[2]) : 0;
}
