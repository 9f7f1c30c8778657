/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/scanner.h"

#include <limits.h>
#include <locale.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

static bool is_blank(char c) {
  return c == ' ' || (c >= '\t' && c <= '\r');
}

/* The length of `word` if `text` starts with it in any case, else 0. */
static size_t starts_with(const char *text, const char *end, const char *word) {
  size_t length = strlen(word);
  if ((size_t)(end - text) < length) return 0;
  for (size_t i = 0; i < length; i++) {
    if ((text[i] | 0x20) != word[i]) return 0;
  }
  return length;
}

const char *qmat_scan_double(const char *text, const char *end, double *number) {
  static const double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                  1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
  const char *at = text;
  bool negative = at < end && *at == '-';
  if (at < end && (*at == '-' || *at == '+')) at++;

  uint64_t mantissa = 0;
  int exponent = 0;  /* the power of ten of the mantissa's last digit */
  bool exact = true; /* the mantissa holds every digit */
  const char *first = at;
  for (; at < end && is_digit(*at); at++) {
    if (mantissa < (uint64_t)1 << 59) {
      mantissa = mantissa * 10 + (uint64_t)(*at - '0');
    } else {
      exact = false;
    }
  }
  size_t digits = (size_t)(at - first);
  if (at < end && *at == '.') {
    const char *point = at++;
    for (; at < end && is_digit(*at); at++) {
      if (mantissa < (uint64_t)1 << 59) {
        mantissa = mantissa * 10 + (uint64_t)(*at - '0');
        if (exponent > -1000)
          exponent--;
        else
          exact = false;
      } else {
        exact = false;
      }
    }
    digits += (size_t)(at - point - 1);
  }
  if (digits == 0) {
    at = first;
    size_t word = starts_with(at, end, "infinity");
    if (!word) word = starts_with(at, end, "inf");
    if (word) {
      *number = negative ? -(double)INFINITY : (double)INFINITY;
      return at + word;
    }
    word = starts_with(at, end, "nan");
    if (!word) return NULL;
    *number = (double)NAN;
    return at + word;
  }
  if (at < end && (*at == 'e' || *at == 'E')) {
    const char *power = at + 1;
    bool minus = power < end && *power == '-';
    if (power < end && (*power == '-' || *power == '+')) power++;
    if (power < end && is_digit(*power)) {
      int value = 0;
      for (; power < end && is_digit(*power); power++) {
        if (value < 100000) value = value * 10 + (*power - '0');
      }
      exponent += minus ? -value : value;
      at = power;
    }
  }

  /* Mantissas up to 2^53 and powers up to 10^22 are exact doubles: one operation rounds once (Clinger 1990). */
  if (exact && mantissa <= (uint64_t)1 << 53 && exponent >= -22 && exponent <= 22) {
    double value = (double)mantissa;
    value = exponent < 0 ? value / powers[-exponent] : value * powers[exponent];
    *number = negative ? -value : value;
    return at;
  }
  /* The C library has the C locale as a constant: newlocale allocates nothing. */
  locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
  if (plain == (locale_t)0) return NULL;
  *number = strtod_l(text, NULL, plain);
  freelocale(plain);
  return at;
}

size_t qmat_byte_order_mark(const void *bytes, size_t size) {
  static const char mark[] = "\xEF\xBB\xBF";
  const size_t length = sizeof mark - 1;
  return size >= length && memcmp(bytes, mark, length) == 0 ? length : 0;
}

void qmat_scanner_init(qmat_scanner *scanner, qmat_context *context, const char *file, const char *text, size_t size,
                       char comment) {
  *scanner = (qmat_scanner){.context = context,
                            .file = file,
                            .at = text + qmat_byte_order_mark(text, size),
                            .end = text + size,
                            .line_start = text,
                            .line = 1,
                            .comment = comment};
}

/* The length of the line end at `at`: 0, 1 or 2. */
static size_t line_end(const qmat_scanner *scanner, const char *at) {
  if (at >= scanner->end) return 0;
  if (*at == '\n') return 1;
  if (*at != '\r') return 0;
  return at + 1 < scanner->end && at[1] == '\n' ? 2 : 1;
}

