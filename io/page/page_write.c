/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/page/page_write.h"

#include <string.h>

#include "core/json_text.h"

/* The sources, which CMake embeds. */
extern const char qmat_page_html[], qmat_index_html[], qmat_page_css[], qmat_page_js[], qmat_reader_mjs[];

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

/* What fills the slots of a template. */
typedef struct slots {
  const char *title, *picture, *data, *rows;
} slots;

static void put_slot(const slots *given, char slot, qmat_writer *writer) {
  switch (slot) {
    case 't':
      qmat_put_markup(writer, given->title);
      break;
    case 'p':
      qmat_put_text(writer, given->picture);
      break;
    case 'd':
      put_data(writer, given->data);
      break;
    case 'r':
      qmat_put_text(writer, given->rows);
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

/* Slots are written {{title}}, {{picture}}, {{data}}, {{rows}}, {{css}} and {{js}}. */
static qmat_status put_template(qmat_context *context, const char *at, const slots *given, qmat_writer *writer) {
  for (const char *open; (open = strstr(at, "{{")) != NULL; at = strstr(open, "}}") + 2) {
    qmat_put_bytes(writer, at, (size_t)(open - at));
    put_slot(given, open[2], writer);
  }
  qmat_put_text(writer, at);
  return writer->failed ? qmat_fail_memory(context, "the page") : QMAT_OK;
}

qmat_status qmat_page_put(qmat_context *context, const qmat_page *page, qmat_writer *writer) {
  char *data = qmat_json_text(page->data, JSON_COMPACT | JSON_SORT_KEYS, NULL);
  if (!data) return qmat_fail_memory(context, "the page");
  const slots given = {.title = page->title, .picture = page->picture, .data = data};
  const qmat_status status = put_template(context, qmat_page_html, &given, writer);
  qmat_free(data);
  return status;
}

qmat_status qmat_index_put(qmat_context *context, const char *title, const char *rows, qmat_writer *writer) {
  return put_template(context, qmat_index_html, &(slots){.title = title, .rows = rows}, writer);
}
