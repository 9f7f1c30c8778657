/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usda_token.h"

#include <string.h>

#define FAIL(...) qmat_scan_fail(&p->scanner, __VA_ARGS__)

qmat_status qmat_usda_push(qmat_usda *p, qmat_usda_list *list, const void *item, size_t size) {
  if (qmat_grow(&list->items, &list->capacity, list->count + 1, size) != 0) return qmat_usd_layer_fail_memory(p->layer);
  memcpy((char *)list->items + list->count++ * size, item, size);
  return QMAT_OK;
}

/* Takes one character of text that may span lines. */
static void step(qmat_usda *p) {
  qmat_scanner *scanner = &p->scanner;
  char c = *scanner->at++;
  if (c != '\n' && (c != '\r' || *scanner->at == '\n')) return;
  scanner->line++;
  scanner->line_start = scanner->at;
}

char qmat_usda_peek(qmat_usda *p) {
  qmat_scanner *scanner = &p->scanner;
  while (qmat_scan_find(scanner)) {
    if (scanner->at[0] != '/' || (scanner->at[1] != '/' && scanner->at[1] != '*')) return *scanner->at;
    bool lines = scanner->at[1] == '*';
    if (lines) scanner->at += 2;
    while (scanner->at < scanner->end) {
      if (lines ? scanner->at[0] == '*' && scanner->at[1] == '/' : *scanner->at == '\n' || *scanner->at == '\r') break;
      step(p);
    }
    if (lines && scanner->at < scanner->end) scanner->at += 2;
  }
  return 0;
}

bool qmat_usda_accept(qmat_usda *p, char c) {
  if (qmat_usda_peek(p) != c || c == 0) return false;
  p->scanner.at++;
  return true;
}

/* The next name, number or character, for messages. */
static const char *next_token(qmat_usda *p, char text[32]) {
  size_t length = 0;
  if (qmat_usda_peek(p) == 0 && p->scanner.at >= p->scanner.end) return "the end of the file";
  text[length++] = '\'';
  const char *at = p->scanner.at;
  do {
    text[length++] = *at >= ' ' && *at <= '~' ? *at : '?';
    at++;
  } while (at < p->scanner.end && length < 28 && strchr(" \t\r\n()[]{}=,;<>@\"'", *at) == NULL);
  text[length++] = '\'';
  text[length] = '\0';
  return text;
}

qmat_status qmat_usda_expected(qmat_usda *p, const char *what) {
  char text[32];
  const char *here = next_token(p, text);
  return FAIL("expected %s, found %s", what, here);
}

qmat_status qmat_usda_expect(qmat_usda *p, char c) {
  if (qmat_usda_accept(p, c)) return QMAT_OK;
  const char what[] = {'\'', c, '\'', '\0'};
  return qmat_usda_expected(p, what);
}

bool qmat_usda_is_name_start(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || (c & 0x80);
}

bool qmat_usda_is_name_part(char c) {
  return qmat_usda_is_name_start(c) || (c >= '0' && c <= '9') || c == ':';
}

const char *qmat_usda_peek_name(qmat_usda *p, size_t *length) {
  *length = 0;
  if (!qmat_usda_is_name_start(qmat_usda_peek(p))) return p->scanner.at;
  const char *at = p->scanner.at;
  while (at + *length < p->scanner.end && qmat_usda_is_name_part(at[*length])) ++*length;
  return at;
}

bool qmat_usda_accept_word(qmat_usda *p, const char *word) {
  size_t length;
  const char *name = qmat_usda_peek_name(p, &length);
  if (!qmat_is_word(name, length, word)) return false;
  p->scanner.at += length;
  return true;
}

qmat_status qmat_usda_take_name(qmat_usda *p, const char *what, const char **name) {
  size_t length;
  const char *text = qmat_usda_peek_name(p, &length);
  if (length == 0) return qmat_usda_expected(p, what);
  *name = qmat_usd_copy(p->layer, text, length);
  p->scanner.at += length;
  return *name ? QMAT_OK : qmat_usd_layer_error(p->layer);
}

