/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <string.h>

#include "graphs/cli/command.h"

/* Prints text for roff: hyphens are those of options, and no line starts with a request. */
static void put(const char *text) {
  bool first = true;
  for (; *text; text++) {
    if (first && (*text == '.' || *text == '\'')) fputs("\\&", stdout);
    first = *text == '\n';
    if (first)
      fputs("\n.br\n", stdout);
    else if (*text == '\\')
      fputs("\\e", stdout);
    else if (*text == '-')
      fputs("\\-", stdout);
    else
      putchar(*text);
  }
}

/* ".TP", then a bold tag and its text. */
static void put_row(const char *tag, const char *rest, const char *text) {
  fputs(".TP\n\\fB", stdout);
  put(tag);
  fputs("\\fR", stdout);
  put(rest);
  putchar('\n');
  put(text);
  putchar('\n');
}

static void put_section(const char *title, const char *text) {
  printf(".SH %s\n", title);
  put(text);
  putchar('\n');
}

static void put_option(const qmat_option *option) {
  char tag[64], rest[64] = "";
  if (option->letter)
    snprintf(tag, sizeof tag, "-%c, --%s", option->letter, option->name);
  else
    snprintf(tag, sizeof tag, "--%s", option->name);
  if (option->value)
    snprintf(rest, sizeof rest, "%s%s", strncmp(option->value, "[=", 2) == 0 ? "" : " ", option->value);
  put_row(tag, rest, option->doc);
}

static bool is_of_table(const qmat_option *table, const char *name) {
  for (; table && table->name; table++)
    if (strcmp(table->name, name) == 0) return true;
  return false;
}

static qmat_status put_command(qmat_context *context, const qmat_registry *registry, const qmat_command *command) {
  qmat_invocation *about = qmat_calloc(1, sizeof *about);
  if (!about) return qmat_fail_memory(context, "manual");
  const qmat_status status = qmat_invocation_init(context, command, registry, about);
  fputs(".SS \"", stdout);
  printf("qmat %s", command->name);
  if (*command->arguments) putchar(' ');
  put(command->arguments);
  fputs("\"\n", stdout);
  put(command->doc);
  putchar('\n');
  /* The options of the cache are the same for all commands, and told once. */
  for (size_t i = 0; i < about->option_count; i++)
    if (!is_of_table(command->caching, about->options[i].name)) put_option(&about->options[i]);
  qmat_invocation_uninit(about);
  qmat_free(about);
  return status;
}

static void put_examples(void) {
  static const char *const examples[][2] = {
      {"qmat mat octopus.off -o octopus.glb --epsilon 1%", "Describe a model."},
      {"qmat mat models -o results/ -f glb -f ma", "Describe all models in a folder, in two formats."},
      {"qmat mat - -o -.ma <octopus.off", "Read from the standard input, write to the standard output."},
      {"qmat mat crate.off --colliders -o crate.urdf", "Make colliders."},
      {"qmat graphs lod >mine.yaml", "Copy a built-in graph, to change it."},
      {"qmat run mine.yaml --set model=octopus.off --dry-run", "See what would run, and what the cache has."},
  };
  puts(".SH EXAMPLES");
  for (size_t i = 0; i < sizeof examples / sizeof *examples; i++) put_row(examples[i][0], "", examples[i][1]);
}

static qmat_status run(qmat_context *context, qmat_invocation *invocation) {
  const qmat_registry *registry = &invocation->registry;
  qmat_status status = QMAT_OK;
  printf(".\\\" Written by 'qmat man'.\n.TH QMAT 1 2026-11-30 \"qmat %s\" \"User Commands\"\n", QMAT_VERSION);
  put_section("NAME", "qmat - the medial axis transform of 3D models");
  puts(".SH SYNOPSIS\n.B qmat\n.I COMMAND\n.RI [ ARGUMENTS ]\n.RI [ OPTIONS ]");
  put_section("DESCRIPTION",
              "qmat describes a solid by a few medial spheres, joined by medial cones and slabs. The surface that they "
              "sweep stays within an error that is chosen. Its commands run graphs of nodes; each result is kept in a "
              "cache.");
  puts(".SH COMMANDS");
  for (size_t i = 0; i < qmat_command_count && status == QMAT_OK; i++)
    if (qmat_commands[i]->summary) status = put_command(context, registry, qmat_commands[i]);
  puts(".SH CACHE\nThese options are those of every command that uses the cache.");
  for (const qmat_option *option = qmat_cache_option_rows; option->name; option++) put_option(option);
  puts(".SH NODES\n.B qmat node\n.I NAME\nexplains one of them.");
  for (size_t i = 0; i < registry->count; i++) put_row(registry->nodes[i]->name, "", registry->nodes[i]->summary);
  put_examples();
  put_section("EXIT STATUS", "0 done, 1 a run failed, 2 bad usage or a bad graph, 3 cancelled.");
  puts(".SH ENVIRONMENT");
  put_row("QMAT_CACHE", "", "The folder of the cache; off: no cache.");
  put_row("QMAT_REMOTE_CACHE", "", "The address of a shared cache.");
  put_row("XDG_CACHE_HOME", "", "Without QMAT_CACHE the cache is its folder qmat.");
  put_row("TMPDIR", "", "The folder of temporary files, such as a model from the standard input.");
  put_row("COLUMNS", "", "The width of what is printed.");
  put_row("NO_COLOR", "", "Progress without colours.");
  return status;
}

const qmat_command qmat_command_man = {
    .name = "man",
    .arguments = "",
    .summary = "Print the manual page",
    .doc = "Prints the manual page, for 'man -l'.",
    .run = run,
};
