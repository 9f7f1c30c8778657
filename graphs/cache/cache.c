/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/cache/cache.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "core/value_form.h"
#include "graphs/cache/cache_files.h"
#include "graphs/cache/cache_record.h"
#include "graphs/cache/cache_size.h"
#include "io/bytes.h"

static const char tag_text[] =
    "Signature: 8a477f597d28d172789f06886806bc55\n"
    "# This folder is a cache of qmat: everything in it can be made again.\n"
    "# About cache directory tags: https://bford.info/cachedir/\n";

/* ---- folders ---- */

/* Makes the folders at the first use. */
static bool make_ready(qmat_cache *cache) {
  if (cache->ready) return true;
  if (cache->read_only) return false;
  for (int kind = 0; kind < QMAT_CACHE_KIND_COUNT; kind++) {
    char *folder = qmat_cache_path(cache, (qmat_cache_kind)kind, "");
    if (!folder) return false;
    folder[strlen(folder) - 1] = 0;
    bool made = qmat_cache_make_folders(folder);
    if (!made) qmat_cache_warn(cache, "write to the cache: making the folder", folder, errno);
    qmat_free(folder);
    if (!made) return false;
  }
  size_t size = strlen(cache->folder) + sizeof "CACHEDIR.TAG";
  char *tag = qmat_alloc(size, 1);
  if (!tag) return false;
  snprintf(tag, size, "%sCACHEDIR.TAG", cache->folder);
  cache->ready = true;
  if (access(tag, F_OK) != 0) cache->ready = qmat_cache_place_file(cache, tag, tag_text, sizeof tag_text - 1);
  qmat_free(tag);
  qmat_cache_collect(cache, UINT64_MAX, false);
  return cache->ready;
}

/* Whether a file is there and may not be read, which is told. It is not damaged: another user may read it. */
static bool is_unreadable(qmat_cache *cache, const char *path) {
  const int file = path ? open(path, O_RDONLY | O_CLOEXEC) : -1, number = errno;
  if (file >= 0) close(file);
  if (!path || file >= 0 || number == ENOENT || number == ENOTDIR) return false;
  qmat_cache_warn(cache, "read the cache:", path, number);
  return true;
}

static bool read_file(qmat_cache *cache, const char *path, qmat_bytes *bytes) {
  qmat_context nobody = {0}; /* a missing file is no error here */
  return !is_unreadable(cache, path) && qmat_bytes_read_file(&nobody, path, bytes) == QMAT_OK;
}

/* ---- opening and closing ---- */

qmat_status qmat_cache_open(qmat_context *context, const qmat_cache_options *options, qmat_cache *cache) {
  struct stat about;
  *cache = (qmat_cache){.read_only = options->read_only,
                        .most_size = options->most_size ? options->most_size : QMAT_CACHE_SIZE};
  size_t length = strlen(options->folder);
  cache->folder = qmat_alloc(length + 2, 1);
  if (!cache->folder) return qmat_fail_memory(context, "cache");
  snprintf(cache->folder, length + 2, "%s%s", options->folder,
           length > 0 && options->folder[length - 1] == '/' ? "" : "/");
  if (stat(options->folder, &about) == 0 && !S_ISDIR(about.st_mode)) {
    qmat_fail(context, QMAT_ERROR_USAGE, "the cache has to be a folder, not a file");
    return qmat_fail_at(context, options->folder, 0, 0);
  }
  if (stat(options->folder, &about) == 0 && access(options->folder, W_OK) != 0) cache->read_only = true;
  if (!options->remote) return QMAT_OK;
  if (strncmp(options->remote, "http://", 7) != 0 && strncmp(options->remote, "https://", 8) != 0) {
    qmat_fail(context, QMAT_ERROR_USAGE, "the URL of a remote cache starts with http:// or https://, not '%.200s'",
              qmat_show_url(options->remote).text);
    return QMAT_ERROR_USAGE;
  }
  cache->remote = qmat_remote_open(options->remote, options->read_only || options->remote_read_only);
  return cache->remote ? QMAT_OK : qmat_fail_memory(context, "remote cache");
}

