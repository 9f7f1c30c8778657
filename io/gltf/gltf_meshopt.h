/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_MESHOPT_H
#define QMAT_IO_GLTF_GLTF_MESHOPT_H

#include <stddef.h>
#include <stdint.h>

#include "core/context.h"

#define QMAT_GLTF_MESHOPT "EXT_meshopt_compression"

typedef enum qmat_meshopt_mode {
  QMAT_MESHOPT_ATTRIBUTES, /* elements of any kind */
  QMAT_MESHOPT_TRIANGLES,  /* indices of a triangle list */
  QMAT_MESHOPT_INDICES     /* other indices */
} qmat_meshopt_mode;

/* What is applied to decoded attributes. */
typedef enum qmat_meshopt_filter {
  QMAT_MESHOPT_NONE,
  QMAT_MESHOPT_OCTAHEDRAL, /* unit vectors */
  QMAT_MESHOPT_QUATERNION, /* rotations */
  QMAT_MESHOPT_EXPONENTIAL /* floats of a shared exponent */
} qmat_meshopt_filter;

/* The compressed data of one buffer view. */
typedef struct qmat_meshopt_view {
  const uint8_t *bytes; /* not owned */
  size_t size;
  qmat_meshopt_mode mode;
  qmat_meshopt_filter filter;
  size_t count, stride; /* of the elements: `stride` bytes each */
} qmat_meshopt_view;

/* Decompresses the data. `*decoded` has count * stride bytes; the caller frees it with qmat_free; NULL on failure. A
 * count that the data cannot hold is refused before anything is allocated. QMAT_ERROR_FORMAT: a stride or count that
 * the mode or filter does not allow, or damaged data; QMAT_ERROR_MEMORY. One thread. Cost: linear in the decoded bytes.
 * Source: the specification of EXT_meshopt_compression; libmeshoptimizer decodes. */
qmat_status qmat_meshopt_decode(qmat_context *context, const qmat_meshopt_view *view, uint8_t **decoded);

#endif
