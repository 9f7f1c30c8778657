/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_TESTS_GRAPHS_TEST_NODES_H
#define QMAT_TESTS_GRAPHS_TEST_NODES_H

/* Small nodes for the tests of graphs: numbers travel as reports {"value": x}. Include after cmocka. */

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "graphs/graph_file.h"
#include "graphs/graph_names.h"
#include "graphs/graph_params.h"
#include "graphs/run/graph_run.h"
#include "graphs/run/run_outputs.h"
#include "graphs/run/run_paths.h"
#include "graphs/run/run_plan.h"
#include "graphs/run/run_summary.h"
#include "nodes/descriptor/medial_summary.h"

typedef struct number_params {
  double value;
  int64_t repeat;
  bool negate;
  const char *path;
} number_params;

static inline qmat_status test_report(qmat_context *context, double number, qmat_value **output) {
  qmat_report *report = qmat_report_new();
  assert_non_null(report);
  json_object_set_new(report->root, "value", json_real(number));
  qmat_status status = qmat_value_seal(context, &report->base);
  *output = &report->base;
  return status;
}

static inline double test_value(const qmat_value *value) {
  return json_number_value(json_object_get(((const qmat_report *)value)->root, "value"));
}

static qmat_status number_check(qmat_context *context, const void *data) {
  const number_params *params = data;
  if (params->repeat > 1 && params->negate) {
    qmat_fail(context, QMAT_ERROR_USAGE, "repeat and negate exclude each other");
    return qmat_fail_field(context, "repeat");
  }
  return QMAT_OK;
}

static qmat_status number_run(qmat_context *context, const void *data, const qmat_value *const inputs[],
                              qmat_value *outputs[]) {
  (void)inputs;
  const number_params *params = data;
  return test_report(context, (params->negate ? -1 : 1) * params->value * (double)params->repeat, &outputs[0]);
}

static const qmat_param number_rows[] = {{.name = "value",
                                          .unit = "1",
                                          .doc = "The number",
                                          .type = QMAT_PARAM_FLOAT,
                                          .default_number = 1,
                                          .min = -100,
                                          .max = 100,
                                          .flags = QMAT_PARAM_RELATIVE,
                                          .offset = offsetof(number_params, value)},
                                         {.name = "repeat",
                                          .unit = "1",
                                          .doc = "How often",
                                          .type = QMAT_PARAM_INT,
                                          .default_number = 1,
                                          .min = 1,
                                          .max = 9,
                                          .offset = offsetof(number_params, repeat)},
                                         {.name = "negate",
                                          .unit = "",
                                          .doc = "Other sign",
                                          .type = QMAT_PARAM_BOOL,
                                          .offset = offsetof(number_params, negate)},
                                         {.name = "path",
                                          .unit = "",
                                          .doc = "A file that is not read",
                                          .type = QMAT_PARAM_PATH,
                                          .default_text = NULL,
                                          .flags = QMAT_PARAM_INPUT_FILE,
                                          .offset = offsetof(number_params, path)},
                                         {0}};
static const qmat_port number_outputs[] = {{.name = "number", .type = QMAT_REPORT, .doc = "The number"}, {0}};
static const qmat_node test_number = {.name = "test.number",
                                      .version = 3,
                                      .summary = "A number",
                                      .doc = "",
                                      .citation = "",
                                      .params_size = sizeof(number_params),
                                      .params = number_rows,
                                      .outputs = number_outputs,
                                      .check = number_check,
                                      .run = number_run};

static qmat_status add_run(qmat_context *context, const void *params, const qmat_value *const inputs[],
                           qmat_value *outputs[]) {
  (void)params;
  return test_report(context, test_value(inputs[0]) + (inputs[1] ? test_value(inputs[1]) : 0), &outputs[0]);
}

static const qmat_port add_inputs[] = {{.name = "first", .type = QMAT_REPORT, .doc = "One"},
                                       {.name = "second", .type = QMAT_REPORT, .optional = true, .doc = "Another"},
                                       {0}};
static const qmat_port add_outputs[] = {{.name = "sum", .type = QMAT_REPORT, .doc = "Their sum"}, {0}};
static const qmat_node test_add = {.name = "test.add",
                                   .version = 1,
                                   .summary = "A sum",
                                   .doc = "",
                                   .citation = "",
                                   .inputs = add_inputs,
                                   .outputs = add_outputs,
                                   .run = add_run};

/* The second number where the first is below 1, else the first, without reading the second. */
static bool pick_reads(const void *params, const qmat_value *const *known, size_t input) {
  (void)params;
  return input == 0 || !known || !known[0] || test_value(known[0]) < 1;
}

