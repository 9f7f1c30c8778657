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

/* One value of a YAML document: a text, or a mapping from texts to values. There are no lists, anchors, aliases or
 * tags: the graph language has no use for them, and without them a document is never larger than its file. */
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
  const char *text; /* NUL-terminated, without other NULs; NULL for a mapping */
  bool empty;       /* nothing was written, or an unquoted null or ~ */
  qmat_tree_entry *entries;
};

enum {
  QMAT_TREE_MAX_BYTES = 1 << 20, /* of a file */
  QMAT_TREE_MAX_DEPTH = 16,      /* mappings in mappings */
  QMAT_TREE_MAX_ENTRIES = 4096   /* of one mapping */
};

/* Reads one YAML document (JSON is a part of YAML) of `size` bytes. `file` is the name that errors give it. `*tree`
 * lives in `arena`. QMAT_ERROR_USAGE with the place: a syntax error, an empty or a second document, a list, an anchor,
 * an alias, a tag, a key that is given twice, or more than the limits above. Cost: linear in the size, and quadratic in
 * the entries of one mapping. */
qmat_status qmat_tree_read(qmat_context *context, qmat_arena *arena, const char *file, const char *text, size_t size,
                           const qmat_tree **tree);

/* Text from a file as an error message may show it: at most 60 bytes, nothing that a terminal would act on. */
typedef struct qmat_shown {
  char text[68];
} qmat_shown;
qmat_shown qmat_show(const char *text);

#endif