void qmat_cache_trim(qmat_cache *cache) {
  int lock = -1;
  if (!cache->stored || !qmat_cache_may_be_full(cache)) return;
  /* Another process may just have finished a sweep: then the file has changed. */
  if (qmat_cache_begin_sweep(cache, &lock) && qmat_cache_may_be_full(cache)) {
    const qmat_cache_sweep sweep = qmat_cache_collect(cache, cache->most_size, false);
    if (sweep.recent > 0 && !*cache->warning)
      snprintf(cache->warning, sizeof cache->warning,
               "the cache is too small for this work: %zu of its files that were used within the last day were "
               "deleted to keep it below %.6g MB; raise --cache-size",
               sweep.recent, (double)cache->most_size / 1e6);
  }
  if (lock >= 0) close(lock);
  cache->stored = false;
}

void qmat_cache_close(qmat_cache *cache) {
  qmat_cache_trim(cache);
  qmat_remote_close(cache->remote);
  qmat_free(cache->folder);
  qmat_free(cache->bad);
  *cache = (qmat_cache){0};
}

bool qmat_cache_is_writable(const qmat_cache *cache) {
  return !cache->read_only || qmat_remote_is_writable(cache->remote);
}

const char *qmat_cache_warning(const qmat_cache *cache) {
  return *cache->warning || !cache->remote ? cache->warning : qmat_remote_warning(cache->remote);
}

/* ---- reading ---- */

static bool is_bad(const qmat_cache *cache, const qmat_digest *digest) {
  for (size_t i = 0; i < cache->bad_count; i++)
    if (qmat_digest_equal(&cache->bad[i], digest)) return true;
  return false;
}

/* Moves a damaged file to bad/. If that fails, the cache remembers it as damaged. */
static bool set_aside(qmat_cache *cache, qmat_cache_kind kind, const qmat_digest *digest) {
  char *from = qmat_cache_path_of_digest(cache, kind, digest),
       *to = qmat_cache_path_of_digest(cache, QMAT_CACHE_BAD, digest);
  bool moved = from && to && !cache->read_only && (rename(from, to) == 0 || unlink(from) == 0);
  qmat_free(from);
  qmat_free(to);
  if (moved) return true;
  if (qmat_grow((void **)&cache->bad, &cache->bad_capacity, cache->bad_count + 1, sizeof *cache->bad) == 0)
    cache->bad[cache->bad_count++] = *digest;
  return false;
}

/* Stores bytes in the folder. */
static bool keep_bytes(qmat_cache *cache, qmat_cache_kind kind, const qmat_digest *digest, const void *bytes,
                       size_t size) {
  char *path = qmat_cache_path_of_digest(cache, kind, digest);
  bool kept = path && make_ready(cache) && qmat_cache_place_file(cache, path, bytes, size);
  if (kept) qmat_cache_count(cache, size);
  qmat_free(path);
  return kept;
}

static void warn_of_damage(qmat_cache *cache, const char *what) {
  if (!*cache->warning) snprintf(cache->warning, sizeof cache->warning, "the remote cache has a damaged %s", what);
}

static json_t *remote_record(qmat_cache *cache, const qmat_digest *key) {
  const uint64_t most_size = (uint64_t)1 << 24;
  qmat_writer body = {0};
  json_t *record = NULL;
  if (qmat_remote_get(cache->remote, qmat_cache_kind_folder(QMAT_CACHE_RECORD), key, most_size, &body)) {
    record = qmat_record_parse(body.bytes, body.size, key);
    if (record)
      keep_bytes(cache, QMAT_CACHE_RECORD, key, body.bytes, body.size);
    else
      warn_of_damage(cache, "record");
  }
  qmat_writer_uninit(&body);
  return record;
}

json_t *qmat_cache_record(qmat_cache *cache, const qmat_digest *key) {
  qmat_bytes bytes = {0};
  char *path = qmat_cache_path_of_digest(cache, QMAT_CACHE_RECORD, key);
  json_t *record = NULL;
  if (path && !is_bad(cache, key) && read_file(cache, path, &bytes)) {
    record = qmat_record_parse(bytes.data, bytes.size, key);
    if (!record) set_aside(cache, QMAT_CACHE_RECORD, key);
  }
  qmat_bytes_uninit(&bytes);
  qmat_free(path);
  return record ? record : remote_record(cache, key);
}

static bool has_locally(const qmat_cache *cache, const qmat_digest *digest, uint64_t size) {
  struct stat about;
  char *path = qmat_cache_path_of_digest(cache, QMAT_CACHE_BLOB, digest);
  bool there = path && !is_bad(cache, digest) && stat(path, &about) == 0 && (uint64_t)about.st_size == size;
  qmat_free(path);
  return there;
}

