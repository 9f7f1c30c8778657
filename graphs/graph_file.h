/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_GRAPH_FILE_H
#define QMAT_GRAPHS_GRAPH_FILE_H

#include "core/node.h"
#include "graphs/yaml_tree.h"

/* A graph file, read and checked:
 *
 *     qmat: 1                                   the version of this language
 *     inputs:                                   other names for parameters
 *       model: model.path
 *       rays: { field: rays, other: rays }      for one parameter each of several nodes
 *     nodes:
 *       model:  { type: scene.read, params: { path: octopus.off } }
 *       field:  { type: mesh.sdf, in: { mesh: model.mesh } }
 *     outputs: { asset: asset.file }            what is wanted; or { from: asset.file, path: octopus.glb }
 *
 * Relative paths in a file are relative to its folder. */

/* The node types that a graph may use. */
typedef struct qmat_registry {
  const qmat_node *const *nodes;
  size_t count;
} qmat_registry;

/* The node type of that name, or NULL. */
const qmat_node *qmat_registry_find(const qmat_registry *registry, const char *name);

enum { QMAT_GRAPH_NAME_SIZE = 64 }; /* of ids and names, with the terminating zero */

/* Where an input port gets its value from. */
typedef struct qmat_graph_link {
  size_t node, port; /* SIZE_MAX: not connected */
  qmat_mark mark;
} qmat_graph_link;

typedef struct qmat_graph_node {
  char id[QMAT_GRAPH_NAME_SIZE];
  const qmat_node *type;
  qmat_mark mark;         /* of the id */
  void *params;           /* type->params_size bytes; its texts are those below or the descriptor's */
  char **texts;           /* per parameter: what it was set to, with the path resolved; NULL: the default */
  qmat_mark *marks;       /* per parameter: where the file sets it; zeros: it does not, or it was set later */
  qmat_graph_link *links; /* per input port */
} qmat_graph_node;

typedef struct qmat_graph_param {
  size_t node, param;
} qmat_graph_param;

/* Another name for a parameter, or for several that are set to the same. */
typedef struct qmat_graph_input {
  char name[QMAT_GRAPH_NAME_SIZE];
  size_t param_count;
  qmat_graph_param *params; /* at least one, in the file's order */
} qmat_graph_input;

typedef struct qmat_graph_output {
  char name[QMAT_GRAPH_NAME_SIZE];
  size_t node, port;
  char *path; /* where the file saves it, resolved; NULL: nowhere */
  qmat_mark mark, path_mark;
} qmat_graph_output;

/* A zeroed graph is empty, and may be uninitialised. */
typedef struct qmat_graph {
  qmat_registry registry;
  char *file;   /* what errors call it */
  char *folder; /* "" (the working folder), or ends in '/' */
  size_t node_count, input_count, output_count;
  qmat_graph_node *nodes;     /* in the file's order */
  qmat_graph_input *inputs;   /* in the file's order */
  qmat_graph_output *outputs; /* in the file's order */
  size_t *order;              /* node_count: every node after those it depends on, otherwise in the file's order */
} qmat_graph;

/* Reads and checks the graph file `path`. The registry's table must outlive the graph. QMAT_ERROR_USAGE with the place
 * and, where there is one, the nearest valid name: everything that is wrong with a graph, also a file that cannot be
 * read. Only the first mistake is told. `*graph` is zeroed on failure; free it with qmat_graph_uninit. */
qmat_status qmat_graph_read_file(qmat_context *context, const qmat_registry *registry, const char *path,
                                 qmat_graph *graph);

/* The same for `size` bytes of text; `file` is what errors call it, and relative paths stay as they are. */
qmat_status qmat_graph_read_text(qmat_context *context, const qmat_registry *registry, const char *file,
                                 const char *text, size_t size, qmat_graph *graph);

/* Frees what the graph holds. Works on a zeroed and on a failed graph. */
void qmat_graph_uninit(qmat_graph *graph);

/* Sets parameter `param` of node `node` from text, which is copied; a relative path is left as it is, so it is relative
 * to the working folder. QMAT_ERROR_USAGE leaves the old value. */
qmat_status qmat_graph_set(qmat_context *context, qmat_graph *graph, size_t node, size_t param, const char *text);

/* Sets every parameter that "node.param" or the name of an input stands for. QMAT_ERROR_USAGE leaves all of them as
 * they were, and suggests the nearest name. */
qmat_status qmat_graph_set_named(qmat_context *context, qmat_graph *graph, const char *name, const char *text);

/* Sets what "node.param=value" or "input=value" says. */
qmat_status qmat_graph_assign(qmat_context *context, qmat_graph *graph, const char *assignment);

/* The node of that id, the output port that "node.port" names, the output of that name. QMAT_ERROR_USAGE suggests the
 * nearest name. */
qmat_status qmat_graph_find_node(qmat_context *context, const qmat_graph *graph, const char *id, size_t *node);
qmat_status qmat_graph_find_port(qmat_context *context, const qmat_graph *graph, const char *name, size_t *node,
                                 size_t *port);
qmat_status qmat_graph_find_output(qmat_context *context, const qmat_graph *graph, const char *name, size_t *output);

/* Whether the ending of `path` fits what output `output` makes: files, in one of the formats that the node which makes
 * them can write, and reports, as .json. `*choice` becomes the value of the node's format parameter
 * (QMAT_PARAM_OUTPUT_FORMAT), or -1 where it has none. QMAT_ERROR_USAGE lists the known endings. */
qmat_status qmat_graph_output_format(qmat_context *context, const qmat_graph *graph, size_t output, const char *path,
                                     int *choice);

/* The parameter of a node type that the ending of an output path sets, or NULL. */
const qmat_param *qmat_output_format_param(const qmat_node *type);

/* Checks every node's parameters: required ones given, and the node's own rules. A required one that is missing is no
 * mistake when the graph names it among its inputs. */
qmat_status qmat_graph_check_params(qmat_context *context, const qmat_graph *graph);

/* The same for one node with those parameters, where nothing may be missing. */
qmat_status qmat_graph_check_node(qmat_context *context, const qmat_graph *graph, size_t node, const void *params);

#endif
