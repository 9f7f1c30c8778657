/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usdc_pack.h"

#include <lz4.h>

/* LZ4 expands a byte to at most 255 bytes, and a block by a few more. */
enum { LZ4_RATIO = 255, LZ4_BLOCK_SLACK = 64 };

size_t qmat_usdc_largest_unpacked(size_t packed) {
  return packed > SIZE_MAX / LZ4_RATIO / 2 ? SIZE_MAX / 2 : packed * LZ4_RATIO + LZ4_BLOCK_SLACK;
}

qmat_status qmat_usdc_unpack(const qmat_usd_layer *layer, const uint8_t *packed, size_t size, void *bytes,
                             size_t capacity, size_t *made) {
  /* The number of blocks, each after its size; 0: one block without a size. */
  qmat_byte_reader reader = {.bytes = packed, .size = size};
  unsigned blocks = qmat_take_u8(&reader);
  *made = 0;
  for (unsigned i = 0; i < (blocks > 0 ? blocks : 1); i++) {
    size_t block_size = blocks > 0 ? qmat_take_u32(&reader) : qmat_bytes_left(&reader);
    const uint8_t *block = qmat_take_bytes(&reader, block_size);
    size_t room = capacity - *made;
    if (!block || block_size > LZ4_MAX_INPUT_SIZE)
      return qmat_usd_layer_fail(layer, "a packed table or array does not fit into the file");
    int got = LZ4_decompress_safe((const char *)block, (char *)bytes + *made, (int)block_size,
                                  room < INT32_MAX ? (int)room : INT32_MAX);
    if (got < 0) return qmat_usd_layer_fail(layer, "a packed table or array cannot be unpacked");
    *made += (size_t)got;
  }
  return QMAT_OK;
}

/* The unpacked bytes are the commonest difference, two bits for each integer, and the other differences. The two bits
 * are the size of the difference from the integer before: none (the commonest), a quarter of `width`, half of it, or
 * all. */
static void decode(qmat_byte_reader *codes, qmat_byte_reader *differences, size_t count, unsigned width,
                   int64_t *integers) {
  const uint64_t common = width == 4 ? (uint64_t)(int32_t)qmat_take_u32(codes) : qmat_take_u64(codes);
  uint64_t value = 0;
  for (size_t i = 0; i < count; i++) {
    uint64_t difference = common;
    switch (codes->bytes[width + i / 4] >> (2 * (i % 4)) & 3) {
      case 1:
        difference =
            width == 4 ? (uint64_t)(int8_t)qmat_take_u8(differences) : (uint64_t)(int16_t)qmat_take_u16(differences);
        break;
      case 2:
        difference =
            width == 4 ? (uint64_t)(int16_t)qmat_take_u16(differences) : (uint64_t)(int32_t)qmat_take_u32(differences);
        break;
      case 3:
        difference = width == 4 ? (uint64_t)(int32_t)qmat_take_u32(differences) : qmat_take_u64(differences);
        break;
      default:
        break;
    }
    value += difference;
    integers[i] = width == 4 ? (int32_t)(uint32_t)value : (int64_t)value;
  }
}

qmat_status qmat_usdc_take_integers(const qmat_usd_layer *layer, qmat_byte_reader *reader, size_t count, unsigned width,
                                    int64_t *integers) {
  const uint64_t packed_size = qmat_take_u64(reader);
  const uint8_t *packed = qmat_take_bytes(reader, packed_size);
  if (!packed) return qmat_usd_layer_fail(layer, "the file ends within packed integers");
  const size_t largest = qmat_usdc_largest_unpacked(packed_size), least = width + count / 4 + (count % 4 != 0);
  if (least > largest) return qmat_usd_layer_fail(layer, "an array is longer than its packed bytes allow");
  const size_t most = least + count * width < largest ? least + count * width : largest;
  uint8_t *bytes = qmat_alloc(most, 1);
  if (!bytes) return qmat_usd_layer_fail_memory(layer);
  size_t size;
  qmat_status status = qmat_usdc_unpack(layer, packed, packed_size, bytes, most, &size);
  qmat_byte_reader codes = {.bytes = bytes, .size = size}, differences = {.bytes = bytes, .size = size, .at = least};
  if (status == QMAT_OK && size >= least) decode(&codes, &differences, count, width, integers);
  if (status == QMAT_OK && (size < least || differences.failed))
    status = qmat_usd_layer_fail(layer, "packed integers unpack to fewer than their count");
  qmat_free(bytes);
  return status;
}
