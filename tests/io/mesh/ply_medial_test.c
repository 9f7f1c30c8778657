/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "tests/io/files.h"

#include "io/mesh/ply_medial.h"
#include "tests/io/medial_examples.h"

static void test_a_medial_mesh_far_from_zero_comes_back_unchanged_with_what_is_stated(void **state) {
  (void)state;
  qmat_context context = {0};
  const double spheres[] = {4e5 + 0.1, 0, 5e6, 1, 4e5 + 1.3, 0, 5e6, 0.5, 4e5, 1, 5e6 + 0.7, 0.25};
  qmat_medial *medial = sealed_medial_mesh(spheres, 3, NULL, 0, (const uint32_t[]){0, 1, 2}, 1), *back;
  const qmat_stated_errors errors = {
      .diagonal = 3, .epsilon = 0.01, .error_out = 0.1 / 17, .error_in = 0.009, .certified = QMAT_CERTIFICATE_YES};
  qmat_file *file;
  json_t *facts = json_object();
  assert_int_equal(qmat_ply_write_medial(&context, medial, &errors, &file), QMAT_OK);
  qmat_bytes bytes = memory_file(file->parts[0].bytes, file->parts[0].size);
  assert_int_equal(qmat_ply_read_medial(&context, &bytes, "x.ply", &back, facts), QMAT_OK);
  assert_memory_equal(&medial->base.digest, &back->base.digest, sizeof back->base.digest);
  assert_true(json_real_value(json_object_get(facts, "qmat_error_out")) == 0.1 / 17);
  assert_true(json_is_true(json_object_get(facts, "qmat_certified")));
  qmat_value_release(&back->base);
  json_decref(facts);

  /* Every shorter file, and every changed byte of the header, is an error, and never a crash. */
  for (size_t size = 0; size < bytes.size; size++) {
    qmat_bytes cut = memory_file(bytes.data, size);
    assert_int_not_equal(qmat_ply_read_medial(&context, &cut, "x.ply", &back, NULL), QMAT_OK);
    assert_null(back);
    free(cut.data);
  }
  qmat_bytes broken = memory_file(bytes.data, bytes.size);
  broken.data[bytes.size - 1] = 9; /* an id of a sphere that is not there */
  assert_int_equal(qmat_ply_read_medial(&context, &broken, "x.ply", &back, NULL), QMAT_ERROR_FORMAT);
  free(broken.data);
  qmat_bytes plain = memory_file("ply\nformat ascii 1.0\nend_header\n", 32);
  assert_int_equal(qmat_ply_read_medial(&context, &plain, "x.ply", &back, NULL), QMAT_ERROR_GEOMETRY);
  free(plain.data);
  free(bytes.data);
  qmat_value_release(&file->base);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_medial_mesh_far_from_zero_comes_back_unchanged_with_what_is_stated),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
