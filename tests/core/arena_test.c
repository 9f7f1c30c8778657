/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/arena.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static void assert_aligned(const void *memory) {
  assert_non_null(memory);
  assert_int_equal((uintptr_t)memory % 64, 0);
}

/* Reads the 16 bytes after the array, as Embree does; the sanitizer watches. */
static void assert_padded(const void *memory, size_t bytes) {
  uint8_t padding[16], zeros[16] = {0};
  memcpy(padding, (const uint8_t *)memory + bytes, sizeof padding);
  assert_memory_equal(padding, zeros, sizeof padding);
}

static void test_arena_arrays_are_aligned_padded_and_apart(void **state) {
  (void)state;
  qmat_arena arena = {0};
  enum { ARRAYS = 500 };
  uint8_t *arrays[ARRAYS];
  for (size_t i = 0; i < ARRAYS; i++) { /* 0 .. 4 MB in all sizes, so that many blocks are made */
    const size_t size = i % 7 == 0 ? i * 300 : i;
    arrays[i] = qmat_arena_alloc(&arena, size, 1);
    assert_aligned(arrays[i]);
    assert_padded(arrays[i], size);
    memset(arrays[i], (int)(i % 251), size);
  }
  for (size_t i = 0; i < ARRAYS; i++) {
    const size_t size = i % 7 == 0 ? i * 300 : i;
    for (size_t k = 0; k < size; k++) assert_int_equal(arrays[i][k], i % 251);
  }
  qmat_arena_uninit(&arena);
}

static void test_a_large_array_leaves_the_rest_of_the_block_in_use(void **state) {
  (void)state;
  qmat_arena arena = {0};
  const uint8_t *before = qmat_arena_alloc(&arena, 1, 1);
  assert_aligned(before);
  uint8_t *large = qmat_arena_alloc(&arena, (size_t)1 << 25, 1);
  assert_aligned(large);
  large[0] = large[((size_t)1 << 25) - 1] = 1;
  const uint8_t *after = qmat_arena_alloc(&arena, 1, 1);
  assert_ptr_equal(after, before + 64);
  qmat_arena_uninit(&arena);
}

static void test_calloc_clears_memory_that_was_used_before(void **state) {
  (void)state;
  qmat_arena arena = {0};
  for (int round = 0; round < 3; round++) {
    uint32_t *array = qmat_arena_calloc(&arena, 1000, sizeof *array);
    assert_aligned(array);
    for (size_t i = 0; i < 1000; i++) assert_int_equal(array[i], 0);
    memset(array, 0xFF, 1000 * sizeof *array);
    qmat_arena_uninit(&arena);
    assert_null(arena.newest);
  }
  uint32_t *array = qmat_calloc(1000, sizeof *array);
  assert_aligned(array);
  for (size_t i = 0; i < 1000; i++) assert_int_equal(array[i], 0);
  qmat_free(array);
}

static void test_uninit_takes_empty_arenas_and_null(void **state) {
  (void)state;
  qmat_arena arena = {0};
  qmat_arena_uninit(&arena);
  qmat_arena_uninit(&arena);
  qmat_arena_uninit(NULL);
}

static void test_what_is_set_aside_outlives_what_comes_after(void **state) {
  (void)state;
  qmat_arena arena = {0};
  uint32_t *first = qmat_arena_calloc(&arena, 100, sizeof *first);
  first[99] = 7;
  const qmat_arena aside = qmat_arena_set_aside(&arena);
  assert_null(arena.newest);
  uint32_t *second = qmat_arena_calloc(&arena, 100, sizeof *second);
  second[99] = 8;
  assert_ptr_not_equal(first, second);
  qmat_arena_put_back(&arena, aside);
  assert_ptr_equal(arena.newest, aside.newest);
  assert_int_equal(first[99], 7);
  qmat_arena_uninit(&arena);
}

static void test_sizes_that_overflow_give_null(void **state) {
  (void)state;
  qmat_arena arena = {0};
  const size_t sizes[][2] = {{SIZE_MAX, 1},
                             {SIZE_MAX - 15, 1},
                             {SIZE_MAX / 2 + 1, 2},
                             {SIZE_MAX / 8 + 2, 8},
                             {(size_t)1 << 32, (size_t)1 << 32},
                             {PTRDIFF_MAX, 1}};
  for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
    assert_null(qmat_arena_alloc(&arena, sizes[i][0], sizes[i][1]));
    assert_null(qmat_arena_calloc(&arena, sizes[i][0], sizes[i][1]));
    assert_null(qmat_alloc(sizes[i][0], sizes[i][1]));
    assert_null(qmat_calloc(sizes[i][0], sizes[i][1]));
  }
  assert_null(arena.newest);
}

