/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_RUN_GRAPH_RUN_H
#define QMAT_GRAPHS_RUN_GRAPH_RUN_H

#include "graphs/cache/cache.h"
#include "graphs/graph_file.h"

/* Running a graph: plan (everything that can be refused is refused here), execute, write. */

/* An output of the graph, and the path that it is saved as. */
typedef struct qmat_run_save {
  size_t output;
  const char *path;
} qmat_run_save;

/* An output port of a node. */
typedef struct qmat_run_port {
  size_t node, port;
} qmat_run_port;

/* A value that stands for what a node would make. */
typedef struct qmat_run_given {
  size_t node, port;
  qmat_value *value; /* sealed, of the port's type */
} qmat_run_given;

/* What to run. The arrays are read by qmat_run_plan only. */
typedef struct qmat_run_options {
  const qmat_run_save *saves; /* instead of the paths that the file gives to these outputs */
  size_t save_count;
  const qmat_run_port *wants; /* values that qmat_run_value gives after the run */
  size_t want_count;
  const qmat_run_given *given;
  size_t given_count;
  bool only_wanted;     /* leave out what neither `saves` nor `wants` needs; else every output of the graph is made */
  const char *to_node;  /* stop there: only this node and what it needs; NULL: the whole graph */
  qmat_cache *cache;    /* where results are looked for and kept; it must outlive the run; NULL: nowhere */
  bool force_all;       /* run every node, whatever the cache has */
  const size_t *forced; /* nodes that run whatever the cache has */
  size_t forced_count;
} qmat_run_options;

/* Where the result of a step comes from. */
typedef enum qmat_step_state {
  QMAT_STEP_RUN,    /* the node runs */
  QMAT_STEP_HIT,    /* from the cache */
  QMAT_STEP_SAME,   /* the node has run and made what was in the cache already */
  QMAT_STEP_DEPENDS /* not run yet: it depends on what nodes before it will make */
} qmat_step_state;

/* "run", "hit", "same", "depends". */
const char *qmat_step_state_name(qmat_step_state state);

/* What is known of a value that a node has made, also after the value is gone. */
typedef struct qmat_run_made {
  qmat_digest digest;
  size_t bytes;
  size_t items;       /* 1; of a list as many as it has */
  uint64_t blob_size; /* of its binary form; 0: it is in no cache */
  size_t counts[3];   /* see qmat_value_counts */
} qmat_run_made;

/* One run of one node. */
typedef struct qmat_run_step {
  size_t node;
  int format;        /* value of its output format parameter; -1: it has none */
  void *params;      /* type->params_size bytes; texts are the graph's */
  size_t *inputs;    /* per input port its slot; SIZE_MAX: not connected */
  size_t first_slot; /* of its output ports */
  bool done;
  bool forced; /* runs whatever the cache has */
  qmat_step_state state;
  bool keyed;            /* the three below are set: there is a cache, and every file that it reads can be read */
  json_t *key_items;     /* what its key is made of */
  qmat_digest key;       /* of all of them */
  qmat_digest first_key; /* of those that are known before it has run: without the files beside its own */
  double seconds;
  qmat_run_made *made;    /* per output port */
  json_t *report;         /* of its first report output, see qmat_report_json; NULL: it makes none */
  size_t lifted;          /* the values of the lists that it ran for, one by one; 0: it ran once, or not at all */
  size_t lifted_hits;     /* for so many of them the cache had the result */
  size_t lifted_left_out; /* for so many of them a node before could not make an input */
  size_t mesh_triangles;  /* of its first mesh input; 0: none */
} qmat_run_step;

/* A value on its way between steps. */
typedef struct qmat_run_slot {
  qmat_value *value;  /* NULL: not made yet, or only its digest is known, or released */
  qmat_digest digest; /* where it is known */
  bool known;
  size_t step;    /* that makes it; SIZE_MAX: it is given */
  size_t readers; /* steps that still read it */
  bool kept;      /* until the run is uninitialised */
} qmat_run_slot;

/* One file that a run writes. */
typedef struct qmat_run_file {
  size_t output, slot;
  char *path;
  size_t bytes;       /* of the main part */
  qmat_digest sha256; /* of the main part's bytes */
} qmat_run_file;

/* One plan, and what came of it. A zeroed run is empty and may be uninitialised. */
typedef struct qmat_run {
  const qmat_graph *graph;
  size_t step_count, slot_count, file_count, given_count;
  qmat_run_step *steps; /* in the order in which they run */
  qmat_run_slot *slots; /* of the steps, then of the given values */
  qmat_run_file *files;
  qmat_run_given *given;               /* given[i] is in slots[slot_count - given_count + i] */
  qmat_cache *cache;                   /* NULL: none */
  bool bypass;                         /* records are not believed: one of them turned out to be wrong */
  struct qmat_run_file_digest *hashed; /* the files that were read, or that keys hold */
  size_t hashed_count, hashed_capacity;
  char name[128]; /* of the first scene that was made or given; else of the graph file */
  double seconds;
} qmat_run;

