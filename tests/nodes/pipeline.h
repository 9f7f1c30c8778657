/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_TESTS_NODES_PIPELINE_H
#define QMAT_TESTS_NODES_PIPELINE_H

/* Makes the inputs of the medial nodes from a model. Include after cmocka. */

#include <stdlib.h>
#include <string.h>

#include "core/geometry/frame.h"
#include "core/node.h"
#include "examples/models.h"
#include "nodes/nodes.h"
#include "tests/shapes.h"

enum { PIPELINE_MOST_PORTS = 8 };

/* Runs a node with the parameters that `text` sets ("name=value name=value"). */
static inline qmat_status pipeline_run(qmat_context *context, const char *name, const char *text,
                                       const qmat_value *const inputs[], qmat_value *outputs[]) {
  const qmat_node *node = qmat_node_find(name);
  assert_non_null(node);
  double params[32]; /* for its alignment */
  assert_true(node->params_size <= sizeof params && qmat_output_count(node) <= PIPELINE_MOST_PORTS);
  qmat_params_default(node, params);
  char copy[256];
  assert_true(strlen(text) < sizeof copy);
  memcpy(copy, text, strlen(text) + 1);
  for (char *rest = copy, *word; (word = strtok_r(rest, " ", &rest)) != NULL;) {
    char *value = strchr(word, '=');
    assert_non_null(value);
    *value++ = '\0';
    const qmat_param *param = qmat_param_find(node, word);
    if (!param) fail_msg("%s has no parameter %s", name, word);
    if (qmat_param_parse(context, param, value, params) != QMAT_OK) fail_msg("%s", context->error.message);
  }
  if (qmat_params_check(context, node, params) != QMAT_OK) fail_msg("%s", context->error.message);
  const qmat_status status = qmat_node_run(context, node, params, inputs, outputs);
  if (status != QMAT_OK) assert_string_not_equal(context->error.message, "");
  return status;
}

/* The same where it must succeed, with `threads` threads; 0: all. */
static inline void pipeline_must_run(int threads, const char *name, const char *text, const qmat_value *const inputs[],
                                     qmat_value *outputs[]) {
  qmat_context context = {.threads = threads};
  if (pipeline_run(&context, name, text, inputs, outputs) != QMAT_OK) {
    char message[2048];
    qmat_error_format(&context.error, message, sizeof message);
    fail_msg("%s", message);
  }
  qmat_context_uninit(&context);
}

static inline void pipeline_release(const char *name, qmat_value *outputs[]) {
  for (size_t i = 0; i < qmat_output_count(qmat_node_find(name)); i++) qmat_value_release(outputs[i]);
}

/* Cancels a run at call `stop_at` of the progress function, which is asked at every opportunity. */
typedef struct pipeline_stopper {
  qmat_context *context;
  size_t stop_at, calls;
} pipeline_stopper;

static inline bool pipeline_may_go_on(void *user, const char *node_id, const char *node_type, uint64_t done,
                                      uint64_t total, const char *unit) {
  (void)node_id, (void)node_type, (void)done, (void)total, (void)unit;
  pipeline_stopper *stopper = user;
  stopper->context->progress_time = 0;
  return stopper->calls++ < stopper->stop_at;
}

/* Runs a node that is cancelled at call `stop_at`; `calls` gets how often it asked. It has outputs only where it came
 * to its end; the caller releases them. */
static inline qmat_status pipeline_run_until(int threads, size_t stop_at, const char *name, const char *text,
                                             const qmat_value *const inputs[], qmat_value *outputs[], size_t *calls) {
  qmat_context context = {.threads = threads, .progress = pipeline_may_go_on};
  pipeline_stopper stopper = {.context = &context, .stop_at = stop_at};
  context.progress_user = &stopper;
  const qmat_status status = pipeline_run(&context, name, text, inputs, outputs);
  for (size_t i = 0; status != QMAT_OK && i < qmat_output_count(qmat_node_find(name)); i++) assert_null(outputs[i]);
  if (status != QMAT_OK) assert_int_equal(context.error.status, status);
  *calls = stopper.calls;
  qmat_context_uninit(&context);
  return status;
}