static bool has_blob(qmat_cache *cache, const qmat_digest *digest, uint64_t size) {
  return has_locally(cache, digest, size) ||
         qmat_remote_has(cache->remote, qmat_cache_kind_folder(QMAT_CACHE_BLOB), digest, size);
}

/* The items of a list, each in a blob of its own. Items are never lists. */
typedef struct list_items {
  qmat_cache *cache;
  bool missing; /* an item is missing or damaged; the list's own blob may be intact */
} list_items;

/* The value of a blob's bytes. Sealing computes the digest of the value's serialised form, so the bytes are hashed
 * once. */
static qmat_value *parse_value(const uint8_t *bytes, size_t size, const qmat_digest *digest,
                               const qmat_value_source *items) {
  qmat_context nobody = {0}; /* bad bytes are no error here */
  qmat_value *value;
  if (qmat_value_deserialize(&nobody, bytes, size, items, &value) != QMAT_OK) return NULL;
  if (qmat_digest_equal(&value->digest, digest)) return value;
  qmat_value_release(value);
  return NULL;
}

static qmat_value *local_value(qmat_cache *cache, const qmat_digest *digest, const qmat_value_source *items) {
  qmat_value *value = NULL;
  qmat_bytes bytes = {0};
  char *path = qmat_cache_path_of_digest(cache, QMAT_CACHE_BLOB, digest);
  if (path && !is_bad(cache, digest) && read_file(cache, path, &bytes)) {
    value = parse_value(bytes.data, bytes.size, digest, items);
    const list_items *list = items ? items->user : NULL;
    if (!value && !(list && list->missing)) set_aside(cache, QMAT_CACHE_BLOB, digest);
  }
  qmat_bytes_uninit(&bytes);
  qmat_free(path);
  return value;
}

static qmat_value *remote_value(qmat_cache *cache, const qmat_digest *digest, uint64_t size,
                                const qmat_value_source *items) {
  qmat_writer body = {0};
  qmat_value *value = NULL;
  if (qmat_remote_get(cache->remote, qmat_cache_kind_folder(QMAT_CACHE_BLOB), digest, size, &body)) {
    value = body.size == size ? parse_value(body.bytes, body.size, digest, items) : NULL;
    const list_items *list = items ? items->user : NULL;
    if (value)
      keep_bytes(cache, QMAT_CACHE_BLOB, digest, body.bytes, body.size);
    else if (!(list && list->missing))
      warn_of_damage(cache, "blob");
  }
  qmat_writer_uninit(&body);
  return value;
}

static qmat_value *find_item(void *user, const qmat_digest *digest, uint64_t size) {
  list_items *list = user;
  qmat_value *item = local_value(list->cache, digest, NULL);
  if (!item) item = remote_value(list->cache, digest, size, NULL);
  if (!item) list->missing = true;
  return item;
}

qmat_value *qmat_cache_value(qmat_cache *cache, const qmat_digest *digest, uint64_t size, qmat_value_type type) {
  list_items list = {.cache = cache};
  const qmat_value_source source = {find_item, &list}, *items = type == QMAT_LIST ? &source : NULL;
  qmat_value *value = local_value(cache, digest, items);
  if (!value && !list.missing) value = remote_value(cache, digest, size, items);
  if (!value || value->type == type) return value;
  qmat_value_release(value);
  return NULL;
}

static void touch(const qmat_cache *cache, qmat_cache_kind kind, const qmat_digest *digest) {
  char *path = cache->read_only ? NULL : qmat_cache_path_of_digest(cache, kind, digest);
  if (path) (void)utimensat(AT_FDCWD, path, NULL, 0);
  qmat_free(path);
}

void qmat_cache_touch_record(qmat_cache *cache, const qmat_digest *key) {
  touch(cache, QMAT_CACHE_RECORD, key);
}

/* ---- writing ---- */

/* Sends bytes to the remote cache. A blob that it has already is not sent; a record may be newer and is sent again. */
static bool send_bytes(qmat_cache *cache, qmat_cache_kind kind, const qmat_digest *digest, const void *bytes,
                       size_t size) {
  const char *folder = qmat_cache_kind_folder(kind);
  if (!qmat_remote_is_writable(cache->remote)) return false;
  return (kind == QMAT_CACHE_BLOB && qmat_remote_has(cache->remote, folder, digest, size)) ||
         qmat_remote_put(cache->remote, folder, digest, bytes, size);
}

