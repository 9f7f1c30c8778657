/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CACHE_CACHE_KEY_H
#define QMAT_GRAPHS_CACHE_CACHE_KEY_H

#include "core/node.h"

/* Everything that a node's result depends on, as a list of items, and the digest of that list: the result's key. The
 * node's descriptor alone determines the items. Each is a JSON array of three texts, tag, name and value:
 *
 *     key      format          "2"
 *     program  version         of qmat: files that it writes name it
 *     program  sources         digest of the sources of core/, io/ and nodes/ (QMAT_KEY_SOURCES)
 *     node     medial.simplify its version
 *     library  Embree          its version and instruction set
 *     param    epsilon         the value as canonical text; an enum by its choice
 *     name     path            the name of an input file, without its folder
 *     file     path            the digest of its bytes, or "none" without a path
 *     input    mesh            type and digest of the value, or "none"
 *     side     path:skin.bin   the digest of a side file of parameter `path`, or "absent"
 *
 * Folders, host, user, time, threads, locale and the node's id are not part of a key. */

enum { QMAT_KEY_FORMAT = 2 };

/* The items of one run of a node. `inputs` has a digest per input port, NULL if it is not connected. `files` has one
 * per parameter: the digest of its input file, NULL if it names none. NULL when memory is short; the caller calls
 * json_decref. */
json_t *qmat_key_items(const qmat_node *type, const void *params, const qmat_digest *const *inputs,
                       const qmat_digest *const *files);

/* Adds a side file of parameter `param`, by its path relative to the folder of that parameter's file. `digest` NULL:
 * the file is missing. False when memory is short. */
bool qmat_key_add_side_file(json_t *items, const char *param, const char *path, const qmat_digest *digest);

/* The key: SHA-256 over all texts, each with its length before it. False for malformed items, or when OpenSSL fails. */
bool qmat_key_digest(const json_t *items, qmat_digest *key);

/* The input file that parameter `row` of a node names, or NULL. The text belongs to `params`. */
const char *qmat_param_input_file(const qmat_node *type, size_t row, const void *params);

#endif