/* Cancels a node on one thread at calls 0, 1, 3, 7, ... of the progress function, up to the last one of a whole run. A
 * cancel is obeyed at once. The first call is before the node starts. */
static inline void pipeline_must_be_cancelled(const char *name, const char *text, const qmat_value *const inputs[]) {
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  size_t whole, calls;
  assert_int_equal(pipeline_run_until(1, SIZE_MAX, name, text, inputs, outputs, &whole), QMAT_OK);
  pipeline_release(name, outputs);
  assert_true(whole > 1);
  for (size_t stop_at = 0; stop_at < whole; stop_at = 2 * stop_at + 1) {
    assert_int_equal(pipeline_run_until(1, stop_at, name, text, inputs, outputs, &calls), QMAT_CANCELLED);
    assert_int_equal(calls, stop_at + 1);
  }
  assert_int_equal(pipeline_run_until(1, whole - 1, name, text, inputs, outputs, &calls), QMAT_CANCELLED);
  assert_int_equal(calls, whole);
}

/* The node must fail because of the geometry in `field`. Returns whether it gives a hint. */
static inline bool pipeline_must_fail(const char *name, const char *text, const qmat_value *const inputs[],
                                      const char *field) {
  qmat_context context = {0};
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  assert_int_equal(pipeline_run(&context, name, text, inputs, outputs), QMAT_ERROR_GEOMETRY);
  assert_string_equal(context.error.field, field);
  const bool has_hint = context.error.hint[0] != '\0';
  qmat_context_uninit(&context);
  return has_hint;
}

/* The first output has the same digest with 1, 2 and 8 threads. */
static inline void pipeline_must_ignore_threads(const char *name, const char *text, const qmat_value *const inputs[]) {
  static const int threads[] = {1, 2, 8};
  qmat_digest first = {{0}};
  for (int i = 0; i < 3; i++) {
    qmat_value *outputs[PIPELINE_MOST_PORTS];
    pipeline_must_run(threads[i], name, text, inputs, outputs);
    if (i == 0) first = outputs[0]->digest;
    assert_memory_equal(&outputs[0]->digest, &first, sizeof first);
    pipeline_release(name, outputs);
  }
}

/* An unsealed mesh of a model's surface. */
static inline qmat_mesh *pipeline_mesh_of(const qmat_model *model) {
  qmat_mesh *mesh = shape_new();
  mesh->vertex_count = model->vertex_count;
  mesh->triangle_count = model->triangle_count;
  mesh->positions = qmat_alloc(3 * model->vertex_count, sizeof(double));
  mesh->triangles = qmat_alloc(3 * model->triangle_count, sizeof(uint32_t));
  assert_true(mesh->positions && mesh->triangles);
  memcpy(mesh->positions, model->positions, 3 * model->vertex_count * sizeof(double));
  memcpy(mesh->triangles, model->triangles, 3 * model->triangle_count * sizeof(uint32_t));
  return mesh;
}

/* An unsealed mesh of the model of that name. */
static inline qmat_mesh *pipeline_model(const char *name, int resolution) {
  qmat_model model;
  assert_int_equal(qmat_model_make(name, resolution, &model), QMAT_OK);
  qmat_mesh *mesh = pipeline_mesh_of(&model);
  qmat_model_uninit(&model);
  return mesh;
}

/* Vertex i becomes vertex i * stride modulo their number (prime to it), corners turn, and facets come in another
 * order. */