/* Whether the cache has an intact blob, or one that may not be read. A damaged one is moved away, or the new value
 * would not be stored. */
static bool is_kept(qmat_cache *cache, const qmat_digest *digest, size_t size) {
  qmat_digest found;
  char *path = qmat_cache_path_of_digest(cache, QMAT_CACHE_BLOB, digest);
  const bool unreadable = is_unreadable(cache, path), there = !unreadable && has_locally(cache, digest, size);
  const bool sound = there && path && qmat_digest_of_file(path, &found) == QMAT_OK && qmat_digest_equal(&found, digest);
  qmat_free(path);
  if (sound) touch(cache, QMAT_CACHE_BLOB, digest); /* as new as the record that is about to name it */
  if (there && !sound) set_aside(cache, QMAT_CACHE_BLOB, digest);
  return sound || unreadable;
}

/* Stores the serialised form of a value and returns its entry in a record. */
static json_t *put_blob(qmat_cache *cache, const qmat_value *value, bool *added) {
  qmat_context nobody = {0};
  const qmat_digest *digest = &value->digest;
  uint8_t *bytes;
  size_t size;
  if (!qmat_cache_is_writable(cache) || qmat_value_serialize(&nobody, value, &bytes, &size) != QMAT_OK) return NULL;
  bool kept = is_kept(cache, digest, size);
  if (!kept) kept = *added = keep_bytes(cache, QMAT_CACHE_BLOB, digest, bytes, size);
  bool sent = send_bytes(cache, QMAT_CACHE_BLOB, digest, bytes, size);
  qmat_free(bytes);
  char hex[65];
  qmat_digest_hex(digest, hex);
  return kept || sent ? json_pack("{s:s, s:I}", "digest", hex, "blob", (json_int_t)size) : NULL;
}

json_t *qmat_cache_put_value(qmat_cache *cache, const qmat_value *value, bool *added) {
  *added = false;
  json_t *items = value->type == QMAT_LIST ? json_array() : NULL;
  bool done = value->type != QMAT_LIST || items;
  for (size_t i = 0; items && i < qmat_value_count(value) && done; i++)
    done = json_array_append_new(items, put_blob(cache, qmat_value_at(value, i), added)) == 0;
  json_t *stored = done ? put_blob(cache, value, added) : NULL;
  if (stored && items && json_object_set(stored, "items", items) != 0) {
    json_decref(stored);
    stored = NULL;
  }
  json_decref(items);
  return stored;
}

/* The blobs of a value's entry in a record: its own, and those of a list's items. */
static size_t blob_count(const json_t *stored) {
  return 1 + json_array_size(json_object_get(stored, "items"));
}

static bool blob_at(const json_t *stored, size_t index, qmat_digest *digest, uint64_t *size) {
  const json_t *blob = index == 0 ? stored : json_array_get(json_object_get(stored, "items"), index - 1);
  const char *hex = json_string_value(json_object_get(blob, "digest"));
  const json_int_t bytes = json_integer_value(json_object_get(blob, "blob"));
  *size = (uint64_t)bytes;
  return hex && qmat_digest_parse(hex, digest) && bytes > 0;
}

bool qmat_cache_has_stored(qmat_cache *cache, const json_t *stored) {
  qmat_digest digest;
  uint64_t size;
  for (size_t i = 0; i < blob_count(stored); i++)
    if (!blob_at(stored, i, &digest, &size) || !has_blob(cache, &digest, size)) return false;
  return true;
}

void qmat_cache_touch_stored(qmat_cache *cache, const json_t *stored) {
  qmat_digest digest;
  uint64_t size;
  for (size_t i = 0; i < blob_count(stored); i++)
    if (blob_at(stored, i, &digest, &size)) touch(cache, QMAT_CACHE_BLOB, &digest);
}

uint64_t qmat_cache_stored_size(const json_t *stored) {
  qmat_digest digest;
  uint64_t size, total = 0;
  for (size_t i = 0; i < blob_count(stored); i++)
    if (blob_at(stored, i, &digest, &size)) total += size;
  return total;
}

