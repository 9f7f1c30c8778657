/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_instancer.h"

#include <stdlib.h>
#include <string.h>

typedef struct arrays {
  const qmat_usd_value *indices, *positions, *orientations, *scales, *ids;
} arrays;

/* Reads an array of `components`, one element for each of `count` instances (SIZE_MAX: any number); NULL without it. */
static qmat_status read_array(const qmat_usd_prim *prim, const char *name, bool numbers, unsigned components,
                              size_t count, const qmat_usd_value **value) {
  const qmat_status status = qmat_usd_prim_attribute(prim, name, value);
  if (status != QMAT_OK || !*value) return status;
  const qmat_usd_value *v = *value;
  const bool good = v->is_array && v->components == components &&
                    (numbers ? qmat_usd_is_number(v->type) : qmat_usd_is_integer(v->type));
  if (!good) return qmat_usd_prim_fail(prim, "%s has a value of the wrong type", name);
  if (v->count == 0 && strcmp(name, "protoIndices") != 0) *value = NULL;
  if (!*value || count == SIZE_MAX || v->count == count) return QMAT_OK;
  return qmat_usd_prim_fail(prim, "%s has %zu elements for %zu instances", name, v->count, count);
}

static qmat_status read_arrays(const qmat_usd_prim *prim, arrays *a) {
  *a = (arrays){0};
  qmat_status status = read_array(prim, "protoIndices", false, 1, SIZE_MAX, &a->indices);
  if (status != QMAT_OK || !a->indices) return status;
  const size_t count = a->indices->count;
  status = read_array(prim, "positions", true, 3, count, &a->positions);
  if (status == QMAT_OK) status = read_array(prim, "orientationsf", true, 4, count, &a->orientations);
  if (status == QMAT_OK && !a->orientations)
    status = read_array(prim, "orientations", true, 4, count, &a->orientations);
  if (status == QMAT_OK) status = read_array(prim, "scales", true, 3, count, &a->scales);
  if (status == QMAT_OK) status = read_array(prim, "ids", false, 1, count, &a->ids);
  return status;
}

typedef struct id_list {
  size_t count, capacity;
  int64_t *ids;
} id_list;

static int compare_ids(const void *a, const void *b) {
  const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
  return x < y ? -1 : x > y;
}

/* Adds integers to the ids, or takes them out. */
static bool edit_ids(id_list *list, const qmat_usd_value *by, bool adds) {
  if (by->count == 0 || !by->is_array || !qmat_usd_is_integer(by->type)) return true;
  if (adds) {
    if (qmat_grow((void **)&list->ids, &list->capacity, list->count + by->count, sizeof *list->ids) != 0) return false;
    for (size_t i = 0; i < by->count; i++) list->ids[list->count++] = by->integers[i];
    return true;
  }
  int64_t *gone = qmat_alloc(by->count, sizeof *gone);
  if (!gone) return false;
  memcpy(gone, by->integers, by->count * sizeof *gone);
  qsort(gone, by->count, sizeof *gone, compare_ids);
  size_t kept = 0;
  for (size_t i = 0; i < list->count; i++)
    if (!bsearch(&list->ids[i], gone, by->count, sizeof *gone, compare_ids)) list->ids[kept++] = list->ids[i];
  list->count = kept;
  qmat_free(gone);
  return true;
}

/* The sorted ids of the instances that are left out: inactiveIds, whose opinions edit the weaker ones, and
 * invisibleIds. The caller frees them. */
