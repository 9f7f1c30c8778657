/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/cli/command.h"

#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "core/json_text.h"
#include "graphs/built_in.h"
#include "graphs/cli/terminal.h"
#include "graphs/graph_names.h"

const qmat_command *const qmat_commands[] = {
    &qmat_command_mat,        &qmat_command_run,      &qmat_command_batch,   &qmat_command_watch, &qmat_command_why,
    &qmat_command_cache,      &qmat_command_check,    &qmat_command_fmt,     &qmat_command_dot,   &qmat_command_info,
    &qmat_command_extract,    &qmat_command_graphs,   &qmat_command_nodes,   &qmat_command_node,  &qmat_command_man,
    &qmat_command_completion, &qmat_command_complete, &qmat_command_version, &qmat_command_help,
};
const size_t qmat_command_count = sizeof qmat_commands / sizeof *qmat_commands;

qmat_status qmat_command_find(qmat_context *context, const char *name, const qmat_command **command) {
  const char *names[sizeof qmat_commands / sizeof *qmat_commands];
  for (size_t i = 0; i < qmat_command_count; i++) {
    names[i] = qmat_commands[i]->name;
    if (strcmp(names[i], name) == 0) {
      *command = qmat_commands[i];
      return QMAT_OK;
    }
  }
  qmat_fail(context, QMAT_ERROR_USAGE, "there is no command '%s'", qmat_show(name).text);
  return qmat_suggest_nearest(context, name, names, qmat_command_count, "'qmat help' lists them");
}

qmat_status qmat_invocation_add_option(qmat_context *context, qmat_invocation *invocation, qmat_option option) {
  if (invocation->option_count == QMAT_MAX_OPTIONS)
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "there are more than %d options", QMAT_MAX_OPTIONS);
  invocation->options[invocation->option_count++] = option;
  return QMAT_OK;
}

qmat_status qmat_invocation_init(qmat_context *context, const qmat_command *command, const qmat_registry *registry,
                                 qmat_invocation *invocation) {
  *invocation = (qmat_invocation){.command = command, .registry = *registry};
  qmat_status status = command->add_options ? command->add_options(context, invocation) : QMAT_OK;
  const qmat_option *const tables[] = {command->options, command->common, command->caching};
  for (int i = 0; i < 3; i++)
    for (const qmat_option *option = tables[i]; option && option->name && status == QMAT_OK; option++)
      status = qmat_invocation_add_option(context, invocation, *option);
  return status;
}

void qmat_invocation_uninit(qmat_invocation *invocation) {
  qmat_free(invocation->given);
  qmat_free(invocation->arguments);
  qmat_graph_uninit(&invocation->graph);
}

static const qmat_option *find_option(const qmat_invocation *invocation, const char *name, size_t length) {
  for (size_t i = 0; i < invocation->option_count; i++)
    if (strlen(invocation->options[i].name) == length && memcmp(invocation->options[i].name, name, length) == 0)
      return &invocation->options[i];
  return NULL;
}

/* Is it an option of `qmat mat` alone, which other commands set as an input of their graph? */
static bool is_input_of_mat(qmat_context *context, const qmat_registry *registry, const char *name) {
  qmat_graph graph = {0};
  bool found = false;
  if (qmat_graph_read_built_in(context, registry, &qmat_built_in_graphs[0], &graph) == QMAT_OK) {
    const qmat_graph_input *input = qmat_graph_input_called(&graph, name);
    found = input && input != &graph.inputs[0]; /* the first is an argument */
  }
  qmat_graph_uninit(&graph);
  return found;
}

static qmat_status fail_unknown(qmat_context *context, const qmat_invocation *invocation, const char *word,
                                size_t length) {
  char name[64];
  snprintf(name, sizeof name, "%.*s", (int)(length < sizeof name ? length : sizeof name - 1), word);
  const bool is_input = find_option(invocation, "set", 3) && is_input_of_mat(context, &invocation->registry, name);
  qmat_fail(context, QMAT_ERROR_USAGE, "'qmat %s' has no option '--%s'", invocation->command->name,
            qmat_show(name).text);
  if (is_input) return qmat_fail_hint(context, "did you mean '--set %s=...'?", name);
  const char *names[QMAT_MAX_OPTIONS + 1] = {"help"};
  size_t count = 1;
  for (size_t i = 0; i < invocation->option_count; i++) names[count++] = invocation->options[i].name;
  const char *nearest = qmat_nearest_name(name, names, count);
  return nearest ? qmat_fail_hint(context, "did you mean '--%s'?", nearest)
                 : qmat_fail_hint(context, "'qmat help %s' lists them", invocation->command->name);
}

