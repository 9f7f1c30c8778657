/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/page/figure.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "core/text.h"
#include "io/base64.h"
#include "io/page/page_write.h"
#include "io/png.h"
#include "nodes/page/look.h"

/* The caption is laid out for this width and scaled to the picture's. */
enum { CAPTION_WIDTH = 960, CAPTION_HEIGHT = 84 };

char *qmat_figure_base64(qmat_context *context, const qmat_picture *picture) {
  qmat_writer png = {0};
  char *text = NULL;
  if (qmat_png_put(context, picture->pixels, picture->width, picture->height, &png) == QMAT_OK) {
    text = qmat_base64_encode(png.bytes, png.size);
    if (!text) qmat_fail_memory(context, "the picture");
  }
  qmat_writer_uninit(&png);
  return text;
}

__attribute__((format(printf, 2, 3))) static void put(qmat_writer *writer, const char *format, ...) {
  char text[512];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  qmat_put_text(writer, text);
}

static void format_colour(const double colour[3], char text[8]) {
  snprintf(text, 8, "#%02x%02x%02x", (unsigned)lround(255 * colour[0]), (unsigned)lround(255 * colour[1]),
           (unsigned)lround(255 * colour[2]));
}

static void put_kinds(qmat_writer *writer, const qmat_caption *caption) {
  static const char *const names[] = {"sphere", "cone", "slab"};
  const size_t counts[] = {caption->spheres, caption->cones, caption->slabs};
  int x = 24;
  for (int i = 0; i < QMAT_LOOK_KINDS; i++) {
    char count[48], hex[8];
    double colour[3];
    qmat_look_of_kind((qmat_look_kind)i, colour);
    format_colour(colour, hex);
    qmat_format_count(counts[i], count);
    put(writer, "<circle cx='%d' cy='57' r='6' fill='%s'/><text x='%d' y='62'>%s %s%s</text>\n", x + 6, hex, x + 20,
        count, names[i], counts[i] == 1 ? "" : "s");
    x += 44 + 9 * (int)(strlen(count) + strlen(names[i]) + 2);
  }
}

static void put_bar(qmat_writer *writer, const qmat_caption *caption) {
  char range[48];
  put(writer, "<defs><linearGradient id='e'>");
  for (int i = 0; i <= 4; i++) {
    double colour[3];
    char hex[8];
    qmat_look_of_error(i / 2.0 - 1, 1, colour);
    format_colour(colour, hex);
    put(writer, "<stop offset='%d%%' stop-color='%s'/>", 25 * i, hex);
  }
  range[0] = '\0';
  if (isfinite(caption->range)) qmat_format_bound(caption->range, range);
  put(writer,
      "</linearGradient></defs><rect x='640' y='26' width='296' height='10' rx='5' fill='url(#e)'/>\n"
      "<text x='640' y='58'>&#8722;%s</text><text x='788' y='58' text-anchor='middle'>0</text>"
      "<text x='936' y='58' text-anchor='end'>+%s</text>\n",
      range, range);
}

qmat_status qmat_figure_put(qmat_context *context, const qmat_picture *picture, const qmat_caption *caption,
                            qmat_writer *writer) {
  char *image = qmat_figure_base64(context, picture);
  if (!image) return context->error.status;
  const double scale = (double)picture->width / CAPTION_WIDTH, height = (double)picture->height;
  put(writer,
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 %zu %.0f' font-family='system-ui,sans-serif' "
      "font-size='16'>\n<style>text{fill:#3b4654}.n{fill:#17202b;font-weight:600}@media (prefers-color-scheme:dark){"
      "text{fill:#aab6c5}.n{fill:#eef2f7}}</style>\n",
      picture->width, height + ceil(CAPTION_HEIGHT * scale));
  if (caption->name) {
    qmat_put_text(writer, "<title>");
    qmat_put_markup(writer, caption->name);
    qmat_put_text(writer, "</title>\n");
  }
  put(writer, "<image width='%zu' height='%zu' href='data:image/png;base64,", picture->width, picture->height);
  qmat_put_text(writer, image);
  qmat_free(image);
  put(writer, "'/>\n<g transform='translate(0 %.0f) scale(%.5f)'>\n<text class='n' x='24' y='32'>", height, scale);
  qmat_put_markup(writer, caption->name ? caption->name : "");
  if (isfinite(caption->error_out) && isfinite(caption->error_in)) {
    char text[48];
    qmat_format_bound(fmax(caption->error_out, caption->error_in), text);
    put(writer, "</text><text x='%d' y='32' text-anchor='end'>within %s", caption->has_errors ? 600 : 936, text);
  }
  qmat_put_text(writer, "</text>\n");
  if (caption->has_medial) put_kinds(writer, caption);
  if (caption->has_errors) put_bar(writer, caption);
  qmat_put_text(writer, "</g>\n</svg>\n");
  return writer->failed ? qmat_fail_memory(context, "the SVG file") : QMAT_OK;
}
