/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <dirent.h>
#include <fcntl.h>
#include <float.h>
#include <locale.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include "tests/io/files.h"

/* ---- whole files ---- */

static void assert_unreadable(const char *path, qmat_status expected, const char *message) {
  qmat_context context = {0};
  qmat_bytes bytes;
  assert_int_equal(qmat_bytes_read_file(&context, path, &bytes), expected);
  assert_string_equal(context.error.message, message);
  assert_string_equal(context.error.file, path);
  assert_null(bytes.data);
  assert_int_equal(bytes.size, 0);
  qmat_bytes_uninit(&bytes);
  qmat_context_uninit(&context);
}

static void test_what_is_no_readable_file_is_refused_by_name(void **state) {
  (void)state;
  char folder[64], path[96];
  make_folder(folder);
  assert_unreadable(folder, QMAT_ERROR_IO, "this is a folder, not a file");
  snprintf(path, sizeof path, "%s/none", folder);
  assert_unreadable(path, QMAT_ERROR_IO, "cannot open the file: No such file or directory");
  snprintf(path, sizeof path, "%s/empty", folder);
  write_file(path, "", 0);
  assert_unreadable(path, QMAT_ERROR_FORMAT, "the file is empty");
  unlink(path);
  snprintf(path, sizeof path, "%s/pipe", folder);
  assert_int_equal(mkfifo(path, 0600), 0);
  assert_unreadable(path, QMAT_ERROR_IO, "this is a pipe, not a file");
  unlink(path);
  assert_unreadable("/dev/zero", QMAT_ERROR_IO, "this is a device or socket, not a file");
  assert_unreadable("", QMAT_ERROR_IO, "cannot open the file: No such file or directory");
  snprintf(path, sizeof path, "%s/huge", folder);
  int file = open(path, O_WRONLY | O_CREAT, 0600);
  assert_int_equal(ftruncate(file, ((off_t)4 << 30) + 1), 0);
  close(file);
  assert_unreadable(path, QMAT_ERROR_FORMAT, "the file has 4294967297 bytes; at most 4 GiB are read");
  unlink(path);
  assert_int_equal(rmdir(folder), 0);
}

