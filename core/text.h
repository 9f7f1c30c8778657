/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_TEXT_H
#define QMAT_CORE_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Text: copies, UTF-8, numbers, and suggestions for misspelt names. Nothing here depends on the locale. Every function
 * is safe from any thread. */

/* A copy of `text` that a value can own; the caller frees it with qmat_free. NULL when memory is short. */
char *qmat_strdup(const char *text);

/* The length in bytes of the UTF-8 character at the start of `text`: 1 to 4, and 1 for the terminating zero. 0 when
 * `text` does not start with a valid character. */
size_t qmat_utf8_length(const char *text);
/* Whether all of `text` is valid UTF-8. */
bool qmat_is_utf8(const char *text);

/* Makes `text` valid UTF-8: replaces its bytes above ASCII by '?', from the start, until the rest is valid. */
void qmat_repair_utf8(char *text);

/* Whether `name` is a relative path to a file below its folder: at most 255 bytes, no backslash, no "..", no "." and no
 * empty component. */
bool qmat_is_part_name(const char *name);

/* The length in bytes of the control character of UTF-8 at the start of a text, which a terminal would obey; 0: it
 * starts with none. */
size_t qmat_control_length(const char *text);

/* Parses all of `text` as a finite decimal number. A trailing '%' divides by 100: "0.1%" is the double nearest to
 * 0.001. Blanks, hexadecimal digits, infinities and NaN are rejected. On false, `*number` is unchanged. */
bool qmat_parse_number(const char *text, double *number);

/* Parses a decimal number with a unit of length: mm, cm, m, in or ft. `*meters` is unchanged on false. */
bool qmat_parse_length(const char *text, double *meters);

/* Writes the shortest decimal text that parses back to the same double. 32 bytes are enough; the text is always
 * terminated when size > 0. */
void qmat_format_number(double number, char *text, size_t size);

/* 1234567 as "1,234,567"; `text` holds at least 32 bytes. */
void qmat_format_count(uint64_t count, char *text);
/* 1234567 as "1.2 MB"; `text` holds at least 32 bytes. */
void qmat_format_bytes(uint64_t bytes, char *text);
/* An upper bound as a percentage with two digits, rounded up, 0.001 % at least unless it is 0: 0.00977 as "0.98 %".
 * `text` holds at least 48 bytes. */
void qmat_format_bound(double fraction, char *text);

/* A length as "4.9 mm", "12 cm" or "3.1 m", with two digits, rounded up. Unless it is 0 it is 0.001 mm at least, or
 * 0.001 % of the model's size (metres; INFINITY: not known) where that is less. `text` holds at least 48 bytes. */
void qmat_format_length(double meters, double size, char *text);

/* The name nearest to `text` by edit distance among `count` names, or NULL when none is near. */
const char *qmat_nearest_name(const char *text, const char *const *names, size_t count);

#endif
