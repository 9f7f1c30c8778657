/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/hash.h"
#include "io/bytes.h"
#include "io/flat_medial.h"
#include "io/stored_medial.h"
#include "tests/io/medial_examples.h"
#include "tests/shapes.h"

static void encode(const qmat_medial *medial, const qmat_sphere_data *data, bool floats, uint8_t **bytes,
                   size_t *size) {
  qmat_context context = {0};
  if (qmat_flat_encode(&context, medial, data, NULL, floats, bytes, size) != QMAT_OK)
    fail_msg("%s", context.error.message);
  qmat_context_uninit(&context);
}

static qmat_medial *decode(const uint8_t *bytes, size_t size) {
  qmat_context context = {0};
  qmat_medial *medial;
  if (qmat_flat_decode(&context, bytes, size, NULL, &medial) != QMAT_OK) fail_msg("%s", context.error.message);
  qmat_context_uninit(&context);
  return medial;
}

static void test_a_cone_and_a_sphere_have_the_bytes_that_the_format_page_says(void **state) {
  (void)state;
  const double spheres[] = {0, 0, 0, 0, 2, 0, 0, 1, 1, 3, 0, 0.5};
  const uint32_t edge[] = {0, 1};
  qmat_medial *medial = sealed_medial_mesh(spheres, 3, edge, 1, NULL, 0);
  uint8_t *bytes;
  size_t size;
  encode(medial, NULL, false, &bytes, &size);
  assert_int_equal(size, 64 + 3 * 8 + 4 + 4);
  assert_memory_equal(bytes, "QMAT\1\0\0\0\3\0\0\0\0\0\0\0\1\0\0\0\1\0\0\0", 24);
  qmat_byte_reader reader = {.bytes = bytes, .size = size, .at = 24};
  const double ranges[4] = {2, 3, 0, 1};
  for (int k = 0; k < 4; k++) assert_true(qmat_take_f32(&reader) == 0);
  for (int k = 0; k < 4; k++) {
    const double reach = 65535 * (double)qmat_take_f32(&reader);
    assert_true(reach >= ranges[k] && reach < ranges[k] * (1 + 2e-7) + 1e-40);
  }
  reader.at = 64;
  const uint16_t expected[12] = {0, 0, 0, 0, 65535, 0, 0, 65535, 32768, 65535, 0, 32768};
  for (int i = 0; i < 12; i++)
    assert_in_range(qmat_take_u16(&reader), expected[i] - (expected[i] == 32768), expected[i]);
  assert_memory_equal(bytes + 88, "\0\0\1\0\2\0\0\0", 8);
  qmat_free(bytes);
  qmat_value_release(&medial->base);
}

static void test_what_is_decoded_has_the_same_simplices_and_moved_by_half_a_step(void **state) {
  (void)state;
  static const size_t counts[] = {1, 3, 20, 200};
  for (size_t c = 0; c < 4; c++) {
    qmat_medial *medial = example_medial(counts[c]);
    for (int floats = 0; floats < 2; floats++) {
      uint8_t *bytes;
      size_t size;
      encode(medial, NULL, floats, &bytes, &size);
      qmat_medial *decoded = decode(bytes, size);
      assert_int_equal(decoded->sphere_count, medial->sphere_count);
      assert_int_equal(decoded->edge_count, medial->edge_count);
      assert_int_equal(decoded->triangle_count, medial->triangle_count);
      if (medial->edge_count > 0) assert_memory_equal(decoded->edges, medial->edges, 8 * medial->edge_count);
      if (medial->triangle_count > 0)
        assert_memory_equal(decoded->triangles, medial->triangles, 12 * medial->triangle_count);
      double side[4], bound = 0;
      for (size_t k = 0; k < 4; k++) {
        double low = INFINITY, high = -INFINITY;
        for (size_t i = 0; i < counts[c]; i++) {
          low = fmin(low, medial->spheres[4 * i + k]);
          high = fmax(high, medial->spheres[4 * i + k]);
        }
        side[k] = (floats ? ldexp(fmax(fabs(low), fabs(high)), -23) : (high - low) / 65535) / 2 + ldexp(fabs(low), -24);
        if (k < 3) bound += side[k] * side[k];
      }
      assert_true(qmat_medial_move(medial, decoded) <= (sqrt(bound) + side[3]) * (1 + 1e-6));
      qmat_value_release(&decoded->base);
      qmat_free(bytes);
    }
    qmat_value_release(&medial->base);
  }
}

static void test_errors_are_raised_by_storage_and_weights_sum_to_one(void **state) {
  (void)state;
  enum { COUNT = 21 };
  qmat_medial *medial = example_medial(COUNT);
  double errors[COUNT], weights[4 * COUNT];
  uint16_t joints[4 * COUNT];
  for (uint32_t i = 0; i < 4 * COUNT; i++) {
    joints[i] = (uint16_t)(i % 11);
    weights[i] = i % 4 == 3 ? 0 : qmat_hash_unit(qmat_hash3(7, i, 0)) + 1e-3;
    errors[i / 4] = 1e-3 * (i / 4);
  }
  const qmat_sphere_data data = {.errors = errors, .joints = joints, .weights = weights};
  for (int floats = 0; floats < 2; floats++) {
    uint8_t *bytes;
    size_t size;
    encode(medial, &data, floats, &bytes, &size);
    qmat_medial *decoded = decode(bytes, size);
    const double moved = qmat_medial_move(medial, decoded);
    qmat_byte_reader reader = {.bytes = bytes, .size = size, .at = 56};
    const double scale = floats ? 1 : (double)qmat_take_f32(&reader);
    reader.at = 64 + (floats ? 16 : 8) * COUNT;
    for (size_t i = 0; i < COUNT; i++) {
      const double stored = floats ? (double)qmat_take_f32(&reader) : scale * qmat_take_u16(&reader);
      assert_true(stored >= errors[i] + moved && stored <= errors[i] + moved * (1 + 1e-6) + 2e-2 / 65535 + 1e-8);
    }
    reader.at = size - 16 * COUNT;
    for (size_t i = 0; i < 4 * COUNT; i++) assert_int_equal(qmat_take_u16(&reader), joints[i]);
    for (size_t i = 0; i < COUNT; i++) {
      const double *w = weights + 4 * i, whole = w[0] + w[1] + w[2] + w[3];
      uint32_t sum = 0;
      for (size_t k = 0; k < 4; k++) {
        const uint16_t stored = qmat_take_u16(&reader);
        sum += stored;
        assert_near(stored / 65535.0, w[k] / whole, 4.0 / 65535);
      }
      assert_int_equal(sum, 65535);
    }
    qmat_value_release(&decoded->base);
    qmat_free(bytes);
  }
  qmat_value_release(&medial->base);
}

