/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_RUN_RUN_PATHS_H
#define QMAT_GRAPHS_RUN_RUN_PATHS_H

#include "graphs/run/run.h"

/* Paths of a run: where they lead, and whether a file may be written there. */

/* The length of the folder in `path`, with its slash; 0: the path has none. */
size_t qmat_folder_length(const char *path);

/* `name` in the folder of the file `path`. NULL when memory is short; free with qmat_free. */
char *qmat_path_beside(const char *path, const char *name);

/* Takes `.` and, with the folder before it, `..` out of a path. One of these at the start goes, too. */
void qmat_fold_dots(char *path);

/* Whether both paths lead to the same file. Neither the file nor its folders need exist. */
bool qmat_same_file(const char *a, const char *b);

/* Refuses a path that is the graph file or a file that a step reads; `what` names it in the error. QMAT_ERROR_USAGE. */
qmat_status qmat_run_check_not_input(qmat_context *context, const qmat_run *run, const char *what, const char *path);

/* Refuses paths of a graph's outputs that no run could save: one that two outputs have, or that is the graph file or a
 * file that a node reads. QMAT_ERROR_USAGE, with its place in the graph file. */
qmat_status qmat_graph_check_paths(qmat_context *context, const qmat_graph *graph);

/* Checks that a file can be written at `path`, so that a long run does not fail at its end. A missing folder is an
 * error. For a run that is only foreseen it may still be made: the first missing one is checked. `*now` (may be NULL)
 * is the time that a file made now in the folder gets. QMAT_ERROR_IO. */
qmat_status qmat_run_check_can_write(qmat_context *context, const qmat_run *run, const char *path,
                                     struct timespec *now);

/* Makes the missing folders of the file `path`. A folder that cannot be made is reported by qmat_run_check_can_write.
 * QMAT_ERROR_MEMORY. */
qmat_status qmat_make_folders(qmat_context *context, const char *path);

/* Both checks; the path may not be one of the run's outputs either. */
qmat_status qmat_run_check_path(qmat_context *context, const qmat_run *run, const char *what, const char *path);

#endif
