/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_GRAPH_FILE_H
#define QMAT_GRAPHS_GRAPH_FILE_H

#include "graphs/graph.h"

/* The graph language:
 *
 *     qmat: 1                                   the version of the language
 *     inputs:                                   short names for parameters
 *       model: model.path
 *       rays: { field: rays, other: rays }      sets one parameter in each of several nodes
 *     nodes:
 *       model:  { type: scene.read, params: { path: octopus.off } }
 *       field:  { type: mesh.sdf, in: { mesh: model.mesh } }
 *     outputs: { asset: asset.file }            the results; or { from: asset.file, path: octopus.glb }
 *
 * Relative paths in a file are relative to its folder. */

/* Reads and checks the graph file `path`. The registry's table must outlive the graph. QMAT_ERROR_USAGE reports the
 * first mistake with its place and the nearest valid name, and also a file that cannot be read. `*graph` is zeroed on
 * failure; free it with qmat_graph_uninit. */
qmat_status qmat_graph_read_file(qmat_context *context, const qmat_registry *registry, const char *path,
                                 qmat_graph *graph);

/* Called with each mistake but the last. */
typedef void qmat_mistake_fn(const qmat_error *error);

/* The same, but goes on after a mistake: the last one is the error. What follows from an earlier mistake is left out.
 * At most 51 are told. `mistake` may be NULL: the first is the only one. `stream` is NULL, or what errors call the
 * standard input that `path` has a copy of: relative paths are then relative to the working folder. */
qmat_status qmat_graph_read_file_all(qmat_context *context, const qmat_registry *registry, const char *path,
                                     const char *stream, qmat_mistake_fn *mistake, qmat_graph *graph);

/* qmat_graph_read_file for `size` bytes of text. Errors call it `file`; relative paths are not resolved. */
qmat_status qmat_graph_read_text(qmat_context *context, const qmat_registry *registry, const char *file,
                                 const char *text, size_t size, qmat_graph *graph);

#endif
