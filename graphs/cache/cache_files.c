/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/cache/cache_files.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

static const char *const kind_folders[QMAT_CACHE_KIND_COUNT] = {"ac/", "cas/", "tmp/", "bad/"};

const char *qmat_cache_kind_folder(qmat_cache_kind kind) {
  return kind_folders[kind];
}

char *qmat_cache_path(const qmat_cache *cache, qmat_cache_kind kind, const char *name) {
  size_t folder = strlen(cache->folder), size = folder + strlen(kind_folders[kind]) + strlen(name) + 1;
  char *path = qmat_alloc(size, 1);
  if (path) snprintf(path, size, "%s%s%s", cache->folder, kind_folders[kind], name);
  return path;
}

char *qmat_cache_path_of_digest(const qmat_cache *cache, qmat_cache_kind kind, const qmat_digest *digest) {
  char hex[65];
  qmat_digest_hex(digest, hex);
  return qmat_cache_path(cache, kind, hex);
}

void qmat_cache_warn(qmat_cache *cache, const char *failure, const char *path, int number) {
  const char *reason = strerrordesc_np(number);
  if (!*cache->warning)
    snprintf(cache->warning, sizeof cache->warning, "cannot %s %s: %s", failure, path,
             reason ? reason : "unknown error");
}

bool qmat_cache_make_folders(char *path) {
  if (mkdir(path, 0777) == 0 || errno == EEXIST) return true;
  char *slash = strrchr(path, '/');
  if (errno != ENOENT || !slash || slash == path) return false;
  *slash = 0;
  bool made = qmat_cache_make_folders(path);
  *slash = '/';
  return made && (mkdir(path, 0777) == 0 || errno == EEXIST);
}

static bool write_all(int file, const void *bytes, size_t size) {
  const char *at = bytes;
  while (size > 0) {
    ssize_t done = write(file, at, size < (size_t)1 << 30 ? size : (size_t)1 << 30);
    if (done < 0 && errno == EINTR) continue;
    if (done < 0) return false;
    at += done;
    size -= (size_t)done;
  }
  return true;
}

/* Makes a temporary file with a lock that lasts as long as its writer; -1 with errno. */
static int make_temporary(qmat_cache *cache, char **path) {
  for (int attempt = 0; attempt < 1000; attempt++) {
    char name[64];
    struct timespec time;
    clock_gettime(CLOCK_REALTIME, &time);
    snprintf(name, sizeof name, "%ld-%lld%09ld-%u", (long)getpid(), (long long)time.tv_sec, time.tv_nsec,
             cache->temporaries++);
    *path = qmat_cache_path(cache, QMAT_CACHE_TEMPORARY, name);
    if (!*path) {
      errno = ENOMEM;
      return -1;
    }
    int file = open(*path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    /* Any other error: the file system has no locks, and a sweep cannot take one either. */
    if (file >= 0 && (flock(file, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK)) return file;
    int number = errno;
    if (file >= 0) close(file);
    qmat_free(*path);
    *path = NULL;
    errno = number;
    if (number != EEXIST && number != EWOULDBLOCK) return -1;
  }
  return -1;
}

bool qmat_cache_place_file(qmat_cache *cache, const char *path, const void *bytes, size_t size) {
  char *temporary = NULL;
  bool done = false;
  /* A sweep may delete a temporary just before it is locked: then try again. */
  for (int attempt = 0; attempt < 3 && !done; attempt++) {
    int file = make_temporary(cache, &temporary);
    done = file >= 0 && write_all(file, bytes, size) && (fsync(file) == 0 || errno == EINVAL) &&
           rename(temporary, path) == 0;
    int number = errno;
    if (!done && temporary) unlink(temporary);
    if (file >= 0) close(file);
    qmat_free(temporary);
    temporary = NULL;
    if (done || number == ENOENT) continue;
    qmat_cache_warn(cache, "write to the cache: storing", path, number);
    return false;
  }
  if (!done) qmat_cache_warn(cache, "write to the cache: storing", path, ENOENT);
  return done;
}