/* Takes an escape, whose backslash is taken. */
static qmat_status take_escape(qmat_usda *p, char *c) {
  static const char letters[] = "nrtabfv", meanings[] = "\n\r\t\a\b\f\v";
  qmat_scanner *scanner = &p->scanner;
  const char *letter = *scanner->at ? strchr(letters, *scanner->at) : NULL;
  unsigned code = 0;
  if (letter) {
    *c = meanings[letter - letters];
    scanner->at++;
    return QMAT_OK;
  }
  if (*scanner->at == 'x') {
    scanner->at++;
    for (int i = 0; i < 2; i++, scanner->at++) {
      char digit = *scanner->at;
      unsigned value = digit >= '0' && digit <= '9'   ? (unsigned)(digit - '0')
                       : digit >= 'a' && digit <= 'f' ? (unsigned)(digit - 'a' + 10)
                       : digit >= 'A' && digit <= 'F' ? (unsigned)(digit - 'A' + 10)
                                                      : 16;
      if (value == 16) break;
      code = 16 * code + value;
    }
  } else if (*scanner->at >= '0' && *scanner->at <= '7') {
    for (int i = 0; i < 3 && *scanner->at >= '0' && *scanner->at <= '7'; i++)
      code = 8 * code + (unsigned)(*scanner->at++ - '0');
  } else {
    *c = *scanner->at;
    step(p);
    return QMAT_OK;
  }
  *c = (char)(code & 0xFF);
  return *c ? QMAT_OK : FAIL("a text cannot contain a zero byte");
}

bool qmat_usda_at_string(qmat_usda *p) {
  const char c = qmat_usda_peek(p);
  return c == '"' || c == '\'';
}

/* A copy of the collected text in the layer's memory. */
static qmat_status keep_text(qmat_usda *p, const char **text) {
  *text = qmat_usd_copy(p->layer, p->text.items ? p->text.items : "", p->text.count);
  return *text ? QMAT_OK : qmat_usd_layer_error(p->layer);
}

qmat_status qmat_usda_take_string(qmat_usda *p, const char **text) {
  qmat_scanner *scanner = &p->scanner;
  if (!qmat_usda_at_string(p)) return qmat_usda_expected(p, "a text in quotes");
  const char quote = *scanner->at;
  const qmat_scanner start = *scanner;
  bool triple = scanner->at[1] == quote && scanner->at[2] == quote;
  scanner->at += triple ? 3 : 1;
  p->text.count = 0;
  for (;;) {
    if (scanner->at >= scanner->end || (!triple && (*scanner->at == '\n' || *scanner->at == '\r')))
      return qmat_scan_fail(&start, "this text has no end");
    char c = *scanner->at;
    if (c == quote && (!triple || (scanner->at[1] == quote && scanner->at[2] == quote))) break;
    step(p);
    if (c == '\0') return FAIL("a text cannot contain a zero byte");
    qmat_status status = QMAT_OK;
    if (c == '\\' && scanner->at < scanner->end) status = take_escape(p, &c);
    if (status == QMAT_OK) status = qmat_usda_push(p, &p->text, &c, 1);
    if (status != QMAT_OK) return status;
  }
  scanner->at += triple ? 3 : 1;
  return keep_text(p, text);
}

qmat_status qmat_usda_take_path(qmat_usda *p, const char **path) {
  if (qmat_usda_peek(p) != '<') return qmat_usda_expected(p, "a path in <>");
  qmat_scanner *scanner = &p->scanner;
  const char *at = scanner->at + 1;
  size_t length = 0;
  while (at + length < scanner->end && at[length] != '>' && at[length] != '\n' && at[length] != '\0') length++;
  if (at[length] != '>') return FAIL("this path has no end");
  *path = qmat_usd_copy(p->layer, at, length);
  scanner->at = at + length + 1;
  return *path ? QMAT_OK : qmat_usd_layer_error(p->layer);
}

qmat_status qmat_usda_take_asset(qmat_usda *p, const char **asset) {
  if (qmat_usda_peek(p) != '@') return qmat_usda_expected(p, "an asset in @@");
  qmat_scanner *scanner = &p->scanner;
  const qmat_scanner start = *scanner;
  bool triple = scanner->at[1] == '@' && scanner->at[2] == '@';
  scanner->at += triple ? 3 : 1;
  p->text.count = 0;
  for (;;) {
    char c = *scanner->at;
    if (scanner->at >= scanner->end || c == '\0' || c == '\n') return qmat_scan_fail(&start, "this asset has no end");
    if (!triple && c == '@') break;
    if (triple && strncmp(scanner->at, "@@@", 3) == 0) break;
    scanner->at++;
    qmat_status status = QMAT_OK;
    if (triple && c == '\\' && strncmp(scanner->at, "@@@", 3) == 0) {
      scanner->at += 3;
      for (int i = 0; i < 3 && status == QMAT_OK; i++) status = qmat_usda_push(p, &p->text, "@", 1);
    } else {
      status = qmat_usda_push(p, &p->text, &c, 1);
    }
    if (status != QMAT_OK) return status;
  }
  scanner->at += triple ? 3 : 1;
  return keep_text(p, asset);
}
