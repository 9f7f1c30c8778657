/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_GRAPH_FORMAT_H
#define QMAT_GRAPHS_GRAPH_FORMAT_H

#include "core/context.h"
#include "io/bytes.h"

enum { QMAT_GRAPH_LINE_WIDTH = 120 };

/* Writes the graph file of `size` bytes of text again, in the one layout of graph files: indentation by two; a mapping
 * in braces on one line where it was and fits in QMAT_GRAPH_LINE_WIDTH columns, else one entry a line; at most one
 * empty line; comments behind entries in one column up to the next empty line. Order, quotes and comments stay as they
 * are. What is formatted again stays as it is. `formatted` is empty or holds the text; the caller frees it.
 * QMAT_ERROR_USAGE: not a YAML document of mappings (with the place, in `file`), or one whose values or comments would
 * not all come back. QMAT_ERROR_MEMORY. Cost: linear, as qmat_tree_read. */
qmat_status qmat_graph_format(qmat_context *context, const char *file, const char *text, size_t size,
                              qmat_writer *formatted);

#endif
