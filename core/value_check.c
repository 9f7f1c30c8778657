/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/value_check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/text.h"

qmat_status qmat_check_finite(qmat_context *context, const double *numbers, size_t count, size_t components,
                              const char *kind, const char *what) {
  for (size_t i = 0; i < count * components; i++) {
    if (isfinite(numbers[i])) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the %s is not finite", what);
    return qmat_fail_element(context, kind, (int64_t)(i / components));
  }
  return QMAT_OK;
}

qmat_status qmat_check_length(qmat_context *context, double length, const char *field) {
  if (length >= 0 && isfinite(length)) return QMAT_OK;
  qmat_fail(context, QMAT_ERROR_GEOMETRY, "it is negative or not finite");
  return qmat_fail_field(context, field);
}

qmat_status qmat_check_skin(qmat_context *context, const uint32_t *joints, const double *weights, size_t skinned_count,
                            size_t count, const char *kind) {
  enum { JOINTS = 65536 }; /* glTF stores joints in 16 bits at most */
  if (skinned_count != 0 && skinned_count != count) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "%zu of %zu elements have joints and weights", skinned_count, count);
    return qmat_fail_field(context, "joints");
  }
  qmat_status status = qmat_check_ids(context, joints, 4 * skinned_count, JOINTS, kind, 4, "joint");
  if (status == QMAT_OK) status = qmat_check_finite(context, weights, skinned_count, 4, kind, "weight");
  for (size_t i = 0; i < skinned_count && status == QMAT_OK; i++) {
    const double *w = weights + 4 * i;
    const bool is_positive = w[0] >= 0 && w[1] >= 0 && w[2] >= 0 && w[3] >= 0;
    if (is_positive && fabs(w[0] + w[1] + w[2] + w[3] - 1) <= 1e-9) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "its weights are negative or do not sum to 1");
    status = qmat_fail_element(context, kind, (int64_t)i);
  }
  return status;
}

qmat_status qmat_check_u32_count(qmat_context *context, size_t count, const char *what) {
  if (count <= UINT32_MAX) return QMAT_OK;
  return qmat_fail(context, QMAT_ERROR_MEMORY, "%zu %s are more than 32-bit indices can address", count, what);
}

qmat_status qmat_check_utf8(qmat_context *context, const char *text, const char *what) {
  if (qmat_is_utf8(text)) return QMAT_OK;
  return qmat_fail(context, QMAT_ERROR_FORMAT, "the %s is not valid UTF-8", what);
}

static int compare_part_names(const void *a, const void *b) {
  const qmat_file_part *first = *(const qmat_file_part *const *)a, *second = *(const qmat_file_part *const *)b;
  const int order = strcmp(first->name, second->name);
  return order != 0 ? order : (first > second) - (first < second); /* equal names stay in file order */
}

qmat_status qmat_check_parts(qmat_context *context, const qmat_file_part *parts, size_t part_count) {
  for (size_t i = 0; i < part_count; i++) {
    const char *name = parts[i].name;
    const qmat_status status = qmat_check_utf8(context, name, "name");
    if (status != QMAT_OK) return qmat_fail_element(context, "part", (int64_t)i);
    if ((name[0] == '\0') != (i == 0)) {
      qmat_fail(context, QMAT_ERROR_FORMAT, i == 0 ? "the main part has a name of its own" : "it has no name");
      return qmat_fail_element(context, "part", (int64_t)i);
    }
    if (i > 0 && !qmat_is_part_name(name)) {
      qmat_fail(context, QMAT_ERROR_FORMAT, "its name '%s' is not a path below the main part's folder", name);
      return qmat_fail_element(context, "part", (int64_t)i);
    }
  }
  const qmat_file_part **sorted = qmat_alloc(part_count, sizeof *sorted);
  if (!sorted) return qmat_fail_memory(context, "the names of a file's parts");
  for (size_t i = 0; i < part_count; i++) sorted[i] = &parts[i];
  qsort(sorted, part_count, sizeof *sorted, compare_part_names);
  size_t repeated = SIZE_MAX;
  for (size_t i = 1; i < part_count; i++) {
    const size_t part = (size_t)(sorted[i] - parts);
    if (strcmp(sorted[i - 1]->name, sorted[i]->name) == 0 && part < repeated) repeated = part;
  }
  qmat_free(sorted);
  if (repeated == SIZE_MAX) return QMAT_OK;
  qmat_fail(context, QMAT_ERROR_FORMAT, "the name '%s' is used twice", parts[repeated].name);
  return qmat_fail_element(context, "part", (int64_t)repeated);
}

