/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CLI_COMMAND_H
#define QMAT_GRAPHS_CLI_COMMAND_H

#include "graphs/run/run_plan.h"

/* The commands of the command line. Each is one constant descriptor at the foot of its file; parsing, mistakes and help
 * come from its table of options. */

/* One option. A table of them ends with a row without a name. */
typedef struct qmat_option {
  const char *name; /* without the dashes */
  char letter;      /* the short form; 0: none */
  const char
      *value;      /* what help calls its value ("PATH"), or "[=NODE]" where it may be left out; NULL: it takes none */
  const char *doc; /* one sentence, no full stop */
} qmat_option;

/* An option that was given. */
typedef struct qmat_given_option {
  const char *name, *value;
} qmat_given_option;

enum { QMAT_MAX_OPTIONS = 48, QMAT_OPTION_DOC_SIZE = 256 };

typedef struct qmat_command qmat_command;

/* One call of a command. */
typedef struct qmat_invocation {
  const qmat_command *command;
  qmat_registry registry;
  qmat_option options[QMAT_MAX_OPTIONS]; /* the command's, then those that it adds itself */
  size_t option_count;
  char docs[QMAT_MAX_OPTIONS][QMAT_OPTION_DOC_SIZE]; /* for options that are added */
  qmat_given_option *given;                          /* in the order of the command line */
  size_t given_count;
  const char **arguments; /* what is not an option */
  size_t argument_count;
  bool help;        /* --help was given */
  qmat_graph graph; /* of commands that add its inputs as options, or read one */
} qmat_invocation;

struct qmat_command {
  const char *name, *arguments, *summary, *doc;
  const qmat_option *options, *common, *caching; /* its own, and those that it shares; NULL: none */
  size_t least, most;                            /* arguments that are not options */
  /* Adds options that depend on a graph; NULL: none. */
  qmat_status (*add_options)(qmat_context *context, qmat_invocation *invocation);
  qmat_status (*run)(qmat_context *context, qmat_invocation *invocation);
};

extern const qmat_command qmat_command_mat, qmat_command_run, qmat_command_batch, qmat_command_watch, qmat_command_why,
    qmat_command_cache, qmat_command_check, qmat_command_dot, qmat_command_nodes, qmat_command_node,
    qmat_command_version, qmat_command_help, qmat_command_info, qmat_command_extract;

/* All commands, in the order in which help lists them. */
extern const qmat_command *const qmat_commands[];
extern const size_t qmat_command_count;

/* The command of that name; QMAT_ERROR_USAGE suggests the nearest. */
qmat_status qmat_command_find(qmat_context *context, const char *name, const qmat_command **command);

/* Prepares an empty call: the command's options, and those that it adds. Free with qmat_invocation_uninit. */
qmat_status qmat_invocation_init(qmat_context *context, const qmat_command *command, const qmat_registry *registry,
                                 qmat_invocation *invocation);
void qmat_invocation_uninit(qmat_invocation *invocation);

/* Adds an option; the texts must outlive the invocation. */
qmat_status qmat_invocation_add_option(qmat_context *context, qmat_invocation *invocation, qmat_option option);

/* Reads `count` words after the command's name. Options may stand before and after arguments; "--" ends them.
 * QMAT_ERROR_USAGE: an unknown option (with the nearest), a missing or an unwanted value, too many or too few
 * arguments; the latter not with --help. */
qmat_status qmat_invocation_parse(qmat_context *context, qmat_invocation *invocation, char *const *words, size_t count);

/* The last value that was given for an option: NULL when it was not given, "" when it takes no value. */
const char *qmat_invocation_value(const qmat_invocation *invocation, const char *option);

/* Prints the help of a command, or the list of commands. */
void qmat_command_print_help(const qmat_invocation *invocation);
void qmat_commands_print(void);

/* Prints `text` wrapped at 80 columns, with `indent` blanks before every line but the first, which starts at column
 * `column`. */
void qmat_print_wrapped(const char *text, int column, int indent);

/* Prints JSON, indented, to the standard output, and releases it; NULL stands for a shortage of memory. */
qmat_status qmat_print_json(qmat_context *context, json_t *json);

/* ---- what commands that know of the cache share ---- */

extern const qmat_option qmat_cache_option_rows[];

/* Opens the cache that the options and the environment ask for; `*open` is false when they ask for none. Free `*cache`
 * with qmat_cache_close in any case. QMAT_ERROR_USAGE: a size that is none, a path that is no folder. */
qmat_status qmat_open_cache(qmat_context *context, const qmat_invocation *invocation, qmat_cache *cache, bool *open);

/* A run that was planned from the command line. */
typedef struct qmat_planned_run {
  qmat_cache cache;
  bool cached; /* there is a cache */
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

/* A `prepare`: reads the graph file that the first argument names. */
qmat_status qmat_read_graph_argument(qmat_context *context, qmat_invocation *invocation);

/* ---- what `run` and `mat` share ---- */

/* The options that both have, beside their own. */
extern const qmat_option qmat_common_options[];

/* Makes invocation->graph with `prepare`, sets what --set says, runs it, and prints and writes what came of it.
 * `finished` hears of the run before it is freed, also of one that failed, whose graph or run may then be empty; NULL:
 * nobody. */
qmat_status qmat_execute(qmat_context *context, qmat_invocation *invocation,
                         qmat_status (*prepare)(qmat_context *context, qmat_invocation *invocation),
                         void (*finished)(void *user, const qmat_graph *graph, const qmat_run *run), void *user);

#endif
