/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_URI_H
#define QMAT_IO_GLTF_GLTF_URI_H

#include <jansson.h>

#include "core/context.h"

/* The files that a glTF asset names: relative paths as URIs, as file names, and as names of parts. */

/* The file that the `length` characters of a relative URI name, as a path from the asset's folder: percent signs are
 * decoded, blanks are kept, steps that lead nowhere ("./", "//", "a/../") are removed. A file outside of the folder
 * starts with "../". `*name` is NULL where the URI is no relative path to a file (a scheme, a query, a leading slash, a
 * backslash); the caller frees it with qmat_free. QMAT_ERROR_MEMORY. */
qmat_status qmat_gltf_file_name(qmat_context *context, const char *uri, size_t length, char **name);

/* Whether such a name leads out of the asset's folder. */
bool qmat_gltf_is_outside(const char *name);

/* The name that the part of a scene or file has for such a file: the same, but "../" and "%" are percent-encoded, so
 * that it is a name that qmat_is_part_name takes and no other file has. NULL when memory is short; qmat_free frees it.
 */
char *qmat_gltf_part_name(const char *name);

/* The URI of a file, percent-encoded where RFC 3986 asks for it. NULL when memory is short; qmat_free frees it. */
char *qmat_gltf_uri_of(const char *name);

/* The path of a file from the folder of the file `asset`; NULL when memory is short. qmat_free frees it. */
char *qmat_gltf_beside(const char *asset, const char *name);

typedef enum qmat_gltf_uri_kind { QMAT_GLTF_BUFFER_URI, QMAT_GLTF_IMAGE_URI, QMAT_GLTF_OTHER_URI } qmat_gltf_uri_kind;

/* Takes `owner[key]`, a string that is a URI. It may set that member, and no other. */
typedef qmat_status qmat_gltf_uri_visit(void *user, json_t *owner, const char *key, qmat_gltf_uri_kind kind);

/* Calls `visit` for the URIs of an asset in a fixed order, until it fails: each string under a key "uri", or one that
 * ends in "Uri", outside of extras. Returns what the last call returned. */
qmat_status qmat_gltf_visit_uris(json_t *root, qmat_gltf_uri_visit *visit, void *user);

#endif
