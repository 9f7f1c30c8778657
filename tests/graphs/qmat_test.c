/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "graphs/qmat.h"
#include "tests/io/gltf/gltf_assets.h"

enum { RINGS = 12, SECTORS = 24, VERTICES = 2 + (RINGS - 1) * SECTORS, TRIANGLES = 2 * SECTORS * (RINGS - 1) };

/* A ball of radius 2 around (1, 0, 0). */
typedef struct ball {
  double positions[3 * VERTICES];
  uint32_t triangles[3 * TRIANGLES];
} ball;

static void make_ball(ball *b) {
  const double pi = 3.14159265358979323846;
  size_t at = 0;
  for (int i = 0; i < VERTICES; i++) {
    int ring = i == 0 ? 0 : i == VERTICES - 1 ? RINGS : 1 + (i - 1) / SECTORS, sector = i == 0 ? 0 : (i - 1) % SECTORS;
    double polar = pi * ring / RINGS, turn = 2 * pi * sector / SECTORS;
    b->positions[3 * i] = 1 + 2 * sin(polar) * cos(turn);
    b->positions[3 * i + 1] = 2 * sin(polar) * sin(turn);
    b->positions[3 * i + 2] = 2 * cos(polar);
  }
#define ADD(a, b_, c)                                                                                             \
  (b->triangles[at] = (uint32_t)(a), b->triangles[at + 1] = (uint32_t)(b_), b->triangles[at + 2] = (uint32_t)(c), \
   at += 3)
  for (int ring = 0; ring < RINGS; ring++)
    for (int s = 0; s < SECTORS; s++) {
      int next = (s + 1) % SECTORS, upper = 1 + (ring - 1) * SECTORS, lower = 1 + ring * SECTORS;
      if (ring == 0) {
        ADD(0, lower + s, lower + next);
      } else if (ring == RINGS - 1) {
        ADD(upper + s, VERTICES - 1, upper + next);
      } else {
        ADD(upper + s, lower + s, lower + next);
        ADD(upper + s, lower + next, upper + next);
      }
    }
#undef ADD
  assert_int_equal(at, 3 * TRIANGLES);
}

static void ok(const qmat_job *job, qmat_result result) {
  if (result != QMAT_RESULT_OK) fail_msg("%s", qmat_job_error(job)->text);
}

static qmat_job *job_with_ball(void) {
  ball b;
  make_ball(&b);
  qmat_job *job;
  ok(job, qmat_job_new(&job));
  ok(job, qmat_job_give_mesh(job, "model.mesh", "ball", b.positions, VERTICES, b.triangles, TRIANGLES));
  ok(job, qmat_job_set(job, "epsilon=3%"));
  return job;
}

static void test_the_listing_names_the_nodes_of_the_built_in_graph(void **state) {
  (void)state;
  static const char *const names[] = {"medial.delaunay", "medial.simplify", "medial.skin", "mesh.sample",
                                      "mesh.sdf",        "scene.read",      "scene.write"};
  char *text = qmat_nodes_json();
  assert_non_null(text);
  json_t *nodes = json_loads(text, 0, NULL);
  assert_non_null(nodes);
  for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
    size_t index;
    json_t *node;
    bool found = false;
    json_array_foreach(nodes, index, node) {
      if (strcmp(json_string_value(json_object_get(node, "name")), names[i]) != 0) continue;
      found = true;
      assert_true(json_array_size(json_object_get(node, "outputs")) > 0);
    }
    if (!found) fail_msg("%s is not listed", names[i]);
  }
  json_decref(nodes);
  qmat_text_free(text);
  assert_string_equal(qmat_version(), QMAT_VERSION);
}

