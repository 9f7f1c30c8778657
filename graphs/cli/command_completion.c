/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "graphs/built_in.h"
#include "graphs/cli/command.h"
#include "graphs/graph_file.h"
#include "graphs/graph_names.h"

/* ---- what may come next ---- */

/* The word that is completed. */
typedef struct completion {
  qmat_context *context;
  const qmat_registry *registry;
  const char *word;   /* its beginning */
  const char *prefix; /* of each candidate: "--set=" where `word` follows it */
} completion;

/* Prints a candidate that continues the word. A last '=' asks for a value. */
__attribute__((format(printf, 2, 3))) static void offer(const completion *c, const char *format, ...) {
  char text[256];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  if (strncmp(text, c->word, strlen(c->word)) == 0) printf("%s%s\n", c->prefix, text);
}

static void offer_choices(const completion *c, const char *before, const qmat_param *param) {
  static const char *const truth[] = {"true", "false", NULL};
  const char *const *choices = param->type == QMAT_PARAM_BOOL ? truth : param->choices;
  for (int i = 0; choices && choices[i]; i++) offer(c, "%s%s", before, choices[i]);
}

/* Offers "input=" and "node.parameter=", or the values of the one that is there. */
static void offer_assignments(const completion *c, const qmat_graph *graph) {
  const char *equals = strchr(c->word, '=');
  char name[2 * QMAT_GRAPH_NAME_SIZE + 2];
  for (size_t i = 0; i < graph->input_count && !equals; i++) offer(c, "%s=", graph->inputs[i].name);
  for (size_t i = 0; i < graph->node_count && !equals; i++)
    for (size_t row = 0; row < qmat_param_count(graph->nodes[i].type); row++)
      offer(c, "%s.%s=", graph->nodes[i].id, graph->nodes[i].type->params[row].name);
  if (!equals || equals - c->word >= (ptrdiff_t)sizeof name - 1) return;
  snprintf(name, sizeof name, "%.*s", (int)(equals - c->word), c->word);
  qmat_graph_param single;
  const qmat_graph_param *params;
  size_t count = 0;
  if (qmat_graph_find_params(c->context, graph, name, &single, &params, &count) != QMAT_OK || count == 0) return;
  snprintf(name, sizeof name, "%.*s", (int)(equals - c->word) + 1, c->word);
  offer_choices(c, name, &graph->nodes[params[0].node].type->params[params[0].param]);
}

/* The graph that the words are about: a file or a built-in one among the arguments, else that of `qmat mat`. */
static qmat_status find_graph(const completion *c, char *const *words, size_t count, qmat_graph *graph) {
  static const char *const of_colliders[] = {"--colliders", "--kind", "--fit", NULL};
  const char *chosen = "qmat_plus";
  for (size_t i = 0; i < count; i++) {
    const size_t length = strlen(words[i]);
    for (const char *const *only = of_colliders; *only; only++)
      if (strcmp(words[i], *only) == 0) chosen = "colliders";
    if (qmat_built_in_graph_find(words[i]) || (length > 5 && strcmp(words[i] + length - 5, ".yaml") == 0))
      chosen = words[i];
  }
  if (qmat_graph_read_file(c->context, c->registry, chosen, graph) == QMAT_OK) return QMAT_OK;
  const qmat_built_in_graph *built_in = qmat_built_in_graph_find(chosen);
  return built_in ? qmat_graph_read_built_in(c->context, c->registry, built_in, graph) : QMAT_ERROR_USAGE;
}