static qmat_status pick_run(qmat_context *context, const void *params, const qmat_value *const inputs[],
                            qmat_value *outputs[]) {
  (void)params;
  const double first = test_value(inputs[0]);
  assert_true((inputs[1] != NULL) == (first < 1));
  return test_report(context, first < 1 ? test_value(inputs[1]) : first, &outputs[0]);
}

static const qmat_port pick_inputs[] = {{.name = "first", .type = QMAT_REPORT, .decides = true, .doc = "One"},
                                        {.name = "second", .type = QMAT_REPORT, .optional = true, .doc = "Another"},
                                        {0}};
static const qmat_node test_pick = {.name = "test.pick",
                                    .version = 1,
                                    .summary = "One of two",
                                    .doc = "",
                                    .citation = "",
                                    .inputs = pick_inputs,
                                    .outputs = add_outputs,
                                    .reads = pick_reads,
                                    .run = pick_run};

typedef struct print_params {
  int format;
  const char *label;
} print_params;

static const char *const print_formats[] = {"txt", "csv", "pair", NULL};

/* txt and csv are one part; pair refers to a side file. */
static qmat_status print_run(qmat_context *context, const void *data, const qmat_value *const inputs[],
                             qmat_value *outputs[]) {
  const print_params *params = data;
  qmat_file *file = qmat_file_new();
  assert_non_null(file);
  size_t parts = params->format == 2 ? 2 : 1;
  file->format = qmat_strdup(print_formats[params->format]);
  file->parts = qmat_calloc(parts, sizeof *file->parts);
  file->part_count = parts;
  for (size_t i = 0; i < parts; i++) {
    char text[80], number[40];
    qmat_format_number(test_value(inputs[0]), number, sizeof number);
    snprintf(text, sizeof text, "%s%s%s\n", params->label, params->format == 1 ? "," : " ", number);
    file->parts[i].name = qmat_strdup(i ? "side.bin" : "");
    file->parts[i].bytes = (uint8_t *)qmat_strdup(text);
    file->parts[i].size = strlen(text);
  }
  outputs[0] = &file->base;
  return qmat_value_seal(context, &file->base);
}

static const qmat_param print_rows[] = {{.name = "format",
                                         .unit = "",
                                         .doc = "How",
                                         .type = QMAT_PARAM_ENUM,
                                         .choices = print_formats,
                                         .flags = QMAT_PARAM_OUTPUT_FORMAT,
                                         .offset = offsetof(print_params, format)},
                                        {.name = "label",
                                         .unit = "",
                                         .doc = "What",
                                         .type = QMAT_PARAM_STRING,
                                         .default_text = "number",
                                         .offset = offsetof(print_params, label)},
                                        {0}};
static const qmat_port print_inputs[] = {{.name = "number", .type = QMAT_REPORT, .doc = "It"}, {0}};
static const qmat_port print_outputs[] = {{.name = "file", .type = QMAT_FILE, .doc = "A file"}, {0}};
static const qmat_node test_print = {.name = "test.print",
                                     .version = 1,
                                     .summary = "A file",
                                     .doc = "",
                                     .citation = "",
                                     .params_size = sizeof(print_params),
                                     .params = print_rows,
                                     .inputs = print_inputs,
                                     .outputs = print_outputs,
                                     .run = print_run};

static qmat_status fail_run(qmat_context *context, const void *params, const qmat_value *const inputs[],
                            qmat_value *outputs[]) {
  (void)params;
  (void)inputs;
  (void)outputs;
  qmat_fail(context, QMAT_ERROR_GEOMETRY, "the number is not round");
  return qmat_fail_element(context, "digit", 7);
}

static const qmat_node test_fail = {.name = "test.fail",
                                    .version = 1,
                                    .summary = "A failure",
                                    .doc = "",
                                    .citation = "",
                                    .inputs = add_inputs,
                                    .outputs = add_outputs,
                                    .run = fail_run};

/* Goes on until it is cancelled. */
static qmat_status wait_run(qmat_context *context, const void *params, const qmat_value *const inputs[],
                            qmat_value *outputs[]) {
  (void)params;
  (void)inputs;
  (void)outputs;
  for (uint64_t i = 1;; i++) {
    qmat_status status = qmat_progress(context, i, 0, "rounds");
    if (status != QMAT_OK) return status;
    usleep(1000);
  }
}

static const qmat_node test_wait = {.name = "test.wait",
                                    .version = 1,
                                    .summary = "Waits",
                                    .doc = "",
                                    .citation = "",
                                    .outputs = add_outputs,
                                    .run = wait_run};

typedef struct path_params {
  const char *path;
} path_params;

