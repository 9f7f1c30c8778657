/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "tests/io/usd/usd_layers.h"

static void assert_numbers(const qmat_usd_value *value, qmat_usd_type type, unsigned components, bool is_array,
                           size_t count, const double *numbers) {
  assert_int_equal(value->type, type);
  assert_int_equal(value->components, components);
  assert_int_equal(value->is_array, is_array);
  assert_int_equal(value->count, count);
  for (size_t i = 0; i < count * components; i++) {
    if (component_of(value, i) != numbers[i]) {
      fail_msg("number %zu is %.17g, not %.17g", i, component_of(value, i), numbers[i]);
    }
  }
}

static void test_metadata_of_the_layer(void **state) {
  (void)state;
  qmat_usd_layer layer = good_layer(
      "#usda 1.0\n( # a remark\n  \"for people\"\n  doc = '''two\nlines'''\n  defaultPrim = \"World\";"
      "metersPerUnit = 0.01\n  upAxis = \"Z\" /*/ one */ // and another\n  /* one\n more */ timeCodesPerSecond = 24\n"
      "  customLayerData = { string by = \"me\"; dictionary deep = { int[] n = [1, 2] } }\n"
      "  subLayers = [@a.usda@ (offset = 2; scale = 0.5), @b.usda@]\n)\n");
  assert_string_equal(qmat_usd_text(value_at(&layer, "", "comment")), "for people");
  assert_string_equal(qmat_usd_text(value_at(&layer, "", "documentation")), "two\nlines");
  assert_string_equal(qmat_usd_text(value_at(&layer, "", "defaultPrim")), "World");
  assert_true(qmat_usd_number(value_at(&layer, "", "metersPerUnit"), 0) == 0.01);
  assert_true(qmat_usd_number(value_at(&layer, "", "timeCodesPerSecond"), 0) == 24);
  const qmat_usd_value *data = value_at(&layer, "", "customLayerData");
  assert_string_equal(qmat_usd_text(qmat_usd_entry(data, "by")), "me");
  static const double one_two[] = {1, 2}, offsets[] = {2, 0.5, 0, 1};
  assert_numbers(qmat_usd_entry(qmat_usd_entry(data, "deep"), "n"), QMAT_USD_INT, 1, true, 2, one_two);
  const qmat_usd_value *sublayers = value_at(&layer, "", "subLayers");
  assert_int_equal(sublayers->count, 2);
  assert_string_equal(sublayers->texts[1], "b.usda");
  assert_numbers(value_at(&layer, "", "subLayerOffsets"), QMAT_USD_DOUBLE, 2, true, 2, offsets);
  qmat_usd_layer_uninit(&layer);
}