/* Hears of every step; either function may be NULL. */
typedef struct qmat_run_observer {
  void *user;
  void (*started)(void *user, const qmat_run *run, size_t step);
  void (*done)(void *user, const qmat_run *run, size_t step);
} qmat_run_observer;

/* Plans a run. The graph must outlive it and stay as it is. `*run` is freed with qmat_run_uninit, also after a failure.
 * A node runs once for each format that its files are saved in, everything before it once. QMAT_ERROR_USAGE: missing
 * parameters, broken rules between them, an unknown ending, two outputs with one path, an output path that is one of
 * the input files or the graph. QMAT_ERROR_IO: a path whose folder is not there or cannot be written to. */
qmat_status qmat_run_plan(qmat_context *context, const qmat_graph *graph, const qmat_run_options *options,
                          qmat_run *run);

/* The bytes of `path` before the name of the file: 0, or those of a folder with its slash. */
size_t qmat_folder_length(const char *path);

/* Whether both paths lead to one file, which need not be there yet. */
bool qmat_same_file(const char *a, const char *b);

/* Whether a file of `path` can be written, and may be beside what the run reads and writes; `what` names it in the
 * error. QMAT_ERROR_USAGE, QMAT_ERROR_IO. */
qmat_status qmat_run_check_path(qmat_context *context, const qmat_run *run, const char *what, const char *path);

/* Runs the steps one after another; a value is released when its last reader is done. No output is written. A node that
 * is given lists at inputs which do not take them whole runs once for each of their values, several at the same time
 * (qmat_run_items), and its outputs are lists; each such run has a cache key of its own. A value that the node cannot
 * work on (QMAT_ERROR_GEOMETRY) gives a failure in these lists, which the nodes after it leave out; the run goes on
 * while anything can be made of another value. QMAT_ERROR_USAGE: lists of different lengths. With a cache, a step whose
 * result is known is not run, and its values are loaded only where a node that does run, an output file or a want needs
 * them. Returns the first failing node's status, of a node that runs several times that of the first value in their
 * order; QMAT_CANCELLED when the context's progress function asks to stop. Once per plan. */
qmat_status qmat_run_execute(qmat_context *context, qmat_run *run, const qmat_run_observer *observer);

/* Sets the state of every step as if it were run, without running any. Instead of qmat_run_execute, once per plan. */
void qmat_run_foresee(qmat_run *run);

/* Writes the files of a finished run: those of one folder together, all through temporaries. */
qmat_status qmat_run_write(qmat_context *context, qmat_run *run);

/* A value that was wanted, or NULL. The run owns it. */
const qmat_value *qmat_run_value(const qmat_run *run, size_t node, size_t port);

/* Frees what the run holds. Works on a zeroed and on a failed run. */
void qmat_run_uninit(qmat_run *run);

/* The root of a report; of a list of reports an object whose list "meshes" has an object for each, with its "name" and
 * "report" (or, of a failure, its "failure"), and whose list "warnings" has those of all, where there are any. NULL
 * when memory is short; the caller calls json_decref. */
json_t *qmat_report_json(const qmat_value *report);

/* The names of what a value of this type counts ("spheres", "cones", "slabs"), in the plural, ended by NULL. */
const char *const *qmat_value_count_names(qmat_value_type type);
/* The counts under those names; of a list their sums. */
void qmat_value_counts(const qmat_value *value, size_t counts[3]);

/* In how far the spheres that a step made describe its mesh. Fractions are of the bounding-box diagonal. */
typedef struct qmat_run_summary {
  size_t step;
  uint64_t spheres;
  size_t triangles;                                         /* of the mesh that they describe; 0: not known */
  size_t meshes;                                            /* that they describe, each within its own diagonal */
  size_t failures;                                          /* meshes of the scene that could not be described */
  double epsilon, surface_to_envelope, envelope_to_surface; /* of several meshes the largest */
  bool evaluated; /* by a node that tells whether the errors are certified; the second is then of the boundary */
  bool certified, estimate;
} qmat_run_summary;

/* The summary of the last step that made or read a medial mesh and made a report with the numbers "spheres", "epsilon",
 * "surface_to_envelope" and "envelope_to_surface"; false when there is none. A report with "certified" makes it
 * evaluated. */
bool qmat_run_summarise(const qmat_run *run, qmat_run_summary *summary);

#endif
