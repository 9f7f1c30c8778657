/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_FLAT_MEDIAL_H
#define QMAT_IO_FLAT_MEDIAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/value.h"

/* Medial meshes as plain numbers, which readers decode without a library. examples/readers/FORMAT.md is the description
 * of the layout. */

/* Data of each sphere beside its centre and radius. A zeroed one says that there are none. */
typedef struct qmat_sphere_data {
  const double *errors;   /* sphere_count, at least 0, model units: bound on the distance to the envelope of the part of
                           * the surface that the sphere answers for; NULL: not known */
  const uint16_t *joints; /* 4 * sphere_count; NULL: none */
  const double *weights;  /* 4 * sphere_count, at least 0, not all 0; with `joints` */
} qmat_sphere_data;

/* Encodes a medial mesh and the data of its spheres. Centres are relative to `origin` (3 numbers; NULL: zero).
 * Spheres keep their order; the simplices are those of qmat_medial_faces. With `floats`, coordinates and radii are
 * single precision; otherwise they are 16-bit numbers with an offset and a scale for each axis and for the radius. Each
 * error is raised by the move of storage and rounded up. The four 16-bit weights of a sphere sum to 65535. `*bytes` is
 * NULL on failure; free it with qmat_free. QMAT_ERROR_GEOMETRY: no spheres, numbers beyond single precision, a missing
 * edge; QMAT_ERROR_MEMORY. The same bytes for the same input. Cost: linear, and a binary search per side of a triangle.
 */
qmat_status qmat_flat_encode(qmat_context *context, const qmat_medial *medial, const qmat_sphere_data *data,
                             const double *origin, bool floats, uint8_t **bytes, size_t *size);

/* Decodes `size` bytes of qmat_flat_encode with the same origin into a sealed medial mesh, without the data of its
 * spheres. Sizes and ids are checked before use: QMAT_ERROR_FORMAT says what is wrong, QMAT_ERROR_GEOMETRY which sphere
 * or simplex is. `*medial` is NULL on failure; the caller releases it. Cost: linear. */
qmat_status qmat_flat_decode(qmat_context *context, const uint8_t *bytes, size_t size, const double *origin,
                             qmat_medial **medial);

#endif
