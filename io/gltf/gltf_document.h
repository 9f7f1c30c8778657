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
  uint8_t *owned;  /* of a data URI; else NULL */
  qmat_bytes file; /* of an external file */
} qmat_gltf_buffer;

/* A glTF asset that has been checked, reduced to its geometry. A zeroed one is empty and valid. */
typedef struct qmat_gltf_document {
  size_t buffer_count;
  qmat_gltf_buffer *buffers;
  size_t data_size;           /* of all buffers */
  json_t *extensions_ignored; /* names that the asset uses, but does not require, and that nothing here knows */
  char *text;                 /* the reduced JSON, terminated, NUL-free */
  size_t text_length;
} qmat_gltf_document;

#endif
