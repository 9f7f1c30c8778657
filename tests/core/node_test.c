/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/node.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/hash.h"
#include "core/value.h"
#include "tests/locale.h"

typedef struct example_params {
  bool caps;
  int64_t rays;
  int64_t seed;
  double epsilon;
  double angle;
  double weight;
  int method;
  const char *label;
  const char *path;
} example_params;

static const char *const methods[] = {"pairs", "greedy", "none", NULL};

static const qmat_param example_rows[] = {
    {.name = "caps", .type = QMAT_PARAM_BOOL, .default_number = 1, .offset = offsetof(example_params, caps)},
    {.name = "rays",
     .unit = "rays",
     .type = QMAT_PARAM_INT,
     .default_number = 30,
     .min = 1,
     .max = 1000,
     .offset = offsetof(example_params, rays)},
    {.name = "seed", .type = QMAT_PARAM_INT, .min = -0x1p63, .max = 0x1p63, .offset = offsetof(example_params, seed)},
    {.name = "epsilon",
     .unit = "diagonal",
     .type = QMAT_PARAM_FLOAT,
     .default_number = 0.01,
     .min = 0,
     .max = 1,
     .flags = QMAT_PARAM_RELATIVE,
     .offset = offsetof(example_params, epsilon)},
    {.name = "angle",
     .unit = "degrees",
     .type = QMAT_PARAM_FLOAT,
     .default_number = 60,
     .min = -DBL_MAX,
     .max = 90,
     .offset = offsetof(example_params, angle)},
    {.name = "weight",
     .unit = "1",
     .type = QMAT_PARAM_FLOAT,
     .default_number = 1e-5,
     .min = 0,
     .max = INFINITY,
     .offset = offsetof(example_params, weight)},
    {.name = "method",
     .type = QMAT_PARAM_ENUM,
     .default_number = 1,
     .choices = methods,
     .offset = offsetof(example_params, method)},
    {.name = "label", .type = QMAT_PARAM_STRING, .default_text = "thin", .offset = offsetof(example_params, label)},
    {.name = "path", .type = QMAT_PARAM_PATH, .flags = QMAT_PARAM_REQUIRED, .offset = offsetof(example_params, path)},
    {.name = NULL}};

static const qmat_port example_inputs[] = {
    {.name = "mesh", .type = QMAT_MESH}, {.name = "field", .type = QMAT_FIELD, .optional = true}, {.name = NULL}};
static const qmat_port example_outputs[] = {{.name = "medial", .type = QMAT_MEDIAL}, {.name = NULL}};

static qmat_status example_check(qmat_context *context, const void *params) {
  const example_params *p = params;
  if (p->rays != 13) return QMAT_OK;
  qmat_fail(context, QMAT_ERROR_USAGE, "rays must not be 13");
  return qmat_fail_field(context, "rays");
}

static const qmat_node example = {.name = "test.example",
                                  .params_size = sizeof(example_params),
                                  .params = example_rows,
                                  .inputs = example_inputs,
                                  .outputs = example_outputs,
                                  .check = example_check};

static const qmat_node bare = {.name = "test.bare", .outputs = example_outputs};

static qmat_status parse(qmat_context *context, const char *name, const char *text, example_params *params) {
  const qmat_param *param = qmat_param_find(&example, name);
  assert_non_null(param);
  return qmat_param_parse(context, param, text, params);
}

/* The parameter refuses the text with this line, and keeps its value. */
static void assert_refused(const char *name, const char *text, const char *expected) {
  qmat_context context = {0};
  example_params params, before;
  qmat_params_default(&example, &params);
  qmat_params_default(&example, &before);
  assert_int_equal(parse(&context, name, text, &params), QMAT_ERROR_USAGE);
  assert_string_equal(context.error.field, name);
  char line[1024];
  qmat_error_format(&context.error, line, sizeof line);
  assert_string_equal(line, expected);
  assert_memory_equal(&params, &before, sizeof params);
}

