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

/* Allocates `count` elements of `size` bytes each, 64-byte aligned, not cleared, followed by at least 16 readable bytes
 * (Embree reads past the last element). Zero elements give a valid pointer. NULL when memory is short or count * size
 * overflows. The arena owns the memory. */
void *qmat_arena_alloc(qmat_arena *arena, size_t count, size_t size);

/* The same, cleared to zero bytes. */
void *qmat_arena_calloc(qmat_arena *arena, size_t count, size_t size);

/* Grows an array of the arena to at least `needed` elements of `size` bytes and keeps its contents; the old array stays
 * too, until the arena is freed. `*capacity` is in elements and at least doubles. `*array` may be NULL with capacity 0.
 * Returns 0, or -1 when memory is short, with both unchanged. */
int qmat_arena_grow(qmat_arena *arena, void **array, size_t *capacity, size_t needed, size_t size);

/* Frees all memory of the arena, which is then empty and usable again. NULL is allowed. */
void qmat_arena_uninit(qmat_arena *arena);

/* Returns what the arena holds; the arena is then empty. So that what follows can be freed before the rest: put it
 * back with `qmat_arena_put_back`, or free it as an arena of your own. */
qmat_arena qmat_arena_set_aside(qmat_arena *arena);

/* Frees all memory of the arena, which then holds `aside` again. */
void qmat_arena_put_back(qmat_arena *arena, qmat_arena aside);

/* The allocations above on the heap, for memory that outlives a run: 64-byte aligned, padded by 16 readable bytes, NULL
 * on shortage or overflow. Free with qmat_free; NULL is allowed. Safe from any thread. */
void *qmat_alloc(size_t count, size_t size);
void *qmat_calloc(size_t count, size_t size);
void qmat_free(void *memory);

/* Grows an array from qmat_alloc to at least `needed` elements of `size` bytes and keeps its contents. `*capacity` is
 * in elements and at least doubles. `*array` may be NULL with capacity 0. Returns 0, or -1 when memory is short, with
 * both unchanged. */
int qmat_grow(void **array, size_t *capacity, size_t needed, size_t size);

#ifdef __cplusplus
}
#endif

#endif