static void test_a_file_with_an_8_bit_name_is_read_whole_and_padded_with_zeros(void **state) {
  (void)state;
  char folder[64], path[96];
  make_folder(folder);
  snprintf(path, sizeof path, "%s/k\xE4se \xC3\xA4\n.off", folder);
  write_file(path, "a\0b", 3);
  qmat_context context = {0};
  qmat_bytes bytes;
  assert_int_equal(qmat_bytes_read_file(&context, path, &bytes), QMAT_OK);
  assert_int_equal(bytes.size, 3);
  assert_memory_equal(bytes.data, "a\0b\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 19);
  qmat_bytes_uninit(&bytes);
  unlink(path);
  rmdir(folder);
}

/* ---- binary numbers ---- */

static void test_numbers_are_taken_in_either_byte_order(void **state) {
  (void)state;
  const uint8_t raw[] = {0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x08};
  qmat_byte_reader little = {.bytes = raw, .size = 8}, big = {.bytes = raw, .size = 8, .big_endian = true};
  assert_int_equal(qmat_take_u8(&little), 0x01);
  assert_int_equal(qmat_take_u16(&little), 0x0302);
  assert_int_equal(qmat_take_u32(&little), 0x07060504);
  assert_int_equal(qmat_bytes_left(&little), 1);
  assert_true(qmat_take_u64(&big) == UINT64_C(0x0102030405060708));
  const uint8_t one[] = {0x3F, 0x80, 0, 0, 0x40, 0x09, 0x21, 0xFB, 0x54, 0x44, 0x2D, 0x18};
  qmat_byte_reader reader = {.bytes = one, .size = 12, .big_endian = true};
  assert_true(qmat_take_f32(&reader) == 1.0f);
  assert_true(qmat_take_f64(&reader) == 3.141592653589793);
  assert_false(reader.failed);
}

static void test_taking_past_the_end_gives_zero_and_stays_failed(void **state) {
  (void)state;
  const uint8_t raw[] = {1, 2, 3};
  qmat_byte_reader reader = {.bytes = raw, .size = 3};
  assert_int_equal(qmat_take_u32(&reader), 0);
  assert_true(reader.failed);
  assert_int_equal(qmat_take_u8(&reader), 0);
  assert_null(qmat_take_bytes(&reader, 0));
  qmat_byte_reader other = {.bytes = raw, .size = 3, .at = 1};
  assert_null(qmat_take_bytes(&other, SIZE_MAX));
}

/* ---- numbers in text ---- */

static void assert_scans(const char *text, double expected, size_t length) {
  double number = 12345;
  const char *after = qmat_scan_double(text, text + strlen(text), &number);
  if (!after) fail_msg("'%s' is no number", text);
  if (memcmp(&number, &expected, sizeof number) != 0) fail_msg("'%s' is %.17g, not %.17g", text, number, expected);
  if ((size_t)(after - text) != length) fail_msg("'%s' ends after %zu, not %zu", text, (size_t)(after - text), length);
}

static void test_numbers_are_read_exactly(void **state) {
  (void)state;
  static const char *const texts[] = {"0",
                                      "-0",
                                      "+1",
                                      "1.5",
                                      "-.5",
                                      "5.",
                                      "1e22",
                                      "1e23",
                                      "1e-22",
                                      "1e-23",
                                      "9007199254740992",
                                      "9007199254740993",
                                      "9007199254740992e1",
                                      "123456789012345678901234567890",
                                      "0.1",
                                      "0.30000000000000004",
                                      "2.2250738585072011e-308",
                                      "4.9e-324",
                                      "2.4703282292062327208e-324",
                                      "1.7976931348623157e308",
                                      "1e400",
                                      "-1e-400",
                                      "1e99999999999999999999",
                                      "1e-99999999999999999999",
                                      "0.00000000000000000000000000000000000000000000000001",
                                      "100000000000000000000000000000000000000000000000000",
                                      "1.00000000000000011102230246251565404236316680908203125",
                                      "1.00000000000000011102230246251565404236316680908203124",
                                      "0e0",
                                      "3E+05"};
  for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++)
    assert_scans(texts[i], strtod(texts[i], NULL), strlen(texts[i]));
  assert_scans("INF", INFINITY, 3);
  assert_scans("-infinity", -INFINITY, 9);
  assert_scans("1e", 1, 1);
  assert_scans("1e+x", 1, 1);
  assert_scans("1.2.3", 1.2, 3);
  assert_scans("0x10", 0, 1); /* no hexadecimal */
  double number;
  for (size_t i = 0; i < 6; i++) {
    const char *bad = ((const char *[]){"", "-", ".", "e5", "+-1", "x"})[i];
    assert_null(qmat_scan_double(bad, bad + strlen(bad), &number));
  }
  static const char not_a_number[] = "nan";
  assert_ptr_equal(qmat_scan_double(not_a_number, not_a_number + 3, &number), not_a_number + 3);
  assert_true(isnan(number));
}

static double random_double(uint64_t index) {
  for (uint64_t k = 0;; k++) {
    uint64_t bits = qmat_hash3(7, index, k);
    double number;
    memcpy(&number, &bits, sizeof number);
    if (isfinite(number)) return number;
  }
}

static void test_any_double_written_in_any_length_reads_as_strtod_reads_it(void **state) {
  (void)state;
  for (uint64_t i = 0; i < 30000; i++) {
    double number =
        i % 2 ? random_double(i) : (qmat_hash_unit(qmat_hash3(9, i, 0)) - 0.5) * pow(10, (double)(i % 40) - 20);
    char text[512];
    snprintf(text, sizeof text,
             i % 3 == 0   ? "%.*g"
             : i % 3 == 1 ? "%.*e"
                          : "%.*f",
             (int)(i % 21), i % 3 == 2 ? fmod(number, 1e10) : number);
    assert_scans(text, strtod(text, NULL), strlen(text));
  }
}

static void test_a_very_long_number_is_read(void **state) {
  (void)state;
  char *text = malloc(100002);
  memset(text, '7', 100001);
  text[1] = '.';
  text[100001] = '\0';
  assert_scans(text, 7.0 + 7.0 / 9, 100001);
  free(text);
}

static qmat_scanner scan(qmat_context *context, const char *text) {
  qmat_scanner scanner;
  qmat_scanner_init(&scanner, context, "file", text, strlen(text), '#');
  return scanner;
}

static void test_lines_and_columns_are_counted_for_every_kind_of_line_end(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_scanner scanner = scan(&context,
                              "\xEF\xBB\xBF"
                              "a # b\n\r\n c\r\rd#e\n");
  size_t length;
  const char *token = qmat_scan_token(&scanner, &length);
  assert_memory_equal(token, "a", length);
  assert_int_equal(scanner.line, 1);
  token = qmat_scan_token(&scanner, &length);
  assert_memory_equal(token, "c", length);
  assert_int_equal(scanner.line, 3);
  assert_int_equal(token - scanner.line_start + 1, 2);
  assert_false(qmat_scan_find_on_line(&scanner));
  token = qmat_scan_token(&scanner, &length);
  assert_int_equal(length, 1);
  assert_memory_equal(token, "d", 1);
  assert_int_equal(scanner.line, 5);
  token = qmat_scan_token(&scanner, &length);
  assert_int_equal(length, 0);
  assert_non_null(token);
}

