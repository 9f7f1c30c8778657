/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usdc_pack.h"

#include <lz4.h>
#include <stdlib.h>
#include <string.h>

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

/* ---- packing ---- */

void qmat_usdc_put_packed(qmat_writer *writer, const void *bytes, size_t size) {
  const int most = size <= LZ4_MAX_INPUT_SIZE ? LZ4_compressBound((int)size) : 0;
  char *packed = most > 0 ? qmat_alloc((size_t)most, 1) : NULL;
  const int made = packed ? LZ4_compress_default(bytes, packed, (int)size, most) : 0;
  writer->failed = writer->failed || made <= 0;
  if (made > 0) {
    qmat_put_u64(writer, (uint64_t)made + 1);
    qmat_put_u8(writer, 0); /* one block */
    qmat_put_bytes(writer, packed, (size_t)made);
  }
  qmat_free(packed);
}

static int by_size(const void *left, const void *right) {
  const int32_t a = *(const int32_t *)left, b = *(const int32_t *)right;
  return a < b ? -1 : a > b;
}

/* The commonest of some numbers, the smallest of equally common ones. Sorts them. */
static int32_t commonest(int32_t *numbers, size_t count) {
  size_t most = 0;
  int32_t best = 0;
  if (count > 0) qsort(numbers, count, sizeof *numbers, by_size);
  for (size_t i = 0, end; i < count; i = end) {
    for (end = i + 1; end < count && numbers[end] == numbers[i];) end++;
    if (end - i <= most) continue;
    most = end - i;
    best = numbers[i];
  }
  return best;
}

void qmat_usdc_put_integers(qmat_writer *writer, const int32_t *integers, size_t count) {
  int32_t *differences = qmat_alloc(count, sizeof *differences), *sorted = qmat_alloc(count, sizeof *sorted);
  uint8_t *codes = qmat_calloc((count + 3) / 4, 1);
  qmat_writer out = {0}, rest = {0};
  writer->failed = writer->failed || !differences || !sorted || !codes;
  for (size_t i = 0; i < count && !writer->failed; i++)
    differences[i] = (int32_t)((uint32_t)integers[i] - (i > 0 ? (uint32_t)integers[i - 1] : 0));
  if (!writer->failed && count > 0) memcpy(sorted, differences, count * sizeof *sorted);
  const int32_t common = writer->failed ? 0 : commonest(sorted, count);
  for (size_t i = 0; i < count && !writer->failed; i++) {
    const int32_t d = differences[i];
    const unsigned code = d == common ? 0 : d == (int8_t)d ? 1 : d == (int16_t)d ? 2 : 3;
    codes[i / 4] |= (uint8_t)(code << (2 * (i % 4)));
    if (code == 1) qmat_put_u8(&rest, (uint8_t)d);
    if (code == 2) qmat_put_u16(&rest, (uint16_t)d);
    if (code == 3) qmat_put_u32(&rest, (uint32_t)d);
  }
  if (!writer->failed) {
    qmat_put_u32(&out, (uint32_t)common);
    qmat_put_bytes(&out, codes, (count + 3) / 4);
    qmat_put_bytes(&out, rest.bytes, rest.size);
    writer->failed = out.failed || rest.failed;
    if (!writer->failed) qmat_usdc_put_packed(writer, out.bytes, out.size);
  }
  qmat_writer_uninit(&rest);
  qmat_writer_uninit(&out);
  qmat_free(codes);
  qmat_free(sorted);
  qmat_free(differences);
}
