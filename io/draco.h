/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_DRACO_H
#define QMAT_IO_DRACO_H

#include <stddef.h>
#include <stdint.h>

#include "core/value.h"

/* Stores medial meshes and skins as Draco bitstreams. Every function runs on the calling thread and gives the same
 * bytes for the same input. */

/* ---- quantisation bits ---- */

/* The smallest number of quantisation bits, 1 to 30, whose error bound sqrt(components) / 2 * range / (2^bits - 1) is
 * at most `error`; 30 if there is none, `range` is not finite or `error` is not positive. `components` is 3 for
 * positions and 1 for radii; `range` is the largest extent over the components. Both lengths are in the same unit. The
 * bound excludes rounding to single precision. */
int qmat_draco_bits_for(int components, double range, double error);

/* The extents that Draco quantises: `*position_range` the largest side of the box of the centres, `*radius_range` the
 * largest radius minus the smallest; model units. Neither pointer may be NULL. */
void qmat_draco_medial_ranges(const qmat_medial *medial, double *position_range, double *radius_range);

/* ---- medial meshes ---- */

/* Encodes a medial mesh as a sequential Draco mesh: POSITION holds the centres and a GENERIC attribute the radii, each
 * quantised on its own to `position_bits` and `radius_bits` (1 to 30). Centres are relative to `origin` (3 numbers;
 * NULL: zero), so that single precision suffices far from zero. Spheres keep their order. The faces are the
 * triangles in their order, then each edge (i, j) that lies on no triangle as (i, j, j), then each sphere i on no edge
 * as (i, i, i). Edgebreaker would be smaller, but it reorders and splits vertices and drops degenerate faces.
 * `*bytes` is NULL on failure; free it with qmat_free. QMAT_ERROR_USAGE for bits out of range, QMAT_ERROR_GEOMETRY for
 * a medial mesh without spheres, beyond single precision or with a missing edge, QMAT_ERROR_MEMORY,
 * QMAT_ERROR_DEPENDENCY. Cost: linear, and a binary search per side of a triangle. */
qmat_status qmat_draco_encode_medial(qmat_context *context, const qmat_medial *medial, const double *origin,
                                     int position_bits, int radius_bits, uint8_t **bytes, size_t *size);

/* Decodes `size` bytes of qmat_draco_encode_medial with the same origin into a sealed medial mesh. Sizes and ids are
 * checked before use: QMAT_ERROR_FORMAT says what is wrong. `*medial` is NULL on failure; the caller releases it.
 * Cost: linear. */
qmat_status qmat_draco_decode_medial(qmat_context *context, const uint8_t *bytes, size_t size, const double *origin,
                                     qmat_medial **medial);

/* ---- triangle meshes for display ---- */

/* A mesh compressed for KHR_draco_mesh_compression. A zeroed one is empty and valid. */
typedef struct qmat_draco_skin {
  uint8_t *bytes; /* owned */
  size_t size;
  uint32_t position_id, normal_id;       /* the attributes' unique ids */
  uint32_t vertex_count, triangle_count; /* as decoded: vertices may be split, dropped or reordered */
  float min[3], max[3];                  /* of the decoded positions */
} qmat_draco_skin;

/* Encodes a triangle mesh for display. It uses edgebreaker, because viewers ignore the order of vertices and
 * edgebreaker needs about a quarter of the bytes of the sequential method. `positions` and `normals` hold 3 *
 * vertex_count finite floats, `triangles` 3 * triangle_count ids below vertex_count; none may be empty. The result is
 * decoded again for its counts and bounds. On failure `skin` is empty. QMAT_ERROR_USAGE, _MEMORY, _DEPENDENCY. */
qmat_status qmat_draco_encode_mesh(qmat_context *context, const float *positions, const float *normals,
                                   size_t vertex_count, const uint32_t *triangles, size_t triangle_count,
                                   int position_bits, int normal_bits, qmat_draco_skin *skin);

/* Frees the bytes; the skin is empty and usable again. */
void qmat_draco_skin_uninit(qmat_draco_skin *skin);

#endif
