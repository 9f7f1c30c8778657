/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_CHECKER_H
#define QMAT_IO_GLTF_GLTF_CHECKER_H

#include "io/gltf/gltf_asset.h"
#include "io/gltf/gltf_document.h"

/* Shared by all checks of a glTF asset: state, errors, and typed access to its JSON. */

/* The properties of an accessor that later checks use. */
typedef struct qmat_gltf_accessor {
  int64_t component_type, components, count;
  bool has_view, normalized;
} qmat_gltf_accessor;

typedef struct qmat_gltf_view {
  int64_t size, stride; /* stride 0: tightly packed */
} qmat_gltf_view;

typedef struct qmat_gltf_checker {
  qmat_context *context;
  const char *path;
  qmat_gltf_document *document;
  json_t *root;
  qmat_gltf_asset asset;
  qmat_gltf_accessor *accessors; /* one per accessor, after qmat_gltf_check_data */
  qmat_gltf_view *views;         /* one per buffer view */
} qmat_gltf_checker;

/* QMAT_ERROR_FORMAT about an element ("accessor", 3; `kind` NULL: the asset), with the asset's path. */
qmat_status qmat_gltf_fail(const qmat_gltf_checker *check, const char *kind, size_t element, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
qmat_status qmat_gltf_fail_memory(const qmat_gltf_checker *check);

/* Reads a whole number in [least, most], also if written as 3.0; false for anything else. */
bool qmat_gltf_whole(const json_t *value, int64_t least, int64_t most, int64_t *number);

/* Each of these reads object[key]. A wrong type or range is an error that names the element. */

/* A whole number; the object then holds it as an integer. Without the key, `*number` is unchanged and `*present` false;
 * if `present` is NULL, the key is required. */
qmat_status qmat_gltf_take_whole(const qmat_gltf_checker *check, json_t *object, const char *key, const char *kind,
                                 size_t element, int64_t least, int64_t most, int64_t *number, bool *present);
/* The index of a member of the root's array `of`; otherwise as qmat_gltf_take_whole. */
qmat_status qmat_gltf_take_id(const qmat_gltf_checker *check, json_t *object, const char *key, const char *kind,
                              size_t element, const char *of, int64_t *id, bool *present);
/* `count` numbers; any number of them if `count` is SIZE_MAX and `numbers` is NULL. */
qmat_status qmat_gltf_take_numbers(const qmat_gltf_checker *check, const json_t *object, const char *key,
                                   const char *kind, size_t element, size_t count, double *numbers, bool *present);
/* An object or an array; `*value` is NULL without the key. */
qmat_status qmat_gltf_take_object(const qmat_gltf_checker *check, const json_t *object, const char *key,
                                  const char *kind, size_t element, json_t **value);
qmat_status qmat_gltf_take_array(const qmat_gltf_checker *check, const json_t *object, const char *key,
                                 const char *kind, size_t element, json_t **value);

/* Deletes every key that is not in the NULL-terminated list. */
void qmat_gltf_keep_keys(json_t *object, const char *const keys[]);

#endif
