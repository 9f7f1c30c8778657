/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/built_in.h"

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "graphs/graph_file.h"

extern const char qmat_plus_graph[], colliders_graph[], lod_graph[];
extern const size_t qmat_plus_graph_size, colliders_graph_size, lod_graph_size;

const qmat_built_in_graph qmat_built_in_graphs[] = {
    {"qmat_plus", qmat_plus_graph, &qmat_plus_graph_size},
    {"colliders", colliders_graph, &colliders_graph_size},
    {"lod", lod_graph, &lod_graph_size},
};
const size_t qmat_built_in_graph_count = sizeof qmat_built_in_graphs / sizeof *qmat_built_in_graphs;

const qmat_built_in_graph *qmat_built_in_graph_find(const char *name) {
  for (size_t i = 0; i < qmat_built_in_graph_count; i++) {
    const size_t length = strlen(qmat_built_in_graphs[i].name);
    if (strncmp(name, qmat_built_in_graphs[i].name, length) == 0 &&
        (!name[length] || strcmp(name + length, ".yaml") == 0))
      return &qmat_built_in_graphs[i];
  }
  return NULL;
}

const qmat_built_in_graph *qmat_built_in_graph_named(const char *name) {
  struct stat about;
  const bool is_file = stat(name, &about) == 0 && !S_ISDIR(about.st_mode);
  return is_file ? NULL : qmat_built_in_graph_find(name);
}

qmat_status qmat_graph_read_built_in(qmat_context *context, const qmat_registry *registry,
                                     const qmat_built_in_graph *built_in, qmat_graph *graph) {
  char file[64];
  snprintf(file, sizeof file, "%s.yaml (built in)", built_in->name);
  return qmat_graph_read_text(context, registry, file, built_in->text, *built_in->size, graph);
}