static void begin_line(qmat_scanner *scanner, const char *at) {
  scanner->at = at;
  scanner->line_start = at;
  if (scanner->line < INT_MAX) scanner->line++;
}

/* The length of a backslash and the line end it escapes, or 0. */
static size_t line_join(const qmat_scanner *scanner, const char *at) {
  if (!scanner->joins_lines || at >= scanner->end || *at != '\\') return 0;
  size_t length = line_end(scanner, at + 1);
  return length > 0 ? length + 1 : 0;
}

static bool ends_token(const qmat_scanner *scanner, const char *at) {
  if (at >= scanner->end || is_blank(*at)) return true;
  if (scanner->comment && *at == scanner->comment) return true;
  return line_join(scanner, at) > 0;
}

static bool find(qmat_scanner *scanner, bool across_lines) {
  while (scanner->at < scanner->end) {
    char c = *scanner->at;
    if (c == '\n' || c == '\r') {
      if (!across_lines) return false;
      begin_line(scanner, scanner->at + line_end(scanner, scanner->at));
    } else if (is_blank(c)) {
      scanner->at++;
    } else if (scanner->comment && c == scanner->comment) {
      while (scanner->at < scanner->end && *scanner->at != '\n' && *scanner->at != '\r') scanner->at++;
    } else {
      size_t join = line_join(scanner, scanner->at);
      if (join == 0) return true;
      begin_line(scanner, scanner->at + join);
    }
  }
  return false;
}

bool qmat_scan_find(qmat_scanner *scanner) {
  return find(scanner, true);
}

bool qmat_scan_find_on_line(qmat_scanner *scanner) {
  return find(scanner, false);
}

bool qmat_scan_next_line(qmat_scanner *scanner) {
  while (scanner->at < scanner->end) {
    size_t length = line_end(scanner, scanner->at);
    if (length > 0) {
      begin_line(scanner, scanner->at + length);
      return scanner->at < scanner->end;
    }
    /* A backslash at the end of a comment does not continue it. */
    if (scanner->comment && *scanner->at == scanner->comment) {
      find(scanner, false);
      continue;
    }
    size_t join = line_join(scanner, scanner->at);
    if (join > 0) {
      begin_line(scanner, scanner->at + join);
    } else {
      scanner->at++;
    }
  }
  return false;
}

static const char *take_token(qmat_scanner *scanner, size_t *length) {
  const char *token = scanner->at;
  while (!ends_token(scanner, scanner->at)) scanner->at++;
  *length = (size_t)(scanner->at - token);
  return token;
}

const char *qmat_scan_token(qmat_scanner *scanner, size_t *length) {
  *length = 0;
  return qmat_scan_find(scanner) ? take_token(scanner, length) : scanner->at;
}

const char *qmat_scan_token_on_line(qmat_scanner *scanner, size_t *length) {
  *length = 0;
  return qmat_scan_find_on_line(scanner) ? take_token(scanner, length) : scanner->at;
}

bool qmat_is_word(const char *token, size_t length, const char *word) {
  return length == strlen(word) && memcmp(token, word, length) == 0;
}

bool qmat_scan_word(qmat_scanner *scanner, const char *word) {
  size_t length = strlen(word);
  if (!qmat_scan_find(scanner) || qmat_scan_left(scanner) < length) return false;
  if (memcmp(scanner->at, word, length) != 0 || !ends_token(scanner, scanner->at + length)) return false;
  scanner->at += length;
  return true;
}

/* The next token, shortened and printable. */
static void quote_token(const qmat_scanner *scanner, char text[32]) {
  size_t length = 0;
  for (const char *at = scanner->at; !ends_token(scanner, at); at++) {
    if (length == 28) {
      memcpy(text + 25, "...", 3);
      break;
    }
    text[length++] = *at >= ' ' && *at <= '~' ? *at : '?';
  }
  text[length] = '\0';
}

