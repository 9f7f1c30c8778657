/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_NODE_H
#define QMAT_CORE_NODE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/value.h"

/* A node is one constant descriptor at the foot of its file. Defaults, parsing, range errors, help, the listing of
 * nodes and the generated tests all come from it. */

typedef enum qmat_param_type {
  QMAT_PARAM_BOOL,   /* bool */
  QMAT_PARAM_INT,    /* int64_t */
  QMAT_PARAM_FLOAT,  /* double */
  QMAT_PARAM_ENUM,   /* int: index into choices */
  QMAT_PARAM_STRING, /* const char * */
  QMAT_PARAM_PATH    /* const char *: relative to the graph file, or to the working folder on the command line */
} qmat_param_type;

enum {
  QMAT_PARAM_REQUIRED = 1,      /* a string or path that has no default */
  QMAT_PARAM_RELATIVE = 2,      /* a length as a fraction of the bounding-box diagonal; "1%" is read as 0.01 */
  QMAT_PARAM_OUTPUT_FORMAT = 4, /* an enum that the ending of an output path sets */
  QMAT_PARAM_INPUT_FILE = 8     /* a path whose bytes the node reads */
};

typedef struct qmat_param {
  const char *name;
  const char *unit; /* "diagonal", "rays", "degrees", "1", "" */
  const char *doc;  /* one line, no full stop */
  qmat_param_type type;
  double default_number;      /* bool 0/1, int, float, enum index */
  const char *default_text;   /* string, path; NULL with QMAT_PARAM_REQUIRED */
  double min, max;            /* inclusive, int and float */
  const char *const *choices; /* NULL-terminated, enum only */
  unsigned flags;
  size_t offset; /* in the node's parameter struct */
} qmat_param;

typedef struct qmat_port {
  const char *name;
  qmat_value_type type;
  bool optional; /* an input that may stay unconnected: the node sees NULL */
  const char *doc;
  /* An output that may be a list of this type; an input that takes a list whole. Where any other input is given a list,
   * the node runs once for each of its values. */
  bool list;
} qmat_port;

/* How an entry of a report enters the summary of a run, and how the reports of several meshes are merged. */
typedef enum qmat_summary_kind {
  QMAT_SUMMARY_SUM,   /* a count: the sum */
  QMAT_SUMMARY_BOUND, /* an upper bound, as a fraction: the largest */
  QMAT_SUMMARY_ALL,   /* a flag: whether all are true; left out unless every report has it */
  QMAT_SUMMARY_ANY,   /* a flag: left out unless it is true in one of them */
  QMAT_SUMMARY_INPUT  /* not in the report: the count of that name (qmat_value_count_rows) of the node's first input
                         that has one; 0 when there is none */
} qmat_summary_kind;

typedef struct qmat_summary_entry {
  const char *key;   /* in the report and in the summary */
  const char *title; /* the column in a table of several runs; NULL: no column */
  qmat_summary_kind kind;
} qmat_summary_entry;

/* What a run that ends with this node comes to. The runner merges the entries and prints the sentence; it does not know
 * what they mean. */
typedef struct qmat_report_summary {
  const qmat_summary_entry *entries; /* ended by an entry without a key. A report without all sums and bounds has no
                                        summary. */
  /* Writes one sentence about `name`. `summary` has the merged entries; of a list of meshes also the counts "meshes",
   * those that have a report, and "failures". `text` holds `size` bytes; always terminated. */
  void (*sentence)(const char *name, const json_t *summary, char *text, size_t size);
} qmat_report_summary;

/* A library beneath whose version may change the bytes that a node makes. */
typedef struct qmat_library {
  const char *name; /* "Embree" */
  /* Writes its version and, where that changes results, the instruction set that it uses. `text` holds `size` bytes;
   * always terminated. */
  void (*describe)(char *text, size_t size);
} qmat_library;

typedef struct qmat_node {
  const char *name;     /* "medial.simplify" */
  uint32_t version;     /* raised whenever the same input may give other bytes */
  const char *summary;  /* one line */
  const char *doc;      /* a few sentences */
  const char *citation; /* paper section and equations, or "" */
  size_t params_size;
  const qmat_param *params;                  /* ended by a row without a name; NULL: none */
  const qmat_port *inputs;                   /* ended by a row without a name; NULL: none */
  const qmat_port *outputs;                  /* ended by a row without a name */
  const qmat_library *const *libraries;      /* those that may change its results, ended by NULL; NULL: none */
  const qmat_report_summary *report_summary; /* of its first report output; NULL: not part of a run's summary */
  /* Rules between parameters; NULL: none. Fails with qmat_fail + qmat_fail_field. */
  qmat_status (*check)(qmat_context *context, const void *params);
  /* Rules for how many values the inputs that take lists whole are given; NULL: none. `counts` has a number for every
   * input, 0 where nothing is given. Fails as `check` does. Asked by qmat_node_run, and by the runner as soon as the
   * counts are known. */
  qmat_status (*check_counts)(qmat_context *context, const void *params, const size_t counts[]);
  /* Makes every output, sealed, one reference each (the caller releases them). On failure no output is set.
   * params and inputs are const; scratch comes from context->arena. */
  qmat_status (*run)(qmat_context *context, const void *params, const qmat_value *const inputs[],
                     qmat_value *outputs[]);
} qmat_node;

/* The number of rows before the one without a name; 0 for NULL. */
size_t qmat_param_count(const qmat_node *node);
size_t qmat_input_count(const qmat_node *node);
size_t qmat_output_count(const qmat_node *node);

/* The parameter, input or output named `name`, or NULL / SIZE_MAX. */
const qmat_param *qmat_param_find(const qmat_node *node, const char *name);
size_t qmat_input_find(const qmat_node *node, const char *name);
size_t qmat_output_find(const qmat_node *node, const char *name);

/* Fills `params` (params_size bytes) with the defaults; required texts become NULL. Strings point into the
 * descriptor. */
void qmat_params_default(const qmat_node *node, void *params);

/* Reads `text` into the parameter, checking type, range and choice; independent of the locale. Strings are not
 * copied: `text` must outlive `params`. QMAT_ERROR_USAGE names the parameter, the range, and the nearest choice. */
qmat_status qmat_param_parse(qmat_context *context, const qmat_node *node, const qmat_param *param, const char *text,
                             void *params);

/* Runs a node whose parameters have been checked. `inputs` and `outputs` hold one pointer per port; outputs start out
 * NULL. What the descriptor promises is looked at on both sides: every input that is not optional is there, every input
 * is sealed and of its port's type, and the lists are as long as the node wants them, else QMAT_ERROR_USAGE names the
 * port and the node does not run; on success every output is sealed and of its port's type, else QMAT_ERROR_INTERNAL;
 * on failure every output is NULL and an error is recorded. Asks the progress function once, with 0 of 0, before it
 * starts. The caller releases the outputs. Scratch memory of the context is freed. */
qmat_status qmat_node_run(qmat_context *context, const qmat_node *node, const void *params,
                          const qmat_value *const inputs[], qmat_value *outputs[]);

/* Required parameters present, every number within its range, and the node's own rules. QMAT_ERROR_USAGE. */
qmat_status qmat_params_check(qmat_context *context, const qmat_node *node, const void *params);

/* Writes the parameter's value as canonical text that qmat_param_parse reads back to the same value. */
void qmat_param_format(const qmat_param *param, const void *params, char *text, size_t size);

#endif
