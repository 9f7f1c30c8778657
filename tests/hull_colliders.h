/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_TESTS_HULL_COLLIDERS_H
#define QMAT_TESTS_HULL_COLLIDERS_H

/* Colliders with hulls for tests. Include after cmocka. */

#include <string.h>

#include "core/value.h"

/* Sealed colliders of one body: 4 numbers per sphere, 3 ids per shape. The hull of shape i is this tetrahedron (4
 * points), moved by `apart` * i along each axis. */
static inline qmat_colliders *hull_colliders(const double *spheres, size_t sphere_count, const uint32_t *shapes,
                                             size_t shape_count, const double body[10], const double tetrahedron[12],
                                             double apart) {
  static const uint32_t faces[] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  qmat_context context = {0};
  qmat_colliders *c = qmat_colliders_new();
  assert_non_null(c);
  c->sphere_count = sphere_count;
  c->shape_count = shape_count;
  c->point_count = c->triangle_count = 4 * shape_count;
  c->body_count = 1;
  c->spheres = qmat_alloc(4 * sphere_count, sizeof(double));
  c->shapes = qmat_alloc(3 * shape_count, sizeof(uint32_t));
  c->points = qmat_alloc(12 * shape_count, sizeof(double));
  c->triangles = qmat_alloc(12 * shape_count, sizeof(uint32_t));
  c->hull_ends = qmat_alloc(2 * shape_count, sizeof(uint32_t));
  c->body = qmat_alloc(10, sizeof(double));
  memcpy(c->spheres, spheres, 4 * sphere_count * sizeof *spheres);
  memcpy(c->shapes, shapes, 3 * shape_count * sizeof *shapes);
  memcpy(c->body, body, 10 * sizeof *body);
  for (uint32_t i = 0; i < shape_count; i++) {
    for (uint32_t k = 0; k < 12; k++) {
      c->points[12 * i + k] = tetrahedron[k] + apart * i;
      c->triangles[12 * i + k] = faces[k] + 4 * i;
    }
    c->hull_ends[2 * i] = c->hull_ends[2 * i + 1] = 4 * (i + 1);
  }
  assert_int_equal(qmat_value_seal(&context, &c->base), QMAT_OK);
  qmat_context_uninit(&context);
  return c;
}

#endif