static void test_more_spheres_than_16_bits_name_have_wide_ids(void **state) {
  (void)state;
  for (size_t count = 65536; count <= 65537; count++) {
    double *spheres = qmat_calloc(4 * count, sizeof *spheres);
    assert_non_null(spheres);
    for (size_t i = 0; i < count; i++) {
      spheres[4 * i] = (double)i;
      spheres[4 * i + 3] = 1;
    }
    const uint32_t edge[] = {0, (uint32_t)count - 1};
    qmat_medial *medial = sealed_medial_mesh(spheres, count, edge, 1, NULL, 0);
    uint8_t *bytes;
    size_t size;
    encode(medial, NULL, false, &bytes, &size);
    const size_t width = count > 65536 ? 4 : 2;
    assert_int_equal(bytes[6], count > 65536 ? 2 : 0);
    assert_int_equal(size, 64 + 8 * count + 2 * width + ((count - 2) * width + 3) / 4 * 4);
    qmat_medial *decoded = decode(bytes, size);
    assert_int_equal(decoded->edges[1], count - 1);
    qmat_value_release(&decoded->base);
    qmat_free(bytes);
    qmat_value_release(&medial->base);
    qmat_free(spheres);
  }
}

static void test_spheres_that_do_not_fit_are_errors(void **state) {
  (void)state;
  qmat_context context = {0};
  const double far[] = {0, 0, 0, 1, 1e39, 0, 0, 1};
  uint8_t *bytes;
  size_t size;
  qmat_medial *medial = sealed_medial_mesh(far, 2, NULL, 0, NULL, 0);
  assert_int_equal(qmat_flat_encode(&context, medial, NULL, NULL, false, &bytes, &size), QMAT_ERROR_GEOMETRY);
  assert_int_equal(context.error.element, 1);
  assert_null(bytes);
  const double near_it[3] = {1e39, 0, 0};
  assert_int_equal(qmat_flat_encode(&context, medial, NULL, near_it, true, &bytes, &size), QMAT_ERROR_GEOMETRY);
  assert_int_equal(context.error.element, 0);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

/* Changes a byte, asks for the message, and changes it back. */
static void assert_broken(uint8_t *bytes, size_t size, size_t at, uint8_t value, const char *message) {
  qmat_context context = {0};
  qmat_medial *medial;
  const uint8_t before = bytes[at];
  bytes[at] = value;
  assert_int_equal(qmat_flat_decode(&context, bytes, size, NULL, &medial), QMAT_ERROR_FORMAT);
  assert_null(medial);
  assert_string_equal(context.error.message, message);
  bytes[at] = before;
  qmat_context_uninit(&context);
}

static void test_broken_data_are_errors_that_say_what_is_wrong(void **state) {
  (void)state;
  qmat_medial *medial = example_medial(20);
  uint8_t *bytes;
  size_t size;
  encode(medial, NULL, true, &bytes, &size);
  assert_broken(bytes, size, 0, 'q', "not flat data: it does not start with \"QMAT\"");
  assert_broken(bytes, size, 4, 2, "version 2 of flat data is not supported (only 1 is)");
  assert_broken(bytes, size, 6, 17, "flat data have unknown flags: 17");
  assert_broken(bytes, size, 67, 0x7f, "a coordinate is not finite");
  assert_broken(bytes, size, 64 + 15, 0xbf, "the radius is below 0 or not finite");
  assert_broken(bytes, size, 64 + 16 * 20, 20, "sphere 20 of a simplex is beyond the 20 spheres");
  assert_broken(bytes, 20, 4, 1, "flat data end within their header");
  char message[96];
  snprintf(message, sizeof message, "flat data have %zu bytes, but their header promises %zu", size - 1, size);
  assert_broken(bytes, size - 1, 4, 1, message);
  snprintf(message, sizeof message, "flat data have %zu bytes, but their header promises %zu", size,
           size + ((size_t)0xff << 24) * 16);
  assert_broken(bytes, size, 11, 0xff, message);
  qmat_free(bytes);
  qmat_value_release(&medial->base);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_cone_and_a_sphere_have_the_bytes_that_the_format_page_says),
      cmocka_unit_test(test_what_is_decoded_has_the_same_simplices_and_moved_by_half_a_step),
      cmocka_unit_test(test_errors_are_raised_by_storage_and_weights_sum_to_one),
      cmocka_unit_test(test_more_spheres_than_16_bits_name_have_wide_ids),
      cmocka_unit_test(test_spheres_that_do_not_fit_are_errors),
      cmocka_unit_test(test_broken_data_are_errors_that_say_what_is_wrong),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
