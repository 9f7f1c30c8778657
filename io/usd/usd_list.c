/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_list.h"

#include <stdlib.h>
#include <string.h>

void qmat_usd_list_uninit(qmat_usd_list *list) {
  qmat_free(list->items);
  *list = (qmat_usd_list){0};
}

/* The length of the folder in a path. */
static size_t folder_length(const char *path) {
  const char *slash = strrchr(path, '/');
  return slash ? (size_t)(slash - path) + 1 : 0;
}

static int compare_folders(const char *a, const char *b) {
  const size_t length = folder_length(a), other = folder_length(b);
  if (length != other) return length < other ? -1 : 1;
  return length > 0 ? memcmp(a, b, length) : 0;
}

static int compare_texts(const qmat_usd_item *a, const qmat_usd_item *b) {
  return strcmp(a->value, b->value);
}

static int compare_references(const qmat_usd_item *a, const qmat_usd_item *b) {
  const qmat_usd_reference *x = a->value, *y = b->value;
  int order = strcmp(x->asset, y->asset);
  if (order == 0) order = strcmp(x->path, y->path);
  if (order == 0 && x->asset[0]) order = compare_folders(a->layer->path, b->layer->path);
  return order;
}

typedef int compare_items(const qmat_usd_item *a, const qmat_usd_item *b);

/* Orders pointers to items; equal ones as they are in the edit. */
static int compare_places(const void *a, const void *b, compare_items *compare) {
  const qmat_usd_item *x = *(const qmat_usd_item *const *)a, *y = *(const qmat_usd_item *const *)b;
  const int order = compare(x, y);
  return order != 0 ? order : (x > y) - (x < y);
}

static int compare_text_places(const void *a, const void *b) {
  return compare_places(a, b, compare_texts);
}

static int compare_reference_places(const void *a, const void *b) {
  return compare_places(a, b, compare_references);
}

/* The items of an edit, each once. */
typedef struct edited {
  compare_items *compare;
  size_t count;
  const qmat_usd_item **sorted;
  const qmat_usd_item *items; /* of the edit, in its order */
  bool *is_placed;            /* for each of these: it goes into the list */
} edited;

/* Sorts the items of an edit. Of equal ones the first counts, or the last. */
static void sort_items(edited *e, bool has_references, size_t count, bool takes_last) {
  for (size_t i = 0; i < count; i++) e->sorted[i] = &e->items[i];
  if (count > 1)
    qsort(e->sorted, count, sizeof *e->sorted, has_references ? compare_reference_places : compare_text_places);
  e->count = 0;
  for (size_t i = 0; i < count; i++) {
    const bool is_new = i == 0 || e->compare(e->sorted[i], e->sorted[e->count - 1]) != 0;
    if (is_new) e->count++;
    if (is_new || takes_last) e->sorted[e->count - 1] = e->sorted[i];
  }
  for (size_t i = 0; i < e->count; i++) e->is_placed[e->sorted[i] - e->items] = true;
}

/* The item of the edit that equals another item, or NULL. */
static const qmat_usd_item *find_item(const edited *e, const qmat_usd_item *item) {
  size_t low = 0, high = e->count;
  while (low < high) {
    const size_t middle = low + (high - low) / 2;
    const int order = e->compare(e->sorted[middle], item);
    if (order == 0) return e->sorted[middle];
    if (order < 0)
      low = middle + 1;
    else
      high = middle;
  }
  return NULL;
}

/* Removes the items of the edit from the list, or with `stays` leaves them where they are and places them no more. */
static void drop_known(qmat_usd_list *list, const edited *e, bool stays) {
  size_t kept = 0;
  for (size_t i = 0; i < list->count; i++) {
    const qmat_usd_item *known = find_item(e, &list->items[i]);
    if (known && stays) e->is_placed[known - e->items] = false;
    if (!known || stays) list->items[kept++] = list->items[i];
  }
  list->count = kept;
}

/* Inserts the items that are to be placed. */
static void place_items(qmat_usd_list *list, const edited *e, size_t count, bool at_front) {
  size_t placed = 0;
  for (size_t i = 0; i < count; i++) placed += e->is_placed[i];
  size_t at = at_front ? 0 : list->count;
  if (placed > 0 && list->count > at)
    memmove(list->items + at + placed, list->items + at, (list->count - at) * sizeof *list->items);
  for (size_t i = 0; i < count; i++)
    if (e->is_placed[i]) list->items[at++] = e->items[i];
  list->count += placed;
}

bool qmat_usd_list_edit(qmat_usd_list *list, qmat_usd_edit edit, const qmat_usd_item *items, size_t count) {
  if (edit == QMAT_USD_ORDERED || (count == 0 && edit != QMAT_USD_EXPLICIT)) return true;
  if (qmat_grow((void **)&list->items, &list->capacity, list->count + count, sizeof *list->items) != 0) return false;
  if (edit == QMAT_USD_EXPLICIT) {
    if (count > 0) memcpy(list->items, items, count * sizeof *items);
    list->count = count;
    return true;
  }
  edited e = {.compare = list->has_references ? compare_references : compare_texts,
              .sorted = qmat_alloc(count, sizeof *e.sorted),
              .items = items,
              .is_placed = qmat_calloc(count, sizeof *e.is_placed)};
  const bool good = e.sorted && e.is_placed;
  if (good) {
    sort_items(&e, list->has_references, count, edit == QMAT_USD_APPENDED);
    drop_known(list, &e, edit == QMAT_USD_ADDED);
    if (edit != QMAT_USD_DELETED) place_items(list, &e, count, edit == QMAT_USD_PREPENDED);
  }
  qmat_free(e.sorted);
  qmat_free(e.is_placed);
  return good;
}
