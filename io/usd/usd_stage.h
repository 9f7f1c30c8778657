/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_STAGE_H
#define QMAT_IO_USD_USD_STAGE_H

#include <jansson.h>

#include "io/usd/usd.h"

/* A scene of USD composed from its layers: sublayers, inherits, variants, references, payloads and specializes, in that
 * order of strength (LIVRPS). Files are found relative to the layer that names them, or beside it in a package. What
 * cannot be composed is left out with a warning that names the prim: files that are not there, absolute paths and
 * addresses, relocates, value clips, prims that refer to themselves. A file that is there and broken is an error.
 * Prims are composed one by one, so that memory holds the layers and one path of prims only.
 * Source: OpenUSD's documentation of composition ("LIVERPS strength ordering"). */
typedef struct qmat_usd_stage qmat_usd_stage;

/* A spec that has a say about a prim, and its layer. */
typedef struct qmat_usd_opinion {
  const qmat_usd_layer *layer;
  const qmat_usd_spec *spec;
  bool is_inherited; /* by way of inherits or specializes */
} qmat_usd_opinion;

/* A composed prim. Zeroed before it is made. */
typedef struct qmat_usd_prim {
  const struct qmat_usd_prim *parent; /* NULL: the root of the scene */
  const char *name;                   /* "" of the root */
  int depth;                          /* of the root 0 */
  size_t opinion_count;
  const qmat_usd_opinion *opinions; /* strongest first */
  struct qmat_usd_node *tree;
  qmat_arena arena;
} qmat_usd_prim;

/* Opens the stage whose root layer is the file in `bytes` (.usda, .usdc or .usdz), which must outlive it. `path` names
 * it and is where other files are looked for. Free with qmat_usd_stage_close; NULL on failure. */
qmat_status qmat_usd_stage_open(qmat_context *context, const qmat_bytes *bytes, const char *path,
                                qmat_usd_stage **stage);
/* NULL is allowed. */
void qmat_usd_stage_close(qmat_usd_stage *stage);

/* The root layer, which has the units. */
const qmat_usd_layer *qmat_usd_stage_root_layer(const qmat_usd_stage *stage);
/* How many layers were read so far. */
size_t qmat_usd_stage_layer_count(const qmat_usd_stage *stage);
/* The bytes of all files that were read so far. */
size_t qmat_usd_stage_bytes(const qmat_usd_stage *stage);
/* The warnings so far, an array of texts, which the stage owns. */
json_t *qmat_usd_stage_warnings(const qmat_usd_stage *stage);

/* Starts over: none so far. */
void qmat_usd_stage_forget_warnings(qmat_usd_stage *stage);

/* Adds a warning "PATH: ..." about a prim. After a hundred only their number is counted on, in the last one. */
qmat_status qmat_usd_warn(qmat_context *context, qmat_usd_stage *stage, const qmat_usd_prim *prim, const char *format,
                          ...) __attribute__((format(printf, 4, 5)));

/* QMAT_ERROR_FORMAT about a prim, with the file. */
qmat_status qmat_usd_prim_fail(qmat_context *context, const qmat_usd_stage *stage, const qmat_usd_prim *prim,
                               const char *format, ...) __attribute__((format(printf, 4, 5)));

/* The root of the scene. Free prims with qmat_usd_prim_uninit, also after a failure, children before parents. */
qmat_status qmat_usd_stage_root(qmat_context *context, qmat_usd_stage *stage, qmat_usd_prim *prim);

/* The names of a prim's children in their order, in its own memory. */
qmat_status qmat_usd_prim_children(qmat_context *context, qmat_usd_prim *prim, const char *const **names,
                                   size_t *count);

/* Composes one child, which keeps a pointer to its parent. QMAT_ERROR_FORMAT also when the scene has become larger than
 * its files justify, as endless instances of instances make it. */
qmat_status qmat_usd_prim_child(qmat_context *context, qmat_usd_stage *stage, const qmat_usd_prim *parent,
                                const char *name, qmat_usd_prim *child);

void qmat_usd_prim_uninit(qmat_usd_prim *prim);

/* The strongest value of a field of the prim itself ("typeName", "active"), or NULL. */
const qmat_usd_value *qmat_usd_prim_field(const qmat_usd_prim *prim, const char *name);

/* "def", "class", or "over" where nothing defines the prim. */
const char *qmat_usd_prim_specifier(const qmat_usd_prim *prim);

/* The strongest value of an attribute, or NULL for none. Of an attribute that changes over time its default, or else
 * its first sample, and a warning. */
qmat_status qmat_usd_prim_attribute(qmat_context *context, qmat_usd_stage *stage, const qmat_usd_prim *prim,
                                    const char *name, const qmat_usd_value **value);

/* Whether any opinion has a relationship of this name. */
bool qmat_usd_prim_has_relationship(const qmat_usd_prim *prim, const char *name);

#endif