static void test_a_mesh_in_memory_becomes_spheres_inside_it(void **state) {
  (void)state;
  qmat_job *job = job_with_ball();
  ok(job, qmat_job_want(job, "simple.medial"));
  ok(job, qmat_job_want(job, "simple.report"));
  ok(job, qmat_job_want(job, "model.mesh"));
  ok(job, qmat_job_run(job, 2, NULL, NULL));
  qmat_mesh_view mesh;
  ok(job, qmat_job_mesh(job, "model.mesh", &mesh));
  assert_int_equal(mesh.vertex_count, VERTICES);
  assert_int_equal(mesh.triangle_count, TRIANGLES);
  qmat_medial_view medial;
  assert_int_equal(qmat_job_mesh(job, "simple.medial", &mesh), QMAT_RESULT_USAGE);
  assert_non_null(strstr(qmat_job_error(job)->text, "'simple.medial' is a medial mesh, not a mesh"));
  ok(job, qmat_job_medial(job, "simple.medial", &medial));
  assert_true(medial.sphere_count >= 1 && medial.sphere_count < VERTICES);
  double tolerance = 0.03 * 4 * sqrt(3), largest = 0;
  for (size_t i = 0; i < medial.sphere_count; i++) {
    const double *s = medial.spheres + 4 * i;
    double reach = sqrt((s[0] - 1) * (s[0] - 1) + s[1] * s[1] + s[2] * s[2]) + s[3];
    assert_true(reach <= 2 + tolerance);
    if (s[3] > largest) largest = s[3];
  }
  assert_true(largest >= 2 - 2 * tolerance);
  for (size_t i = 0; i < 2 * medial.edge_count; i++) assert_true(medial.edges[i] < medial.sphere_count);
  for (size_t i = 0; i < 3 * medial.triangle_count; i++) assert_true(medial.triangles[i] < medial.sphere_count);
  char *text;
  ok(job, qmat_job_report(job, "simple.report", &text));
  json_t *report = json_loads(text, 0, NULL);
  assert_int_equal(json_integer_value(json_object_get(report, "spheres")), medial.sphere_count);
  json_decref(report);
  qmat_text_free(text);
  /* Nothing that was not asked for has run. */
  ok(job, qmat_job_run_report(job, &text));
  report = json_loads(text, 0, NULL);
  assert_int_equal(json_array_size(json_object_get(report, "nodes")), 8);
  json_decref(report);
  qmat_text_free(text);
  qmat_job_free(job);
}

static void test_the_saved_file_is_the_file_in_memory(void **state) {
  (void)state;
  char folder[] = "/tmp/qmat-job-XXXXXX", path[64];
  assert_non_null(mkdtemp(folder));
  snprintf(path, sizeof path, "%s/ball.ma", folder);
  qmat_job *job = job_with_ball();
  ok(job, qmat_job_set(job, "asset.format=ma"));
  ok(job, qmat_job_save(job, NULL, path));
  ok(job, qmat_job_want(job, "asset.file"));
  ok(job, qmat_job_run(job, 0, NULL, NULL));
  qmat_file_view view;
  ok(job, qmat_job_file(job, "asset.file", &view));
  assert_string_equal(view.format, "ma");
  assert_int_equal(view.part_count, 1);
  const char *name;
  const uint8_t *bytes;
  size_t size;
  ok(job, qmat_job_file_part(job, "asset.file", 0, &name, &bytes, &size));
  assert_string_equal(name, "");
  FILE *file = fopen(path, "rb");
  assert_non_null(file);
  uint8_t *saved = malloc(size + 1);
  assert_non_null(saved);
  assert_int_equal(fread(saved, 1, size + 1, file), size);
  assert_memory_equal(saved, bytes, size);
  fclose(file);
  free(saved);
  assert_int_equal(qmat_job_file_part(job, "asset.file", 1, &name, &bytes, &size), QMAT_RESULT_USAGE);
  qmat_job_free(job);
  unlink(path);
  rmdir(folder);
}

static bool refuse(void *user, const char *node, const char *type, uint64_t done, uint64_t total, const char *unit) {
  (void)type;
  (void)done;
  (void)total;
  (void)unit;
  return strcmp(node, (const char *)user) != 0;
}

static void test_the_progress_function_cancels_and_the_job_runs_again(void **state) {
  (void)state;
  char folder[] = "/tmp/qmat-job-XXXXXX", path[64], node[] = "simple";
  assert_non_null(mkdtemp(folder));
  snprintf(path, sizeof path, "%s/ball.ma", folder);
  qmat_job *job = job_with_ball();
  ok(job, qmat_job_save(job, "asset", path));
  assert_int_equal(qmat_job_run(job, 0, refuse, node), QMAT_RESULT_CANCELLED);
  assert_string_equal(qmat_job_error(job)->status, "cancelled");
  assert_string_equal(qmat_job_error(job)->node, "simple");
  assert_int_equal(access(path, F_OK), -1);
  ok(job, qmat_job_run(job, 0, NULL, NULL));
  assert_int_equal(access(path, F_OK), 0);
  qmat_job_free(job);
  unlink(path);
  rmdir(folder);
}

