/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USDC_ORIGINAL_H
#define QMAT_IO_USD_USDC_ORIGINAL_H

#include "io/bytes.h"

/* A crate that lies over a scene (qmat_usd_write_layer) names the scene's file twice: as its sublayer, and in its
 * customLayerData, by which a later run knows that the side file is its own. */

/* Appends the crate in `part` with another name of that file to an empty writer. QMAT_ERROR_FORMAT, QMAT_ERROR_MEMORY.
 */
qmat_status qmat_usdc_rename_original(qmat_context *context, const qmat_file_part *part, const char *name,
                                      qmat_writer *out);

/* Whether the file `path` is a crate over the file `name`. False for other files, and where memory is short. */
bool qmat_usdc_has_original(const char *path, const char *name);

#endif
