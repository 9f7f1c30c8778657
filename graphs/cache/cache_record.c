/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/cache/cache_record.h"

#include <string.h>

#include "core/json_text.h"
#include "graphs/cache/cache_key.h"

/* A record's last line has the digest of its JSON. */
static const char record_end[] = "\nsha256 ";

json_t *qmat_record_parse(const uint8_t *bytes, size_t size, const qmat_digest *key) {
  const size_t tail = sizeof record_end - 1 + 64 + 1;
  qmat_digest wanted, digest;
  char hex[65];
  if (size <= tail || bytes[size - 1] != '\n') return NULL;
  size_t length = size - tail;
  if (memcmp(bytes + length, record_end, sizeof record_end - 1) != 0) return NULL;
  memcpy(hex, bytes + size - 65, 64);
  hex[64] = 0;
  if (!qmat_digest_parse(hex, &wanted) || qmat_digest_of(bytes, length, &digest) != QMAT_OK ||
      !qmat_digest_equal(&wanted, &digest))
    return NULL;
  json_t *record = json_loadb((const char *)bytes, length, JSON_REJECT_DUPLICATES, NULL);
  if (qmat_key_digest(json_object_get(record, "key"), &digest) && qmat_digest_equal(&digest, key)) return record;
  json_decref(record);
  return NULL;
}

bool qmat_record_write(const json_t *record, qmat_writer *writer) {
  qmat_digest digest;
  char hex[65];
  size_t length;
  char *text = qmat_json_text(record, JSON_COMPACT | JSON_SORT_KEYS, &length);
  const bool done = text && qmat_digest_of(text, length, &digest) == QMAT_OK;
  if (done) {
    qmat_digest_hex(&digest, hex);
    qmat_put_bytes(writer, text, length);
    qmat_put_text(writer, record_end);
    qmat_put_text(writer, hex);
    qmat_put_text(writer, "\n");
  }
  qmat_free(text);
  return done && !writer->failed;
}
