/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CACHE_REMOTE_CACHE_H
#define QMAT_GRAPHS_CACHE_REMOTE_CACHE_H

#include "core/digest.h"
#include "io/bytes.h"

/* A cache that others share, behind any HTTP server that knows GET, HEAD and PUT (nginx with WebDAV, Bazel's servers):
 * URL/ac/KEY and URL/cas/DIGEST hold the same bytes as the files of a qmat_cache. Nothing it says is believed: whoever
 * reads checks digests. The first time that it does not answer, or too slowly, is the last that it is asked. */
typedef struct qmat_remote_cache qmat_remote_cache;

/* The URL as messages show it: what stands before its last '@', a user and password, is replaced by "***". */
typedef struct qmat_shown_url {
  char text[256];
} qmat_shown_url;
qmat_shown_url qmat_show_url(const char *url);

/* `url` starts with http:// or https://; user and password may stand in it. NULL when memory is short; free with
 * qmat_remote_close. Nothing is sent yet. */
qmat_remote_cache *qmat_remote_open(const char *url, bool read_only);
void qmat_remote_close(qmat_remote_cache *remote);

/* Gets URL/`folder``digest` ("ac/", "cas/") of at most `most_size` bytes into an empty writer. False: it is not there,
 * or the server failed. */
bool qmat_remote_get(qmat_remote_cache *remote, const char *folder, const qmat_digest *digest, uint64_t most_size,
                     qmat_writer *body);

/* Whether it is there and `size` bytes long. */
bool qmat_remote_has(qmat_remote_cache *remote, const char *folder, const qmat_digest *digest, uint64_t size);

/* Puts bytes there; does nothing when it is read only. */
bool qmat_remote_put(qmat_remote_cache *remote, const char *folder, const qmat_digest *digest, const void *bytes,
                     size_t size);

/* Whether anything can be put. */
bool qmat_remote_is_writable(const qmat_remote_cache *remote);

/* What went wrong first; "": nothing. */
const char *qmat_remote_warning(const qmat_remote_cache *remote);

#endif
