/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/mesh/ply_medial.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/geometry/medial_build.h"
#include "io/scanner.h"

#define START "ply\nformat binary_little_endian 1.0\ncomment medial mesh\n"
#define VERTICES "property double x\nproperty double y\nproperty double z\nproperty double radius\n"
#define EDGES "property int vertex1\nproperty int vertex2\n"
#define FACES "property list uchar int vertex_indices\nend_header\n"

enum { SPHERE_SIZE = 32, EDGE_SIZE = 8, TRIANGLE_SIZE = 13 };

/* ---- writing ---- */

static void put_count(qmat_writer *writer, const char *element, size_t count) {
  qmat_put_text(writer, element);
  qmat_put_integer(writer, (int64_t)count);
  qmat_put_text(writer, "\n");
}

static void put_errors(qmat_writer *writer, const qmat_stated_errors *errors) {
  const struct {
    const char *key;
    double value;
  } numbers[] = {{"comment qmat_epsilon ", errors->epsilon},
                 {"comment qmat_error_out ", errors->error_out},
                 {"comment qmat_error_in ", errors->error_in}};
  for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
    if (!isfinite(numbers[i].value)) continue;
    qmat_put_text(writer, numbers[i].key);
    qmat_put_number(writer, numbers[i].value);
    qmat_put_text(writer, "\n");
  }
  if (errors->certified == QMAT_CERTIFICATE_UNKNOWN) return;
  qmat_put_text(writer, errors->certified == QMAT_CERTIFICATE_YES ? "comment qmat_certified true\n"
                                                                  : "comment qmat_certified false\n");
}

qmat_status qmat_ply_write_medial(qmat_context *context, const qmat_medial *medial, const qmat_stated_errors *errors,
                                  qmat_file **file) {
  *file = NULL;
  qmat_writer writer = {0};
  qmat_put_text(&writer, START);
  if (errors) put_errors(&writer, errors);
  put_count(&writer, "element vertex ", medial->sphere_count);
  qmat_put_text(&writer, VERTICES);
  put_count(&writer, "element edge ", medial->edge_count);
  qmat_put_text(&writer, EDGES);
  put_count(&writer, "element face ", medial->triangle_count);
  qmat_put_text(&writer, FACES);
  for (size_t i = 0; i < 4 * medial->sphere_count; i++) qmat_put_f64(&writer, medial->spheres[i]);
  for (size_t i = 0; i < 2 * medial->edge_count; i++) qmat_put_u32(&writer, medial->edges[i]);
  for (size_t i = 0; i < medial->triangle_count; i++) {
    qmat_put_u8(&writer, 3);
    for (size_t k = 0; k < 3; k++) qmat_put_u32(&writer, medial->triangles[3 * i + k]);
  }
  return qmat_writer_to_file(context, &writer, "ply", file);
}

/* ---- reading ---- */

typedef struct reader {
  qmat_context *context;
  const char *path, *at, *end;
} reader;

static qmat_status fail(const reader *r, const char *what) {
  qmat_fail(r->context, QMAT_ERROR_FORMAT, "%s", what);
  return qmat_fail_at(r->context, r->path, 0, 0);
}

/* Skips `text` if it comes next. */
static bool take(reader *r, const char *text) {
  const size_t length = strlen(text);
  if ((size_t)(r->end - r->at) < length || memcmp(r->at, text, length) != 0) return false;
  r->at += length;
  return true;
}

/* Reads the rest of the line and skips its end. False if it has no end or more than 63 characters. */
static bool take_line(reader *r, char line[64]) {
  const char *end = memchr(r->at, '\n', (size_t)(r->end - r->at));
  if (!end || end - r->at > 63) return false;
  memcpy(line, r->at, (size_t)(end - r->at));
  line[end - r->at] = '\0';
  r->at = end + 1;
  return true;
}

/* Reads a header line such as "element vertex 12" and skips `tail`. A count is at most the number of bytes left. */
static bool take_element(reader *r, const char *head, const char *tail, size_t *count) {
  char line[64];
  double number;
  if (!take(r, head) || !take_line(r, line)) return false;
  const char *after = qmat_scan_double(line, line + strlen(line), &number);
  if (!after || *after || !(number >= 0 && number <= (double)(r->end - r->at)) || number != floor(number)) return false;
  *count = (size_t)number;
  return take(r, tail);
}

