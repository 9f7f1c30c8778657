/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <time.h>

#include "tests/io/usd/crate_writer.h"
#include "tests/io/usd/usd_examples.h"
#include "tests/io/usd/usd_layers.h"

#define DATA "../shared/data/usd/"

static bool is_there(const char *path) {
  return access(path, R_OK) == 0;
}

static qmat_usd_layer read_layer_file(const char *path) {
  qmat_context context = {0};
  qmat_usd_layer layer = {0};
  qmat_bytes bytes = {0};
  if (qmat_bytes_read_file(&context, path, &bytes) != QMAT_OK ||
      read_layer(&context, &bytes, path, &layer) != QMAT_OK) {
    char line[1024];
    qmat_error_format(&context.error, line, sizeof line);
    fail_msg("%s", line);
  }
  qmat_bytes_uninit(&bytes);
  qmat_context_uninit(&context);
  return layer;
}

/* What differs is known to differ: the files were exported at different times, so that an object had moved, and an
 * image had another name. */
static void test_crates_of_real_assets_say_what_their_texts_say(void **state) {
  (void)state;
  static const struct {
    const char *text, *crate, *differences;
    size_t least; /* values to be compared */
  } twins[] = {
      {DATA "hair.usda", DATA "hair.usdc", "", 80},
      {DATA "texturedcube.usda", DATA "texturedcube.usdc", "xformOp:transform.default inputs:file.default ", 120},
      {DATA "translated-cube.usda", DATA "translated-cube.usdc", "", 64}};
  if (!is_there(twins[0].text)) {
    print_message("skipped: %s is not there\n", DATA);
    skip();
  }
  for (size_t i = 0; i < sizeof twins / sizeof twins[0]; i++) {
    qmat_usd_layer text = read_layer_file(twins[i].text), crate = read_layer_file(twins[i].crate);
    char differences[1024] = "";
    size_t compared = compare_specs(&text, text.root, &crate, crate.root, differences);
    print_message("%s: %zu values\n", twins[i].crate, compared);
    assert_string_equal(differences, twins[i].differences);
    assert_true(compared >= twins[i].least);
    assert_int_equal(text.specs.count, crate.specs.count);
    qmat_usd_layer_uninit(&text);
    qmat_usd_layer_uninit(&crate);
  }
}

static void read_crate(const qmat_writer *crate, qmat_usd_layer *layer) {
  qmat_context context = {0};
  qmat_bytes bytes = memory_file(crate->bytes, crate->size);
  if (qmat_usdc_read(&context, &bytes, "file", layer) != QMAT_OK) fail_msg("%s", context.error.message);
  free(bytes.data);
  qmat_context_uninit(&context);
}

static void test_every_kind_of_value_comes_through_a_crate_of_every_version(void **state) {
  (void)state;
  qmat_usd_layer text = good_layer(usd_example);
  for (int version = 6; version <= 10; version++) {
    qmat_usd_layer crate = {0};
    qmat_writer writer = write_crate(&text, version);
    read_crate(&writer, &crate);
    char differences[1024] = "";
    assert_true(compare_specs(&text, text.root, &crate, crate.root, differences) > 80);
    assert_string_equal(differences, "");
    assert_int_equal(text.specs.count, crate.specs.count);
    const qmat_usd_spec *a = text.root->first_child, *b = crate.root->first_child;
    for (; a; a = a->next, b = b->next) assert_string_equal(a->name, b->name);
    assert_null(b);
    qmat_usd_layer_uninit(&crate);
    qmat_writer_uninit(&writer);
  }
  qmat_usd_layer_uninit(&text);
}

static void assert_crate_refused(const qmat_writer *crate, size_t size, const char *expected) {
  qmat_context context = {0};
  qmat_usd_layer layer = {0};
  qmat_bytes bytes = memory_file(crate->bytes, size);
  assert_int_equal(qmat_usdc_read(&context, &bytes, "file", &layer), QMAT_ERROR_FORMAT);
  if (expected) assert_string_equal(context.error.message, expected);
  assert_string_equal(context.error.file, "file");
  qmat_usd_layer_uninit(&layer);
  free(bytes.data);
  qmat_context_uninit(&context);
}

static void test_versions_that_are_not_read_are_refused_by_number(void **state) {
  (void)state;
  qmat_usd_layer text = good_layer(usd_example);
  qmat_writer writer = write_crate(&text, 8);
  writer.bytes[9] = 5;
  assert_crate_refused(&writer, writer.size, "the crate has version 0.5; only 0.6 to 0.10 are supported");
  writer.bytes[9] = 11;
  assert_crate_refused(&writer, writer.size, "the crate has version 0.11; only 0.6 to 0.10 are supported");
  writer.bytes[8] = 1;
  assert_crate_refused(&writer, writer.size, "the crate has version 1.11; only 0.6 to 0.10 are supported");
  qmat_writer_uninit(&writer);
  qmat_usd_layer_uninit(&text);
}

