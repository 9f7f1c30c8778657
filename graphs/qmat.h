/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_H
#define QMAT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* qmat: the medial axis transform of 3D models. This is the library's only public header.
 *
 * A job is a graph of nodes with its parameters and its results:
 *
 *     qmat_job *job;
 *     int result = qmat_job_new(&job);                             the built-in graph, that of `qmat mat`
 *     if (!result) result = qmat_job_set(job, "model=octopus.off");
 *     if (!result) result = qmat_job_set(job, "epsilon=1%");
 *     if (!result) result = qmat_job_save(job, "asset", "octopus.glb");
 *     if (!result) result = qmat_job_run(job, 0, NULL, NULL);
 *     if (result) puts(qmat_job_error(job)->text);
 *     qmat_job_free(job);
 *
 * Functions that can fail return a qmat_result; qmat_job_error then has the error. Positions are in the units of the
 * model. Texts are UTF-8 and are copied; numbers in texts are read without the locale. There is no global state:
 * different threads may use different jobs at the same time, one thread at a time uses a job. A pointer to a result,
 * and the job itself, must not be NULL. A NULL text or array is QMAT_RESULT_USAGE where nothing says that it may be
 * NULL. */

#if defined(__GNUC__)
#define QMAT_API __attribute__((visibility("default")))
#else
#define QMAT_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* The result of a call. The exit codes of the command line are the same numbers. */
typedef enum qmat_result {
  QMAT_RESULT_OK = 0,
  QMAT_RESULT_FAILED = 1,   /* a file, a model, memory, or a library */
  QMAT_RESULT_USAGE = 2,    /* a wrong graph, name, value or order of calls */
  QMAT_RESULT_CANCELLED = 3 /* by the progress function */
} qmat_result;

typedef struct qmat_job qmat_job;

/* The library's version, "0.3.0". Never NULL; not freed. */
QMAT_API const char *qmat_version(void);

/* All node types with their ports and parameters, as JSON: what `qmat nodes --json` prints. NULL when memory is short;
 * free with qmat_text_free. */
QMAT_API char *qmat_nodes_json(void);
/* Frees a text that this library returned; NULL is allowed. */
QMAT_API void qmat_text_free(char *text);

/* ---- making a job ---- */

/* A job with the built-in graph, graphs/qmat_plus.yaml: nodes model, surface, solid, thickness, samples, initial,
 * refined, features, simple, errors, skin, asset, chain, page, picture; inputs model, epsilon, vertices, features,
 * effort, require; outputs asset, page, picture. `*job` is NULL only when memory is short; after any other failure it
 * has the error. Free it with qmat_job_free. */
QMAT_API qmat_result qmat_job_new(qmat_job **job);
/* The same with a graph file, or where there is none of that name a built-in graph: "qmat_plus", "colliders", "lod".
 * Relative paths of a file are relative to its folder. */
QMAT_API qmat_result qmat_job_new_from_file(qmat_job **job, const char *path);
/* The same with `size` bytes of graph text, YAML or JSON; NULL is an empty text. Its relative paths are relative to the
 * working folder. */
QMAT_API qmat_result qmat_job_new_from_text(qmat_job **job, const char *text, size_t size);
/* Frees a job and everything that it returned; NULL is allowed. */
QMAT_API void qmat_job_free(qmat_job *job);

/* ---- inputs and outputs ---- */

/* Sets a parameter: "node.parameter=value", or "input=value" for an input of the graph. Lengths are fractions of the
 * bounding-box diagonal; "1%" is 0.01. */
QMAT_API qmat_result qmat_job_set(qmat_job *job, const char *assignment);

/* Sets an output port ("model.mesh") to a triangle mesh. Its node then does not run; the node's output of type scene
 * gets the name `name` (NULL: "mesh"). `positions` has 3 * vertex_count doubles x y z, `triangles` 3 * triangle_count
 * indices below vertex_count, counter-clockwise from outside; both are copied. As for a file, vertices at the same
 * position are welded, the orientation is made consistent, and triangles are left out that have fewer than three
 * different vertices, or the same ones as an earlier triangle. Cost: linear. */