static void offer_value(const completion *c, const char *option, char *const *words, size_t count) {
  static const char *const words_of[][5] = {{"progress", "tty", "json", "off"}, {"engine", "local", "slurm"}};
  for (size_t i = 0; i < sizeof words_of / sizeof *words_of; i++)
    for (size_t k = 1; strcmp(option, words_of[i][0]) == 0 && k < 5 && words_of[i][k]; k++)
      offer(c, "%s", words_of[i][k]);
  qmat_graph graph = {0};
  if (find_graph(c, words, count, &graph) != QMAT_OK) return;
  if (strcmp(option, "set") == 0) offer_assignments(c, &graph);
  const bool is_node = strcmp(option, "to") == 0 || strcmp(option, "force") == 0;
  for (size_t i = 0; is_node && i < graph.node_count; i++) offer(c, "%s", graph.nodes[i].id);
  const qmat_graph_input *input = qmat_graph_input_called(&graph, option);
  if (input) offer_choices(c, "", &graph.nodes[input->params[0].node].type->params[input->params[0].param]);
  for (size_t i = 0; strcmp(option, "format") == 0 && i < graph.output_count; i++) {
    const qmat_param *format = qmat_output_format_param(graph.nodes[graph.outputs[i].node].type);
    if (format) offer_choices(c, "", format);
  }
  qmat_graph_uninit(&graph);
}

static void offer_argument(const completion *c, const qmat_command *command) {
  static const char *const shells[] = {"bash", "zsh", "fish"}, *const actions[] = {"stats",  "ls", "show",
                                                                                   "verify", "gc", "clear"};
  for (size_t i = 0; command == &qmat_command_completion && i < 3; i++) offer(c, "%s", shells[i]);
  for (size_t i = 0; command == &qmat_command_cache && i < 6; i++) offer(c, "%s", actions[i]);
  for (size_t i = 0; command == &qmat_command_help && i < qmat_command_count; i++)
    if (qmat_commands[i]->summary) offer(c, "%s", qmat_commands[i]->name);
  for (size_t i = 0; command == &qmat_command_node && i < c->registry->count; i++)
    offer(c, "%s", c->registry->nodes[i]->name);
  const bool takes_graph =
      strncmp(command->arguments, "GRAPH", 5) == 0 || strncmp(command->arguments, "[GRAPH]", 7) == 0;
  /* Files come first: nothing is offered until a letter says that none of them is meant. */
  for (size_t i = 0; i < qmat_built_in_graph_count; i++)
    if (command == &qmat_command_graphs || (takes_graph && *c->word)) offer(c, "%s", qmat_built_in_graphs[i].name);
}

/* Prints what may stand for the last word, one candidate a line; nothing where a file may. */
static void offer_next(completion *c, const qmat_invocation *about, char *const *words, size_t count) {
  const char *last = words[count - 1], *equals = strchr(last, '=');
  const qmat_option *option = NULL;
  char prefix[64];
  for (size_t i = 0; i < about->option_count; i++) {
    const qmat_option *row = &about->options[i];
    const char *before = count > 1 ? words[count - 2] : "";
    const bool is_value = row->value && *row->value != '[' && strcmp(row->name, "output") != 0;
    const bool letter = before[0] == '-' && before[1] == row->letter && row->letter && !before[2];
    if (is_value && (letter || (strncmp(before, "--", 2) == 0 && strcmp(before + 2, row->name) == 0))) option = row;
    if (row->value && equals && strncmp(last, "--", 2) == 0 && strlen(row->name) == (size_t)(equals - last) - 2 &&
        strncmp(last + 2, row->name, strlen(row->name)) == 0) {
      option = row;
      snprintf(prefix, sizeof prefix, "%.*s", (int)(equals - last) + 1, last);
      c->prefix = prefix;
      c->word = equals + 1;
    }
  }
  if (option) {
    offer_value(c, option->name, words, count - 1);
  } else if (*last == '-') {
    for (size_t i = 0; i < about->option_count; i++) offer(c, "--%s", about->options[i].name);
    offer(c, "--help");
  } else {
    offer_argument(c, about->command);
  }
}

