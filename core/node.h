/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_NODE_H
#define QMAT_CORE_NODE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/value.h"

/* The end of the hint where a length has a unit and the model has none. A runner fits it to its graph. */
#define QMAT_UNIT_ADVICE ", or state the file's unit; qmat mat: --set model.unit=mm"

/* A node is one constant descriptor at the end of its file. Defaults, parsing, range errors, help, the list of nodes
 * and the generated tests are all derived from it. */

typedef enum qmat_param_type {
  QMAT_PARAM_BOOL,   /* bool */
  QMAT_PARAM_INT,    /* int64_t */
  QMAT_PARAM_FLOAT,  /* double */
  QMAT_PARAM_ENUM,   /* int: index into choices */
  QMAT_PARAM_STRING, /* const char * */
  QMAT_PARAM_PATH    /* const char *: relative to the graph file, or on the command line to the working folder */
} qmat_param_type;

enum {
  QMAT_PARAM_REQUIRED = 1,      /* a string or path without a default */
  QMAT_PARAM_RELATIVE = 2,      /* a length: a fraction of the bounding-box diagonal, "1%" is read as 0.01; or "5mm",
                                   which is stored as minus its metres until qmat_node_run makes it a fraction */
  QMAT_PARAM_OUTPUT_FORMAT = 4, /* an enum that is set by the extension of an output path */
  QMAT_PARAM_INPUT_FILE = 8     /* a file that the node reads */
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

/* Rows of a parameter table. `params` is the node's parameter struct; `field` is its member and the parameter's name. A
 * length is a share of the diagonal of the model's bounding box, which may be written "1%", or a length with a unit
 * ("5mm") where the model has one. A node's `run` always gets the share. The default of QMAT_BOOL is no. Rows with
 * other flags are written out. */
#define QMAT_NUMBER(params, field, kind, unit_text, value, least, most, text, set)                                    \
  {                                                                                                                   \
    .name = #field, .unit = unit_text, .doc = text, .type = kind, .default_number = value, .min = least, .max = most, \
    .flags = set, .offset = offsetof(params, field)                                                                   \
  }
#define QMAT_FLOAT(params, field, unit, value, least, most, doc) \
  QMAT_NUMBER(params, field, QMAT_PARAM_FLOAT, unit, value, least, most, doc, 0)
#define QMAT_LENGTH(params, field, value, least, most, doc) \
  QMAT_NUMBER(params, field, QMAT_PARAM_FLOAT, "diagonal", value, least, most, doc, QMAT_PARAM_RELATIVE)
#define QMAT_INT(params, field, unit, value, least, most, doc) \
  QMAT_NUMBER(params, field, QMAT_PARAM_INT, unit, value, least, most, doc, 0)
#define QMAT_ENUM(params, field, choice_names, value, text)                                    \
  {                                                                                            \
    .name = #field, .unit = "", .doc = text, .type = QMAT_PARAM_ENUM, .default_number = value, \
    .choices = choice_names, .offset = offsetof(params, field)                                 \
  }
#define QMAT_BOOL(params, field, text) \
  { .name = #field, .unit = "", .doc = text, .type = QMAT_PARAM_BOOL, .offset = offsetof(params, field) }

typedef struct qmat_port {
  const char *name;
  qmat_value_type type;
  bool optional; /* an input that may be unconnected: the node gets NULL */
  const char *doc;
  /* An output that may be a list of this type, or an input that takes a list as a whole. When any other input is given
   * a list, the node runs once per item. */
  bool list;
  bool on_request; /* an output of a graph that is made only where a run saves it */
  bool decides;    /* an input whose value `reads` needs; it takes no list */
} qmat_port;

/* How an entry of a report enters the summary of a run, and how the reports of several meshes are merged. */
typedef enum qmat_summary_kind {
  QMAT_SUMMARY_SUM,   /* a count: the sum */
  QMAT_SUMMARY_BOUND, /* an upper bound, as a fraction: the largest */
  QMAT_SUMMARY_SIZE,  /* an upper bound that may be missing: the largest; left out unless every report has it */
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
  /* Writes what was made of `name` and, on a second line, how good it is. `summary` has the merged entries; of a list
   * of meshes also the counts "meshes", those that have a report, and "failures". `text` holds `size` bytes; always
   * terminated. */
  void (*sentence)(const char *name, const json_t *summary, char *text, size_t size);
} qmat_report_summary;

/* A library whose version may change the results of a node. */
typedef struct qmat_library {
  const char *name; /* "Embree" */
  /* Writes its version and, if results depend on it, its instruction set. `text` holds `size` bytes; always
   * terminated. */
  void (*describe)(char *text, size_t size);
} qmat_library;

typedef struct qmat_node {
  const char *name;     /* "medial.simplify" */
  uint32_t version;     /* raised whenever the same input may give a different result */
  const char *summary;  /* one line */
  const char *doc;      /* a few sentences */
  const char *citation; /* paper section and equations, or "" */
  size_t params_size;
  const qmat_param *params;                  /* ended by a row without a name; NULL: none */
  const qmat_port *inputs;                   /* ended by a row without a name; NULL: none */
  const qmat_port *outputs;                  /* ended by a row without a name */
  const qmat_library *const *libraries;      /* ended by NULL; NULL: none */
  const qmat_report_summary *report_summary; /* of its first report output; NULL: not part of a run's summary */
  unsigned
      effort; /* its usual share of the time of a run with other nodes, in per cent; 0: little. For progress only */
  /* Checks rules between parameters; NULL: none. Fails with qmat_fail and qmat_fail_field. Lengths with a unit are
   * shares by then, so that the check waits for the node's inputs. */
  qmat_status (*check)(qmat_context *context, const void *params);
  /* Checks the lengths of the lists at inputs that take lists as a whole; NULL: none. `counts` has one number per
   * input, 0 for an unconnected one. Fails like `check`. Called by qmat_node_run, and by the runner as soon as the
   * counts are known. */
  qmat_status (*check_counts)(qmat_context *context, const void *params, const size_t counts[]);
  /* Whether an input is read with these parameters; NULL: each is. One that is not is as if unconnected, and what only
   * it needs does not run. `known` has per input the value of one that decides, once it is made, else NULL; NULL:
   * nothing is made yet. An input that is not read stays so when more is known. */
  bool (*reads)(const void *params, const qmat_value *const *known, size_t input);
  /* Makes every output: sealed, with one reference, which the caller releases. On failure no output is set. Scratch
   * memory comes from context->arena. */
  qmat_status (*run)(qmat_context *context, const void *params, const qmat_value *const inputs[],
                     qmat_value *outputs[]);
} qmat_node;

/* The number of rows, without the end row; 0 for NULL. */
size_t qmat_param_count(const qmat_node *node);
size_t qmat_input_count(const qmat_node *node);
size_t qmat_output_count(const qmat_node *node);

/* The parameter, input or output named `name`, or NULL / SIZE_MAX. */
const qmat_param *qmat_param_find(const qmat_node *node, const char *name);
size_t qmat_input_find(const qmat_node *node, const char *name);
size_t qmat_output_find(const qmat_node *node, const char *name);

/* Fills `params` (params_size bytes) with the defaults; required texts become NULL. Texts point into the descriptor. */
void qmat_params_default(const qmat_node *node, void *params);

/* Parses `text` into the parameter and checks type, range and choice; independent of the locale. Texts are not copied:
 * `text` must outlive `params`. QMAT_ERROR_USAGE names the parameter, the range, and the nearest choice. */
qmat_status qmat_param_parse(qmat_context *context, const qmat_param *param, const char *text, void *params);

/* Ends `run` of a node. Seals `values` (`count`, in the order of its outputs) that are not sealed yet, and hands them
 * over as `outputs`. Where `status` is an error, or sealing fails, it releases them instead (NULL: none) and sets no
 * output. Returns the status. */
qmat_status qmat_hand_over(qmat_context *context, qmat_status status, qmat_value *const values[], size_t count,
                           qmat_value *outputs[]);

/* Runs a node whose parameters have been checked. Lengths with a unit become shares of the diagonal of the first input
 * that is a mesh or a chain; where that has no unit, QMAT_ERROR_USAGE. `inputs` and `outputs` hold one pointer per
 * port. Both are checked against the descriptor. An input that is missing, not sealed or of another type, or a list of
 * a wrong length, is QMAT_ERROR_USAGE; the error names the port and the node does not run. An output that is missing,
 * not sealed or of another type is QMAT_ERROR_INTERNAL. On failure every output is NULL and an error is recorded; on
 * success the caller releases the outputs. Reports progress 0 of 0 before the node starts, so a run can be cancelled
 * between nodes. Frees the context's scratch memory. */
qmat_status qmat_node_run(qmat_context *context, const qmat_node *node, const void *params,
                          const qmat_value *const inputs[], qmat_value *outputs[]);

/* Checks that required parameters are present, that numbers are in range, and the node's own rules. QMAT_ERROR_USAGE.
 */
qmat_status qmat_params_check(qmat_context *context, const qmat_node *node, const void *params);

/* Writes the parameter's value as canonical text, which qmat_param_parse reads back to the same value. */
void qmat_param_format(const qmat_param *param, const void *params, char *text, size_t size);

/* Whether a stored number of the parameter is a length in metres, which is stored negated: "5mm" as -0.005. */
bool qmat_param_in_meters(const qmat_param *param, double value);

#endif
