/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_BYTES_H
#define QMAT_IO_BYTES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/value.h"

/* Files as bytes: reading whole files, decoding binary numbers, and building the bytes of a new file. io/scanner.h
 * reads text, io/save.h writes finished files to disk. Nothing here depends on the locale. */

/* ---- whole files ---- */

/* A file in memory. A zeroed one is empty and valid. */
typedef struct qmat_bytes {
  size_t size;
  uint8_t *data; /* `size` bytes, followed by 16 zero bytes; NULL before a file is read */
} qmat_bytes;

/* Reads the file `path`, which must be a regular, non-empty file of at most 4 GiB. Missing and unreadable files,
 * folders, pipes and devices fail with QMAT_ERROR_IO, empty and too large ones with QMAT_ERROR_FORMAT; the error names
 * the file, and `bytes` is then empty. Free with qmat_bytes_uninit. Cost: one pass over the file. */
qmat_status qmat_bytes_read_file(qmat_context *context, const char *path, qmat_bytes *bytes);

/* Frees the bytes; they are empty and usable again. Works after a failed read. */
void qmat_bytes_uninit(qmat_bytes *bytes);

/* Records an error about the file `path` as a whole, without a line, and returns `status`. */
qmat_status qmat_fail_file(qmat_context *context, qmat_status status, const char *path, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/* Records QMAT_ERROR_IO "WHAT: REASON" about the file `path`, where REASON is the C library's untranslated text of the
 * error `number` (an errno). */
qmat_status qmat_fail_io(qmat_context *context, const char *path, const char *what, int number);

/* ---- binary numbers ---- */

/* Decodes numbers from `size` bytes in order. Past the end every call returns 0 and sets `failed`, which stays set:
 * check it once after a group of reads. Zero it, then set bytes, size and big_endian. */
typedef struct qmat_byte_reader {
  const uint8_t *bytes; /* not owned */
  size_t size, at;      /* at <= size */
  bool big_endian, failed;
} qmat_byte_reader;

uint8_t qmat_take_u8(qmat_byte_reader *reader);
uint16_t qmat_take_u16(qmat_byte_reader *reader);
uint32_t qmat_take_u32(qmat_byte_reader *reader);
uint64_t qmat_take_u64(qmat_byte_reader *reader);
float qmat_take_f32(qmat_byte_reader *reader);
double qmat_take_f64(qmat_byte_reader *reader);
/* A pointer to the next `size` bytes, which the reader does not copy; NULL when fewer remain. */
const uint8_t *qmat_take_bytes(qmat_byte_reader *reader, size_t size);
/* The number of bytes that remain. */
size_t qmat_bytes_left(const qmat_byte_reader *reader);

/* ---- building a file ---- */

/* Growing text or bytes. A zeroed writer is empty and valid. The first shortage of memory sets `failed`, after which
 * every call does nothing: check it once at the end. */
typedef struct qmat_writer {
  uint8_t *bytes;
  size_t size, capacity;
  bool failed;
} qmat_writer;

void qmat_put_bytes(qmat_writer *writer, const void *bytes, size_t size);
void qmat_put_text(qmat_writer *writer, const char *text);
/* Four blanks for each level. */
void qmat_put_indent(qmat_writer *writer, size_t depth);
/* The shortest text that reads back as the same number; "nan", "inf" and "-inf". */
void qmat_put_number(qmat_writer *writer, double number);
void qmat_put_integer(qmat_writer *writer, int64_t number);
/* Little-endian binary. */
void qmat_put_u8(qmat_writer *writer, uint8_t number);
void qmat_put_u16(qmat_writer *writer, uint16_t number);
void qmat_put_u32(qmat_writer *writer, uint32_t number);
void qmat_put_u64(qmat_writer *writer, uint64_t number);
void qmat_put_f32(qmat_writer *writer, float number);
void qmat_put_f64(qmat_writer *writer, double number);
/* Frees the bytes; the writer is empty and usable again. To keep the bytes (qmat_free them), take the pointer and zero
 * the writer instead. */
void qmat_writer_uninit(qmat_writer *writer);

/* Moves the written bytes into part `part` of an unsealed file value under `name` ("" for the main part); the writer is
 * empty afterwards, whatever the result. file->parts must hold that part, zeroed. QMAT_ERROR_MEMORY. */
qmat_status qmat_writer_to_part(qmat_context *context, qmat_writer *writer, qmat_file *file, size_t part,
                                const char *name);

/* Makes a sealed file value of one part from the written bytes; the writer is empty afterwards, whatever the result.
 * `format` is "ma", "ply", ...; the caller releases `*file`, which is NULL on failure. QMAT_ERROR_MEMORY. */
qmat_status qmat_writer_to_file(qmat_context *context, qmat_writer *writer, const char *format, qmat_file **file);

#endif
