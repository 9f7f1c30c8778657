/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_H
#define QMAT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* qmat: the medial axis transform of 3D models. This is the library's one public header.
 *
 * A job is a graph of nodes, what is set and wanted of it, and what came of it:
 *
 *     qmat_job *job;
 *     int result = qmat_job_new(&job);                             the built-in graph, the one of `qmat mat`
 *     if (!result) result = qmat_job_set(job, "model=octopus.off");
 *     if (!result) result = qmat_job_set(job, "epsilon=1%");
 *     if (!result) result = qmat_job_save(job, "asset", "octopus.glb");
 *     if (!result) result = qmat_job_run(job, 0, NULL, NULL);
 *     if (result) puts(qmat_job_error(job)->text);
 *     qmat_job_free(job);
 *
 * Functions that can fail return a qmat_result; what went wrong is then in qmat_job_error. Positions are in the units
 * of the model. Texts are UTF-8 and are copied; numbers in texts are read without the locale. There is no global state:
 * different jobs may be used by different threads at the same time, one job by one thread at a time. */

#if defined(__GNUC__)
#define QMAT_API __attribute__((visibility("default")))
#else
#define QMAT_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* What a call came to; the exit codes of the command line are the same numbers. */
typedef enum qmat_result {
  QMAT_RESULT_OK = 0,
  QMAT_RESULT_FAILED = 1,   /* a file, a model, memory, or a library beneath */
  QMAT_RESULT_USAGE = 2,    /* a bad graph, name, value or order of calls */
  QMAT_RESULT_CANCELLED = 3 /* the progress function asked to stop */
} qmat_result;

typedef struct qmat_job qmat_job;

/* The library's version, "0.1.0". Never NULL; not freed. */
QMAT_API const char *qmat_version(void);

/* All node types with their ports and parameters, as JSON: what `qmat nodes --json` prints. NULL when memory is short;
 * free with qmat_text_free. */
QMAT_API char *qmat_nodes_json(void);
/* Frees a text that a function of this header has made; NULL is allowed. */
QMAT_API void qmat_text_free(char *text);

/* ---- making a job ---- */

/* A job of the built-in graph, graphs/qmat_plus.yaml: nodes model, thickness, samples, initial, simple, errors, skin,
 * asset; inputs model, epsilon, vertices; output asset. `*job` is NULL only when memory is short; after any other
 * failure it holds the error. Free it with qmat_job_free. */
QMAT_API qmat_result qmat_job_new(qmat_job **job);
/* The same of a graph file; its relative paths are relative to its folder. */
QMAT_API qmat_result qmat_job_new_from_file(qmat_job **job, const char *path);
/* The same of `size` bytes of graph text, YAML or JSON; its relative paths are relative to the working folder. */
QMAT_API qmat_result qmat_job_new_from_text(qmat_job **job, const char *text, size_t size);
/* Frees a job and everything that it has given out; NULL is allowed. */
QMAT_API void qmat_job_free(qmat_job *job);

/* ---- what to do ---- */

/* Sets a parameter: "node.parameter=value", or "input=value" with the name of an input of the graph. Lengths are
 * fractions of the bounding-box diagonal; "1%" is 0.01. */
QMAT_API qmat_result qmat_job_set(qmat_job *job, const char *assignment);

/* Gives a triangle mesh as the value of an output port ("model.mesh"), in place of what the node would make; the node
 * then does not run, and an output of type scene carries `name` (NULL: "mesh"). `positions` holds 3 * vertex_count
 * doubles x y z, `triangles` 3 * triangle_count indices below vertex_count, counter-clockwise from outside; both are
 * copied. The mesh is treated as one from a file: vertices of equal position are welded, the orientation is made
 * consistent. Cost: linear. */
QMAT_API qmat_result qmat_job_give_mesh(qmat_job *job, const char *port, const char *name, const double *positions,
                                        size_t vertex_count, const uint32_t *triangles, size_t triangle_count);

/* Asks for the value of an output port ("simple.medial"), to be read after the run. When anything is asked for, only
 * what that and the saved outputs need is run; else every output of the graph is made. */
QMAT_API qmat_result qmat_job_want(qmat_job *job, const char *port);

/* Saves an output of the graph ("asset"; NULL: the only one that is a file) as `path` when the run has succeeded. The
 * path's ending chooses the format. May be called again for the same output with another path. */
QMAT_API qmat_result qmat_job_save(qmat_job *job, const char *output, const char *path);

