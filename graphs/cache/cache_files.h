/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CACHE_CACHE_FILES_H
#define QMAT_GRAPHS_CACHE_CACHE_FILES_H

#include "graphs/cache/cache.h"

/* The files of a cache: where they are, and how they are written. One thread at a time uses a qmat_cache. */

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
