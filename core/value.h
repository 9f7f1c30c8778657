/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_VALUE_H
#define QMAT_CORE_VALUE_H

#include "core/context.h"
#include "core/text.h"
#include "core/value_types.h"

/* The life of a value: one node makes it, fills it and seals it. From then on any number of threads may read it, and
 * the last reader's release frees it. */

/* qmat_scene_new(), qmat_mesh_new(), ...: an empty, unsealed value of one reference; NULL when memory is short. Fill it
 * with qmat_alloc'd arrays and strings, which it then owns, and seal it. A report starts with an empty JSON object. */
#define QMAT_CONSTRUCTOR(NAME, name) qmat_##name *qmat_##name##_new(void);
QMAT_VALUE_TYPES(QMAT_CONSTRUCTOR)
#undef QMAT_CONSTRUCTOR
/* The same for a type that is known at run time only. */
qmat_value *qmat_value_new(qmat_value_type type);
/* A list of `count` items and names, all NULL; fill both. */
qmat_list *qmat_list_new(size_t count);

/* Checks the value (every index in range, every number finite, counts consistent), computes its digest and makes it
 * read-only. QMAT_ERROR_GEOMETRY names the first bad element. Cost: linear in the content. */
qmat_status qmat_value_seal(qmat_context *context, qmat_value *value);

/* Adds a reference and returns the argument; NULL gives NULL. Safe from any thread. */
qmat_value *qmat_value_retain(const qmat_value *value);
/* Drops a reference; the last one frees the value. NULL is allowed. Safe from any thread. */
void qmat_value_release(qmat_value *value);

/* The items of a list, or the value itself; NULL has none. `index` is below the count. */
size_t qmat_value_count(const qmat_value *value);
const qmat_value *qmat_value_at(const qmat_value *value, size_t index);
/* The type of those items, disregarding failures. */
qmat_value_type qmat_value_item_type(const qmat_value *value);

/* A sealed failure whose reason is the context's newest error, without its file and node id. NULL when memory is short,
 * which is then the newest error. */
qmat_value *qmat_failure_of_error(qmat_context *context);
/* The reason of a failure, owned by the value; NULL for every other type. */
const char *qmat_value_failure(const qmat_value *value);

/* "mesh", "medial", ...; "unknown" for a number that is no type. */
const char *qmat_value_type_name(qmat_value_type type);
/* The same as people say it: "a mesh", "a medial mesh", "a set of samples". */
const char *qmat_value_type_phrase(qmat_value_type type);

/* The bytes that the value's arrays, texts and files occupy, without lists of names; a list's are those of its items.
 */
size_t qmat_value_bytes(const qmat_value *value);

/* One table of numbers in a value: rows * columns doubles or ids, row by row; the other pointer is NULL. */
typedef struct qmat_value_array {
  const char *name; /* of the field in its struct: "positions" */
  size_t rows, columns;
  const double *numbers;
  const uint32_t *ids;
} qmat_value_array;

/* Table `index` of a value, in the order of its fields; the value owns it. False beyond the last. */
bool qmat_value_array_at(const qmat_value *value, size_t index, qmat_value_array *array);

/* The counts of a type, at most QMAT_MOST_COUNTS, ended by a row without a name. */
const qmat_value_count_row *qmat_value_count_rows(qmat_value_type type);
/* Those counts of one value, in that order; of a list their sums. Unused counts are 0. */
void qmat_value_counts(const qmat_value *value, size_t counts[QMAT_MOST_COUNTS]);

/* The diagonal of the box of the vertices that the triangles of a mesh use, in model units; 0 without triangles. */
double qmat_mesh_diagonal(const qmat_mesh *mesh);

#endif
