/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CLI_TERMINAL_H
#define QMAT_GRAPHS_CLI_TERMINAL_H

#include <stdio.h>

/* Text for people, as wide as their terminal. */

/* The columns of the terminal behind `stream`: $COLUMNS, else what the terminal says, else 80. */
int qmat_terminal_width(FILE *stream);

/* The columns of UTF-8 text, one per character. */
int qmat_columns_of(const char *text);

/* Prints text from a file, with question marks for control characters. */
void qmat_put_shown(FILE *out, const char *text);

/* Prints `text` wrapped at `width` columns. The first line starts at column `column`; the others are indented by
 * `indent`. When `whole` is set, parentheses stay whole, a short one stays with the word before it, and a number keeps
 * its per cent sign. A longer word has a line of its own; where `out` is a terminal, its middle is left out.
 * Control characters but the line feed become question marks. */
void qmat_put_wrapped(FILE *out, const char *text, int column, int indent, int width, int whole);

#endif