static void test_a_backslash_joins_lines_only_where_asked(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_scanner scanner = scan(&context, "1 2\\\r\n3\n4");
  scanner.joins_lines = true;
  int64_t number = 0;
  for (int64_t i = 1; i <= 3; i++) {
    assert_true(qmat_scan_find_on_line(&scanner));
    assert_int_equal(qmat_scan_integer(&scanner, "it", 0, 9, &number), QMAT_OK);
    assert_int_equal(number, i);
  }
  assert_false(qmat_scan_find_on_line(&scanner));
  assert_int_equal(scanner.line, 2);
  scanner = scan(&context, "2\\\n3");
  assert_int_equal(qmat_scan_integer(&scanner, "it", 0, 9, &number), QMAT_ERROR_FORMAT);
}

static void assert_integer_refused(const char *text, const char *expected) {
  qmat_context context = {0};
  qmat_scanner scanner = scan(&context, text);
  int64_t number = 77;
  char line[512];
  assert_int_equal(qmat_scan_integer(&scanner, "the count", 0, 10, &number), QMAT_ERROR_FORMAT);
  assert_int_equal(number, 77);
  qmat_error_format(&context.error, line, sizeof line);
  assert_string_equal(line, expected);
}

static void test_whole_numbers_are_checked_and_the_place_is_named(void **state) {
  (void)state;
  assert_integer_refused("", "file:1:1: the file ends where the count should stand");
  assert_integer_refused("\n\n  x", "file:3:3: the count is 'x', which is no whole number");
  assert_integer_refused("11", "file:1:1: the count is '11', not one of 0 to 10");
  assert_integer_refused("-1", "file:1:1: the count is '-1', not one of 0 to 10");
  assert_integer_refused("1.5", "file:1:1: the count is '1.5', which is no whole number");
  assert_integer_refused("99999999999999999999999",
                         "file:1:1: the count is '99999999999999999999999', which is no whole number");
  assert_integer_refused("3x", "file:1:1: the count is '3x', which is no whole number");
  assert_integer_refused("nan", "file:1:1: the count is 'nan', which is no whole number");
  assert_integer_refused("\001\377abcdefghijklmnopqrstuvwxyz0123456789",
                         "file:1:1: the count is '"
                         "??abcdefghijklmnopqrstuvw...', which is no whole number");
  qmat_context context = {0};
  qmat_scanner scanner = scan(&context, "3.0 1e1 +7");
  int64_t number;
  assert_int_equal(qmat_scan_integer(&scanner, "it", 0, 10, &number), QMAT_OK);
  assert_int_equal(number, 3);
  assert_int_equal(qmat_scan_integer(&scanner, "it", 0, 10, &number), QMAT_OK);
  assert_int_equal(number, 10);
  assert_int_equal(qmat_scan_integer(&scanner, "it", 0, 10, &number), QMAT_OK);
  assert_int_equal(number, 7);
}

/* ---- writing ---- */

static void assert_put(double number, const char *expected) {
  qmat_writer writer = {0};
  qmat_put_number(&writer, number);
  assert_false(writer.failed);
  assert_int_equal(writer.size, strlen(expected));
  assert_memory_equal(writer.bytes, expected, writer.size);
  qmat_writer_uninit(&writer);
}

static void check_written_numbers(void) {
  assert_put(0, "0");
  assert_put(-0.0, "-0");
  assert_put(0.1, "0.1");
  assert_put(-1.5, "-1.5");
  assert_put(1234567, "1234567");
  assert_put(1e15, "1e+15");
  assert_put(0.1 + 0.2, "0.30000000000000004");
  assert_put(1.0 / 3, "0.3333333333333333");
  assert_put(DBL_MAX, "1.7976931348623157e+308");
  assert_put(5e-324, "5e-324");
  assert_put(INFINITY, "inf");
  assert_put(-INFINITY, "-inf");
  assert_put(NAN, "nan");
  assert_put((double)INT64_MIN, "-9.223372036854776e+18");
}

static void test_numbers_are_written_in_few_digits(void **state) {
  (void)state;
  check_written_numbers();
}

