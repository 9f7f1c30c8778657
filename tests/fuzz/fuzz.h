/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_TESTS_FUZZ_FUZZ_H
#define QMAT_TESTS_FUZZ_FUZZ_H

/* Damaged copies of files: each is made from its number alone, so that a failure can be found again. Link with
 * -Wl,--wrap=aligned_alloc. */
#include <time.h>

#include "tests/io/files.h"

/* What a file may take on top of 256 bytes for each of its own, and the same of a block that is handed on. */
#define FREE_BYTES ((size_t)1 << 25)
#define BYTES_PER_BYTE 512
#define MOST_SECONDS 20

static size_t largest_request;

void *__real_aligned_alloc(size_t alignment, size_t size);
void *__wrap_aligned_alloc(size_t alignment, size_t size);
void *__wrap_aligned_alloc(size_t alignment, size_t size) {
  if (size > largest_request) largest_request = size;
  return __real_aligned_alloc(alignment, size);
}

typedef struct sample {
  const char *name;
  uint8_t *bytes;
  size_t size;
} sample;

/* A copy of the sample that is damaged in one to eight places; longer than it by `room` at most. */
static size_t damage(const sample *from, uint64_t seed, uint64_t number, uint8_t *bytes, size_t room) {
  static const uint8_t notable[] = {0, 1, 2, 0x7F, 0x80, 0xFE, 0xFF};
  static const char syntax[] = "()[]{}<>@\"'=,;:.#!0123456789-+eE/\\ \n";
  size_t size = from->size;
  memcpy(bytes, from->bytes, size);
  const uint64_t dice = qmat_hash3(seed, number, 0), places = dice & 1 ? 1 : 1 + (dice >> 1) % 8;
  for (uint64_t i = 1; i <= places && size > 0; i++) {
    const uint64_t random = qmat_hash3(seed, number, i), more = qmat_hash3(seed, number, i + 100);
    const size_t at = (size_t)(random >> 8) % size, length = 1 + (size_t)(more >> 40) % 64;
    switch (random & 7) {
      case 0: /* a bit */
        bytes[at] = (uint8_t)(bytes[at] ^ 1u << (more & 7));
        break;
      case 1: /* any byte */
        bytes[at] = (uint8_t)more;
        break;
      case 2: /* a notable byte */
        bytes[at] = notable[more % sizeof notable];
        break;
      case 3: /* a character of the grammar */
        bytes[at] = (uint8_t)syntax[more % (sizeof syntax - 1)];
        break;
      case 4: { /* a piece from elsewhere, over what is here */
        const size_t other = (size_t)(more >> 8) % size, most = size - (at > other ? at : other);
        memmove(bytes + at, bytes + other, length < most ? length : most);
        break;
      }
      case 5: { /* a piece less */
        const size_t less = length < size - at ? length : size - at;
        memmove(bytes + at, bytes + at + less, size - at - less);
        size -= less;
        break;
      }
      case 6: /* a piece twice */
        if (at + length <= size && size + length <= from->size + room) {
          memmove(bytes + at + length, bytes + at, size - at);
          size += length;
        }
        break;
      default: /* four bytes as a large number, or the end of the file */
        if (more % 16 == 0) {
          size = at;
        } else {
          for (size_t k = 0; k < 4 && at + k < size; k++) bytes[at + k] = k < 3 ? 0xFF : (uint8_t)(more >> 32);
        }
        break;
    }
  }
  return size;
}

static double seconds_of_processor(void) {
  struct timespec time;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static uint64_t mutation_count = 100, mutation_seed = 1;

/* `read_all` reads bytes in every way, and tells whether something came of them. */
static void try_damaged_copies(const sample *samples, size_t count,
                               bool (*read_all)(const uint8_t *bytes, size_t size)) {
  enum { ROOM = 1024 };
  size_t largest = 0, most_requested = 0, read = 0;
  double slowest = 0;
  for (size_t i = 0; i < count; i++) largest = samples[i].size > largest ? samples[i].size : largest;
  uint8_t *bytes = malloc(largest + ROOM);
  assert_non_null(bytes);
  for (uint64_t number = 0; number < mutation_count; number++) {
    const sample *from = &samples[number % count];
    const size_t size = damage(from, mutation_seed, number, bytes, ROOM);
    largest_request = 0;
    const double start = seconds_of_processor();
    read += read_all(bytes, size);
    const double seconds = seconds_of_processor() - start;
    if (largest_request > FREE_BYTES + BYTES_PER_BYTE * size || seconds > MOST_SECONDS) {
      fail_msg("copy %llu of %s, %zu bytes: %zu bytes at once, %.1f s", (unsigned long long)number, from->name, size,
               largest_request, seconds);
    }
    most_requested = largest_request > most_requested ? largest_request : most_requested;
    slowest = seconds > slowest ? seconds : slowest;
  }
  print_message("%llu copies of %zu files like %s: %zu were read, at most %zu bytes at once, at most %.3f s\n",
                (unsigned long long)mutation_count, count, samples[0].name, read, most_requested, slowest);
  free(bytes);
}

static void add_file(sample *samples, size_t *count, const char *path) {
  qmat_context context = {0};
  qmat_bytes bytes = {0};
  if (access(path, R_OK) == 0 && qmat_bytes_read_file(&context, path, &bytes) == QMAT_OK && bytes.size < 65536) {
    samples[*count] = (sample){.name = path, .size = bytes.size, .bytes = malloc(bytes.size)};
    assert_non_null(samples[*count].bytes);
    memcpy(samples[(*count)++].bytes, bytes.data, bytes.size);
  }
  qmat_bytes_uninit(&bytes);
  qmat_context_uninit(&context);
}

static void add_sample(sample *samples, size_t *count, const char *name, const void *bytes, size_t size) {
  samples[*count] = (sample){.name = name, .size = size, .bytes = malloc(size)};
  assert_non_null(samples[*count].bytes);
  memcpy(samples[(*count)++].bytes, bytes, size);
}

static void free_samples(sample *samples, size_t count) {
  for (size_t i = 0; i < count; i++) free(samples[i].bytes);
}

#endif
