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

bool qmat_same_file(const char *a, const char *b) {
  struct stat first, second;
  bool first_is = stat(a, &first) == 0, second_is = stat(b, &second) == 0;
  if (first_is && second_is) return first.st_dev == second.st_dev && first.st_ino == second.st_ino;
  if (first_is != second_is || strcmp(a + qmat_folder_length(a), b + qmat_folder_length(b)) != 0) return false;
  char *first_folder = folder_of(a), *second_folder = folder_of(b);
  bool same = first_folder && second_folder && stat(first_folder, &first) == 0 && stat(second_folder, &second) == 0 &&
              first.st_dev == second.st_dev && first.st_ino == second.st_ino;
  qmat_free(first_folder);
  qmat_free(second_folder);
  return same;
}

qmat_status qmat_run_check_not_input(qmat_context *context, const qmat_run *run, const char *what, const char *path) {
  if (run->graph->is_file && qmat_same_file(path, run->graph->file))
    return qmat_fail(context, QMAT_ERROR_USAGE, "%s '%s' would overwrite the graph file", what, path);
  for (size_t i = 0; i < run->step_count; i++) {
    const qmat_graph_node *node = &run->graph->nodes[run->steps[i].node];
    for (size_t row = 0; row < qmat_param_count(node->type); row++) {
      const char *input = qmat_param_input_file(node->type, row, run->steps[i].params);
      if (input && qmat_same_file(path, input)) {
        return qmat_fail(context, QMAT_ERROR_USAGE, "%s '%s' would overwrite the file that node '%s' reads", what, path,
                         node->id);
      }
    }
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