bool qmat_cache_put_record(qmat_cache *cache, const qmat_digest *key, const json_t *record) {
  qmat_writer writer = {0};
  bool done = qmat_cache_is_writable(cache) && qmat_record_write(record, &writer);
  if (done) {
    const bool kept = keep_bytes(cache, QMAT_CACHE_RECORD, key, writer.bytes, writer.size);
    const bool sent = send_bytes(cache, QMAT_CACHE_RECORD, key, writer.bytes, writer.size);
    done = kept || sent;
  }
  qmat_writer_uninit(&writer);
  return done;
}

/* ---- maintenance ---- */

typedef struct entry_list {
  qmat_cache_entry *entries;
  size_t count, capacity;
} entry_list;

/* Whether the cache makes files of this name. */
static bool is_ours(qmat_cache_kind kind, const char *name, qmat_digest *digest) {
  if (kind == QMAT_CACHE_TEMPORARY) return *name && strspn(name, "0123456789-") == strlen(name) && strlen(name) < 64;
  return qmat_digest_parse(name, digest);
}

static bool list_kind(const qmat_cache *cache, qmat_cache_kind kind, entry_list *list) {
  char *path = qmat_cache_path(cache, kind, "");
  DIR *folder = path ? opendir(path) : NULL;
  bool done = path != NULL;
  qmat_free(path);
  for (struct dirent *file; folder && done && (file = readdir(folder));) {
    qmat_cache_entry entry = {.kind = kind};
    struct stat about;
    if (!is_ours(kind, file->d_name, &entry.digest) || fstatat(dirfd(folder), file->d_name, &about, 0) != 0 ||
        !S_ISREG(about.st_mode))
      continue;
    snprintf(entry.name, sizeof entry.name, "%.*s", (int)sizeof entry.name - 1, file->d_name);
    entry.size = (uint64_t)about.st_size;
    entry.used = (int64_t)about.st_mtim.tv_sec * 1000000000 + about.st_mtim.tv_nsec;
    done = qmat_grow((void **)&list->entries, &list->capacity, list->count + 1, sizeof *list->entries) == 0;
    if (done) list->entries[list->count++] = entry;
  }
  if (folder) closedir(folder);
  return done;
}

static int64_t now_nanoseconds(void) {
  struct timespec time;
  clock_gettime(CLOCK_REALTIME, &time);
  return (int64_t)time.tv_sec * 1000000000 + time.tv_nsec;
}

static bool is_recent(const qmat_cache_entry *entry, int64_t now) {
  return now - entry->used < (int64_t)24 * 3600 * 1000000000;
}

static int by_kind_and_name(const void *a, const void *b) {
  const qmat_cache_entry *first = a, *second = b;
  return first->kind != second->kind ? (first->kind > second->kind) - (first->kind < second->kind)
                                     : strcmp(first->name, second->name);
}

static int by_last_use(const void *a, const void *b) {
  const qmat_cache_entry *first = a, *second = b;
  return first->used != second->used ? (first->used > second->used) - (first->used < second->used)
                                     : by_kind_and_name(a, b);
}

/* The order of chance: by a hash of the last use to 2 s, so that the record of a result and its blobs stay together. */
static int by_chance(const void *a, const void *b) {
  const qmat_cache_entry *first = a, *second = b;
  const uint64_t factor = 0x9e3779b97f4a7c15u, x = (uint64_t)(first->used >> 31) * factor,
                 y = (uint64_t)(second->used >> 31) * factor;
  return x != y ? (x > y) - (x < y) : by_last_use(a, b);
}

/* Sorts entries by how little they are worth keeping: by their last use. Of the last day, the older half is in an order
 * of chance: work in the same order each day that does not fit would find nothing again, as each result would be
 * deleted just before its turn. */
static void sort_victims(qmat_cache_entry *entries, size_t count, int64_t now) {
  size_t old = 0;
  if (count == 0) return;
  qsort(entries, count, sizeof *entries, by_last_use);
  while (old < count && !is_recent(&entries[old], now)) old++;
  if (count - old > 1) qsort(entries + old, (count - old) / 2, sizeof *entries, by_chance);
}

