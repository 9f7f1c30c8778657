/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <string.h>

#include "io/mesh/mesh_formats.h"
#include "io/scanner.h"

static qmat_status read_vertex(qmat_scanner *scanner, qmat_soup *soup) {
  static const char *const names[3] = {"the x coordinate of a vertex", "the y coordinate of a vertex",
                                       "the z coordinate of a vertex"};
  double point[3] = {0, 0, 0};
  for (int k = 0; k < 3; k++) {
    if (!qmat_scan_find_on_line(scanner)) return qmat_scan_fail(scanner, "the line ends before %s", names[k]);
    qmat_status status = qmat_scan_number(scanner, names[k], &point[k]);
    if (status != QMAT_OK) return status;
  }
  return qmat_soup_add_vertices(scanner->context, soup, point, 1);
}

/* A signed whole number at `*at`; false when there is none or it is too long. */
static bool read_reference(const char **at, int64_t *number) {
  bool negative = **at == '-';
  const char *digit = *at + (negative || **at == '+'), *first = digit;
  *number = 0;
  for (; *digit >= '0' && *digit <= '9' && digit - first < 18; digit++) *number = *number * 10 + (*digit - '0');
  if (negative) *number = -*number;
  *at = digit;
  return digit > first && !(*digit >= '0' && *digit <= '9');
}

/* A corner v, v/vt, v//vn or v/vt/vn; the token is `length` bytes. */
static qmat_status read_corner(qmat_scanner *scanner, const char *token, size_t length, size_t vertex_count,
                               uint32_t *corner) {
  const char *at = token, *end = token + length;
  const int shown = length < 24 ? (int)length : 24;
  int64_t number = 0, other;
  bool good = read_reference(&at, &number);
  for (int slashes = 0; good && at < end; slashes++) {
    good = *at++ == '/' && slashes < 2;
    if (good && at < end && *at != '/') good = read_reference(&at, &other);
  }
  if (!good || at != end) {
    return qmat_scan_fail(scanner, "'%.*s' is no corner of a facet: v, v/vt, v//vn or v/vt/vn", shown, token);
  }
  if (number == 0) return qmat_scan_fail(scanner, "vertex 0 is named, but OBJ counts vertices from 1");
  int64_t vertex = number > 0 ? number - 1 : (int64_t)vertex_count + number;
  if (vertex < 0 || vertex >= (int64_t)vertex_count) {
    return qmat_scan_fail(scanner, "vertex %lld is named, but %zu are defined so far", (long long)number, vertex_count);
  }
  *corner = (uint32_t)vertex;
  return QMAT_OK;
}

qmat_status qmat_obj_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_soup *soup) {
  qmat_status status = QMAT_OK;
  uint32_t *corners = NULL, facet = 0;
  size_t capacity = 0;
  qmat_scanner scanner;
  qmat_scanner_init(&scanner, context, path, (const char *)bytes->data, bytes->size, '#');
  scanner.joins_lines = true;

  while (status == QMAT_OK && qmat_scan_find(&scanner)) {
    const qmat_scanner statement = scanner;
    size_t length;
    const char *word = qmat_scan_token_on_line(&scanner, &length);
    if (length == 1 && word[0] == 'v') {
      status = read_vertex(&scanner, soup);
      if (status != QMAT_OK) qmat_fail_element(context, "vertex", (int64_t)soup->vertex_count);
    } else if (length == 1 && word[0] == 'f') {
      size_t count = 0;
      while (status == QMAT_OK && qmat_scan_find_on_line(&scanner)) {
        const qmat_scanner here = scanner;
        const char *token = qmat_scan_token_on_line(&scanner, &length);
        if (qmat_grow((void **)&corners, &capacity, count + 1, sizeof *corners) != 0) {
          status = qmat_fail_memory(context, "the corners of a facet");
        } else {
          qmat_scanner place = here;
          status = read_corner(&place, token, length, soup->vertex_count, &corners[count++]);
        }
      }
      if (status != QMAT_OK) {
        qmat_fail_element(context, "facet", facet);
        break;
      }
      status = qmat_soup_add_facet(context, soup, corners, count, facet++, statement.line);
    } else if (length == 4 && memcmp(word, "surf", 4) == 0) {
      status = qmat_scan_fail(&statement, "free-form surfaces are not read");
      qmat_fail_hint(context, "export the model as polygons");
    } else if (length == 4 && memcmp(word, "call", 4) == 0) {
      status = qmat_scan_fail(&statement, "calls of other files are not read");
    }
    /* What is left of the line: weights and colours, groups, materials, lines, points. */
    if (status == QMAT_OK) qmat_scan_next_line(&scanner);
  }
  qmat_free(corners);
  return status;
}