/* A job makes one file after the other; a report of a run stays what it was when parameters change. */
static void test_a_job_forgets_models_and_paths(void **state) {
  (void)state;
  static const double tetrahedron[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  static const uint32_t sides[] = {0, 2, 1, 0, 1, 3, 1, 2, 3,
                                   0, 3, 2, 0, 2, 1, 3, 3, 0}; /* one twice, one without area */
  char folder[] = "/tmp/qmat-job-XXXXXX", first[64], second[64], *report;
  assert_non_null(mkdtemp(folder));
  snprintf(first, sizeof first, "%s/first.ma", folder);
  snprintf(second, sizeof second, "%s/second.ma", folder);
  qmat_job *job = job_with_ball();
  ok(job, qmat_job_save(job, "asset", first));
  ok(job, qmat_job_save(job, "asset", first));
  ok(job, qmat_job_run(job, 0, NULL, NULL));
  ok(job, qmat_job_set(job, "model=elsewhere.off"));
  ok(job, qmat_job_run_report(job, &report));
  assert_null(strstr(report, "elsewhere.off"));
  assert_non_null(strstr(report, "first.ma"));
  qmat_text_free(report);
  assert_int_equal(unlink(first), 0);
  qmat_job_forget(job);
  ok(job, qmat_job_give_mesh(job, "model.mesh", "tetrahedron", tetrahedron, 4, sides, 6));
  ok(job, qmat_job_save(job, "asset", second));
  ok(job, qmat_job_run(job, 0, NULL, NULL));
  assert_int_equal(unlink(second), 0);
  assert_int_equal(rmdir(folder), 0); /* the first is not written again */
  qmat_job_free(job);
}

/* Requests save nothing at the graph's own path; a save without a path does, and makes the folder. */
static void test_a_path_of_the_graph_is_saved_where_nothing_is_requested(void **state) {
  (void)state;
  char folder[] = "/tmp/qmat-job-XXXXXX", text[512], saved[64], below[64], *json;
  assert_non_null(mkdtemp(folder));
  snprintf(saved, sizeof saved, "%s/own/mesh.ply", folder);
  snprintf(below, sizeof below, "%s/own", folder);
  snprintf(text, sizeof text,
           "qmat: 1\nnodes:\n  given: { type: medial.read }\n"
           "  asset: { type: scene.write, in: { medial: given.medial } }\n"
           "outputs: { asset: { from: asset.file, path: %s }, plain: asset.file }\n",
           saved);
  static const double ball[] = {0, 0, 0, 1};
  qmat_job *job;
  ok(job, qmat_job_new_from_text(&job, text, strlen(text)));
  ok(job, qmat_job_graph(job, &json));
  json_t *graph = json_loads(json, 0, NULL);
  const json_t *outputs = json_object_get(graph, "outputs");
  assert_string_equal(json_string_value(json_object_get(json_array_get(outputs, 0), "path")), saved);
  assert_true(json_is_null(json_object_get(json_array_get(outputs, 1), "path")));
  json_decref(graph);
  qmat_text_free(json);
  ok(job, qmat_job_give_medial(job, "given.medial", ball, 1, NULL, 0, NULL, 0));
  ok(job, qmat_job_run(job, 1, NULL, NULL));
  assert_int_equal(unlink(saved), 0);
  assert_int_equal(rmdir(below), 0);
  ok(job, qmat_job_want(job, "asset.file"));
  ok(job, qmat_job_run(job, 1, NULL, NULL));
  assert_int_equal(access(below, F_OK), -1);
  assert_int_equal(qmat_job_save(job, "plain", NULL), QMAT_RESULT_USAGE);
  assert_non_null(strstr(qmat_job_error(job)->text, "the graph gives output 'plain' none"));
  ok(job, qmat_job_save(job, "asset", NULL));
  ok(job, qmat_job_run(job, 1, NULL, NULL));
  assert_int_equal(unlink(saved), 0);
  qmat_job_forget(job);
  ok(job, qmat_job_give_medial(job, "given.medial", ball, 1, NULL, 0, NULL, 0));
  ok(job, qmat_job_want(job, "asset.file"));
  snprintf(saved, sizeof saved, "%s/own/new/x.ma", folder);
  ok(job, qmat_job_save(job, "plain", saved));
  ok(job, qmat_job_run(job, 1, NULL, NULL));
  assert_int_equal(unlink(saved), 0);
  snprintf(saved, sizeof saved, "%s/own/new", folder);
  assert_int_equal(rmdir(saved) + rmdir(below) + rmdir(folder), 0);
  qmat_job_free(job);
}

/* Values of any type pass from job to job without a file. */
static void test_values_are_given_read_and_passed_on(void **state) {
  (void)state;
  static const char text[] =
      "qmat: 1\nnodes:\n  given: { type: medial.read }\n  skin: { type: medial.skin, in: { medial: given.medial } }\n"
      "outputs: { skin: skin.mesh }\n";
  static const double capsule[] = {0, 0, 0, 1, 4, 0, 0, 1};
  static const uint32_t edges[] = {1, 0, 0, 1};
  static const double points[] = {2, 3, 0, 7, 0, 0, 2, 0, 0}, right[] = {2, 2, -1};
  qmat_job *first, *second;
  ok(first, qmat_job_new_from_text(&first, text, sizeof text - 1));
  char *json;
  ok(first, qmat_job_graph(first, &json));
  json_t *graph = json_loads(json, 0, NULL);
  const json_t *output = json_array_get(json_object_get(graph, "outputs"), 0);
  assert_string_equal(json_string_value(json_object_get(output, "port")), "skin.mesh");
  assert_string_equal(json_string_value(json_object_get(output, "type")), "mesh");
  json_decref(graph);
  qmat_text_free(json);
  ok(first, qmat_job_give_medial(first, "given.medial", capsule, 2, edges, 2, NULL, 0));
  ok(first, qmat_job_want(first, "given.medial"));
  ok(first, qmat_job_run(first, 2, NULL, NULL));
  qmat_value_view value;
  ok(first, qmat_job_value(first, "given.medial", &value));
  assert_string_equal(value.type, "medial");
  assert_string_equal(value.name, "");
  assert_int_equal(value.item_count, 0);
  qmat_array_view array;
  ok(first, qmat_job_array(first, "given.medial", 1, &array));
  assert_string_equal(array.name, "edges");
  assert_int_equal(array.rows, 1);
  assert_int_equal(array.columns, 2);
  assert_null(array.numbers);
  assert_int_equal(array.ids[0], 0);
  assert_int_equal(qmat_job_array(first, "given.medial", value.array_count, &array), QMAT_RESULT_USAGE);
  ok(first, qmat_job_new_from_text(&second, text, sizeof text - 1));
  ok(second, qmat_job_give_result(second, "given.medial", first, "given.medial"));
  assert_int_equal(qmat_job_give_result(second, "skin.mesh", first, "given.medial"), QMAT_RESULT_USAGE);
  assert_int_equal(qmat_job_give_result(second, "given.medial", first, "skin.mesh"), QMAT_RESULT_USAGE);
  qmat_job_free(first);
  ok(second, qmat_job_want(second, "given.medial"));
  ok(second, qmat_job_run(second, 1, NULL, NULL));
  double distances[3];
  ok(second, qmat_job_distances(second, "given.medial", points, 3, distances));
  for (int i = 0; i < 3; i++) assert_true(fabs(distances[i] - right[i]) < 1e-12);
  const double nowhere[] = {0, 0, 0, 0, NAN, 0};
  assert_int_equal(qmat_job_distances(second, "given.medial", nowhere, 2, distances), QMAT_RESULT_FAILED);
  assert_int_equal(qmat_job_error(second)->element, 1);
  const uint32_t beyond[] = {0, 2};
  assert_int_equal(qmat_job_give_medial(second, "given.medial", capsule, 2, beyond, 1, NULL, 0), QMAT_RESULT_FAILED);
  ok(second, qmat_job_value(second, "given.medial[0]", &value)); /* a single value is its own item 0 */
  assert_string_equal(value.type, "medial");
  assert_int_equal(value.item_count, 0);
  assert_int_equal(qmat_job_value(second, "given.medial[1]", &value), QMAT_RESULT_USAGE);
  assert_non_null(strstr(qmat_job_error(second)->text, "'given.medial' has a single value, without item 1"));
  assert_int_equal(qmat_job_value(second, "given.medial[x]", &value), QMAT_RESULT_USAGE);
  assert_int_equal(qmat_job_value(second, "given.medial[0", &value), QMAT_RESULT_USAGE);
  assert_int_equal(qmat_job_value(second, "given.medial[18446744073709551615]", &value), QMAT_RESULT_USAGE);
  qmat_job_free(second);
}

/* A glTF file of a box and of a triangle that encloses nothing. */
static void write_box_and_triangle(const char *path) {
  static const char text[] =
      "{'asset':{'version':'2.0'},'scenes':[{'nodes':[0,1]}],'nodes':[{'mesh':0},{'mesh':1}],"
      "'meshes':[{'name':'box','primitives':[{'attributes':{'POSITION':0},'indices':1}]},"
      "{'name':'flap','primitives':[{'attributes':{'POSITION':0},'indices':2}]}],"
      "'accessors':[{'bufferView':0,'componentType':5126,'count':8,'type':'VEC3','min':[0,0,0],'max':[3,1,1]},"
      "{'bufferView':1,'componentType':5123,'count':36,'type':'SCALAR'},"
      "{'bufferView':1,'componentType':5123,'count':3,'type':'SCALAR'}],"
      "'bufferViews':[{'buffer':0,'byteLength':96},{'buffer':0,'byteOffset':96,'byteLength':72}],"
      "'buffers':[{'byteLength':168}]}";
  qmat_writer data = {0};
  put_box_corners(&data, 3);
  put_box_triangles(&data);
  qmat_writer glb = asset_glb(text, data.bytes, data.size);
  FILE *file = fopen(path, "wb");
  assert_non_null(file);
  assert_int_equal(fwrite(glb.bytes, 1, glb.size, file), glb.size);
  assert_int_equal(fclose(file), 0);
  qmat_writer_uninit(&glb);
  qmat_writer_uninit(&data);
}

static void test_items_of_a_list_are_read_one_by_one_and_one_that_failed_says_why(void **state) {
  (void)state;
  static const char text[] =
      "qmat: 1\nnodes:\n  model: { type: scene.read }\n"
      "  thickness: { type: mesh.sdf, in: { mesh: model.mesh } }\noutputs: { thickness: thickness.thickness }\n";
  char folder[] = "/tmp/qmat-job-XXXXXX", path[64], assignment[96];
  assert_non_null(mkdtemp(folder));
  snprintf(path, sizeof path, "%s/two.glb", folder);
  snprintf(assignment, sizeof assignment, "model.path=%s", path);
  write_box_and_triangle(path);
  qmat_job *job, *other;
  ok(job, qmat_job_new_from_text(&job, text, sizeof text - 1));
  ok(job, qmat_job_set(job, assignment));
  ok(job, qmat_job_want(job, "model.mesh"));
  ok(job, qmat_job_want(job, "thickness.thickness"));
  ok(job, qmat_job_run(job, 2, NULL, NULL));
  qmat_value_view value;
  ok(job, qmat_job_value(job, "model.mesh", &value));
  assert_string_equal(value.type, "mesh");
  assert_string_equal(value.name, "");
  assert_int_equal(value.item_count, 2);
  assert_int_equal(value.array_count, 0);
  static const char *const names[] = {"box", "flap"};
  static const size_t triangles[] = {12, 1};
  for (size_t i = 0; i < 2; i++) {
    char port[32];
    qmat_mesh_view mesh;
    snprintf(port, sizeof port, "model.mesh[%zu]", i);
    ok(job, qmat_job_value(job, port, &value));
    assert_string_equal(value.type, "mesh");
    assert_string_equal(value.name, names[i]);
    assert_int_equal(value.item_count, 0);
    assert_true(value.array_count >= 2);
    ok(job, qmat_job_mesh(job, port, &mesh));
    assert_int_equal(mesh.triangle_count, triangles[i]);
  }
  qmat_mesh_view mesh;
  qmat_array_view array;
  assert_int_equal(qmat_job_mesh(job, "model.mesh", &mesh), QMAT_RESULT_USAGE);
  assert_int_equal(qmat_job_array(job, "model.mesh", 0, &array), QMAT_RESULT_USAGE);
  assert_int_equal(qmat_job_mesh(job, "model.mesh[2]", &mesh), QMAT_RESULT_USAGE);
  assert_non_null(strstr(qmat_job_error(job)->text, "'model.mesh' is a list of 2 items, without item 2"));
  /* One of two thicknesses was made. */
  ok(job, qmat_job_value(job, "thickness.thickness", &value));
  assert_string_equal(value.type, "field");
  assert_int_equal(value.item_count, 2);
  ok(job, qmat_job_array(job, "thickness.thickness[0]", 0, &array));
  assert_int_equal(array.rows, 12);
  assert_int_equal(qmat_job_value(job, "thickness.thickness[1]", &value), QMAT_RESULT_FAILED);
  assert_string_equal(qmat_job_error(job)->element_kind, "item");
  assert_int_equal(qmat_job_error(job)->element, 1);
  assert_non_null(strstr(qmat_job_error(job)->message, "mesh.sdf: "));
  /* All of a list, or an item, is given to another job. */
  ok(other, qmat_job_new_from_text(&other, text, sizeof text - 1));
  ok(other, qmat_job_give_result(other, "model.mesh", job, "model.mesh"));
  ok(other, qmat_job_want(other, "thickness.thickness"));
  ok(other, qmat_job_run(other, 1, NULL, NULL));
  ok(other, qmat_job_value(other, "thickness.thickness", &value));
  assert_int_equal(value.item_count, 2);
  ok(other, qmat_job_give_result(other, "model.mesh", job, "model.mesh[0]"));
  ok(other, qmat_job_run(other, 1, NULL, NULL));
  ok(other, qmat_job_value(other, "thickness.thickness", &value));
  assert_int_equal(value.item_count, 0);
  qmat_job_free(other);
  qmat_job_free(job);
  unlink(path);
  rmdir(folder);
}

/* Sets a variable of the environment, or removes it, and returns a copy of what it was. */
static char *exchange(const char *name, const char *text) {
  const char *now = getenv(name);
  char *before = now ? strdup(now) : NULL;
  assert_int_equal(text ? setenv(name, text, 1) : unsetenv(name), 0);
  return before;
}

static void test_the_cache_folder_follows_the_environment(void **state) {
  (void)state;
  static const char *const names[] = {"QMAT_CACHE", "XDG_CACHE_HOME", "HOME"};
  static const struct {
    const char *values[3], *folder;
  } cases[] = {{{"off", "/x", "/h"}, NULL},
               {{"", "/x", "/h"}, NULL},
               {{"a folder", "/x", "/h"}, "a folder"},
               {{"offset", "/x", "/h"}, "offset"},
               {{NULL, "/x", "/h"}, "/x/qmat"},
               {{NULL, "", "/h"}, "/h/.cache/qmat"},
               {{NULL, "relative", "/h"}, "/h/.cache/qmat"}, /* the XDG specification ignores it */
               {{NULL, NULL, "/h"}, "/h/.cache/qmat"},
               {{NULL, NULL, "relative"}, NULL},
               {{NULL, NULL, NULL}, NULL}};
  char *before[3];
  for (size_t k = 0; k < 3; k++) before[k] = exchange(names[k], NULL);
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    for (size_t k = 0; k < 3; k++) free(exchange(names[k], cases[i].values[k]));
    char *folder = qmat_cache_folder();
    if (cases[i].folder) {
      assert_non_null(folder);
      assert_string_equal(folder, cases[i].folder);
    } else {
      assert_null(folder);
    }
    qmat_text_free(folder);
  }
  for (size_t k = 0; k < 3; k++) {
    free(exchange(names[k], before[k]));
    free(before[k]);
  }
}