static void test_values_of_every_shape(void **state) {
  (void)state;
  qmat_usd_layer layer = good_layer(
      "#usda 1.0\ndef \"a\"\n{\n"
      "  bool yes = true\n  bool[] bits = [0, 1, false]\n  uchar small = 255\n  int low = -2147483648\n"
      "  uint64 most = 18446744073709551615\n  int64 least = -9223372036854775808\n"
      "  half h = 0.1\n  float f = 0.1\n  double d = 0.1\n  double big = -inf\n  float none = nan\n  timecode t = 1.5\n"
      "  float3[] points = [(1, 2, 3), (4, 5, 6),]\n  point3f[] empty = []\n  quatf q = (1, 0, 0, 0.5)\n"
      "  matrix2d m = ((1, 2), (3, 4))\n  matrix2d[] ms = [((1, 2), (3, 4))]\n"
      "  string s = \"a \\\"quoted\\\" \\x41\\102\\n\"\n  token[] names = ['x', \"y\"]\n  asset file = @./a b.png@\n"
      "  asset odd = @@@a@b\\@@@c@@@\n  int blocked = None\n  normal3d n\n  string[] several = [\"\"\"l1\nl2\"\"\", "
      "'']\n}\n");
  static const double bits[] = {0, 1, 0}, points[] = {1, 2, 3, 4, 5, 6}, quaternion[] = {1, 0, 0, 0.5},
                      matrix[] = {1, 2, 3, 4};
  assert_true(qmat_usd_truth(value_at(&layer, "/a.yes", "default"), false));
  assert_numbers(value_at(&layer, "/a.bits", "default"), QMAT_USD_BOOL, 1, true, 3, bits);
  assert_int_equal(value_at(&layer, "/a.small", "default")->integers[0], 255);
  assert_int_equal(value_at(&layer, "/a.low", "default")->integers[0], INT32_MIN);
  assert_int_equal((uint64_t)value_at(&layer, "/a.most", "default")->integers[0], UINT64_MAX);
  assert_int_equal(value_at(&layer, "/a.least", "default")->integers[0], INT64_MIN);
  assert_true(qmat_usd_number(value_at(&layer, "/a.h", "default"), 0) == 0.0999755859375);
  assert_true(qmat_usd_number(value_at(&layer, "/a.f", "default"), 0) == (double)0.1f);
  assert_true(qmat_usd_number(value_at(&layer, "/a.d", "default"), 0) == 0.1);
  assert_true(qmat_usd_number(value_at(&layer, "/a.big", "default"), 0) == -(double)INFINITY);
  assert_true(isnan(qmat_usd_number(value_at(&layer, "/a.none", "default"), 0)));
  assert_true(qmat_usd_number(value_at(&layer, "/a.t", "default"), 0) == 1.5);
  assert_numbers(value_at(&layer, "/a.points", "default"), QMAT_USD_FLOAT, 3, true, 2, points);
  assert_numbers(value_at(&layer, "/a.empty", "default"), QMAT_USD_FLOAT, 3, true, 0, NULL);
  assert_numbers(value_at(&layer, "/a.q", "default"), QMAT_USD_FLOAT, 4, false, 1, quaternion);
  assert_numbers(value_at(&layer, "/a.m", "default"), QMAT_USD_DOUBLE, 4, false, 1, matrix);
  assert_numbers(value_at(&layer, "/a.ms", "default"), QMAT_USD_DOUBLE, 4, true, 1, matrix);
  assert_string_equal(qmat_usd_text(value_at(&layer, "/a.s", "default")), "a \"quoted\" AB\n");
  assert_string_equal(value_at(&layer, "/a.names", "default")->texts[1], "y");
  assert_string_equal(qmat_usd_text(value_at(&layer, "/a.file", "default")), "./a b.png");
  assert_string_equal(qmat_usd_text(value_at(&layer, "/a.odd", "default")), "a@b@@@c");
  assert_int_equal(value_at(&layer, "/a.blocked", "default")->type, QMAT_USD_BLOCK);
  assert_null(qmat_usd_field_value(spec_at(&layer, "/a.n"), "default"));
  assert_string_equal(qmat_usd_text(value_at(&layer, "/a.n", "typeName")), "normal3d");
  assert_string_equal(value_at(&layer, "/a.several", "default")->texts[0], "l1\nl2");
  qmat_usd_layer_uninit(&layer);
}

