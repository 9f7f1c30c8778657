/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SKIN_ID_TABLE_H
#define QMAT_NODES_SKIN_ID_TABLE_H

#include <string.h>

#include "core/context.h"
#include "core/hash.h"

#define QMAT_NO_ID UINT32_MAX
#define QMAT_NO_KEY UINT64_MAX

/* A table from 64-bit keys to ids, with open addressing, at most half full. */
typedef struct qmat_id_table {
  uint64_t *keys; /* QMAT_NO_KEY where free */
  uint32_t *ids;
  uint64_t mask;
} qmat_id_table;

/* Room for `entries` keys. Nonzero when memory is short. Free with qmat_id_table_uninit in any case. */
static inline int qmat_id_table_init(qmat_id_table *table, size_t entries) {
  size_t size = 64;
  while (size < 2 * entries) size *= 2;
  table->mask = size - 1;
  table->keys = qmat_alloc(size, sizeof *table->keys);
  table->ids = qmat_alloc(size, sizeof *table->ids);
  if (!table->keys || !table->ids) return -1;
  memset(table->keys, 0xff, size * sizeof *table->keys);
  return 0;
}

static inline void qmat_id_table_uninit(qmat_id_table *table) {
  qmat_free(table->keys);
  qmat_free(table->ids);
  *table = (qmat_id_table){0};
}

/* The place of the key, or the free place where it belongs. */
static inline size_t qmat_id_table_slot(const qmat_id_table *table, uint64_t key) {
  size_t slot = qmat_hash_mix(key) & table->mask;
  while (table->keys[slot] != key && table->keys[slot] != QMAT_NO_KEY) slot = (slot + 1) & table->mask;
  return slot;
}

static inline uint32_t qmat_id_table_find(const qmat_id_table *table, uint64_t key) {
  size_t slot = qmat_id_table_slot(table, key);
  return table->keys[slot] == key ? table->ids[slot] : QMAT_NO_ID;
}

/* Makes room for `entries` keys in all. */
static inline int qmat_id_table_reserve(qmat_id_table *table, size_t entries) {
  if (2 * entries <= table->mask + 1) return 0;
  qmat_id_table larger;
  if (qmat_id_table_init(&larger, 2 * entries)) {
    qmat_id_table_uninit(&larger);
    return -1;
  }
  for (size_t i = 0; i <= table->mask; i++) {
    if (table->keys[i] == QMAT_NO_KEY) continue;
    size_t slot = qmat_id_table_slot(&larger, table->keys[i]);
    larger.keys[slot] = table->keys[i];
    larger.ids[slot] = table->ids[i];
  }
  qmat_id_table_uninit(table);
  *table = larger;
  return 0;
}

#endif
