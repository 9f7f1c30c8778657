/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <sys/stat.h>

#include "tests/io/files.h"

#include "io/gltf/gltf_asset.h"
#include "io/save.h"
#include "io/side_files.h"
#include "io/usd/usdc.h"
#include "io/usd/usdc_write.h"
#include "tests/io/gltf/gltf_assets.h"

/* A .gltf that names the given files: the first as a buffer, the others as images. `content` is in each of them. */
static qmat_file *make_file(const char *text, const char *const names[], size_t count, const char *content) {
  qmat_context context = {0};
  qmat_file *file = qmat_file_new();
  assert_non_null(file);
  file->format = qmat_strdup("gltf");
  file->part_count = 1 + count;
  file->parts = qmat_calloc(1 + count, sizeof *file->parts);
  char *json = asset_json(text);
  for (size_t i = 0; i <= count; i++) {
    const char *bytes = i == 0 ? json : content;
    file->parts[i].name = qmat_strdup(i == 0 ? "" : names[i - 1]);
    file->parts[i].bytes = (uint8_t *)qmat_strdup(bytes);
    file->parts[i].size = strlen(bytes);
  }
  free(json);
  assert_int_equal(qmat_value_seal(&context, &file->base), QMAT_OK);
  qmat_context_uninit(&context);
  return file;
}

static const char *const plain_names[] = {"buf.bin", "a/t.png", "b/t.png", "a b.png"};
static const char plain_text[] =
    "{'asset':{'version':'2.0'},'buffers':[{'uri':'buf.bin','byteLength':4}],"
    "'images':[{'uri':'a/t.png'},{'uri':'b/t.png'},{'uri':'a%20b.png'},{'uri':'./a/t.png'},"
    "{'uri':'http://x/y.png'},{'uri':'data:image/png;base64,AAAA'}]}";

static const char *uri_of(const qmat_gltf_asset *asset, const char *array, size_t index) {
  return json_string_value(json_object_get(json_array_get(json_object_get(asset->root, array), index), "uri"));
}

static void test_side_files_are_named_after_the_output(void **state) {
  (void)state;
  static const char *const expected[] = {"", "my out.bin", "my out_t.png", "my out_t-2.png", "my out_a b.png"};
  qmat_context context = {0};
  qmat_file *file = make_file(plain_text, plain_names, 4, "four"), *named;
  assert_int_equal(qmat_file_name_sides(&context, file, "some/folder/my out.gltf", &named), QMAT_OK);
  assert_int_equal(named->part_count, 5);
  for (size_t i = 0; i < 5; i++) assert_string_equal(named->parts[i].name, expected[i]);
  qmat_gltf_asset asset;
  assert_int_equal(qmat_gltf_asset_init(&context, named->parts[0].bytes, named->parts[0].size, "x", &asset), QMAT_OK);
  assert_string_equal(uri_of(&asset, "buffers", 0), "my%20out.bin");
  assert_string_equal(uri_of(&asset, "images", 0), "my%20out_t.png");
  assert_string_equal(uri_of(&asset, "images", 1), "my%20out_t-2.png");
  assert_string_equal(uri_of(&asset, "images", 2), "my%20out_a%20b.png");
  assert_string_equal(uri_of(&asset, "images", 3), "my%20out_t.png");
  assert_string_equal(uri_of(&asset, "images", 4), "http://x/y.png");
  assert_string_equal(uri_of(&asset, "images", 5), "data:image/png;base64,AAAA");
  qmat_gltf_asset_uninit(&asset);
  qmat_value_release(&named->base);
  qmat_value_release(&file->base);
  qmat_context_uninit(&context);
}