static void test_rows_are_counted_and_found_by_name(void **state) {
  (void)state;
  assert_int_equal(qmat_param_count(&example), 9);
  assert_int_equal(qmat_input_count(&example), 2);
  assert_int_equal(qmat_output_count(&example), 1);
  assert_ptr_equal(qmat_param_find(&example, "epsilon"), &example_rows[3]);
  assert_null(qmat_param_find(&example, "epsilo"));
  assert_int_equal(qmat_input_find(&example, "field"), 1);
  assert_int_equal(qmat_input_find(&example, "medial"), SIZE_MAX);
  assert_int_equal(qmat_output_find(&example, "medial"), 0);
  assert_int_equal(qmat_param_count(&bare), 0);
  assert_int_equal(qmat_input_count(&bare), 0);
  assert_null(qmat_param_find(&bare, "epsilon"));
  assert_int_equal(qmat_input_find(&bare, "mesh"), SIZE_MAX);
}

static void test_defaults_come_from_the_rows(void **state) {
  (void)state;
  example_params params;
  memset(&params, 0xFF, sizeof params);
  qmat_params_default(&example, &params);
  assert_true(params.caps);
  assert_int_equal(params.rays, 30);
  assert_int_equal(params.seed, 0);
  assert_true(params.epsilon == 0.01);
  assert_true(params.angle == 60);
  assert_int_equal(params.method, 1);
  assert_string_equal(params.label, "thin");
  assert_null(params.path);
  qmat_params_default(&bare, NULL);
}

static void test_texts_become_values(void **state) {
  (void)state;
  qmat_context context = {0};
  example_params params;
  qmat_params_default(&example, &params);
  const struct {
    const char *text;
    bool value;
  } bools[] = {{"true", true}, {"false", false}, {"yes", true}, {"no", false}, {"on", true}, {"off", false}};
  for (size_t i = 0; i < 6; i++) {
    assert_int_equal(parse(&context, "caps", bools[i].text, &params), QMAT_OK);
    assert_int_equal(params.caps, bools[i].value);
  }
  assert_int_equal(parse(&context, "rays", "1000", &params), QMAT_OK);
  assert_int_equal(params.rays, 1000);
  assert_int_equal(parse(&context, "seed", "-9223372036854775808", &params), QMAT_OK);
  assert_true(params.seed == INT64_MIN);
  assert_int_equal(parse(&context, "seed", "+9223372036854775807", &params), QMAT_OK);
  assert_true(params.seed == INT64_MAX);
  assert_int_equal(parse(&context, "epsilon", "2.5e-2", &params), QMAT_OK);
  assert_true(params.epsilon == 0.025);
  assert_int_equal(parse(&context, "angle", "-1e300", &params), QMAT_OK);
  assert_true(params.angle == -1e300);
  assert_int_equal(parse(&context, "method", "none", &params), QMAT_OK);
  assert_int_equal(params.method, 2);
  assert_int_equal(parse(&context, "label", "", &params), QMAT_OK);
  assert_string_equal(params.label, "");
  const char *path = "models/a b.obj";
  assert_int_equal(parse(&context, "path", path, &params), QMAT_OK);
  assert_ptr_equal(params.path, path);
}

static void test_percentages_are_read_only_for_relative_lengths(void **state) {
  (void)state;
  qmat_context context = {0};
  example_params params;
  qmat_params_default(&example, &params);
  assert_int_equal(parse(&context, "epsilon", "3%", &params), QMAT_OK);
  assert_true(params.epsilon == 0.03);
  assert_int_equal(parse(&context, "epsilon", "100%", &params), QMAT_OK);
  assert_true(params.epsilon == 1);
  assert_refused("angle", "10%", "angle must be a plain number, not the percentage 10%");
  assert_refused("epsilon", "101%", "epsilon must be between 0 and 1 (diagonal), not 101%");
}

