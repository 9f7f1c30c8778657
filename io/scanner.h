/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_SCANNER_H
#define QMAT_IO_SCANNER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/context.h"

/* Text files as tokens and numbers, with the line and column of every error. Nothing here depends on the locale. */

/* Parses the number at the start of `text` as the C locale writes it: an optional sign, decimal digits with an optional
 * point, an optional exponent, or "nan", "inf", "infinity" in any case. Correctly rounded. Returns the first character
 * after it, or NULL when `text` starts with no number. `*end` must be readable and a zero byte. */
const char *qmat_scan_double(const char *text, const char *end, double *number);

/* The length of the UTF-8 byte order mark that `size` bytes start with: 3, or 0 for none. */
size_t qmat_byte_order_mark(const void *bytes, size_t size);

/* Walks through text as blank-separated tokens and counts lines. Blanks are space, tab, line feed, carriage return,
 * vertical tab and form feed; "\n", "\r\n" and a lone "\r" end a line. */
typedef struct qmat_scanner {
  qmat_context *context;
  const char *file;                  /* for errors */
  const char *at, *end, *line_start; /* *end is a readable zero byte, as after qmat_bytes */
  int line;                          /* from 1 */
  char comment;                      /* starts a comment up to the end of its line; 0: the text has no comments */
  bool joins_lines;                  /* a backslash at the end of a line joins the next one to it (OBJ) */
} qmat_scanner;

/* Starts at the first byte of `size` bytes of text; skips a UTF-8 byte order mark. `text`, `file` and `context` must
 * outlive the scanner. */
void qmat_scanner_init(qmat_scanner *scanner, qmat_context *context, const char *file, const char *text, size_t size,
                       char comment);

/* Moves to the next token on any line; false at the end of the text. */
bool qmat_scan_find(qmat_scanner *scanner);
/* Moves to the next token on this line; false at the end of the line or the text. */
bool qmat_scan_find_on_line(qmat_scanner *scanner);
/* Moves to the start of the next line; false at the end of the text. */
bool qmat_scan_next_line(qmat_scanner *scanner);

/* The next token, up to the next blank, on any line or on this line only. `*length` is 0 (and the result not NULL) when
 * there is none. The text owns the token. */
const char *qmat_scan_token(qmat_scanner *scanner, size_t *length);
const char *qmat_scan_token_on_line(qmat_scanner *scanner, size_t *length);

/* Whether the `length` bytes at `token` are exactly `word`. */
bool qmat_is_word(const char *token, size_t length, const char *word);

/* Takes the next token, on any line, if it is exactly `word`; otherwise takes nothing and returns false. */
bool qmat_scan_word(qmat_scanner *scanner, const char *word);

/* Reads the next token, on any line, as a number / as a whole number in [least, most]. `what` names it in the error
 * ("the x coordinate of a vertex"), which has the file, line and column. A whole number may be written 3.0.
 * QMAT_ERROR_FORMAT when it is missing, not a number or out of range. */
qmat_status qmat_scan_number(qmat_scanner *scanner, const char *what, double *number);
qmat_status qmat_scan_integer(qmat_scanner *scanner, const char *what, int64_t least, int64_t most, int64_t *number);

/* Reads the next token, on any line, as a count below 2^32 - 1 of items that take at least `bytes_each` bytes of the
 * rest of the file, where the last may lack its line end. QMAT_ERROR_FORMAT also when the rest is too short for them,
 * so that memory can be taken for the count. */
qmat_status qmat_scan_count(qmat_scanner *scanner, const char *what, size_t bytes_each, size_t *count);

/* Reads the x, y and z of a vertex from the next three tokens, on any line or on this line only. Errors as above. */
qmat_status qmat_scan_vertex(qmat_scanner *scanner, bool on_line, double point[3]);

/* QMAT_ERROR_FORMAT "expected WHAT, found TOKEN" at the scanner's place, where TOKEN may be the end of the line or of
 * the file. */
qmat_status qmat_scan_expected(const qmat_scanner *scanner, const char *what);
/* QMAT_ERROR_FORMAT at the scanner's place, with file, line and column. */
qmat_status qmat_scan_fail(const qmat_scanner *scanner, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* The number of bytes that remain: the bound for any count in a header. */
size_t qmat_scan_left(const qmat_scanner *scanner);

#endif