static void test_names_stay_within_what_file_systems_take(void **state) {
  (void)state;
  char name[256], text[512];
  memset(name, 'x', 250);
  strcpy(name + 250, ".png");
  snprintf(text, sizeof text, "{'asset':{'version':'2.0'},'images':[{'uri':'%s'}]}", name);
  const char *const names[] = {name};
  qmat_context context = {0};
  qmat_file *file = make_file(text, names, 1, "four"), *named;
  assert_int_equal(qmat_file_name_sides(&context, file, "out.gltf", &named), QMAT_OK);
  assert_int_equal(strlen(named->parts[1].name), 255);
  assert_memory_equal(named->parts[1].name, "out_x", 5);
  assert_string_equal(named->parts[1].name + 250, "x.png");
  qmat_value_release(&named->base);
  qmat_value_release(&file->base);
  qmat_context_uninit(&context);
}

static void test_other_formats_and_files_without_sides_stay_as_they_are(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_file *alone = make_file("{'asset':{'version':'2.0'}}", NULL, 0, ""), *named;
  assert_int_equal(qmat_file_name_sides(&context, alone, "out.gltf", &named), QMAT_OK);
  assert_ptr_equal(alone, named);
  qmat_value_release(&named->base);
  qmat_value_release(&alone->base);
  qmat_context_uninit(&context);
}

/* Names, checks and saves. */
static qmat_status save(qmat_context *context, const qmat_file *file, const char *path) {
  qmat_file *named = NULL;
  qmat_status status = qmat_file_name_sides(context, file, path, &named);
  if (status == QMAT_OK) status = qmat_file_check_sides(context, named, path);
  if (status == QMAT_OK) status = qmat_file_save(context, named, path);
  if (named) qmat_value_release(&named->base);
  return status;
}

static void test_the_file_below_a_layer_of_usd_is_named_after_the_layer(void **state) {
  (void)state;
  static const struct {
    const char *path, *text, *name;
  } cases[] = {{"x/out.usda", "q = \"out_original.usdc\" s = @out_original.usdc@ original.usdc", "out_original.usdc"},
               {"x/a@b.usda", "q = \"original.usdc\" s = @@@a@b_original.usdc@@@ original.usdc", "a@b_original.usdc"}};
  for (size_t i = 0; i < 2; i++) {
    static const char *const names[] = {"original.usdc"};
    qmat_context context = {0};
    qmat_file *file = make_file("{}", names, 1, "crate"), *named;
    file->base.sealed = false;
    qmat_free(file->format);
    file->format = qmat_strdup("usda");
    qmat_free(file->parts[0].bytes);
    file->parts[0].bytes = (uint8_t *)qmat_strdup("q = \"original.usdc\" s = @original.usdc@ original.usdc");
    file->parts[0].size = strlen((const char *)file->parts[0].bytes);
    assert_int_equal(qmat_file_name_sides(&context, file, cases[i].path, &named), QMAT_OK);
    assert_int_equal(named->part_count, 2);
    assert_string_equal(named->parts[1].name, cases[i].name);
    assert_int_equal(named->parts[1].size, 5);
    assert_int_equal(named->parts[0].size, strlen(cases[i].text));
    assert_memory_equal(named->parts[0].bytes, cases[i].text, strlen(cases[i].text));
    qmat_value_release(&named->base);
    qmat_value_release(&file->base);
    qmat_context_uninit(&context);
  }
}

/* A crate over "original.usdc", with its side file of `content`. */
static qmat_file *make_crate(const char *content) {
  static const char *const names[] = {"original.usdc"};
  static const char text[] =
      "#usda 1.0\n( customLayerData = { string qmat_original = \"original.usdc\" } subLayers = [@original.usdc@] )\n";
  qmat_context context = {0};
  qmat_writer crate = {0};
  qmat_file *file = make_file("{}", names, 1, content);
  qmat_put_text(&crate, text);
  assert_int_equal(qmat_usdc_of_text(&context, &crate), QMAT_OK);
  file->base.sealed = false;
  qmat_free(file->format);
  file->format = qmat_strdup("usdc");
  qmat_free(file->parts[0].bytes);
  file->parts[0].bytes = crate.bytes;
  file->parts[0].size = crate.size;
  return file;
}