QMAT_API qmat_result qmat_job_give_mesh(qmat_job *job, const char *port, const char *name, const double *positions,
                                        size_t vertex_count, const uint32_t *triangles, size_t triangle_count);

/* Sets an output port ("medial.medial" of a medial.read) to a medial mesh: `spheres` has 4 * sphere_count doubles x y z
 * radius, `edges` 2 * edge_count and `triangles` 3 * triangle_count indices below sphere_count; all are copied, and an
 * array of count 0 may be NULL. Edges and triangles are sorted, repeated ones are left out, and missing sides of
 * triangles become edges. Cost: linear. */
QMAT_API qmat_result qmat_job_give_medial(qmat_job *job, const char *port, const double *spheres, size_t sphere_count,
                                          const uint32_t *edges, size_t edge_count, const uint32_t *triangles,
                                          size_t triangle_count);
/* Sets an output port to a result of any type of another job, or of the same one. Nothing is copied; `from` may then be
 * freed, changed or run again. For a list, all of it. */
QMAT_API qmat_result qmat_job_give_result(qmat_job *job, const char *port, const qmat_job *from, const char *from_port);

/* Requests the value of an output port ("simple.medial"), to be read after the run. With requests, only the nodes that
 * they and the outputs of qmat_job_save need run, and nothing is saved at the paths that the graph gives to its
 * outputs; without, every output of the graph is made, and saved where it has a path. */
QMAT_API qmat_result qmat_job_want(qmat_job *job, const char *port);

/* The graph's inputs, nodes and outputs as JSON: {"inputs": ["model"], "nodes": [{"id", "type", "outputs": {"mesh":
 * "mesh"}}], "outputs": [{"name", "port", "type", "on_request", "path"}]}: on_request, it is made only where a run
 * saves it; path, where the graph saves it, or null. Free with qmat_text_free. */
QMAT_API qmat_result qmat_job_graph(qmat_job *job, char **json);

/* Saves an output of the graph ("asset"; NULL: the one that alone has the ending of `path`, else the only one that
 * every run makes) as `path` (NULL, with an output: the path that the graph gives it) after a successful run. Missing
 * folders are made. The path's ending chooses the format. An output may be saved several times under different paths.
 * They hold for every later run. A path that is given again replaces the earlier one. */
QMAT_API qmat_result qmat_job_save(qmat_job *job, const char *output, const char *path);

/* Forgets what was given, requested and saved, for a run with other models or paths. Parameters and the cache stay, and
 * so do the results of the last run. */
QMAT_API void qmat_job_forget(qmat_job *job);

/* Sets the folder of the cache, which is made if it is missing; NULL, the default: no cache. A cached result is used
 * instead of running its node; a mesh in memory counts by its content. Any number of jobs, threads and processes may
 * share a folder. A failure of the cache never fails a run; qmat_job_run_report has it under "cache".
 * QMAT_RESULT_USAGE: the path is a file. qmat_job_run has this result, too, where it has become one meanwhile. */
QMAT_API qmat_result qmat_job_cache(qmat_job *job, const char *folder);
/* The cache folder of the command line: $QMAT_CACHE, $XDG_CACHE_HOME/qmat or ~/.cache/qmat. NULL: $QMAT_CACHE is "off",
 * or there is no home folder. Free with qmat_text_free. */
QMAT_API char *qmat_cache_folder(void);

/* How many nodes of the last run came from the cache, and how many it had. Either pointer may be NULL. */
QMAT_API qmat_result qmat_job_hits(qmat_job *job, size_t *hits, size_t *nodes);

/* ---- running ---- */

/* Called while a node runs: `done` of `total` (0: unknown) of `unit`. Returns false to cancel. Called from the thread
 * that runs the job. */