static void test_a_null_that_a_call_cannot_work_with_is_a_usage_error(void **state) {
  (void)state;
  qmat_job *job, *none;
  static const double positions[] = {0, 0, 0};
  static const uint32_t triangles[] = {0, 0, 0};
  ok(job, qmat_job_new(&job));
  assert_int_equal(qmat_job_set(job, NULL), QMAT_RESULT_USAGE);
  assert_non_null(strstr(qmat_job_error(job)->text, "the assignment is NULL"));
  assert_int_equal(qmat_job_want(job, NULL), QMAT_RESULT_USAGE);
  assert_non_null(strstr(qmat_job_error(job)->text, "the port is NULL"));
  assert_int_equal(qmat_job_save(job, NULL, NULL), QMAT_RESULT_USAGE);
  assert_non_null(strstr(qmat_job_error(job)->text, "the path is NULL"));
  assert_int_equal(qmat_job_save(job, "asset", NULL), QMAT_RESULT_USAGE);
  assert_int_equal(qmat_job_give_mesh(job, "model.mesh", NULL, NULL, 3, triangles, 1), QMAT_RESULT_USAGE);
  assert_non_null(strstr(qmat_job_error(job)->text, "positions is NULL"));
  assert_int_equal(qmat_job_give_mesh(job, "model.mesh", NULL, positions, 1, NULL, 1), QMAT_RESULT_USAGE);
  assert_non_null(strstr(qmat_job_error(job)->text, "triangles is NULL"));
  assert_int_equal(qmat_job_give_mesh(job, NULL, NULL, positions, 1, triangles, 1), QMAT_RESULT_USAGE);
  assert_int_equal(qmat_job_give_medial(job, "simple.medial", NULL, 1, NULL, 0, NULL, 0), QMAT_RESULT_USAGE);
  assert_non_null(strstr(qmat_job_error(job)->text, "spheres is NULL"));
  assert_int_equal(qmat_job_give_medial(job, "simple.medial", positions, 0, NULL, 1, NULL, 0), QMAT_RESULT_USAGE);
  assert_int_equal(qmat_job_give_result(job, "model.mesh", NULL, "model.mesh"), QMAT_RESULT_USAGE);
  assert_int_equal(qmat_job_new_from_file(&none, NULL), QMAT_RESULT_USAGE);
  assert_non_null(strstr(qmat_job_error(none)->text, "the path of the graph is NULL"));
  qmat_job_free(none);
  qmat_job_free(job);
}

