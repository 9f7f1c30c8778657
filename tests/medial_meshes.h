/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_TESTS_MEDIAL_MESHES_H
#define QMAT_TESTS_MEDIAL_MESHES_H

/* Medial meshes for tests. Include after cmocka. */

#include <string.h>

#include "core/geometry/medial_build.h"

/* An unsealed medial mesh; the sides of triangles are added. Without `spheres` (NULL) sphere i is (i, 0, 0, 1). */
static inline qmat_medial *medial_mesh(const double *spheres, size_t sphere_count, const uint32_t *edges,
                                       size_t edge_count, const uint32_t *triangles, size_t triangle_count) {
  qmat_context context = {0};
  qmat_medial *medial = qmat_medial_new();
  assert_non_null(medial);
  medial->sphere_count = sphere_count;
  medial->spheres = qmat_alloc(4 * sphere_count, sizeof *medial->spheres);
  assert_non_null(medial->spheres);
  for (size_t i = 0; i < sphere_count; i++) {
    const double in_a_row[4] = {(double)i, 0, 0, 1};
    memcpy(&medial->spheres[4 * i], spheres ? &spheres[4 * i] : in_a_row, sizeof in_a_row);
  }
  assert_int_equal(qmat_medial_set_simplices(&context, medial, edges, edge_count, triangles, triangle_count), QMAT_OK);
  qmat_context_uninit(&context);
  return medial;
}

/* The same, sealed. */
static inline qmat_medial *sealed_medial_mesh(const double *spheres, size_t sphere_count, const uint32_t *edges,
                                              size_t edge_count, const uint32_t *triangles, size_t triangle_count) {
  qmat_context context = {0};
  qmat_medial *medial = medial_mesh(spheres, sphere_count, edges, edge_count, triangles, triangle_count);
  assert_int_equal(qmat_value_seal(&context, &medial->base), QMAT_OK);
  qmat_context_uninit(&context);
  return medial;
}

static inline void medial_must_have(const qmat_medial *medial, size_t spheres, size_t edges, size_t triangles) {
  assert_int_equal(medial->sphere_count, spheres);
  assert_int_equal(medial->edge_count, edges);
  assert_int_equal(medial->triangle_count, triangles);
}

#endif
