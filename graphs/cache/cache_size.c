/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/cache/cache_size.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "graphs/cache/cache_files.h"

enum { LINE = 21 }; /* 20 digits and the end of the line */
static const uint64_t unit = (uint64_t)1 << 16;

static char *size_path(const qmat_cache *cache) {
  const size_t size = strlen(cache->folder) + sizeof "size";
  char *path = qmat_alloc(size, 1);
  if (path) snprintf(path, size, "%ssize", cache->folder);
  return path;
}

/* Opens the file; -1: it is missing, or memory is short. */
static int open_size(const qmat_cache *cache, int flags) {
  char *path = size_path(cache);
  const int file = path ? open(path, flags | O_CLOEXEC, 0666) : -1;
  qmat_free(path);
  return file;
}

/* The size at the last listing, and the units of 64 KiB counted since. False: the file says nothing. */
static bool read_size(const qmat_cache *cache, uint64_t *total, uint64_t *counted) {
  char line[LINE + 1] = "";
  struct stat about;
  const int file = open_size(cache, O_RDONLY);
  const bool read_it = file >= 0 && pread(file, line, LINE, 0) == LINE && fstat(file, &about) == 0;
  if (file >= 0) close(file);
  if (!read_it || strspn(line, "0123456789") != LINE - 1 || line[LINE - 1] != '\n') return false;
  *total = strtoull(line, NULL, 10);
  *counted = (uint64_t)about.st_size - LINE;
  return true;
}

void qmat_cache_count(qmat_cache *cache, uint64_t bytes) {
  cache->stored = true;
  if (bytes > cache->counted_ahead) {
    char dots[4096];
    uint64_t units = (bytes - cache->counted_ahead - 1) / unit + 1;
    cache->counted_ahead += units * unit;
    memset(dots, '.', sizeof dots);
    const int file = open_size(cache, O_WRONLY | O_APPEND | O_CREAT);
    for (size_t part; units > 0 && !cache->uncounted; units -= part) {
      part = units < sizeof dots ? (size_t)units : sizeof dots;
      cache->uncounted = file < 0 || write(file, dots, part) != (ssize_t)part;
    }
    if (file >= 0) close(file);
  }
  cache->counted_ahead -= bytes;
}

bool qmat_cache_may_be_full(const qmat_cache *cache) {
  uint64_t total, counted;
  if (cache->uncounted || !read_size(cache, &total, &counted)) return true;
  /* Rounded down: a cache of a few units is listed each time. */
  return total > cache->most_size || counted > (cache->most_size - total) / unit ||
         counted > cache->most_size / 8 / unit;
}

uint64_t qmat_cache_size_length(const qmat_cache *cache) {
  struct stat about;
  char *path = size_path(cache);
  const bool there = path && stat(path, &about) == 0;
  qmat_free(path);
  return there ? (uint64_t)about.st_size : 0;
}

void qmat_cache_note_size(qmat_cache *cache, uint64_t total, uint64_t length) {
  char *path = size_path(cache);
  const uint64_t now = qmat_cache_size_length(cache), most = (uint64_t)1 << 24;
  uint64_t since = now > length ? now - length : 0;
  if (since > most) since = most; /* 1 TB: a damaged file may be of any length */
  char *text = path && total > 0 ? qmat_alloc(LINE + (size_t)since + 1, 1) : NULL;
  if (text) {
    snprintf(text, LINE + 1, "%020" PRIu64 "\n", total);
    memset(text + LINE, '.', (size_t)since);
    if (qmat_cache_place_file(cache, path, text, LINE + (size_t)since)) cache->uncounted = false;
  } else if (path) {
    unlink(path);
  }
  qmat_free(text);
  qmat_free(path);
}

bool qmat_cache_begin_sweep(const qmat_cache *cache, int *file) {
  *file = open_size(cache, O_RDWR);
  return *file < 0 || flock(*file, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
}
