/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_TESTS_FUZZ_TARGETS_H
#define QMAT_TESTS_FUZZ_TARGETS_H

#include <stddef.h>
#include <stdint.h>

/* One reader under test. Its seed corpus is tests/fuzz/corpus/NAME. */
typedef struct fuzz_target {
  const char *name;
  void (*read)(const uint8_t *bytes, size_t size); /* aborts the program when a property of the reader is violated */
} fuzz_target;

extern const fuzz_target fuzz_targets[];
extern const size_t fuzz_target_count;

/* The target of that name, or NULL. */
const fuzz_target *fuzz_target_find(const char *name);

/* Runs the target on a copy of the input. Aborts when the reader allocates more at once than an input of this size
 * justifies. Link with -Wl,--wrap=aligned_alloc, which qmat_alloc calls. */
void fuzz_run(const fuzz_target *target, const uint8_t *bytes, size_t size);

#endif