static inline void pipeline_shuffle(qmat_mesh *mesh) {
  const size_t n = mesh->vertex_count, m = mesh->triangle_count;
  size_t stride = n / 3 + 1;
  for (size_t a = n, b = stride; b != 1;) { /* Euclid */
    const size_t rest = b > 0 ? a % b : 0;
    a = b;
    b = rest;
    if (b == 0) a = n, b = ++stride;
  }
  double *positions = qmat_alloc(3 * n, sizeof *positions);
  uint32_t *triangles = qmat_alloc(3 * m, sizeof *triangles);
  assert_true(positions && triangles);
  for (size_t i = 0; i < n; i++)
    memcpy(&positions[3 * (i * stride % n)], &mesh->positions[3 * i], 3 * sizeof *positions);
  for (size_t t = 0; t < m; t++)
    for (size_t k = 0; k < 3; k++)
      triangles[3 * (m - 1 - t) + (k + t) % 3] = (uint32_t)(mesh->triangles[3 * t + k] * stride % n);
  qmat_free(mesh->positions);
  qmat_free(mesh->triangles);
  mesh->positions = positions;
  mesh->triangles = triangles;
}

/* The inputs of the medial nodes, and the initial medial mesh. */
typedef struct pipeline {
  qmat_mesh *mesh;
  qmat_field *thickness;
  qmat_samples *samples;
  qmat_medial *medial;
  qmat_report *report; /* of medial.delaunay */
} pipeline;

/* Seals the mesh, takes it over, and makes its thickness and samples. */
static inline void pipeline_sample(pipeline *p, qmat_mesh *mesh, const char *sample_params) {
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  *p = (pipeline){.mesh = mesh->base.sealed ? mesh : shape_seal(mesh)};
  pipeline_must_run(0, "mesh.sdf", "", (const qmat_value *[]){&mesh->base}, outputs);
  p->thickness = (qmat_field *)outputs[0];
  for (size_t i = 1; i < qmat_output_count(qmat_node_find("mesh.sdf")); i++) qmat_value_release(outputs[i]);
  pipeline_must_run(0, "mesh.sample", sample_params, (const qmat_value *[]){&mesh->base, &p->thickness->base}, outputs);
  p->samples = (qmat_samples *)outputs[0];
  qmat_value_release(outputs[1]);
}

/* Replaces the initial medial mesh. */
static inline void pipeline_delaunay(pipeline *p, int threads, const char *delaunay_params) {
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  qmat_value_release(p->medial ? &p->medial->base : NULL);
  qmat_value_release(p->report ? &p->report->base : NULL);
  pipeline_must_run(threads, "medial.delaunay", delaunay_params,
                    (const qmat_value *[]){&p->mesh->base, &p->thickness->base, &p->samples->base}, outputs);
  p->medial = (qmat_medial *)outputs[0];
  p->report = (qmat_report *)outputs[1];
}

static inline void pipeline_make(pipeline *p, qmat_mesh *mesh, const char *sample_params, const char *delaunay_params) {
  pipeline_sample(p, mesh, sample_params);
  pipeline_delaunay(p, 0, delaunay_params);
}

static inline void pipeline_free(pipeline *p) {
  qmat_value_release(p->mesh ? &p->mesh->base : NULL);
  qmat_value_release(p->thickness ? &p->thickness->base : NULL);
  qmat_value_release(p->samples ? &p->samples->base : NULL);
  qmat_value_release(p->medial ? &p->medial->base : NULL);
  qmat_value_release(p->report ? &p->report->base : NULL);
  *p = (pipeline){NULL, NULL, NULL, NULL, NULL};
}

/* Two boxes, one above the other, with a gap of 0.4 % of the diagonal between them. */
static inline qmat_mesh *pipeline_narrow_gap(void) {
  qmat_mesh *mesh = shape_new();
  shape_add_box(mesh, 0, 0, 0, 1, 0.1, 0.1, false);
  shape_add_box(mesh, 0.2, 0.104, 0.02, 0.8, 0.2, 0.08, false);
  return mesh;
}

