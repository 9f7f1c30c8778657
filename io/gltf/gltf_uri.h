/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_URI_H
#define QMAT_IO_GLTF_GLTF_URI_H

#include <jansson.h>

#include "core/context.h"

/* Converts the files that a glTF asset refers to between relative URIs, file names and part names. */

/* Converts a relative URI of `length` characters to a path relative to the asset's folder. Percent codes are decoded,
 * blanks stay, and redundant steps ("./", "//", "a/../") are removed. A path outside the folder starts with "../".
 * `*name` is NULL if the URI is not a relative path to a file (a scheme, a query, a leading slash, a backslash); the
 * caller frees it with qmat_free. QMAT_ERROR_MEMORY. */
qmat_status qmat_gltf_file_name(qmat_context *context, const char *uri, size_t length, char **name);

/* Whether such a path lies outside the asset's folder. */
bool qmat_gltf_is_outside(const char *name);

/* The part name of such a path: leading "../" and all "%" are percent-encoded, so that qmat_is_part_name accepts it and
 * no two files share it. NULL when out of memory; free it with qmat_free. */
char *qmat_gltf_part_name(const char *name);

/* The URI of a path, percent-encoded as RFC 3986 requires. NULL when out of memory; free it with qmat_free. */
char *qmat_gltf_uri_of(const char *name);

/* The path of file `name` in the folder of the file `asset`. NULL when out of memory; free it with qmat_free. */
char *qmat_gltf_beside(const char *asset, const char *name);

/* Decodes a data URI of `length` characters. `*bytes` (free it with qmat_free) gets `*size` bytes; NULL if it is no
 * data URI in base64. QMAT_ERROR_FORMAT for invalid base64, QMAT_ERROR_MEMORY. Linear. */
qmat_status qmat_gltf_decode_uri(qmat_context *context, const char *uri, size_t length, uint8_t **bytes, size_t *size);

typedef enum qmat_gltf_uri_kind { QMAT_GLTF_BUFFER_URI, QMAT_GLTF_IMAGE_URI, QMAT_GLTF_OTHER_URI } qmat_gltf_uri_kind;

/* Receives the URI string `owner[key]`. It may set that member and no other. */
typedef qmat_status qmat_gltf_uri_visit(void *user, json_t *owner, const char *key, qmat_gltf_uri_kind kind);

/* Calls `visit` for the URIs of an asset in a fixed order until a call fails. A URI is a string outside extras whose
 * key is "uri" or ends in "Uri". Returns the status of the last call. */
qmat_status qmat_gltf_visit_uris(json_t *root, qmat_gltf_uri_visit *visit, void *user);

#endif
