/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_TESTS_RANDOM_H
#define QMAT_TESTS_RANDOM_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "core/hash.h"

/* Random numbers for tests, the same on every machine. */
typedef struct random_numbers {
  uint64_t seed, drawn;
} random_numbers;

static inline double random_between(random_numbers *random, double low, double high) {
  return low + (high - low) * qmat_hash_unit(qmat_hash3(random->seed, random->drawn++, 0));
}

/* 0 to count - 1. */
static inline size_t random_index(random_numbers *random, size_t count) {
  return (size_t)(qmat_hash3(random->seed, random->drawn++, 1) % count);
}

/* A finite number with any bits. */
static inline double random_double(uint64_t index) {
  for (uint64_t k = 0;; k++) {
    uint64_t bits = qmat_hash3(7, index, k);
    double number;
    memcpy(&number, &bits, sizeof number);
    if (isfinite(number)) return number;
  }
}

#endif
