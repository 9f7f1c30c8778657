/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_DRACO_DRACO_H
#define QMAT_IO_DRACO_DRACO_H

#include <stddef.h>
#include <stdint.h>

#include "core/context.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Flat-array interface to Draco. Bitstreams have version 2.2, as glTF requires. Every function runs on the calling
 * thread, gives the same bytes for the same input, and throws no C++ exception. QMAT_ERROR_DEPENDENCY includes Draco's
 * own message. */

/* ---- writing ---- */

typedef enum qmat_draco_meaning {
  QMAT_DRACO_POSITION,
  QMAT_DRACO_NORMAL,
  QMAT_DRACO_COLOR,
  QMAT_DRACO_TEXCOORD,
  QMAT_DRACO_GENERIC
} qmat_draco_meaning;

typedef enum qmat_draco_number {
  QMAT_DRACO_FLOAT,
  QMAT_DRACO_INT8,
  QMAT_DRACO_UINT8,
  QMAT_DRACO_INT16,
  QMAT_DRACO_UINT16
} qmat_draco_number;

/* One number or vector per point. Its unique id in the bitstream is its index among the attributes. */
typedef struct qmat_draco_attribute {
  qmat_draco_meaning meaning;
  qmat_draco_number number;
  int components;     /* 1 to 4 */
  int bits;           /* quantisation of floats, 1 to 30 (2 to 30 for normals); integers are exact */
  const void *values; /* components * point_count of that number, finite; not owned */
} qmat_draco_attribute;

/* Encodes a triangle mesh. `faces` holds 3 * face_count point ids below point_count; neither count may be 0. With
 * `keep_order` (Draco's sequential method) points and faces stay in order and degenerate faces stay. Without it
 * (edgebreaker) the result is about a quarter as large, but points are reordered and split, and degenerate faces and
 * points on no face are dropped. `*bytes` is NULL on failure; free it with qmat_free. QMAT_ERROR_USAGE for bits out of
 * range, QMAT_ERROR_MEMORY; QMAT_ERROR_DEPENDENCY where Draco cannot: all faces are degenerate, or an attribute's
 * floats are not finite or their range or its inverse overflows. */
qmat_status qmat_draco_encode(qmat_context *context, const qmat_draco_attribute *attributes, size_t attribute_count,
                              size_t point_count, const uint32_t *faces, size_t face_count, bool keep_order,
                              uint8_t **bytes, size_t *size);

/* ---- reading ---- */

/* A decoded triangle mesh. */
typedef struct qmat_draco_mesh qmat_draco_mesh;

/* Decodes `size` bytes. The counts in the header are checked against `size` first, so that a few bytes cannot allocate
 * gigabytes. After decoding, every face is checked against the number of points. `*mesh` is NULL on failure; free it
 * with qmat_draco_mesh_free. QMAT_ERROR_FORMAT, _MEMORY. */
qmat_status qmat_draco_mesh_new(qmat_context *context, const uint8_t *bytes, size_t size, qmat_draco_mesh **mesh);
/* NULL is allowed. */
void qmat_draco_mesh_free(qmat_draco_mesh *mesh);

size_t qmat_draco_mesh_point_count(const qmat_draco_mesh *mesh);
size_t qmat_draco_mesh_face_count(const qmat_draco_mesh *mesh);

/* Writes the faces' corners: 3 * face_count point ids, each below point_count. */
void qmat_draco_mesh_faces(const qmat_draco_mesh *mesh, uint32_t *corners);

/* The unique id of the only attribute of that meaning, if it has `components` floats; false otherwise. */
bool qmat_draco_mesh_find(const qmat_draco_mesh *mesh, qmat_draco_meaning meaning, int components, uint32_t *unique_id);

/* Writes the attribute with that unique id for all points: `components` * point_count numbers. Integers are not
 * normalised. QMAT_ERROR_FORMAT if there is no such attribute, or it has other components or an unsupported type. */
qmat_status qmat_draco_mesh_attribute(qmat_context *context, const qmat_draco_mesh *mesh, uint32_t unique_id,
                                      int components, double *values);

#ifdef __cplusplus
}
#endif

#endif