static void test_any_double_is_read_back_as_it_was_written(void **state) {
  (void)state;
  for (uint64_t i = 0; i < 20000; i++) {
    double number = random_double(i), back;
    qmat_writer writer = {0};
    qmat_put_number(&writer, number);
    qmat_put_bytes(&writer, "", 1);
    const char *text = (const char *)writer.bytes;
    assert_ptr_equal(qmat_scan_double(text, text + writer.size - 1, &back), text + writer.size - 1);
    assert_memory_equal(&back, &number, sizeof back);
    qmat_writer_uninit(&writer);
  }
}

static void test_the_locale_changes_nothing(void **state) {
  (void)state;
  if (!setlocale(LC_ALL, "de_DE.UTF-8") && !setlocale(LC_ALL, "de_DE")) skip();
  char text[16];
  snprintf(text, sizeof text, "%.1f", 0.5);
  assert_string_equal(text, "0,5");
  check_written_numbers();
  assert_scans("0.123456789012345678", 0.123456789012345678, 20);
  assert_scans("0,5", 0, 1);
  setlocale(LC_ALL, "C");
}

static void test_binary_numbers_are_written_little_endian(void **state) {
  (void)state;
  qmat_writer writer = {0};
  qmat_put_u8(&writer, 1);
  qmat_put_u16(&writer, 0x0203);
  qmat_put_u32(&writer, 0x04050607);
  qmat_put_f32(&writer, 1.0f);
  qmat_put_f64(&writer, 1.0);
  assert_int_equal(writer.size, 19);
  assert_memory_equal(writer.bytes, "\1\3\2\7\6\5\4\0\0\x80\x3F\0\0\0\0\0\0\xF0\x3F", 19);
  qmat_writer_uninit(&writer);
}

/* ---- saving ---- */

static size_t count_entries(const char *folder) {
  DIR *entries = opendir(folder);
  assert_non_null(entries);
  size_t count = 0;
  while (readdir(entries)) count++;
  closedir(entries);
  return count - 2;
}

static qmat_file *make_file(const char *side_name, size_t size) {
  qmat_file *file = qmat_file_new();
  file->format = qmat_strdup("gltf");
  file->part_count = side_name ? 2 : 1;
  file->parts = qmat_calloc(2, sizeof *file->parts);
  for (size_t i = 0; i < file->part_count; i++) {
    file->parts[i].name = qmat_strdup(i == 0 ? "" : side_name);
    file->parts[i].size = size;
    file->parts[i].bytes = qmat_alloc(size, 1);
    memset(file->parts[i].bytes, i == 0 ? 'm' : 's', size);
  }
  return file;
}

static void assert_content(const char *path, const char *expected) {
  qmat_context context = {0};
  qmat_bytes bytes;
  assert_int_equal(qmat_bytes_read_file(&context, path, &bytes), QMAT_OK);
  assert_string_equal((const char *)bytes.data, expected);
  qmat_bytes_uninit(&bytes);
}

static void assert_unsaved(const char *path, const char *side_name, const char *named, const char *message) {
  qmat_context context = {0};
  qmat_file *file = make_file(side_name, 3);
  assert_int_equal(qmat_file_save(&context, file, path), QMAT_ERROR_IO);
  assert_string_equal(context.error.message, message);
  assert_string_equal(context.error.file, named);
  qmat_value_release(&file->base);
}

static void test_every_part_is_saved_and_permissions_stay(void **state) {
  (void)state;
  char folder[64], main_path[96], side_path[96];
  make_folder(folder);
  snprintf(main_path, sizeof main_path, "%s/m\xE4in.gltf", folder);
  snprintf(side_path, sizeof side_path, "%s/m\xE4in.bin", folder);
  write_file(side_path, "old content", 11);
  assert_int_equal(chmod(side_path, 0640), 0);
  qmat_context context = {0};
  qmat_file *file = make_file("m\xE4in.bin", 3);
  assert_int_equal(qmat_file_save(&context, file, main_path), QMAT_OK);
  assert_int_equal(count_entries(folder), 2);
  assert_content(main_path, "mmm");
  assert_content(side_path, "sss");
  struct stat about;
  assert_int_equal(stat(side_path, &about), 0);
  assert_int_equal(about.st_mode & 0777, 0640);
  mode_t mask = umask(0);
  umask(mask);
  assert_int_equal(stat(main_path, &about), 0);
  assert_int_equal(about.st_mode & 0777, 0666 & ~mask);
  qmat_value_release(&file->base);
  unlink(main_path);
  unlink(side_path);
  assert_int_equal(rmdir(folder), 0);
}

