/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_TESTS_IO_FILES_H
#define QMAT_TESTS_IO_FILES_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "core/hash.h"
#include "io/bytes.h"
#include "io/soup.h"

typedef qmat_status read_function(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_soup *soup);

/* A file in memory of exactly the promised size, so that the address sanitizer sees reads beyond it. Free with
 * free(bytes.data). */
static inline qmat_bytes memory_file(const void *content, size_t size) {
  qmat_bytes bytes = {.size = size, .data = calloc(size + 16, 1)};
  assert_non_null(bytes.data);
  if (size > 0) memcpy(bytes.data, content, size);
  return bytes;
}

static inline qmat_status read_bytes(read_function *reader, qmat_context *context, const void *content, size_t size,
                                     qmat_soup *soup) {
  qmat_bytes bytes = memory_file(content, size);
  *soup = (qmat_soup){0};
  qmat_status status = reader(context, &bytes, "file", soup);
  free(bytes.data);
  return status;
}

/* Reads text that must be good, or fails the test with the message. */
static inline qmat_soup read_good(read_function *reader, const void *content, size_t size) {
  qmat_context context = {0};
  qmat_soup soup;
  if (read_bytes(reader, &context, content, size, &soup) != QMAT_OK) {
    char text[1024];
    qmat_error_format(&context.error, text, sizeof text);
    fail_msg("%s", text);
  }
  qmat_context_uninit(&context);
  return soup;
}

/* Reads text that must be refused with exactly this error line. */
static inline void assert_refused(read_function *reader, const void *content, size_t size, const char *expected) {
  qmat_context context = {0};
  qmat_soup soup;
  char text[1024];
  assert_int_not_equal(read_bytes(reader, &context, content, size, &soup), QMAT_OK);
  qmat_error_format(&context.error, text, sizeof text);
  assert_string_equal(text, expected);
  qmat_soup_uninit(&soup);
  qmat_context_uninit(&context);
}

static inline void assert_text_refused(read_function *reader, const char *content, const char *expected) {
  assert_refused(reader, content, strlen(content), expected);
}

/* Reads bytes that may be anything, and makes a mesh of them if they can be read: must end with a result or an error.
 */
static inline void try_hostile(read_function *reader, const void *content, size_t size) {
  qmat_context context = {0};
  qmat_soup soup;
  qmat_status status = read_bytes(reader, &context, content, size, &soup);
  for (int drop = 0; drop < 2 && status == QMAT_OK; drop++) {
    const qmat_read_options options = {.defects = drop ? QMAT_DEFECTS_DROP : QMAT_DEFECTS_REFUSE};
    qmat_mesh *mesh = NULL;
    qmat_status made = qmat_soup_to_mesh(&context, &soup, "file", &options, &mesh, NULL);
    assert_true((made == QMAT_OK) == (mesh != NULL));
    if (mesh) qmat_value_release(&mesh->base);
    if (made != QMAT_OK) assert_true(context.error.message[0] != '\0');
  }
  if (status != QMAT_OK) {
    assert_int_equal(status, context.error.status);
    assert_true(context.error.message[0] != '\0');
    assert_string_equal(context.error.file, "file");
  }
  qmat_soup_uninit(&soup);
  qmat_context_uninit(&context);
}

/* Every beginning of the file, and many copies with bytes that were changed. */
static inline void try_damaged(read_function *reader, const void *content, size_t size) {
  for (size_t cut = 0; cut <= size; cut++) try_hostile(reader, content, cut);
  uint8_t *copy = malloc(size + 1);
  assert_non_null(copy);
  for (uint64_t round = 0; round < 3000; round++) {
    memcpy(copy, content, size);
    for (uint64_t k = 0; k <= round % 4; k++) {
      uint64_t random = qmat_hash3(1, round, k);
      uint8_t byte = (uint8_t)(random >> 32);
      static const char common[] = "0123456789-+.e \n\t/#\\";
      if (random >> 63) byte = (uint8_t)common[byte % (sizeof common - 1)];
      copy[random % size] = byte;
    }
    try_hostile(reader, copy, size);
  }
  free(copy);
}

/* A new folder for files; remove what is in it, then the folder itself with rmdir. */
static inline void make_folder(char path[64]) {
  strcpy(path, "/tmp/qmat-test-XXXXXX");
  assert_non_null(mkdtemp(path));
}

static inline void write_file(const char *path, const void *content, size_t size) {
  FILE *file = fopen(path, "wb");
  assert_non_null(file);
  assert_int_equal(fwrite(content, 1, size, file), size);
  assert_int_equal(fclose(file), 0);
}

static inline void assert_positions(const double *positions, const double *expected, size_t count) {
  for (size_t i = 0; i < count; i++) {
    if (positions[i] != expected[i]) fail_msg("number %zu is %.17g, not %.17g", i, positions[i], expected[i]);
  }
}

#endif
