/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <string.h>

#include "io/mesh/mesh_formats.h"
#include "io/scanner.h"

/* The keyword [ST][C][N][4][n]OFF and what follows it on its line. A file without a keyword starts with its counts. */
static qmat_status read_keyword(qmat_scanner *scanner) {
  size_t length;
  const qmat_scanner start = *scanner;
  const char *token = qmat_scan_token(scanner, &length);
  if (length == 0) return qmat_scan_fail(&start, "the file holds nothing but comments");
  if (length < 3 || memcmp(token + length - 3, "OFF", 3) != 0) {
    if (token[0] >= '0' && token[0] <= '9') {
      *scanner = start;
      return QMAT_OK;
    }
    *scanner = start;
    qmat_scan_find(scanner);
    return qmat_scan_fail(scanner, "this is no OFF file: it does not start with 'OFF'");
  }
  const char *at = token, *end = token + length - 3;
  if (end - at >= 2 && memcmp(at, "ST", 2) == 0) at += 2;
  if (at < end && *at == 'C') at++;
  if (at < end && *at == 'N') at++;
  bool four = at < end && *at == '4';
  if (four) at++;
  bool n = at < end && *at == 'n';
  if (n) at++;
  if (at != end) {
    *scanner = start;
    qmat_scan_find(scanner);
    return qmat_scan_fail(scanner, "this is no OFF file: '%.*s' is no OFF keyword", length < 24 ? (int)length : 24,
                          token);
  }
  if (four || n) {
    *scanner = start;
    qmat_scan_find(scanner);
    return qmat_scan_fail(scanner, "%sOFF files, whose vertices do not have three coordinates, are not read",
                          four ? "4" : "n");
  }
  qmat_scanner ahead = *scanner;
  if (qmat_scan_find_on_line(&ahead) && qmat_scan_word(&ahead, "BINARY")) {
    return qmat_scan_fail(scanner, "binary OFF files are not read");
  }
  return QMAT_OK;
}

/* Passes over what a line holds besides: normals, colours, texture coordinates. */
static void skip_rest_of_line(qmat_scanner *scanner) {
  if (qmat_scan_find_on_line(scanner)) qmat_scan_next_line(scanner);
}

qmat_status qmat_off_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_soup *soup) {
  uint32_t *corners = NULL;
  size_t capacity = 0;
  qmat_scanner scanner;
  qmat_scanner_init(&scanner, context, path, (const char *)bytes->data, bytes->size, '#');
  qmat_status status = read_keyword(&scanner);
  if (status != QMAT_OK) return status;

  /* "0 0 0" and a line end make a vertex, a digit and a line end the least facet. The edge count means nothing. */
  int64_t vertices = 0, facets = 0;
  status = qmat_scan_integer(&scanner, "the number of vertices", 0, UINT32_MAX - 1, &vertices);
  if (status != QMAT_OK) return status;
  if ((uint64_t)vertices > qmat_scan_left(&scanner) / 6) {
    return qmat_scan_fail(&scanner, "the header counts %lld vertices, more than the file can hold",
                          (long long)vertices);
  }
  status = qmat_scan_integer(&scanner, "the number of facets", 0, UINT32_MAX - 1, &facets);
  if (status != QMAT_OK) return status;
  if ((uint64_t)facets > qmat_scan_left(&scanner) / 2) {
    return qmat_scan_fail(&scanner, "the header counts %lld facets, more than the file can hold", (long long)facets);
  }
  skip_rest_of_line(&scanner);
  /* "3 0 1 2" is the least good facet: no memory for more of them. */
  const size_t likely = (size_t)facets < qmat_scan_left(&scanner) / 7 ? (size_t)facets : qmat_scan_left(&scanner) / 7;
  status = qmat_soup_reserve(context, soup, (size_t)vertices, likely, 3 * likely);
  if (status != QMAT_OK) return status;

  for (int64_t i = 0; i < vertices; i++) {
    double point[3];
    status = qmat_scan_number(&scanner, "the x coordinate of a vertex", &point[0]);
    if (status == QMAT_OK) status = qmat_scan_number(&scanner, "the y coordinate of a vertex", &point[1]);
    if (status == QMAT_OK) status = qmat_scan_number(&scanner, "the z coordinate of a vertex", &point[2]);
    if (status != QMAT_OK) return qmat_fail_element(context, "vertex", i);
    skip_rest_of_line(&scanner);
    status = qmat_soup_add_vertices(context, soup, point, 1);
    if (status != QMAT_OK) return status;
  }

  for (int64_t f = 0; f < facets && status == QMAT_OK; f++) {
    int64_t count = 0;
    status = qmat_scan_integer(&scanner, "the number of corners of a facet", 0, UINT32_MAX, &count);
    int line = scanner.line;
    if (status == QMAT_OK && (uint64_t)count > qmat_scan_left(&scanner) / 2) {
      status = qmat_scan_fail(&scanner, "the facet counts %lld corners, more than the file can hold", (long long)count);
    }
    if (status == QMAT_OK && qmat_grow((void **)&corners, &capacity, (size_t)count, sizeof *corners) != 0) {
      status = qmat_fail_memory(context, "the corners of a facet");
    }
    for (int64_t k = 0; k < count && status == QMAT_OK; k++) {
      int64_t vertex = 0;
      status = qmat_scan_integer(&scanner, "the number of a vertex", 0, vertices - 1, &vertex);
      if (status == QMAT_OK) corners[k] = (uint32_t)vertex;
    }
    if (status != QMAT_OK) {
      qmat_fail_element(context, "facet", f);
      break;
    }
    skip_rest_of_line(&scanner);
    status = qmat_soup_add_facet(context, soup, corners, (size_t)count, (uint32_t)f, line);
  }
  if (status == QMAT_OK && qmat_scan_find(&scanner)) {
    status = qmat_scan_fail(&scanner, "the file goes on after the %lld vertices and %lld facets of its header",
                            (long long)vertices, (long long)facets);
  }
  qmat_free(corners);
  return status;
}