/* A mesh from memory has no file whose unit could be stated. */
static void test_no_hint_advises_what_a_mesh_from_memory_does_not_have(void **state) {
  (void)state;
  qmat_job *job = job_with_ball();
  ok(job, qmat_job_want(job, "simple.medial"));
  ok(job, qmat_job_set(job, "epsilon=5mm"));
  assert_int_equal(qmat_job_run(job, 0, NULL, NULL), QMAT_RESULT_USAGE);
  assert_non_null(strstr(qmat_job_error(job)->text, "epsilon is 5mm, but the model has no unit of length"));
  assert_string_equal(qmat_job_error(job)->hint, "type a share of the diagonal, such as 1%");
  qmat_job_free(job);
}

static void test_mistakes_are_results_with_a_problem(void **state) {
  (void)state;
  qmat_job *job;
  ok(job, qmat_job_new(&job));
  assert_int_equal(qmat_job_error(job)->result, QMAT_RESULT_OK);
  assert_int_equal(qmat_job_set(job, "simple.epsilom=1"), QMAT_RESULT_USAGE);
  assert_non_null(strstr(qmat_job_error(job)->hint, "'epsilon'"));
  assert_int_equal(qmat_job_want(job, "simple.medal"), QMAT_RESULT_USAGE);
  assert_non_null(strstr(qmat_job_error(job)->text, "'medial'"));
  assert_int_equal(qmat_job_save(job, "asset", "x.doc"), QMAT_RESULT_USAGE);
  assert_non_null(strstr(qmat_job_error(job)->hint, ".glb"));
  qmat_medial_view medial;
  assert_int_equal(qmat_job_medial(job, "simple.medial", &medial), QMAT_RESULT_USAGE);
  /* No model is given. */
  assert_int_equal(qmat_job_run(job, 0, NULL, NULL), QMAT_RESULT_USAGE);
  assert_string_equal(qmat_job_error(job)->field, "path");
  assert_int_equal(qmat_job_run(job, -1, NULL, NULL), QMAT_RESULT_USAGE);
  assert_non_null(strstr(qmat_job_error(job)->text, "the number of threads has to be from 0 to 1024, not -1"));
  assert_int_equal(qmat_job_run(job, 1025, NULL, NULL), QMAT_RESULT_USAGE);
  assert_non_null(strstr(qmat_job_error(job)->text, "the number of threads has to be from 0 to 1024, not 1025"));
  assert_int_equal(qmat_job_run(job, 1024, NULL, NULL), QMAT_RESULT_USAGE);
  assert_string_equal(qmat_job_error(job)->field, "path"); /* still no model: 1024 threads are allowed */
  ok(job, qmat_job_set(job, "model=/nowhere/x.off"));
  assert_int_equal(qmat_job_run(job, 0, NULL, NULL), QMAT_RESULT_FAILED);
  assert_string_equal(qmat_job_error(job)->status, "io");
  static const double positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  static const uint32_t triangles[] = {0, 1, 2, 0, 1, 3};
  assert_int_equal(qmat_job_give_mesh(job, "model.mesh", NULL, positions, 3, triangles, 2), QMAT_RESULT_FAILED);
  assert_string_equal(qmat_job_error(job)->element_kind, "facet");
  assert_int_equal(qmat_job_error(job)->element, 1);
  assert_int_equal(qmat_job_give_mesh(job, "simple.medial", NULL, positions, 3, triangles, 1), QMAT_RESULT_USAGE);
  assert_int_equal(qmat_job_give_mesh(job, "model.mesh", NULL, NULL, 0, NULL, 0), QMAT_RESULT_FAILED);
  qmat_job_free(job);
  qmat_job_free(NULL);
  assert_string_equal(qmat_job_error(NULL)->status, "memory");
}

