/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <string.h>

#include "io/mesh/mesh_formats.h"
#include "io/scanner.h"

enum { HEADER = 84, FACET = 50 };

bool qmat_stl_is_binary(const qmat_bytes *bytes) {
  if (bytes->size < HEADER) return false;
  qmat_byte_reader reader = {.bytes = bytes->data, .size = bytes->size, .at = HEADER - 4};
  /* Four characters of ASCII text, read as a count, stand for more than 4 GiB: text is never taken for binary. */
  return bytes->size == HEADER + FACET * (uint64_t)qmat_take_u32(&reader);
}

static qmat_status add_triangle(qmat_context *context, qmat_soup *soup, const double points[9], int line) {
  if (soup->vertex_count > UINT32_MAX - 4) return qmat_fail_memory(context, "the vertices and facets");
  const uint32_t first = (uint32_t)soup->vertex_count, corners[3] = {first, first + 1, first + 2};
  qmat_status status = qmat_soup_add_vertices(context, soup, points, 3);
  if (status != QMAT_OK) return status;
  return qmat_soup_add_facet(context, soup, corners, 3, (uint32_t)soup->facet_count, line);
}

static qmat_status read_binary(qmat_context *context, const qmat_bytes *bytes, qmat_soup *soup) {
  qmat_byte_reader reader = {.bytes = bytes->data, .size = bytes->size, .at = HEADER - 4};
  size_t facets = qmat_take_u32(&reader);
  qmat_status status = qmat_soup_reserve(context, soup, 3 * facets, facets, 3 * facets);
  for (size_t f = 0; f < facets && status == QMAT_OK; f++) {
    double points[9];
    qmat_take_bytes(&reader, 12); /* the normal: the order of the corners implies it */
    for (int k = 0; k < 9; k++) points[k] = (double)qmat_take_f32(&reader);
    qmat_take_bytes(&reader, 2);
    status = add_triangle(context, soup, points, 0);
  }
  return status;
}

/* Takes the next token if it is `word` in upper or lower case. */
static bool take_word(qmat_scanner *scanner, const char *word) {
  if (!qmat_scan_find(scanner)) return false;
  const qmat_scanner start = *scanner;
  size_t length;
  const char *token = qmat_scan_token(scanner, &length);
  bool same = length == strlen(word);
  for (size_t i = 0; same && i < length; i++) same = (token[i] | 0x20) == word[i];
  if (!same) *scanner = start;
  return same;
}

static qmat_status expect(qmat_scanner *scanner, const char *word) {
  if (take_word(scanner, word)) return QMAT_OK;
  char quoted[16];
  snprintf(quoted, sizeof quoted, "'%s'", word);
  return qmat_scan_expected(scanner, quoted);
}

/* Reads "normal x y z", "outer loop", three vertices, "endloop" and "endfacet"; "facet" is taken. */
static qmat_status read_facet(qmat_scanner *scanner, qmat_soup *soup) {
  const int line = scanner->line;
  double points[9], normal;
  qmat_status status = expect(scanner, "normal");
  for (int k = 0; k < 3 && status == QMAT_OK; k++)
    status = qmat_scan_number(scanner, "a coordinate of a normal", &normal);
  if (status == QMAT_OK) status = expect(scanner, "outer");
  if (status == QMAT_OK) status = expect(scanner, "loop");
  for (int k = 0; k < 3 && status == QMAT_OK; k++) {
    status = expect(scanner, "vertex");
    if (status == QMAT_OK) status = qmat_scan_vertex(scanner, false, points + 3 * k);
  }
  if (status == QMAT_OK) status = expect(scanner, "endloop");
  if (status == QMAT_OK) status = expect(scanner, "endfacet");
  if (status != QMAT_OK) return qmat_fail_element(scanner->context, "facet", (int64_t)soup->facet_count);
  return add_triangle(scanner->context, soup, points, line);
}

/* Reads solids, each "solid NAME", facets, "endsolid NAME". */
static qmat_status read_ascii(qmat_scanner *scanner, qmat_soup *soup) {
  qmat_status status = QMAT_OK;
  do {
    status = expect(scanner, "solid");
    if (status != QMAT_OK) return status;
    qmat_scan_next_line(scanner);
    while (status == QMAT_OK && take_word(scanner, "facet")) status = read_facet(scanner, soup);
    if (status == QMAT_OK) status = expect(scanner, "endsolid");
    if (status == QMAT_OK) qmat_scan_next_line(scanner);
  } while (status == QMAT_OK && qmat_scan_find(scanner));
  return status;
}

qmat_status qmat_stl_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_soup *soup) {
  if (qmat_stl_is_binary(bytes)) return read_binary(context, bytes, soup);

  /* Binary files may start with "solid" too, but text has no zero bytes. */
  qmat_scanner scanner;
  qmat_scanner_init(&scanner, context, path, (const char *)bytes->data, bytes->size, 0);
  qmat_scanner first = scanner;
  bool text = take_word(&first, "solid") && !memchr(bytes->data, 0, bytes->size);
  if (text) return read_ascii(&scanner, soup);
  if (bytes->size < HEADER) {
    return qmat_fail_file(context, QMAT_ERROR_FORMAT, path,
                          "not an STL file: text starts with 'solid', and binary STL has at least %d bytes, not %zu",
                          HEADER, bytes->size);
  }
  qmat_byte_reader reader = {.bytes = bytes->data, .size = bytes->size, .at = HEADER - 4};
  const uint64_t facets = qmat_take_u32(&reader);
  return qmat_fail_file(context, QMAT_ERROR_FORMAT, path,
                        "the binary STL header counts %llu facets, which take %llu bytes, but the file has %zu",
                        (unsigned long long)facets, (unsigned long long)(HEADER + FACET * facets), bytes->size);
}