static void test_prims_arcs_and_properties(void **state) {
  (void)state;
  qmat_usd_layer layer = good_layer(
      "#usda 1.0\nclass \"_base\" {}\nover \"w\" (\n  active = false\n  kind = \"component\"\n"
      "  prepend references = [@a.usd@</p> (offset = 1), </_base>]\n  delete references = @b.usd@\n"
      "  payload = @c.usdc@\n  inherits = </_base>\n  add specializes = [</_base>]\n  variants = { string look = "
      "\"red\" }\n"
      "  prepend variantSets = [\"look\"]\n  append apiSchemas = [\"X\"]\n  instanceable = true\n  hidden = false\n"
      "  relocates = { <a> : <b>, }\n)\n{\n"
      "  custom uniform token[] xformOpOrder = [\"xformOp:translate\"]\n  rel target = [</a>, </b.c>]\n"
      "  prepend rel more = </d>\n  custom rel lone\n  float a.connect = </s.out>\n  float a = 2 ( elementSize = 3\n"
      "    interpolation = \"vertex\" )\n  float b.timeSamples = { 1: 2.5, 3: None, }\n  double s.spline = { bezier, "
      "1: 2 }\n"
      "  reorder nameChildren = [\"y\", \"x\"]\n"
      "  def Xform \"x\" {} def \"y\" ( \"remark\" ) { float z }\n"
      "  variantSet \"look\" = {\n    \"red\" (kind = \"k\") { float a = 9 def \"in\" {} variantSet \"deep\" = { \"v\" "
      "{} } }\n"
      "    \"blue\" {}\n  }\n}\n");
  const qmat_usd_value *references = value_at(&layer, "/w", "references");
  assert_int_equal(references->type, QMAT_USD_LIST_OP);
  assert_false(references->list_op->is_explicit);
  const qmat_usd_value *prepended = &references->list_op->lists[QMAT_USD_PREPENDED];
  assert_int_equal(prepended->count, 2);
  assert_string_equal(prepended->references[0].asset, "a.usd");
  assert_string_equal(prepended->references[0].path, "/p");
  assert_true(prepended->references[0].offset == 1);
  assert_string_equal(prepended->references[1].asset, "");
  assert_string_equal(references->list_op->lists[QMAT_USD_DELETED].references[0].asset, "b.usd");
  const qmat_usd_list_op *payload = value_at(&layer, "/w", "payload")->list_op;
  assert_true(payload->is_explicit);
  assert_string_equal(payload->lists[QMAT_USD_EXPLICIT].references[0].asset, "c.usdc");
  assert_string_equal(value_at(&layer, "/w", "inheritPaths")->list_op->lists[QMAT_USD_EXPLICIT].texts[0], "/_base");
  assert_string_equal(value_at(&layer, "/w", "specializes")->list_op->lists[QMAT_USD_ADDED].texts[0], "/_base");
  assert_string_equal(qmat_usd_text(qmat_usd_entry(value_at(&layer, "/w", "variantSelection"), "look")), "red");
  assert_string_equal(value_at(&layer, "/w", "variantSetNames")->list_op->lists[QMAT_USD_PREPENDED].texts[0], "look");
  assert_string_equal(qmat_usd_text(value_at(&layer, "/w", "specifier")), "over");
  assert_string_equal(qmat_usd_text(value_at(&layer, "/_base", "specifier")), "class");
  assert_false(qmat_usd_truth(value_at(&layer, "/w", "active"), true));
  assert_true(qmat_usd_truth(value_at(&layer, "/w", "instanceable"), false));
  assert_int_equal(value_at(&layer, "/w", "relocates")->type, QMAT_USD_UNREAD);
  assert_string_equal(qmat_usd_text(value_at(&layer, "/w.xformOpOrder", "variability")), "uniform");
  assert_true(qmat_usd_truth(value_at(&layer, "/w.xformOpOrder", "custom"), false));
  assert_int_equal(value_at(&layer, "/w.target", "targetPaths")->list_op->lists[QMAT_USD_EXPLICIT].count, 2);
  assert_string_equal(value_at(&layer, "/w.more", "targetPaths")->list_op->lists[QMAT_USD_PREPENDED].texts[0], "/d");
  assert_string_equal(value_at(&layer, "/w.a", "connectionPaths")->list_op->lists[QMAT_USD_EXPLICIT].texts[0],
                      "/s.out");
  assert_true(qmat_usd_number(value_at(&layer, "/w.a", "default"), 0) == 2);
  assert_true(qmat_usd_number(value_at(&layer, "/w.a", "elementSize"), 0) == 3);
  const qmat_usd_samples *samples = value_at(&layer, "/w.b", "timeSamples")->samples;
  assert_int_equal(samples->count, 2);
  assert_true(samples->times[1] == 3 && samples->values[0]->numbers[0] == 2.5);
  assert_int_equal(samples->values[1]->type, QMAT_USD_BLOCK);
  assert_int_equal(value_at(&layer, "/w.s", "spline")->type, QMAT_USD_UNREAD);
  const qmat_usd_spec *w = spec_at(&layer, "/w");
  const qmat_usd_spec *set = qmat_usd_child(&layer, w, QMAT_USD_VARIANT_SET, "look");
  const qmat_usd_spec *red = qmat_usd_child(&layer, set, QMAT_USD_VARIANT, "red");
  assert_non_null(qmat_usd_child(&layer, set, QMAT_USD_VARIANT, "blue"));
  assert_non_null(qmat_usd_child(&layer, red, QMAT_USD_PRIM, "in"));
  assert_non_null(qmat_usd_child(&layer, red, QMAT_USD_VARIANT_SET, "deep"));
  assert_string_equal(qmat_usd_text(qmat_usd_field_value(red, "kind")), "k");
  assert_int_equal(spec_at(&layer, "/w/y")->line, 29);
  qmat_usd_layer_uninit(&layer);
}

