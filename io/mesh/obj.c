/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <string.h>

#include "io/mesh/mesh_formats.h"
#include "io/scanner.h"

/* Reads the signed whole number at `*at`; false when there is none or it has more than 18 digits. */
static bool read_reference(const char **at, int64_t *number) {
  bool negative = **at == '-';
  const char *digit = *at + (negative || **at == '+'), *first = digit;
  *number = 0;
  for (; *digit >= '0' && *digit <= '9' && digit - first < 18; digit++) *number = *number * 10 + (*digit - '0');
  if (negative) *number = -*number;
  *at = digit;
  return digit > first && !(*digit >= '0' && *digit <= '9');
}

/* Reads the corner v, v/vt, v//vn or v/vt/vn that the token at `scanner` is. */
static qmat_status read_corner(const qmat_scanner *scanner, const char *token, size_t length, size_t vertex_count,
                               uint32_t *corner) {
  const char *at = token, *end = token + length;
  int64_t number = 0, other;
  bool good = read_reference(&at, &number);
  for (int slashes = 0; good && at < end; slashes++) {
    good = *at++ == '/' && slashes < 2;
    if (good && at < end && *at != '/') good = read_reference(&at, &other);
  }
  if (!good || at != end) return qmat_scan_expected(scanner, "a corner v, v/vt, v//vn or v/vt/vn");
  if (number == 0) return qmat_scan_fail(scanner, "a vertex index is 0, but OBJ counts vertices from 1");
  int64_t vertex = number > 0 ? number - 1 : (int64_t)vertex_count + number;
  if (vertex < 0 || vertex >= (int64_t)vertex_count) {
    return qmat_scan_fail(scanner, "a vertex index is %lld, but %zu vertices precede it", (long long)number,
                          vertex_count);
  }
  *corner = (uint32_t)vertex;
  return QMAT_OK;
}

/* Reads the corners of a facet, whose keyword is taken. */
static qmat_status read_facet(qmat_scanner *scanner, qmat_soup *soup, uint32_t **corners, size_t *capacity) {
  const int line = scanner->line;
  size_t count = 0;
  while (qmat_scan_find_on_line(scanner)) {
    const qmat_scanner here = *scanner;
    size_t length;
    const char *token = qmat_scan_token_on_line(scanner, &length);
    if (qmat_grow((void **)corners, capacity, count + 1, sizeof **corners) != 0)
      return qmat_fail_memory(scanner->context, "the corners of a facet");
    qmat_status status = read_corner(&here, token, length, soup->vertex_count, &(*corners)[count++]);
    if (status != QMAT_OK) return qmat_fail_element(scanner->context, "facet", (int64_t)soup->facet_count);
  }
  return qmat_soup_add_facet(scanner->context, soup, *corners, count, (uint32_t)soup->facet_count, line);
}

qmat_status qmat_obj_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_soup *soup) {
  static const char *const free_form[] = {"surf", "bzp", "bsp", "cdc"}; /* "surf" and its predecessors */
  qmat_status status = QMAT_OK;
  uint32_t *corners = NULL;
  size_t capacity = 0;
  qmat_scanner scanner;
  qmat_scanner_init(&scanner, context, path, (const char *)bytes->data, bytes->size, '#');
  scanner.joins_lines = true;

  while (status == QMAT_OK && qmat_scan_find(&scanner)) {
    const qmat_scanner statement = scanner;
    size_t length;
    const char *word = qmat_scan_token_on_line(&scanner, &length);
    if (qmat_is_word(word, length, "v")) {
      double point[3];
      status = qmat_scan_vertex(&scanner, true, point);
      if (status != QMAT_OK) qmat_fail_element(context, "vertex", (int64_t)soup->vertex_count);
      if (status == QMAT_OK) status = qmat_soup_add_vertices(context, soup, point, 1);
    } else if (qmat_is_word(word, length, "f") || qmat_is_word(word, length, "fo")) { /* "fo": before version 3 */
      status = read_facet(&scanner, soup, &corners, &capacity);
    } else if (qmat_is_word(word, length, "call")) {
      status = qmat_scan_fail(&statement, "calls of other files are not supported");
    }
    for (size_t i = 0; i < sizeof free_form / sizeof free_form[0]; i++) {
      if (!qmat_is_word(word, length, free_form[i])) continue;
      status = qmat_scan_fail(&statement, "free-form surfaces are not supported");
      qmat_fail_hint(context, "export the model as polygons");
    }
    /* Skips the rest of the line: weights and colours, groups, materials, lines, points. */
    if (status == QMAT_OK) qmat_scan_next_line(&scanner);
  }
  qmat_free(corners);
  return status;
}