bool qmat_cache_list(const qmat_cache *cache, qmat_cache_entry **entries, size_t *count) {
  entry_list list = {0};
  bool done = true;
  for (int kind = 0; kind < QMAT_CACHE_KIND_COUNT && done; kind++)
    done = list_kind(cache, (qmat_cache_kind)kind, &list);
  if (!done) {
    qmat_free(list.entries);
    list = (entry_list){0};
  }
  if (list.count > 0) qsort(list.entries, list.count, sizeof *list.entries, by_kind_and_name);
  *entries = list.entries;
  *count = list.count;
  return done;
}

static void delete_entry(const qmat_cache *cache, const qmat_cache_entry *entry, qmat_cache_sweep *sweep) {
  char *path = qmat_cache_path(cache, entry->kind, entry->name);
  if (path && unlink(path) == 0) {
    sweep->deleted++;
    sweep->freed += entry->size;
  }
  qmat_free(path);
}

/* Whether the writer of a temporary is gone. */
static bool is_abandoned(const qmat_cache *cache, const qmat_cache_entry *entry) {
  char *path = qmat_cache_path(cache, entry->kind, entry->name);
  int file = path ? open(path, O_RDONLY | O_CLOEXEC) : -1;
  bool abandoned = file >= 0 && flock(file, LOCK_EX | LOCK_NB) == 0;
  if (file >= 0) close(file);
  qmat_free(path);
  return abandoned;
}

/* The entry of a blob in a sorted list, or NULL. */
static qmat_cache_entry *find_blob(qmat_cache_entry *entries, size_t count, const qmat_digest *digest) {
  qmat_cache_entry wanted = {.kind = QMAT_CACHE_BLOB};
  if (count == 0) return NULL;
  qmat_digest_hex(digest, wanted.name);
  return bsearch(&wanted, entries, count, sizeof *entries, by_kind_and_name);
}

/* Marks the blobs of a value's entry in a record. False: one is missing. */
static bool mark_named(const json_t *stored, qmat_cache_entry *entries, size_t count, bool *named) {
  bool complete = true;
  for (size_t i = 0; i < blob_count(stored); i++) {
    qmat_digest digest;
    uint64_t size;
    qmat_cache_entry *blob = blob_at(stored, i, &digest, &size) ? find_blob(entries, count, &digest) : NULL;
    if (blob)
      named[blob - entries] = true;
    else
      complete = false;
  }
  return complete;
}

/* Deletes damaged files, records with a missing blob, and blobs that no record names. */
static void collect_unnamed(qmat_cache *cache, qmat_cache_entry *entries, size_t count, qmat_cache_sweep *sweep) {
  const int64_t hour = (int64_t)3600 * 1000000000, now = now_nanoseconds();
  bool *named = qmat_calloc(count, sizeof *named);
  if (!named) return;
  for (size_t i = 0; i < count && entries[i].kind == QMAT_CACHE_RECORD; i++) {
    json_t *record = qmat_cache_record(cache, &entries[i].digest);
    const json_t *outputs = json_object_get(record, "outputs");
    bool complete = record != NULL;
    for (size_t k = 0; k < json_array_size(outputs); k++)
      if (!mark_named(json_array_get(outputs, k), entries, count, named)) complete = false;
    /* Another process may have stored the blobs since the listing, so a new record stays. */
    if (record && !complete && now - entries[i].used > hour) delete_entry(cache, &entries[i], sweep);
    json_decref(record);
  }
  for (size_t i = 0; i < count; i++) {
    bool unnamed = entries[i].kind == QMAT_CACHE_BLOB && !named[i] && now - entries[i].used > hour;
    if (unnamed || entries[i].kind == QMAT_CACHE_BAD) delete_entry(cache, &entries[i], sweep);
  }
  qmat_free(named);
}

