/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CACHE_REMOTE_CACHE_H
#define QMAT_GRAPHS_CACHE_REMOTE_CACHE_H

#include "core/digest.h"
#include "io/bytes.h"

/* A shared cache on any HTTP server with GET, HEAD and PUT (nginx with WebDAV, cache servers for Bazel). URL/ac/KEY and
 * URL/cas/DIGEST have the same bytes as the files of a qmat_cache. The server is not trusted: readers check digests.
 * After the first request that gets no answer, or one too slowly, it is not used again. */
typedef struct qmat_remote_cache qmat_remote_cache;

/* The URL for messages: user and password, everything before the last '@', become "***". */
typedef struct qmat_shown_url {
  char text[256];
} qmat_shown_url;
qmat_shown_url qmat_show_url(const char *url);

/* `url` starts with http:// or https:// and may contain user and password. Sends nothing. NULL when memory is short;
 * free with qmat_remote_close. */
qmat_remote_cache *qmat_remote_open(const char *url, bool read_only);
void qmat_remote_close(qmat_remote_cache *remote);

/* Gets URL/`folder``digest` ("ac/", "cas/") of at most `most_size` bytes into an empty writer. False: missing, or the
 * server failed. */
bool qmat_remote_get(qmat_remote_cache *remote, const char *folder, const qmat_digest *digest, uint64_t most_size,
                     qmat_writer *body);

/* Whether the server has it with `size` bytes. */
bool qmat_remote_has(qmat_remote_cache *remote, const char *folder, const qmat_digest *digest, uint64_t size);

/* Puts bytes on the server. False: read only, or the server refused. */
bool qmat_remote_put(qmat_remote_cache *remote, const char *folder, const qmat_digest *digest, const void *bytes,
                     size_t size);

/* Whether qmat_remote_put may succeed. */
bool qmat_remote_is_writable(const qmat_remote_cache *remote);

/* The first failure; "": none. */
const char *qmat_remote_warning(const qmat_remote_cache *remote);

#endif
