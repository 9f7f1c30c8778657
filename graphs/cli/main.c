/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <locale.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/auxv.h>
#include <unistd.h>

#include "graphs/cli/command.h"
#include "graphs/cli/progress.h"
#include "nodes/nodes.h"

static qmat_status call(qmat_context *context, const char *name, char *const *words, size_t count) {
  const qmat_registry registry = {qmat_nodes, qmat_node_count};
  const qmat_command *command;
  qmat_status status = qmat_command_find(context, name, &command);
  if (status != QMAT_OK) return status;
  qmat_invocation *invocation = qmat_calloc(1, sizeof *invocation);
  if (!invocation) return qmat_fail_memory(context, "options");
  status = qmat_invocation_init(context, command, &registry, invocation);
  if (status == QMAT_OK) status = qmat_invocation_parse(context, invocation, words, count);
  if (status == QMAT_OK) {
    if (invocation->help)
      qmat_command_print_help(invocation);
    else
      status = command->run(context, invocation);
  }
  qmat_streams_close(context, &invocation->streams);
  qmat_invocation_uninit(invocation);
  qmat_free(invocation);
  return status;
}

/* Memory comes from the system in huge pages, and the heap grows by 64 MB for blocks of up to 1 GB. A run needs tens of
 * thousands of pages of 4 kB, and the first touch of each costs a fault: a fifth of the time of a small model. */
static const char memory_settings[] =
    "glibc.malloc.hugetlb=1:glibc.malloc.mmap_threshold=1073741824:glibc.malloc.top_pad=67108864";

/* Libraries read these settings from the environment before `main`, so the program starts itself once more. What the
 * user has set stays as it is. Where the second start fails the program runs without them. */
static void start_with_settings(char **argv) {
  const bool set_memory = !getenv("GLIBC_TUNABLES");
  /* Threads that wait for others give their processor away, GCC's after ten microseconds. Most waits are shorter. */
  const bool set_threads = !getenv("OMP_WAIT_POLICY") && !getenv("GOMP_SPINCOUNT");
  if (!(set_memory || set_threads)) return;
  if (getauxval(AT_SECURE)) return; /* the loader would remove the first again, and each start would start another */
  if (set_memory && setenv("GLIBC_TUNABLES", memory_settings, 1) != 0) return;
  if (set_threads && (setenv("OMP_WAIT_POLICY", "passive", 1) != 0 || setenv("GOMP_SPINCOUNT", "3000", 1) != 0)) return;
  qmat_hold_interrupts(); /* until the next start catches them */
  execv("/proc/self/exe", argv);
}

static bool goes_on(void *user, const char *node_id, const char *node_type, uint64_t done, uint64_t total,
                    const char *unit) {
  (void)user, (void)node_id, (void)node_type, (void)done, (void)total, (void)unit;
  return !qmat_interrupted();
}

int main(int argc, char **argv) {
  start_with_settings(argv);
  /* Only the character set, for the progress bar: numbers are read and written without the locale. */
  setlocale(LC_CTYPE, "");
  qmat_catch_interrupts();
  signal(SIGXFSZ, SIG_IGN); /* a file size limit is then an error of write() and does not kill the program */
  qmat_context context = {.progress = goes_on}; /* of commands that show none */
  const char *name = argc > 1 ? argv[1] : "help";
  if (strcmp(name, "--help") == 0 || strcmp(name, "-h") == 0) name = "help";
  if (strcmp(name, "--version") == 0 || strcmp(name, "-V") == 0) name = "version";
  size_t count = argc > 2 ? (size_t)argc - 2 : 0;
  qmat_status status = call(&context, name, argv + (argc > 2 ? 2 : argc), count);
  if (status == QMAT_OK && argc < 2) status = qmat_fail(&context, QMAT_ERROR_USAGE, "no command is given");
  if ((fflush(stdout) != 0 || ferror(stdout)) && status == QMAT_OK)
    status = qmat_fail(&context, QMAT_ERROR_IO, "cannot write to the standard output");
  if (status != QMAT_OK) {
    qmat_print_error(&context.error);
  }
  qmat_context_uninit(&context);
  return qmat_status_exit_code(status);
}
