/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_KEY_TABLE_H
#define QMAT_CORE_KEY_TABLE_H

#include <string.h>

#include "core/arena.h"
#include "core/hash.h"

/* A hash table from 64-bit keys to an id, a number or a pointer: open addressing with linear probing, at most half
 * full. Its users look keys up and never walk it, so results do not depend on the order of its slots. Any number of
 * threads may look keys up while none adds one. */

#define QMAT_NO_ID UINT32_MAX
#define QMAT_NO_KEY UINT64_MAX /* no key may be this */

typedef struct qmat_key_slot {
  uint64_t key; /* QMAT_NO_KEY: the slot is free */
  union {
    uint32_t id;
    double number;
    void *pointer;
  };
} qmat_key_slot;

typedef struct qmat_key_table {
  qmat_key_slot *slots;
  size_t mask, count; /* the number of slots, a power of two, less one; the number of keys */
} qmat_key_table;

/* Makes room for `entries` keys. Nonzero when memory is short. Free with qmat_key_table_uninit, also after a failure.
 */
static inline int qmat_key_table_init(qmat_key_table *table, size_t entries) {
  size_t size = 64;
  while (size < 2 * entries) size *= 2;
  *table = (qmat_key_table){.slots = (qmat_key_slot *)qmat_alloc(size, sizeof *table->slots), .mask = size - 1};
  if (table->slots) memset(table->slots, 0xff, size * sizeof *table->slots);
  return table->slots ? 0 : -1;
}

static inline void qmat_key_table_uninit(qmat_key_table *table) {
  qmat_free(table->slots);
  *table = (qmat_key_table){0};
}

/* The slot that has the key, or the free slot where it belongs. */
static inline qmat_key_slot *qmat_key_table_find(const qmat_key_table *table, uint64_t key) {
  size_t slot = (size_t)qmat_hash_mix(key) & table->mask;
  while (table->slots[slot].key != key && table->slots[slot].key != QMAT_NO_KEY) slot = (slot + 1) & table->mask;
  return &table->slots[slot];
}

/* The id of a key, or QMAT_NO_ID. */
static inline uint32_t qmat_key_table_id(const qmat_key_table *table, uint64_t key) {
  const qmat_key_slot *slot = qmat_key_table_find(table, key);
  return slot->key == key ? slot->id : QMAT_NO_ID;
}

/* The slot of a key that is not in the table yet; the caller sets its value. NULL when memory is short. Slots
 * move when a key is added. */
static inline qmat_key_slot *qmat_key_table_add(qmat_key_table *table, uint64_t key) {
  if (2 * (table->count + 1) > table->mask + 1) {
    qmat_key_table larger;
    if (qmat_key_table_init(&larger, table->mask + 1)) return NULL;
    for (size_t i = 0; i <= table->mask; i++) {
      if (table->slots[i].key != QMAT_NO_KEY) *qmat_key_table_find(&larger, table->slots[i].key) = table->slots[i];
    }
    larger.count = table->count;
    qmat_key_table_uninit(table);
    *table = larger;
  }
  qmat_key_slot *slot = qmat_key_table_find(table, key);
  slot->key = key;
  table->count++;
  return slot;
}

#endif
