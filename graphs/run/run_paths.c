/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/run/run_paths.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "graphs/cache/cache_key.h"

size_t qmat_folder_length(const char *path) {
  const char *slash = strrchr(path, '/');
  return slash ? (size_t)(slash - path) + 1 : 0;
}

char *qmat_path_beside(const char *path, const char *name) {
  size_t folder = qmat_folder_length(path), length = strlen(name);
  char *beside = qmat_alloc(folder + length + 1, 1);
  if (!beside) return NULL;
  memcpy(beside, path, folder);
  memcpy(beside + folder, name, length + 1);
  return beside;
}

/* The folder of `path`, "." where it has none. The caller frees it with qmat_free. */
static char *folder_of(const char *path) {
  return qmat_path_beside(path, qmat_folder_length(path) > 0 ? "" : ".");
}

void qmat_fold_dots(char *path) {
  size_t length = 0;
  for (const char *part = path; *part;) {
    const size_t size = strcspn(part, "/"), with_slash = size + (part[size] == '/');
    const bool is_up = size == 2 && memcmp(part, "..", 2) == 0;
    if (is_up && length > 0) {
      length--;
      while (length > 0 && path[length - 1] != '/') length--;
    } else if (!is_up && size > 0 && !(size == 1 && *part == '.')) {
      memmove(path + length, part, with_slash);
      length += with_slash;
    }
    part += with_slash;
  }
  path[length] = '\0';
}

/* The length of the deepest folder of a path that exists, with its slash; 0: the working folder. */
static size_t existing_folder(char *path, struct stat *folder) {
  for (size_t length = qmat_folder_length(path); length > 0;) {
    const char kept = path[length];
    path[length] = 0;
    const bool exists = stat(path, folder) == 0;
    path[length] = kept;
    if (exists) return length;
    for (length--; length > 0 && path[length - 1] != '/';) length--;
  }
  if (stat(".", folder) != 0) *folder = (struct stat){0};
  return 0;
}

bool qmat_same_file(const char *a, const char *b) {
  struct stat first, second;
  const bool first_is = stat(a, &first) == 0, second_is = stat(b, &second) == 0;
  if (first_is && second_is) return first.st_dev == second.st_dev && first.st_ino == second.st_ino;
  if (first_is != second_is) return false;
  char *first_path = qmat_strdup(a), *second_path = qmat_strdup(b);
  bool same = first_path && second_path;
  if (same) {
    char *first_rest = first_path + existing_folder(first_path, &first);
    char *second_rest = second_path + existing_folder(second_path, &second);
    qmat_fold_dots(first_rest);
    qmat_fold_dots(second_rest);
    same = first.st_dev == second.st_dev && first.st_ino == second.st_ino && strcmp(first_rest, second_rest) == 0;
  }
  qmat_free(first_path);
  qmat_free(second_path);
  return same;
}

/* Refuses a path that is a file which a node reads with these parameters. */
static qmat_status check_not_read_by(qmat_context *context, const qmat_graph_node *node, const void *params,
                                     const char *what, const char *path) {
  for (size_t row = 0; row < qmat_param_count(node->type); row++) {
    const char *input = qmat_param_input_file(node->type, row, params);
    if (input && qmat_same_file(path, input))
      return qmat_fail(context, QMAT_ERROR_USAGE, "%s '%s' would overwrite the file that node '%s' reads", what, path,
                       node->id);
  }
  return QMAT_OK;
}

static qmat_status check_not_graph(qmat_context *context, const qmat_graph *graph, const char *what, const char *path) {
  if (!graph->is_file || !qmat_same_file(path, graph->file)) return QMAT_OK;
  return qmat_fail(context, QMAT_ERROR_USAGE, "%s '%s' would overwrite the graph file", what, path);
}

qmat_status qmat_run_check_not_input(qmat_context *context, const qmat_run *run, const char *what, const char *path) {
  qmat_status status = check_not_graph(context, run->graph, what, path);
  for (size_t i = 0; i < run->step_count && status == QMAT_OK; i++)
    status = check_not_read_by(context, &run->graph->nodes[run->steps[i].node], run->steps[i].params, what, path);
  return status;
}

