/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_PNG_H
#define QMAT_IO_PNG_H

#include "io/bytes.h"

/* Appends a PNG file (libpng) of `width` x `height` pixels, rows from the top, four bytes each: red, green, blue,
 * opacity. QMAT_ERROR_MEMORY. The same bytes for the same pixels and libraries. Cost: linear. */
qmat_status qmat_png_put(qmat_context *context, const uint8_t *pixels, size_t width, size_t height,
                         qmat_writer *writer);

#endif
