/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/qmat.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/geometry/envelope.h"
#include "core/geometry/medial_build.h"
#include "core/json_text.h"
#include "graphs/built_in.h"
#include "graphs/graph_file.h"
#include "graphs/graph_names.h"
#include "graphs/graph_params.h"
#include "graphs/node_json.h"
#include "graphs/run/graph_run.h"
#include "graphs/run/run_outputs.h"
#include "graphs/run/run_paths.h"
#include "graphs/run/run_plan.h"
#include "graphs/run/run_report.h"
#include "io/soup.h"
#include "nodes/nodes.h"

enum { PORT_SIZE = 2 * QMAT_GRAPH_NAME_SIZE }; /* of "node.port" with the terminating zero */

typedef struct job_save {
  size_t output;
  char *path;
} job_save;

struct qmat_job {
  qmat_context context;
  qmat_graph graph;
  qmat_run run;
  bool loaded; /* false: the graph could not be read, and every call returns that error */
  bool ran;
  job_save *saves;
  size_t save_count, save_capacity;
  qmat_run_port *wants;
  size_t want_count, want_capacity;
  qmat_run_given *given;
  size_t given_count, given_capacity;
  char *cache_folder; /* NULL: none */
  qmat_cache cache;   /* open during a run */
  char *run_report;   /* of the last run, as JSON; NULL: there is none */
  qmat_job_progress progress;
  void *progress_user;
  qmat_job_problem problem;
  char problem_text[2048];
};

const char *qmat_version(void) {
  return QMAT_VERSION;
}

char *qmat_nodes_json(void) {
  json_t *nodes = qmat_registry_json(&(qmat_registry){qmat_nodes, qmat_node_count});
  char *text = nodes ? qmat_json_text(nodes, JSON_INDENT(2) | JSON_REAL_PRECISION(15), NULL) : NULL;
  json_decref(nodes);
  return text;
}

void qmat_text_free(char *text) {
  qmat_free(text);
}

/* Ends a call: stores its error for qmat_job_error. */
static qmat_result finish(qmat_job *job, qmat_status status) {
  qmat_result result = (qmat_result)qmat_status_exit_code(status);
  if (result == QMAT_RESULT_OK) return result;
  const qmat_error *error = &job->context.error;
  qmat_error_format(error, job->problem_text, sizeof job->problem_text);
  job->problem = (qmat_job_problem){
      .result = result,
      .status = qmat_status_name(error->status),
      .node = error->node_id,
      .type = error->node_type,
      .field = error->field,
      .element_kind = error->element_kind,
      .element = error->element,
      .file = error->file,
      .line = error->line,
      .column = error->column,
      .message = error->message,
      .hint = error->hint,
      .text = job->problem_text,
  };
  return result;
}

/* Refuses a NULL that a call cannot work with. */
static qmat_status expect_given(qmat_context *context, const void *pointer, const char *what) {
  return pointer ? QMAT_OK : qmat_fail(context, QMAT_ERROR_USAGE, "%s is NULL", what);
}

/* The same for an array of `count` elements: an empty one may be NULL. */
static qmat_status expect_array(qmat_context *context, const void *array, size_t count, const char *what) {
  return count > 0 ? expect_given(context, array, what) : QMAT_OK;
}

static const qmat_job_problem no_problem = {QMAT_RESULT_OK, "ok", "", "", "", "", -1, "", 0, 0, "", "", ""};
static const qmat_job_problem no_memory = {
    QMAT_RESULT_FAILED,           "memory", "", "", "", "", -1, "", 0, 0, "not enough memory for a job", "",
    "not enough memory for a job"};

const qmat_job_problem *qmat_job_error(const qmat_job *job) {
  return job ? &job->problem : &no_memory;
}

static qmat_status dump(qmat_context *context, const json_t *root, char **json) {
  *json = root ? qmat_json_text(root, JSON_INDENT(2) | JSON_REAL_PRECISION(15), NULL) : NULL;
  return *json ? QMAT_OK : qmat_fail_memory(context, "report");
}

/* ---- making ---- */

static qmat_job *new_job(void) {
  qmat_job *job = qmat_calloc(1, sizeof *job);
  if (job) job->problem = no_problem;
  return job;
}

/* Ends the making of a job. */
static qmat_result finish_new(qmat_job *job, qmat_status status) {
  job->loaded = status == QMAT_OK;
  return finish(job, status);
}

