/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/cli/command.h"

static qmat_status run(qmat_context *context, qmat_invocation *invocation) {
  if (invocation->argument_count == 0) {
    qmat_commands_print();
    return QMAT_OK;
  }
  const qmat_command *command;
  qmat_status status = qmat_command_find(context, invocation->arguments[0], &command);
  if (status != QMAT_OK) return status;
  qmat_invocation *about = qmat_calloc(1, sizeof *about);
  if (!about) return qmat_fail_memory(context, "help");
  status = qmat_invocation_init(context, command, &invocation->registry, about);
  if (status == QMAT_OK) qmat_command_print_help(about);
  qmat_invocation_uninit(about);
  qmat_free(about);
  return status;
}

const qmat_command qmat_command_help = {
    .name = "help",
    .arguments = "[COMMAND]",
    .summary = "List the commands, or explain one",
    .doc = "Lists the commands, or explains one of them.",
    .most = 1,
    .run = run,
};
