/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_YAML_TREE_H
#define QMAT_GRAPHS_YAML_TREE_H

#include <stdbool.h>
#include <stddef.h>

#include "core/context.h"

/* A place in a text, from 1; zeros: none. */
typedef struct qmat_mark {
  int line, column;
} qmat_mark;

/* One value of a YAML document: a text, or a mapping from texts to values. The graph language has no lists, anchors,
 * aliases or tags; without them a document is never larger than its file. */
typedef struct qmat_tree qmat_tree;

typedef struct qmat_tree_entry {
  const char *key;
  qmat_mark mark; /* of the key */
  const qmat_tree *value;
  struct qmat_tree_entry *next; /* in the file's order; NULL: the last */
} qmat_tree_entry;

struct qmat_tree {
  bool is_mapping;
  qmat_mark mark;
  const char *text; /* NUL-terminated, no other NULs; NULL for a mapping */
  bool empty;       /* no text, or an unquoted null or ~ */
  qmat_tree_entry *entries;
};

enum {
  QMAT_TREE_MAX_BYTES = 1 << 20, /* of a file */
  QMAT_TREE_MAX_DEPTH = 16,      /* mappings in mappings */
  QMAT_TREE_MAX_ENTRIES = 4096   /* of one mapping */
};

/* Reads one YAML document (or JSON, which is part of YAML) of `size` bytes. Errors call it `file`. `*tree` lives in
 * `arena`. QMAT_ERROR_USAGE with the place: a syntax error, an empty or a second document, a list, anchor, alias or
 * tag, a key that is given twice, or a limit above. Cost: linear in the size, quadratic in the entries of one mapping.
 */
qmat_status qmat_tree_read(qmat_context *context, qmat_arena *arena, const char *file, const char *text, size_t size,
                           const qmat_tree **tree);

/* Text from a file for an error message: at most 60 bytes, without control characters. */
typedef struct qmat_shown {
  char text[68];
} qmat_shown;
qmat_shown qmat_show(const char *text);

#endif