static void test_a_relative_name_is_saved_in_the_working_folder(void **state) {
  (void)state;
  char folder[64], before[4096];
  make_folder(folder);
  assert_non_null(getcwd(before, sizeof before));
  assert_int_equal(chdir(folder), 0);
  qmat_context context = {0};
  qmat_file *file = make_file("b", 2);
  assert_int_equal(qmat_file_save(&context, file, "a"), QMAT_OK);
  assert_content("a", "mm");
  assert_content("b", "ss");
  qmat_value_release(&file->base);
  unlink("a");
  unlink("b");
  assert_int_equal(chdir(before), 0);
  assert_int_equal(rmdir(folder), 0);
}

static void test_a_failed_save_names_the_file_and_leaves_nothing_behind(void **state) {
  (void)state;
  char folder[64], path[96], side[96];
  make_folder(folder);
  snprintf(path, sizeof path, "%s/none/x.gltf", folder);
  assert_unsaved(path, NULL, path, "cannot write the file: No such file or directory");
  assert_unsaved(folder, NULL, folder, "cannot write the file: there is already a folder of this name");
  snprintf(path, sizeof path, "%s/", folder);
  char message[160];
  snprintf(message, sizeof message, "'%s' names no output file", path);
  assert_unsaved(path, NULL, path, message);
  assert_unsaved("", NULL, "", "'' names no output file");
  assert_unsaved("/dev/null", NULL, "/dev/null",
                 "cannot write the file: there is already a pipe or device of this name");
  snprintf(path, sizeof path, "%s/x", folder);
  assert_unsaved(path, "x", "", "two parts of the output would have the name 'x'");

  /* The side part cannot be written: the main part is not there either. */
  snprintf(side, sizeof side, "%s/side", folder);
  assert_int_equal(mkdir(side, 0700), 0);
  assert_unsaved(path, "side", side, "cannot write the file: there is already a folder of this name");
  assert_int_equal(count_entries(folder), 1);
  rmdir(side);

  if (geteuid() != 0) {
    assert_int_equal(chmod(folder, 0500), 0);
    assert_unsaved(path, NULL, path, "cannot write the file: Permission denied");
    assert_int_equal(chmod(folder, 0700), 0);
  }
  assert_int_equal(rmdir(folder), 0);
}

static void test_a_full_disk_leaves_the_old_file_as_it_was(void **state) {
  (void)state;
  char folder[64], path[96];
  make_folder(folder);
  snprintf(path, sizeof path, "%s/x", folder);
  write_file(path, "old", 3);
  struct rlimit before, small;
  assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
  small = before;
  small.rlim_cur = 4096;
  signal(SIGXFSZ, SIG_IGN);
  assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
  qmat_context context = {0};
  qmat_file *file = make_file("y", 100000);
  qmat_status status = qmat_file_save(&context, file, path);
  assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
  assert_int_equal(status, QMAT_ERROR_IO);
  assert_string_equal(context.error.message, "cannot write the file: File too large");
  assert_string_equal(context.error.file, path);
  assert_int_equal(count_entries(folder), 1);
  assert_content(path, "old");
  qmat_value_release(&file->base);
  unlink(path);
  assert_int_equal(rmdir(folder), 0);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_what_is_no_readable_file_is_refused_by_name),
      cmocka_unit_test(test_a_file_with_an_8_bit_name_is_read_whole_and_padded_with_zeros),
      cmocka_unit_test(test_numbers_are_taken_in_either_byte_order),
      cmocka_unit_test(test_taking_past_the_end_gives_zero_and_stays_failed),
      cmocka_unit_test(test_numbers_are_read_exactly),
      cmocka_unit_test(test_any_double_written_in_any_length_reads_as_strtod_reads_it),
      cmocka_unit_test(test_a_very_long_number_is_read),
      cmocka_unit_test(test_lines_and_columns_are_counted_for_every_kind_of_line_end),
      cmocka_unit_test(test_a_backslash_joins_lines_only_where_asked),
      cmocka_unit_test(test_whole_numbers_are_checked_and_the_place_is_named),
      cmocka_unit_test(test_numbers_are_written_in_few_digits),
      cmocka_unit_test(test_any_double_is_read_back_as_it_was_written),
      cmocka_unit_test(test_the_locale_changes_nothing),
      cmocka_unit_test(test_binary_numbers_are_written_little_endian),
      cmocka_unit_test(test_every_part_is_saved_and_permissions_stay),
      cmocka_unit_test(test_a_relative_name_is_saved_in_the_working_folder),
      cmocka_unit_test(test_a_failed_save_names_the_file_and_leaves_nothing_behind),
      cmocka_unit_test(test_a_full_disk_leaves_the_old_file_as_it_was),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
