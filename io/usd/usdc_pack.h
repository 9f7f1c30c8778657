/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USDC_PACK_H
#define QMAT_IO_USD_USDC_PACK_H

#include "io/bytes.h"
#include "io/usd/usd_layer.h"

/* The two compressions of crates: LZ4 blocks, and integers as differences. `layer` is for errors: QMAT_ERROR_FORMAT and
 * QMAT_ERROR_MEMORY. Source: OpenUSD, pxr/base/tf/fastCompression and pxr/usd/sdf/integerCoding. */

/* The most bytes that `packed` bytes can unpack to. */
size_t qmat_usdc_largest_unpacked(size_t packed);

/* Unpacks `size` bytes into at most `capacity` bytes at `bytes`; `*made` is their number. */
qmat_status qmat_usdc_unpack(const qmat_usd_layer *layer, const uint8_t *packed, size_t size, void *bytes,
                             size_t capacity, size_t *made);

/* Takes `count` integers of `width` 4 or 8 bytes, sign-extended, into `integers`. */
qmat_status qmat_usdc_take_integers(const qmat_usd_layer *layer, qmat_byte_reader *reader, size_t count, unsigned width,
                                    int64_t *integers);

/* Appends the size of the packed bytes (8 bytes) and then them: of any bytes, or of 32-bit integers. Shortage of
 * memory, or more than LZ4 takes at once (2 GB), sets writer->failed. */
void qmat_usdc_put_packed(qmat_writer *writer, const void *bytes, size_t size);
void qmat_usdc_put_integers(qmat_writer *writer, const int32_t *integers, size_t count);

#endif
