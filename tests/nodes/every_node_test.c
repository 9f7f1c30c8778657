/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Tests of every node in the table, generated from its descriptor. The descriptor is complete and its texts follow one
 * style. Parameters work at their bounds. The same inputs give the same bytes on any number of threads. Bad inputs give
 * an error that names them. A run can be cancelled or run out of memory at any point. A new node needs no code here. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

#include "core/geometry/medial_build.h"
#include "core/value_form.h"
#include "examples/models.h"
#include "nodes/nodes.h"
#include "tests/shapes.h"
#include "tests/shortage.h"

/* A run at the bound of a parameter can take hours. Its progress function stops it after PATIENCE seconds, and it must
 * return within LATENCY seconds. */
static const double PATIENCE = 0.5, LATENCY = 20;

/* The number of points at which a run is stopped or runs out of memory; fewer if the run is one of many (with each
 * choice of a parameter). */
enum { MOST_STOPS = 8, MOST_SHORTAGES = 32, FEWER_SHORTAGES = 6 };

enum { MOST_PORTS = 16 };

static double now(void) {
  struct timespec time;
  clock_gettime(CLOCK_MONOTONIC, &time);
  return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

/* ---- values for ports ---- */

/* Families of matching values, one of each type. */
typedef enum world {
  WORLD_SOLID,    /* a small solid and what the nodes themselves make of it */
  WORLD_OTHER,    /* the same of another solid with other counts */
  WORLD_EMPTY,    /* nothing at all */
  WORLD_TRIANGLE, /* one triangle, one sphere of radius 0 */
  WORLD_FLAT,     /* closed but without volume: a triangle and its back */
  WORLD_POINT,    /* closed, but all vertices are in one place */
  WORLD_HUGE,     /* a tetrahedron whose squared lengths overflow */
  WORLD_TINY,     /* a tetrahedron whose squared lengths vanish */
  WORLD_COUNT
} world;

static const char *const world_names[WORLD_COUNT] = {"a solid",    "another solid", "nothing", "one triangle",
                                                     "a flat one", "one point",     "huge",    "tiny"};

typedef struct fixture {
  qmat_value *values[WORLD_COUNT][QMAT_VALUE_TYPE_COUNT];
  char folder[64];
  char files[2][96]; /* a model and a medial mesh, for parameters that are paths */
} fixture;

static fixture made;

static void seal(qmat_value *value) {
  qmat_context context = {0};
  const qmat_status status = qmat_value_seal(&context, value);
  if (status != QMAT_OK) fail_msg("%s", context.error.message);
  qmat_context_uninit(&context);
}

/* A run of one node. */
typedef struct subject {
  const qmat_node *node;
  void *params;
  const qmat_value *inputs[MOST_PORTS];
  qmat_value *outputs[MOST_PORTS];
} subject;

static void release_outputs(subject *run) {
  for (size_t i = 0; i < qmat_output_count(run->node); i++) {
    qmat_value_release(run->outputs[i]);
    run->outputs[i] = NULL;
  }
}

static void subject_uninit(subject *run) {
  release_outputs(run);
  qmat_free(run->params);
}

static void use_world(subject *run, world from) {
  for (size_t i = 0; i < qmat_input_count(run->node); i++)
    run->inputs[i] = made.values[from][run->node->inputs[i].type];
}

/* Sets lengths to five times their default, and widths and heights in pixels to a tenth, within their range. Every node
 * is run hundreds of times, and work grows with the inverse square of lengths and with the number of pixels. */
static void make_coarse(const qmat_node *node, void *params) {
  for (size_t row = 0; row < qmat_param_count(node); row++) {
    const qmat_param *param = &node->params[row];
    char *value = (char *)params + param->offset;
    if (param->flags & QMAT_PARAM_RELATIVE) {
      const double length = fmin(5 * param->default_number, param->max);
      memcpy(value, &length, sizeof length);
    } else if (param->type == QMAT_PARAM_INT && strcmp(param->unit, "pixels") == 0) {
      const int64_t pixels = (int64_t)fmax(param->default_number / 10, param->min);
      memcpy(value, &pixels, sizeof pixels);
    }
  }
}

/* Coarse lengths, defaults for the other parameters, and the solid's values at every input. A required path becomes the
 * first test file that the node accepts. */
static subject subject_of(const qmat_node *node) {
  subject run = {.node = node, .params = qmat_calloc(1, node->params_size)};
  assert_non_null(run.params);
  assert_in_range(qmat_input_count(node), 0, MOST_PORTS);
  assert_in_range(qmat_output_count(node), 1, MOST_PORTS);
  qmat_params_default(node, run.params);
  make_coarse(node, run.params);
  use_world(&run, WORLD_SOLID);
  qmat_context context = {0};
  for (size_t row = 0; row < qmat_param_count(node); row++) {
    const qmat_param *param = &node->params[row];
    if (!(param->flags & QMAT_PARAM_REQUIRED)) continue;
    qmat_status status = QMAT_ERROR_USAGE;
    for (size_t i = 0; i < 2 && status != QMAT_OK; i++) {
      status = qmat_param_parse(&context, param, made.files[i], run.params);
      if (param->flags & QMAT_PARAM_INPUT_FILE) {
        status = qmat_node_run(&context, node, run.params, run.inputs, run.outputs);
        release_outputs(&run);
      }
    }
    if (status != QMAT_OK) fail_msg("%s: no file of this test fits '%s'; add one", node->name, param->name);
  }
  qmat_context_uninit(&context);
  return run;
}

/* Runs a node with default parameters, except `param`, and returns its output `port`. */
static qmat_value *make(const char *name, const char *port, world in, const char *param, const char *text) {
  const qmat_node *node = qmat_node_find(name);
  assert_non_null(node);
  qmat_context context = {0};
  subject run = {.node = node, .params = qmat_calloc(1, node->params_size)};
  qmat_params_default(node, run.params);
  if (param) assert_int_equal(qmat_param_parse(&context, qmat_param_find(node, param), text, run.params), QMAT_OK);
  use_world(&run, in);
  if (qmat_node_run(&context, node, run.params, run.inputs, run.outputs) != QMAT_OK)
    fail_msg("%s: %s", name, context.error.message);
  const size_t index = qmat_output_find(node, port);
  assert_int_not_equal(index, SIZE_MAX);
  qmat_value *value = qmat_value_retain(run.outputs[index]);
  subject_uninit(&run);
  qmat_context_uninit(&context);
  return value;
}

/* An unsealed chain without a collapse. */
static qmat_value *chain_of(const qmat_medial *medial) {
  qmat_chain *chain = qmat_chain_new();
  chain->sphere_count = medial->sphere_count;
  chain->edge_count = medial->edge_count;
  chain->triangle_count = medial->triangle_count;
  chain->spheres = shape_copy(medial->spheres, 4 * medial->sphere_count * sizeof(double));
  chain->edges = shape_copy(medial->edges, 2 * medial->edge_count * sizeof(uint32_t));
  chain->triangles = shape_copy(medial->triangles, 3 * medial->triangle_count * sizeof(uint32_t));
  return &chain->base;
}

static void save_model(const qmat_model *model, const char *path) {
  FILE *file = fopen(path, "w");
  assert_non_null(file);
  fprintf(file, "OFF\n%zu %zu 0\n", model->vertex_count, model->triangle_count);
  for (size_t i = 0; i < model->vertex_count; i++) {
    const double *p = model->positions + 3 * i;
    fprintf(file, "%.17g %.17g %.17g\n", p[0], p[1], p[2]);
  }
  for (size_t i = 0; i < model->triangle_count; i++) {
    const uint32_t *t = model->triangles + 3 * i;
    fprintf(file, "3 %u %u %u\n", t[0], t[1], t[2]);
  }
  assert_int_equal(fclose(file), 0);
}

static qmat_value *failure(void) {
  qmat_failure *made = qmat_failure_new();
  assert_non_null(made);
  made->reason = qmat_strdup("it is flat");
  return &made->base;
}

/* A list of the report twice. */
static qmat_value *list_of(const qmat_value *report) {
  qmat_list *list = qmat_list_new(2);
  assert_non_null(list);
  for (size_t i = 0; i < 2; i++) {
    list->items[i] = qmat_value_retain(report);
    list->names[i] = qmat_strdup("a report");
  }
  return &list->base;
}

static void make_solid(world to, const qmat_model *model) {
  qmat_value **values = made.values[to];
  save_model(model, made.files[0]);
  values[QMAT_SCENE] = make("scene.read", "scene", to, "path", made.files[0]);
  values[QMAT_MESH] = make("scene.read", "mesh", to, "path", made.files[0]);
  values[QMAT_FIELD] = make("mesh.sdf", "thickness", to, NULL, NULL);
  values[QMAT_SAMPLES] = make("mesh.sample", "samples", to, "spacing", "0");
  values[QMAT_MEDIAL] = make("medial.delaunay", "medial", to, NULL, NULL);
  qmat_value *simple = make("medial.simplify", "medial", to, "epsilon", "3%");
  qmat_value_release(values[QMAT_MEDIAL]);
  values[QMAT_MEDIAL] = simple;
  values[QMAT_REPORT] = make("medial.evaluate", "report", to, "epsilon", "3.1%"); /* storage moves spheres a little */
  seal(values[QMAT_CHAIN] = chain_of((const qmat_medial *)simple));
  values[QMAT_COLLIDERS] = make("medial.colliders", "colliders", to, "kind", "spheres");
  values[QMAT_FILE] = make("scene.write", "file", to, "format", "ma");
  seal(values[QMAT_FAILURE] = failure());
  seal(values[QMAT_LIST] = list_of(values[QMAT_REPORT]));
  print_message("%s: %zu facets, %zu samples, %zu medial spheres\n", world_names[to],
                ((const qmat_mesh *)values[QMAT_MESH])->triangle_count,
                ((const qmat_samples *)values[QMAT_SAMPLES])->count,
                ((const qmat_medial *)values[QMAT_MEDIAL])->sphere_count);
}

/* A family made by hand: a field of `thickness` per facet, the vertices as samples, and a medial mesh of a sphere with
 * that radius at each of the first `sphere_count` vertices, joined by all edges and triangles. */
static void make_by_hand(world to, const double *positions, size_t vertex_count, const uint32_t *triangles,
                         size_t triangle_count, bool closed, double thickness, size_t sphere_count) {
  qmat_value **values = made.values[to];
  qmat_scene *scene = qmat_scene_new();
  scene->name = qmat_strdup("");
  scene->format = qmat_strdup("");
  values[QMAT_SCENE] = &scene->base;
  qmat_mesh *mesh = qmat_mesh_new();
  mesh->vertex_count = vertex_count;
  mesh->triangle_count = triangle_count;
  mesh->positions = shape_copy(positions, 3 * vertex_count * sizeof *positions);
  mesh->triangles = shape_copy(triangles, 3 * triangle_count * sizeof *triangles);
  mesh->closed = mesh->oriented = closed;
  values[QMAT_MESH] = &mesh->base;
  qmat_field *field = qmat_field_new();
  field->count = triangle_count;
  field->values = qmat_alloc(triangle_count, sizeof *field->values);
  for (size_t i = 0; i < triangle_count; i++) field->values[i] = thickness;
  field->domain = QMAT_PER_FACET;
  field->unit = qmat_strdup("model unit");
  values[QMAT_FIELD] = &field->base;
  qmat_samples *samples = qmat_samples_new();
  samples->count = samples->vertex_count = vertex_count;
  samples->positions = shape_copy(positions, 3 * vertex_count * sizeof *positions);
  samples->facets = qmat_calloc(vertex_count, sizeof *samples->facets);
  samples->barycentrics = qmat_calloc(3 * vertex_count, sizeof *samples->barycentrics);
  for (size_t i = 0; i < vertex_count; i++) {
    size_t corner = 0;
    while (triangles[corner] != i) corner++;
    samples->facets[i] = (uint32_t)(corner / 3);
    samples->barycentrics[3 * i + corner % 3] = 1;
  }
  values[QMAT_SAMPLES] = &samples->base;
  qmat_medial *medial = qmat_medial_new();
  medial->sphere_count = sphere_count;
  medial->spheres = qmat_alloc(4 * sphere_count, sizeof *medial->spheres);
  for (size_t i = 0; i < sphere_count; i++) {
    memcpy(medial->spheres + 4 * i, positions + 3 * i, 3 * sizeof *positions);
    medial->spheres[4 * i + 3] = thickness;
  }
  qmat_context context = {0};
  static const uint32_t edges[] = {0, 1, 0, 2, 1, 2}, slab[] = {0, 1, 2};
  assert_int_equal(qmat_medial_set_simplices(&context, medial, edges, sphere_count < 3 ? sphere_count / 2 : 3, slab,
                                             sphere_count == 3),
                   QMAT_OK);
  qmat_context_uninit(&context);
  values[QMAT_MEDIAL] = &medial->base;
  values[QMAT_CHAIN] = chain_of(medial);
  values[QMAT_REPORT] = &qmat_report_new()->base;
  qmat_file *file = qmat_file_new();
  file->format = qmat_strdup("ma");
  file->part_count = 1;
  file->parts = qmat_calloc(1, sizeof *file->parts);
  file->parts[0].name = qmat_strdup("");
  values[QMAT_FILE] = &file->base;
  values[QMAT_FAILURE] = failure();
  values[QMAT_COLLIDERS] = &qmat_colliders_new()->base;
  values[QMAT_LIST] = list_of(values[QMAT_REPORT]);
  for (int type = 0; type < QMAT_VALUE_TYPE_COUNT; type++) seal(values[type]);
}

static int make_fixture(void **state) {
  (void)state;
  json_set_alloc_funcs(__wrap_malloc, free);
  snprintf(made.folder, sizeof made.folder, "/tmp/qmat-every-node-XXXXXX");
  assert_non_null(mkdtemp(made.folder));
  snprintf(made.files[0], sizeof made.files[0], "%s/model.off", made.folder);
  snprintf(made.files[1], sizeof made.files[1], "%s/medial.ma", made.folder);
  /* Slender, since work grows with the area in squared diagonals. The second is made last, and its file stays. */
  qmat_model model;
  assert_int_equal(qmat_model_make_box(2, 0.3, 0.2, 6, &model), QMAT_OK);
  make_solid(WORLD_OTHER, &model);
  qmat_model_uninit(&model);
  assert_int_equal(qmat_model_make_sheet(2, 0.25, 0.15, 1, 4, &model), QMAT_OK);
  make_solid(WORLD_SOLID, &model);
  qmat_model_uninit(&model);
  const qmat_file_part *text = ((const qmat_file *)made.values[WORLD_SOLID][QMAT_FILE])->parts;
  FILE *file = fopen(made.files[1], "wb");
  assert_non_null(file);
  assert_int_equal(fwrite(text->bytes, 1, text->size, file), text->size);
  assert_int_equal(fclose(file), 0);

  static const double triangle[] = {0, 0, 0, 1, 0, 0, 0, 1, 0}, point[12] = {0};
  static const double huge[] = {0, 0, 0, 1e300, 0, 0, 0, 1e300, 0, 0, 0, 1e300};
  static const double tiny[] = {0, 0, 0, 1e-300, 0, 0, 0, 1e-300, 0, 0, 0, 1e-300};
  static const uint32_t front[] = {0, 1, 2}, both[] = {0, 1, 2, 2, 1, 0};
  static const uint32_t four[] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  make_by_hand(WORLD_EMPTY, NULL, 0, NULL, 0, true, 0, 0);
  make_by_hand(WORLD_TRIANGLE, triangle, 3, front, 1, false, 0, 1);
  make_by_hand(WORLD_FLAT, triangle, 3, both, 2, true, 0, 3);
  make_by_hand(WORLD_POINT, point, 4, four, 4, true, 0, 3);
  make_by_hand(WORLD_HUGE, huge, 4, four, 4, true, 1e300, 3);
  make_by_hand(WORLD_TINY, tiny, 4, four, 4, true, 1e-300, 3);
  return 0;
}

static int free_fixture(void **state) {
  (void)state;
  for (int from = 0; from < WORLD_COUNT; from++)
    for (int type = 0; type < QMAT_VALUE_TYPE_COUNT; type++) qmat_value_release(made.values[from][type]);
  unlink(made.files[0]);
  unlink(made.files[1]);
  rmdir(made.folder);
  return 0;
}

/* ---- descriptors ---- */

/* A lower-case letter, then such letters, digits and '_'. Returns the first character that does not belong to it. */
static const char *after_name(const char *text) {
  if (*text < 'a' || *text > 'z') return text;
  while ((*text >= 'a' && *text <= 'z') || (*text >= '0' && *text <= '9') || *text == '_') text++;
  return text;
}

static void test_names_are_group_dot_operator_sorted_and_unique(void **state) {
  (void)state;
  assert_true(qmat_node_count > 0);
  for (size_t i = 0; i < qmat_node_count; i++) {
    const qmat_node *node = qmat_nodes[i];
    const char *dot = after_name(node->name);
    if (*dot != '.' || *after_name(dot + 1) != 0 || dot == node->name || dot[1] == 0)
      fail_msg("'%s' is not of the form group.operator", node->name);
    assert_true(strlen(node->name) < sizeof((qmat_error *)0)->node_type);
    if (i > 0 && strcmp(qmat_nodes[i - 1]->name, node->name) >= 0) fail_msg("%s is not sorted", node->name);
    assert_ptr_equal(qmat_node_find(node->name), node);
    assert_true(node->version >= 1);
    assert_non_null(node->run);
  }
  assert_null(qmat_node_find("mesh.nothing"));
}

/* One line that starts with a capital, or with one of the node's choices and a colon ("envelope: ..."). */
static void check_line(const qmat_node *node, const char *of, const char *text) {
  if (!text || !*text) fail_msg("%s: '%s' has no text", node->name, of);
  const size_t length = strlen(text);
  if (strchr(text, '\n')) fail_msg("%s: the text of '%s' is more than a line", node->name, of);
  if (text[length - 1] == '.' || text[length - 1] == ' ') fail_msg("%s: '%s' ends in a full stop", node->name, of);
  if (text[0] >= 'A' && text[0] <= 'Z') return;
  for (size_t row = 0; row < qmat_param_count(node); row++) {
    const char *const *choices = node->params[row].choices;
    for (size_t i = 0; choices && choices[i]; i++)
      if (strncmp(text, choices[i], strlen(choices[i])) == 0 && text[strlen(choices[i])] == ':') return;
  }
  fail_msg("%s: the text of '%s' does not start with a capital: %s", node->name, of, text);
}

static void test_every_text_is_there_and_reads_alike(void **state) {
  (void)state;
  for (size_t i = 0; i < qmat_node_count; i++) {
    const qmat_node *node = qmat_nodes[i];
    check_line(node, "summary", node->summary);
    /* What the node does, in the third person: "Makes ...", "Reads ...". */
    const size_t verb = strcspn(node->summary, " ");
    if (node->summary[verb - 1] != 's') fail_msg("%s: not as in \"Makes ...\": %s", node->name, node->summary);
    if (!node->doc || !*node->doc || node->doc[strlen(node->doc) - 1] != '.' || strstr(node->doc, "  "))
      fail_msg("%s: the description is not made of sentences", node->name);
    assert_non_null(node->citation);
    if (*node->citation) check_line(node, "citation", node->citation);
    for (size_t row = 0; row < qmat_param_count(node); row++)
      check_line(node, node->params[row].name, node->params[row].doc);
    for (size_t port = 0; port < qmat_input_count(node); port++)
      check_line(node, node->inputs[port].name, node->inputs[port].doc);
    for (size_t port = 0; port < qmat_output_count(node); port++)
      check_line(node, node->outputs[port].name, node->outputs[port].doc);
  }
}

/* The runner merges reports by these entries and would leave out the summary of a report that lacks one. */
static void test_a_report_has_what_its_summary_needs(void **state) {
  (void)state;
  size_t checked = 0;
  for (size_t i = 0; i < qmat_node_count; i++) {
    const qmat_node *node = qmat_nodes[i];
    if (!node->report_summary) continue;
    assert_non_null(node->report_summary->sentence);
    qmat_context context = {0};
    subject run = subject_of(node);
    assert_int_equal(qmat_node_run(&context, node, run.params, run.inputs, run.outputs), QMAT_OK);
    size_t port = 0;
    while (port < qmat_output_count(node) && node->outputs[port].type != QMAT_REPORT) port++;
    if (port == qmat_output_count(node)) fail_msg("%s: has a summary but no report", node->name);
    for (const qmat_summary_entry *entry = node->report_summary->entries; entry->key; entry++) {
      const json_t *value = json_object_get(((const qmat_report *)run.outputs[port])->root, entry->key);
      const bool is_sum = entry->kind == QMAT_SUMMARY_SUM, is_bound = entry->kind == QMAT_SUMMARY_BOUND;
      if ((is_sum && !json_is_integer(value)) || (is_bound && !json_is_real(value)))
        fail_msg("%s: its report lacks '%s'", node->name, entry->key);
      checked += is_sum || is_bound;
    }
    subject_uninit(&run);
    qmat_context_uninit(&context);
  }
  assert_true(checked >= 4);
}

static size_t size_of_type(qmat_param_type type) {
  switch (type) {
    case QMAT_PARAM_BOOL:
      return sizeof(bool);
    case QMAT_PARAM_INT:
      return sizeof(int64_t);
    case QMAT_PARAM_FLOAT:
      return sizeof(double);
    case QMAT_PARAM_ENUM:
      return sizeof(int);
    default:
      return sizeof(const char *);
  }
}

static void check_flags(const qmat_node *node, const qmat_param *param) {
  const bool is_text = param->type == QMAT_PARAM_STRING || param->type == QMAT_PARAM_PATH;
  if ((param->flags & QMAT_PARAM_REQUIRED) && (!is_text || param->default_text))
    fail_msg("%s: only texts without a default are required, not '%s'", node->name, param->name);
  if (is_text && !(param->flags & QMAT_PARAM_REQUIRED) && !param->default_text)
    fail_msg("%s: '%s' has no default and is not required", node->name, param->name);
  if ((param->flags & QMAT_PARAM_RELATIVE) && (param->type != QMAT_PARAM_FLOAT || strcmp(param->unit, "diagonal") != 0))
    fail_msg("%s: '%s' is relative, so it is a number of diagonals", node->name, param->name);
  if ((param->flags & QMAT_PARAM_OUTPUT_FORMAT) && param->type != QMAT_PARAM_ENUM)
    fail_msg("%s: a format is an enum, unlike '%s'", node->name, param->name);
  if ((param->flags & QMAT_PARAM_INPUT_FILE) && param->type != QMAT_PARAM_PATH)
    fail_msg("%s: a file is a path, unlike '%s'", node->name, param->name);
}

static void check_default(const qmat_node *node, const qmat_param *param) {
  const double number = param->default_number;
  size_t choices = 0;
  while (param->choices && param->choices[choices]) choices++;
  switch (param->type) {
    case QMAT_PARAM_BOOL:
      assert_true(number == 0 || number == 1);
      break;
    case QMAT_PARAM_INT:
      assert_true(number == floor(number) && param->min == floor(param->min) && param->max == floor(param->max));
      assert_true(fabs(param->min) <= 0x1p53 && fabs(param->max) <= 0x1p53);
      /* fall through */
    case QMAT_PARAM_FLOAT:
      assert_true(isfinite(param->min) && isfinite(param->max) && param->min < param->max);
      if (!(number >= param->min && number <= param->max))
        fail_msg("%s: the default of '%s' is out of its range", node->name, param->name);
      if (!*param->unit) fail_msg("%s: '%s' has no unit; \"1\" is that of a plain number", node->name, param->name);
      break;
    case QMAT_PARAM_ENUM:
      if (choices < 2) fail_msg("%s: '%s' leaves no choice", node->name, param->name);
      assert_true(number == floor(number) && number >= 0 && number < (double)choices);
      for (size_t i = 0; i < choices; i++) {
        if (*after_name(param->choices[i])) fail_msg("%s: '%s' is no name", node->name, param->choices[i]);
        for (size_t k = 0; k < i; k++) assert_string_not_equal(param->choices[i], param->choices[k]);
      }
      break;
    default:
      break;
  }
  if (param->type != QMAT_PARAM_ENUM && param->choices)
    fail_msg("%s: '%s' has choices and is no enum", node->name, param->name);
}

static void test_parameters_have_a_name_a_unit_a_default_and_a_place_of_their_own(void **state) {
  (void)state;
  for (size_t i = 0; i < qmat_node_count; i++) {
    const qmat_node *node = qmat_nodes[i];
    size_t formats = 0;
    for (size_t row = 0; row < qmat_param_count(node); row++) {
      const qmat_param *param = &node->params[row];
      if (*after_name(param->name)) fail_msg("%s: '%s' is no name", node->name, param->name);
      if (!param->unit) fail_msg("%s: '%s' has no unit; \"\" is that of what is not a number", node->name, param->name);
      check_flags(node, param);
      check_default(node, param);
      if (param->flags & QMAT_PARAM_OUTPUT_FORMAT) formats++;
      const size_t size = size_of_type(param->type);
      if (param->offset % size != 0 || param->offset + size > node->params_size)
        fail_msg("%s: '%s' lies outside the parameters", node->name, param->name);
      for (size_t k = 0; k < row; k++) {
        const qmat_param *other = &node->params[k];
        assert_string_not_equal(param->name, other->name);
        if (param->offset < other->offset + size_of_type(other->type) && other->offset < param->offset + size)
          fail_msg("%s: '%s' and '%s' share their place", node->name, param->name, other->name);
      }
      assert_ptr_equal(qmat_param_find(node, param->name), param);
    }
    assert_in_range(formats, 0, 1);
  }
}

static void check_ports(const qmat_node *node, const qmat_port *ports, size_t count) {
  for (size_t i = 0; i < count; i++) {
    if (*after_name(ports[i].name)) fail_msg("%s: '%s' is no name", node->name, ports[i].name);
    assert_in_range(ports[i].type, 0, QMAT_VALUE_TYPE_COUNT - 1);
    for (size_t k = 0; k < i; k++) assert_string_not_equal(ports[i].name, ports[k].name);
  }
}

static void test_ports_have_a_name_of_their_own_and_a_type(void **state) {
  (void)state;
  for (size_t i = 0; i < qmat_node_count; i++) {
    const qmat_node *node = qmat_nodes[i];
    check_ports(node, node->inputs, qmat_input_count(node));
    check_ports(node, node->outputs, qmat_output_count(node));
    assert_in_range(qmat_output_count(node), 1, MOST_PORTS);
    for (size_t port = 0; port < qmat_output_count(node); port++) assert_false(node->outputs[port].optional);
    /* A parameter and an input of one name could not be told apart in an error. */
    for (size_t port = 0; port < qmat_input_count(node); port++)
      assert_null(qmat_param_find(node, node->inputs[port].name));
  }
}

/* ---- running ---- */

static void check_outputs(const subject *run) {
  for (size_t i = 0; i < qmat_output_count(run->node); i++) {
    const qmat_value *value = run->outputs[i];
    assert_non_null(value);
    assert_true(value->sealed);
    assert_int_equal(value->type, run->node->outputs[i].type);
  }
}

static void check_no_outputs(const subject *run) {
  for (size_t i = 0; i < qmat_output_count(run->node); i++) assert_null(run->outputs[i]);
}

static qmat_status execute(qmat_context *context, subject *run) {
  release_outputs(run);
  const qmat_status status = qmat_node_run(context, run->node, run->params, run->inputs, run->outputs);
  if (status == QMAT_OK) {
    check_outputs(run);
  } else {
    check_no_outputs(run);
    assert_int_equal(context->error.status, status);
    assert_string_equal(context->error.node_type, run->node->name);
    assert_true(context->error.message[0] != 0);
  }
  return status;
}

/* The digests of all outputs. */
typedef struct digests {
  qmat_digest of[MOST_PORTS];
} digests;

static digests digests_of(const subject *run) {
  digests all = {0};
  for (size_t i = 0; i < qmat_output_count(run->node); i++) all.of[i] = run->outputs[i]->digest;
  return all;
}

static void check_same(const subject *run, const digests *expected, const char *what) {
  const digests got = digests_of(run);
  for (size_t i = 0; i < qmat_output_count(run->node); i++)
    if (memcmp(&got.of[i], &expected->of[i], sizeof got.of[i]) != 0)
      fail_msg("%s: '%s' has other bytes %s", run->node->name, run->node->outputs[i].name, what);
}

/* Stops a run after a time, or after a number of progress calls. */
typedef struct stopper {
  double deadline; /* 0: none */
  size_t calls, stop_at;
  qmat_context *context; /* set: progress is reported at every opportunity; NULL: as usual */
  double stopped;        /* when; 0: not yet */
} stopper;

static bool may_go_on(void *user, const char *node_id, const char *node_type, uint64_t done, uint64_t total,
                      const char *unit) {
  (void)node_id;
  stopper *watch = user;
  assert_non_null(node_type);
  assert_non_null(unit);
  if (total > 0) assert_true(done <= total);
  const double time = now();
  if (watch->stopped > 0) fail_msg("%s asks again after it was told to stop", node_type);
  if (watch->context) watch->context->progress_time = 0;
  if (watch->calls++ < watch->stop_at && (watch->deadline == 0 || time < watch->deadline)) return true;
  watch->stopped = time;
  return false;
}

/* Runs for at most PATIENCE seconds; true if the run ended by itself. */
static bool execute_patiently(qmat_context *context, subject *run, qmat_status *status) {
  stopper watch = {.deadline = now() + PATIENCE, .stop_at = SIZE_MAX};
  context->progress = may_go_on;
  context->progress_user = &watch;
  *status = execute(context, run);
  context->progress = NULL;
  if (watch.stopped == 0) {
    assert_int_not_equal(*status, QMAT_CANCELLED);
    return true;
  }
  assert_int_equal(*status, QMAT_CANCELLED);
  if (now() - watch.stopped > LATENCY) fail_msg("%s took too long to stop", run->node->name);
  return false;
}

static void test_defaults_pass_the_check_and_run(void **state) {
  (void)state;
  for (size_t i = 0; i < qmat_node_count; i++) {
    subject run = subject_of(qmat_nodes[i]);
    for (size_t row = 0; row < qmat_param_count(run.node); row++) {
      const qmat_param *param = &run.node->params[row];
      if (param->flags & QMAT_PARAM_RELATIVE)
        memcpy((char *)run.params + param->offset, &param->default_number, sizeof param->default_number);
    }
    qmat_context context = {0};
    if (qmat_params_check(&context, run.node, run.params) != QMAT_OK || execute(&context, &run) != QMAT_OK)
      fail_msg("%s: %s", run.node->name, context.error.message);
    for (size_t port = 0; port < qmat_output_count(run.node); port++) {
      /* An input that passes through is also referenced by its owners. */
      bool is_input = false;
      for (size_t k = 0; k < qmat_input_count(run.node); k++) is_input = is_input || run.inputs[k] == run.outputs[port];
      if (!is_input) assert_int_equal(run.outputs[port]->references, 1);
    }
    qmat_context_uninit(&context);
    subject_uninit(&run);
  }
}

static void test_optional_inputs_may_be_left_out(void **state) {
  (void)state;
  for (size_t i = 0; i < qmat_node_count; i++) {
    subject run = subject_of(qmat_nodes[i]);
    qmat_context context = {0};
    for (size_t left_out = 0; left_out <= qmat_input_count(run.node); left_out++) {
      use_world(&run, WORLD_SOLID);
      for (size_t port = 0; port < qmat_input_count(run.node); port++)
        if (run.node->inputs[port].optional && (left_out == qmat_input_count(run.node) || left_out == port))
          run.inputs[port] = NULL;
      if (execute(&context, &run) != QMAT_OK) fail_msg("%s: %s", run.node->name, context.error.message);
    }
    qmat_context_uninit(&context);
    subject_uninit(&run);
  }
}

static bool is_named(const qmat_node *node, const qmat_error *error) {
  if (error->element >= 0 && error->element_kind[0]) return true;
  if (qmat_param_find(node, error->field)) return true;
  return qmat_input_find(node, error->field) != SIZE_MAX;
}

/* Sets one parameter: the node runs, or refuses the parameter by name. */
static void try_param(const qmat_node *node, const qmat_param *param, const char *text) {
  subject run = subject_of(node);
  qmat_context context = {.threads = 2};
  qmat_status status = qmat_param_parse(&context, param, text, run.params);
  if (status != QMAT_OK) fail_msg("%s: %s=%s: %s", node->name, param->name, text, context.error.message);
  char written[64];
  qmat_param_format(param, run.params, written, sizeof written);
  assert_int_equal(qmat_param_parse(&context, param, text, run.params), QMAT_OK);
  status = qmat_params_check(&context, node, run.params);
  const double start = now();
  if (status == QMAT_OK && !execute_patiently(&context, &run, &status))
    print_message("%s: %s=%s was stopped after %.1f s\n", node->name, param->name, text, now() - start);
  /* A choice can make another parameter invalid, such as the spacing of an algorithm that is not the default. */
  const qmat_error *error = &context.error;
  const bool names_it =
      param->type == QMAT_PARAM_ENUM ? is_named(node, error) : strcmp(error->field, param->name) == 0 || error->file[0];
  const bool is_refusal = status == QMAT_ERROR_USAGE || status == QMAT_ERROR_GEOMETRY || status == QMAT_ERROR_IO ||
                          status == QMAT_ERROR_FORMAT || status == QMAT_ERROR_MEMORY;
  if (status != QMAT_OK && status != QMAT_CANCELLED && !(is_refusal && names_it))
    fail_msg("%s: %s=%s: %s: %s", node->name, param->name, text, qmat_status_name(status), error->message);
  qmat_context_uninit(&context);
  subject_uninit(&run);
}

static void test_every_parameter_at_its_bounds_runs_or_is_refused_by_name(void **state) {
  (void)state;
  for (size_t i = 0; i < qmat_node_count; i++) {
    const qmat_node *node = qmat_nodes[i];
    for (size_t row = 0; row < qmat_param_count(node); row++) {
      const qmat_param *param = &node->params[row];
      char text[128];
      switch (param->type) {
        case QMAT_PARAM_BOOL:
          try_param(node, param, "true");
          try_param(node, param, "false");
          break;
        case QMAT_PARAM_ENUM:
          for (size_t k = 0; param->choices[k]; k++) try_param(node, param, param->choices[k]);
          break;
        case QMAT_PARAM_INT:
        case QMAT_PARAM_FLOAT:
          qmat_format_number(param->min, text, sizeof text);
          try_param(node, param, text);
          qmat_format_number(param->max, text, sizeof text);
          try_param(node, param, text);
          /* Divisions by tiny values overflow. */
          if (param->type == QMAT_PARAM_FLOAT && param->min <= 0) try_param(node, param, "1e-300");
          break;
        default:
          snprintf(text, sizeof text, "%s/not-there", made.folder);
          try_param(node, param, text);
          try_param(node, param, made.folder);
          break;
      }
    }
  }
}

/* The meshes of the tests have no unit, so a length with a unit is refused by name, before the node runs. */
static void test_every_length_may_have_a_unit_and_needs_a_model_with_one(void **state) {
  (void)state;
  for (size_t i = 0; i < qmat_node_count; i++) {
    const qmat_node *node = qmat_nodes[i];
    for (size_t row = 0; row < qmat_param_count(node); row++) {
      const qmat_param *param = &node->params[row];
      if (!(param->flags & QMAT_PARAM_RELATIVE)) continue;
      subject run = subject_of(node);
      qmat_context context = {0};
      assert_int_equal(qmat_param_parse(&context, param, "5mm", run.params), QMAT_OK);
      assert_int_equal(qmat_params_check(&context, node, run.params), QMAT_OK);
      assert_int_equal(execute(&context, &run), QMAT_ERROR_USAGE);
      assert_string_equal(context.error.field, param->name);
      assert_non_null(strstr(context.error.message, "has no unit of length"));
      qmat_context_uninit(&context);
      subject_uninit(&run);
    }
  }
}

static void check_refused(const qmat_node *node, const qmat_param *param, const char *text) {
  qmat_context context = {0};
  void *params = qmat_calloc(1, node->params_size);
  qmat_params_default(node, params);
  if (qmat_param_parse(&context, param, text, params) != QMAT_ERROR_USAGE)
    fail_msg("%s: %s=%s is taken", node->name, param->name, text);
  assert_string_equal(context.error.field, param->name);
  qmat_free(params);
}

static void test_parameters_beyond_their_bounds_are_refused_by_name(void **state) {
  (void)state;
  for (size_t i = 0; i < qmat_node_count; i++) {
    const qmat_node *node = qmat_nodes[i];
    for (size_t row = 0; row < qmat_param_count(node); row++) {
      const qmat_param *param = &node->params[row];
      const bool is_int = param->type == QMAT_PARAM_INT;
      if (param->type == QMAT_PARAM_STRING || param->type == QMAT_PARAM_PATH) continue;
      check_refused(node, param, "");
      check_refused(node, param, "maybe");
      check_refused(node, param, "nan");
      if (param->type == QMAT_PARAM_BOOL || param->type == QMAT_PARAM_ENUM) continue;
      char text[64];
      qmat_format_number(is_int ? param->min - 1 : nextafter(param->min, -INFINITY), text, sizeof text);
      check_refused(node, param, text);
      qmat_format_number(is_int ? param->max + 1 : nextafter(param->max, INFINITY), text, sizeof text);
      check_refused(node, param, text);
      check_refused(node, param, "1e999");
      if (is_int) check_refused(node, param, "1.5");
    }
  }
}

static void compare_threads(subject *run, const char *what) {
  static const int threads[] = {1, 1, 2, 8};
  digests first = {0};
  for (size_t i = 0; i < sizeof threads / sizeof threads[0]; i++) {
    qmat_context context = {.threads = threads[i]};
    if (execute(&context, run) != QMAT_OK) fail_msg("%s%s: %s", run->node->name, what, context.error.message);
    char text[96];
    snprintf(text, sizeof text, "on %d threads%s", threads[i], what);
    if (i == 0) first = digests_of(run);
    check_same(run, &first, text);
    qmat_context_uninit(&context);
  }
}

/* Calls `visit` with the node's defaults, and with every other choice of each enum, which can select another algorithm.
 */
static void for_each_choice(const qmat_node *node, void (*visit)(subject *run, const char *what)) {
  subject run = subject_of(node);
  visit(&run, "");
  subject_uninit(&run);
  for (size_t row = 0; row < qmat_param_count(node); row++) {
    const qmat_param *param = &node->params[row];
    for (int choice = 0; param->type == QMAT_PARAM_ENUM && param->choices[choice]; choice++) {
      if (choice == (int)param->default_number) continue;
      run = subject_of(node);
      memcpy((char *)run.params + param->offset, &choice, sizeof choice);
      char what[64];
      snprintf(what, sizeof what, " with %s=%s", param->name, param->choices[choice]);
      visit(&run, what);
      subject_uninit(&run);
    }
  }
}

static void test_any_number_of_threads_and_any_run_gives_the_same_bytes(void **state) {
  (void)state;
  for (size_t i = 0; i < qmat_node_count; i++) for_each_choice(qmat_nodes[i], compare_threads);
}

/* The digest of the value's present content, not of its content when it was sealed. */
static qmat_digest digest_now(const qmat_value *value) {
  qmat_context context = {0};
  uint8_t *bytes;
  size_t size;
  assert_int_equal(qmat_value_serialize(&context, value, &bytes, &size), QMAT_OK);
  qmat_hasher hasher;
  qmat_digest digest;
  assert_int_equal(qmat_hasher_init(&hasher), QMAT_OK);
  qmat_hasher_add(&hasher, bytes, size);
  assert_int_equal(qmat_hasher_finish(&hasher, &digest), QMAT_OK);
  qmat_free(bytes);
  qmat_context_uninit(&context);
  return digest;
}

static void test_inputs_and_parameters_are_left_as_they_were(void **state) {
  (void)state;
  for (size_t i = 0; i < qmat_node_count; i++) {
    subject run = subject_of(qmat_nodes[i]);
    const size_t count = qmat_input_count(run.node);
    void *params = shape_copy(run.params, run.node->params_size);
    unsigned references[MOST_PORTS];
    for (size_t port = 0; port < count; port++) references[port] = run.inputs[port]->references;
    qmat_context context = {.threads = 2};
    assert_int_equal(execute(&context, &run), QMAT_OK);
    release_outputs(&run);
    for (size_t port = 0; port < count; port++) {
      const qmat_digest digest = digest_now(run.inputs[port]);
      if (memcmp(&digest, &run.inputs[port]->digest, sizeof digest) != 0)
        fail_msg("%s changes its input '%s'", run.node->name, run.node->inputs[port].name);
      assert_int_equal(run.inputs[port]->references, references[port]);
    }
    if (run.node->params_size > 0) assert_memory_equal(params, run.params, run.node->params_size);
    qmat_free(params);
    qmat_context_uninit(&context);
    subject_uninit(&run);
  }
}

/* ---- bad inputs ---- */

static qmat_value *new_value(qmat_value_type type) {
  switch (type) {
    case QMAT_SCENE:
      return &qmat_scene_new()->base;
    case QMAT_MESH:
      return &qmat_mesh_new()->base;
    case QMAT_FIELD:
      return &qmat_field_new()->base;
    case QMAT_SAMPLES:
      return &qmat_samples_new()->base;
    case QMAT_MEDIAL:
      return &qmat_medial_new()->base;
    case QMAT_CHAIN:
      return &qmat_chain_new()->base;
    case QMAT_REPORT:
      return &qmat_report_new()->base;
    case QMAT_COLLIDERS:
      return &qmat_colliders_new()->base;
    default:
      return &qmat_file_new()->base;
  }
}

static void check_port_refused(subject *run, size_t port, const char *what) {
  qmat_context context = {0};
  const qmat_status status = execute(&context, run);
  if (status != QMAT_ERROR_USAGE || strcmp(context.error.field, run->node->inputs[port].name) != 0)
    fail_msg("%s: '%s' may be %s", run->node->name, run->node->inputs[port].name, what);
  qmat_context_uninit(&context);
}

static void test_missing_unsealed_and_wrong_inputs_are_refused_by_name(void **state) {
  (void)state;
  for (size_t i = 0; i < qmat_node_count; i++) {
    subject run = subject_of(qmat_nodes[i]);
    for (size_t port = 0; port < qmat_input_count(run.node); port++) {
      use_world(&run, WORLD_SOLID);
      const qmat_value_type type = run.node->inputs[port].type;
      if (!run.node->inputs[port].optional) {
        run.inputs[port] = NULL;
        check_port_refused(&run, port, "missing");
      }
      run.inputs[port] = made.values[WORLD_SOLID][(type + 1) % QMAT_VALUE_TYPE_COUNT];
      check_port_refused(&run, port, "of another type");
      qmat_value *open = new_value(type);
      run.inputs[port] = open;
      check_port_refused(&run, port, "unsealed");
      qmat_value_release(open);
    }
    subject_uninit(&run);
  }
}

/* A result, or an error that names a port, a parameter or an element. */
static qmat_status check_result_or_clear_error(subject *run, const char *what) {
  qmat_context context = {.threads = 2};
  qmat_status status;
  execute_patiently(&context, run, &status);
  const bool is_clear = status == QMAT_OK || status == QMAT_CANCELLED ||
                        ((status == QMAT_ERROR_USAGE || status == QMAT_ERROR_GEOMETRY || status == QMAT_ERROR_MEMORY) &&
                         is_named(run->node, &context.error));
  char line[1024];
  qmat_error_format(&context.error, line, sizeof line);
  if (!is_clear) fail_msg("%s with %s: %s: %s", run->node->name, what, qmat_status_name(status), line);
  qmat_context_uninit(&context);
  return status;
}

static void test_odd_values_give_a_result_or_an_error_that_names_what_is_at_fault(void **state) {
  (void)state;
  for (size_t i = 0; i < qmat_node_count; i++) {
    subject run = subject_of(qmat_nodes[i]);
    for (int from = WORLD_SOLID + 1; from < WORLD_COUNT; from++) {
      char what[128];
      snprintf(what, sizeof what, "%s at every input", world_names[from]);
      use_world(&run, (world)from);
      check_result_or_clear_error(&run, what);
      for (size_t port = 0; port < qmat_input_count(run.node); port++) {
        use_world(&run, WORLD_SOLID);
        run.inputs[port] = made.values[from][run.node->inputs[port].type];
        snprintf(what, sizeof what, "%s at '%s'", world_names[from], run.node->inputs[port].name);
        check_result_or_clear_error(&run, what);
      }
    }
    subject_uninit(&run);
  }
}

static void test_an_empty_mesh_and_an_empty_medial_mesh_are_refused(void **state) {
  (void)state;
  for (size_t i = 0; i < qmat_node_count; i++) {
    subject run = subject_of(qmat_nodes[i]);
    for (size_t port = 0; port < qmat_input_count(run.node); port++) {
      const qmat_port *input = &run.node->inputs[port];
      if (input->optional || (input->type != QMAT_MESH && input->type != QMAT_MEDIAL)) continue;
      use_world(&run, WORLD_EMPTY);
      if (check_result_or_clear_error(&run, "nothing") == QMAT_OK)
        fail_msg("%s makes something of nothing", run.node->name);
      use_world(&run, WORLD_SOLID);
      run.inputs[port] = made.values[WORLD_EMPTY][input->type];
      if (check_result_or_clear_error(&run, "nothing") == QMAT_OK)
        fail_msg("%s takes an empty '%s'", run.node->name, input->name);
    }
    subject_uninit(&run);
  }
}

/* Thickness and medial spheres are measured in the solid that a surface encloses. A node that makes them from a mesh
 * refuses a single triangle; nodes that take a medial mesh too may still have a result. */
static void test_one_triangle_that_encloses_nothing_is_refused(void **state) {
  (void)state;
  size_t tested = 0;
  for (size_t i = 0; i < qmat_node_count; i++) {
    subject run = subject_of(qmat_nodes[i]);
    bool takes_mesh = false, takes_medial = false, measures = false;
    for (size_t port = 0; port < qmat_input_count(run.node); port++) {
      takes_mesh = takes_mesh || run.node->inputs[port].type == QMAT_MESH;
      takes_medial = takes_medial || run.node->inputs[port].type == QMAT_MEDIAL;
    }
    for (size_t port = 0; port < qmat_output_count(run.node); port++)
      measures = measures || run.node->outputs[port].type == QMAT_FIELD || run.node->outputs[port].type == QMAT_MEDIAL;
    if (takes_mesh && !takes_medial && measures) {
      use_world(&run, WORLD_TRIANGLE);
      if (check_result_or_clear_error(&run, "one triangle") != QMAT_ERROR_GEOMETRY)
        fail_msg("%s makes something of one triangle", run.node->name);
      tested++;
    }
    subject_uninit(&run);
  }
  assert_true(tested >= 2);
}

/* A field or samples of another mesh. */
static void test_values_that_do_not_belong_together_are_refused(void **state) {
  (void)state;
  static const world others[] = {WORLD_OTHER, WORLD_EMPTY, WORLD_TRIANGLE, WORLD_FLAT};
  for (size_t i = 0; i < qmat_node_count; i++) {
    subject run = subject_of(qmat_nodes[i]);
    bool has_mesh = false;
    for (size_t port = 0; port < qmat_input_count(run.node); port++)
      if (run.node->inputs[port].type == QMAT_MESH) has_mesh = true;
    for (size_t port = 0; port < qmat_input_count(run.node); port++) {
      const qmat_value_type type = run.node->inputs[port].type;
      if (!has_mesh || (type != QMAT_FIELD && type != QMAT_SAMPLES)) continue;
      for (size_t k = 0; k < sizeof others / sizeof others[0]; k++) {
        use_world(&run, WORLD_SOLID);
        run.inputs[port] = made.values[others[k]][type];
        if (check_result_or_clear_error(&run, world_names[others[k]]) == QMAT_OK)
          fail_msg("%s takes a '%s' of another mesh (%s)", run.node->name, run.node->inputs[port].name,
                   world_names[others[k]]);
      }
    }
    subject_uninit(&run);
  }
}

static void test_numbers_that_are_not_finite_cannot_be_sealed(void **state) {
  (void)state;
  static const double bad[] = {NAN, INFINITY, -INFINITY};
  for (size_t k = 0; k < sizeof bad / sizeof bad[0]; k++) {
    qmat_context context = {0};
    qmat_value *values[4];
    qmat_mesh *mesh = qmat_mesh_new();
    mesh->vertex_count = 2;
    mesh->positions = shape_copy((double[]){0, 0, 0, 0, bad[k], 0}, 6 * sizeof(double));
    values[0] = &mesh->base;
    qmat_field *field = qmat_field_new();
    field->count = 2;
    field->unit = qmat_strdup("1");
    field->values = shape_copy((double[]){0, bad[k]}, 2 * sizeof(double));
    values[1] = &field->base;
    qmat_samples *samples = qmat_samples_new();
    samples->count = 2;
    samples->positions = shape_copy((double[]){0, 0, 0, 0, 0, bad[k]}, 6 * sizeof(double));
    samples->facets = qmat_calloc(2, sizeof *samples->facets);
    samples->barycentrics = shape_copy((double[]){1, 0, 0, 1, 0, 0}, 6 * sizeof(double));
    values[2] = &samples->base;
    qmat_medial *medial = qmat_medial_new();
    medial->sphere_count = 2;
    medial->spheres = shape_copy((double[]){0, 0, 0, 1, 0, 0, 0, bad[k]}, 8 * sizeof(double));
    values[3] = &medial->base;
    for (size_t i = 0; i < 4; i++) {
      assert_int_equal(qmat_value_seal(&context, values[i]), QMAT_ERROR_GEOMETRY);
      assert_int_equal(context.error.element, 1);
      assert_false(values[i]->sealed);
      qmat_value_release(values[i]);
    }
    qmat_context_uninit(&context);
  }
}

/* ---- being stopped, and running out of memory ---- */

/* The `index`-th of at most `most` points spread evenly over `count`, with both ends. */
static size_t spread(size_t index, size_t count, size_t most) {
  return count <= most ? index : index * (count - 1) / (most - 1);
}

static void test_a_cancelled_run_has_no_outputs(void **state) {
  (void)state;
  for (size_t i = 0; i < qmat_node_count; i++) {
    subject run = subject_of(qmat_nodes[i]);
    qmat_context context = {.threads = 2};
    stopper watch = {.stop_at = SIZE_MAX, .context = &context};
    context.progress = may_go_on;
    context.progress_user = &watch;
    assert_int_equal(execute(&context, &run), QMAT_OK);
    const digests whole = digests_of(&run);
    const size_t calls = watch.calls, tries = calls < MOST_STOPS ? calls : MOST_STOPS;
    if (calls == 0) fail_msg("%s never reports progress, so it cannot be cancelled", run.node->name);
    for (size_t k = 0; k < tries; k++) {
      watch = (stopper){.stop_at = spread(k, calls, MOST_STOPS), .context = &context};
      context.progress_time = 0;
      assert_int_equal(execute(&context, &run), QMAT_CANCELLED);
      assert_true(watch.stopped > 0);
    }
    context.progress = NULL;
    assert_int_equal(execute(&context, &run), QMAT_OK);
    check_same(&run, &whole, "after a cancelled run");
    qmat_context_uninit(&context);
    subject_uninit(&run);
  }
}

static void try_shortages(subject *run, const char *what) {
  qmat_context context = {.threads = 1};
  shortage(SIZE_MAX, 0);
  const qmat_status usual = qmat_node_run(&context, run->node, run->params, run->inputs, run->outputs);
  const size_t needed = atomic_load(&asked);
  if (usual != QMAT_OK) fail_msg("%s%s: %s", run->node->name, what, context.error.message);
  const digests whole = digests_of(run);
  release_outputs(run);
  qmat_context_uninit(&context);
  assert_true(needed > 0);
  /* Memory stays short from some point on, or a single allocation fails. */
  const size_t most = *what ? FEWER_SHORTAGES : MOST_SHORTAGES;
  for (size_t k = 0; k < 2 * most && k / 2 < needed; k++) {
    context = (qmat_context){.threads = 1};
    const size_t first = spread(k / 2, needed, most);
    shortage(first, k % 2 ? 1 : SIZE_MAX);
    const qmat_status status = qmat_node_run(&context, run->node, run->params, run->inputs, run->outputs);
    shortage(SIZE_MAX, 0);
    if (status == QMAT_OK) {
      check_outputs(run);
      check_same(run, &whole, "after a shortage of memory");
    } else if (status != QMAT_ERROR_MEMORY || context.error.status != status) {
      fail_msg("%s%s: allocation %zu of %zu: %s: %s", run->node->name, what, first, needed, qmat_status_name(status),
               context.error.message);
    } else {
      check_no_outputs(run);
    }
    release_outputs(run);
    qmat_context_uninit(&context);
  }
}

static void test_a_shortage_of_memory_anywhere_is_an_error_or_makes_no_difference(void **state) {
  (void)state;
  for (size_t i = 0; i < qmat_node_count; i++) for_each_choice(qmat_nodes[i], try_shortages);
}

/* every_node_test [PATTERN]: only the tests whose names match. */
int main(int argc, char **argv) {
  if (argc > 1) cmocka_set_test_filter(argv[1]);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_names_are_group_dot_operator_sorted_and_unique),
      cmocka_unit_test(test_every_text_is_there_and_reads_alike),
      cmocka_unit_test(test_a_report_has_what_its_summary_needs),
      cmocka_unit_test(test_parameters_have_a_name_a_unit_a_default_and_a_place_of_their_own),
      cmocka_unit_test(test_ports_have_a_name_of_their_own_and_a_type),
      cmocka_unit_test(test_defaults_pass_the_check_and_run),
      cmocka_unit_test(test_optional_inputs_may_be_left_out),
      cmocka_unit_test(test_every_parameter_at_its_bounds_runs_or_is_refused_by_name),
      cmocka_unit_test(test_every_length_may_have_a_unit_and_needs_a_model_with_one),
      cmocka_unit_test(test_parameters_beyond_their_bounds_are_refused_by_name),
      cmocka_unit_test(test_any_number_of_threads_and_any_run_gives_the_same_bytes),
      cmocka_unit_test(test_inputs_and_parameters_are_left_as_they_were),
      cmocka_unit_test(test_missing_unsealed_and_wrong_inputs_are_refused_by_name),
      cmocka_unit_test(test_odd_values_give_a_result_or_an_error_that_names_what_is_at_fault),
      cmocka_unit_test(test_an_empty_mesh_and_an_empty_medial_mesh_are_refused),
      cmocka_unit_test(test_one_triangle_that_encloses_nothing_is_refused),
      cmocka_unit_test(test_values_that_do_not_belong_together_are_refused),
      cmocka_unit_test(test_numbers_that_are_not_finite_cannot_be_sealed),
      cmocka_unit_test(test_a_cancelled_run_has_no_outputs),
      cmocka_unit_test(test_a_shortage_of_memory_anywhere_is_an_error_or_makes_no_difference),
  };
  return cmocka_run_group_tests(tests, make_fixture, free_fixture);
}
