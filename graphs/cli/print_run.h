/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CLI_PRINT_RUN_H
#define QMAT_GRAPHS_CLI_PRINT_RUN_H

#include <stdio.h>

#include "graphs/run/run.h"

/* The results of a run, for people. Nothing is wider than the terminal. */

/* Prints what a finished run made, how good it is, and which files it wrote. With `table` first a line per step: node,
 * type, state if there is a cache, seconds, and as much of the results as has room. */
void qmat_print_run(const qmat_run *run, bool table, FILE *out);

/* Prints a line per step of a foreseen run: node, type, state, and its missing parameter if any. With `keys` also the
 * starts of the keys that are known. */
void qmat_print_plan(const qmat_run *run, bool keys, FILE *out);

/* Prints what several runs come to, or one: its text in two lines, of which the second may be missing. The first line
 * starts the paragraph, the second is indented. */
void qmat_print_summary(const char *text, FILE *out);

#endif
