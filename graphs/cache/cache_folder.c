/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graphs/cache/cache.h"

char *qmat_cache_default_folder(void) {
  const char *base = getenv("XDG_CACHE_HOME"), *below = "/qmat";
  if (!base || *base != '/') {
    base = getenv("HOME");
    below = "/.cache/qmat";
  }
  if (!base || *base != '/') return NULL;
  size_t size = strlen(base) + strlen(below) + 1;
  char *folder = qmat_alloc(size, 1);
  if (folder) snprintf(folder, size, "%s%s", base, below);
  return folder;
}