/* Takes one option. Its value may be the next word. */
static qmat_status take_option(qmat_context *context, qmat_invocation *invocation, char *const *words, size_t count,
                               size_t *at) {
  const char *word = words[*at], *value = NULL;
  const qmat_option *option = NULL;
  if (word[1] == '-') {
    const char *equals = strchr(word, '=');
    size_t length = equals ? (size_t)(equals - word) - 2 : strlen(word + 2);
    if (length == 4 && memcmp(word + 2, "help", 4) == 0 && !equals) {
      invocation->help = true;
      return QMAT_OK;
    }
    option = find_option(invocation, word + 2, length);
    if (!option) return fail_unknown(context, invocation, word + 2, length);
    if (equals) value = equals + 1;
  } else {
    if (strcmp(word, "-h") == 0) {
      invocation->help = true;
      return QMAT_OK;
    }
    for (size_t i = 0; i < invocation->option_count; i++)
      if (invocation->options[i].letter && invocation->options[i].letter == word[1]) option = &invocation->options[i];
    if (!option || (!option->value && word[2])) {
      qmat_fail(context, QMAT_ERROR_USAGE, "'qmat %s' has no option '%s'", invocation->command->name,
                qmat_show(word).text);
      return qmat_fail_hint(context, "'qmat help %s' lists them", invocation->command->name);
    }
    if (word[2]) value = word + 2 + (word[2] == '=');
  }
  if (value && !option->value)
    return qmat_fail(context, QMAT_ERROR_USAGE, "option '--%s' takes no value", option->name);
  if (!value && option->value && strncmp(option->value, "[=", 2) != 0) {
    if (*at + 1 >= count)
      return qmat_fail(context, QMAT_ERROR_USAGE, "option '--%s' needs a value: %s", option->name, option->value);
    value = words[++*at];
  }
  invocation->given[invocation->given_count++] = (qmat_given_option){option->name, value ? value : ""};
  return QMAT_OK;
}

qmat_status qmat_invocation_parse(qmat_context *context, qmat_invocation *invocation, char *const *words,
                                  size_t count) {
  const qmat_command *command = invocation->command;
  invocation->given = qmat_calloc(count, sizeof *invocation->given);
  invocation->arguments = qmat_calloc(count, sizeof *invocation->arguments);
  if (!invocation->given || !invocation->arguments) return qmat_fail_memory(context, "options");
  bool only_arguments = false;
  for (size_t i = 0; i < count; i++) {
    if (!only_arguments && strcmp(words[i], "--") == 0) {
      only_arguments = true;
    } else if (!only_arguments && words[i][0] == '-' && words[i][1]) {
      qmat_status status = take_option(context, invocation, words, count, &i);
      if (status != QMAT_OK) return status;
    } else {
      invocation->arguments[invocation->argument_count++] = words[i];
    }
  }
  if (invocation->help) return QMAT_OK;
  if (invocation->argument_count > command->most) {
    qmat_fail(context, QMAT_ERROR_USAGE, "'%s' is one argument too many",
              qmat_show(invocation->arguments[command->most]).text);
    return qmat_fail_hint(context, "qmat %s %s", command->name, command->arguments);
  }
  if (invocation->argument_count < command->least) {
    qmat_fail(context, QMAT_ERROR_USAGE, "'qmat %s' needs more arguments", command->name);
    return qmat_fail_hint(context, "qmat %s %s", command->name, command->arguments);
  }
  return QMAT_OK;
}

