/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_PRIM_H
#define QMAT_IO_USD_USD_PRIM_H

#include <jansson.h>

#include "io/usd/usd_layer.h"

/* A composed prim: the specs that have opinions about it, and messages about it. io/usd/usd_stage.h makes prims. */

/* How times of a layer become those of the scene, both in time codes: offset + scale * time. */
typedef struct qmat_usd_time {
  double offset, scale;
} qmat_usd_time;

/* Times that pass through `inner` first, then through `outer`. */
static inline qmat_usd_time qmat_usd_time_through(qmat_usd_time outer, qmat_usd_time inner) {
  return (qmat_usd_time){.offset = outer.offset + outer.scale * inner.offset, .scale = outer.scale * inner.scale};
}

/* A spec with opinions about a prim, and its layer. */
typedef struct qmat_usd_opinion {
  const qmat_usd_layer *layer;
  const qmat_usd_spec *spec;
  bool is_inherited; /* through an inherit or specialize arc */
  int introduced;    /* the depth of the prim with the arc that brings the spec's paths into the scene; 0: none does */
  int arc_depth;     /* the same, but variants count as arcs too */
  const qmat_usd_spec *variant; /* the nearest one that brings the spec; NULL: none does */
  qmat_usd_time time;
} qmat_usd_opinion;

/* Where the messages about the prims of a stage go. */
typedef struct qmat_usd_log {
  qmat_context *context;
  const char *file; /* of the root layer, for errors */
  json_t *warnings; /* an array of texts "PATH: ..." */
  size_t count;     /* of warnings; after 100 the last text is their number */
} qmat_usd_log;

/* Zeroed before it is made. */
typedef struct qmat_usd_prim {
  qmat_usd_log *log;
  const struct qmat_usd_prim *parent; /* NULL: the root of the scene */
  const char *name;                   /* "" for the root */
  int depth;                          /* 0 for the root */
  size_t opinion_count;
  const qmat_usd_opinion *opinions; /* strongest first */
  int least_arc_depth;        /* the children only have opinions of arcs from this depth on; above 0 for instances */
  struct qmat_usd_node *tree; /* for composing its children */
  qmat_arena arena;
} qmat_usd_prim;

/* Adds a warning about a prim, printable and in UTF-8. QMAT_ERROR_MEMORY. */
qmat_status qmat_usd_warn(const qmat_usd_prim *prim, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* QMAT_ERROR_FORMAT about a prim, with its path and the file of the root layer. */
qmat_status qmat_usd_prim_fail(const qmat_usd_prim *prim, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* Turns the error that qmat_usd_prim_fail has recorded about the prim into a warning, "what: the error's text", and
 * puts the error `before` back. QMAT_ERROR_MEMORY. */
qmat_status qmat_usd_warn_of_error(const qmat_usd_prim *prim, const char *what, const qmat_error *before);

/* QMAT_ERROR_MEMORY about composing a prim. */
qmat_status qmat_usd_fail_prim_memory(const qmat_usd_prim *prim);

/* The text, or "?" when it is not UTF-8. */
const char *qmat_usd_shown(const char *text);

/* Whether a prim with this customData (NULL: none) was written by qmat as a medial mesh. */
bool qmat_usd_is_medial_data(const qmat_usd_value *custom_data);
/* Whether qmat has written the prim as a medial mesh. */
bool qmat_usd_prim_is_medial(const qmat_usd_prim *prim);

/* The names of the children in their order, in the prim's memory. QMAT_ERROR_MEMORY. */
qmat_status qmat_usd_prim_children(qmat_usd_prim *prim, const char *const **names, size_t *count);

/* The child whose name is the first `length` bytes of `name`: its name in the memory of a layer, or NULL. Cost: a
 * look-up for each opinion. QMAT_ERROR_MEMORY. */
qmat_status qmat_usd_prim_find_child(qmat_usd_prim *prim, const char *name, size_t length, const char **found);

/* The strongest value of a field of the prim itself ("typeName", "active"), or NULL. */
const qmat_usd_value *qmat_usd_prim_field(const qmat_usd_prim *prim, const char *name);

/* "def", "class", or "over" when nothing defines the prim. */
const char *qmat_usd_prim_specifier(const qmat_usd_prim *prim);

/* The strongest value of an attribute, or NULL for none. An attribute that changes over time has its default, or else
 * its first sample, with a warning. */
qmat_status qmat_usd_prim_attribute(const qmat_usd_prim *prim, const char *name, const qmat_usd_value **value);

/* The strongest opinion about an attribute: its samples over time with the way to the scene's times, or else its
 * default value; NULL for what it does not have. */
void qmat_usd_prim_samples(const qmat_usd_prim *prim, const char *name, const qmat_usd_samples **samples,
                           qmat_usd_time *time, const qmat_usd_value **fixed);

/* The nearest prim from `prim` upwards that has an attribute or a relationship of this name; NULL: none. */
const qmat_usd_prim *qmat_usd_prim_above(const qmat_usd_prim *prim, qmat_usd_kind kind, const char *name);

/* The strongest value of a field of an attribute ("interpolation"), or NULL. */
const qmat_usd_value *qmat_usd_prim_metadata(const qmat_usd_prim *prim, const char *attribute, const char *field);

/* The strongest value of an attribute that is a text, which the layer owns; `otherwise` for other values and for none.
 */
qmat_status qmat_usd_prim_token(const qmat_usd_prim *prim, const char *name, const char *otherwise, const char **token);

/* Whether an API schema of this name is applied to the prim. */
bool qmat_usd_prim_has_schema(const qmat_usd_prim *prim, const char *name);

/* Whether any opinion has a relationship of this name. */
bool qmat_usd_prim_has_relationship(const qmat_usd_prim *prim, const char *name);

/* The targets of a relationship as paths in the scene, edited from the weakest opinion to the strongest; `arena` gets
 * them. Targets outside of what an arc brings in are skipped with a warning. QMAT_ERROR_FORMAT, QMAT_ERROR_MEMORY. */
qmat_status qmat_usd_prim_targets(const qmat_usd_prim *prim, const char *name, qmat_arena *arena,
                                  const char *const **targets, size_t *count);

/* The path of a prim in the scene, in the arena's memory; NULL when memory is short. */
const char *qmat_usd_prim_path(const qmat_usd_prim *prim, qmat_arena *arena);

/* Whether a path is `end`, or ends in it after a slash. */
bool qmat_usd_path_ends_in(const char *path, const char *end);

void qmat_usd_prim_uninit(qmat_usd_prim *prim);

#endif
