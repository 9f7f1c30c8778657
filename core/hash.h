/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_HASH_H
#define QMAT_CORE_HASH_H

#include <stdint.h>

/* Stateless random numbers: each number is a function of its counters (seed, facet, index). Work can therefore be split
 * among threads in any way without changing a result. Not for cryptography. */

/* A bijection of 64 bits in which every input bit affects every output bit (the finaliser of SplitMix64, Steele et al.
 * 2014, variant 13 of Stafford). */
static inline uint64_t qmat_hash_mix(uint64_t x) {
  x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
  x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
  return x ^ (x >> 31);
}

/* 64 uniform bits for the counters (a, b) in the stream `seed`. */
static inline uint64_t qmat_hash3(uint64_t seed, uint64_t a, uint64_t b) {
  const uint64_t step = UINT64_C(0x9e3779b97f4a7c15);
  uint64_t h = qmat_hash_mix(seed + step);
  h = qmat_hash_mix((h ^ a) + step);
  return qmat_hash_mix((h ^ b) + step);
}

/* A uniform number in [0, 1) from 64 uniform bits; a multiple of 2^-53. */
static inline double qmat_hash_unit(uint64_t h) {
  return (double)(h >> 11) * 0x1.0p-53;
}

#endif
