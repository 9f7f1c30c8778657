/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_SIDE_FILES_H
#define QMAT_IO_SIDE_FILES_H

#include "core/value.h"

/* Files that are saved next to a main file, such as glTF buffers and textures. */

/* Names the side parts of a file after the path of its main part, so that two outputs in one folder never share a side
 * file. For "x/out.gltf" a single buffer becomes "out.bin"; other parts get the prefix "out_" and, if names are equal,
 * a number. The URIs in the main part are updated. The side part of a USD layer becomes "out_original.usda", say. All
 * parts are saved in the same folder. Other formats keep their names. `*named` is not sealed; the caller releases it.
 * It is `file` itself, retained, if it is not glTF or has no side parts; NULL on failure. QMAT_ERROR_MEMORY. Cost:
 * linear. */
qmat_status qmat_file_name_sides(qmat_context *context, const qmat_file *file, const char *path, qmat_file **named);

/* Protects files that belong to other outputs. QMAT_ERROR_IO if a file with the name of a side part exists with other
 * content, unless an existing file `path` refers to it, as after an earlier run. Writes nothing. */
qmat_status qmat_file_check_sides(qmat_context *context, const qmat_file *named, const char *path);

#endif
