/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_RUN_RUN_PLAN_H
#define QMAT_GRAPHS_RUN_RUN_PLAN_H

#include "graphs/run/run.h"

/* An output of the graph, and the path that it is saved as. */
typedef struct qmat_run_save {
  size_t output;
  const char *path;
} qmat_run_save;

/* An output port of a node. */
typedef struct qmat_run_port {
  size_t node, port;
} qmat_run_port;

/* What to run. The arrays are read by qmat_run_plan only. */
typedef struct qmat_run_options {
  const qmat_run_save *saves; /* replace the paths that the graph file gives to these outputs */
  size_t save_count;
  const qmat_run_port *wants; /* values that qmat_run_value returns after the run */
  size_t want_count;
  const qmat_run_given *given;
  size_t given_count;
  bool only_wanted;     /* run only what `saves` and `wants` need; else every output of the graph is made */
  bool no_paths;        /* save only `saves`; outputs with a path in the graph are made as those without one */
  bool foresee;         /* for qmat_run_foresee only: required parameters and output folders may be missing */
  const char *to_node;  /* run only this node and what it needs; NULL: the whole graph */
  qmat_cache *cache;    /* must outlive the run; NULL: none */
  bool force_all;       /* run every node, whatever the cache has */
  const size_t *forced; /* nodes that run whatever the cache has */
  size_t forced_count;
} qmat_run_options;

/* Plans a run: chooses the steps, and refuses whatever can be refused before the first one runs. A node runs once for
 * each format that its files are saved in; every node before it runs once. The graph must outlive the run and must not
 * change. Free `*run` with qmat_run_uninit, also after a failure. QMAT_ERROR_USAGE: missing parameters, broken rules
 * between them, an unknown ending, two outputs with one path, an output path that is an input file or the graph.
 * QMAT_ERROR_IO: an output folder that is missing or not writable. */
qmat_status qmat_run_plan(qmat_context *context, const qmat_graph *graph, const qmat_run_options *options,
                          qmat_run *run);

#endif
