/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_BASE64_H
#define QMAT_IO_BASE64_H

#include <stddef.h>
#include <stdint.h>

#include "core/context.h"

/* Base64 (RFC 4648 section 4, padded, no line breaks) through OpenSSL. */

/* The text of `size` bytes: 4 characters for every 3 bytes begun, terminated. The caller frees it with qmat_free.
 * NULL when memory is short. `bytes` may be NULL when size is 0. */
char *qmat_base64_encode(const uint8_t *bytes, size_t size);

/* The bytes that `length` characters of base64 stand for, followed by 16 readable ones; the caller frees them with
 * qmat_free. QMAT_ERROR_FORMAT for a length that is no multiple of 4 or a character that is not of the alphabet,
 * QMAT_ERROR_MEMORY. On failure `*bytes` is NULL and `*size` 0. */
qmat_status qmat_base64_decode(qmat_context *context, const char *text, size_t length, uint8_t **bytes, size_t *size);

#endif