qmat_result qmat_job_new(qmat_job **job) {
  *job = new_job();
  if (!*job) return QMAT_RESULT_FAILED;
  return finish_new(*job, qmat_graph_read_built_in(&(*job)->context, &(qmat_registry){qmat_nodes, qmat_node_count},
                                                   &qmat_built_in_graphs[0], &(*job)->graph));
}

qmat_result qmat_job_new_from_file(qmat_job **job, const char *path) {
  *job = new_job();
  if (!*job) return QMAT_RESULT_FAILED;
  if (!path) return finish_new(*job, expect_given(&(*job)->context, path, "the path of the graph"));
  const qmat_registry registry = {qmat_nodes, qmat_node_count};
  const qmat_built_in_graph *built_in = qmat_built_in_graph_named(path);
  return finish_new(*job, built_in ? qmat_graph_read_built_in(&(*job)->context, &registry, built_in, &(*job)->graph)
                                   : qmat_graph_read_file(&(*job)->context, &registry, path, &(*job)->graph));
}

qmat_result qmat_job_new_from_text(qmat_job **job, const char *text, size_t size) {
  *job = new_job();
  if (!*job) return QMAT_RESULT_FAILED;
  return finish_new(*job, qmat_graph_read_text(&(*job)->context, &(qmat_registry){qmat_nodes, qmat_node_count}, "graph",
                                               text ? text : "", text ? size : 0, &(*job)->graph));
}

void qmat_job_forget(qmat_job *job) {
  for (size_t i = 0; i < job->save_count; i++) qmat_free(job->saves[i].path);
  for (size_t i = 0; i < job->given_count; i++) qmat_value_release(job->given[i].value);
  job->save_count = job->want_count = job->given_count = 0;
}

void qmat_job_free(qmat_job *job) {
  if (!job) return;
  qmat_run_uninit(&job->run);
  qmat_free(job->cache_folder);
  qmat_free(job->run_report);
  qmat_job_forget(job);
  qmat_free(job->saves);
  qmat_free(job->wants);
  qmat_free(job->given);
  qmat_graph_uninit(&job->graph);
  qmat_context_uninit(&job->context);
  qmat_free(job);
}

/* ---- inputs and outputs ---- */

qmat_result qmat_job_set(qmat_job *job, const char *assignment) {
  if (!job->loaded) return job->problem.result;
  qmat_status status = expect_given(&job->context, assignment, "the assignment");
  if (status == QMAT_OK) status = qmat_graph_assign(&job->context, &job->graph, assignment);
  return finish(job, status);
}

static qmat_status make_mesh(qmat_context *context, const char *name, const double *positions, size_t vertex_count,
                             const uint32_t *triangles, size_t triangle_count, qmat_mesh **mesh) {
  const qmat_read_options options = {.defects = QMAT_DEFECTS_DROP};
  qmat_soup soup = {0};
  *mesh = NULL;
  qmat_status status = QMAT_OK;
  if (triangle_count > UINT32_MAX || vertex_count > UINT32_MAX) status = qmat_fail_memory(context, "the mesh");
  if (status == QMAT_OK) status = qmat_soup_reserve(context, &soup, vertex_count, triangle_count, 3 * triangle_count);
  if (status == QMAT_OK) status = qmat_soup_add_vertices(context, &soup, positions, vertex_count);
  for (size_t i = 0; i < triangle_count && status == QMAT_OK; i++)
    status = qmat_soup_add_facet(context, &soup, triangles + 3 * i, 3, (uint32_t)i, 0);
  if (status == QMAT_OK) status = qmat_soup_to_mesh(context, &soup, name, &options, mesh, NULL);
  qmat_soup_uninit(&soup);
  return status;
}

static qmat_status make_scene(qmat_context *context, const char *name, qmat_scene **scene) {
  *scene = qmat_scene_new();
  if (!*scene) return qmat_fail_memory(context, "the scene");
  (*scene)->name = qmat_strdup(name);
  (*scene)->format = qmat_strdup("memory");
  qmat_status status = (*scene)->name && (*scene)->format ? qmat_value_seal(context, &(*scene)->base)
                                                          : qmat_fail_memory(context, "the scene");
  if (status == QMAT_OK) return status;
  qmat_value_release(&(*scene)->base);
  *scene = NULL;
  return status;
}

