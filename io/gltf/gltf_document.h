/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_DOCUMENT_H
#define QMAT_IO_GLTF_GLTF_DOCUMENT_H

#include <stddef.h>
#include <stdint.h>

#include <jansson.h>

#include "core/context.h"
#include "io/bytes.h"

/* The bytes of one glTF buffer: exactly byteLength of them. */
typedef struct qmat_gltf_buffer {
  const uint8_t *bytes;
  size_t size;
  uint8_t *owned;      /* of a data URI; else NULL */
  qmat_bytes file;     /* of an external file */
  bool is_placeholder; /* only its size is known: its views are compressed elsewhere */
} qmat_gltf_buffer;

/* A checked glTF asset, reduced to its geometry. A zeroed one is empty and valid. */
typedef struct qmat_gltf_document {
  size_t buffer_count;
  qmat_gltf_buffer *buffers;  /* those of the asset, then one for each compressed buffer view */
  size_t data_size;           /* of all buffers of the asset */
  size_t decoded_size;        /* of the decompressed buffer views */
  json_t *extensions_ignored; /* names of used extensions that the reader does not know */
  json_t *warnings;           /* texts: what was read in another way than the asset says */
  char *text;                 /* the reduced JSON, terminated, NUL-free */
  size_t text_length;
} qmat_gltf_document;

#endif