/* Keeps the results of every node in a folder, which is made when it is not there, and takes them from there when they
 * are known: a mesh that is given in memory counts by its content, like one from a file. Any number of jobs, threads
 * and processes may share a folder. NULL: no cache, which is how a job starts. What goes wrong with a cache never fails
 * a run; qmat_job_run_report tells of it ("cache"). QMAT_RESULT_USAGE: the path leads to a file. */
QMAT_API qmat_result qmat_job_cache(qmat_job *job, const char *folder);
/* The folder that the command line uses: $QMAT_CACHE, or qmat in $XDG_CACHE_HOME or ~/.cache; NULL where that is "off"
 * or there is no home. Free with qmat_text_free. */
QMAT_API char *qmat_cache_folder(void);

/* How many nodes of the last run came from the cache, and how many there were. NULL is allowed. */
QMAT_API qmat_result qmat_job_hits(qmat_job *job, size_t *hits, size_t *nodes);

/* ---- running ---- */

/* Hears of the running node: `done` of `total` (0: not known) of `unit`. Returns false to cancel. Called from the
 * thread that runs the job. */
typedef bool (*qmat_job_progress)(void *user, const char *node, const char *type, uint64_t done, uint64_t total,
                                  const char *unit);

/* Runs the job with `threads` threads (0: as many as there are processors). `progress` may be NULL. Nothing is written
 * unless everything succeeds. A job may be changed and run again; what an earlier run gave out is freed then. The
 * results are the same bytes for any number of threads. */
QMAT_API qmat_result qmat_job_run(qmat_job *job, int threads, qmat_job_progress progress, void *user);

/* ---- results ---- */
/* Pointers stay valid until the next run of the job or its end. Each call fails with QMAT_RESULT_USAGE when the port
 * was not asked for before the run, holds another type of value, or holds one for each of several meshes of a glTF
 * scene: "model.mesh=NAME" chooses one of them, "model.mesh=merged" takes them as one. */

/* A medial mesh. */
typedef struct qmat_medial_view {
  size_t sphere_count, edge_count, triangle_count;
  const double *spheres;     /* 4 * sphere_count: x y z radius */
  const uint32_t *edges;     /* 2 * edge_count: medial cones, also those at the rim of slabs */
  const uint32_t *triangles; /* 3 * triangle_count: medial slabs */
} qmat_medial_view;

typedef struct qmat_mesh_view {
  size_t vertex_count, triangle_count;
  const double *positions;   /* 3 * vertex_count: x y z */
  const uint32_t *triangles; /* 3 * triangle_count */
} qmat_mesh_view;

/* A finished file: part 0 is the main one, the others are those that it refers to by their names. */
typedef struct qmat_file_view {
  const char *format; /* "glb" */
  size_t part_count;
} qmat_file_view;

QMAT_API qmat_result qmat_job_medial(qmat_job *job, const char *port, qmat_medial_view *view);
QMAT_API qmat_result qmat_job_mesh(qmat_job *job, const char *port, qmat_mesh_view *view);
QMAT_API qmat_result qmat_job_file(qmat_job *job, const char *port, qmat_file_view *view);
/* Part `part` of that file: its name ("" for part 0) and bytes. */
QMAT_API qmat_result qmat_job_file_part(qmat_job *job, const char *port, size_t part, const char **name,
                                        const uint8_t **bytes, size_t *size);
/* A report as JSON text; free with qmat_text_free. */
QMAT_API qmat_result qmat_job_report(qmat_job *job, const char *port, char **json);
/* What the whole run did, as `qmat run --report` writes it; free with qmat_text_free. */
QMAT_API qmat_result qmat_job_run_report(qmat_job *job, char **json);

/* ---- errors ---- */

/* What went wrong. Texts are never NULL; "" , element -1 and line 0 mean "does not apply". */
typedef struct qmat_job_problem {
  qmat_result result;
  const char *status;       /* "usage", "io", "format", "geometry", "memory", "dependency", "internal", "cancelled" */
  const char *node;         /* the node's id in the graph */
  const char *type;         /* "medial.simplify" */
  const char *field;        /* parameter, port or option */
  const char *element_kind; /* "facet" */
  int64_t element;
  const char *file;
  int line, column; /* from 1 */
  const char *message, *hint;
  const char *text; /* all of it on one line */
} qmat_job_problem;

/* The job's newest failure; its result is QMAT_RESULT_OK when nothing has failed. Valid until the next call on the job.
 * A NULL job tells of a shortage of memory. Never NULL. */
QMAT_API const qmat_job_problem *qmat_job_error(const qmat_job *job);

#ifdef __cplusplus
}
#endif

#endif