qmat_status qmat_scan_expected(const qmat_scanner *scanner, const char *what) {
  char text[32];
  if (scanner->at >= scanner->end) return qmat_scan_fail(scanner, "expected %s, found the end of the file", what);
  quote_token(scanner, text);
  if (!*text) return qmat_scan_fail(scanner, "expected %s, found the end of the line", what);
  return qmat_scan_fail(scanner, "expected %s, found '%s'", what, text);
}

static qmat_status fail_token(const qmat_scanner *scanner, const char *what, const char *complaint) {
  char text[32];
  quote_token(scanner, text);
  return qmat_scan_fail(scanner, "%s is '%s', %s", what, text, complaint);
}

qmat_status qmat_scan_number(qmat_scanner *scanner, const char *what, double *number) {
  if (!qmat_scan_find(scanner)) return qmat_scan_expected(scanner, what);
  const char *after = qmat_scan_double(scanner->at, scanner->end, number);
  if (!after || !ends_token(scanner, after)) return fail_token(scanner, what, "not a number");
  scanner->at = after;
  return QMAT_OK;
}

qmat_status qmat_scan_integer(qmat_scanner *scanner, const char *what, int64_t least, int64_t most, int64_t *number) {
  if (!qmat_scan_find(scanner)) return qmat_scan_expected(scanner, what);
  const char *at = scanner->at;
  bool negative = *at == '-';
  if (*at == '-' || *at == '+') at++;
  const char *first = at;
  int64_t value = 0;
  for (; is_digit(*at) && at - first < 18; at++) value = value * 10 + (*at - '0');
  if (at > first && ends_token(scanner, at)) {
    if (negative) value = -value;
  } else {
    double real;
    at = qmat_scan_double(scanner->at, scanner->end, &real);
    if (!at || !ends_token(scanner, at) || !(fabs(real) <= 9.0e15) || real != floor(real))
      return fail_token(scanner, what, "not a whole number");
    value = (int64_t)real;
  }
  if (value < least || value > most) {
    char complaint[96];
    if (least > most) {
      snprintf(complaint, sizeof complaint, "but none exist");
    } else {
      snprintf(complaint, sizeof complaint, "outside %lld to %lld", (long long)least, (long long)most);
    }
    return fail_token(scanner, what, complaint);
  }
  *number = value;
  scanner->at = at;
  return QMAT_OK;
}

qmat_status qmat_scan_vertex(qmat_scanner *scanner, bool on_line, double point[3]) {
  static const char *const names[3] = {"the x coordinate of a vertex", "the y coordinate of a vertex",
                                       "the z coordinate of a vertex"};
  for (int k = 0; k < 3; k++) {
    if (on_line && !qmat_scan_find_on_line(scanner)) return qmat_scan_expected(scanner, names[k]);
    qmat_status status = qmat_scan_number(scanner, names[k], &point[k]);
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

qmat_status qmat_scan_count(qmat_scanner *scanner, const char *what, size_t bytes_each, size_t *count) {
  int64_t number = 0;
  qmat_status status = qmat_scan_integer(scanner, what, 0, UINT32_MAX - 1, &number);
  if (status != QMAT_OK) return status;
  if ((uint64_t)number > (qmat_scan_left(scanner) + 1) / bytes_each)
    return qmat_scan_fail(scanner, "%s is %lld, more than the file can hold", what, (long long)number);
  *count = (size_t)number;
  return QMAT_OK;
}

qmat_status qmat_scan_fail(const qmat_scanner *scanner, const char *format, ...) {
  char message[512];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(message, sizeof message, format, arguments);
  va_end(arguments);
  qmat_fail(scanner->context, QMAT_ERROR_FORMAT, "%s", message);
  ptrdiff_t column = scanner->at - scanner->line_start + 1;
  return qmat_fail_at(scanner->context, scanner->file, scanner->line, column < INT_MAX ? (int)column : INT_MAX);
}

size_t qmat_scan_left(const qmat_scanner *scanner) {
  return (size_t)(scanner->end - scanner->at);
}