qmat_status qmat_check_ids(qmat_context *context, const uint32_t *ids, size_t length, size_t count, const char *kind,
                           size_t components, const char *of) {
  for (size_t i = 0; i < length; i++) {
    if (ids[i] < count) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "it names %s %u of %zu", of, ids[i], count);
    return qmat_fail_element(context, kind, (int64_t)(i / components));
  }
  return QMAT_OK;
}

qmat_status qmat_check_spheres(qmat_context *context, const double *spheres, size_t count, const char *kind) {
  const qmat_status status = qmat_check_finite(context, spheres, count, 4, kind, "centre or radius");
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < count; i++) {
    if (spheres[4 * i + 3] >= 0) continue;
    char number[32];
    qmat_format_number(spheres[4 * i + 3], number, sizeof number);
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the radius %s is negative", number);
    return qmat_fail_element(context, kind, (int64_t)i);
  }
  return QMAT_OK;
}

/* Lexicographic order of two groups of `width` indices. */
static int compare_ids(const uint32_t *a, const uint32_t *b, size_t width) {
  for (size_t i = 0; i < width; i++) {
    if (a[i] != b[i]) return a[i] < b[i] ? -1 : 1;
  }
  return 0;
}

qmat_status qmat_check_simplices(qmat_context *context, const uint32_t *simplices, size_t count, size_t width,
                                 size_t sphere_count, const char *kind) {
  for (size_t i = 0; i < count; i++) {
    const uint32_t *ids = simplices + width * i;
    for (size_t k = 0; k < width; k++) {
      if (ids[k] >= sphere_count) {
        qmat_fail(context, QMAT_ERROR_GEOMETRY, "it names sphere %u of %zu", ids[k], sphere_count);
        return qmat_fail_element(context, kind, (int64_t)i);
      }
      if (k > 0 && ids[k - 1] >= ids[k]) {
        qmat_fail(context, QMAT_ERROR_GEOMETRY, "its spheres %u and %u are not in ascending order", ids[k - 1], ids[k]);
        return qmat_fail_element(context, kind, (int64_t)i);
      }
    }
    const int order = i == 0 ? -1 : compare_ids(ids - width, ids, width);
    if (order < 0) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY,
              order == 0 ? "it repeats the previous %s" : "it sorts before the previous %s", kind);
    return qmat_fail_element(context, kind, (int64_t)i);
  }
  return QMAT_OK;
}

size_t qmat_simplex_find(const uint32_t *rows, size_t count, size_t width, const uint32_t *row) {
  size_t low = 0, high = count;
  while (low < high) {
    const size_t middle = low + (high - low) / 2;
    const uint32_t *at = &rows[width * middle];
    size_t k = 0;
    while (k < width && at[k] == row[k]) k++;
    if (k == width) return middle;
    if (at[k] < row[k])
      low = middle + 1;
    else
      high = middle;
  }
  return SIZE_MAX;
}

qmat_status qmat_check_sides(qmat_context *context, const uint32_t *edges, size_t edge_count, const uint32_t *triangles,
                             size_t triangle_count) {
  static const int sides[3][2] = {{0, 1}, {0, 2}, {1, 2}};
  for (size_t i = 0; i < triangle_count; i++) {
    for (int k = 0; k < 3; k++) {
      const uint32_t side[2] = {triangles[3 * i + (size_t)sides[k][0]], triangles[3 * i + (size_t)sides[k][1]]};
      if (qmat_simplex_find(edges, edge_count, 2, side) != SIZE_MAX) continue;
      qmat_fail(context, QMAT_ERROR_GEOMETRY, "its side (%u, %u) is not among the edges", side[0], side[1]);
      return qmat_fail_element(context, "triangle", (int64_t)i);
    }
  }
  return QMAT_OK;
}
