/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/digest.h"

#include <errno.h>
#include <fcntl.h>
#include <openssl/evp.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

qmat_status qmat_hasher_init(qmat_hasher *hasher) {
  EVP_MD_CTX *state = EVP_MD_CTX_new();
  hasher->state = NULL;
  if (!state) return QMAT_ERROR_MEMORY;
  if (EVP_DigestInit_ex(state, EVP_sha256(), NULL) != 1) {
    EVP_MD_CTX_free(state);
    return QMAT_ERROR_DEPENDENCY;
  }
  hasher->state = state;
  return QMAT_OK;
}

void qmat_hasher_add(qmat_hasher *hasher, const void *bytes, size_t size) {
  if (!hasher->state || size == 0) return;
  if (EVP_DigestUpdate(hasher->state, bytes, size) != 1) qmat_hasher_finish(hasher, NULL);
}

qmat_status qmat_hasher_finish(qmat_hasher *hasher, qmat_digest *digest) {
  bool done = hasher->state != NULL;
  if (digest) {
    memset(digest, 0, sizeof *digest);
    done = done && EVP_DigestFinal_ex(hasher->state, digest->bytes, NULL) == 1;
  }
  EVP_MD_CTX_free(hasher->state);
  hasher->state = NULL;
  return done ? QMAT_OK : QMAT_ERROR_DEPENDENCY;
}

void qmat_digest_hex(const qmat_digest *digest, char text[65]) {
  for (size_t i = 0; i < sizeof digest->bytes; i++) {
    text[2 * i] = "0123456789abcdef"[digest->bytes[i] >> 4];
    text[2 * i + 1] = "0123456789abcdef"[digest->bytes[i] & 15];
  }
  text[64] = '\0';
}

qmat_status qmat_digest_of(const void *bytes, size_t size, qmat_digest *digest) {
  qmat_hasher hasher;
  const qmat_status status = qmat_hasher_init(&hasher);
  qmat_hasher_add(&hasher, bytes, size);
  const qmat_status finished = qmat_hasher_finish(&hasher, digest);
  return status != QMAT_OK ? status : finished;
}

qmat_status qmat_digest_of_file(const char *path, qmat_digest *digest) {
  /* Without O_NONBLOCK, opening a pipe waits for its writer. */
  const int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  struct stat about;
  if (file < 0) return QMAT_ERROR_IO;
  if (fstat(file, &about) != 0 || !S_ISREG(about.st_mode)) {
    close(file);
    return QMAT_ERROR_IO;
  }
  unsigned char bytes[1 << 16];
  qmat_hasher hasher;
  qmat_status status = qmat_hasher_init(&hasher);
  while (status == QMAT_OK) {
    const ssize_t got = read(file, bytes, sizeof bytes);
    if (got == 0) break;
    if (got > 0) {
      qmat_hasher_add(&hasher, bytes, (size_t)got);
    } else if (errno != EINTR) {
      status = QMAT_ERROR_IO;
    }
  }
  close(file);
  const qmat_status finished = qmat_hasher_finish(&hasher, digest);
  return status != QMAT_OK ? status : finished;
}

static int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

bool qmat_digest_parse(const char *text, qmat_digest *digest) {
  qmat_digest parsed;
  if (strnlen(text, 65) != 64) return false;
  for (size_t i = 0; i < sizeof parsed.bytes; i++) {
    const int high = hex_digit(text[2 * i]), low = hex_digit(text[2 * i + 1]);
    if (high < 0 || low < 0) return false;
    parsed.bytes[i] = (uint8_t)(16 * high + low);
  }
  *digest = parsed;
  return true;
}

bool qmat_digest_equal(const qmat_digest *a, const qmat_digest *b) {
  return memcmp(a->bytes, b->bytes, sizeof a->bytes) == 0;
}