qmat_cache_sweep qmat_cache_collect(qmat_cache *cache, uint64_t most_size, bool thorough) {
  qmat_cache_sweep sweep = {0};
  if (cache->read_only) return sweep;
  entry_list list = {0};
  const int64_t now = now_nanoseconds();
  const uint64_t length = qmat_cache_size_length(cache);
  if (most_size == UINT64_MAX && !thorough) {
    list_kind(cache, QMAT_CACHE_TEMPORARY, &list);
  } else if (!qmat_cache_list(cache, &list.entries, &list.count)) {
    return sweep;
  }
  for (size_t i = 0; i < list.count; i++)
    if (list.entries[i].kind == QMAT_CACHE_TEMPORARY && is_abandoned(cache, &list.entries[i]))
      delete_entry(cache, &list.entries[i], &sweep);
  if (thorough) {
    collect_unnamed(cache, list.entries, list.count, &sweep);
    qmat_free(list.entries);
    if (!qmat_cache_list(cache, &list.entries, &list.count)) return sweep;
  }
  uint64_t total = 0;
  for (size_t i = 0; i < list.count; i++)
    if (list.entries[i].kind <= QMAT_CACHE_BLOB) total += list.entries[i].size;
  if (total > most_size) {
    /* A tenth below the limit, so that the next run need not delete again. */
    uint64_t wanted = most_size - most_size / 10;
    sort_victims(list.entries, list.count, now);
    for (size_t i = 0; i < list.count && total > wanted; i++) {
      const qmat_cache_entry *entry = &list.entries[i];
      if (entry->kind > QMAT_CACHE_BLOB) continue;
      const size_t before = sweep.deleted;
      delete_entry(cache, entry, &sweep);
      total -= entry->size;
      if (sweep.deleted > before && is_recent(entry, now)) sweep.recent++;
    }
  }
  if (most_size != UINT64_MAX || thorough) qmat_cache_note_size(cache, total, length);
  qmat_free(list.entries);
  return sweep;
}

qmat_cache_sweep qmat_cache_clear(qmat_cache *cache) {
  qmat_cache_sweep sweep = {0};
  qmat_cache_entry *entries;
  size_t count;
  if (cache->read_only || !qmat_cache_list(cache, &entries, &count)) return sweep;
  /* The list has records first, so that no process reads a record whose blobs are gone. */
  for (size_t i = 0; i < count; i++)
    if (entries[i].kind != QMAT_CACHE_TEMPORARY || is_abandoned(cache, &entries[i]))
      delete_entry(cache, &entries[i], &sweep);
  qmat_free(entries);
  qmat_cache_note_size(cache, 0, 0);
  return sweep;
}

/* Whether another process has deleted an entry since it was listed. */
static bool is_gone(const qmat_cache *cache, const qmat_cache_entry *entry) {
  char *path = qmat_cache_path(cache, entry->kind, entry->name);
  const bool gone = path && access(path, F_OK) != 0 && errno == ENOENT;
  qmat_free(path);
  return gone;
}

static qmat_cache_health check_record(qmat_cache *cache, const qmat_cache_entry *entry) {
  json_t *record = qmat_cache_record(cache, &entry->digest);
  const json_t *outputs = json_object_get(record, "outputs");
  qmat_cache_health health = QMAT_CACHE_SOUND;
  for (size_t i = 0; i < json_array_size(outputs); i++)
    if (!qmat_cache_has_stored(cache, json_array_get(outputs, i))) health = QMAT_CACHE_INCOMPLETE;
  json_decref(record);
  return health;
}

/* Whether the file of an entry has the bytes that its name promises. */
static bool is_intact(const qmat_cache_entry *entry, const char *path) {
  qmat_digest digest;
  if (entry->kind == QMAT_CACHE_BLOB)
    return qmat_digest_of_file(path, &digest) == QMAT_OK && qmat_digest_equal(&digest, &entry->digest);
  qmat_context nobody = {0};
  qmat_bytes bytes = {0};
  json_t *record = NULL;
  if (qmat_bytes_read_file(&nobody, path, &bytes) == QMAT_OK)
    record = qmat_record_parse(bytes.data, bytes.size, &entry->digest);
  const bool intact = record != NULL;
  json_decref(record);
  qmat_bytes_uninit(&bytes);
  return intact;
}

qmat_cache_health qmat_cache_check(qmat_cache *cache, const qmat_cache_entry *entry) {
  if (entry->kind > QMAT_CACHE_BLOB) return QMAT_CACHE_SOUND;
  char *path = qmat_cache_path(cache, entry->kind, entry->name);
  const bool unreadable = is_unreadable(cache, path), intact = !unreadable && path && is_intact(entry, path);
  qmat_free(path);
  if (unreadable) return QMAT_CACHE_UNREADABLE;
  if (intact) return entry->kind == QMAT_CACHE_RECORD ? check_record(cache, entry) : QMAT_CACHE_SOUND;
  if (is_gone(cache, entry)) return QMAT_CACHE_SOUND;
  return set_aside(cache, entry->kind, &entry->digest) ? QMAT_CACHE_BROKEN : QMAT_CACHE_STUCK;
}
