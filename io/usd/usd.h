/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_H
#define QMAT_IO_USD_USD_H

#include "core/arena.h"
#include "io/bytes.h"

/* One file of Universal Scene Description in memory: a layer, which is a tree of specs with named fields, as both the
 * text (.usda) and the binary crate (.usdc) hold it. Names of fields are those of the binary form: "specifier",
 * "typeName", "references", "default", "timeSamples", "targetPaths", ... Nothing is composed here: io/usd/usd_stage.h
 * does that. Source: OpenUSD's documentation of the file formats, and of the crate OpenUSD's own reader. */

/* What an element of a value is made of. */
typedef enum qmat_usd_type {
  QMAT_USD_BLOCK, /* None: says that there is no value */
  QMAT_USD_BOOL,  /* from here integers */
  QMAT_USD_UCHAR,
  QMAT_USD_INT,
  QMAT_USD_UINT,
  QMAT_USD_INT64,
  QMAT_USD_UINT64, /* beyond 2^63 - 1 as the negative number of the same bits */
  QMAT_USD_HALF,   /* from here numbers */
  QMAT_USD_FLOAT,
  QMAT_USD_DOUBLE,
  QMAT_USD_TIMECODE,
  QMAT_USD_STRING, /* from here texts */
  QMAT_USD_TOKEN,  /* also specifier ("def", "over", "class"), variability, permission */
  QMAT_USD_ASSET,
  QMAT_USD_PATH,
  QMAT_USD_REFERENCE, /* of a reference or a payload */
  QMAT_USD_DICTIONARY,
  QMAT_USD_LIST_OP, /* edits of a list */
  QMAT_USD_TIME_SAMPLES,
  QMAT_USD_UNREAD, /* a value of a kind that is not taken apart; texts[0] names the kind */
  QMAT_USD_TYPE_COUNT
} qmat_usd_type;

typedef struct qmat_usd_reference {
  const char *asset; /* "": the same layer */
  const char *path;  /* "": the layer's default prim */
  double offset, scale;
} qmat_usd_reference;

/* The lists of a list operation. */
typedef enum qmat_usd_edit {
  QMAT_USD_EXPLICIT,
  QMAT_USD_ADDED,
  QMAT_USD_PREPENDED,
  QMAT_USD_APPENDED,
  QMAT_USD_DELETED,
  QMAT_USD_ORDERED,
  QMAT_USD_EDIT_COUNT
} qmat_usd_edit;

typedef struct qmat_usd_field qmat_usd_field;
typedef struct qmat_usd_list_op qmat_usd_list_op;
typedef struct qmat_usd_samples qmat_usd_samples;

/* A value; the layer owns it and everything in it, and several fields may share it. */
typedef struct qmat_usd_value {
  qmat_usd_type type;
  bool is_array;
  uint8_t components; /* of an element: 1; 2 to 4 of vectors and quaternions (real part first); 4, 9, 16 of matrices */
  size_t count;       /* elements: 1 when it is no array; entries of a dictionary */
  union {
    const int64_t *integers; /* count * components */
    const double *numbers;   /* the same; rounded to what half and float hold */
    const char *const *texts;
    const qmat_usd_reference *references;
    const qmat_usd_field *entries;
    const qmat_usd_list_op *list_op;
    const qmat_usd_samples *samples;
  };
} qmat_usd_value;

/* A named value: a field of a spec, an entry of a dictionary. */
struct qmat_usd_field {
  const char *name;
  const qmat_usd_value *value;
};

struct qmat_usd_list_op {
  bool is_explicit;
  qmat_usd_value lists[QMAT_USD_EDIT_COUNT]; /* arrays; count 0 where there is none */
};

/* Samples over time, as written. */
struct qmat_usd_samples {
  size_t count;
  const double *times;                 /* count */
  const qmat_usd_value *const *values; /* count */
};

typedef enum qmat_usd_kind {
  QMAT_USD_ROOT, /* of the layer: its metadata; its children are the root prims */
  QMAT_USD_PRIM,
  QMAT_USD_ATTRIBUTE,
  QMAT_USD_RELATIONSHIP,
  QMAT_USD_VARIANT_SET, /* of a prim or variant; its children are variants */
  QMAT_USD_VARIANT      /* has fields and children like a prim */
} qmat_usd_kind;

typedef struct qmat_usd_spec {
  qmat_usd_kind kind;
  const char *name;
  int line, column; /* where it stands in text, from 1; 0 in crates */
  int depth;        /* of the root 0 */
  struct qmat_usd_spec *parent, *first_child, *last_child, *next;
  size_t field_count, field_capacity;
  qmat_usd_field *fields;
} qmat_usd_spec;

enum { QMAT_USD_DEEPEST = 200 }; /* nesting of specs and of dictionaries: more is refused */

