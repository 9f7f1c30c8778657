/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_ITEM_QUEUE_H
#define QMAT_NODES_INITIAL_ITEM_QUEUE_H

#include "core/arena.h"

/* A queue of numbered items, the smallest key first, a smaller number first where keys are equal. A zeroed queue is
 * empty; the owner frees `items` with qmat_free. Push and pop take logarithmic time. */
typedef struct qmat_queued {
  double key;
  size_t item;
} qmat_queued;

typedef struct qmat_item_queue {
  size_t count, capacity;
  qmat_queued *items;
} qmat_item_queue;

static inline int qmat_queued_before(qmat_queued a, qmat_queued b) {
  return a.key < b.key || (a.key == b.key && a.item < b.item);
}

/* Returns 0, or -1 when memory is short. */
static inline int qmat_queue_push(qmat_item_queue *queue, double key, size_t item) {
  if (qmat_grow((void **)&queue->items, &queue->capacity, queue->count + 1, sizeof *queue->items)) return -1;
  const qmat_queued added = {key, item};
  qmat_queued *items = queue->items;
  size_t i = queue->count++;
  for (; i > 0 && qmat_queued_before(added, items[(i - 1) / 2]); i = (i - 1) / 2) items[i] = items[(i - 1) / 2];
  items[i] = added;
  return 0;
}

/* Takes the first item out of a queue that is not empty. */
static inline qmat_queued qmat_queue_pop(qmat_item_queue *queue) {
  qmat_queued *items = queue->items;
  const qmat_queued first = items[0], last = items[--queue->count];
  size_t i = 0;
  for (size_t child; (child = 2 * i + 1) < queue->count; i = child) {
    if (child + 1 < queue->count && qmat_queued_before(items[child + 1], items[child])) child++;
    if (!qmat_queued_before(items[child], last)) break;
    items[i] = items[child];
  }
  items[i] = last;
  return first;
}

#endif
