/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_LIST_H
#define QMAT_IO_USD_USD_LIST_H

#include "io/usd/usd_layer.h"

/* Lists that the opinions of several layers edit: of references, of paths, of names. */

/* A text, or a qmat_usd_reference, which the layer owns. */
typedef struct qmat_usd_item {
  const void *value;
  const qmat_usd_layer *layer; /* of a reference: whose asset is relative to the layer's folder; else unused */
} qmat_usd_item;

/* A zeroed list is empty. Free it with qmat_usd_list_uninit. */
typedef struct qmat_usd_list {
  bool has_references; /* else texts */
  size_t count, capacity;
  qmat_usd_item *items;
} qmat_usd_list;

void qmat_usd_list_uninit(qmat_usd_list *list);

/* Applies one edit of `count` items (NULL for none). QMAT_USD_EXPLICIT replaces the list, and keeps what is repeated.
 * QMAT_USD_DELETED removes the items. QMAT_USD_ADDED adds at the end those that the list does not have.
 * QMAT_USD_PREPENDED and QMAT_USD_APPENDED move them to the front and to the end; of an item that the edit repeats, the
 * first and the last counts. QMAT_USD_ORDERED does nothing. Equal texts are one item, and references to the same prim
 * of the same file. False when memory is short; the list is then as before. Cost: n log n for n items of both. */
bool qmat_usd_list_edit(qmat_usd_list *list, qmat_usd_edit edit, const qmat_usd_item *items, size_t count);

#endif