/* Sets a port to a value. The job takes the caller's reference. */
static qmat_status give(qmat_job *job, size_t node, size_t port, qmat_value *value) {
  for (size_t i = 0; i < job->given_count; i++)
    if (job->given[i].node == node && job->given[i].port == port) {
      qmat_value_release(job->given[i].value);
      job->given[i].value = value;
      return QMAT_OK;
    }
  if (qmat_grow((void **)&job->given, &job->given_capacity, job->given_count + 1, sizeof *job->given) != 0) {
    qmat_value_release(value);
    return qmat_fail_memory(&job->context, "values");
  }
  job->given[job->given_count++] = (qmat_run_given){node, port, value};
  return QMAT_OK;
}

/* Finds an output port that takes values of this type. */
static qmat_status find_given_port(qmat_job *job, const char *port, qmat_value_type type, size_t *node, size_t *index) {
  qmat_status status = expect_given(&job->context, port, "the port");
  if (status == QMAT_OK) status = qmat_graph_find_port(&job->context, &job->graph, port, node, index);
  if (status != QMAT_OK) return status;
  const qmat_value_type takes = job->graph.nodes[*node].type->outputs[*index].type;
  if (takes == type) return QMAT_OK;
  return qmat_fail(&job->context, QMAT_ERROR_USAGE, "'%s' is %s, not %s", port, qmat_value_type_phrase(takes),
                   qmat_value_type_phrase(type));
}

qmat_result qmat_job_give_mesh(qmat_job *job, const char *port, const char *name, const double *positions,
                               size_t vertex_count, const uint32_t *triangles, size_t triangle_count) {
  if (!job->loaded) return job->problem.result;
  size_t node, index;
  qmat_status status = find_given_port(job, port, QMAT_MESH, &node, &index);
  if (status == QMAT_OK) status = expect_array(&job->context, positions, vertex_count, "positions");
  if (status == QMAT_OK) status = expect_array(&job->context, triangles, triangle_count, "triangles");
  if (status != QMAT_OK) return finish(job, status);
  const qmat_node *type = job->graph.nodes[node].type;
  if (!name || !*name) name = "mesh";
  qmat_mesh *mesh;
  status = make_mesh(&job->context, name, positions, vertex_count, triangles, triangle_count, &mesh);
  if (status == QMAT_OK) status = give(job, node, index, &mesh->base);
  for (size_t i = 0; i < qmat_output_count(type) && status == QMAT_OK; i++) {
    if (type->outputs[i].type != QMAT_SCENE) continue;
    qmat_scene *scene;
    status = make_scene(&job->context, name, &scene);
    if (status == QMAT_OK) status = give(job, node, i, &scene->base);
  }
  return finish(job, status);
}

static qmat_status make_medial(qmat_context *context, const double *spheres, size_t sphere_count, const uint32_t *edges,
                               size_t edge_count, const uint32_t *triangles, size_t triangle_count,
                               qmat_medial **made) {
  qmat_medial *medial = *made = qmat_medial_new();
  if (medial) medial->spheres = qmat_alloc(sphere_count, 4 * sizeof *spheres);
  if (!medial || !medial->spheres) {
    qmat_value_release(medial ? &medial->base : NULL);
    return qmat_fail_memory(context, "the medial mesh");
  }
  if (sphere_count > 0) memcpy(medial->spheres, spheres, 4 * sphere_count * sizeof *spheres);
  medial->sphere_count = sphere_count;
  qmat_status status = qmat_medial_set_simplices(context, medial, edges, edge_count, triangles, triangle_count);
  if (status == QMAT_OK) status = qmat_value_seal(context, &medial->base);
  if (status != QMAT_OK) qmat_value_release(&medial->base);
  return status;
}

qmat_result qmat_job_give_medial(qmat_job *job, const char *port, const double *spheres, size_t sphere_count,
                                 const uint32_t *edges, size_t edge_count, const uint32_t *triangles,
                                 size_t triangle_count) {
  if (!job->loaded) return job->problem.result;
  size_t node, index;
  qmat_medial *medial;
  qmat_status status = find_given_port(job, port, QMAT_MEDIAL, &node, &index);
  if (status == QMAT_OK) status = expect_array(&job->context, spheres, sphere_count, "spheres");
  if (status == QMAT_OK) status = expect_array(&job->context, edges, edge_count, "edges");
  if (status == QMAT_OK) status = expect_array(&job->context, triangles, triangle_count, "triangles");
  if (status == QMAT_OK)
    status = make_medial(&job->context, spheres, sphere_count, edges, edge_count, triangles, triangle_count, &medial);
  if (status == QMAT_OK) status = give(job, node, index, &medial->base);
  return finish(job, status);
}

