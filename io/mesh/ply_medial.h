/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_MESH_PLY_MEDIAL_H
#define QMAT_IO_MESH_PLY_MEDIAL_H

#include <jansson.h>

#include "io/bytes.h"
#include "io/stored_medial.h"

/* Writes a medial mesh as binary little-endian PLY: vertices x y z radius (double), edges vertex1 vertex2 (int), faces.
 * `errors` (NULL: none) become comments "qmat_epsilon 0.01", under the names that glTF has in its extras. The caller
 * releases `*file`, which is sealed; NULL on failure. QMAT_ERROR_MEMORY. Linear. */
qmat_status qmat_ply_write_medial(qmat_context *context, const qmat_medial *medial, const qmat_stated_errors *errors,
                                  qmat_file **file);

/* Reads what qmat_ply_write_medial writes. `facts` (an object, may be NULL) gains what the comments say. `path` is for
 * errors. `*medial` is sealed and released by the caller; NULL on failure. QMAT_ERROR_GEOMETRY where the file does not
 * say that it is a medial mesh, QMAT_ERROR_FORMAT where it is damaged, QMAT_ERROR_MEMORY. Linear. */
qmat_status qmat_ply_read_medial(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_medial **medial,
                                 json_t *facts);

#endif
