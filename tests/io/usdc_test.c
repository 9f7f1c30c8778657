/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "tests/io/usd_layers.h"

#define DATA "../shared/data/usd/"

static bool is_there(const char *path) {
  return access(path, R_OK) == 0;
}

static qmat_usd_layer read_layer_file(const char *path) {
  qmat_context context = {0};
  qmat_usd_layer layer = {0};
  qmat_bytes bytes = {0};
  if (qmat_bytes_read_file(&context, path, &bytes) != QMAT_OK ||
      qmat_usd_layer_read(&context, &bytes, path, &layer) != QMAT_OK) {
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
    assert_int_equal(text.spec_count, crate.spec_count);
    qmat_usd_layer_uninit(&text);
    qmat_usd_layer_uninit(&crate);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_crates_of_real_assets_say_what_their_texts_say),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