static void test_a_bad_graph_keeps_its_error(void **state) {
  (void)state;
  static const char text[] = "qmat: 1\nnodes:\n  a: { type: mesh.sfd }\n";
  qmat_job *job;
  assert_int_equal(qmat_job_new_from_text(&job, text, sizeof text - 1), QMAT_RESULT_USAGE);
  assert_int_equal(qmat_job_error(job)->line, 3);
  assert_non_null(strstr(qmat_job_error(job)->hint, "mesh.sdf"));
  assert_int_equal(qmat_job_set(job, "a.b=1"), QMAT_RESULT_USAGE);
  assert_int_equal(qmat_job_run(job, 0, NULL, NULL), QMAT_RESULT_USAGE);
  assert_int_equal(qmat_job_error(job)->line, 3);
  qmat_job_free(job);
  assert_int_equal(qmat_job_new_from_file(&job, "/nowhere.yaml"), QMAT_RESULT_USAGE);
  assert_string_equal(qmat_job_error(job)->file, "/nowhere.yaml");
  qmat_job_free(job);
  char empty[1024];
  assert_int_equal(qmat_job_new_from_text(&job, "", 0), QMAT_RESULT_USAGE);
  snprintf(empty, sizeof empty, "%s", qmat_job_error(job)->text);
  qmat_job_free(job);
  assert_int_equal(qmat_job_new_from_text(&job, NULL, 0), QMAT_RESULT_USAGE);
  assert_string_equal(qmat_job_error(job)->text, empty);
  qmat_job_free(job);
}

