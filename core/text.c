/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/text.h"

#include <float.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/arena.h"

char *qmat_strdup(const char *text) {
  const size_t size = strlen(text) + 1;
  char *copy = qmat_alloc(size, 1);
  if (copy) memcpy(copy, text, size);
  return copy;
}

size_t qmat_utf8_length(const char *text) {
  const unsigned char *bytes = (const unsigned char *)text, first = bytes[0];
  const size_t length = first < 0x80                    ? 1
                        : first >= 0xC2 && first < 0xE0 ? 2
                        : first >= 0xE0 && first < 0xF0 ? 3
                        : first >= 0xF0 && first < 0xF5 ? 4
                                                        : 0;
  for (size_t i = 1; i < length; i++) {
    if ((bytes[i] & 0xC0) != 0x80) return 0;
  }
  /* Overlong forms, surrogates, and code points above U+10FFFF. */
  if ((first == 0xE0 && bytes[1] < 0xA0) || (first == 0xED && bytes[1] > 0x9F) || (first == 0xF0 && bytes[1] < 0x90) ||
      (first == 0xF4 && bytes[1] > 0x8F)) {
    return 0;
  }
  return length;
}

bool qmat_is_utf8(const char *text) {
  while (*text != '\0') {
    const size_t length = qmat_utf8_length(text);
    if (length == 0) return false;
    text += length;
  }
  return true;
}

void qmat_repair_utf8(char *text) {
  for (; !qmat_is_utf8(text); text++)
    if ((unsigned char)*text >= 0x80) *text = '?';
}

bool qmat_is_part_name(const char *name) {
  if (strchr(name, '\\') != NULL || strlen(name) > 255) return false;
  for (const char *step = name;; step++) {
    const size_t length = strcspn(step, "/");
    if (length == 0 || (length == 1 && step[0] == '.') || (length == 2 && step[0] == '.' && step[1] == '.'))
      return false;
    step += length;
    if (*step == '\0') return true;
  }
}

static bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

static const char *skip_digits(const char *text) {
  while (is_digit(*text)) text++;
  return text;
}

bool qmat_parse_number(const char *text, double *number) {
  /* This grammar rejects what strtod accepts beyond it: blanks, hexadecimal digits, infinities and NaN. */
  const char *digits = text + (*text == '-' || *text == '+');
  const char *end = skip_digits(digits);
  size_t digit_count = (size_t)(end - digits);
  if (*end == '.') {
    const char *fraction = end + 1;
    end = skip_digits(fraction);
    digit_count += (size_t)(end - fraction);
  }
  if (digit_count == 0) return false;
  const char *mantissa_end = end;
  long exponent = 0;
  if (*end == 'e' || *end == 'E') {
    const char *exponent_digits = end + 1 + (end[1] == '-' || end[1] == '+');
    end = skip_digits(exponent_digits);
    if (end == exponent_digits) return false;
    exponent = strtol(mantissa_end + 1, NULL, 10); /* saturates */
  }

  char shifted[160];
  if (*end == '%') {
    /* Lowering the exponent by two rounds once; dividing by 100 would round twice. */
    const size_t length = (size_t)(mantissa_end - text);
    if (end[1] != '\0' || length + 32 > sizeof shifted) return false;
    if (exponent < -100000) exponent = -100000;
    if (exponent > 100000) exponent = 100000;
    memcpy(shifted, text, length);
    snprintf(shifted + length, sizeof shifted - length, "e%ld", exponent - 2);
    text = shifted;
  } else if (*end != '\0') {
    return false;
  }

  const locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
  if (plain == (locale_t)0) return false;
  const double value = strtod_l(text, NULL, plain);
  freelocale(plain);
  if (!isfinite(value)) return false;
  *number = value;
  return true;
}

bool qmat_parse_length(const char *text, double *meters) {
  /* Dividing by a power of ten rounds once: 5mm and 0.5cm are the same number. */
  static const struct {
    const char *name;
    double factor, divisor;
  } units[] = {{"mm", 1, 1000}, {"cm", 1, 100}, {"in", 0.0254, 1}, {"ft", 0.3048, 1}, {"m", 1, 1}};
  const size_t length = strlen(text);
  for (size_t i = 0; i < sizeof units / sizeof *units; i++) {
    const size_t unit = strlen(units[i].name), digits = length - unit;
    char number_text[64];
    double number;
    if (length <= unit || digits >= sizeof number_text || strcmp(text + digits, units[i].name) != 0) continue;
    memcpy(number_text, text, digits);
    number_text[digits] = '\0';
    if (strchr(number_text, '%') || !qmat_parse_number(number_text, &number)) return false;
    *meters = number * units[i].factor / units[i].divisor;
    return true;
  }
  return false;
}