typedef bool (*qmat_job_progress)(void *user, const char *node, const char *type, uint64_t done, uint64_t total,
                                  const char *unit);

/* Runs the job on `threads` threads (0: one per processor). `progress` may be NULL. Files are written only after every
 * node has succeeded, and get the time at which the run started: what is edited meanwhile is newer. A job may be
 * changed and run again, which frees what the earlier run returned. The results are the same bytes for any number of
 * threads. */
QMAT_API qmat_result qmat_job_run(qmat_job *job, int threads, qmat_job_progress progress, void *user);

/* ---- results ---- */
/* Pointers are valid until the next run or the end of the job. Each call fails with QMAT_RESULT_USAGE when the port was
 * not requested before the run, has another type, or has one value per mesh of a glTF or USD scene. Such a list has
 * items, which a port may name: "simple.medial[0]", which a single value has, too. (Or set "model.mesh=NAME" to choose
 * a mesh, or "model.mesh=merged" to merge them.) An item that could not be made is QMAT_RESULT_FAILED with the reason.
 */

/* What a value is. */
typedef struct qmat_value_view {
  const char *type;   /* "mesh", "field", "samples", "medial", "chain", "report", "file", "scene", "colliders" */
  const char *name;   /* of the mesh in its scene, for an item of a list; else "" */
  size_t item_count;  /* of a list, at least 2; 0: it is no list */
  size_t array_count; /* tables of numbers that it has; 0 for a list, a report and a file */
} qmat_value_view;

/* A table of numbers: rows * columns doubles, or as many indices, row by row. One of the pointers is NULL. */
typedef struct qmat_array_view {
  const char *name; /* "positions", "spheres", "values" */
  size_t rows, columns;
  const double *numbers;
  const uint32_t *ids;
} qmat_array_view;

QMAT_API qmat_result qmat_job_value(qmat_job *job, const char *port, qmat_value_view *view);
/* Table `array` of a value of any type; QMAT_RESULT_USAGE beyond the last. */
QMAT_API qmat_result qmat_job_array(qmat_job *job, const char *port, size_t array, qmat_array_view *view);

/* A medial mesh. */
typedef struct qmat_medial_view {
  size_t sphere_count, edge_count, triangle_count;
  const double *spheres;     /* 4 * sphere_count: x y z radius */
  const uint32_t *edges;     /* 2 * edge_count: medial cones, including the sides of slabs */
  const uint32_t *triangles; /* 3 * triangle_count: medial slabs */
} qmat_medial_view;

typedef struct qmat_mesh_view {
  size_t vertex_count, triangle_count;
  const double *positions;   /* 3 * vertex_count: x y z */
  const uint32_t *triangles; /* 3 * triangle_count */
} qmat_mesh_view;

/* A finished file: part 0 is the main file, the others are its side files. */
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
/* The signed distances of `count` points (3 doubles each) to the envelope of the medial mesh of a port: exact outside
 * of it; negative inside, where the depth is at least as large. Threads are those of the run. Cost: O(log n) a point.
 */
QMAT_API qmat_result qmat_job_distances(qmat_job *job, const char *port, const double *points, size_t count,
                                        double *distances);
/* A report as JSON text; free with qmat_text_free. */
QMAT_API qmat_result qmat_job_report(qmat_job *job, const char *port, char **json);
/* The report of the run, as `qmat run --report` writes it; free with qmat_text_free. */
QMAT_API qmat_result qmat_job_run_report(qmat_job *job, char **json);

/* ---- errors ---- */

/* An error. Texts are never NULL; "", element -1 and line 0 mean "does not apply". */
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
  const char *text; /* the whole error on one line */
} qmat_job_problem;

/* The job's latest error; its result is QMAT_RESULT_OK when nothing has failed. Valid until the next call on the job.
 * For a NULL job: a shortage of memory. Never NULL. */
QMAT_API const qmat_job_problem *qmat_job_error(const qmat_job *job);

#ifdef __cplusplus
}
#endif

#endif
