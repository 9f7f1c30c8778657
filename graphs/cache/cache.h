/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CACHE_CACHE_H
#define QMAT_GRAPHS_CACHE_CACHE_H

#include "core/value.h"
#include "graphs/cache/remote_cache.h"

/* A store of results, shared by any number of processes:
 *
 *     ac/KEY        a record: what ran, its key in readable form, and the digests of what came out
 *     cas/DIGEST    a blob: the binary form of a value, under the digest of its bytes
 *     tmp/          files that are being written; their writers hold a lock on them
 *     bad/          blobs and records that did not hold what their name says, for whoever wants to know why
 *
 * Beside the folder there may be a remote cache of the same bytes: what is not in the folder is looked for there and
 * then kept in the folder, and what is stored goes to both.
 *
 * Everything is written to tmp/, flushed and renamed, blobs before the record that names them: what exists is complete.
 * Readers take no lock and check every digest; what does not agree is set aside and counts as absent. No failure of the
 * cache fails a run: it is told once, in `warning`. One thread at a time uses a qmat_cache. */

typedef struct qmat_cache_options {
  const char *folder;
  bool read_only;        /* store nothing and change nothing */
  uint64_t most_size;    /* in bytes; above it the least recently used is deleted; 0: QMAT_CACHE_SIZE */
  const char *remote;    /* URL of a remote cache; NULL: none */
  bool remote_read_only; /* store nothing there */
} qmat_cache_options;

#define QMAT_CACHE_SIZE ((uint64_t)10000000000)

typedef struct qmat_cache {
  char *folder; /* ends in '/' */
  bool read_only;
  uint64_t most_size;
  uint64_t stored;      /* bytes that were added since it was opened */
  bool ready;           /* its folders are there */
  unsigned temporaries; /* how many have been made */
  char warning[384];    /* what went wrong first; "": nothing */
  qmat_digest *bad;     /* blobs that did not hold what they should and could not be set aside */
  size_t bad_count, bad_capacity;
  qmat_remote_cache *remote; /* NULL: none */
} qmat_cache;

/* Opens the cache in a folder, which need not exist yet: it is made when something is stored. QMAT_ERROR_USAGE: the
 * path leads to a file. Free with qmat_cache_close, also after a failure. */
qmat_status qmat_cache_open(qmat_context *context, const qmat_cache_options *options, qmat_cache *cache);

/* Deletes what is beyond the size if anything was stored, and frees. Works on a zeroed cache. */
void qmat_cache_close(qmat_cache *cache);

/* The default folder: qmat in $XDG_CACHE_HOME, else in ~/.cache. NULL when neither is set to an absolute path or memory
 * is short; free with qmat_free. */
char *qmat_cache_default_folder(void);

/* Whether anything that is stored may be kept, in the folder or remotely. */
bool qmat_cache_is_writable(const qmat_cache *cache);

/* What went wrong first, here or remotely; "": nothing. */
const char *qmat_cache_warning(const qmat_cache *cache);

/* The record of a key, checked: its own digest, and that its items make the key. NULL: there is none. The caller calls
 * json_decref. */
json_t *qmat_cache_record(qmat_cache *cache, const qmat_digest *key);

/* The value of that digest, whose blob has `size` bytes, sealed and checked; NULL: it is not there, or not what it
 * should be. */
qmat_value *qmat_cache_value(qmat_cache *cache, const qmat_digest *digest, uint64_t size, qmat_value_type type);

/* Notes that a record was used just now: what was used least recently is deleted first. */
void qmat_cache_touch_record(qmat_cache *cache, const qmat_digest *key);

/* Stores a sealed value; of a list each item as a blob of its own, which other lists and runs share. Gives what a
 * record says of it: {"digest": hexadecimal, "blob": size of the blob}, of a list with "items", the same of each; NULL
 * when it could not be stored. `*added`: whether any of it was not there before. The caller calls json_decref. */
json_t *qmat_cache_put_value(qmat_cache *cache, const qmat_value *value, bool *added);

/* Of such an object: whether all blobs that it names are there, of their sizes (their bytes are not looked at); that
 * they were used just now; their sizes together. */
bool qmat_cache_has_stored(qmat_cache *cache, const json_t *stored);
void qmat_cache_touch_stored(qmat_cache *cache, const json_t *stored);
uint64_t qmat_cache_stored_size(const json_t *stored);

/* Stores a record; its "key" holds the items of `key`. Store what it names first. */
bool qmat_cache_put_record(qmat_cache *cache, const qmat_digest *key, const json_t *record);

/* ---- looking after it ---- */

typedef enum qmat_cache_kind {
  QMAT_CACHE_RECORD,
  QMAT_CACHE_BLOB,
  QMAT_CACHE_TEMPORARY,
  QMAT_CACHE_BAD,
  QMAT_CACHE_KIND_COUNT
} qmat_cache_kind;

/* A file of the cache. */
typedef struct qmat_cache_entry {
  qmat_cache_kind kind;
  char name[80];      /* of a record or blob: the digest in hexadecimal */
  qmat_digest digest; /* the same as bytes */
  uint64_t size;
  int64_t used; /* nanoseconds since 1970: when it was stored or used last */
} qmat_cache_entry;

/* All files of the cache, records first, each kind by name. Files that are not the cache's are left out. False when
 * memory is short; free `*entries` with qmat_free. */
bool qmat_cache_list(const qmat_cache *cache, qmat_cache_entry **entries, size_t *count);

typedef struct qmat_cache_sweep {
  size_t deleted;
  uint64_t freed;
} qmat_cache_sweep;

/* Deletes temporaries whose writers are gone, and the least recently used records and blobs until at most `most_size`
 * bytes are left. With `thorough` also what was set aside, records of which a blob is missing, and blobs older than an
 * hour that no record names. */
qmat_cache_sweep qmat_cache_collect(qmat_cache *cache, uint64_t most_size, bool thorough);

/* Deletes every file of the cache, but none that is not the cache's. */
qmat_cache_sweep qmat_cache_clear(qmat_cache *cache);

/* What checking an entry came to. */
typedef enum qmat_cache_health { QMAT_CACHE_SOUND, QMAT_CACHE_INCOMPLETE, QMAT_CACHE_BROKEN } qmat_cache_health;

/* Reads a record or blob and checks it; a broken one is set aside. A record is incomplete when a blob that it names is
 * missing: it is then never used. */
qmat_cache_health qmat_cache_check(qmat_cache *cache, const qmat_cache_entry *entry);

#endif
