/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USDC_WRITE_H
#define QMAT_IO_USD_USDC_WRITE_H

#include "io/bytes.h"
#include "io/usd/usd_layer.h"

/* Appends a layer as a binary crate of version 0.8 to an empty writer: what io/usd/usd_write.h makes as text, that is,
 * no variants, no values over time, and absolute paths. Fields whose type the text form leaves open ("upAxis = ...")
 * get that of USD's schema. QMAT_ERROR_INTERNAL for any other layer; QMAT_ERROR_MEMORY. The same bytes for the same
 * layer. Cost: linear. */
qmat_status qmat_usdc_write(qmat_context *context, qmat_usd_layer *layer, qmat_writer *out);

/* Replaces a text layer by the same layer as a crate. QMAT_ERROR_INTERNAL, QMAT_ERROR_MEMORY; the writer's contents are
 * then undefined. */
qmat_status qmat_usdc_of_text(qmat_context *context, qmat_writer *layer);

#endif
