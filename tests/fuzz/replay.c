/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fuzz_replay CORPUS: runs every target on its part of the corpus, with any compiler. Inputs that once crashed a reader
 * are kept there. */
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/fuzz/targets.h"

/* Returns whether the file could be read. */
static int replay_file(const fuzz_target *target, const char *path) {
  FILE *file = fopen(path, "rb");
  enum { MOST = 1 << 20 };
  uint8_t *bytes = malloc(MOST);
  if (!file || !bytes) {
    perror(path);
    return 0;
  }
  const size_t size = fread(bytes, 1, MOST, file);
  fclose(file);
  fprintf(stderr, "%s\n", path);
  fuzz_run(target, bytes, size);
  free(bytes);
  return 1;
}

int main(int argc, char **argv) {
  if (argc != 2) {
    fputs("usage: fuzz_replay CORPUS\n", stderr);
    return 2;
  }
  for (size_t i = 0; i < fuzz_target_count; i++) {
    char path[512];
    snprintf(path, sizeof path, "%s/%s", argv[1], fuzz_targets[i].name);
    DIR *folder = opendir(path);
    size_t count = 0;
    for (struct dirent *entry; folder && (entry = readdir(folder));) {
      if (entry->d_name[0] == '.') continue;
      snprintf(path, sizeof path, "%s/%s/%s", argv[1], fuzz_targets[i].name, entry->d_name);
      if (!replay_file(&fuzz_targets[i], path)) return 1;
      count++;
    }
    if (folder) closedir(folder);
    if (count == 0) {
      fprintf(stderr, "fuzz_replay: %s has no corpus in %s\n", fuzz_targets[i].name, argv[1]);
      return 1;
    }
  }
  return 0;
}