static void test_zero_elements_give_a_valid_pointer(void **state) {
  (void)state;
  qmat_arena arena = {0};
  void *first = qmat_arena_alloc(&arena, 0, 8), *second = qmat_arena_alloc(&arena, 8, 0);
  assert_aligned(first);
  assert_aligned(second);
  assert_ptr_not_equal(first, second);
  qmat_arena_uninit(&arena);
  void *heap = qmat_alloc(0, 8);
  assert_aligned(heap);
  assert_padded(heap, 0);
  qmat_free(heap);
  qmat_free(NULL);
}

static void test_heap_arrays_are_aligned_and_padded(void **state) {
  (void)state;
  for (size_t size = 1; size < 200; size++) {
    uint8_t *memory = qmat_alloc(size, 3);
    assert_aligned(memory);
    memset(memory, 0xAA, size * 3);
    assert_padded(memory, size * 3);
    qmat_free(memory);
  }
}

static void test_growing_keeps_contents_and_at_least_doubles(void **state) {
  (void)state;
  void *array = NULL;
  size_t capacity = 0, count = 0, moves = 0;
  for (; count < 100000; count++) {
    const size_t before = capacity;
    assert_int_equal(qmat_grow(&array, &capacity, count + 1, sizeof(uint32_t)), 0);
    assert_true(capacity > count);
    if (capacity != before) {
      assert_true(capacity >= 2 * before);
      assert_aligned(array);
      moves++;
    }
    ((uint32_t *)array)[count] = (uint32_t)count;
  }
  assert_true(moves < 20);
  for (size_t i = 0; i < count; i++) assert_int_equal(((uint32_t *)array)[i], i);
  assert_int_equal(qmat_grow(&array, &capacity, 5 * capacity + 1, sizeof(uint32_t)), 0);
  assert_int_equal(((uint32_t *)array)[99999], 99999);
  qmat_free(array);
}

static void test_growing_in_an_arena_keeps_contents_and_the_old_array(void **state) {
  (void)state;
  qmat_arena arena = {NULL};
  void *array = NULL, *first = NULL;
  size_t capacity = 0, count = 0;
  for (; count < 1000; count++) {
    assert_int_equal(qmat_arena_grow(&arena, &array, &capacity, count + 1, sizeof(uint32_t)), 0);
    assert_true(capacity > count);
    if (!first) first = array;
    ((uint32_t *)array)[count] = (uint32_t)count;
  }
  for (size_t i = 0; i < count; i++) assert_int_equal(((uint32_t *)array)[i], i);
  assert_ptr_not_equal(first, array);
  assert_int_equal(*(uint32_t *)first, 0);
  const size_t before = capacity;
  assert_int_equal(qmat_arena_grow(&arena, &array, &capacity, SIZE_MAX / 4, 8), -1);
  assert_int_equal(capacity, before);
  qmat_arena_uninit(&arena);
}

static void test_growing_beyond_memory_changes_nothing(void **state) {
  (void)state;
  void *array = NULL;
  size_t capacity = 0;
  assert_int_equal(qmat_grow(&array, &capacity, 10, 8), 0);
  void *const before = array;
  const size_t capacity_before = capacity;
  assert_int_equal(qmat_grow(&array, &capacity, SIZE_MAX / 4, 8), -1);
  assert_ptr_equal(array, before);
  assert_int_equal(capacity, capacity_before);
  qmat_free(array);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_arena_arrays_are_aligned_padded_and_apart),
      cmocka_unit_test(test_a_large_array_leaves_the_rest_of_the_block_in_use),
      cmocka_unit_test(test_calloc_clears_memory_that_was_used_before),
      cmocka_unit_test(test_uninit_takes_empty_arenas_and_null),
      cmocka_unit_test(test_what_is_set_aside_outlives_what_comes_after),
      cmocka_unit_test(test_sizes_that_overflow_give_null),
      cmocka_unit_test(test_zero_elements_give_a_valid_pointer),
      cmocka_unit_test(test_heap_arrays_are_aligned_and_padded),
      cmocka_unit_test(test_growing_keeps_contents_and_at_least_doubles),
      cmocka_unit_test(test_growing_in_an_arena_keeps_contents_and_the_old_array),
      cmocka_unit_test(test_growing_beyond_memory_changes_nothing),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
