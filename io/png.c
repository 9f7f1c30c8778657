/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/png.h"

#include <png.h>

static void write_bytes(png_structp png, png_bytep bytes, png_size_t size) {
  qmat_put_bytes(png_get_io_ptr(png), bytes, size);
}

static void flush(png_structp png) {
  (void)png;
}

/* libpng's warnings are about profiles and text, which are not written. */
static void ignore(png_structp png, png_const_charp message) {
  (void)png;
  (void)message;
}

static void give_up(png_structp png, png_const_charp message) {
  (void)message;
  png_longjmp(png, 1);
}

qmat_status qmat_png_put(qmat_context *context, const uint8_t *pixels, size_t width, size_t height,
                         qmat_writer *writer) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, give_up, ignore);
  png_infop info = png ? png_create_info_struct(png) : NULL;
  if (!info || setjmp(png_jmpbuf(png))) {
    png_destroy_write_struct(&png, &info);
    return qmat_fail_memory(context, "the PNG file");
  }
  png_set_write_fn(png, writer, write_bytes, flush);
  png_set_IHDR(png, info, (png_uint_32)width, (png_uint_32)height, 8, PNG_COLOR_TYPE_RGBA, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_compression_level(png, 9);
  png_write_info(png, info);
  for (size_t row = 0; row < height; row++) png_write_row(png, &pixels[4 * width * row]);
  png_write_end(png, NULL);
  png_destroy_write_struct(&png, &info);
  return writer->failed ? qmat_fail_memory(context, "the PNG file") : QMAT_OK;
}
