/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CACHE_CACHE_FILES_H
#define QMAT_GRAPHS_CACHE_CACHE_FILES_H

#include "core/digest.h"
#include "graphs/cache/remote_cache.h"

/* An open cache, where its files are, and how they are written. One thread at a time uses a qmat_cache. */

typedef enum qmat_cache_kind {
  QMAT_CACHE_RECORD,
  QMAT_CACHE_BLOB,
  QMAT_CACHE_TEMPORARY,
  QMAT_CACHE_BAD,
  QMAT_CACHE_KIND_COUNT
} qmat_cache_kind;

typedef struct qmat_cache {
  char *folder; /* ends in '/' */
  bool read_only;
  uint64_t most_size;
  bool stored;            /* something was added since the last trim */
  bool uncounted;         /* something was added that the file `size` does not count */
  uint64_t counted_ahead; /* bytes that the file `size` counts and that are not stored yet */
  bool ready;             /* its folders exist */
  unsigned temporaries;   /* how many were made */
  char warning[384];      /* the first failure, or that it is too small; "": none */
  qmat_digest *bad;       /* damaged files that could not be moved to bad/ */
  size_t bad_count, bad_capacity;
  qmat_remote_cache *remote; /* NULL: none */
} qmat_cache;

/* The folder of a kind inside the cache, which ends in '/'. A constant. */
const char *qmat_cache_kind_folder(qmat_cache_kind kind);

/* The path of a file of a kind, by its name or by a digest. NULL when memory is short; free with qmat_free. */
char *qmat_cache_path(const qmat_cache *cache, qmat_cache_kind kind, const char *name);
char *qmat_cache_path_of_digest(const qmat_cache *cache, qmat_cache_kind kind, const qmat_digest *digest);

/* Sets the warning "cannot FAILURE PATH: reason" if there is none yet. `number` is an errno. */
void qmat_cache_warn(qmat_cache *cache, const char *failure, const char *path, int number);

/* Makes a folder and its parents. False with errno. `path` is changed meanwhile. */
bool qmat_cache_make_folders(char *path);

/* Writes a file through tmp/, whole or not at all, and flushes it. False: the cache has a warning. */
bool qmat_cache_place_file(qmat_cache *cache, const char *path, const void *bytes, size_t size);

#endif
