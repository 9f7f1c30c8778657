/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_ARCS_H
#define QMAT_IO_USD_USD_ARCS_H

#include "io/usd/usd_files.h"

/* Composition arcs. The opinions about a prim come from a tree of nodes: its own layer stack is the root, and every arc
 * (inherit, variant, reference, ...) adds a child. Errors are QMAT_ERROR_FORMAT and QMAT_ERROR_MEMORY. */

/* From strong to weak. */
typedef enum qmat_usd_arc {
  QMAT_USD_ARC_ROOT,
  QMAT_USD_ARC_INHERIT,
  QMAT_USD_ARC_VARIANT,
  QMAT_USD_ARC_REFERENCE,
  QMAT_USD_ARC_PAYLOAD,
  QMAT_USD_ARC_SPECIALIZE
} qmat_usd_arc;

/* The specs of one prim or variant in one layer stack. */
typedef struct qmat_usd_node {
  qmat_usd_arc arc;
  int introduced; /* the depth of the prim that has the arc */
  int arcs_deep;  /* arcs between this node and the root */
  qmat_usd_time time;
  size_t stack;      /* the number of its layer stack */
  size_t spec_count; /* of layers of the stack that have a spec, strongest first */
  const qmat_usd_spec **specs;
  const qmat_usd_layer **layers;
  const qmat_usd_spec *variant; /* the nearest variant from this node to the root; NULL: none */
  bool has_variants_done;
  struct qmat_usd_node *parent, *first_child, *next; /* children strongest first */
} qmat_usd_node;

/* What composing a prim needs. */
typedef struct qmat_usd_composer {
  qmat_usd_files *files;
  qmat_usd_prim *prim; /* whose tree is being built */
  size_t *nodes_made;  /* for the whole scene */
  size_t node_count;   /* for this prim */
} qmat_usd_composer;

/* Makes a node in the prim's memory with room for `most_specs`; `parent` may be NULL and does not get it as a child.
 * QMAT_ERROR_FORMAT also when the prim or the scene has more nodes than the files justify. */
qmat_status qmat_usd_new_node(qmat_usd_composer *c, qmat_usd_node *parent, qmat_usd_arc arc, size_t stack,
                              size_t most_specs, qmat_usd_node **made);

/* The prim or variant at a path in a layer, "/a/b{set=choice}"; NULL when there is none. Cost: a look-up a name. */
const qmat_usd_spec *qmat_usd_spec_at(const qmat_usd_layer *layer, const char *path);

void qmat_usd_add_spec(qmat_usd_node *to, const qmat_usd_layer *layer, const qmat_usd_spec *spec);

/* Adds the arcs of a node's specs, and their arcs, except variants. */
qmat_status qmat_usd_add_arcs(qmat_usd_composer *c, qmat_usd_node *at);

/* Makes the part of the tree of the child `name` that comes from the arcs of its parent's tree, `from`; NULL when there
 * is none. `parent`: as in qmat_usd_new_node. Specs of nodes that are introduced above the depth `least` are left out:
 * INT_MIN for none. */
qmat_status qmat_usd_copy_tree(qmat_usd_composer *c, const qmat_usd_node *from, qmat_usd_node *parent, const char *name,
                               int least, qmat_usd_node **made);

/* Adds the arcs of the child itself to all nodes that qmat_usd_copy_tree made. */
qmat_status qmat_usd_add_arcs_of_copies(qmat_usd_composer *c, qmat_usd_node *at);

/* Adds the selected variants of all nodes of the prim's tree, and their arcs. Selections may come from any node, so
 * that the other arcs have to be there. */
qmat_status qmat_usd_add_variants(qmat_usd_composer *c);

#endif
