/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_MESH_PLY_MEDIAL_H
#define QMAT_IO_MESH_PLY_MEDIAL_H

#include <jansson.h>

#include "io/bytes.h"
#include "io/stored_medial.h"

/* Writes a medial mesh as binary little-endian PLY: vertices x y z radius (double), edges vertex1 vertex2 (int), faces.
 * `errors` (NULL: none) become comments such as "qmat_epsilon 0.01", with the keys of the glTF extras. `*file` is
 * sealed; the caller releases it; NULL on failure. QMAT_ERROR_MEMORY. Cost: linear. */
qmat_status qmat_ply_write_medial(qmat_context *context, const qmat_medial *medial, const qmat_stated_errors *errors,
                                  qmat_file **file);

/* Reads a file written by qmat_ply_write_medial. `facts` (a JSON object, may be NULL) gains the keys and values of the
 * comments. `path` is for errors. `*medial` is sealed; the caller releases it; NULL on failure. QMAT_ERROR_GEOMETRY:
 * not a medial mesh; QMAT_ERROR_FORMAT: a damaged file; QMAT_ERROR_MEMORY. Cost: linear. */
qmat_status qmat_ply_read_medial(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_medial **medial,
                                 json_t *facts);

#endif
