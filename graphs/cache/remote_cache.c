/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/cache/remote_cache.h"

#include <curl/curl.h>
#include <stdio.h>
#include <string.h>

enum {
  CONNECT_MILLISECONDS = 1500,
  SLOW_SECONDS = 3, /* of less than SLOW_BYTES a second */
  SLOW_BYTES = 4096,
  TRANSFER_MILLISECONDS = 60000 /* of one file */
};

struct qmat_remote_cache {
  char *url; /* without a slash at its end */
  bool read_only, dead;
  CURL *curl;
  char warning[384];
};

qmat_shown_url qmat_show_url(const char *url) {
  qmat_shown_url shown;
  const char *scheme_end = strstr(url, "://"), *host = strrchr(url, '@');
  const int scheme = scheme_end && host && scheme_end < host ? (int)(scheme_end - url) + 3 : 0;
  if (host)
    snprintf(shown.text, sizeof shown.text, "%.*s***%s", scheme, url, host);
  else
    snprintf(shown.text, sizeof shown.text, "%s", url);
  return shown;
}

qmat_remote_cache *qmat_remote_open(const char *url, bool read_only) {
  qmat_remote_cache *remote = qmat_calloc(1, sizeof *remote);
  if (!remote) return NULL;
  remote->read_only = read_only;
  remote->url = qmat_strdup(url);
  remote->curl = curl_easy_init();
  if (!remote->url || !remote->curl) {
    qmat_remote_close(remote);
    return NULL;
  }
  size_t length = strlen(remote->url);
  while (length > 0 && remote->url[length - 1] == '/') remote->url[--length] = 0;
  return remote;
}

void qmat_remote_close(qmat_remote_cache *remote) {
  if (!remote) return;
  if (remote->curl) curl_easy_cleanup(remote->curl);
  qmat_free(remote->url);
  qmat_free(remote);
}

bool qmat_remote_is_writable(const qmat_remote_cache *remote) {
  return remote && !remote->dead && !remote->read_only;
}

const char *qmat_remote_warning(const qmat_remote_cache *remote) {
  return remote->warning;
}

/* ---- one request ---- */

/* The body of a request or of an answer. */
typedef struct transfer {
  qmat_writer *received;
  uint64_t most_size;
  const char *sent;
  size_t sent_size, sent_so_far;
} transfer;

static size_t take_bytes(char *bytes, size_t one, size_t size, void *user) {
  transfer *transfer = user;
  (void)one;
  if (!transfer->received) return size;
  if (transfer->received->size + size > transfer->most_size) return 0; /* too long: ends the transfer */
  qmat_put_bytes(transfer->received, bytes, size);
  return transfer->received->failed ? 0 : size;
}

static size_t give_bytes(char *bytes, size_t one, size_t size, void *user) {
  transfer *transfer = user;
  size *= one;
  if (size > transfer->sent_size - transfer->sent_so_far) size = transfer->sent_size - transfer->sent_so_far;
  if (size > 0) memcpy(bytes, transfer->sent + transfer->sent_so_far, size);
  transfer->sent_so_far += size;
  return size;
}

/* A server that sends the body on to another address reads it again from its start. */
static int rewind_bytes(void *user, curl_off_t offset, int origin) {
  transfer *transfer = user;
  if (origin != SEEK_SET || offset < 0 || (uint64_t)offset > transfer->sent_size) return CURL_SEEKFUNC_FAIL;
  transfer->sent_so_far = (size_t)offset;
  return CURL_SEEKFUNC_OK;
}

