/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USDA_TOKEN_H
#define QMAT_IO_USD_USDA_TOKEN_H

#include "io/scanner.h"
#include "io/usd/usd_layer.h"

/* The tokens of the text form of USD: names, texts in quotes, paths and assets. Every function skips blanks and
 * comments first. Errors are QMAT_ERROR_FORMAT with file, line and column, or QMAT_ERROR_MEMORY. */

/* A growing array: values are collected in one before their number is known. Free `items` with qmat_free. */
typedef struct qmat_usda_list {
  void *items;
  size_t count, capacity;
} qmat_usda_list;

typedef struct qmat_usda {
  qmat_usd_layer *layer;
  qmat_scanner scanner;
  int depth;              /* of dictionaries */
  qmat_usda_list text;    /* of char: the text that is being read */
  qmat_usda_list numbers; /* of double or int64_t: the components that are being read */
} qmat_usda;

/* Appends an item of `size` bytes. */
qmat_status qmat_usda_push(qmat_usda *p, qmat_usda_list *list, const void *item, size_t size);

/* The next character; 0 at the end of the text. */
char qmat_usda_peek(qmat_usda *p);
/* Takes the next character if it is `c`, which is not 0. */
bool qmat_usda_accept(qmat_usda *p, char c);
/* The same, and an error otherwise. */
qmat_status qmat_usda_expect(qmat_usda *p, char c);
/* The error "expected WHAT, found ...". */
qmat_status qmat_usda_expected(qmat_usda *p, const char *what);

bool qmat_usda_is_name_start(char c);
/* Letters, digits, underscores, bytes of UTF-8, and colons. */
bool qmat_usda_is_name_part(char c);

/* The name that starts here, which may have colons; `*length` is 0 when there is none. Nothing is taken. */
const char *qmat_usda_peek_name(qmat_usda *p, size_t *length);
/* Takes the name here if it is `word`. */
bool qmat_usda_accept_word(qmat_usda *p, const char *word);
/* Takes a name; `what` is for the error. */
qmat_status qmat_usda_take_name(qmat_usda *p, const char *what, const char **name);

/* Whether a text in quotes starts here. */
bool qmat_usda_at_string(qmat_usda *p);
/* A text in single or double quotes, or in three of them, which may span lines. */
qmat_status qmat_usda_take_string(qmat_usda *p, const char **text);
/* <path> */
qmat_status qmat_usda_take_path(qmat_usda *p, const char **path);
/* @asset@, or @@@asset@@@, in which \@@@ stands for @@@. */
qmat_status qmat_usda_take_asset(qmat_usda *p, const char **asset);

#endif