static void test_every_beginning_of_a_crate_is_refused(void **state) {
  (void)state;
  qmat_usd_layer text = good_layer(usd_example);
  qmat_writer writer = write_crate(&text, 8);
  for (size_t size = 1; size < writer.size; size++) assert_crate_refused(&writer, size, NULL);
  qmat_writer_uninit(&writer);
  qmat_usd_layer_uninit(&text);
}

/* A count in the first table, raised: refused before anything of that size is asked for. */
static void test_counts_beyond_the_file_are_refused(void **state) {
  (void)state;
  qmat_usd_layer text = good_layer(usd_example);
  qmat_writer writer = write_crate(&text, 8);
  qmat_byte_reader toc = {.bytes = writer.bytes, .size = writer.size, .at = 16};
  toc.at = (size_t)qmat_take_u64(&toc) + 8;
  for (int table = 0; table < 6; table++) {
    toc.at += 16;
    const size_t at = (size_t)qmat_take_u64(&toc);
    qmat_take_u64(&toc);
    for (int byte = 3; byte < 8; byte++) {
      writer.bytes[at + (size_t)byte] ^= 0x7F;
      assert_crate_refused(&writer, writer.size, NULL);
      writer.bytes[at + (size_t)byte] ^= 0x7F;
    }
  }
  qmat_writer_uninit(&writer);
  qmat_usd_layer_uninit(&text);
}

/* Damage to the packed bytes of a table seldom means anything, so the numbers are damaged before they are packed. */
static void test_wrong_numbers_in_the_tables_are_refused_by_the_table(void **state) {
  (void)state;
  static const char *const complaints[] = {
      "a string refers to a missing token",
      "a field refers to a missing token",
      "a path refers to a missing token",
      "the table PATHS is not a tree",
  };
  enum { CRATES = 600, KINDS = sizeof complaints / sizeof complaints[0] };
  size_t found[KINDS] = {0};
  qmat_usd_layer text = good_layer(usd_example);
  for (uint64_t seed = 1; seed <= CRATES; seed++) {
    qmat_context context = {0};
    qmat_usd_layer layer = {0};
    qmat_writer writer = write_damaged_crate(&text, 6 + (int)(seed % 5), 2 * seed + 1);
    qmat_bytes bytes = memory_file(writer.bytes, writer.size);
    const qmat_status status = read_layer(&context, &bytes, "file", &layer);
    assert_true(status == QMAT_OK || status == QMAT_ERROR_FORMAT);
    for (size_t i = 0; i < KINDS && status != QMAT_OK; i++)
      found[i] += strstr(context.error.message, complaints[i]) != NULL;
    qmat_usd_layer_uninit(&layer);
    free(bytes.data);
    qmat_writer_uninit(&writer);
    qmat_context_uninit(&context);
  }
  qmat_usd_layer_uninit(&text);
  for (size_t i = 0; i < KINDS; i++)
    if (found[i] == 0) fail_msg("never found: %s", complaints[i]);
}

/* A crate of `count` paths, each with a spec of the type (the first one is the root) and the fields in `sets`. The
 * jumps of all but the last are alike; the element of path i is token `first_token` + i * `step`. Frees the tokens. */
static qmat_writer write_rows(qmat_writer *tokens, size_t token_count, uint32_t first_token, uint32_t step,
                              uint32_t spec_type, int32_t jump, const uint32_t *sets, size_t set_length, size_t count,
                              size_t names) {
  enum { ROWS = 6 };
  qmat_writer body = {0};
  uint32_t *rows[ROWS];
  for (int r = 0; r < ROWS; r++) {
    rows[r] = calloc(count, sizeof *rows[r]);
    assert_non_null(rows[r]);
  }
  for (uint32_t i = 0; i < count; i++) {
    rows[0][i] = i;
    rows[1][i] = first_token + i * step;
    rows[2][i] = (uint32_t)(i + 1 == count ? -2 : i == 0 ? -1 : jump);
    rows[3][i] = i;
    rows[5][i] = i == 0 ? 7 : spec_type;
  }
  for (int i = 0; i < CRATE_HEADER; i++) qmat_put_u8(&body, 0);
  crate_put_u64(&body, names); /* a list of the same name */
  for (size_t i = 0; i < names; i++) qmat_put_u32(&body, 1);
  const uint32_t field_name = 0;
  const uint64_t rep = crate_rep(41, 0, CRATE_HEADER);
  const crate_tables tables = {.token_count = token_count,
                               .token_bytes = tokens->size,
                               .field_count = 1,
                               .set_length = set_length,
                               .path_count = count,
                               .spec_count = count,
                               .tokens = (const char *)tokens->bytes,
                               .field_names = &field_name,
                               .sets = sets,
                               .indices = rows[0],
                               .elements = rows[1],
                               .jumps = rows[2],
                               .spec_paths = rows[3],
                               .spec_sets = rows[4],
                               .spec_types = rows[5],
                               .field_reps = &rep};
  crate_put_tables(&body, 8, &tables);
  for (int r = 0; r < ROWS; r++) free(rows[r]);
  qmat_writer_uninit(tokens);
  return body;
}

