/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_TESTS_IO_MEDIAL_EXAMPLES_H
#define QMAT_TESTS_IO_MEDIAL_EXAMPLES_H

/* Sealed medial meshes for tests; release them. Include after cmocka. */

#include <math.h>
#include <string.h>

#include "tests/medial_meshes.h"

/* A spiral of `count` spheres: the first half in triangles, then edges that lie on none, and every seventh sphere
 * alone. One sphere is alone; three make one triangle. */
static inline qmat_medial *example_medial(size_t count) {
  double *spheres = qmat_alloc(4 * count, sizeof *spheres);
  uint32_t *edges = qmat_alloc(2 * count, sizeof *edges), *triangles = qmat_alloc(3 * count, sizeof *triangles);
  assert_true(spheres && edges && triangles);
  size_t edge_count = 0, triangle_count = 0;
  for (size_t i = 0; i < count; i++) {
    const double turn = 0.7 * (double)i, height = 0.05 * (double)i;
    const double sphere[4] = {cos(turn) * (1 + height), height, sin(turn), 0.1 + 0.03 * sin(3 * turn)};
    memcpy(spheres + 4 * i, sphere, sizeof sphere);
    const uint32_t id = (uint32_t)i;
    const bool alone = count > 3 && i % 7 == 6, next_alone = count > 3 && (i + 1) % 7 == 6;
    if (i + 2 < count && i < (count + 1) / 2 && !alone && !next_alone && !(count > 3 && (i + 2) % 7 == 6)) {
      const uint32_t t[3] = {id, id + 1, id + 2};
      memcpy(triangles + 3 * triangle_count++, t, sizeof t);
    } else if (i + 1 < count && i >= count / 2 && count > 3 && !alone && !next_alone) {
      const uint32_t e[2] = {id, id + 1};
      memcpy(edges + 2 * edge_count++, e, sizeof e);
    }
  }
  qmat_medial *medial = sealed_medial_mesh(spheres, count, edges, edge_count, triangles, triangle_count);
  qmat_free(spheres);
  qmat_free(edges);
  qmat_free(triangles);
  return medial;
}

#endif