/* A tetrahedron, named after the path. */
static qmat_status mesh_run(qmat_context *context, const void *data, const qmat_value *const inputs[],
                            qmat_value *outputs[]) {
  (void)inputs;
  static const double positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  static const uint32_t triangles[] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  const char *name = strrchr(((const path_params *)data)->path, '/');
  name = name ? name + 1 : ((const path_params *)data)->path;
  qmat_scene *scene = qmat_scene_new();
  scene->name = qmat_strdup(name);
  scene->format = qmat_strdup("off");
  qmat_mesh *mesh = qmat_mesh_new();
  mesh->vertex_count = mesh->triangle_count = 4;
  mesh->positions = qmat_alloc(12, sizeof *mesh->positions);
  memcpy(mesh->positions, positions, sizeof positions);
  mesh->triangles = qmat_alloc(12, sizeof *mesh->triangles);
  memcpy(mesh->triangles, triangles, sizeof triangles);
  mesh->closed = mesh->oriented = true;
  outputs[0] = &scene->base;
  outputs[1] = &mesh->base;
  qmat_status status = qmat_value_seal(context, &scene->base);
  return status == QMAT_OK ? qmat_value_seal(context, &mesh->base) : status;
}

static const qmat_param mesh_rows[] = {{.name = "path",
                                        .unit = "",
                                        .doc = "The model",
                                        .type = QMAT_PARAM_PATH,
                                        .flags = QMAT_PARAM_REQUIRED | QMAT_PARAM_INPUT_FILE,
                                        .offset = offsetof(path_params, path)},
                                       {0}};
static const qmat_port mesh_outputs[] = {{.name = "scene", .type = QMAT_SCENE, .doc = "Its name"},
                                         {.name = "mesh", .type = QMAT_MESH, .doc = "Its surface"},
                                         {0}};
static const qmat_node test_mesh = {.name = "test.mesh",
                                    .version = 1,
                                    .summary = "A surface",
                                    .doc = "",
                                    .citation = "",
                                    .params_size = sizeof(path_params),
                                    .params = mesh_rows,
                                    .outputs = mesh_outputs,
                                    .run = mesh_run};

/* One sphere, and a report with the numbers of a simplification. */
static qmat_status ball_run(qmat_context *context, const void *params, const qmat_value *const inputs[],
                            qmat_value *outputs[]) {
  (void)params;
  (void)inputs;
  qmat_medial *medial = qmat_medial_new();
  medial->sphere_count = 1;
  medial->spheres = qmat_alloc(4, sizeof *medial->spheres);
  for (int i = 0; i < 4; i++) medial->spheres[i] = 0.25;
  medial->edges = qmat_alloc(0, sizeof *medial->edges);
  medial->triangles = qmat_alloc(0, sizeof *medial->triangles);
  qmat_report *report = qmat_report_new();
  json_object_set_new(report->root, "spheres", json_integer(1));
  json_object_set_new(report->root, "epsilon", json_real(0.01));
  json_object_set_new(report->root, "surface_to_envelope", json_real(0.00977));
  json_object_set_new(report->root, "envelope_to_surface", json_real(0));
  outputs[0] = &medial->base;
  outputs[1] = &report->base;
  qmat_status status = qmat_value_seal(context, &medial->base);
  return status == QMAT_OK ? qmat_value_seal(context, &report->base) : status;
}

static const qmat_port ball_inputs[] = {{.name = "mesh", .type = QMAT_MESH, .doc = "A surface"}, {0}};
static const qmat_port ball_outputs[] = {{.name = "medial", .type = QMAT_MEDIAL, .doc = "A sphere"},
                                         {.name = "report", .type = QMAT_REPORT, .doc = "How well"},
                                         {0}};
static const qmat_node test_ball = {.name = "test.ball",
                                    .version = 1,
                                    .summary = "A sphere",
                                    .doc = "",
                                    .citation = "",
                                    .inputs = ball_inputs,
                                    .outputs = ball_outputs,
                                    .report_summary = &qmat_medial_summary,
                                    .run = ball_run};

static const qmat_node *const test_node_table[] = {&test_add,    &test_ball, &test_fail,  &test_mesh,
                                                   &test_number, &test_pick, &test_print, &test_wait};
static const qmat_registry test_registry = {test_node_table, sizeof test_node_table / sizeof *test_node_table};

/* Reads graph text under the name "g.yaml". */
static inline qmat_status test_read(qmat_context *context, const char *text, qmat_graph *graph) {
  return qmat_graph_read_text(context, &test_registry, "g.yaml", text, strlen(text), graph);
}

/* Fails with the error when the status is not QMAT_OK. */
static inline void test_ok(const qmat_context *context, qmat_status status) {
  if (status == QMAT_OK) return;
  char line[2048];
  qmat_error_format(&context->error, line, sizeof line);
  fail_msg("%s", line);
}

#endif