static void test_bad_texts_are_refused_by_name_and_range(void **state) {
  (void)state;
  assert_refused("caps", "TRUE", "caps must be true or false, not 'TRUE'");
  assert_refused("caps", "", "caps must be true or false, not ''");
  assert_refused("rays", "0", "rays must be between 1 and 1000 (rays), not 0");
  assert_refused("rays", "1001", "rays must be between 1 and 1000 (rays), not 1001");
  assert_refused("rays", "1e2", "rays must be a whole number, not '1e2'");
  assert_refused("rays", " 1", "rays must be a whole number, not ' 1'");
  assert_refused("rays", "-", "rays must be a whole number, not '-'");
  assert_refused("rays", "0x10", "rays must be a whole number, not '0x10'");
  assert_refused("rays", "99999999999999999999", "rays must be between 1 and 1000 (rays), not 99999999999999999999");
  assert_refused("seed", "9223372036854775808", "seed is out of range: 9223372036854775808");
  assert_refused("seed", "-9223372036854775809", "seed is out of range: -9223372036854775809");
  assert_refused("epsilon", "3", "epsilon must be between 0 and 1 (diagonal), not 3");
  assert_refused("epsilon", "nan",
                 "epsilon must be a number, a percentage, or a length in mm, cm, m, in or ft, not 'nan'");
  assert_refused("epsilon", "-5mm", "epsilon must be between 0 and 1 (diagonal), not -5mm");
  assert_refused("weight", "5mm", "weight must be a number, not '5mm'");
  assert_refused("epsilon", "0,5",
                 "epsilon must be a number, a percentage, or a length in mm, cm, m, in or ft, not '0,5'");
  assert_refused("angle", "90.5", "angle must be at most 90 (degrees), not 90.5");
  assert_refused("weight", "-1e-9", "weight must be at least 0, not -1e-9");
  assert_refused("method", "greddy", "method must be pairs, greedy or none, not 'greddy' (did you mean 'greedy'?)");
  assert_refused("method", "voronoi", "method must be pairs, greedy or none, not 'voronoi'");
  assert_refused("path", "", "path must not be empty");
}

static void test_negative_zero_is_read_as_zero(void **state) {
  (void)state;
  qmat_context context = {0};
  example_params params;
  qmat_params_default(&example, &params);
  assert_int_equal(parse(&context, "epsilon", "-0", &params), QMAT_OK);
  assert_false(signbit(params.epsilon));
}

static void test_the_check_asks_for_required_texts_ranges_and_rules(void **state) {
  (void)state;
  qmat_context context = {0};
  example_params params;
  qmat_params_default(&example, &params);
  assert_int_equal(qmat_params_check(&context, &example, &params), QMAT_ERROR_USAGE);
  assert_string_equal(context.error.message, "path must be given");
  params.path = "a.off";
  assert_int_equal(qmat_params_check(&context, &example, &params), QMAT_OK);
  params.epsilon = (double)NAN;
  assert_int_equal(qmat_params_check(&context, &example, &params), QMAT_ERROR_USAGE);
  assert_string_equal(context.error.field, "epsilon");
  params.epsilon = 1.5;
  assert_int_equal(qmat_params_check(&context, &example, &params), QMAT_ERROR_USAGE);
  assert_string_equal(context.error.message, "epsilon must be between 0 and 1 (diagonal), not 1.5");
  params.epsilon = 1;
  params.method = 3;
  assert_int_equal(qmat_params_check(&context, &example, &params), QMAT_ERROR_USAGE);
  assert_string_equal(context.error.field, "method");
  params.method = 0;
  params.rays = 13;
  assert_int_equal(qmat_params_check(&context, &example, &params), QMAT_ERROR_USAGE);
  assert_string_equal(context.error.message, "rays must not be 13");
  params.rays = 1001;
  assert_int_equal(qmat_params_check(&context, &example, &params), QMAT_ERROR_USAGE);
  assert_string_equal(context.error.message, "rays must be between 1 and 1000 (rays), not 1001");
  assert_int_equal(qmat_params_check(&context, &bare, NULL), QMAT_OK);
}

/* A box of 3 by 4 by 12 units, whose diagonal is 13, in the given unit. */
static qmat_mesh *make_box(double meters_per_unit) {
  qmat_context context = {0};
  qmat_mesh *mesh = qmat_mesh_new();
  mesh->vertex_count = 8;
  mesh->triangle_count = 2;
  mesh->positions = qmat_alloc(24, sizeof *mesh->positions);
  mesh->triangles = qmat_alloc(6, sizeof *mesh->triangles);
  const double sides[3] = {3, 4, 12};
  for (size_t i = 0; i < 24; i++) mesh->positions[i] = (i / 3 >> (i % 3) & 1) != 0 ? sides[i % 3] : 0;
  const uint32_t corners[6] = {0, 1, 2, 7, 6, 5};
  memcpy(mesh->triangles, corners, sizeof corners);
  mesh->meters_per_unit = meters_per_unit;
  assert_int_equal(qmat_value_seal(&context, &mesh->base), QMAT_OK);
  return mesh;
}

