/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_TESTS_SHORTAGE_H
#define QMAT_TESTS_SHORTAGE_H

/* Running out of memory at will. The linker sends the allocations of the program's own objects here (qmat_may_run_short
 * in tests/nodes/CMakeLists.txt), those of header-only C++ libraries included; jansson is to be given __wrap_malloc.
 * For one source file of a program. */

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

static atomic_size_t asked;             /* allocations so far */
static size_t first_refused = SIZE_MAX; /* refused from this one on... */
static size_t refused_count = SIZE_MAX; /* ...so many of them */

static bool refused(void) {
  const size_t number = atomic_fetch_add_explicit(&asked, 1, memory_order_relaxed);
  return number >= first_refused && number - first_refused < refused_count;
}

/* From now on allocations are counted, and refused from the `first` on, `count` of them. */
static inline void shortage(size_t first, size_t count) {
  atomic_store(&asked, 0);
  first_refused = first;
  refused_count = count;
}

void *__real_aligned_alloc(size_t alignment, size_t size);
void *__wrap_aligned_alloc(size_t alignment, size_t size);
void *__wrap_aligned_alloc(size_t alignment, size_t size) {
  return refused() ? NULL : __real_aligned_alloc(alignment, size);
}

void *__real_malloc(size_t size);
void *__wrap_malloc(size_t size);
void *__wrap_malloc(size_t size) {
  return refused() ? NULL : __real_malloc(size);
}

void *__real_calloc(size_t count, size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_calloc(size_t count, size_t size) {
  return refused() ? NULL : __real_calloc(count, size);
}

void *__real_realloc(void *memory, size_t size);
void *__wrap_realloc(void *memory, size_t size);
void *__wrap_realloc(void *memory, size_t size) {
  return refused() ? NULL : __real_realloc(memory, size);
}

/* operator new(size_t), and what it throws. */
_Noreturn void _ZSt17__throw_bad_allocv(void);
void *__real__Znwm(size_t size);
void *__wrap__Znwm(size_t size);
void *__wrap__Znwm(size_t size) {
  if (refused()) _ZSt17__throw_bad_allocv();
  return __real__Znwm(size);
}

/* CGAL's containers lose a block when memory runs out between the block and the list of blocks, and planes with
 * constraints cannot be taken apart then. */
__attribute__((visibility("default"))) const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void) {
  return "leak:CGAL::Compact_container\nleak:cut_plane";
}

#endif
