/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_PAGE_PAGE_ARRAY_H
#define QMAT_IO_PAGE_PAGE_ARRAY_H

#include <stddef.h>
#include <stdint.h>

/* An array of a page as text, which arrayOf of page.js reads: `count` little-endian numbers of `width` bytes (1, 2 or
 * 4) in `bytes`. With `row` > 0 each number is first replaced by its difference to the one `row` places before, with
 * the sign in the lowest bit. Then come the lowest bytes of all numbers, the next ones, and so on; all that is deflated
 * without a header (RFC 1951) and is base64. The caller frees it with qmat_free. NULL when memory is short. */
char *qmat_page_array_encode(const uint8_t *bytes, size_t count, size_t width, size_t row);

#endif