qmat_status qmat_graph_check_paths(qmat_context *context, const qmat_graph *graph) {
  for (size_t i = 0; i < graph->output_count; i++) {
    const qmat_graph_output *output = &graph->outputs[i];
    if (!output->path) continue;
    char what[QMAT_GRAPH_NAME_SIZE + 16];
    snprintf(what, sizeof what, "output '%s':", output->name);
    qmat_status status = check_not_graph(context, graph, what, output->path);
    for (size_t node = 0; node < graph->node_count && status == QMAT_OK; node++)
      status = check_not_read_by(context, &graph->nodes[node], graph->nodes[node].params, what, output->path);
    for (size_t k = 0; k < i && status == QMAT_OK; k++)
      if (graph->outputs[k].path && qmat_same_file(output->path, graph->outputs[k].path))
        status = qmat_fail(context, QMAT_ERROR_USAGE, "two outputs have the path '%s'", output->path);
    if (status != QMAT_OK) return qmat_fail_at(context, graph->file, output->path_mark.line, output->path_mark.column);
  }
  return QMAT_OK;
}

/* Whether a file can be made in a folder, and the time that it gets. For root access() allows all, also where a file
 * system has no files to make, such as /proc. */
static bool can_make_file(const char *folder, struct timespec *now) {
  struct stat info;
  char name[4200];
  if (access(folder, W_OK | X_OK) != 0) return false;
  if (snprintf(name, sizeof name, "%s/.qmat-XXXXXX", folder) >= (int)sizeof name) return true; /* writing will tell */
  const int file = mkstemp(name);
  if (file < 0) return false;
  if (fstat(file, &info) == 0) *now = info.st_mtim;
  close(file);
  unlink(name);
  return true;
}

static qmat_status check_can_write(qmat_context *context, const char *path, struct timespec *now) {
  struct stat info;
  struct timespec time;
  clock_gettime(CLOCK_REALTIME, &time);
  qmat_status status = QMAT_OK;
  char *folder = folder_of(path);
  if (!folder) return qmat_fail_memory(context, "output path");
  if (stat(folder, &info) != 0)
    qmat_fail(context, status = QMAT_ERROR_IO, "cannot use the output folder: %s", strerror(errno));
  else if (!S_ISDIR(info.st_mode))
    qmat_fail(context, status = QMAT_ERROR_IO, "the output folder is a file");
  else if (!can_make_file(folder, &time))
    qmat_fail(context, status = QMAT_ERROR_IO, "cannot write to the output folder: %s", strerror(errno));
  else if (stat(path, &info) == 0 && S_ISDIR(info.st_mode))
    qmat_fail(context, status = QMAT_ERROR_IO, "the output path is a folder");
  qmat_free(folder);
  if (now) *now = time;
  return status == QMAT_OK ? status : qmat_fail_at(context, path, 0, 0);
}

qmat_status qmat_run_check_can_write(qmat_context *context, const qmat_run *run, const char *path,
                                     struct timespec *now) {
  if (!run->foreseen) return check_can_write(context, path, now);
  struct stat info;
  char *first = qmat_strdup(path); /* its first missing folder, else the file */
  if (!first) return qmat_fail_memory(context, "output path");
  for (char *slash = first; (slash = strchr(slash + 1, '/'));) {
    *slash = 0;
    if (stat(first, &info) != 0) break;
    *slash = '/';
  }
  const qmat_status status = check_can_write(context, first, now);
  qmat_free(first);
  return status;
}

qmat_status qmat_make_folders(qmat_context *context, const char *path) {
  char *folder = qmat_strdup(path);
  if (!folder) return qmat_fail_memory(context, "output path");
  for (char *slash = folder; (slash = strchr(slash + 1, '/'));) {
    *slash = 0;
    mkdir(folder, 0777);
    *slash = '/';
  }
  qmat_free(folder);
  return QMAT_OK;
}

qmat_status qmat_run_check_path(qmat_context *context, const qmat_run *run, const char *what, const char *path) {
  qmat_status status = qmat_run_check_not_input(context, run, what, path);
  for (size_t i = 0; i < run->file_count && status == QMAT_OK; i++)
    if (qmat_same_file(path, run->files[i].path))
      status = qmat_fail(context, QMAT_ERROR_USAGE, "%s '%s' would overwrite output '%s'", what, path,
                         run->graph->outputs[run->files[i].output].name);
  return status == QMAT_OK ? qmat_run_check_can_write(context, run, path, NULL) : status;
}