static void test_the_file_below_a_crate_is_named_after_it_and_is_its_own(void **state) {
  (void)state;
  qmat_context context = {0};
  char folder[64], path[96], side[128];
  make_folder(folder);
  snprintf(path, sizeof path, "%s/x@\".usdc", folder);
  snprintf(side, sizeof side, "%s/x@\"_original.usdc", folder);
  qmat_file *first = make_crate("one"), *second = make_crate("two");
  write_file(side, "none", 4);
  assert_int_equal(save(&context, first, path), QMAT_ERROR_IO); /* of something else */
  assert_string_equal(context.error.file, side);
  assert_int_equal(unlink(side), 0);
  assert_int_equal(save(&context, first, path), QMAT_OK);
  assert_int_equal(save(&context, second, path), QMAT_OK); /* the output's own from the run before */
  const qmat_file_part kept = {.name = (char *)"", .size = 3, .bytes = (uint8_t *)(uintptr_t) "two"};
  assert_true(qmat_file_holds(side, &kept));
  qmat_bytes bytes;
  qmat_usd_layer layer = {0};
  assert_int_equal(qmat_bytes_read_file(&context, path, &bytes), QMAT_OK);
  assert_int_equal(qmat_usdc_read(&context, &bytes, path, &layer), QMAT_OK);
  assert_string_equal(qmat_usd_field_value(layer.root, "subLayers")->texts[0], "x@\"_original.usdc");
  qmat_usd_layer_uninit(&layer);
  qmat_bytes_uninit(&bytes);
  assert_int_equal(unlink(path), 0);
  assert_int_equal(unlink(side), 0);
  assert_int_equal(rmdir(folder), 0);
  qmat_value_release(&first->base);
  qmat_value_release(&second->base);
  qmat_context_uninit(&context);
}

static void test_a_file_of_something_else_is_never_replaced(void **state) {
  (void)state;
  qmat_context context = {0};
  char folder[64], path[96], side[96];
  make_folder(folder);
  snprintf(path, sizeof path, "%s/a.gltf", folder);
  snprintf(side, sizeof side, "%s/a.bin", folder);
  static const char text[] = "{'asset':{'version':'2.0'},'buffers':[{'uri':'buf.bin','byteLength':4}]}";
  static const char *const names[] = {"buf.bin"};
  qmat_file *first = make_file(text, names, 1, "one "), *second = make_file(text, names, 1, "two ");
  write_file(side, "one ", 4);
  assert_int_equal(save(&context, first, path), QMAT_OK);  /* the same bytes are no harm */
  assert_int_equal(save(&context, second, path), QMAT_OK); /* the output's own from the run before */
  assert_int_equal(unlink(path), 0);
  assert_int_equal(save(&context, first, path), QMAT_ERROR_IO); /* nobody says whose it is */
  assert_string_equal(context.error.file, side);
  struct stat about;
  assert_int_not_equal(stat(path, &about), 0);
  write_file(path, "{'a.bin'}", 9); /* names it, but not in quotation marks */
  assert_int_equal(save(&context, first, path), QMAT_ERROR_IO);
  qmat_file_part kept = {.name = (char *)"", .size = 4, .bytes = (uint8_t *)(uintptr_t) "two "};
  assert_true(qmat_file_holds(side, &kept));
  assert_int_equal(unlink(path), 0);
  assert_int_equal(unlink(side), 0);
  assert_int_equal(rmdir(folder), 0);
  qmat_value_release(&first->base);
  qmat_value_release(&second->base);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_side_files_are_named_after_the_output),
      cmocka_unit_test(test_names_stay_within_what_file_systems_take),
      cmocka_unit_test(test_other_formats_and_files_without_sides_stay_as_they_are),
      cmocka_unit_test(test_the_file_below_a_layer_of_usd_is_named_after_the_layer),
      cmocka_unit_test(test_the_file_below_a_crate_is_named_after_it_and_is_its_own),
      cmocka_unit_test(test_a_file_of_something_else_is_never_replaced),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