const char *qmat_invocation_value(const qmat_invocation *invocation, const char *option) {
  for (size_t i = invocation->given_count; i-- > 0;)
    if (strcmp(invocation->given[i].name, option) == 0) return invocation->given[i].value;
  return NULL;
}

bool qmat_invocation_chooses(const qmat_invocation *invocation, const char *option, const char *other) {
  for (size_t i = invocation->given_count; i-- > 0;) {
    if (strcmp(invocation->given[i].name, option) == 0) return true;
    if (strcmp(invocation->given[i].name, other) == 0) return false;
  }
  return false;
}

qmat_status qmat_invocation_number(qmat_context *context, const qmat_invocation *invocation, const char *option,
                                   int least, int most, int *number) {
  const char *text = qmat_invocation_value(invocation, option);
  double value = 0;
  if (!text) return QMAT_OK;
  if (!qmat_parse_number(text, &value) || strchr(text, '%') || value < least || value > most ||
      value != (double)(int)value) {
    char field[64];
    snprintf(field, sizeof field, "--%s", option);
    qmat_fail(context, QMAT_ERROR_USAGE, "expected a whole number from %d to %d, found '%s'", least, most,
              qmat_show(text).text);
    return qmat_fail_field(context, field);
  }
  *number = (int)value;
  return QMAT_OK;
}

/* ---- help ---- */

static int help_width(void) {
  const int width = qmat_terminal_width(stdout);
  return width < 80 ? width : 80;
}

void qmat_print_wrapped(const char *text, int column, int indent) {
  qmat_put_wrapped(stdout, text, column, indent, help_width(), false);
}

void qmat_print_error(const qmat_error *error) {
  char line[2048];
  qmat_error_format(error, line, sizeof line);
  fputs("qmat: ", stderr);
  qmat_put_wrapped(stderr, line, 6, 2, isatty(STDERR_FILENO) ? qmat_terminal_width(stderr) : INT_MAX, true);
}

qmat_status qmat_print_json(qmat_context *context, json_t *json) {
  char *text = json ? qmat_json_text(json, JSON_INDENT(2) | JSON_REAL_PRECISION(15), NULL) : NULL;
  json_decref(json);
  if (!text) return qmat_fail_memory(context, "listing");
  printf("%s\n", text);
  qmat_free(text);
  return QMAT_OK;
}

static void print_row(const char *left, const char *text) {
  const int indent = help_width() < 70 ? 8 : 26;
  int length = printf("  %s", left);
  if (length > indent - 2) {
    printf("\n%*s", indent, "");
  } else {
    printf("%*s", indent - length, "");
  }
  qmat_print_wrapped(text, indent, indent);
}

void qmat_command_print_help(const qmat_invocation *invocation) {
  const qmat_command *command = invocation->command;
  printf("qmat %s%s%s%s\n\n", command->name, *command->arguments ? " " : "", command->arguments,
         invocation->option_count ? " [OPTIONS]" : "");
  qmat_print_wrapped(command->doc, 0, 0);
  printf("\nOptions:\n");
  for (size_t i = 0; i < invocation->option_count; i++) {
    const qmat_option *option = &invocation->options[i];
    char left[96], letter[8] = "";
    if (option->letter) snprintf(letter, sizeof letter, "-%c, ", option->letter);
    const char *value = option->value ? option->value : "";
    snprintf(left, sizeof left, "%s--%s%s%s", letter, option->name, *value && strncmp(value, "[=", 2) != 0 ? " " : "",
             value);
    print_row(left, option->doc);
  }
  print_row("-h, --help", "Print this help");
}

void qmat_commands_print(void) {
  printf("qmat COMMAND [ARGUMENTS] [OPTIONS]\n\nThe medial axis transform of 3D models, for asset pipelines.\n\n");
  for (size_t i = 0; i < qmat_command_count; i++)
    if (qmat_commands[i]->summary) print_row(qmat_commands[i]->name, qmat_commands[i]->summary);
  putchar('\n');
  qmat_print_wrapped("'qmat help COMMAND' explains a command.", 0, 0);
  qmat_print_wrapped("Exit codes: 0 done, 1 a run failed, 2 bad usage or a bad graph, 3 cancelled.", 0, 0);
}
