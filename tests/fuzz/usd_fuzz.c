/* SPDX-License-Identifier: GPL-3.0-or-later */
/* usd_fuzz COUNT [SEED]: reads COUNT damaged copies each of text layers, crates and packages of USD. A copy is made
 * from its number alone, so that a failure can be found again: the last line names it. Ends with an error where a
 * reader takes more memory at once than the file justifies, or more seconds than any of them needs; crashes are for the
 * sanitizers to find. */
#include "io/usd/usd_medial.h"
#include "io/usd/usd_scene.h"
#include "io/usd/usdz.h"
#include "tests/fuzz/fuzz.h"
#include "tests/io/usd/crate_writer.h"
#include "tests/io/usd/usd_examples.h"
#include "tests/io/usd/usd_layers.h"

#define DATA "../shared/data/usd/"

/* Reads the bytes in every way; true when a scene came of them. */
static bool read_all(const uint8_t *content, size_t size) {
  static const char path[] = "/no such folder/file.usd";
  qmat_context context = {0};
  qmat_usd_layer layer = {0};
  qmat_soup soup = {0};
  qmat_medial *medial = NULL;
  json_t *report = json_object(), *facts = json_object();
  qmat_bytes bytes = memory_file(content, size);
  qmat_usd_layer_read(&context, &bytes, path, &layer);
  qmat_usd_layer_uninit(&layer);
  const qmat_status status = qmat_usd_read(&context, &bytes, path, &soup, report);
  qmat_status made = status;
  if (status == QMAT_OK) {
    const qmat_read_options options = {.defects = QMAT_DEFECTS_DROP};
    qmat_mesh *mesh = NULL;
    made = qmat_soup_to_mesh(&context, &soup, path, &options, &mesh, NULL);
    if (mesh) qmat_value_release(&mesh->base);
  }
  if (made != QMAT_OK) assert_true(context.error.message[0] != '\0' && context.error.status != QMAT_ERROR_INTERNAL);
  if (qmat_usd_read_medial(&context, &bytes, path, NULL, &medial, facts) == QMAT_OK) qmat_value_release(&medial->base);
  qmat_soup_uninit(&soup);
  json_decref(report);
  json_decref(facts);
  free(bytes.data);
  qmat_context_uninit(&context);
  return status == QMAT_OK;
}

static void test_damaged_texts(void **state) {
  (void)state;
  sample samples[8];
  size_t count = 0;
  add_sample(samples, &count, "the example's text", usd_example, sizeof usd_example - 1);
  add_file(samples, &count, DATA "texturedcube.usda");
  add_file(samples, &count, DATA "pyramid_creases.usda");
  add_file(samples, &count, DATA "skintest.usda");
  try_damaged_copies(samples, count, read_all);
  free_samples(samples, count);
}

static void test_damaged_crates(void **state) {
  (void)state;
  sample samples[16];
  size_t count = 0;
  qmat_usd_layer text = good_layer(usd_example);
  for (int version = 6; version <= 10; version += 2) {
    qmat_writer writer = write_crate(&text, version);
    add_sample(samples, &count, "the example's crate", writer.bytes, writer.size);
    qmat_writer_uninit(&writer);
  }
  qmat_usd_layer_uninit(&text);
  add_file(samples, &count, DATA "hair.usdc");
  add_file(samples, &count, DATA "texturedcube.usdc");
  add_file(samples, &count, DATA "translated-cube.usdc");
  try_damaged_copies(samples, count, read_all);
  free_samples(samples, count);
}

static void test_damaged_packages(void **state) {
  (void)state;
  sample samples[4];
  size_t count = 0;
  qmat_writer writer = {0};
  qmat_usdz_put(&writer, "a.usda", usd_example, sizeof usd_example - 1);
  add_sample(samples, &count, "the example's package", writer.bytes, writer.size);
  qmat_writer_uninit(&writer);
  add_file(samples, &count, DATA "cube.usdz");
  try_damaged_copies(samples, count, read_all);
  free_samples(samples, count);
}

/* The tables of a crate are packed, and damage to them seldom means what it says: here numbers in them are wrong. */
static void test_crates_with_wrong_tables(void **state) {
  (void)state;
  qmat_usd_layer text = good_layer(usd_example);
  size_t read = 0;
  largest_request = 0;
  for (uint64_t number = 0; number < mutation_count; number++) {
    qmat_writer writer = write_damaged_crate(&text, 6 + (int)(number % 5), qmat_hash3(mutation_seed, number, 0) | 1);
    const double start = seconds_of_processor();
    read += read_all(writer.bytes, writer.size);
    if (largest_request > FREE_BYTES || seconds_of_processor() - start > MOST_SECONDS) {
      fail_msg("crate %llu: %zu bytes at once", (unsigned long long)number, largest_request);
    }
    qmat_writer_uninit(&writer);
  }
  print_message("%llu crates with wrong tables: %zu were read, at most %zu bytes at once\n",
                (unsigned long long)mutation_count, read, largest_request);
  qmat_usd_layer_uninit(&text);
}

int main(int argc, char **argv) {
  if (argc > 1) mutation_count = strtoull(argv[1], NULL, 10);
  if (argc > 2) mutation_seed = strtoull(argv[2], NULL, 10);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_damaged_texts),
      cmocka_unit_test(test_damaged_crates),
      cmocka_unit_test(test_damaged_packages),
      cmocka_unit_test(test_crates_with_wrong_tables),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