void qmat_format_number(double number, char *text, size_t size) {
  if (size == 0) return;
  text[0] = '\0';
  const locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
  if (plain == (locale_t)0) return;
  const locale_t before = uselocale(plain);
  char shortest[40];
  /* "%.15g" drops trailing zeros, so it is the shortest text wherever 15 digits are enough. Subnormal numbers have
   * fewer significant digits and are tried from one digit up. */
  const int first = number != 0 && fabs(number) < DBL_MIN ? 1 : 15;
  for (int precision = first; precision <= 17; precision++) {
    snprintf(shortest, sizeof shortest, "%.*g", precision, number);
    if (strtod(shortest, NULL) == number) break;
  }
  uselocale(before);
  freelocale(plain);
  snprintf(text, size, "%s", shortest);
}

void qmat_format_count(uint64_t count, char *text) {
  char digits[24];
  int length = snprintf(digits, sizeof digits, "%llu", (unsigned long long)count);
  char *out = text;
  for (int i = 0; i < length; i++) {
    if (i > 0 && (length - i) % 3 == 0) *out++ = ',';
    *out++ = digits[i];
  }
  *out = 0;
}

void qmat_format_bytes(uint64_t bytes, char *text) {
  static const char *const units[] = {"kB", "MB", "GB", "TB"};
  if (bytes < 1000) {
    snprintf(text, 32, "%u byte%s", (unsigned)bytes, bytes == 1 ? "" : "s");
    return;
  }
  double size = (double)bytes / 1000;
  int unit = 0;
  while (size >= 999.5 && unit < 3) {
    size /= 1000;
    unit++;
  }
  char number[40];
  qmat_format_number(size < 9.95 ? round(size * 10) / 10 : round(size), number, sizeof number);
  snprintf(text, 32, "%.20s %s", number, units[unit]);
}

size_t qmat_control_length(const char *text) {
  const unsigned char first = (unsigned char)text[0], second = first ? (unsigned char)text[1] : 0;
  if (first == 0xc2 && second >= 0x80 && second < 0xa0) return 2;
  return first && (first < 0x20 || first == 0x7f);
}

/* The least percentage, and number of millimetres, that bounds are written as: what is below is an effect of rounding.
 */
static const double least_written = 0.001;

/* The least number of two digits that is not below `value` and `least`; 0 where `value` is not above 0. */
static double round_up(double value, double least) {
  if (!(value > 0)) return 0;
  value = fmax(value, least);
  const double digits = floor(1 - floor(log10(value))), scale = pow(10, digits > 0 ? digits : 0);
  /* The factor below 1 absorbs rounding errors: 0.98 must not be rounded up to 0.99. */
  return isfinite(scale) ? ceil(value * scale * (1 - 1e-12)) / scale : value;
}

void qmat_format_bound(double fraction, char *text) {
  char number[40];
  qmat_format_number(round_up(fraction * 100, least_written), number, sizeof number);
  snprintf(text, 48, "%s %%", number);
}

void qmat_format_length(double meters, double size, char *text) {
  static const struct {
    const char *unit;
    double scale, below;
  } units[] = {{"mm", 1000, 0.1}, {"cm", 100, 1}, {"m", 1, 0}};
  size_t i = 0;
  const double least = fmin(least_written, size * 1000 * least_written / 100);
  double value = round_up(meters * units[i].scale, least);
  while (i < 2 && value >= units[i].below * units[i].scale) value = round_up(meters * units[++i].scale, least);
  char number[40];
  qmat_format_number(value, number, sizeof number);
  snprintf(text, 48, "%s %s", number, units[i].unit);
}

static size_t smaller(size_t a, size_t b) {
  return a < b ? a : b;
}

enum { LONGEST_NAME = 63 };

/* The optimal string alignment distance: insertions, deletions, substitutions and swaps of neighbours. */
static size_t edit_distance(const char *a, size_t a_length, const char *b, size_t b_length) {
  size_t rows[3][LONGEST_NAME + 1];
  size_t *before = rows[0], *last = rows[1], *row = rows[2];
  for (size_t j = 0; j <= b_length; j++) last[j] = j;
  for (size_t i = 1; i <= a_length; i++) {
    row[0] = i;
    for (size_t j = 1; j <= b_length; j++) {
      row[j] = smaller(smaller(last[j], row[j - 1]) + 1, last[j - 1] + (a[i - 1] != b[j - 1]));
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) row[j] = smaller(row[j], before[j - 2] + 1);
    }
    size_t *oldest = before;
    before = last;
    last = row;
    row = oldest;
  }
  return last[b_length];
}

const char *qmat_nearest_name(const char *text, const char *const *names, size_t count) {
  const size_t length = strnlen(text, LONGEST_NAME + 1);
  if (length > LONGEST_NAME) return NULL;
  const char *nearest = NULL;
  size_t nearest_distance =
      smaller(1 + length / 3 + 1, length); /* no name is near a text that shares no letter with it */
  for (size_t i = 0; i < count; i++) {
    const size_t name_length = strnlen(names[i], LONGEST_NAME + 1);
    if (name_length > LONGEST_NAME) continue;
    const size_t distance = edit_distance(text, length, names[i], name_length);
    if (distance < nearest_distance) {
      nearest = names[i];
      nearest_distance = distance;
    }
  }
  return nearest;
}
