/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/page/page_write.h"

#include <string.h>

#include "core/json_text.h"

/* The sources, which CMake embeds. */
extern const char qmat_page_html[], qmat_page_css[], qmat_page_js[], qmat_reader_mjs[];

void qmat_put_markup(qmat_writer *writer, const char *text) {
  static const struct {
    char character;
    const char *entity;
  } reserved[] = {{'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}, {'\'', "&#39;"}};
  for (; *text; text++) {
    const char *entity = NULL;
    for (size_t i = 0; i < sizeof reserved / sizeof *reserved; i++)
      if (*text == reserved[i].character) entity = reserved[i].entity;
    if (entity)
      qmat_put_text(writer, entity);
    else if ((unsigned char)*text >= ' ')
      qmat_put_bytes(writer, text, 1);
  }
}

/* JSON inside of a script element: a name with "</script>" must not end it. */
static void put_data(qmat_writer *writer, const char *text) {
  for (const char *next; *text; text = next) {
    const size_t plain = strcspn(text, "<");
    qmat_put_bytes(writer, text, plain);
    next = text + plain;
    if (*next == '<') {
      qmat_put_text(writer, "\\u003c");
      next++;
    }
  }
}

static void put_slot(const qmat_page *page, const char *data, char slot, qmat_writer *writer) {
  switch (slot) {
    case 't':
      qmat_put_markup(writer, page->title);
      break;
    case 'p':
      qmat_put_text(writer, page->picture);
      break;
    case 'd':
      put_data(writer, data);
      break;
    case 'c':
      qmat_put_text(writer, qmat_page_css);
      break;
    default: /* one module, so that the reader's exports are its own names */
      qmat_put_text(writer, qmat_reader_mjs);
      qmat_put_text(writer, qmat_page_js);
      break;
  }
}

qmat_status qmat_page_put(qmat_context *context, const qmat_page *page, qmat_writer *writer) {
  char *data = qmat_json_text(page->data, JSON_COMPACT | JSON_SORT_KEYS, NULL);
  if (!data) return qmat_fail_memory(context, "the page");
  /* Slots are written {{title}}, {{picture}}, {{data}}, {{css}} and {{js}}. */
  const char *at = qmat_page_html;
  for (const char *open; (open = strstr(at, "{{")) != NULL; at = strstr(open, "}}") + 2) {
    qmat_put_bytes(writer, at, (size_t)(open - at));
    put_slot(page, data, open[2], writer);
  }
  qmat_put_text(writer, at);
  qmat_free(data);
  return writer->failed ? qmat_fail_memory(context, "the page") : QMAT_OK;
}
