/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_LAYER_H
#define QMAT_IO_USD_USD_LAYER_H

#include "core/arena.h"
#include "core/key_table.h"
#include "io/bytes.h"

/* One file of Universal Scene Description in memory: a layer, which is a tree of specs with named fields. io/usd/usda.h
 * reads it from text (.usda), io/usd/usdc.h from a binary crate (.usdc), and io/usd/usd_stage.h composes layers. Fields
 * have their names of the binary form: "specifier", "typeName", "references", "default", "timeSamples", "targetPaths",
 * ... Source: OpenUSD's documentation of the text format and its reader of the crate format. */

/* The type of an element of a value. */
typedef enum qmat_usd_type {
  QMAT_USD_BLOCK, /* None: blocks weaker values */
  QMAT_USD_BOOL,  /* integers from here */
  QMAT_USD_UCHAR,
  QMAT_USD_INT,
  QMAT_USD_UINT,
  QMAT_USD_INT64,
  QMAT_USD_UINT64, /* from 2^63 on: the negative number of the same bits */
  QMAT_USD_HALF,   /* numbers from here */
  QMAT_USD_FLOAT,
  QMAT_USD_DOUBLE,
  QMAT_USD_TIMECODE,
  QMAT_USD_STRING, /* texts from here */
  QMAT_USD_TOKEN,  /* also specifier ("def", "over", "class"), variability, permission */
  QMAT_USD_ASSET,
  QMAT_USD_PATH,
  QMAT_USD_REFERENCE, /* of a reference or a payload */
  QMAT_USD_DICTIONARY,
  QMAT_USD_LIST_OP, /* edits of a list */
  QMAT_USD_TIME_SAMPLES,
  QMAT_USD_UNREAD, /* a kind of value that is skipped; texts[0] names the kind */
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

/* A value. The layer owns it with all its contents; several fields may share it. */
typedef struct qmat_usd_value {
  qmat_usd_type type;
  bool is_array;
  uint8_t components; /* of an element: 1, vectors and quaternions (real part first) 2 to 4, matrices 4, 9 or 16 */
  size_t count;       /* elements: 1 unless it is an array; entries of a dictionary */
  union {
    const int64_t *integers; /* count * components */
    const double *numbers;   /* count * components, rounded to half or float for these types */
    const char *const *texts;
    const qmat_usd_reference *references;
    const qmat_usd_field *entries;
    const qmat_usd_list_op *list_op;
    const qmat_usd_samples *samples;
  };
} qmat_usd_value;

/* A named value: a field of a spec or an entry of a dictionary. */
struct qmat_usd_field {
  const char *name;
  const qmat_usd_value *value;
};

struct qmat_usd_list_op {
  bool is_explicit;
  qmat_usd_value lists[QMAT_USD_EDIT_COUNT]; /* arrays; count 0 where there is none */
};

/* Samples over time, in the order of the file. */
struct qmat_usd_samples {
  size_t count;
  const double *times;                 /* count */
  const qmat_usd_value *const *values; /* count */
};

typedef enum qmat_usd_kind {
  QMAT_USD_ROOT, /* has the layer's metadata; its children are the root prims */
  QMAT_USD_PRIM,
  QMAT_USD_ATTRIBUTE,
  QMAT_USD_RELATIONSHIP,
  QMAT_USD_VARIANT_SET, /* below a prim or variant; its children are variants */
  QMAT_USD_VARIANT      /* has fields and children like a prim */
} qmat_usd_kind;

typedef struct qmat_usd_spec {
  qmat_usd_kind kind;
  const char *name;
  int line, column; /* in text, from 1; 0 in crates */
  int depth;        /* 0 for the root */
  struct qmat_usd_spec *parent, *first_child, *last_child, *next;
  size_t field_count, field_capacity;
  qmat_usd_field *fields;
} qmat_usd_spec;

enum {
  QMAT_USD_DEEPEST = 200,     /* nesting of specs and of dictionaries */
  QMAT_USD_MOST_FIELDS = 4096 /* of a spec: finding one is linear */
};

/* A zeroed layer is empty and valid. Free with qmat_usd_layer_uninit, also after a failed read. */
typedef struct qmat_usd_layer {
  qmat_context *context; /* for errors while it is read */
  const char *path;      /* for errors */
  qmat_usd_spec *root;
  qmat_key_table specs; /* by parent, kind and name */
  uint8_t *chunk;       /* where small allocations come from */
  size_t chunk_left;
  size_t allowance; /* bytes that may still be allocated: 2^24, and 256 for each byte of the file */
  qmat_arena arena;
} qmat_usd_layer;

void qmat_usd_layer_uninit(qmat_usd_layer *layer);

/* The value of a field, or of an entry of a dictionary (NULL or another value: none); NULL when there is none. */
const qmat_usd_value *qmat_usd_field_value(const qmat_usd_spec *spec, const char *name);
const qmat_usd_value *qmat_usd_entry(const qmat_usd_value *dictionary, const char *name);

/* The text of a value that is one text; NULL for other values and for NULL. */
const char *qmat_usd_text(const qmat_usd_value *value);
/* The number of a value that is one number or integer; `otherwise` for other values and for NULL. */
double qmat_usd_number(const qmat_usd_value *value, double otherwise);
/* Whether the value is `true` or a number other than 0; `otherwise` for other values and for NULL. */
bool qmat_usd_truth(const qmat_usd_value *value, bool otherwise);

/* The name of the layer that qmat has written this one over, by its customLayerData; NULL: it is no such layer. */
const char *qmat_usd_original_of(const qmat_usd_layer *layer);

/* The time codes of a second, as the layer states them; 24 where it does not. */
double qmat_usd_codes_per_second(const qmat_usd_layer *layer);

/* The class of a type. */
bool qmat_usd_is_integer(qmat_usd_type type);
bool qmat_usd_is_number(qmat_usd_type type);
bool qmat_usd_is_text(qmat_usd_type type);

/* The child of that name and kind; NULL when there is none. Cost: a hash look-up. */
qmat_usd_spec *qmat_usd_child(const qmat_usd_layer *layer, const qmat_usd_spec *parent, qmat_usd_kind kind,
                              const char *name);

/* ---- for the readers ---- */

/* Starts a layer for a file of `size` bytes: an empty root, and the allowance. `path` is copied. `context` records
 * errors while the layer is read. QMAT_ERROR_MEMORY. */
qmat_status qmat_usd_layer_init(qmat_context *context, qmat_usd_layer *layer, const char *path, size_t size);

/* QMAT_ERROR_FORMAT and QMAT_ERROR_MEMORY about the layer's file as a whole. */
qmat_status qmat_usd_layer_fail(const qmat_usd_layer *layer, const char *what);
qmat_status qmat_usd_layer_fail_memory(const qmat_usd_layer *layer);
/* The status of the error that was recorded last. */
qmat_status qmat_usd_layer_error(const qmat_usd_layer *layer);

/* Memory of the layer: `count` elements of `size` bytes, cleared, aligned for any of the types here. NULL with the
 * error recorded when memory is short (QMAT_ERROR_MEMORY) or the allowance is used up (QMAT_ERROR_FORMAT). */
void *qmat_usd_alloc(qmat_usd_layer *layer, size_t count, size_t size);

/* A copy of `length` bytes and a terminating zero in the layer's memory; NULL with the error recorded. */
const char *qmat_usd_copy(qmat_usd_layer *layer, const char *text, size_t length);

/* Adds a child at the end of its parent, which must not have it yet. `name` must outlive the layer. NULL with the error
 * recorded, also when the nesting is too deep. */
qmat_usd_spec *qmat_usd_add_child(qmat_usd_layer *layer, qmat_usd_spec *parent, qmat_usd_kind kind, const char *name);

/* Sets a field to a copy of `value`, or replaces its older value. `name` must outlive the layer. */
qmat_status qmat_usd_set_field(qmat_usd_layer *layer, qmat_usd_spec *spec, const char *name,
                               const qmat_usd_value *value);

/* Makes `*value` one text (a token, say) or one boolean. `text` must outlive the layer. */
qmat_status qmat_usd_make_text(qmat_usd_layer *layer, qmat_usd_type type, const char *text, qmat_usd_value *value);
qmat_status qmat_usd_make_bool(qmat_usd_layer *layer, bool truth, qmat_usd_value *value);

/* Rounds the number to what `type` (half, float, or wider) can hold. */
double qmat_usd_round(qmat_usd_type type, double number);

#endif
