/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_ARENA_H
#define QMAT_CORE_ARENA_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Scratch memory that is freed all at once. A zeroed arena is empty and valid. Not thread-safe. */
typedef struct qmat_arena {
  struct qmat_arena_block *newest;
} qmat_arena;

/* Makes room for `count` elements of `size` bytes each, 64-byte aligned, not cleared, followed by at least
 * 16 readable bytes (Embree reads past the last element). Zero elements give a valid pointer.
 * Returns NULL when memory is short or count * size overflows. The arena owns it. */
void *qmat_arena_alloc(qmat_arena *arena, size_t count, size_t size);

/* The same, cleared to zero bytes. */
void *qmat_arena_calloc(qmat_arena *arena, size_t count, size_t size);

/* Frees everything that the arena made; the arena is empty and usable again. NULL is allowed. */
void qmat_arena_uninit(qmat_arena *arena);

/* Heap twins of the above for what outlives a run: 64-byte aligned, 16 readable bytes of padding, NULL on
 * shortage or overflow; free with qmat_free. */
void *qmat_alloc(size_t count, size_t size);
void *qmat_calloc(size_t count, size_t size);
void qmat_free(void *memory);

/* Grows an array made by qmat_alloc to hold at least `needed` elements of `size` bytes (capacity at least
 * doubles); keeps its contents. `*capacity` is in elements. Returns 0 on success; on shortage -1 and both are
 * unchanged. `*array` may be NULL with capacity 0. */
int qmat_grow(void **array, size_t *capacity, size_t needed, size_t size);

#ifdef __cplusplus
}
#endif

#endif
