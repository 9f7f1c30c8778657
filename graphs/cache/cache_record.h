/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CACHE_CACHE_RECORD_H
#define QMAT_GRAPHS_CACHE_CACHE_RECORD_H

#include <jansson.h>

#include "core/digest.h"
#include "io/bytes.h"

/* The bytes of a record: JSON on one line, and a line with its digest. */

/* A record's JSON, if its `size` bytes are intact and its "key" gives `key`; else NULL. The caller calls json_decref.
 * Cost: one pass over the bytes. */
json_t *qmat_record_parse(const uint8_t *bytes, size_t size, const qmat_digest *key);

/* Puts the bytes of a record into an empty writer, which the caller frees in any case. False when memory is short. */
bool qmat_record_write(const json_t *record, qmat_writer *writer);

#endif
