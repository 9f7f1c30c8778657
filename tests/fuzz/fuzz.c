/* SPDX-License-Identifier: GPL-3.0-or-later */
/* qmat_fuzz TARGET [OPTION...] [FOLDER...]: libFuzzer on one of the targets. tests/fuzz/run.sh runs them all. */
#include <stdio.h>
#include <stdlib.h>

#include "tests/fuzz/targets.h"

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

static const fuzz_target *target;

/* The target's name goes to the environment, where libFuzzer's own child processes find it. */
int LLVMFuzzerInitialize(int *argc, char ***argv) {
  if (*argc > 1 && fuzz_target_find((*argv)[1])) {
    setenv("QMAT_FUZZ_TARGET", (*argv)[1], 1);
    (*argv)[1] = (*argv)[0];
    (*argv)++;
    (*argc)--;
  }
  const char *name = getenv("QMAT_FUZZ_TARGET");
  target = name ? fuzz_target_find(name) : NULL;
  if (target) return 0;
  fputs("usage: qmat_fuzz TARGET [libFuzzer's options] [FOLDER or FILE...]\ntargets:", stderr);
  for (size_t i = 0; i < fuzz_target_count; i++) fprintf(stderr, " %s", fuzz_targets[i].name);
  fputs("\n", stderr);
  exit(2);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
  fuzz_run(target, bytes, size);
  return 0;
}