static double seen_epsilon;
static int checked;

static qmat_status see_epsilon(qmat_context *context, const void *params, const qmat_value *const inputs[],
                               qmat_value *outputs[]) {
  (void)inputs;
  seen_epsilon = ((const example_params *)params)->epsilon;
  outputs[0] = &qmat_medial_new()->base;
  return qmat_value_seal(context, outputs[0]);
}

static qmat_status check_epsilon(qmat_context *context, const void *params) {
  (void)context;
  checked++;
  assert_true(((const example_params *)params)->epsilon >= 0);
  return QMAT_OK;
}

/* Runs a node on a box with that epsilon; what the node sees is in seen_epsilon. */
static qmat_status run_with(qmat_context *context, const char *epsilon, double meters_per_unit) {
  qmat_node node = example;
  node.run = see_epsilon;
  node.check = check_epsilon;
  example_params params;
  qmat_params_default(&node, &params);
  params.path = "a.off";
  assert_int_equal(parse(context, "epsilon", epsilon, &params), QMAT_OK);
  assert_int_equal(qmat_params_check(context, &node, &params), QMAT_OK);
  const example_params before = params;
  qmat_mesh *box = make_box(meters_per_unit);
  const qmat_value *inputs[2] = {&box->base, NULL};
  qmat_value *output;
  const qmat_status status = qmat_node_run(context, &node, &params, inputs, &output);
  assert_memory_equal(&params, &before, sizeof params);
  qmat_value_release(output);
  qmat_value_release(&box->base);
  return status;
}

static void test_a_length_with_a_unit_is_a_share_of_the_diagonal_when_the_node_runs(void **state) {
  (void)state;
  static const struct {
    const char *text;
    double meters_per_unit, share;
  } lengths[] = {{"13mm", 0.01, 0.1},     {"1.3cm", 0.01, 0.1},    {"0.013m", 0.01, 0.1}, {"13mm", 0.001, 1},
                 {"1in", 1, 0.0254 / 13}, {"1ft", 1, 0.3048 / 13}, {"0mm", 0, 0},         {"1%", 0, 0.01}};
  qmat_context context = {0};
  for (size_t i = 0; i < sizeof lengths / sizeof *lengths; i++) {
    checked = 0;
    assert_int_equal(run_with(&context, lengths[i].text, lengths[i].meters_per_unit), QMAT_OK);
    assert_true(fabs(seen_epsilon - lengths[i].share) < 1e-15);
    assert_int_equal(checked, 1); /* once, on shares */
  }
  assert_int_equal(run_with(&context, "13mm", 0), QMAT_ERROR_USAGE);
  assert_string_equal(context.error.message, "epsilon is 13mm, but the model has no unit of length");
  assert_string_equal(context.error.field, "epsilon");
  assert_non_null(strstr(context.error.hint, "--set model.unit=mm"));
  assert_int_equal(run_with(&context, "26mm", 0.001), QMAT_ERROR_USAGE);
  assert_string_equal(context.error.message,
                      "epsilon must be between 0 and 1 (diagonal), not 26mm of a diagonal of 13 mm");
}

/* Keys of the cache are made of the canonical text. */
static void test_equal_lengths_have_one_canonical_text(void **state) {
  (void)state;
  static const char *const texts[] = {"5mm", "0.5cm", "0.005m", "5e-3m", "+5.0mm"};
  qmat_context context = {0};
  for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
    example_params params, again;
    char text[32];
    qmat_params_default(&example, &params);
    qmat_params_default(&example, &again);
    assert_int_equal(parse(&context, "epsilon", texts[i], &params), QMAT_OK);
    qmat_param_format(qmat_param_find(&example, "epsilon"), &params, text, sizeof text);
    assert_string_equal(text, "0.005m");
    assert_int_equal(parse(&context, "epsilon", text, &again), QMAT_OK);
    assert_memory_equal(&again.epsilon, &params.epsilon, sizeof params.epsilon);
  }
}

