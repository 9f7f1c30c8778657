/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_MORTON_H
#define QMAT_CORE_GEOMETRY_MORTON_H

#include <stdint.h>

/* Spreads the low 21 bits of a number to every third bit of the result. Those of three coordinates, shifted by 0, 1 and
 * 2, are the place of a point along a curve that keeps near points together. */
static inline uint64_t qmat_spread_bits(uint64_t x) {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x1f00000000ffff;
  x = (x | x << 16) & 0x1f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  return (x | x << 2) & 0x1249249249249249;
}

#endif
