/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CLI_COMMAND_H
#define QMAT_GRAPHS_CLI_COMMAND_H

#include "graphs/cli/standard_streams.h"
#include "graphs/run/run_plan.h"

/* The commands of the command line. Each command is one constant descriptor at the end of its file. Parsing, errors and
 * help come from its table of options. */

/* One option. A table of them ends with a row without a name. */
typedef struct qmat_option {
  const char *name;  /* without the dashes */
  char letter;       /* the short form; 0: none */
  const char *value; /* its value in the help: "PATH", or "[=NODE]" for an optional value; NULL: it takes none */
  const char *doc;   /* one sentence, no full stop */
} qmat_option;

/* An option that was given. */
typedef struct qmat_given_option {
  const char *name, *value;
} qmat_given_option;

enum { QMAT_MAX_OPTIONS = 48, QMAT_OPTION_DOC_SIZE = 768 };

typedef struct qmat_command qmat_command;

/* One call of a command. */
typedef struct qmat_invocation {
  const qmat_command *command;
  qmat_registry registry;
  qmat_option options[QMAT_MAX_OPTIONS]; /* the command's own and shared ones, and those of add_options */
  size_t option_count;
  char docs[QMAT_MAX_OPTIONS][QMAT_OPTION_DOC_SIZE]; /* texts of the options of add_options */
  qmat_given_option *given;                          /* in the order given */
  size_t given_count;
  const char **arguments; /* the words that are not options */
  size_t argument_count;
  bool help;               /* --help was given */
  bool inputs_are_options; /* each input of the graph is an option of its name */
  qmat_graph graph;        /* of commands that work on one */
  qmat_streams streams;    /* the standard input and output, where a path is "-" */
} qmat_invocation;

struct qmat_command {
  const char *name, *arguments, *summary, *doc;  /* without a summary it is in no list */
  const qmat_option *options, *common, *caching; /* its own, and shared tables; NULL: none */
  size_t least, most;                            /* how many arguments it takes */
  /* Adds options that depend on a graph; NULL: none. */
  qmat_status (*add_options)(qmat_context *context, qmat_invocation *invocation);
  qmat_status (*run)(qmat_context *context, qmat_invocation *invocation);
};

extern const qmat_command qmat_command_mat, qmat_command_run, qmat_command_batch, qmat_command_watch, qmat_command_why,
    qmat_command_cache, qmat_command_check, qmat_command_dot, qmat_command_nodes, qmat_command_node,
    qmat_command_version, qmat_command_help, qmat_command_info, qmat_command_extract, qmat_command_graphs,
    qmat_command_fmt, qmat_command_man, qmat_command_completion, qmat_command_complete;

/* All commands, in the order of the help. */
extern const qmat_command *const qmat_commands[];
extern const size_t qmat_command_count;

/* The command of that name; QMAT_ERROR_USAGE suggests the nearest. */
qmat_status qmat_command_find(qmat_context *context, const char *name, const qmat_command **command);

/* Prepares a call: collects the command's options. Free with qmat_invocation_uninit. */
qmat_status qmat_invocation_init(qmat_context *context, const qmat_command *command, const qmat_registry *registry,
                                 qmat_invocation *invocation);
void qmat_invocation_uninit(qmat_invocation *invocation);

/* Adds an option; the texts must outlive the invocation. */
qmat_status qmat_invocation_add_option(qmat_context *context, qmat_invocation *invocation, qmat_option option);

/* Reads the `count` words after the command's name. Options may come before and after arguments; "--" ends them.
 * QMAT_ERROR_USAGE: an unknown option (with the nearest), a missing or superfluous value, too many arguments or,
 * without
 * --help, too few. */
qmat_status qmat_invocation_parse(qmat_context *context, qmat_invocation *invocation, char *const *words, size_t count);

/* The last value given for an option; "" for an option without a value; NULL: the option was not given. */
const char *qmat_invocation_value(const qmat_invocation *invocation, const char *option);

/* Whether an option was given, and not its opposite after it. */
bool qmat_invocation_chooses(const qmat_invocation *invocation, const char *option, const char *other);

/* Prints the help of a command, or the list of commands. */
void qmat_command_print_help(const qmat_invocation *invocation);
void qmat_commands_print(void);

/* Reads a whole number from `least` to `most`. `*number` keeps its value when the option is not given. */
qmat_status qmat_invocation_number(qmat_context *context, const qmat_invocation *invocation, const char *option,
                                   int least, int most, int *number);

/* Prints `text` wrapped at 80 columns, or at the terminal's where it is narrower. The first line starts at column
 * `column`; the others are indented by `indent`. */
void qmat_print_wrapped(const char *text, int column, int indent);

/* Prints an error on stderr, on one line; wrapped where stderr is a terminal. */
void qmat_print_error(const qmat_error *error);

/* Prints JSON, indented, and releases it. NULL: QMAT_ERROR_MEMORY. */
qmat_status qmat_print_json(qmat_context *context, json_t *json);

/* ---- the cache ---- */

extern const qmat_option qmat_cache_option_rows[];

/* Opens the cache that the options and the environment choose; `*open` is false when they choose none. Free `*cache`
 * with qmat_cache_close in any case. QMAT_ERROR_USAGE: a bad size, a path that is not a folder. */
qmat_status qmat_open_cache(qmat_context *context, const qmat_invocation *invocation, qmat_cache *cache, bool *open);

/* A run planned from the command line. */
typedef struct qmat_planned_run {
  qmat_cache cache;
  bool cached; /* `cache` is open */
  qmat_run run;
  qmat_run_save *saves;
  size_t *forced;
} qmat_planned_run;

/* Makes invocation->graph with `prepare`, applies --set, opens the cache and plans the run that the options ask for.
 * With `foresee` the run is only for qmat_run_foresee, and required parameters may be missing. Free `*planned` with
 * qmat_planned_run_uninit in any case. */
qmat_status qmat_plan_invocation(qmat_context *context, qmat_invocation *invocation,
                                 qmat_status (*prepare)(qmat_context *context, qmat_invocation *invocation),
                                 bool foresee, qmat_planned_run *planned);
void qmat_planned_run_uninit(qmat_planned_run *planned);

/* A `prepare` that reads the graph named by the first argument: a file, "-", or a built-in graph. */
qmat_status qmat_read_graph_argument(qmat_context *context, qmat_invocation *invocation);

/* ---- many models ---- */

/* Runs the command once per model, each in a process of its own. `inputs` are models, folders and patterns; `graph` is
 * the argument of `qmat run`, or NULL for `qmat mat` with its options. Results go below the folder `results`. */
qmat_status qmat_run_batch(qmat_context *context, qmat_invocation *invocation, const char *graph,
                           const char *const *inputs, size_t count, const char *results);

/* ---- running ---- */

extern const qmat_option qmat_common_options[], qmat_output_options[];

/* Plans a run as qmat_plan_invocation does, runs it, writes its files and reports, and prints the result. `finished`
 * (may be NULL) is called before the run is freed, also after a failure: the graph or the run may then be empty. */
qmat_status qmat_execute(qmat_context *context, qmat_invocation *invocation,
                         qmat_status (*prepare)(qmat_context *context, qmat_invocation *invocation),
                         void (*finished)(void *user, const qmat_graph *graph, const qmat_run *run), void *user);

#endif
