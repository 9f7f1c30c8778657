/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USDZ_H
#define QMAT_IO_USD_USDZ_H

#include "io/bytes.h"

/* USDZ packages: zip archives of uncompressed members that start at multiples of 64 bytes. The first member is the root
 * layer. Source: the USDZ file format specification, version 1.3. */

typedef struct qmat_usdz_member {
  char *name; /* with folders; owned */
  const uint8_t *bytes;
  size_t size;
} qmat_usdz_member;

/* A zeroed package is empty and valid. */
typedef struct qmat_usdz {
  size_t member_count;
  qmat_usdz_member *members; /* in the archive's order */
} qmat_usdz;

/* Whether bytes are those of a package. */
bool qmat_usdz_is_package(const uint8_t *bytes, size_t size);

/* Finds the members of the archive in `bytes`, which must outlive the package. Compressed and encrypted members and
 * wrong checksums are refused; alignment is not required. QMAT_ERROR_FORMAT, QMAT_ERROR_MEMORY. Free with
 * qmat_usdz_uninit, also after a failure. Cost: linear. */
qmat_status qmat_usdz_open(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_usdz *package);

void qmat_usdz_uninit(qmat_usdz *package);

/* The member of that name, or NULL. */
const qmat_usdz_member *qmat_usdz_find(const qmat_usdz *package, const char *name);

/* An archive that is being written. `out` is empty before; the rest is zeroed. */
typedef struct qmat_usdz_writer {
  qmat_writer *out;
  qmat_writer directory;
  size_t count;
} qmat_usdz_writer;

/* Appends a member; the first one is the root layer. Sets out->failed for names of more than 255 bytes, for more than
 * 4 GiB and 65,535 members, and when memory is short. */
void qmat_usdz_add(qmat_usdz_writer *writer, const char *name, const void *bytes, size_t size);

/* Appends the directory, and frees it. Call it also after a failure. */
void qmat_usdz_finish(qmat_usdz_writer *writer);

/* Appends an archive of one member to an empty writer. */
void qmat_usdz_put(qmat_writer *writer, const char *name, const void *bytes, size_t size);

#endif