/* Books side by side on a board, one solid. The gaps between them have 4 % of their thickness. */
static inline qmat_mesh *pipeline_books(int count) {
  qmat_mesh *mesh = shape_new();
  for (int i = 0; i < count; i++) shape_add_box(mesh, 0.052 * i, 0, 0, 0.052 * i + 0.05, 0.21, 0.35, false);
  shape_add_box(mesh, -0.02, -0.05, -0.03, 0.052 * count + 0.02, 0.26, 0, false);
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  pipeline_must_run(0, "mesh.solid", "", (const qmat_value *[]){&shape_seal(mesh)->base}, outputs);
  qmat_value_release(outputs[1]);
  qmat_value_release(&mesh->base);
  return (qmat_mesh *)outputs[0];
}

/* The spheres of radius zero. */
static inline size_t pipeline_features(const qmat_medial *medial) {
  size_t count = 0;
  for (size_t i = 0; i < medial->sphere_count; i++) count += medial->spheres[4 * i + 3] == 0;
  return count;
}

/* The diagonal of the mesh's bounding box. */
static inline double pipeline_diagonal(const qmat_mesh *mesh) {
  qmat_context context = {0};
  qmat_frame frame;
  assert_int_equal(qmat_frame_of_mesh(&context, mesh, &frame), QMAT_OK);
  qmat_context_uninit(&context);
  return frame.diagonal;
}

static inline int64_t pipeline_count(const qmat_report *report, const char *name) {
  const json_t *number = json_object_get(report->root, name);
  if (!json_is_integer(number)) fail_msg("the report has no count %s", name);
  return json_integer_value(number);
}

static inline double pipeline_number(const qmat_report *report, const char *name) {
  const json_t *number = json_object_get(report->root, name);
  if (!json_is_number(number)) fail_msg("the report has no number %s", name);
  return json_number_value(number);
}

/* Bounds of medial.evaluate for an epsilon of 3 %, as shares of the diagonal: those that `names` lists. */
static inline void pipeline_errors(const qmat_mesh *mesh, const qmat_medial *medial, size_t count,
                                   const char *const names[], double errors[]) {
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  pipeline_must_run(0, "medial.evaluate", "epsilon=3%", (const qmat_value *[]){&mesh->base, &medial->base}, outputs);
  for (size_t i = 0; i < count; i++) errors[i] = pipeline_number((const qmat_report *)outputs[0], names[i]);
  pipeline_release("medial.evaluate", outputs);
}

/* One of them. */
static inline double pipeline_error(const qmat_mesh *mesh, const qmat_medial *medial, const char *name) {
  double error;
  pipeline_errors(mesh, medial, 1, &name, &error);
  return error;
}

/* What medial.simplify makes of an initial medial mesh; the caller releases it. */
static inline qmat_medial *pipeline_simplify(const pipeline *p, const qmat_medial *initial, const char *params) {
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  pipeline_must_run(0, "medial.simplify", params,
                    (const qmat_value *[]){&p->mesh->base, &p->thickness->base, &p->samples->base, &initial->base},
                    outputs);
  for (size_t i = 1; i < qmat_output_count(qmat_node_find("medial.simplify")); i++) qmat_value_release(outputs[i]);
  return (qmat_medial *)outputs[0];
}

/* Vertices - edges + triangles. */
static inline long pipeline_euler(const qmat_medial *medial) {
  return (long)medial->sphere_count - (long)medial->edge_count + (long)medial->triangle_count;
}

static inline size_t pipeline_components(const qmat_medial *medial) {
  uint32_t *parent = calloc(medial->sphere_count + 1, sizeof *parent);
  assert_non_null(parent);
  size_t components = medial->sphere_count;
  for (size_t i = 0; i < medial->sphere_count; i++) parent[i] = (uint32_t)i;
  for (size_t e = 0; e < medial->edge_count; e++) {
    uint32_t ends[2] = {medial->edges[2 * e], medial->edges[2 * e + 1]};
    for (int k = 0; k < 2; k++)
      while (parent[ends[k]] != ends[k]) ends[k] = parent[ends[k]] = parent[parent[ends[k]]];
    components -= ends[0] != ends[1];
    parent[ends[1]] = ends[0];
  }
  free(parent);
  return components;
}

#endif
