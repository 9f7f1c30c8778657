/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/digest.h"

#include <openssl/evp.h>
#include <stdbool.h>
#include <string.h>

qmat_status qmat_hasher_init(qmat_hasher *hasher) {
  EVP_MD_CTX *state = EVP_MD_CTX_new();
  hasher->state = NULL;
  if (state == NULL) return QMAT_ERROR_MEMORY;
  if (EVP_DigestInit_ex(state, EVP_sha256(), NULL) != 1) {
    EVP_MD_CTX_free(state);
    return QMAT_ERROR_DEPENDENCY;
  }
  hasher->state = state;
  return QMAT_OK;
}

void qmat_hasher_add(qmat_hasher *hasher, const void *bytes, size_t size) {
  if (hasher->state == NULL || size == 0) return;
  if (EVP_DigestUpdate(hasher->state, bytes, size) != 1) qmat_hasher_finish(hasher, NULL);
}

qmat_status qmat_hasher_finish(qmat_hasher *hasher, qmat_digest *digest) {
  bool done = hasher->state != NULL;
  if (digest != NULL) {
    memset(digest, 0, sizeof *digest);
    done = done && EVP_DigestFinal_ex(hasher->state, digest->bytes, NULL) == 1;
  }
  EVP_MD_CTX_free(hasher->state);
  hasher->state = NULL;
  return done ? QMAT_OK : QMAT_ERROR_DEPENDENCY;
}

void qmat_digest_hex(const qmat_digest *digest, char text[65]) {
  for (size_t i = 0; i < sizeof digest->bytes; ++i) {
    text[2 * i] = "0123456789abcdef"[digest->bytes[i] >> 4];
    text[2 * i + 1] = "0123456789abcdef"[digest->bytes[i] & 15];
  }
  text[64] = '\0';
}
