/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/cli/terminal.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "core/text.h"

int qmat_terminal_width(FILE *stream) {
  const char *columns = getenv("COLUMNS");
  double number;
  struct winsize size;
  if (columns && qmat_parse_number(columns, &number) && number >= 20 && number <= 1000) return (int)number;
  if (ioctl(fileno(stream), TIOCGWINSZ, &size) == 0 && size.ws_col >= 20) return size.ws_col;
  return 80;
}

static bool starts_character(char byte) {
  return ((unsigned char)byte & 0xc0) != 0x80;
}

int qmat_columns_of(const char *text) {
  int columns = 0;
  for (; *text; text++) columns += starts_character(*text);
  return columns;
}

/* Whether `text` starts with a short remark in parentheses, such as a size, which stays with the word before it. */
static bool starts_remark(const char *text) {
  const char *end = *text == '(' ? strchr(text, ')') : NULL;
  return end && end - text < 12;
}

/* The length of the word at the start of `text` in bytes, and its columns. */
static size_t word_length(const char *text, int whole, int *columns) {
  size_t length = 0;
  int depth = 0;
  for (*columns = 0; text[length] && text[length] != '\n'; length++) {
    if (whole && text[length] == '(') depth++;
    if (whole && text[length] == ')') depth--;
    if (text[length] == ' ' && depth <= 0 && !(whole && (text[length + 1] == '%' || starts_remark(text + length + 1))))
      break;
    *columns += starts_character(text[length]);
  }
  return length;
}

/* Prints a part of a text. A terminal would obey control characters. */
static void put_part(FILE *out, const char *text, size_t length) {
  for (size_t i = 0; i < length; i++) {
    const size_t control = qmat_control_length(&text[i]);
    fputc(control > 0 ? '?' : text[i], out);
    if (control > 1) i += control - 1;
  }
}

void qmat_put_shown(FILE *out, const char *text) {
  put_part(out, text, strlen(text));
}

/* The length in bytes of the first `count` characters of a word. */
static size_t length_of(const char *word, size_t length, int count) {
  size_t i = 0;
  while (i < length && (count > 0 || !starts_character(word[i]))) count -= starts_character(word[i++]);
  return i;
}

/* Prints a word without its middle, so that it takes `room` columns. */
static void put_shortened(FILE *out, const char *word, size_t length, int columns, int room) {
  const int head = (room - 3) / 2, tail = room - 3 - head;
  const size_t end = length_of(word, length, head), start = length_of(word, length, columns - tail);
  put_part(out, word, end);
  fputs("...", out);
  put_part(out, word + start, length - start);
}

void qmat_put_wrapped(FILE *out, const char *text, int column, int indent, int width, int whole) {
  const bool shortens = isatty(fileno(out)) != 0;
  int blanks = 0; /* before the next word */
  bool first = true;
  while (*text) {
    int columns;
    const size_t length = word_length(text, whole, &columns);
    if (*text == '\n' || (length > 0 && column + blanks + columns > width && (!first || column > indent))) {
      fprintf(out, "\n%*s", indent, "");
      column = indent;
      blanks = 0;
      first = true;
    }
    if (length > 0) {
      fprintf(out, "%*s", blanks, "");
      if (shortens && columns > width - indent && width - indent > 10)
        put_shortened(out, text, length, columns, width - indent);
      else
        put_part(out, text, length);
      column += columns + blanks;
      first = false;
    }
    text += length + (*text == '\n');
    blanks = (int)strspn(text, " ");
    text += blanks;
    if (first) blanks = 0;
  }
  fputc('\n', out);
}
