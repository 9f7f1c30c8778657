/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/arena.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Under AddressSanitizer the unused part of a block is poisoned, so that an overrun of an arena array is found. */
#if defined(__SANITIZE_ADDRESS__)
#define QMAT_ARENA_POISON 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define QMAT_ARENA_POISON 1
#endif
#endif
#ifdef QMAT_ARENA_POISON
#include <sanitizer/asan_interface.h>
#else
#define ASAN_POISON_MEMORY_REGION(address, size) ((void)(address), (void)(size))
#define ASAN_UNPOISON_MEMORY_REGION(address, size) ((void)(address), (void)(size))
#endif

enum { ALIGNMENT = 64, PADDING = 16 };
static const size_t FIRST_BLOCK = (size_t)1 << 16, LARGEST_SHARED_BLOCK = (size_t)1 << 24;

/* The header of a block, followed by its memory; padded to ALIGNMENT. */
typedef struct qmat_arena_block {
  struct qmat_arena_block *older;
  size_t used, capacity; /* bytes after the header */
} qmat_arena_block;

_Static_assert(sizeof(qmat_arena_block) <= ALIGNMENT, "the block header takes one alignment unit");

static uint8_t *block_memory(qmat_arena_block *block) {
  return (uint8_t *)block + ALIGNMENT;
}

/* The bytes for `count` elements and their padding, a multiple of ALIGNMENT; 0 on overflow. */
static size_t padded_bytes(size_t count, size_t size) {
  size_t bytes;
  if (__builtin_mul_overflow(count, size, &bytes) || bytes > (size_t)PTRDIFF_MAX / 2) return 0;
  return (bytes + PADDING + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
}

void *qmat_arena_alloc(qmat_arena *arena, size_t count, size_t size) {
  const size_t bytes = padded_bytes(count, size);
  if (bytes == 0) return NULL;

  qmat_arena_block *block = arena->newest;
  if (!block || block->capacity - block->used < bytes) {
    size_t capacity = block == NULL ? FIRST_BLOCK : block->capacity;
    if (block && capacity < LARGEST_SHARED_BLOCK) capacity *= 2;
    if (capacity > LARGEST_SHARED_BLOCK) capacity = LARGEST_SHARED_BLOCK;
    if (capacity < bytes) capacity = bytes;
    qmat_arena_block *fresh = aligned_alloc(ALIGNMENT, ALIGNMENT + capacity);
    if (!fresh) return NULL;
    *fresh = (qmat_arena_block){.older = block, .capacity = capacity};
    ASAN_POISON_MEMORY_REGION(block_memory(fresh), capacity);
    if (block && block->capacity - block->used > capacity - bytes) {
      /* A large array gets its own block, so that the rest of the current block stays in use. */
      fresh->older = block->older;
      block->older = fresh;
    } else {
      arena->newest = fresh;
    }
    block = fresh;
  }
  uint8_t *memory = block_memory(block) + block->used;
  block->used += bytes;
  ASAN_UNPOISON_MEMORY_REGION(memory, count * size + PADDING);
  memset(memory + count * size, 0, PADDING);
  return memory;
}

void *qmat_arena_calloc(qmat_arena *arena, size_t count, size_t size) {
  void *memory = qmat_arena_alloc(arena, count, size);
  if (memory) memset(memory, 0, count * size);
  return memory;
}

void qmat_arena_uninit(qmat_arena *arena) {
  if (!arena) return;
  qmat_arena_block *block = arena->newest;
  while (block) {
    qmat_arena_block *older = block->older;
    ASAN_UNPOISON_MEMORY_REGION(block_memory(block), block->capacity);
    free(block);
    block = older;
  }
  arena->newest = NULL;
}

qmat_arena qmat_arena_set_aside(qmat_arena *arena) {
  const qmat_arena aside = *arena;
  arena->newest = NULL;
  return aside;
}

void qmat_arena_put_back(qmat_arena *arena, qmat_arena aside) {
  qmat_arena_uninit(arena);
  *arena = aside;
}

void *qmat_alloc(size_t count, size_t size) {
  const size_t bytes = padded_bytes(count, size);
  if (bytes == 0) return NULL;
  uint8_t *memory = aligned_alloc(ALIGNMENT, bytes);
  if (memory) memset(memory + count * size, 0, PADDING);
  return memory;
}

void *qmat_calloc(size_t count, size_t size) {
  void *memory = qmat_alloc(count, size);
  if (memory) memset(memory, 0, count * size);
  return memory;
}

void qmat_free(void *memory) {
  free(memory);
}

static int grow(qmat_arena *arena, void **array, size_t *capacity, size_t needed, size_t size) {
  if (needed <= *capacity && *array) return 0;
  size_t wanted = *capacity > SIZE_MAX / 2 ? SIZE_MAX : *capacity * 2;
  if (wanted < needed) wanted = needed;
  if (wanted < 16) wanted = 16;
  void *grown = arena ? qmat_arena_alloc(arena, wanted, size) : qmat_alloc(wanted, size);
  if (!grown) return -1;
  if (*array) memcpy(grown, *array, *capacity * size);
  if (!arena) qmat_free(*array);
  *array = grown;
  *capacity = wanted;
  return 0;
}

int qmat_grow(void **array, size_t *capacity, size_t needed, size_t size) {
  return grow(NULL, array, capacity, needed, size);
}

int qmat_arena_grow(qmat_arena *arena, void **array, size_t *capacity, size_t needed, size_t size) {
  return grow(arena, array, capacity, needed, size);
}
