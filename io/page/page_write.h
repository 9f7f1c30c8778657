/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_PAGE_PAGE_WRITE_H
#define QMAT_IO_PAGE_PAGE_WRITE_H

#include <jansson.h>

#include "io/bytes.h"

/* One HTML file that needs nothing else: page.html with its style (page.css) and script
 * (examples/readers/qmat_reader.mjs and page.js) in it. */
typedef struct qmat_page {
  const char *title;   /* UTF-8 */
  const char *picture; /* a PNG file as base64, for browsers without WebGL */
  const json_t *data;  /* what the script shows; nodes/page/page_data.h */
} qmat_page;

/* Appends the page. QMAT_ERROR_MEMORY. The same bytes for the same arguments. Cost: linear. */
qmat_status qmat_page_put(qmat_context *context, const qmat_page *page, qmat_writer *writer);

/* Appends index.html: a page with a table that is sorted by clicks. `title` is UTF-8; `rows` is the inside of the
 * table, a head and a body. QMAT_ERROR_MEMORY. */
qmat_status qmat_index_put(qmat_context *context, const char *title, const char *rows, qmat_writer *writer);

/* Appends text with the five characters escaped that HTML and XML reserve; control characters are left out. */
void qmat_put_markup(qmat_writer *writer, const char *text);

#endif