static void test_a_job_takes_from_the_cache_what_another_has_made(void **state) {
  (void)state;
  char folder[] = "/tmp/qmat-job-XXXXXX", command[64];
  assert_non_null(mkdtemp(folder));
  size_t spheres[2];
  for (int i = 0; i < 2; i++) {
    qmat_job *job = job_with_ball();
    qmat_medial_view medial;
    size_t hits, nodes;
    assert_int_equal(qmat_job_hits(job, &hits, &nodes), QMAT_RESULT_USAGE);
    ok(job, qmat_job_cache(job, folder));
    ok(job, qmat_job_want(job, "simple.medial"));
    ok(job, qmat_job_run(job, 1 + i, NULL, NULL));
    ok(job, qmat_job_medial(job, "simple.medial", &medial));
    ok(job, qmat_job_hits(job, &hits, &nodes));
    assert_true(nodes >= 4);
    assert_int_equal(hits, i == 0 ? 0 : nodes);
    spheres[i] = medial.sphere_count;
    char *json;
    ok(job, qmat_job_run_report(job, &json));
    assert_non_null(strstr(json, "\"hits\""));
    qmat_text_free(json);
    ok(job, qmat_job_cache(job, NULL));
    ok(job, qmat_job_run(job, 1, NULL, NULL));
    ok(job, qmat_job_hits(job, &hits, NULL));
    assert_int_equal(hits, 0);
    assert_int_equal(qmat_job_cache(job, "/proc/self/exe"), QMAT_RESULT_USAGE);
    qmat_job_free(job);
  }
  assert_int_equal(spheres[0], spheres[1]);
  snprintf(command, sizeof command, "rm -r %s", folder);
  assert_int_equal(system(command), 0);
}

