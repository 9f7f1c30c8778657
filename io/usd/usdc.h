/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USDC_H
#define QMAT_IO_USD_USDC_H

#include "io/bytes.h"
#include "io/usd/usd_layer.h"

/* Whether the bytes start like a crate. */
bool qmat_usdc_is_crate(const qmat_bytes *bytes);

/* Reads a binary layer ("crate") of version 0.6 to 0.10, in which tables of tokens, paths, fields and specs are packed.
 * `bytes` may be freed afterwards. `path` is copied into the layer. Every count and offset is checked against the file
 * before memory is taken for it, and the allowance of the layer bounds what its values add up to. QMAT_ERROR_FORMAT,
 * QMAT_ERROR_MEMORY. Free the layer also after a failure. One thread. Cost: linear in the unpacked file. Source of the
 * format: OpenUSD, pxr/usd/sdf/crateFile. */
qmat_status qmat_usdc_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_usd_layer *layer);

#endif
