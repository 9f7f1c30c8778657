/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_FILES_H
#define QMAT_IO_USD_USD_FILES_H

#include "io/bytes.h"
#include "io/usd/usd_prim.h"

/* The files of a scene of USD: layers, packages, and stacks of a layer with its sublayers. Files are found relative to
 * the layer that names them, or beside it in its package. A missing file, an absolute path or an address gives a
 * warning about the prim that needs it; a broken file is an error. */

enum { QMAT_USD_DEEPEST_ARCS = 64 }; /* nesting of references and of sublayers */

/* A layer with all its sublayers, strongest first. */
typedef struct qmat_usd_stack {
  size_t count, capacity, time_capacity;
  const qmat_usd_layer **layers;
  qmat_usd_time *times; /* how the times of each layer become those of the first */
} qmat_usd_stack;

/* Zeroed it is empty and valid. */
typedef struct qmat_usd_files {
  size_t file_count, file_capacity, package_count, package_capacity, stack_count, stack_capacity;
  struct qmat_usd_file **files; /* of layers, also missing ones */
  struct qmat_usd_package *packages;
  qmat_usd_stack *stacks;
  size_t layers_read, specs_read, bytes_read;
} qmat_usd_files;

/* Opens the root layer in `bytes` (.usda, .usdc or .usdz), which must outlive the files; its stack is number 0. `root`
 * is the root of the scene, for messages. QMAT_ERROR_FORMAT, QMAT_ERROR_MEMORY. */
qmat_status qmat_usd_files_open(qmat_usd_files *files, const qmat_usd_prim *root, const qmat_bytes *bytes,
                                const char *path);

/* Finds the stack of the layer that the layer `from` calls `asset`, and reads its files if they are new; SIZE_MAX when
 * it is missing, with a warning about `prim` that the `what` ("reference") is skipped. `from` belongs to a stack of
 * `files`. QMAT_ERROR_FORMAT, QMAT_ERROR_MEMORY. */
qmat_status qmat_usd_files_find(qmat_usd_files *files, const qmat_usd_prim *prim, const qmat_usd_layer *from,
                                const char *asset, const char *what, size_t *found);

/* How the times of a layer of a stack become those of the stack's first layer. */
qmat_usd_time qmat_usd_stack_time(const qmat_usd_stack *stack, const qmat_usd_layer *layer);

/* One of the files that were read, numbered from 0. `*path` and `*layer` are NULL for a file that is missing or is
 * itself a package; `*is_member`: it is in a package. */
void qmat_usd_files_at(const qmat_usd_files *files, size_t number, const char **path, const qmat_usd_layer **layer,
                       bool *is_member);

/* The path of `asset` relative to the folder of the file `from`, with "." and ".." resolved as far as possible; NULL
 * when memory is short, or `asset` is absolute, an address or in a package. Free with qmat_free. */
char *qmat_usd_beside(const char *from, const char *asset);

void qmat_usd_files_uninit(qmat_usd_files *files);

#endif