static void test_a_cache_that_has_become_a_file_is_a_usage_error_of_the_run(void **state) {
  (void)state;
  char path[] = "/tmp/qmat-job-XXXXXX";
  const int file = mkstemp(path);
  assert_true(file >= 0);
  close(file);
  unlink(path);
  qmat_job *job = job_with_ball();
  ok(job, qmat_job_want(job, "model.mesh"));
  ok(job, qmat_job_cache(job, path));
  fclose(fopen(path, "we"));
  assert_int_equal(qmat_job_run(job, 1, NULL, NULL), QMAT_RESULT_USAGE);
  assert_string_equal(qmat_job_error(job)->file, path);
  unlink(path);
  ok(job, qmat_job_run(job, 1, NULL, NULL));
  qmat_job_free(job);
  char command[64];
  snprintf(command, sizeof command, "rm -rf %s", path);
  assert_int_equal(system(command), 0);
}

static void test_the_shipped_graph_is_the_built_in_one(void **state) {
  (void)state;
  /* Tests run in the folder of the source. */
  qmat_job *job;
  ok(job, qmat_job_new_from_file(&job, "graphs/qmat_plus.yaml"));
  ball b;
  make_ball(&b);
  ok(job, qmat_job_give_mesh(job, "model.mesh", "ball", b.positions, VERTICES, b.triangles, TRIANGLES));
  ok(job, qmat_job_set(job, "epsilon=0.03"));
  qmat_job *built_in = job_with_ball(), *jobs[] = {job, built_in};
  const uint8_t *bytes[2];
  size_t sizes[2];
  for (int i = 0; i < 2; i++) {
    const char *name;
    ok(jobs[i], qmat_job_want(jobs[i], "asset.file"));
    ok(jobs[i], qmat_job_run(jobs[i], 1 + i, NULL, NULL));
    ok(jobs[i], qmat_job_file_part(jobs[i], "asset.file", 0, &name, &bytes[i], &sizes[i]));
  }
  assert_int_equal(sizes[0], sizes[1]);
  assert_memory_equal(bytes[0], bytes[1], sizes[0]);
  qmat_job_free(job);
  qmat_job_free(built_in);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_the_listing_names_the_nodes_of_the_built_in_graph),
      cmocka_unit_test(test_a_mesh_in_memory_becomes_spheres_inside_it),
      cmocka_unit_test(test_the_saved_file_is_the_file_in_memory),
      cmocka_unit_test(test_the_progress_function_cancels_and_the_job_runs_again),
      cmocka_unit_test(test_a_job_forgets_models_and_paths),
      cmocka_unit_test(test_a_path_of_the_graph_is_saved_where_nothing_is_requested),
      cmocka_unit_test(test_values_are_given_read_and_passed_on),
      cmocka_unit_test(test_items_of_a_list_are_read_one_by_one_and_one_that_failed_says_why),
      cmocka_unit_test(test_the_cache_folder_follows_the_environment),
      cmocka_unit_test(test_a_null_that_a_call_cannot_work_with_is_a_usage_error),
      cmocka_unit_test(test_no_hint_advises_what_a_mesh_from_memory_does_not_have),
      cmocka_unit_test(test_mistakes_are_results_with_a_problem),
      cmocka_unit_test(test_a_bad_graph_keeps_its_error),
      cmocka_unit_test(test_a_job_takes_from_the_cache_what_another_has_made),
      cmocka_unit_test(test_a_cache_that_has_become_a_file_is_a_usage_error_of_the_run),
      cmocka_unit_test(test_the_shipped_graph_is_the_built_in_one),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
