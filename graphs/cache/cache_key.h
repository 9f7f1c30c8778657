/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CACHE_CACHE_KEY_H
#define QMAT_GRAPHS_CACHE_CACHE_KEY_H

#include "core/node.h"

/* What the result of a node depends on, as a list of items, and the digest of that list: the key that a result is kept
 * under. The items come from the node's descriptor alone. Each is a JSON array of three texts, tag, name and value:
 *
 *     key      format          "2"
 *     program  sources         digest of the sources of core/, io/ and nodes/ (where it was built so)
 *     node     medial.simplify its version
 *     library  Embree          its version and instruction set
 *     param    epsilon         the value in canonical text; a choice by its name
 *     name     path            the name of a file that is read, without its folder
 *     file     path            the digest of its bytes, or "none" where no path is given
 *     input    mesh            type and digest of the value, or "none"
 *     side     path:skin.bin   the digest of a file that the one of parameter `path` refers to, or "absent"
 *
 * Folders, host, user, time, threads, locale and the node's id are not among them. */

enum { QMAT_KEY_FORMAT = 2 };

/* The items of one run of a node. `inputs` holds a digest per input port, NULL where nothing is connected; `files` one
 * per parameter: of the file that it names, NULL for other parameters and where no path is given. NULL when memory is
 * short; the caller calls json_decref. */
json_t *qmat_key_items(const qmat_node *type, const void *params, const qmat_digest *const *inputs,
                       const qmat_digest *const *files);

/* Adds a file beside the one that parameter `param` names, by its path from that file's folder; NULL `digest`: it is
 * not there. False when memory is short. */
bool qmat_key_add_side_file(json_t *items, const char *param, const char *path, const qmat_digest *digest);

/* The key: SHA-256 over the items, every text with its length before it. False for what is no list of items, or when
 * OpenSSL fails. */
bool qmat_key_digest(const json_t *items, qmat_digest *key);

/* The file that parameter `row` of a node names with these parameters; NULL: it names none. The text is the params'. */
const char *qmat_param_input_file(const qmat_node *type, size_t row, const void *params);

#endif
