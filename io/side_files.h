/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_SIDE_FILES_H
#define QMAT_IO_SIDE_FILES_H

#include "core/value.h"

/* The files that are saved beside a main file. */

/* Names the side parts of a file after the path that its main part is saved as, so that two outputs in one folder never
 * share a side file: for "x/out.gltf" an only buffer becomes "out.bin", everything else "out_" and its base name, with
 * a number where two of them would be equal. The main part's URIs change with them. All lie in the main part's folder.
 * Files of other
 * formats than glTF keep their names. `*named` is not sealed and is released by the caller; it is `file` itself,
 * retained, where no name changes. NULL on failure. QMAT_ERROR_MEMORY. Linear. */
qmat_status qmat_file_name_sides(qmat_context *context, const qmat_file *file, const char *path, qmat_file **named);

/* Refuses to replace a file that is not this output's: QMAT_ERROR_IO where a side part's name exists with other bytes,
 * unless the file `path` exists, too, and names it, as it does after an earlier run. Writes nothing. */
qmat_status qmat_file_check_sides(qmat_context *context, const qmat_file *named, const char *path);

#endif
