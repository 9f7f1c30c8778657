/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_DIGEST_H
#define QMAT_CORE_DIGEST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/status.h"

/* A SHA-256 digest. */
typedef struct qmat_digest {
  uint8_t bytes[32];
} qmat_digest;

/* An incremental SHA-256 (OpenSSL). */
typedef struct qmat_hasher {
  void *state;
} qmat_hasher;

/* Starts a hash; QMAT_ERROR_MEMORY or QMAT_ERROR_DEPENDENCY when OpenSSL cannot. */
qmat_status qmat_hasher_init(qmat_hasher *hasher);
/* Adds `size` bytes; `bytes` may be NULL when size is 0. Does nothing after a failed init. */
void qmat_hasher_add(qmat_hasher *hasher, const void *bytes, size_t size);
/* Writes the digest and frees the hasher; with `digest` NULL it only frees. QMAT_ERROR_DEPENDENCY and a digest of zeros
 * when init failed or OpenSSL failed since. */
qmat_status qmat_hasher_finish(qmat_hasher *hasher, qmat_digest *digest);

/* The digest of `size` bytes; statuses as above. */
qmat_status qmat_digest_of(const void *bytes, size_t size, qmat_digest *digest);

/* The digest of the bytes of a regular file, read in pieces. QMAT_ERROR_IO when it cannot be read. Cost: one pass. */
qmat_status qmat_digest_of_file(const char *path, qmat_digest *digest);

/* Parses exactly 64 lower-case hexadecimal digits. On false, `*digest` is unchanged. */
bool qmat_digest_parse(const char *text, qmat_digest *digest);

/* Whether two digests are the same. */
bool qmat_digest_equal(const qmat_digest *a, const qmat_digest *b);

/* Writes the 64 lower-case hexadecimal digits and a terminating zero. */
void qmat_digest_hex(const qmat_digest *digest, char text[65]);

#endif