/* The item that "node.port[7]" names, and its port; SIZE_MAX: none. */
static qmat_status split_item(qmat_context *context, const char *text, char port[PORT_SIZE], size_t *item) {
  const char *bracket = strchr(text, '[');
  const size_t length = bracket ? (size_t)(bracket - text) : strlen(text);
  *item = SIZE_MAX;
  snprintf(port, PORT_SIZE, "%.*s", length < PORT_SIZE ? (int)length : PORT_SIZE, text);
  if (!bracket) return QMAT_OK;
  char *end = NULL;
  errno = 0;
  if (bracket[1] >= '0' && bracket[1] <= '9') *item = strtoull(bracket + 1, &end, 10);
  if (end && strcmp(end, "]") == 0 && errno == 0 && *item != SIZE_MAX) return QMAT_OK;
  return qmat_fail(context, QMAT_ERROR_USAGE, "'%s' is not of the form node.port[item]", qmat_show(text).text);
}

/* The value of a port of a job that ran, of any type. `*name` (may be NULL) is that of an item. */
static qmat_status find_value(qmat_context *context, const qmat_job *job, const char *port, const qmat_value **value,
                              const char **name) {
  size_t node, index, item;
  char plain[PORT_SIZE];
  *value = NULL;
  qmat_status status = expect_given(context, port, "the port");
  if (status != QMAT_OK) return status;
  if (!job->ran) return qmat_fail(context, QMAT_ERROR_USAGE, "the job has no results: run it first");
  status = split_item(context, port, plain, &item);
  if (status == QMAT_OK) status = qmat_graph_find_port(context, &job->graph, plain, &node, &index);
  if (status != QMAT_OK) return status;
  const qmat_value *found = qmat_run_value(&job->run, node, index);
  if (!found) {
    qmat_fail(context, QMAT_ERROR_USAGE, "'%s' was not requested before the run", plain);
    return qmat_fail_hint(context, "qmat_job_want");
  }
  if (item != SIZE_MAX && found->type != QMAT_LIST) {
    if (item > 0) return qmat_fail(context, QMAT_ERROR_USAGE, "'%s' has a single value, without item %zu", plain, item);
  } else if (item != SIZE_MAX) {
    const size_t count = qmat_value_count(found);
    if (item >= count)
      return qmat_fail(context, QMAT_ERROR_USAGE, "'%s' is a list of %zu items, without item %zu", plain, count, item);
    if (name) *name = ((const qmat_list *)found)->names[item];
    found = qmat_value_at(found, item);
    if (found->type == QMAT_FAILURE) {
      qmat_fail(context, QMAT_ERROR_GEOMETRY, "%s", qmat_value_failure(found));
      return qmat_fail_element(context, "item", (int64_t)item);
    }
  }
  *value = found;
  return QMAT_OK;
}

qmat_result qmat_job_give_result(qmat_job *job, const char *port, const qmat_job *from, const char *from_port) {
  if (!job->loaded) return job->problem.result;
  size_t node, index;
  const qmat_value *value;
  qmat_status status = expect_given(&job->context, from, "the other job");
  if (status == QMAT_OK) status = find_value(&job->context, from, from_port, &value, NULL);
  if (status == QMAT_OK) status = find_given_port(job, port, qmat_value_item_type(value), &node, &index);
  if (status == QMAT_OK) status = give(job, node, index, qmat_value_retain(value));
  return finish(job, status);
}

qmat_result qmat_job_want(qmat_job *job, const char *port) {
  if (!job->loaded) return job->problem.result;
  qmat_run_port want;
  qmat_status status = expect_given(&job->context, port, "the port");
  if (status == QMAT_OK) status = qmat_graph_find_port(&job->context, &job->graph, port, &want.node, &want.port);
  if (status == QMAT_OK &&
      qmat_grow((void **)&job->wants, &job->want_capacity, job->want_count + 1, sizeof *job->wants) != 0)
    status = qmat_fail_memory(&job->context, "ports");
  if (status == QMAT_OK) job->wants[job->want_count++] = want;
  return finish(job, status);
}