static qmat_status run_complete(qmat_context *context, qmat_invocation *invocation) {
  char *const *words = (char *const *)invocation->arguments;
  const size_t count = invocation->argument_count;
  completion c = {context, &invocation->registry, words[count - 1], ""};
  for (size_t i = 0; i < qmat_command_count; i++) {
    if (!qmat_commands[i]->summary) continue;
    if (count == 1) offer(&c, "%s", qmat_commands[i]->name);
    if (count == 1 || strcmp(words[0], qmat_commands[i]->name) != 0) continue;
    qmat_invocation *about = qmat_calloc(1, sizeof *about);
    if (!about) return qmat_fail_memory(context, "options");
    const qmat_status status = qmat_invocation_init(context, qmat_commands[i], &invocation->registry, about);
    if (status == QMAT_OK) offer_next(&c, about, words + 1, count - 1);
    qmat_invocation_uninit(about);
    qmat_free(about);
    return status;
  }
  return QMAT_OK;
}

const qmat_command qmat_command_complete = {
    .name = "complete",
    .arguments = "-- WORD...",
    .doc = "Prints what may stand for the last of the words after 'qmat'. The scripts of 'qmat completion' call it.",
    .least = 1,
    .most = SIZE_MAX,
    .run = run_complete,
};

/* ---- the scripts ---- */

/* Bash splits words at '=', so the line is split here; what it will replace starts after the last '='. */
static const char bash_script[] =
    "_qmat() {\n"
    "  local line=${COMP_LINE:0:COMP_POINT} cur words\n"
    "  read -ra words <<<\"$line\"\n"
    "  [[ $line == *[[:space:]] ]] && words+=('')\n"
    "  mapfile -t COMPREPLY < <(\"${words[0]}\" complete -- \"${words[@]:1}\" 2>/dev/null)\n"
    "  [[ ${COMPREPLY[0]} == *= ]] && compopt -o nospace\n"
    "  cur=${words[-1]}\n"
    "  if [[ $cur == *=* && $COMP_WORDBREAKS == *=* ]]; then COMPREPLY=(\"${COMPREPLY[@]#\"${cur%=*}=\"}\"); fi\n"
    "}\n"
    "complete -o bashdefault -o default -F _qmat qmat\n";

static const char zsh_script[] =
    "#compdef qmat\n"
    "_qmat() {\n"
    "  local -a found\n"
    "  found=(${(f)\"$(${words[1]} complete -- \"${(@)words[2,CURRENT]}\" 2>/dev/null)\"})\n"
    "  if (( ! $#found )); then _files; return; fi\n"
    "  compadd -S '' -- ${(M)found:#*=}\n"
    "  compadd -- ${found:#*=}\n"
    "}\n"
    "if [ \"$funcstack[1]\" = _qmat ]; then _qmat \"$@\"; else compdef _qmat qmat; fi\n";

static const char fish_script[] =
    "function __qmat_complete\n"
    "  set -l words (commandline -opc)\n"
    "  set -l found ($words[1] complete -- $words[2..-1] (commandline -ct) 2>/dev/null)\n"
    "  if test (count $found) -gt 0\n"
    "    printf '%s\\n' $found\n"
    "  else\n"
    "    __fish_complete_path (commandline -ct)\n"
    "  end\n"
    "end\n"
    "complete -c qmat -f -a '(__qmat_complete)'\n";

static qmat_status run(qmat_context *context, qmat_invocation *invocation) {
  static const char *const shells[] = {"bash", "zsh", "fish"}, *const scripts[] = {bash_script, zsh_script,
                                                                                   fish_script};
  const char *shell = invocation->arguments[0];
  for (int i = 0; i < 3; i++) {
    if (strcmp(shell, shells[i]) != 0) continue;
    fputs(scripts[i], stdout);
    return QMAT_OK;
  }
  qmat_fail(context, QMAT_ERROR_USAGE, "there are no completions for '%s'", qmat_show(shell).text);
  return qmat_suggest_nearest(context, shell, shells, 3, "bash, zsh or fish");
}

const qmat_command qmat_command_completion = {
    .name = "completion",
    .arguments = "SHELL",
    .summary = "Print the completions of a shell: bash, zsh or fish",
    .doc =
        "Prints a script that makes a shell complete commands, options, parameters of the graph and their values. It "
        "is "
        "installed with the program; without: 'source <(qmat completion bash)'.",
    .least = 1,
    .most = 1,
    .run = run,
};