static void test_formatted_values_read_back_to_themselves(void **state) {
  (void)state;
  qmat_context context = {0};
  for (uint64_t round = 0; round < 2000; round++) {
    example_params params, again;
    qmat_params_default(&example, &params);
    qmat_params_default(&example, &again);
    params.caps = round % 2 == 0;
    params.rays = (int64_t)(round % 1000) + 1;
    params.seed = (int64_t)qmat_hash3(1, round, 0);
    params.epsilon = qmat_hash_unit(qmat_hash3(1, round, 1));
    params.weight = ldexp(qmat_hash_unit(qmat_hash3(1, round, 2)), (int)(round % 2000) - 1000);
    params.method = (int)(round % 3);
    params.path = "x.off";
    char texts[9][64];
    for (size_t i = 0; i < 9; i++) {
      qmat_param_format(&example_rows[i], &params, texts[i], sizeof texts[i]);
      assert_int_equal(qmat_param_parse(&context, &example_rows[i], texts[i], &again), QMAT_OK);
    }
    assert_int_equal(again.caps, params.caps);
    assert_true(again.rays == params.rays && again.seed == params.seed);
    assert_true(again.epsilon == params.epsilon && again.weight == params.weight && again.angle == params.angle);
    assert_int_equal(again.method, params.method);
    assert_string_equal(again.path, params.path);
    assert_string_equal(again.label, params.label);
  }
}

static void test_formatting_cuts_at_the_size_given(void **state) {
  (void)state;
  example_params params;
  qmat_params_default(&example, &params);
  params.path = "a long path";
  char text[8];
  qmat_param_format(&example_rows[8], &params, text, 7);
  assert_string_equal(text, "a long");
  text[0] = '#';
  qmat_param_format(&example_rows[8], &params, text, 0);
  assert_int_equal(text[0], '#');
  params.path = NULL;
  qmat_param_format(&example_rows[8], &params, text, sizeof text);
  assert_string_equal(text, "");
  params.method = 77;
  qmat_param_format(&example_rows[6], &params, text, sizeof text);
  assert_string_equal(text, "");
}

static void test_numbers_do_not_depend_on_the_locale(void **state) {
  (void)state;
  locale_with_comma();
  char text[32], comma[8];
  snprintf(comma, sizeof comma, "%.1f", 0.5);
  double number = 0, refused = 0;
  const bool read = qmat_parse_number("0.5", &number), read_comma = qmat_parse_number("0,5", &refused);
  qmat_format_number(0.25, text, sizeof text);
  qmat_context context = {0};
  example_params params;
  qmat_params_default(&example, &params);
  const qmat_status status = parse(&context, "epsilon", "1.5", &params);
  setlocale(LC_ALL, "C");
  assert_string_equal(comma, "0,5"); /* the locale was in force */
  assert_true(read && number == 0.5);
  assert_false(read_comma);
  assert_string_equal(text, "0.25");
  assert_int_equal(status, QMAT_ERROR_USAGE);
  assert_string_equal(context.error.message, "epsilon must be between 0 and 1 (diagonal), not 1.5");
}

/* What a node does that breaks its promises. */
typedef enum lapse { MAKES_ALL, MISSES_ONE, LEAVES_ONE_OPEN, MAKES_ANOTHER_TYPE, FAILS_IN_SILENCE, LAPSE_COUNT } lapse;

static lapse present_lapse;
static qmat_report *made_first; /* its first output, of which the test keeps a reference */

static qmat_status make_with_lapse(qmat_context *context, const void *params, const qmat_value *const inputs[],
                                   qmat_value *outputs[]) {
  (void)params, (void)inputs;
  const bool is_another = present_lapse == MAKES_ANOTHER_TYPE;
  qmat_value *second = is_another ? &qmat_report_new()->base : &qmat_medial_new()->base;
  assert_int_equal(qmat_value_seal(context, &made_first->base), QMAT_OK);
  if (present_lapse != LEAVES_ONE_OPEN) assert_int_equal(qmat_value_seal(context, second), QMAT_OK);
  outputs[0] = qmat_value_retain(&made_first->base);
  outputs[1] = second;
  if (present_lapse == MISSES_ONE) {
    qmat_value_release(second);
    outputs[1] = NULL;
  }
  return present_lapse == FAILS_IN_SILENCE ? QMAT_ERROR_GEOMETRY : QMAT_OK;
}