qmat_result qmat_job_graph(qmat_job *job, char **json) {
  *json = NULL;
  if (!job->loaded) return job->problem.result;
  json_t *graph = qmat_graph_json(&job->graph);
  const qmat_status status = dump(&job->context, graph, json);
  json_decref(graph);
  return finish(job, status);
}

/* Finds the output that alone has the ending of the path, else the only one that is a file. */
static qmat_status only_file(qmat_job *job, const char *path, size_t *output) {
  if (qmat_graph_output_of_ending(&job->graph, path, output)) return QMAT_OK;
  const size_t count = qmat_graph_file_count(&job->graph, output);
  if (count == 1) return QMAT_OK;
  return qmat_fail(&job->context, QMAT_ERROR_USAGE, "the graph makes %zu files: name the output to save", count);
}

qmat_result qmat_job_save(qmat_job *job, const char *output, const char *path) {
  if (!job->loaded) return job->problem.result;
  job_save save = {0};
  int choice;
  qmat_status status = output ? QMAT_OK : expect_given(&job->context, path, "the path");
  if (status == QMAT_OK)
    status = output ? qmat_graph_find_output(&job->context, &job->graph, output, &save.output)
                    : only_file(job, path, &save.output);
  if (status == QMAT_OK && !path) {
    path = job->graph.outputs[save.output].path;
    if (!path)
      status = qmat_fail(&job->context, QMAT_ERROR_USAGE, "the path is NULL, and the graph gives output '%s' none",
                         qmat_show(output).text);
  }
  if (status == QMAT_OK) status = qmat_graph_output_format(&job->context, &job->graph, save.output, path, &choice);
  for (size_t i = 0; i < job->save_count && status == QMAT_OK; i++) {
    if (strcmp(job->saves[i].path, path) != 0) continue;
    job->saves[i].output = save.output;
    return QMAT_RESULT_OK;
  }
  if (status == QMAT_OK) {
    save.path = qmat_strdup(path);
    if (!save.path ||
        qmat_grow((void **)&job->saves, &job->save_capacity, job->save_count + 1, sizeof *job->saves) != 0) {
      qmat_free(save.path);
      status = qmat_fail_memory(&job->context, "paths");
    }
  }
  if (status == QMAT_OK) job->saves[job->save_count++] = save;
  return finish(job, status);
}

qmat_result qmat_job_cache(qmat_job *job, const char *folder) {
  if (!job->loaded) return job->problem.result;
  qmat_cache cache = {0};
  qmat_status status = QMAT_OK;
  char *copy = folder ? qmat_strdup(folder) : NULL;
  if (folder && !*folder)
    status = qmat_fail(&job->context, QMAT_ERROR_USAGE, "the folder of the cache is empty");
  else if (folder && !copy)
    status = qmat_fail_memory(&job->context, "cache");
  else if (folder)
    status = qmat_cache_open(&job->context, &(qmat_cache_options){.folder = folder}, &cache);
  qmat_cache_close(&cache);
  if (status == QMAT_OK) {
    qmat_free(job->cache_folder);
    job->cache_folder = copy;
  } else {
    qmat_free(copy);
  }
  return finish(job, status);
}

char *qmat_cache_folder(void) {
  const char *named = getenv("QMAT_CACHE");
  if (!named) return qmat_cache_default_folder();
  return *named && strcmp(named, "off") != 0 ? qmat_strdup(named) : NULL;
}

qmat_result qmat_job_hits(qmat_job *job, size_t *hits, size_t *nodes) {
  if (!job->loaded) return job->problem.result;
  if (!job->ran) return finish(job, qmat_fail(&job->context, QMAT_ERROR_USAGE, "the job has no results: run it first"));
  size_t count = 0;
  for (size_t i = 0; i < job->run.step_count; i++) count += job->run.steps[i].state == QMAT_STEP_HIT;
  if (hits) *hits = count;
  if (nodes) *nodes = job->run.step_count;
  return QMAT_RESULT_OK;
}

/* ---- running ---- */

static bool forward_progress(void *user, const char *node_id, const char *node_type, uint64_t done, uint64_t total,
                             const char *unit) {
  const qmat_job *job = user;
  return job->progress(job->progress_user, node_id, node_type, done, total, unit);
}

