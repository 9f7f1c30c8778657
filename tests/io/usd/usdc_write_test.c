/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usdc_write.h"

#include "io/usd/usdc_pack.h"
#include "tests/io/usd/usd_layers.h"
#include "tests/random.h"

#define DATA "../shared/data/usd/"

static qmat_writer written_of(qmat_usd_layer *layer) {
  qmat_context context = {0};
  qmat_writer out = {0};
  if (qmat_usdc_write(&context, layer, &out) != QMAT_OK) fail_msg("%s", context.error.message);
  qmat_context_uninit(&context);
  return out;
}

/* Writes a layer as a crate and reads that. Returns the number of equal values. */
static size_t assert_comes_back(qmat_usd_layer *layer) {
  qmat_context context = {0};
  qmat_usd_layer read = {0};
  char differences[1024] = "";
  qmat_writer out = written_of(layer), again = written_of(layer);
  assert_int_equal(out.size, again.size);
  assert_memory_equal(out.bytes, again.bytes, out.size);
  qmat_bytes bytes = memory_file(out.bytes, out.size);
  if (qmat_usdc_read(&context, &bytes, "crate", &read) != QMAT_OK) fail_msg("%s", context.error.message);
  const size_t compared = compare_specs(layer, layer->root, &read, read.root, differences);
  assert_string_equal(differences, "");
  free(bytes.data);
  qmat_writer_uninit(&out);
  qmat_writer_uninit(&again);
  qmat_usd_layer_uninit(&read);
  qmat_context_uninit(&context);
  return compared;
}

static const char every_type[] =
    "#usda 1.0\n( defaultPrim = \"a\" doc = \"text\" metersPerUnit = 0.01 startTimeCode = 1 upAxis = \"Z\"\n"
    "  customLayerData = { string s = \"x\" dictionary d = { int i = -3 double f = 0.1 } bool b = true }\n"
    "  subLayers = [@one.usda@, @two.usdc@ (offset = 2; scale = 0.5)] )\n"
    "class Xform \"a\" ( apiSchemas = [\"A\", \"B\"] kind = \"component\" ) {\n"
    "  bool b = true\n uchar c = 200\n int i = -7\n uint u = 4000000000\n int64 l = -5000000000\n uint64 m = 1\n"
    "  half h = 0.333\n half[] hs = [1e-7, -65504, 0, 1]\n float f = 0.1\n double d = 0.1\n timecode t = 2.5\n"
    "  string s = \"two\\nlines\"\n token k = \"k\"\n asset e = @x.png@\n asset[] es = [@x.png@, @y.png@]\n"
    "  int2 i2 = (1, -2)\n float3 f3 = (1, 2, 0.3)\n double4 d4 = (1, 2, 3, 4)\n half2 h2 = (1, 2)\n"
    "  quatf q = (1, 2, 3, 4)\n quatd[] qs = [(1, 0, 0, 0), (0.5, 0.25, 0, 1)]\n"
    "  matrix2d m2 = ((1, 2), (3, 4))\n matrix3d m3 = ((1, 2, 3), (4, 5, 6), (7, 8, 9))\n"
    "  matrix4d m4 = ((1, 2, 3, 4), (5, 6, 7, 8), (9, 10, 11, 12), (13, 14, 15, 16))\n"
    "  int[] none = []\n int[] few = [3, 1, 2]\n token[] names = [\"x\", \"y\"]\n string[] texts = [\"x\", \"\"]\n"
    "  int[] many = [0, 1, 2, 3, 5, 4, 300, -70000, 2147483647, -2147483648, 0, 0, 1, 2, 3, 4, 5, 6]\n"
    "  uint[] large = [0, 4294967295, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]\n"
    "  float[] w = [1, 2] ( interpolation = \"vertex\" elementSize = 2 customData = { int[] v = [1, 2] } )\n"
    "  custom uniform token p = \"q\"\n float blocked = None\n float unset\n"
    "  rel r = [</a/b>, </a.f>]\n rel empty\n add rel added = </a>\n float to.connect = </a/b.f>\n"
    "  over \"b\" ( prepend references = [@x.usd@</p> (offset = 1), </a>] append payload = @y.usd@</p/q>\n"
    "    inherits = </a> instanceable = false delete apiSchemas = [\"A\"] ) { float f = 1 }\n"
    "  reorder nameChildren = [\"b\"]\n}\n"
    "def \"c\" {}\n";

static void test_every_type_comes_back(void **state) {
  (void)state;
  qmat_usd_layer layer = good_layer(every_type);
  assert_true(assert_comes_back(&layer) > 100);
  qmat_usd_layer_uninit(&layer);
  layer = good_layer("#usda 1.0\n");
  assert_int_equal(assert_comes_back(&layer), 0);
  qmat_usd_layer_uninit(&layer);
}

/* Text leaves these types open; a reader of crates relies on them. */
static void test_fields_have_the_types_of_the_schema(void **state) {
  (void)state;
  static const struct {
    const char *path, *field;
    qmat_usd_type type;
  } fields[] = {{"", "metersPerUnit", QMAT_USD_DOUBLE},
                {"", "startTimeCode", QMAT_USD_DOUBLE},
                {"", "upAxis", QMAT_USD_TOKEN},
                {"", "defaultPrim", QMAT_USD_TOKEN},
                {"", "documentation", QMAT_USD_STRING},
                {"/a", "kind", QMAT_USD_TOKEN},
                {"/a.w", "interpolation", QMAT_USD_TOKEN},
                {"/a.w", "elementSize", QMAT_USD_INT},
                {"/a.f", "custom", QMAT_USD_BOOL},
                {"/a.f", "variability", QMAT_USD_TOKEN}};
  qmat_context context = {0};
  qmat_usd_layer layer = good_layer(every_type), read = {0};
  qmat_writer out = written_of(&layer);
  qmat_bytes bytes = memory_file(out.bytes, out.size);
  assert_int_equal(qmat_usdc_read(&context, &bytes, "crate", &read), QMAT_OK);
  for (size_t i = 0; i < sizeof fields / sizeof *fields; i++)
    assert_int_equal(value_at(&read, fields[i].path, fields[i].field)->type, fields[i].type);
  assert_string_equal(qmat_usd_text(value_at(&read, "/a", "specifier")), "class");
  assert_string_equal(qmat_usd_text(value_at(&read, "/a/b", "specifier")), "over");
  free(bytes.data);
  qmat_writer_uninit(&out);
  qmat_usd_layer_uninit(&read);
  qmat_usd_layer_uninit(&layer);
}