static void assert_bad(const char *text, const char *expected) {
  qmat_context context = {0};
  qmat_usd_layer layer = {0};
  char line[1024];
  assert_int_equal(read_layer_text(&context, text, &layer), QMAT_ERROR_FORMAT);
  qmat_error_format(&context.error, line, sizeof line);
  assert_string_equal(line, expected);
  qmat_usd_layer_uninit(&layer);
  qmat_context_uninit(&context);
}

static void test_mistakes_have_their_place(void **state) {
  (void)state;
  assert_bad("usda", "file:1:1: a text layer of USD must start with '#usda 1.0'");
  assert_bad("#usda 2.0\n", "file:1:1: only version 1 of the text form of USD is supported");
  assert_bad("#usda 1.0\ndef \"a\" {", "file:2:10: expected the name of a type, found the end of the file");
  assert_bad("#usda 1.0\ndef \"a\" {}\n def \"a\" {}", "file:3:2: duplicate prim 'a'");
  assert_bad("#usda 1.0\ndef \"a b\" {}", "file:2:1: 'a b' is not a valid name of a prim");
  assert_bad("#usda 1.0\ndef \"a\" {\n int i = 1.5\n}",
             "file:3:10: this is not a whole number, or out of the range of its type");
  assert_bad("#usda 1.0\ndef \"a\" {\n int i = 2147483648\n}",
             "file:3:10: this is not a whole number, or out of the range of its type");
  assert_bad("#usda 1.0\ndef \"a\" {\n float3 p = (1, 2)\n}", "file:3:18: expected ',', found ')'");
  assert_bad("#usda 1.0\ndef \"a\" {\n float[] p = [1 2]\n}", "file:3:17: expected ',' or ']', found '2'");
  assert_bad("#usda 1.0\ndef \"a\" {\n string s = \"x\n\"}", "file:3:13: this text has no end");
  assert_bad("#usda 1.0\ndef \"a\" {\n rel r = </x\n}", "file:3:10: this path has no end");
  assert_bad("#usda 1.0\ndef \"a\" {\n asset r = @x\n}", "file:3:12: this asset has no end");
  assert_bad("#usda 1.0\n?", "file:2:1: expected def, over or class, found '?'");
  assert_bad("#usda 1.0\n(upAxis \"Z\")", "file:2:9: expected '=', found '\"Z'");
  assert_bad("#usda 1.0\ndef \"a\" { float x.y = 1 }", "file:2:19: expected connect, timeSamples or spline, found 'y'");
}

static void test_nesting_without_end_is_refused(void **state) {
  (void)state;
  enum { COUNT = 100000 };
  static const struct {
    const char *start, *repeated, *expected;
  } cases[] = {
      {"#usda 1.0\n", "def\"a\"{", "file:2: prims are nested more than 200 deep"},
      {"#usda 1.0\n(customData={", "dictionary a={", "file:2:2813: dictionaries are nested more than 200 deep"},
      {"#usda 1.0\n(x=", "[", "file:2:4: this value has no end"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    size_t length = strlen(cases[i].repeated), at = strlen(cases[i].start);
    char *text = malloc(at + COUNT * length + 1);
    assert_non_null(text);
    strcpy(text, cases[i].start);
    for (size_t k = 0; k < COUNT; k++) memcpy(text + at + k * length, cases[i].repeated, length + 1);
    assert_bad(text, cases[i].expected);
    free(text);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_metadata_of_the_layer),          cmocka_unit_test(test_values_of_every_shape),
      cmocka_unit_test(test_prims_arcs_and_properties),      cmocka_unit_test(test_mistakes_have_their_place),
      cmocka_unit_test(test_nesting_without_end_is_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