qmat_result qmat_job_run(qmat_job *job, int threads, qmat_job_progress progress, void *user) {
  if (!job->loaded) return job->problem.result;
  qmat_context *context = &job->context;
  qmat_run_uninit(&job->run);
  qmat_free(job->run_report);
  job->run_report = NULL;
  job->ran = false;
  if (threads < 0 || threads > 1024)
    return finish(
        job, qmat_fail(context, QMAT_ERROR_USAGE, "the number of threads has to be from 0 to 1024, not %d", threads));
  qmat_run_save *saves = qmat_calloc(job->save_count, sizeof *saves);
  if (!saves) return finish(job, qmat_fail_memory(context, "paths"));
  for (size_t i = 0; i < job->save_count; i++) saves[i] = (qmat_run_save){job->saves[i].output, job->saves[i].path};
  const qmat_run_options options = {
      .saves = saves,
      .save_count = job->save_count,
      .wants = job->wants,
      .want_count = job->want_count,
      .given = job->given,
      .given_count = job->given_count,
      .only_wanted = job->want_count > 0,
      .cache = job->cache_folder ? &job->cache : NULL,
  };
  job->progress = progress;
  job->progress_user = user;
  context->threads = threads;
  context->progress = progress ? forward_progress : NULL;
  context->progress_user = job;
  qmat_status status = QMAT_OK;
  if (job->cache_folder)
    status = qmat_cache_open(context, &(qmat_cache_options){.folder = job->cache_folder}, &job->cache);
  for (size_t i = 0; i < job->save_count && status == QMAT_OK; i++)
    status = qmat_make_folders(context, job->saves[i].path);
  if (status == QMAT_OK) status = qmat_run_plan(context, &job->graph, &options, &job->run);
  if (status == QMAT_OK) status = qmat_run_execute(context, &job->run, NULL);
  if (status == QMAT_OK) status = qmat_run_make_files(context, &job->run);
  if (status == QMAT_OK) status = qmat_run_write(context, &job->run);
  qmat_cache_trim(&job->cache); /* the report has its warning */
  if (status == QMAT_OK) {      /* now, since it has texts of the graph, which may change */
    json_t *report = qmat_run_report(context, &job->run);
    status = dump(context, report, &job->run_report);
    json_decref(report);
  }
  context->progress = NULL;
  qmat_cache_close(&job->cache);
  qmat_free(saves);
  job->ran = status == QMAT_OK;
  if (status != QMAT_OK) qmat_run_uninit(&job->run);
  return finish(job, status);
}

/* ---- results ---- */

static qmat_status find_single(qmat_job *job, const char *port, qmat_value_type type, const qmat_value **value) {
  qmat_context *context = &job->context;
  const qmat_status status = find_value(context, job, port, value, NULL);
  if (status != QMAT_OK) return status;
  if ((*value)->type == QMAT_LIST) {
    qmat_fail(context, QMAT_ERROR_USAGE, "'%s' has %zu values, one for each mesh of the scene", port,
              qmat_value_count(*value));
    return qmat_fail_hint(context, "name one as %s[0], or set model.mesh to the name of a mesh, or to merged", port);
  }
  if ((*value)->type != type)
    return qmat_fail(context, QMAT_ERROR_USAGE, "'%s' is %s, not %s", port, qmat_value_type_phrase((*value)->type),
                     qmat_value_type_phrase(type));
  return QMAT_OK;
}

/* The value of a port, or NULL: the error is then in job->problem. */
static const void *result_value(qmat_job *job, const char *port, qmat_value_type type) {
  const qmat_value *value;
  if (!job->loaded) return NULL;
  return finish(job, find_single(job, port, type, &value)) == QMAT_RESULT_OK ? value : NULL;
}

qmat_result qmat_job_value(qmat_job *job, const char *port, qmat_value_view *view) {
  const qmat_value *value;
  *view = (qmat_value_view){.type = "", .name = ""};
  if (!job->loaded) return job->problem.result;
  qmat_status status = find_value(&job->context, job, port, &value, &view->name);
  if (status != QMAT_OK) return finish(job, status);
  view->type = qmat_value_type_name(qmat_value_item_type(value));
  if (value->type == QMAT_LIST) {
    view->item_count = qmat_value_count(value);
  } else {
    qmat_value_array array;
    while (qmat_value_array_at(value, view->array_count, &array)) view->array_count++;
  }
  return QMAT_RESULT_OK;
}

