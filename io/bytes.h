/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_BYTES_H
#define QMAT_IO_BYTES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/value.h"

/* Files as bytes: reading whole files, taking numbers out of bytes and text, and writing finished files.
 * Nothing here depends on the locale. */

/* ---- whole files ---- */

/* A file in memory. A zeroed one is empty and valid. */
typedef struct qmat_bytes {
  size_t size;
  uint8_t *data; /* `size` bytes, followed by 16 zero bytes; NULL before it is read */
} qmat_bytes;

/* Reads the file `path`, which must be a regular, non-empty file of at most 4 GiB. Missing and unreadable files,
 * folders, pipes and devices fail with QMAT_ERROR_IO, empty and too large ones with QMAT_ERROR_FORMAT; the error names
 * the file, and `bytes` is then empty. Free with qmat_bytes_uninit. Cost: one pass over the file. */
qmat_status qmat_bytes_read_file(qmat_context *context, const char *path, qmat_bytes *bytes);

/* Frees the bytes; they are empty and usable again. Works after a failed read. */
void qmat_bytes_uninit(qmat_bytes *bytes);

/* ---- binary numbers ---- */

/* Takes numbers out of `size` bytes one after the other. Past the end every call gives 0 and sets `failed`, which
 * stays set: check it once after a group of reads. Zero it, then set bytes, size and big_endian. */
typedef struct qmat_byte_reader {
  const uint8_t *bytes; /* not owned */
  size_t size, at;
  bool big_endian, failed;
} qmat_byte_reader;

uint8_t qmat_take_u8(qmat_byte_reader *reader);
uint16_t qmat_take_u16(qmat_byte_reader *reader);
uint32_t qmat_take_u32(qmat_byte_reader *reader);
uint64_t qmat_take_u64(qmat_byte_reader *reader);
float qmat_take_f32(qmat_byte_reader *reader);
double qmat_take_f64(qmat_byte_reader *reader);
/* The next `size` bytes, which stay the reader's; NULL when fewer are left. */
const uint8_t *qmat_take_bytes(qmat_byte_reader *reader, size_t size);
/* The bytes that are left. */
size_t qmat_bytes_left(const qmat_byte_reader *reader);

/* ---- numbers in text ---- */

/* The number that starts at `text`, as in the C locale: an optional sign, decimal digits with an optional point, an
 * optional exponent, or "nan", "inf", "infinity" in any case. Correctly rounded. Returns the first character that is
 * not part of it, or NULL when there is no number. `*end` must be readable and a zero byte. */
const char *qmat_scan_double(const char *text, const char *end, double *number);

/* Walks through text as blank-separated tokens and knows the line and column. Blanks are space, tab, line feed,
 * carriage return, vertical tab and form feed; "\n", "\r\n" and a lone "\r" end a line. */
typedef struct qmat_scanner {
  qmat_context *context;
  const char *file;                  /* for errors */
  const char *at, *end, *line_start; /* *end is a readable zero byte, as after qmat_bytes */
  int line;                          /* from 1 */
  char comment;                      /* runs to the end of its line; 0: the text has no comments */
  bool joins_lines;                  /* a backslash at the end of a line joins the next one to it (OBJ) */
} qmat_scanner;

/* Starts at the first byte of `size` bytes of text; skips a UTF-8 byte order mark. `text`, `file` and `context` must
 * outlive the scanner. */
void qmat_scanner_init(qmat_scanner *scanner, qmat_context *context, const char *file, const char *text, size_t size,
                       char comment);

/* Goes to the next token on any line; false at the end of the text. */
bool qmat_scan_find(qmat_scanner *scanner);
/* Goes to the next token on this line; false at the end of the line or the text. */
bool qmat_scan_find_on_line(qmat_scanner *scanner);
/* Goes to the start of the next line; false at the end of the text. */
bool qmat_scan_next_line(qmat_scanner *scanner);

/* The next token, up to the next blank; `*length` is 0 (and the result not NULL) at the end. The first looks across
 * lines, the second stays on this one. The text owns it. */
const char *qmat_scan_token(qmat_scanner *scanner, size_t *length);
const char *qmat_scan_token_on_line(qmat_scanner *scanner, size_t *length);

/* Takes the next token if it is exactly `word`; otherwise stays and returns false. Looks across lines. */
bool qmat_scan_word(qmat_scanner *scanner, const char *word);

/* Reads the next token, across lines, as a number / as a whole number in [least, most]. `what` names it in the error
 * ("the x coordinate of a vertex"), which has the file, line and column. A whole number may be written 3.0.
 * QMAT_ERROR_FORMAT when it is missing, is no number or is out of range. */
qmat_status qmat_scan_number(qmat_scanner *scanner, const char *what, double *number);
qmat_status qmat_scan_integer(qmat_scanner *scanner, const char *what, int64_t least, int64_t most, int64_t *number);

/* QMAT_ERROR_FORMAT at the scanner's place, with file, line and column. */
qmat_status qmat_scan_fail(const qmat_scanner *scanner, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* The bytes that are left: what a count in a header is checked against. */
size_t qmat_scan_left(const qmat_scanner *scanner);

/* ---- writing ---- */

/* Text or bytes that grow. A zeroed writer is empty and valid. The first shortage of memory sets `failed`, after which
 * every call does nothing: check it once at the end. */
typedef struct qmat_writer {
  uint8_t *bytes;
  size_t size, capacity;
  bool failed;
} qmat_writer;

void qmat_put_bytes(qmat_writer *writer, const void *bytes, size_t size);
void qmat_put_text(qmat_writer *writer, const char *text);
/* The shortest text that reads back as the same number; "nan", "inf" and "-inf". */
void qmat_put_number(qmat_writer *writer, double number);
void qmat_put_integer(qmat_writer *writer, int64_t number);
/* Little-endian binary. */
void qmat_put_u8(qmat_writer *writer, uint8_t number);
void qmat_put_u16(qmat_writer *writer, uint16_t number);
void qmat_put_u32(qmat_writer *writer, uint32_t number);
void qmat_put_f32(qmat_writer *writer, float number);
void qmat_put_f64(qmat_writer *writer, double number);
/* Frees the bytes; the writer is empty and usable again. To keep the bytes (qmat_free them), take the pointer and zero
 * the writer instead. */
void qmat_writer_uninit(qmat_writer *writer);

/* Moves what was written into part `part` of an unsealed file value under `name` ("" for the main part); the writer is
 * empty afterwards, whatever the result. file->parts must hold that part, zeroed. */
qmat_status qmat_writer_to_part(qmat_context *context, qmat_writer *writer, qmat_file *file, size_t part,
                                const char *name);

/* Makes a sealed file value of one part from what was written; the writer is empty afterwards, whatever the result.
 * `format` is "ma", "ply", ...; the caller releases `*file`, which is NULL on failure. QMAT_ERROR_MEMORY. */
qmat_status qmat_writer_to_file(qmat_context *context, qmat_writer *writer, const char *format, qmat_file **file);

/* Saves every part: the main part as `path`, the others under their names in the same folder, in folders below it where
 * their names say so; a side part that is there with the same bytes already stays as it is. All are written to
 * temporary files there and flushed to the disk before the first one is renamed; side parts first, the main part last.
 * A failure before the renames leaves nothing behind and what was there untouched. Existing files keep their
 * permissions. QMAT_ERROR_IO names the file. */
qmat_status qmat_file_save(qmat_context *context, const qmat_file *file, const char *path);

#endif