/* Prepares a request for URL/folder/digest. */
static bool start(qmat_remote_cache *remote, const char *folder, const qmat_digest *digest, transfer *transfer) {
  char hex[65];
  if (!remote || remote->dead) return false;
  size_t size = strlen(remote->url) + strlen(folder) + sizeof hex + 1;
  char *url = qmat_alloc(size, 1);
  if (!url) return false;
  qmat_digest_hex(digest, hex);
  snprintf(url, size, "%s/%s%s", remote->url, folder, hex);
  CURL *curl = remote->curl;
  curl_easy_reset(curl); /* the connection stays open */
  curl_easy_setopt(curl, CURLOPT_URL, url);
  curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(curl, CURLOPT_REDIR_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(curl, CURLOPT_FOLLOWLOCATION, 1L);
  curl_easy_setopt(curl, CURLOPT_MAXREDIRS, 3L);
  curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT_MS, (long)CONNECT_MILLISECONDS);
  curl_easy_setopt(curl, CURLOPT_LOW_SPEED_LIMIT, (long)SLOW_BYTES);
  curl_easy_setopt(curl, CURLOPT_LOW_SPEED_TIME, (long)SLOW_SECONDS);
  curl_easy_setopt(curl, CURLOPT_TIMEOUT_MS, (long)TRANSFER_MILLISECONDS);
  curl_easy_setopt(curl, CURLOPT_USERAGENT, "qmat/" QMAT_VERSION);
  curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, take_bytes);
  curl_easy_setopt(curl, CURLOPT_WRITEDATA, transfer);
  qmat_free(url);
  return true;
}

/* Performs a request and returns the HTTP status; 0: no answer, and the server is not used again. */
static long finish(qmat_remote_cache *remote) {
  CURLcode result = curl_easy_perform(remote->curl);
  long code = 0;
  if (result == CURLE_OK) curl_easy_getinfo(remote->curl, CURLINFO_RESPONSE_CODE, &code);
  if (result == CURLE_WRITE_ERROR) return 0; /* a longer answer than expected; the server is alive */
  if (result != CURLE_OK || code >= 500) {
    char reason[64];
    snprintf(reason, sizeof reason, "it answers with status %ld", code);
    remote->dead = true;
    snprintf(remote->warning, sizeof remote->warning, "the remote cache %.200s is not used any more: %s",
             qmat_show_url(remote->url).text, result != CURLE_OK ? curl_easy_strerror(result) : reason);
    return 0;
  }
  return code;
}

bool qmat_remote_get(qmat_remote_cache *remote, const char *folder, const qmat_digest *digest, uint64_t most_size,
                     qmat_writer *body) {
  transfer transfer = {.received = body, .most_size = most_size};
  if (!start(remote, folder, digest, &transfer)) return false;
  return finish(remote) == 200 && !body->failed;
}

bool qmat_remote_has(qmat_remote_cache *remote, const char *folder, const qmat_digest *digest, uint64_t size) {
  transfer transfer = {0};
  curl_off_t length = -1;
  if (!start(remote, folder, digest, &transfer)) return false;
  curl_easy_setopt(remote->curl, CURLOPT_NOBODY, 1L);
  if (finish(remote) != 200) return false;
  curl_easy_getinfo(remote->curl, CURLINFO_CONTENT_LENGTH_DOWNLOAD_T, &length);
  return length >= 0 && (uint64_t)length == size;
}

bool qmat_remote_put(qmat_remote_cache *remote, const char *folder, const qmat_digest *digest, const void *bytes,
                     size_t size) {
  transfer transfer = {.sent = bytes, .sent_size = size};
  if (!qmat_remote_is_writable(remote) || !start(remote, folder, digest, &transfer)) return false;
  curl_easy_setopt(remote->curl, CURLOPT_UPLOAD, 1L);
  curl_easy_setopt(remote->curl, CURLOPT_INFILESIZE_LARGE, (curl_off_t)size);
  curl_easy_setopt(remote->curl, CURLOPT_READFUNCTION, give_bytes);
  curl_easy_setopt(remote->curl, CURLOPT_READDATA, &transfer);
  curl_easy_setopt(remote->curl, CURLOPT_SEEKFUNCTION, rewind_bytes);
  curl_easy_setopt(remote->curl, CURLOPT_SEEKDATA, &transfer);
  long code = finish(remote);
  if (code >= 200 && code < 300) return true;
  /* A server that refuses PUT may still answer GET. */
  if (code > 0 && !*remote->warning) {
    snprintf(remote->warning, sizeof remote->warning, "the remote cache %.200s refuses to store: status %ld",
             qmat_show_url(remote->url).text, code);
    remote->read_only = true;
  }
  return false;
}
