/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_RUN_RUN_H
#define QMAT_GRAPHS_RUN_RUN_H

#include <time.h>

#include "graphs/cache/cache.h"
#include "graphs/graph.h"

/* A planned run: its steps, the values that pass between them, and the files that it writes. qmat_run_plan makes one,
 * qmat_run_execute runs it. */

/* A value that replaces an output of a node. */
typedef struct qmat_run_given {
  size_t node, port;
  qmat_value *value; /* sealed, of the port's type */
} qmat_run_given;

/* Where the result of a step comes from. */
typedef enum qmat_step_state {
  QMAT_STEP_RUN,    /* the node runs */
  QMAT_STEP_HIT,    /* from the cache */
  QMAT_STEP_SAME,   /* the node ran, and the cache already had its result */
  QMAT_STEP_DEPENDS /* not known before earlier nodes run */
} qmat_step_state;

/* For programs: "run", "hit", "same", "depends". */
const char *qmat_step_state_name(qmat_step_state state);

/* For people: "ran" ("to run" before the run), "from cache", "unchanged", "depends". */
const char *qmat_step_state_words(qmat_step_state state, bool ran);

/* Facts about a value that a node made. They outlive the value. */
typedef struct qmat_run_made {
  qmat_digest digest;
  size_t bytes;
  size_t items;                    /* the length of a list; 1 for any other value */
  uint64_t blob_size;              /* of its serialised form in the cache; 0: it is in no cache */
  size_t counts[QMAT_MOST_COUNTS]; /* see qmat_value_counts */
} qmat_run_made;

/* One run of one node. */
typedef struct qmat_run_step {
  size_t node;
  int format;                /* value of its output format parameter; -1: it has none */
  void *params;              /* type->params_size bytes; texts belong to the graph */
  const qmat_param *missing; /* a required parameter that is not given; NULL: none */
  size_t *inputs;            /* slot per input port; SIZE_MAX: not connected */
  size_t first_slot;         /* of its output ports */
  bool done;
  bool wanted; /* runs whether or not its outputs are read */
  bool forced; /* runs whatever the cache has */
  qmat_step_state state;
  bool keyed;        /* the next two are set: there is a cache, and every input file is readable */
  json_t *key_items; /* what its key is made of */
  qmat_digest key;   /* of all items */
  double seconds;
  qmat_run_made *made;    /* per output port */
  json_t *report;         /* of its first report output, see qmat_report_json; NULL: it makes none */
  size_t lifted;          /* items of the lists that it ran over; 0: it ran once, or not at all */
  size_t lifted_hits;     /* items whose result came from the cache */
  size_t lifted_left_out; /* items that an earlier node failed on */
} qmat_run_step;

/* A value between steps. */
typedef struct qmat_run_slot {
  qmat_value *value;  /* NULL: not made yet, released, or only its digest is known */
  qmat_digest digest; /* valid when `known` */
  bool known;
  size_t step;    /* the step that makes it; SIZE_MAX: it is given */
  size_t readers; /* steps that have not read it yet */
  bool kept;      /* until the run is uninitialised */
} qmat_run_slot;

/* One output that a run saves. */
typedef struct qmat_run_file {
  size_t output, slot;
  char *path;
  bool by_graph;           /* the path is the graph's own: the caller named none for this output */
  size_t bytes;            /* of the main part */
  qmat_digest sha256;      /* of the main part's bytes */
  qmat_file *written;      /* the file to save, with its side files; NULL: not made yet */
  struct timespec planned; /* when the run was planned, by the clock of the file's folder: before any input was read */
} qmat_run_file;

/* A file that a run reads, with its digest at the first reading. A file is hashed once. */
typedef struct qmat_run_file_digest {
  char *path;
  bool readable;
  qmat_digest digest;
} qmat_run_file_digest;

/* One plan and its results. A zeroed run is empty and may be uninitialised. */
typedef struct qmat_run {
  const qmat_graph *graph;
  size_t step_count, slot_count, file_count, given_count;
  qmat_run_step *steps; /* in execution order */
  qmat_run_slot *slots; /* of the steps, then of the given values */
  qmat_run_file *files;
  qmat_run_given *given;        /* given[i] is in slots[slot_count - given_count + i] */
  qmat_cache *cache;            /* NULL: none */
  bool bypass;                  /* ignore the cache's records: one of them was wrong */
  bool foreseen;                /* planned for qmat_run_foresee only: no folder is made */
  qmat_run_file_digest *hashed; /* the files that were read or that keys contain */
  size_t hashed_count, hashed_capacity;
  char name[128]; /* of the first scene that was made or given; else of the graph file */
  double seconds;
} qmat_run;

/* "model: not given (--set model=FILE)" for a step with a missing parameter, else "". Terminated; cut when `size` is
 * short. */
void qmat_step_describe_missing(const qmat_graph *graph, const qmat_run_step *step, char *text, size_t size);

/* The value of an output port, or NULL when it was not kept. The run owns it. */
const qmat_value *qmat_run_value(const qmat_run *run, size_t node, size_t port);

/* Sets how many steps read each slot, as before the first step. */
void qmat_run_count_readers(qmat_run *run);

/* Releases the values that no step reads any more and that are not kept. */
void qmat_run_release_unread(qmat_run *run);

/* Discards all results, so that the run can be executed again. */
void qmat_run_reset(qmat_run *run);

/* Makes a zeroed step a step of `node`: its parameters (NULL: the node's), and arrays for its ports. */
qmat_status qmat_step_init(qmat_context *context, const qmat_graph *graph, size_t node, const void *params, int format,
                           qmat_run_step *step);

/* Frees what a step holds. Works on a zeroed one. */
void qmat_step_uninit(qmat_run_step *step);

/* Frees what the run holds. Works on a zeroed and on a failed run. */
void qmat_run_uninit(qmat_run *run);

/* The root of a report. For a list of reports: an object with the list "meshes", which has one object per report
 * ("name" and "report", or "name" and "failure"), and the list "warnings" of all reports if there are any. NULL when
 * memory is short; the caller calls json_decref. */
json_t *qmat_report_json(const qmat_value *report);

/* Monotonic time in seconds. */
double qmat_clock_seconds(void);

#endif
