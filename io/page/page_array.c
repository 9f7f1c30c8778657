/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/page/page_array.h"

#include <zlib.h>

#include "io/base64.h"

static uint32_t number_at(const uint8_t *bytes, size_t index, size_t width) {
  uint32_t number = 0;
  for (size_t k = 0; k < width; k++) number |= (uint32_t)bytes[width * index + k] << (8 * k);
  return number;
}

/* A difference modulo 2^bits, small ones of either sign as small numbers. */
static uint32_t folded(uint32_t difference, size_t width) {
  const unsigned unused = 32 - 8 * (unsigned)width, shifted = difference << unused;
  const uint32_t sign = shifted >> 31 ? UINT32_MAX : 0;
  return ((difference << 1) ^ sign) << unused >> unused;
}

static char *deflated(uint8_t *planes, size_t size) {
  z_stream stream = {0};
  if (size > UINT32_MAX || deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, -MAX_WBITS, 9, Z_DEFAULT_STRATEGY))
    return NULL;
  const uLong most = deflateBound(&stream, (uLong)size);
  uint8_t *packed = most <= UINT32_MAX ? qmat_alloc(most, 1) : NULL;
  char *text = NULL;
  if (packed) {
    stream.next_in = planes;
    stream.avail_in = (uInt)size;
    stream.next_out = packed;
    stream.avail_out = (uInt)most;
    if (deflate(&stream, Z_FINISH) == Z_STREAM_END) text = qmat_base64_encode(packed, stream.total_out);
  }
  deflateEnd(&stream);
  qmat_free(packed);
  return text;
}

char *qmat_page_array_encode(const uint8_t *bytes, size_t count, size_t width, size_t row) {
  uint8_t *planes = qmat_alloc(count, width);
  if (!planes) return NULL;
  for (size_t i = 0; i < count; i++) {
    uint32_t number = number_at(bytes, i, width);
    if (row > 0) number = folded(number - (i >= row ? number_at(bytes, i - row, width) : 0), width);
    for (size_t k = 0; k < width; k++) planes[k * count + i] = (uint8_t)(number >> (8 * k));
  }
  char *text = deflated(planes, count * width);
  qmat_free(planes);
  return text;
}
