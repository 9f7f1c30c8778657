/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_SAVE_H
#define QMAT_IO_SAVE_H

#include "core/value.h"

/* Saves every part of a file value: the main part as `path`, the others under their names in the same folder or in
 * folders below it, which are made. Every part is written to a temporary file and flushed to disk before the first
 * rename; side parts are renamed first, the main part last. A side part that already has the same bytes on disk is left
 * alone. A process that is killed while it writes leaves no part of a file behind, where the file system has files
 * without names. A failure before the renames leaves no new file behind and every old file untouched. Existing files
 * keep their permissions. QMAT_ERROR_IO names the file; QMAT_ERROR_MEMORY. One thread. Cost: one pass over the bytes.
 */
qmat_status qmat_file_save(qmat_context *context, const qmat_file *file, const char *path);

/* Whether `path` is a file that holds the bytes of the part, and no others. */
bool qmat_file_holds(const char *path, const qmat_file_part *part);

#endif
