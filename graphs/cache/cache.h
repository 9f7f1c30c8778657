/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CACHE_CACHE_H
#define QMAT_GRAPHS_CACHE_CACHE_H

#include "core/value.h"
#include "graphs/cache/cache_files.h"

/* A store of results, shared by any number of processes:
 *
 *     ac/KEY        a record: the node that ran, its readable key, and the digests of its outputs; or the side files
 *                   that every run of this key has read, whose digests lead to the next key
 *     cas/DIGEST    a blob: the serialised form of a value, named by the digest of its bytes
 *     tmp/          files being written; their writers hold a lock on them
 *     bad/          damaged blobs and records, kept for inspection
 *     size          about how many bytes there are (cache_size.h)
 *
 * A remote cache may hold the same files. Missing files are fetched from it into the folder; stored files go to both.
 *
 * Every file is written to tmp/, flushed and renamed, and blobs come before the record that names them, so every file
 * is complete. Readers take no lock and check every digest; a damaged file is moved to bad/ and counts as missing. One
 * that may not be read counts as missing and stays. A failure of the cache never fails a run: the first one is reported
 * in `warning`. One thread at a time uses a qmat_cache. */

typedef struct qmat_cache_options {
  const char *folder;
  bool read_only;        /* store nothing and change nothing */
  uint64_t most_size;    /* in bytes; above it the least recently used files are deleted; 0: QMAT_CACHE_SIZE */
  const char *remote;    /* URL of a remote cache; NULL: none */
  bool remote_read_only; /* send it nothing */
} qmat_cache_options;

#define QMAT_CACHE_SIZE ((uint64_t)10000000000)

/* Opens the cache in a folder, which is made when something is stored. QMAT_ERROR_USAGE: the path is a file, or the
 * remote URL is not http or https. Free with qmat_cache_close, also after a failure. */
qmat_status qmat_cache_open(qmat_context *context, const qmat_cache_options *options, qmat_cache *cache);

/* If anything was stored: deletes the least recently used files when the cache may be above its size, and sets the
 * warning when some of them were used within the last day. A run calls it before it tells the warning. The folder is
 * listed only when the file `size` says so, and by one process at a time. Processes that are still running may stand
 * above the limit; where counts were lost, an eighth of it may be added. */
void qmat_cache_trim(qmat_cache *cache);

/* Trims the cache and frees it. Works on a zeroed cache. */
void qmat_cache_close(qmat_cache *cache);

/* The default folder: $XDG_CACHE_HOME/qmat, else ~/.cache/qmat. NULL when neither is an absolute path or memory is
 * short; free with qmat_free. */
char *qmat_cache_default_folder(void);

/* Whether results can be stored, in the folder or remotely. */
bool qmat_cache_is_writable(const qmat_cache *cache);

/* The first failure, here or remotely; "": none. */
const char *qmat_cache_warning(const qmat_cache *cache);

/* The record of a key, or NULL. Its digest is checked, and that its items give the key. The caller calls json_decref.
 */
json_t *qmat_cache_record(qmat_cache *cache, const qmat_digest *key);

/* The value of a digest, whose blob has `size` bytes, checked and sealed; NULL: missing or damaged. */
qmat_value *qmat_cache_value(qmat_cache *cache, const qmat_digest *digest, uint64_t size, qmat_value_type type);

/* Marks a record as just used. The least recently used files are deleted first. */
void qmat_cache_touch_record(qmat_cache *cache, const qmat_digest *key);

/* Stores a sealed value. Each item of a list is a blob of its own, which lists and runs share. Returns the value's
 * entry in a record: {"digest": hexadecimal, "blob": size of the blob}, for a list also "items", an array of the same;
 * NULL when it could not be stored. `*added`: a blob is new. The caller calls json_decref. */
json_t *qmat_cache_put_value(qmat_cache *cache, const qmat_value *value, bool *added);

/* For such an entry: whether all its blobs exist with their sizes (their bytes are not checked); marking them as just
 * used; their total size. */
bool qmat_cache_has_stored(qmat_cache *cache, const json_t *stored);
void qmat_cache_touch_stored(qmat_cache *cache, const json_t *stored);
uint64_t qmat_cache_stored_size(const json_t *stored);

/* Stores a record; its "key" has the items of `key`. Store the values that it names first. */
bool qmat_cache_put_record(qmat_cache *cache, const qmat_digest *key, const json_t *record);

/* ---- maintenance ---- */

/* A file of the cache. */
typedef struct qmat_cache_entry {
  qmat_cache_kind kind;
  char name[80];      /* of a record or blob: the digest in hexadecimal */
  qmat_digest digest; /* the same as bytes */
  uint64_t size;
  int64_t used; /* nanoseconds since 1970: the last use */
} qmat_cache_entry;

/* All files of the cache, records first, each kind sorted by name. Foreign files are left out. False when memory is
 * short; free `*entries` with qmat_free. */
bool qmat_cache_list(const qmat_cache *cache, qmat_cache_entry **entries, size_t *count);

typedef struct qmat_cache_sweep {
  size_t deleted, recent; /* recent: of the least recently used, those that were used within the last day */
  uint64_t freed;
} qmat_cache_sweep;

/* Deletes temporaries whose writers are gone, and the least recently used records and blobs until at most `most_size`
 * bytes remain; among the older half of those of the last day in an order of chance. With `thorough` also damaged
 * files, and records with a missing blob and unnamed blobs that are older than an hour. */
qmat_cache_sweep qmat_cache_collect(qmat_cache *cache, uint64_t most_size, bool thorough);

/* Deletes every file of the cache, but no foreign file. */
qmat_cache_sweep qmat_cache_clear(qmat_cache *cache);

typedef enum qmat_cache_health {
  QMAT_CACHE_SOUND,
  QMAT_CACHE_INCOMPLETE, /* a record one of whose blobs is missing; it is never used */
  QMAT_CACHE_BROKEN,     /* and moved to bad/ */
  QMAT_CACHE_STUCK,      /* broken, and it could not be moved */
  QMAT_CACHE_UNREADABLE  /* the system refuses to read it; nothing is known about its bytes */
} qmat_cache_health;

/* Checks a record or blob; a broken one is moved to bad/. */
qmat_cache_health qmat_cache_check(qmat_cache *cache, const qmat_cache_entry *entry);

#endif
