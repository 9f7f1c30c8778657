/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/node.h"
#include "tests/io/files.h"

extern const qmat_node qmat_node_medial_read;

/* Runs the node on a file of this content; *output is NULL after a failure. */
static qmat_status run(qmat_context *context, const char *content, qmat_value **output) {
  const qmat_node *node = &qmat_node_medial_read;
  char folder[64], path[96];
  uint64_t params[8];
  make_folder(folder);
  snprintf(path, sizeof path, "%s/a.ma", folder);
  write_file(path, content, strlen(content));
  assert_true(node->params_size <= sizeof params);
  qmat_params_default(node, params);
  assert_int_equal(qmat_params_check(context, node, params), QMAT_ERROR_USAGE);
  assert_int_equal(qmat_param_parse(context, qmat_param_find(node, "path"), path, params), QMAT_OK);
  *output = NULL;
  const qmat_status status = node->run(context, params, NULL, output);
  unlink(path);
  assert_int_equal(rmdir(folder), 0);
  assert_true((status == QMAT_OK) == (*output != NULL));
  return status;
}

static void test_the_node_gives_a_sealed_medial_mesh(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_value *output;
  assert_int_equal(run(&context, "3 0 1\nv 0 0 0 1\nv 1 0 0 .5\nv 0 1 0 0\nf 2 1 0\n", &output), QMAT_OK);
  assert_int_equal(output->type, QMAT_MEDIAL);
  assert_true(output->sealed);
  const qmat_medial *medial = (const qmat_medial *)output;
  assert_int_equal(medial->sphere_count, 3);
  assert_int_equal(medial->edge_count, 3);
  assert_int_equal(medial->triangle_count, 1);
  assert_true(medial->spheres[7] == 0.5);
  qmat_value_release(output);
  qmat_context_uninit(&context);
}

static void test_the_order_of_rows_does_not_change_the_digest(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_value *first, *second;
  assert_int_equal(run(&context, "3 2 0\nv 0 0 0 1\nv 1 0 0 1\nv 2 0 0 1\ne 0 1\ne 1 2\n", &first), QMAT_OK);
  assert_int_equal(run(&context, "3 2 0\ne 2 1\ne 1 0\nv 0 0 0 1\nv 1 0 0 1\nv 2 0 0 1\n", &second), QMAT_OK);
  assert_memory_equal(&first->digest, &second->digest, sizeof first->digest);
  qmat_value_release(first);
  qmat_value_release(second);
  qmat_context_uninit(&context);
}

static void test_a_single_sphere_of_no_radius_is_read(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_value *output;
  assert_int_equal(run(&context, "1 0 0 v 1 2 3 0", &output), QMAT_OK);
  assert_int_equal(((const qmat_medial *)output)->edge_count, 0);
  qmat_value_release(output);
  qmat_context_uninit(&context);
}

static void test_a_bad_row_is_named_with_its_line(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_value *output;
  assert_int_equal(run(&context, "1 0 0\nv 1 2 3 -4\n", &output), QMAT_ERROR_FORMAT);
  assert_int_equal(context.error.line, 2);
  assert_int_equal(context.error.column, 9);
  assert_string_equal(context.error.element_kind, "sphere");
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_the_node_gives_a_sealed_medial_mesh),
      cmocka_unit_test(test_the_order_of_rows_does_not_change_the_digest),
      cmocka_unit_test(test_a_single_sphere_of_no_radius_is_read),
      cmocka_unit_test(test_a_bad_row_is_named_with_its_line),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
