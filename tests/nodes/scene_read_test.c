/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/node.h"
#include "tests/io/files.h"

extern const qmat_node qmat_node_scene_read;

static char folder[64], path[96];

static int set_up(void **state) {
  (void)state;
  make_folder(folder);
  snprintf(path, sizeof path, "%s/model.off", folder);
  return 0;
}

static int tear_down(void **state) {
  (void)state;
  return rmdir(folder);
}

/* Runs the node on a file of this content; `outputs` holds scene, mesh and report. */
static const char *given_unit; /* NULL: the default */

static qmat_status run(qmat_context *context, const char *content, const char *defects, qmat_value *outputs[3]) {
  const qmat_node *node = &qmat_node_scene_read;
  uint64_t params[8];
  assert_true(node->params_size <= sizeof params);
  qmat_params_default(node, params);
  assert_int_equal(qmat_params_check(context, node, params), QMAT_ERROR_USAGE); /* the path is required */
  assert_int_equal(qmat_param_parse(context, qmat_param_find(node, "path"), path, params), QMAT_OK);
  if (defects) {
    assert_int_equal(qmat_param_parse(context, qmat_param_find(node, "defects"), defects, params), QMAT_OK);
  }
  if (given_unit)
    assert_int_equal(qmat_param_parse(context, qmat_param_find(node, "unit"), given_unit, params), QMAT_OK);
  assert_int_equal(qmat_params_check(context, node, params), QMAT_OK);
  if (content) write_file(path, content, strlen(content));
  for (int i = 0; i < 3; i++) outputs[i] = NULL;
  const qmat_status status = node->run(context, params, NULL, outputs);
  if (content) unlink(path);
  return status;
}

static void release(qmat_value *outputs[3]) {
  for (int i = 0; i < 3; i++) qmat_value_release(outputs[i]);
}

static const char cube[] =
    "OFF 8 6 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n"
    "4 2 3 7 6\n4 3 0 4 7\n";
static const char repeated[] = "OFF 3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 2 1 0\n";

static void test_the_node_gives_scene_mesh_and_report(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_value *outputs[3];
  assert_int_equal(qmat_output_count(&qmat_node_scene_read), 3);
  assert_int_equal(qmat_input_count(&qmat_node_scene_read), 0);
  assert_int_equal(run(&context, cube, NULL, outputs), QMAT_OK);
  for (size_t i = 0; i < 3; i++) {
    assert_int_equal(outputs[i]->type, qmat_node_scene_read.outputs[i].type);
    assert_true(outputs[i]->sealed);
    assert_int_equal(outputs[i]->references, 1);
  }
  const qmat_mesh *mesh = (const qmat_mesh *)outputs[1];
  assert_string_equal(((const qmat_scene *)outputs[0])->name, "model");
  assert_int_equal(mesh->triangle_count, 12);
  assert_true(mesh->closed && mesh->oriented);
  const json_t *report = ((const qmat_report *)outputs[2])->root;
  assert_int_equal(json_integer_value(json_object_get(report, "polygons_triangulated")), 6);
  release(outputs);
  qmat_context_uninit(&context);
}

static void test_equal_files_give_equal_digests(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_value *first[3], *second[3];
  assert_int_equal(run(&context, cube, NULL, first), QMAT_OK);
  assert_int_equal(run(&context, cube, NULL, second), QMAT_OK);
  for (int i = 0; i < 3; i++) assert_memory_equal(&first[i]->digest, &second[i]->digest, sizeof first[i]->digest);
  release(first);
  release(second);
  qmat_context_uninit(&context);
}

static void test_defects_are_dropped_unless_they_are_to_be_refused(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_value *outputs[3];
  assert_int_equal(run(&context, repeated, "refuse", outputs), QMAT_ERROR_GEOMETRY);
  assert_string_equal(context.error.message, "the facet repeats facet 0");
  assert_string_equal(context.error.file, path);
  assert_int_equal(context.error.line, 6);
  for (int i = 0; i < 3; i++) assert_null(outputs[i]);
  static const char *const dropping[] = {NULL, "drop"};
  for (int i = 0; i < 2; i++) {
    assert_int_equal(run(&context, repeated, dropping[i], outputs), QMAT_OK);
    assert_int_equal(((const qmat_mesh *)outputs[1])->triangle_count, 1);
    const json_t *report = ((const qmat_report *)outputs[2])->root;
    assert_int_equal(json_integer_value(json_object_get(report, "facets_dropped_as_defects")), 1);
    release(outputs);
  }
  qmat_context_uninit(&context);
}

static void test_a_file_without_a_unit_gets_the_one_that_is_given(void **state) {
  (void)state;
  static const struct {
    const char *unit;
    double meters;
  } units[] = {{"file", 0}, {"mm", 0.001}, {"cm", 0.01}, {"m", 1}, {"in", 0.0254}, {"ft", 0.3048}};
  for (size_t i = 0; i < sizeof units / sizeof *units; i++) {
    qmat_context context = {0};
    qmat_value *outputs[3];
    given_unit = units[i].unit;
    assert_int_equal(run(&context, cube, NULL, outputs), QMAT_OK);
    given_unit = NULL;
    assert_true(((const qmat_scene *)outputs[0])->meters_per_unit == units[i].meters);
    assert_true(((const qmat_mesh *)outputs[1])->meters_per_unit == units[i].meters);
    release(outputs);
    qmat_context_uninit(&context);
  }
}

static void test_a_missing_file_is_named(void **state) {
  (void)state;
  qmat_context context = {.node_id = "model", .node_type = "scene.read"};
  qmat_value *outputs[3];
  assert_int_equal(run(&context, NULL, NULL, outputs), QMAT_ERROR_IO);
  char text[512], expected[512];
  qmat_error_format(&context.error, text, sizeof text);
  snprintf(expected, sizeof expected, "%s: node 'model' (scene.read): cannot open the file: No such file or directory",
           path);
  assert_string_equal(text, expected);
  qmat_context_uninit(&context);
}

static void test_an_unknown_choice_is_refused(void **state) {
  (void)state;
  qmat_context context = {0};
  uint64_t params[8];
  const qmat_node *node = &qmat_node_scene_read;
  qmat_params_default(node, params);
  assert_int_equal(qmat_param_parse(&context, qmat_param_find(node, "defects"), "dropp", params), QMAT_ERROR_USAGE);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_the_node_gives_scene_mesh_and_report),
      cmocka_unit_test(test_equal_files_give_equal_digests),
      cmocka_unit_test(test_defects_are_dropped_unless_they_are_to_be_refused),
      cmocka_unit_test(test_a_file_without_a_unit_gets_the_one_that_is_given),
      cmocka_unit_test(test_a_missing_file_is_named),
      cmocka_unit_test(test_an_unknown_choice_is_refused),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
