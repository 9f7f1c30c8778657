/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <fcntl.h>
#include <float.h>
#include <sys/stat.h>

#include "io/scanner.h"
#include "tests/io/files.h"
#include "tests/locale.h"
#include "tests/random.h"

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
  assert_unreadable(path, QMAT_ERROR_FORMAT, "the file has 4294967297 bytes, more than the 4 GiB that can be read");
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

/* ---- building a file ---- */

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

static void test_numbers_are_written_in_few_digits_in_any_locale(void **state) {
  (void)state;
  check_written_numbers();
  locale_with_comma();
  char text[16];
  snprintf(text, sizeof text, "%.1f", 0.5);
  assert_string_equal(text, "0,5");
  check_written_numbers();
  setlocale(LC_ALL, "C");
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

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_what_is_no_readable_file_is_refused_by_name),
      cmocka_unit_test(test_a_file_with_an_8_bit_name_is_read_whole_and_padded_with_zeros),
      cmocka_unit_test(test_numbers_are_taken_in_either_byte_order),
      cmocka_unit_test(test_taking_past_the_end_gives_zero_and_stays_failed),
      cmocka_unit_test(test_numbers_are_written_in_few_digits_in_any_locale),
      cmocka_unit_test(test_any_double_is_read_back_as_it_was_written),
      cmocka_unit_test(test_binary_numbers_are_written_little_endian),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