static void test_texts_of_real_assets_come_back(void **state) {
  (void)state;
  static const char *const names[] = {DATA "hair.usda", DATA "texturedcube.usda", DATA "translated-cube.usda"};
  if (access(names[0], R_OK) != 0) {
    print_message("skipped: %s is not there\n", DATA);
    skip();
  }
  for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
    qmat_context context = {0};
    qmat_usd_layer layer = {0};
    qmat_bytes bytes = {0};
    assert_int_equal(qmat_bytes_read_file(&context, names[i], &bytes), QMAT_OK);
    assert_int_equal(qmat_usda_read(&context, &bytes, names[i], &layer), QMAT_OK);
    assert_true(assert_comes_back(&layer) >= 64);
    qmat_bytes_uninit(&bytes);
    qmat_usd_layer_uninit(&layer);
  }
}

/* The header, and the table of contents at the end, by hand. */
static void test_an_empty_layer_by_hand(void **state) {
  (void)state;
  qmat_usd_layer layer = good_layer("#usda 1.0\n");
  qmat_writer out = written_of(&layer);
  static const uint8_t start[] = "PXR-USDC\0\10\0\0\0\0\0\0";
  assert_memory_equal(out.bytes, start, 16);
  qmat_byte_reader reader = {.bytes = out.bytes, .size = out.size, .at = 16};
  reader.at = qmat_take_u64(&reader);
  assert_int_equal(qmat_bytes_left(&reader), 8 + 6 * 32);
  assert_int_equal(qmat_take_u64(&reader), 6);
  uint64_t place = 88;
  static const char *const names[] = {"TOKENS", "STRINGS", "FIELDS", "FIELDSETS", "PATHS", "SPECS"};
  for (size_t i = 0; i < 6; i++) {
    assert_string_equal((const char *)qmat_take_bytes(&reader, 16), names[i]);
    assert_int_equal(qmat_take_u64(&reader), place);
    place += qmat_take_u64(&reader);
  }
  qmat_writer_uninit(&out);
  qmat_usd_layer_uninit(&layer);
}

static void assert_integers_come_back(const int32_t *integers, size_t count) {
  qmat_context context = {0};
  qmat_usd_layer layer = {.context = &context, .path = "file"};
  qmat_writer out = {0};
  static int64_t read[1000];
  qmat_usdc_put_integers(&out, integers, count);
  assert_false(out.failed);
  qmat_byte_reader reader = {.bytes = out.bytes, .size = out.size};
  assert_int_equal(qmat_usdc_take_integers(&layer, &reader, count, 4, read), QMAT_OK);
  assert_int_equal(qmat_bytes_left(&reader), 0);
  for (size_t i = 0; i < count; i++) assert_int_equal(read[i], integers[i]);
  qmat_writer_uninit(&out);
  qmat_context_uninit(&context);
}

static void test_integers_come_back(void **state) {
  (void)state;
  static const int32_t few[] = {0, 127, -1, 127, -32768, 32767, INT32_MIN, INT32_MAX, INT32_MIN, 5};
  static int32_t many[1000];
  random_numbers random = {.seed = 3};
  for (size_t count = 0; count <= 10; count++) assert_integers_come_back(few, count);
  for (int width = 1; width < 31; width += 5) {
    for (size_t i = 0; i < 1000; i++) many[i] = (int32_t)random_between(&random, -(1 << width), 1 << width);
    assert_integers_come_back(many, 1000);
  }
}

static void test_what_is_not_written_is_refused(void **state) {
  (void)state;
  static const char *const texts[][2] = {
      {"#usda 1.0\ndef \"a\" { variantSet \"v\" = { \"x\" {} } }", "a crate is not written with variants"},
      {"#usda 1.0\ndef \"a\" { float f.timeSamples = { 1: 2 } }",
       "a crate is not written with a value of an unknown type"},
      {"#usda 1.0\ndef \"a\" ( references = @x.usda@ ) {}",
       "a crate is not written with a path that is missing or relative, or has variants"},
      {"#usda 1.0\ndef \"a\" { rel r = <../b> }",
       "a crate is not written with a path that is missing or relative, or has variants"}};
  for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
    qmat_context context = {0};
    qmat_writer out = {0};
    qmat_usd_layer layer = good_layer(texts[i][0]);
    assert_int_equal(qmat_usdc_write(&context, &layer, &out), QMAT_ERROR_INTERNAL);
    assert_string_equal(context.error.message, texts[i][1]);
    qmat_writer_uninit(&out);
    qmat_usd_layer_uninit(&layer);
    qmat_context_uninit(&context);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_every_type_comes_back),
      cmocka_unit_test(test_fields_have_the_types_of_the_schema),
      cmocka_unit_test(test_texts_of_real_assets_come_back),
      cmocka_unit_test(test_an_empty_layer_by_hand),
      cmocka_unit_test(test_integers_come_back),
      cmocka_unit_test(test_what_is_not_written_is_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