qmat_result qmat_job_array(qmat_job *job, const char *port, size_t index, qmat_array_view *view) {
  const qmat_value *value;
  qmat_value_array array = {0};
  *view = (qmat_array_view){.name = ""};
  if (!job->loaded) return job->problem.result;
  qmat_status status = find_value(&job->context, job, port, &value, NULL);
  if (status == QMAT_OK && (value->type == QMAT_LIST || !qmat_value_array_at(value, index, &array)))
    status = qmat_fail(&job->context, QMAT_ERROR_USAGE, "'%s' has no array %zu", port, index);
  if (status != QMAT_OK) return finish(job, status);
  *view = (qmat_array_view){array.name, array.rows, array.columns, array.numbers, array.ids};
  return QMAT_RESULT_OK;
}

qmat_result qmat_job_distances(qmat_job *job, const char *port, const double *points, size_t count, double *distances) {
  const qmat_medial *medial = result_value(job, port, QMAT_MEDIAL);
  if (!medial) return job->problem.result;
  qmat_envelope *envelope = NULL;
  qmat_status status = expect_array(&job->context, points, count, "points");
  if (status == QMAT_OK) status = expect_array(&job->context, distances, count, "distances");
  for (size_t i = 0; i < 3 * count && status == QMAT_OK; i++) {
    if (isfinite(points[i])) continue;
    qmat_fail(&job->context, QMAT_ERROR_GEOMETRY, "a coordinate is not finite");
    status = qmat_fail_element(&job->context, "point", (int64_t)(i / 3));
  }
  if (status == QMAT_OK) status = qmat_envelope_of_medial(&job->context, medial, &envelope);
  if (status == QMAT_OK) status = qmat_envelope_distances(&job->context, envelope, points, count, distances);
  qmat_envelope_free(envelope);
  return finish(job, status);
}

qmat_result qmat_job_medial(qmat_job *job, const char *port, qmat_medial_view *view) {
  *view = (qmat_medial_view){0};
  const qmat_medial *medial = result_value(job, port, QMAT_MEDIAL);
  if (!medial) return job->problem.result;
  *view = (qmat_medial_view){medial->sphere_count, medial->edge_count, medial->triangle_count,
                             medial->spheres,      medial->edges,      medial->triangles};
  return QMAT_RESULT_OK;
}

qmat_result qmat_job_mesh(qmat_job *job, const char *port, qmat_mesh_view *view) {
  *view = (qmat_mesh_view){0};
  const qmat_mesh *mesh = result_value(job, port, QMAT_MESH);
  if (!mesh) return job->problem.result;
  *view = (qmat_mesh_view){mesh->vertex_count, mesh->triangle_count, mesh->positions, mesh->triangles};
  return QMAT_RESULT_OK;
}

qmat_result qmat_job_file(qmat_job *job, const char *port, qmat_file_view *view) {
  *view = (qmat_file_view){.format = ""};
  const qmat_file *file = result_value(job, port, QMAT_FILE);
  if (!file) return job->problem.result;
  *view = (qmat_file_view){file->format, file->part_count};
  return QMAT_RESULT_OK;
}

qmat_result qmat_job_file_part(qmat_job *job, const char *port, size_t part, const char **name, const uint8_t **bytes,
                               size_t *size) {
  *name = "";
  *bytes = NULL;
  *size = 0;
  const qmat_file *file = result_value(job, port, QMAT_FILE);
  if (!file) return job->problem.result;
  if (part >= file->part_count)
    return finish(job, qmat_fail(&job->context, QMAT_ERROR_USAGE, "'%s' has %zu parts and no part %zu", port,
                                 file->part_count, part));
  *name = file->parts[part].name;
  *bytes = file->parts[part].bytes;
  *size = file->parts[part].size;
  return QMAT_RESULT_OK;
}

qmat_result qmat_job_report(qmat_job *job, const char *port, char **json) {
  *json = NULL;
  const qmat_report *report = result_value(job, port, QMAT_REPORT);
  return report ? finish(job, dump(&job->context, report->root, json)) : job->problem.result;
}

qmat_result qmat_job_run_report(qmat_job *job, char **json) {
  *json = NULL;
  if (!job->loaded) return job->problem.result;
  if (!job->ran) return finish(job, qmat_fail(&job->context, QMAT_ERROR_USAGE, "the job has no results: run it first"));
  *json = qmat_strdup(job->run_report);
  return finish(job, *json ? QMAT_OK : qmat_fail_memory(&job->context, "report"));
}