static qmat_status read_masked(const qmat_usd_prim *prim, id_list *masked) {
  const qmat_usd_value *invisible;
  const qmat_status status = read_array(prim, "invisibleIds", false, 1, SIZE_MAX, &invisible);
  if (status != QMAT_OK) return status;
  bool done = true;
  for (size_t i = prim->opinion_count; i-- > 0 && done;) {
    const qmat_usd_value *value = qmat_usd_field_value(prim->opinions[i].spec, "inactiveIds");
    const qmat_usd_list_op *op = value && value->type == QMAT_USD_LIST_OP ? value->list_op : NULL;
    if (value && (!op || op->is_explicit)) masked->count = 0;
    if (value && !op) done = edit_ids(masked, value, true);
    if (op && done) done = edit_ids(masked, &op->lists[QMAT_USD_DELETED], false);
    for (int edit = 0; op && edit < QMAT_USD_EDIT_COUNT && done; edit++)
      if (edit != QMAT_USD_ORDERED && edit != QMAT_USD_DELETED) done = edit_ids(masked, &op->lists[edit], true);
  }
  done = done && (!invisible || edit_ids(masked, invisible, true));
  if (masked->count > 0) qsort(masked->ids, masked->count, sizeof *masked->ids, compare_ids);
  return done ? QMAT_OK : qmat_usd_fail_prim_memory(prim);
}

/* Scale, then orientation, then position. */
static qmat_usd_transform place(const arrays *a, size_t i) {
  qmat_usd_transform result = qmat_usd_identity();
  for (size_t k = 0; k < 3 && a->scales; k++) result.m[5 * k] = a->scales->numbers[3 * i + k];
  if (a->orientations) {
    const qmat_usd_transform turn = qmat_usd_orientation(a->orientations->numbers + 4 * i);
    result = qmat_usd_product(&result, &turn);
  }
  for (size_t k = 0; k < 3 && a->positions; k++) result.m[12 + k] = a->positions->numbers[3 * i + k];
  return result;
}

/* The prototype of an instance; UINT32_MAX: the instance is left out. */
static uint32_t prototype_of(const arrays *a, const id_list *masked, size_t i) {
  const int64_t id = a->ids ? a->ids->integers[i] : (int64_t)i;
  const bool is_masked = masked->count > 0 && bsearch(&id, masked->ids, masked->count, sizeof id, compare_ids);
  return is_masked ? UINT32_MAX : (uint32_t)a->indices->integers[i];
}

/* Sorts the instances by their prototypes, those of one in the order of the file. */
static qmat_status read_instances(const qmat_usd_prim *prim, qmat_arena *arena, const id_list *masked,
                                  qmat_usd_instancer *instancer) {
  const size_t prototypes = instancer->prototype_count;
  arrays a;
  qmat_status status = read_arrays(prim, &a);
  if (status != QMAT_OK || !a.indices) {
    instancer->prototype_count = 0;
    return status;
  }
  instancer->ends = qmat_arena_calloc(arena, prototypes + 1, sizeof *instancer->ends);
  instancer->placements = qmat_arena_alloc(arena, a.indices->count, sizeof *instancer->placements);
  if (!instancer->ends || !instancer->placements) return qmat_usd_fail_prim_memory(prim);
  for (size_t i = 0; i < a.indices->count; i++) {
    const int64_t of = a.indices->integers[i];
    if (of < 0 || (uint64_t)of >= prototypes)
      return qmat_usd_prim_fail(prim, "instance %zu has prototype %lld, but there are %zu", i, (long long)of,
                                prototypes);
    const uint32_t prototype = prototype_of(&a, masked, i);
    if (prototype != UINT32_MAX) instancer->ends[prototype + 1]++;
  }
  for (size_t k = 1; k <= prototypes; k++) instancer->ends[k] += instancer->ends[k - 1];
  instancer->instance_count = instancer->ends[prototypes];
  for (size_t i = 0; i < a.indices->count; i++) {
    const uint32_t prototype = prototype_of(&a, masked, i);
    if (prototype != UINT32_MAX) instancer->placements[instancer->ends[prototype]++] = place(&a, i);
  }
  return QMAT_OK;
}

qmat_status qmat_usd_instancer_read(const qmat_usd_prim *prim, qmat_arena *arena, qmat_usd_instancer *instancer) {
  id_list masked = {0};
  *instancer = (qmat_usd_instancer){0};
  qmat_status status =
      qmat_usd_prim_targets(prim, "prototypes", arena, &instancer->prototypes, &instancer->prototype_count);
  if (status == QMAT_OK) status = read_masked(prim, &masked);
  if (status == QMAT_OK) status = read_instances(prim, arena, &masked, instancer);
  qmat_free(masked.ids);
  return status;
}
