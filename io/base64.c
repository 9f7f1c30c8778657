/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/base64.h"

#include <string.h>

#include <openssl/evp.h>

#include "core/arena.h"

/* OpenSSL counts in int, so long input goes through in pieces, which must be whole groups of 3 bytes. */
#define PIECE ((size_t)3 << 20)

char *qmat_base64_encode(const uint8_t *bytes, size_t size) {
  if (size > SIZE_MAX / 2) return NULL;
  char *text = qmat_alloc((size + 2) / 3 * 4 + 1, 1);
  if (!text) return NULL;
  char *to = text;
  *to = '\0';
  for (size_t at = 0; at < size; at += PIECE) {
    size_t piece = size - at < PIECE ? size - at : PIECE;
    to += EVP_EncodeBlock((unsigned char *)to, bytes + at, (int)piece);
  }
  return text;
}

qmat_status qmat_base64_decode(qmat_context *context, const char *text, size_t length, uint8_t **bytes, size_t *size) {
  *bytes = NULL;
  *size = 0;
  if (length % 4 != 0)
    return qmat_fail(context, QMAT_ERROR_FORMAT, "base64 text has %zu characters, which is no multiple of 4", length);
  size_t padding = 0;
  while (padding < 2 && padding < length && text[length - 1 - padding] == '=') padding++;
  /* OpenSSL skips blanks at both ends and takes '-' for an end mark; neither belongs here. */
  for (size_t i = 0; i < length - padding; i++) {
    char c = text[i];
    if ((c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '+' || c == '/') continue;
    return qmat_fail(context, QMAT_ERROR_FORMAT, "character %zu of the base64 text is not of its alphabet", i);
  }
  uint8_t *out = qmat_alloc(length / 4 * 3, 1);
  if (!out) return qmat_fail_memory(context, "base64 data");
  uint8_t *to = out;
  for (size_t at = 0; at < length; at += PIECE / 3 * 4) {
    size_t piece = length - at < PIECE / 3 * 4 ? length - at : PIECE / 3 * 4;
    int wrote = EVP_DecodeBlock(to, (const unsigned char *)text + at, (int)piece);
    if (wrote < 0) {
      qmat_free(out);
      return qmat_fail(context, QMAT_ERROR_FORMAT, "the base64 text cannot be decoded");
    }
    to += wrote;
  }
  *bytes = out;
  *size = length / 4 * 3 - padding;
  return QMAT_OK;
}