/* Reads a crate that a reader of quadratic cost would need minutes for. */
static size_t read_quickly(qmat_writer *crate) {
  qmat_usd_layer layer = {0};
  const clock_t start = clock();
  read_crate(crate, &layer);
  assert_true(clock() - start < 5 * CLOCKS_PER_SEC);
  const size_t count = layer.specs.count;
  qmat_usd_layer_uninit(&layer);
  qmat_writer_uninit(crate);
  return count;
}

static void test_a_million_levels_below_a_target_take_linear_time(void **state) {
  (void)state;
  static const uint32_t no_fields[] = {UINT32_MAX};
  qmat_writer tokens = {0};
  qmat_put_bytes(&tokens, "-\0[x]", 6);
  qmat_writer crate = write_rows(&tokens, 2, 1, 0, 6, -1, no_fields, 1, 1000000, 0);
  assert_int_equal(read_quickly(&crate), 0);
}

static void test_a_list_of_children_that_all_prims_share_takes_linear_time(void **state) {
  (void)state;
  enum { COUNT = 100000 };
  static const uint32_t one_field[] = {0, UINT32_MAX};
  qmat_writer tokens = {0};
  qmat_put_bytes(&tokens, "primChildren", 13);
  for (int64_t i = 1; i <= COUNT; i++) {
    qmat_put_integer(&tokens, i);
    qmat_put_u8(&tokens, 0);
  }
  qmat_writer crate = write_rows(&tokens, COUNT + 1, 1, 1, 6, 0, one_field, 2, COUNT, COUNT);
  assert_int_equal(read_quickly(&crate), COUNT - 1);
}

/* The path of a set of variants, twice: the fields of the second would not fit into the place of the first's. */
static void test_a_set_of_variants_has_one_path(void **state) {
  (void)state;
  static const uint32_t one_field[] = {0, UINT32_MAX};
  qmat_writer tokens = {0};
  qmat_put_bytes(&tokens, "note\0{a=}", 10);
  qmat_writer crate = write_rows(&tokens, 2, 1, 0, 11, 0, one_field, 2, 3, 0);
  assert_crate_refused(&crate, crate.size, "two specs have the same path");
  qmat_writer_uninit(&crate);
}

static void test_more_fields_than_a_spec_may_have_are_refused(void **state) {
  (void)state;
  static uint32_t fields[QMAT_USD_MOST_FIELDS + 2]; /* of the same field */
  qmat_writer tokens = {0};
  fields[QMAT_USD_MOST_FIELDS + 1] = UINT32_MAX;
  qmat_put_bytes(&tokens, "properties", 11);
  qmat_writer crate = write_rows(&tokens, 1, 0, 0, 6, -2, fields, QMAT_USD_MOST_FIELDS + 2, 1, 0);
  assert_crate_refused(&crate, crate.size, "a spec has too many fields");
  qmat_writer_uninit(&crate);
  qmat_put_bytes(&tokens, "properties", 11);
  crate = write_rows(&tokens, 1, 0, 0, 6, -2, fields + 1, QMAT_USD_MOST_FIELDS + 1, 1, 0);
  assert_int_equal(read_quickly(&crate), 0);
}

static void test_a_variant_that_is_there_twice_is_refused(void **state) {
  (void)state;
  static const uint32_t no_fields[] = {UINT32_MAX};
  qmat_writer tokens = {0};
  qmat_put_bytes(&tokens, "-\0{s=v}", 8);
  qmat_writer crate = write_rows(&tokens, 2, 1, 0, 10, 0, no_fields, 1, 3, 0);
  assert_crate_refused(&crate, crate.size, "two specs have the same path");
  qmat_writer_uninit(&crate);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_every_kind_of_value_comes_through_a_crate_of_every_version),
      cmocka_unit_test(test_versions_that_are_not_read_are_refused_by_number),
      cmocka_unit_test(test_every_beginning_of_a_crate_is_refused),
      cmocka_unit_test(test_counts_beyond_the_file_are_refused),
      cmocka_unit_test(test_wrong_numbers_in_the_tables_are_refused_by_the_table),
      cmocka_unit_test(test_a_million_levels_below_a_target_take_linear_time),
      cmocka_unit_test(test_a_list_of_children_that_all_prims_share_takes_linear_time),
      cmocka_unit_test(test_a_set_of_variants_has_one_path),
      cmocka_unit_test(test_more_fields_than_a_spec_may_have_are_refused),
      cmocka_unit_test(test_a_variant_that_is_there_twice_is_refused),
      cmocka_unit_test(test_crates_of_real_assets_say_what_their_texts_say),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
