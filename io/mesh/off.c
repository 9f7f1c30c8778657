/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <string.h>
#include <strings.h>

#include "io/mesh/mesh_formats.h"
#include "io/scanner.h"

/* Reads the keyword [ST][C][N][4][n]OFF; some writers write "off". A file without a keyword starts with its counts. In
 * files of ModelNet the first count follows OFF without a blank. */
static qmat_status read_keyword(qmat_scanner *scanner) {
  size_t length;
  if (!qmat_scan_find(scanner)) return qmat_scan_expected(scanner, "'OFF'");
  const qmat_scanner start = *scanner;
  const char *token = qmat_scan_token(scanner, &length);
  if (length > 3 && strncasecmp(token, "OFF", 3) == 0 && token[3] >= '0' && token[3] <= '9') {
    scanner->at = token + 3;
    return QMAT_OK;
  }
  if (length < 3 || strncasecmp(token + length - 3, "OFF", 3) != 0) {
    *scanner = start;
    return token[0] >= '0' && token[0] <= '9' ? QMAT_OK : qmat_scan_expected(scanner, "'OFF'");
  }
  const char *at = token, *end = token + length - 3;
  if (end - at >= 2 && memcmp(at, "ST", 2) == 0) at += 2;
  if (at < end && *at == 'C') at++;
  if (at < end && *at == 'N') at++;
  const bool four = at < end && *at == '4';
  if (four) at++;
  const bool n = at < end && *at == 'n';
  if (n) at++;
  if (at != end) return qmat_scan_expected(&start, "an OFF keyword");
  if (four || n) {
    return qmat_scan_fail(&start, "%sOFF is not supported: its vertices do not have three coordinates",
                          four ? "4" : "n");
  }
  qmat_scanner ahead = *scanner;
  if (qmat_scan_find_on_line(&ahead) && qmat_scan_word(&ahead, "BINARY"))
    return qmat_scan_fail(scanner, "binary OFF is not supported");
  return QMAT_OK;
}

/* Skips what else a line holds: normals, colours, texture coordinates. */
static void skip_rest_of_line(qmat_scanner *scanner) {
  if (qmat_scan_find_on_line(scanner)) qmat_scan_next_line(scanner);
}

static qmat_status read_vertices(qmat_scanner *scanner, size_t count, qmat_soup *soup) {
  for (size_t i = 0; i < count; i++) {
    double point[3];
    qmat_status status = qmat_scan_vertex(scanner, false, point);
    if (status != QMAT_OK) return qmat_fail_element(scanner->context, "vertex", (int64_t)i);
    skip_rest_of_line(scanner);
    status = qmat_soup_add_vertices(scanner->context, soup, point, 1);
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

static qmat_status read_facets(qmat_scanner *scanner, size_t count, qmat_soup *soup) {
  uint32_t *corners = NULL;
  size_t capacity = 0;
  qmat_status status = QMAT_OK;
  for (size_t f = 0; f < count && status == QMAT_OK; f++) {
    size_t size = 0;
    status = qmat_scan_count(scanner, "the number of corners of a facet", 2, &size);
    const int line = scanner->line;
    if (status == QMAT_OK && qmat_grow((void **)&corners, &capacity, size, sizeof *corners) != 0)
      status = qmat_fail_memory(scanner->context, "the corners of a facet");
    for (size_t k = 0; k < size && status == QMAT_OK; k++) {
      int64_t vertex = 0;
      status = qmat_scan_integer(scanner, "a vertex index", 0, (int64_t)soup->vertex_count - 1, &vertex);
      corners[k] = (uint32_t)vertex;
    }
    if (status != QMAT_OK) {
      qmat_fail_element(scanner->context, "facet", (int64_t)f);
      break;
    }
    skip_rest_of_line(scanner);
    status = qmat_soup_add_facet(scanner->context, soup, corners, size, (uint32_t)f, line);
  }
  qmat_free(corners);
  return status;
}

qmat_status qmat_off_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_soup *soup) {
  qmat_scanner scanner;
  qmat_scanner_init(&scanner, context, path, (const char *)bytes->data, bytes->size, '#');
  size_t vertices = 0, facets = 0;
  qmat_status status = read_keyword(&scanner);
  /* The shortest vertex is "0 0 0", the shortest facet "0", each with a line end. The edge count is ignored. */
  if (status == QMAT_OK) status = qmat_scan_count(&scanner, "the number of vertices", 6, &vertices);
  if (status == QMAT_OK) status = qmat_scan_count(&scanner, "the number of facets", 2, &facets);
  if (status != QMAT_OK) return status;
  skip_rest_of_line(&scanner);
  /* The shortest valid facet is "3 0 1 2": memory is reserved for that many only. */
  const size_t likely = facets < qmat_scan_left(&scanner) / 7 ? facets : qmat_scan_left(&scanner) / 7;
  status = qmat_soup_reserve(context, soup, vertices, likely, 3 * likely);
  if (status == QMAT_OK) status = read_vertices(&scanner, vertices, soup);
  if (status == QMAT_OK) status = read_facets(&scanner, facets, soup);
  if (status == QMAT_OK && qmat_scan_find(&scanner)) {
    status = qmat_scan_fail(&scanner, "the file continues after the %zu vertices and %zu facets of its header",
                            vertices, facets);
  }
  return status;
}
