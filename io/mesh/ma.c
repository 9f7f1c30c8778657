/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/mesh/ma.h"

#include <math.h>

#include "core/geometry/medial_build.h"
#include "io/scanner.h"

static qmat_status read_sphere(qmat_scanner *scanner, double sphere[4]) {
  static const char *const names[4] = {"the x coordinate of a sphere", "the y coordinate of a sphere",
                                       "the z coordinate of a sphere", "the radius of a sphere"};
  for (int k = 0; k < 4; k++) {
    qmat_scan_find(scanner);
    const qmat_scanner here = *scanner;
    qmat_status status = qmat_scan_number(scanner, names[k], &sphere[k]);
    if (status != QMAT_OK) return status;
    if (!isfinite(sphere[k])) return qmat_scan_fail(&here, "%s is not finite", names[k]);
    if (k == 3 && sphere[k] < 0) return qmat_scan_fail(&here, "%s is negative", names[k]);
  }
  return QMAT_OK;
}

static qmat_status read_simplex(qmat_scanner *scanner, const char *name, size_t width, size_t sphere_count,
                                uint32_t *ids) {
  for (size_t k = 0; k < width; k++) {
    int64_t id = 0;
    qmat_status status = qmat_scan_integer(scanner, "a sphere index", 0, (int64_t)sphere_count - 1, &id);
    if (status != QMAT_OK) return status;
    ids[k] = (uint32_t)id;
    for (size_t j = 0; j < k; j++) {
      if (ids[j] == ids[k]) return qmat_scan_fail(scanner, "the %s has sphere %u twice", name, ids[k]);
    }
  }
  return QMAT_OK;
}

static qmat_status read_rows(qmat_scanner *scanner, const size_t counts[3], double *spheres, uint32_t *edges,
                             uint32_t *triangles) {
  static const char *const names[3] = {"sphere", "edge", "triangle"};
  size_t read[3] = {0, 0, 0};
  while (read[0] < counts[0] || read[1] < counts[1] || read[2] < counts[2]) {
    int kind = 0;
    if (qmat_scan_word(scanner, "e")) {
      kind = 1;
    } else if (qmat_scan_word(scanner, "f")) {
      kind = 2;
    } else if (!qmat_scan_word(scanner, "v")) {
      if (qmat_scan_find(scanner)) return qmat_scan_expected(scanner, "v, e or f");
      return qmat_scan_fail(scanner,
                            "the file ends after %zu of %zu spheres, %zu of %zu edges and %zu of %zu triangles",
                            read[0], counts[0], read[1], counts[1], read[2], counts[2]);
    }
    if (read[kind] == counts[kind])
      return qmat_scan_fail(scanner, "there are more than the %zu %ss of the header", counts[kind], names[kind]);
    size_t row = read[kind]++;
    qmat_status status = kind == 0   ? read_sphere(scanner, spheres + 4 * row)
                         : kind == 1 ? read_simplex(scanner, names[1], 2, counts[0], edges + 2 * row)
                                     : read_simplex(scanner, names[2], 3, counts[0], triangles + 3 * row);
    if (status != QMAT_OK) return qmat_fail_element(scanner->context, names[kind], (int64_t)row);
  }
  return qmat_scan_find(scanner) ? qmat_scan_expected(scanner, "the end of the file") : QMAT_OK;
}

qmat_status qmat_ma_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_medial **medial) {
  *medial = NULL;
  uint32_t *edges = NULL, *triangles = NULL;
  size_t counts[3] = {0, 0, 0};
  qmat_scanner scanner;
  qmat_scanner_init(&scanner, context, path, (const char *)bytes->data, bytes->size, '#');
  /* The shortest rows are "v 0 0 0 0", "e 0 1" and "f 0 1 2", each with a line end. */
  qmat_status status = qmat_scan_count(&scanner, "the number of spheres", 10, &counts[0]);
  if (status == QMAT_OK) status = qmat_scan_count(&scanner, "the number of edges", 6, &counts[1]);
  if (status == QMAT_OK) status = qmat_scan_count(&scanner, "the number of triangles", 8, &counts[2]);
  if (status != QMAT_OK) return status;
  if (counts[0] == 0) return qmat_scan_fail(&scanner, "the medial mesh has no spheres");

  qmat_medial *made = qmat_medial_new();
  edges = qmat_alloc(counts[1], 2 * sizeof *edges);
  triangles = qmat_alloc(counts[2], 3 * sizeof *triangles);
  if (made) made->spheres = qmat_alloc(counts[0], 4 * sizeof *made->spheres);
  if (!made || !made->spheres || !edges || !triangles) {
    status = qmat_fail_memory(context, "the medial mesh");
    goto done;
  }
  made->sphere_count = counts[0];
  status = read_rows(&scanner, counts, made->spheres, edges, triangles);
  if (status == QMAT_OK) status = qmat_medial_set_simplices(context, made, edges, counts[1], triangles, counts[2]);
  if (status == QMAT_OK) status = qmat_value_seal(context, &made->base);

done:
  qmat_free(edges);
  qmat_free(triangles);
  if (status == QMAT_OK) {
    *medial = made;
  } else if (made) {
    qmat_value_release(&made->base);
  }
  return status;
}

static void put_rows(qmat_writer *writer, const char *letter, const uint32_t *ids, size_t count, size_t width) {
  for (size_t i = 0; i < count; i++) {
    qmat_put_text(writer, letter);
    for (size_t k = 0; k < width; k++) {
      qmat_put_text(writer, " ");
      qmat_put_integer(writer, ids[width * i + k]);
    }
    qmat_put_text(writer, "\n");
  }
}

qmat_status qmat_ma_write(qmat_context *context, const qmat_medial *medial, qmat_file **file) {
  *file = NULL;
  qmat_writer writer = {0};
  const size_t counts[3] = {medial->sphere_count, medial->edge_count, medial->triangle_count};
  for (int k = 0; k < 3; k++) {
    qmat_put_integer(&writer, (int64_t)counts[k]);
    qmat_put_text(&writer, k < 2 ? " " : "\n");
  }
  for (size_t i = 0; i < medial->sphere_count; i++) {
    qmat_put_text(&writer, "v");
    for (size_t k = 0; k < 4; k++) {
      qmat_put_text(&writer, " ");
      qmat_put_number(&writer, medial->spheres[4 * i + k]);
    }
    qmat_put_text(&writer, "\n");
  }
  put_rows(&writer, "e", medial->edges, medial->edge_count, 2);
  put_rows(&writer, "f", medial->triangles, medial->triangle_count, 3);
  return qmat_writer_to_file(context, &writer, "ma", file);
}