/* A zeroed layer is empty and valid; free it with qmat_usd_layer_uninit, also after a failed read. */
typedef struct qmat_usd_layer {
  const char *path; /* for errors */
  qmat_usd_spec *root;
  size_t spec_count, slot_count;
  qmat_usd_spec **slots; /* by parent, kind and name */
  uint8_t *chunk;        /* for small things */
  size_t chunk_left;
  size_t allowance; /* the bytes that may still be taken: a file justifies only so many */
  qmat_arena arena;
} qmat_usd_layer;

/* Reads a text layer. `bytes` is the whole file, followed by 16 zero bytes, as qmat_bytes_read_file gives it; it may be
 * freed afterwards. `path` is copied into the layer. QMAT_ERROR_FORMAT with file, line and column; QMAT_ERROR_MEMORY.
 * One thread; linear. */
qmat_status qmat_usda_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_usd_layer *layer);

/* Reads a binary layer ("crate") of version 0.6 to 0.10; otherwise as qmat_usda_read. Every count and offset is checked
 * against the file before memory is taken for it. What values add up to is limited to 2^24 bytes and 256 for each byte
 * of the file. */
qmat_status qmat_usdc_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_usd_layer *layer);

/* Either of them, by the first bytes. */
qmat_status qmat_usd_layer_read(qmat_context *context, const qmat_bytes *bytes, const char *path,
                                qmat_usd_layer *layer);

void qmat_usd_layer_uninit(qmat_usd_layer *layer);

/* A field's value, or an entry's of a dictionary; NULL when there is none. */
const qmat_usd_value *qmat_usd_field_value(const qmat_usd_spec *spec, const char *name);
const qmat_usd_value *qmat_usd_entry(const qmat_usd_value *dictionary, const char *name);

/* The one text of a value that is no array of them; NULL for other values and for NULL. */
const char *qmat_usd_text(const qmat_usd_value *value);
/* The one number or integer of a value; `otherwise` for other values and for NULL. */
double qmat_usd_number(const qmat_usd_value *value, double otherwise);
/* Whether the value is `true` or a number other than 0; `otherwise` for other values and for NULL. */
bool qmat_usd_truth(const qmat_usd_value *value, bool otherwise);

/* What an element is made of. */
bool qmat_usd_is_integer(qmat_usd_type type);
bool qmat_usd_is_number(qmat_usd_type type);
bool qmat_usd_is_text(qmat_usd_type type);

/* The child of that name and kind; NULL when there is none. Properties share their names: ask for attributes or
 * relationships, either finds that kind only. */
qmat_usd_spec *qmat_usd_child(const qmat_usd_layer *layer, const qmat_usd_spec *parent, qmat_usd_kind kind,
                              const char *name);

/* ---- for the readers ---- */

/* Starts a layer for a file of `size` bytes: an empty root, and the allowance. */
qmat_status qmat_usd_layer_init(qmat_context *context, qmat_usd_layer *layer, const char *path, size_t size);

/* Memory of the layer: `count` elements of `size` bytes, cleared, aligned for any of our types. NULL with the error
 * recorded when memory is short (QMAT_ERROR_MEMORY) or the allowance is used up (QMAT_ERROR_FORMAT). */
void *qmat_usd_alloc(qmat_context *context, qmat_usd_layer *layer, size_t count, size_t size);

/* A copy of `length` bytes and a terminating zero in the layer's memory; NULL with the error recorded. */
const char *qmat_usd_copy(qmat_context *context, qmat_usd_layer *layer, const char *text, size_t length);

/* Makes a child at the end of its parent. `name` has to outlive the layer. NULL with the error recorded, also where
 * the nesting is too deep. Whether there is one already is the caller's question. */
qmat_usd_spec *qmat_usd_add_child(qmat_context *context, qmat_usd_layer *layer, qmat_usd_spec *parent,
                                  qmat_usd_kind kind, const char *name);

/* Sets a field; an older value of this name is replaced. `name` has to outlive the layer. */
qmat_status qmat_usd_set_field(qmat_context *context, qmat_usd_layer *layer, qmat_usd_spec *spec, const char *name,
                               const qmat_usd_value *value);

/* A value of one text, a token, say; NULL with the error recorded. `text` has to outlive the layer. */
const qmat_usd_value *qmat_usd_text_value(qmat_context *context, qmat_usd_layer *layer, qmat_usd_type type,
                                          const char *text);
/* A value of one boolean. */
const qmat_usd_value *qmat_usd_bool_value(qmat_context *context, qmat_usd_layer *layer, bool truth);

/* The number as `type` (half, float, or wider) holds it. */
double qmat_usd_round(qmat_usd_type type, double number);

#endif