/* Reads the comments with facts. */
static qmat_status take_facts(reader *r, json_t *facts) {
  char line[64];
  double number;
  while (take(r, "comment ")) {
    char *value = take_line(r, line) ? strchr(line, ' ') : NULL;
    if (!value || strncmp(line, "qmat_", 5) != 0) return fail(r, "a comment in the header was not written by qmat");
    *value++ = '\0';
    const char *after = qmat_scan_double(value, value + strlen(value), &number);
    const bool is_number = after && !*after && isfinite(number), is_true = strcmp(value, "true") == 0;
    if (!is_number && !is_true && strcmp(value, "false") != 0) return fail(r, "a comment in the header has no value");
    if (facts && json_object_set_new(facts, line, is_number ? json_real(number) : json_boolean(is_true)) != 0)
      return qmat_fail_memory(r->context, "facts");
  }
  return QMAT_OK;
}

/* Reads `count` simplices of `corners` sphere ids each. A face has a leading byte, 3. The caller frees the ids. */
static qmat_status take_ids(const reader *r, qmat_byte_reader *body, size_t count, size_t corners, size_t spheres,
                            uint32_t **ids) {
  *ids = qmat_alloc(count, corners * sizeof **ids);
  if (!*ids) return qmat_fail_memory(r->context, "a medial mesh");
  for (size_t i = 0; i < count; i++) {
    if (corners == 3 && qmat_take_u8(body) != 3) return fail(r, "a face is not a triangle");
    for (size_t k = 0; k < corners; k++) {
      (*ids)[corners * i + k] = qmat_take_u32(body);
      if ((*ids)[corners * i + k] >= spheres) return fail(r, "an edge or face refers to a sphere that does not exist");
    }
  }
  return QMAT_OK;
}

static qmat_status read_body(reader *r, size_t spheres, size_t edges, size_t triangles, qmat_medial *medial) {
  const size_t left = (size_t)(r->end - r->at);
  if (left != SPHERE_SIZE * spheres + EDGE_SIZE * edges + TRIANGLE_SIZE * triangles)
    return fail(r, "the size of the data differs from the header");
  qmat_byte_reader body = {.bytes = (const uint8_t *)r->at, .size = left};
  uint32_t *ends = NULL, *corners = NULL;
  medial->spheres = qmat_alloc(spheres, 4 * sizeof *medial->spheres);
  qmat_status status = medial->spheres ? QMAT_OK : qmat_fail_memory(r->context, "a medial mesh");
  if (status == QMAT_OK) medial->sphere_count = spheres;
  for (size_t i = 0; i < 4 * medial->sphere_count; i++) medial->spheres[i] = qmat_take_f64(&body);
  if (status == QMAT_OK) status = take_ids(r, &body, edges, 2, spheres, &ends);
  if (status == QMAT_OK) status = take_ids(r, &body, triangles, 3, spheres, &corners);
  if (status == QMAT_OK) status = qmat_medial_set_simplices(r->context, medial, ends, edges, corners, triangles);
  if (status == QMAT_OK) status = qmat_value_seal(r->context, &medial->base);
  qmat_free(corners);
  qmat_free(ends);
  return status == QMAT_OK ? status : qmat_fail_at(r->context, r->path, 0, 0);
}

qmat_status qmat_ply_read_medial(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_medial **medial,
                                 json_t *facts) {
  reader r = {.context = context,
              .path = path,
              .at = (const char *)bytes->data,
              .end = (const char *)bytes->data + bytes->size};
  size_t spheres = 0, edges = 0, triangles = 0;
  *medial = NULL;
  if (!take(&r, START)) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the PLY file has no medial mesh");
    return qmat_fail_at(context, path, 0, 0);
  }
  qmat_status status = take_facts(&r, facts);
  if (status != QMAT_OK) return status;
  if (!take_element(&r, "element vertex ", VERTICES, &spheres) || !take_element(&r, "element edge ", EDGES, &edges) ||
      !take_element(&r, "element face ", FACES, &triangles))
    return fail(&r, "the header is not that of a medial mesh written by qmat");
  qmat_medial *made = qmat_medial_new();
  status = made ? read_body(&r, spheres, edges, triangles, made) : qmat_fail_memory(context, "a medial mesh");
  if (status == QMAT_OK) {
    *medial = made;
  } else if (made) {
    qmat_value_release(&made->base);
  }
  return status;
}
