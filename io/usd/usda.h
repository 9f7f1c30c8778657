/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USDA_H
#define QMAT_IO_USD_USDA_H

#include "io/bytes.h"
#include "io/usd/usd_layer.h"

/* Reads a text layer (.usda). `bytes` is the whole file followed by 16 zero bytes, as qmat_bytes_read_file returns it;
 * it may be freed afterwards. `path` is copied into the layer. QMAT_ERROR_FORMAT with file, line and column;
 * QMAT_ERROR_MEMORY. Free the layer also after a failure. One thread. Cost: linear. */
qmat_status qmat_usda_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_usd_layer *layer);

#endif
