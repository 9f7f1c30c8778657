/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/node.h"
#include "tests/shapes.h"

extern const qmat_node qmat_node_mesh_scale;

/* Runs the node on a box of the given length. The caller releases `*scaled`. */
static qmat_status scale_box(qmat_context *context, double length, const char *factor, qmat_value **scaled) {
  const qmat_node *node = &qmat_node_mesh_scale;
  double params[8];
  assert_true(node->params_size <= sizeof params);
  qmat_params_default(node, params);
  assert_int_equal(qmat_param_parse(context, qmat_param_find(node, "factor"), factor, params), QMAT_OK);
  qmat_mesh *box = shape_seal(shape_box(length, 1, 1));
  const qmat_value *inputs[] = {&box->base};
  *scaled = NULL;
  const qmat_status status = node->run(context, params, inputs, scaled);
  qmat_value_release(&box->base);
  return status;
}

static void test_lengths_are_multiplied_and_triangles_stay(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_value *value;
  assert_int_equal(scale_box(&context, 2, "2.5", &value), QMAT_OK);
  const qmat_mesh *mesh = (const qmat_mesh *)value;
  assert_int_equal(mesh->vertex_count, 8);
  assert_int_equal(mesh->triangle_count, 12);
  assert_true(mesh->closed && mesh->oriented && value->sealed);
  double longest = 0;
  for (size_t i = 0; i < mesh->vertex_count; i++) longest = fmax(longest, mesh->positions[3 * i]);
  assert_near(longest, 5, 0);
  qmat_value_release(value);
  qmat_context_uninit(&context);
}

static void test_a_length_beyond_all_numbers_is_an_error_that_names_the_vertex(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_value *value;
  assert_int_equal(scale_box(&context, 1e300, "1e12", &value), QMAT_ERROR_GEOMETRY);
  assert_null(value);
  assert_true(context.error.element >= 0);
  qmat_context_uninit(&context);
}

static void test_a_factor_of_zero_is_out_of_range(void **state) {
  (void)state;
  qmat_context context = {0};
  const qmat_node *node = &qmat_node_mesh_scale;
  double params[8];
  qmat_params_default(node, params);
  assert_int_equal(qmat_param_parse(&context, qmat_param_find(node, "factor"), "0", params), QMAT_ERROR_USAGE);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_lengths_are_multiplied_and_triangles_stay),
      cmocka_unit_test(test_a_length_beyond_all_numbers_is_an_error_that_names_the_vertex),
      cmocka_unit_test(test_a_factor_of_zero_is_out_of_range),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