static void test_a_node_that_breaks_its_promises_is_an_error_without_outputs(void **state) {
  (void)state;
  static const qmat_port outputs_of_two[] = {
      {.name = "report", .type = QMAT_REPORT}, {.name = "medial", .type = QMAT_MEDIAL}, {.name = NULL}};
  static const qmat_node node = {.name = "test.two", .outputs = outputs_of_two, .run = make_with_lapse};
  for (present_lapse = MAKES_ALL; present_lapse < LAPSE_COUNT; present_lapse++) {
    qmat_context context = {0};
    qmat_fail(&context, QMAT_ERROR_GEOMETRY, "an earlier error"); /* is not that of this run */
    made_first = qmat_report_new();
    qmat_value *outputs[2] = {(qmat_value *)&context, (qmat_value *)&context};
    const qmat_status status = qmat_node_run(&context, &node, NULL, NULL, outputs);
    if (present_lapse == MAKES_ALL) {
      assert_int_equal(status, QMAT_OK);
      assert_ptr_equal(outputs[0], made_first);
      assert_int_equal(outputs[1]->type, QMAT_MEDIAL);
      qmat_value_release(outputs[0]);
      qmat_value_release(outputs[1]);
    } else {
      const bool is_silent = present_lapse == FAILS_IN_SILENCE;
      assert_int_equal(status, is_silent ? QMAT_ERROR_GEOMETRY : QMAT_ERROR_INTERNAL);
      assert_int_equal(context.error.status, status);
      assert_string_equal(context.error.message, is_silent ? "the node failed without recording an error"
                                                           : "the node did not make its output 'medial'");
      assert_string_equal(context.error.field, is_silent ? "" : "medial");
      assert_string_equal(context.error.node_type, "test.two");
      assert_null(outputs[0]);
      assert_null(outputs[1]);
    }
    assert_null(context.node_type);
    assert_int_equal(made_first->base.references, 1); /* what was made was released */
    qmat_value_release(&made_first->base);
    qmat_context_uninit(&context);
  }
}

static void test_values_are_sealed_and_handed_over_all_or_none(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_report *first = qmat_report_new(), *second = qmat_report_new();
  qmat_value *outputs[2] = {NULL, NULL};
  assert_int_equal(qmat_value_seal(&context, &second->base), QMAT_OK);
  qmat_value_retain(&second->base);
  assert_int_equal(qmat_hand_over(&context, QMAT_OK, (qmat_value *const[]){&first->base, &second->base}, 2, outputs),
                   QMAT_OK);
  assert_ptr_equal(outputs[0], first);
  assert_ptr_equal(outputs[1], second);
  assert_true(first->base.sealed);
  /* An error passes through: both are released (the sanitizer says if not), the second once. */
  qmat_value *none[3] = {NULL, NULL, NULL};
  assert_int_equal(
      qmat_hand_over(&context, QMAT_CANCELLED, (qmat_value *const[]){&first->base, &second->base, NULL}, 3, none),
      QMAT_CANCELLED);
  assert_null(none[0]);
  assert_true(second->base.sealed);
  qmat_value_release(&second->base);
  /* What cannot be sealed is released with what was. */
  qmat_field *field = qmat_field_new();
  qmat_report *report = qmat_report_new();
  field->count = 1; /* and no values */
  assert_int_not_equal(qmat_hand_over(&context, QMAT_OK, (qmat_value *const[]){&report->base, &field->base}, 2, none),
                       QMAT_OK);
  assert_null(none[0]);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_rows_are_counted_and_found_by_name),
      cmocka_unit_test(test_defaults_come_from_the_rows),
      cmocka_unit_test(test_texts_become_values),
      cmocka_unit_test(test_percentages_are_read_only_for_relative_lengths),
      cmocka_unit_test(test_bad_texts_are_refused_by_name_and_range),
      cmocka_unit_test(test_negative_zero_is_read_as_zero),
      cmocka_unit_test(test_the_check_asks_for_required_texts_ranges_and_rules),
      cmocka_unit_test(test_a_length_with_a_unit_is_a_share_of_the_diagonal_when_the_node_runs),
      cmocka_unit_test(test_equal_lengths_have_one_canonical_text),
      cmocka_unit_test(test_formatted_values_read_back_to_themselves),
      cmocka_unit_test(test_formatting_cuts_at_the_size_given),
      cmocka_unit_test(test_numbers_do_not_depend_on_the_locale),
      cmocka_unit_test(test_a_node_that_breaks_its_promises_is_an_error_without_outputs),
      cmocka_unit_test(test_values_are_sealed_and_handed_over_all_or_none),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
