/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "io/draco.h"
#include "io/draco_draco.h"
#include "io/stored_medial.h"
#include "tests/io/medial_examples.h"

static void assert_same_simplices(const qmat_medial *a, const qmat_medial *b) {
  assert_int_equal(a->sphere_count, b->sphere_count);
  assert_int_equal(a->edge_count, b->edge_count);
  assert_int_equal(a->triangle_count, b->triangle_count);
  for (size_t i = 0; i < 2 * a->edge_count; i++) assert_int_equal(a->edges[i], b->edges[i]);
  for (size_t i = 0; i < 3 * a->triangle_count; i++) assert_int_equal(a->triangles[i], b->triangles[i]);
}

/* Encodes, decodes, and asserts that order and simplices are kept and every sphere is within the stated bound. */
static void assert_round_trip(const qmat_medial *medial, int position_bits, int radius_bits) {
  qmat_context context = {0};
  uint8_t *bytes;
  size_t size;
  qmat_medial *decoded;
  assert_int_equal(qmat_draco_encode_medial(&context, medial, NULL, position_bits, radius_bits, &bytes, &size),
                   QMAT_OK);
  assert_int_equal(qmat_draco_decode_medial(&context, bytes, size, NULL, &decoded), QMAT_OK);
  assert_true(decoded->base.sealed);
  assert_same_simplices(medial, decoded);
  double position_range, radius_range, largest = 0;
  qmat_draco_medial_ranges(medial, &position_range, &radius_range);
  for (size_t i = 0; i < 4 * medial->sphere_count; i++) largest = fmax(largest, fabs(medial->spheres[i]));
  /* A step of Draco's quantisation is range / (2^bits - 1), or 1 / (2^bits - 1) when all values are equal; then they
   * are met exactly. On top comes single precision: a few roundings of the largest number. */
  const double rounding = 4 * 0x1p-24 * (largest + position_range + radius_range);
  const double position_bound = sqrt(3) / 2 * position_range / (pow(2, position_bits) - 1) + 2 * rounding;
  const double radius_bound = 0.5 * radius_range / (pow(2, radius_bits) - 1) + rounding;
  for (size_t i = 0; i < medial->sphere_count; i++) {
    const double *a = medial->spheres + 4 * i, *b = decoded->spheres + 4 * i;
    const double moved = sqrt(pow(a[0] - b[0], 2) + pow(a[1] - b[1], 2) + pow(a[2] - b[2], 2));
    if (moved > position_bound) fail_msg("sphere %zu moved by %g, more than %g", i, moved, position_bound);
    if (fabs(a[3] - b[3]) > radius_bound) fail_msg("radius %zu changed by %g", i, fabs(a[3] - b[3]));
  }
  assert_true(qmat_medial_move(medial, decoded) <= position_bound + radius_bound);
  qmat_value_release(&decoded->base);
  qmat_free(bytes);
  qmat_context_uninit(&context);
}

static void test_medial_meshes_come_back_in_order_within_the_bound(void **state) {
  (void)state;
  static const int bits[][2] = {{1, 1}, {8, 6}, {14, 12}, {20, 20}, {30, 30}};
  static const size_t counts[] = {1, 2, 3, 200};
  for (size_t c = 0; c < sizeof counts / sizeof *counts; c++) {
    qmat_medial *medial = example_medial(counts[c]);
    for (size_t b = 0; b < sizeof bits / sizeof *bits; b++) assert_round_trip(medial, bits[b][0], bits[b][1]);
    qmat_value_release(&medial->base);
  }
}

static void test_equal_spheres_stay_apart(void **state) {
  (void)state;
  /* Draco's tools like to merge points of equal attributes; ids would then point elsewhere. */
  double spheres[16];
  for (int i = 0; i < 4; i++) memcpy(spheres + 4 * i, (const double[]){1, 2, 3, 0.5}, 4 * sizeof *spheres);
  qmat_medial *medial = sealed_medial_mesh(spheres, 4, (const uint32_t[]){0, 3}, 1, NULL, 0);
  assert_round_trip(medial, 10, 10);
  qmat_value_release(&medial->base);
}

static void test_far_and_tiny_models_keep_what_single_precision_holds(void **state) {
  (void)state;
  const double far[12] = {1e6, 1e6, 1e6, 1, 1e6 + 3, 1e6, 1e6, 2, 1e6, 1e6 + 4, 1e6, 0};
  const double tiny[12] = {0, 0, 0, 1e-30, 3e-30, 0, 0, 2e-30, 0, 4e-30, 0, 0};
  const uint32_t triangle[3] = {0, 1, 2};
  qmat_medial *medial = sealed_medial_mesh(far, 3, NULL, 0, triangle, 1);
  assert_round_trip(medial, 16, 16);
  qmat_value_release(&medial->base);
  medial = sealed_medial_mesh(tiny, 3, NULL, 0, triangle, 1);
  assert_round_trip(medial, 16, 16);
  qmat_value_release(&medial->base);
}

static void test_the_same_medial_mesh_gives_the_same_bytes(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_medial *medial = example_medial(200);
  uint8_t *bytes[2];
  size_t size[2];
  for (int i = 0; i < 2; i++) {
    assert_int_equal(qmat_draco_encode_medial(&context, medial, NULL, 12, 10, &bytes[i], &size[i]), QMAT_OK);
  }
  assert_int_equal(size[0], size[1]);
  assert_memory_equal(bytes[0], bytes[1], size[0]);
  assert_memory_equal(bytes[0], "DRACO", 5);
  assert_int_equal(bytes[0][7], 1); /* a mesh */
  assert_int_equal(bytes[0][8], 0); /* sequential */
  for (int i = 0; i < 2; i++) qmat_free(bytes[i]);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

static void test_faces_are_triangles_then_edges_then_spheres(void **state) {
  (void)state;
  qmat_context context = {0};
  const double spheres[24] = {0, 0, 0, 1, 1, 0, 0, 1, 0, 1, 0, 1, 0, 0, 1, 1, 5, 5, 5, 1, 6, 6, 6, 1};
  qmat_medial *medial = sealed_medial_mesh(spheres, 6, (const uint32_t[]){2, 3}, 1, (const uint32_t[]){0, 1, 2}, 1);
  uint8_t *bytes;
  size_t size;
  qmat_draco_mesh *mesh;
  assert_int_equal(qmat_draco_encode_medial(&context, medial, NULL, 12, 12, &bytes, &size), QMAT_OK);
  assert_int_equal(qmat_draco_mesh_new(&context, bytes, size, &mesh), QMAT_OK);
  assert_int_equal(qmat_draco_mesh_point_count(mesh), 6);
  assert_int_equal(qmat_draco_mesh_face_count(mesh), 4);
  uint32_t corners[12];
  qmat_draco_mesh_faces(mesh, corners);
  const uint32_t expected[12] = {0, 1, 2, 2, 3, 3, 4, 4, 4, 5, 5, 5};
  assert_memory_equal(corners, expected, sizeof expected);
  qmat_draco_mesh_free(mesh);
  qmat_free(bytes);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

static void test_bits_are_the_fewest_that_hold_the_error(void **state) {
  (void)state;
  for (int components = 1; components <= 3; components += 2) {
    for (int bits = 1; bits < 30; bits++) {
      const double bound = sqrt(components) / 2 * 7 / (pow(2, bits) - 1);
      assert_int_equal(qmat_draco_bits_for(components, 7, bound * (1 + 1e-12)), bits);
      assert_int_equal(qmat_draco_bits_for(components, 7, bound * (1 - 1e-12)), bits + 1);
    }
    assert_int_equal(qmat_draco_bits_for(components, 7, 1e-30), 30);
    assert_int_equal(qmat_draco_bits_for(components, 0, 1e-30), 1);
  }
  assert_int_equal(qmat_draco_bits_for(3, 7, 0), 30);
  assert_int_equal(qmat_draco_bits_for(3, 7, NAN), 30);
  assert_int_equal(qmat_draco_bits_for(3, NAN, 1), 30);
}

static void test_bad_bits_and_empty_medial_meshes_are_refused(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_medial *medial = example_medial(3);
  uint8_t *bytes;
  size_t size;
  assert_int_equal(qmat_draco_encode_medial(&context, medial, NULL, 0, 8, &bytes, &size), QMAT_ERROR_USAGE);
  assert_string_equal(context.error.field, "position_bits");
  assert_int_equal(qmat_draco_encode_medial(&context, medial, NULL, 8, 31, &bytes, &size), QMAT_ERROR_USAGE);
  assert_string_equal(context.error.field, "radius_bits");
  assert_null(bytes);
  qmat_value_release(&medial->base);

  medial = qmat_medial_new();
  assert_int_equal(qmat_draco_encode_medial(&context, medial, NULL, 8, 8, &bytes, &size), QMAT_ERROR_GEOMETRY);
  qmat_value_release(&medial->base);

  const double large[8] = {0, 0, 0, 1, 0, 1e300, 0, 1};
  medial = sealed_medial_mesh(large, 2, NULL, 0, NULL, 0);
  assert_int_equal(qmat_draco_encode_medial(&context, medial, NULL, 8, 8, &bytes, &size), QMAT_ERROR_GEOMETRY);
  assert_string_equal(context.error.element_kind, "sphere");
  assert_int_equal(context.error.element, 1);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

/* A closed surface like a rippled ball: `rings` by `rings` quads between two poles. */
typedef struct ball {
  size_t vertex_count, triangle_count;
  float *positions, *normals;
  uint32_t *triangles;
} ball;

static ball make_ball(size_t rings) {
  ball b = {.vertex_count = rings * rings + 2, .triangle_count = 2 * rings * rings};
  b.positions = malloc(3 * b.vertex_count * sizeof(float));
  b.normals = malloc(3 * b.vertex_count * sizeof(float));
  b.triangles = malloc(3 * b.triangle_count * sizeof(uint32_t));
  assert_true(b.positions && b.normals && b.triangles);
  for (size_t i = 0; i < b.vertex_count; i++) {
    const bool pole = i >= rings * rings;
    const double down = pole ? (i == rings * rings ? 0 : M_PI) : M_PI * (double)(i / rings + 1) / (double)(rings + 1);
    const double turn = pole ? 0 : 2 * M_PI * (double)(i % rings) / (double)rings;
    const double n[3] = {sin(down) * cos(turn), sin(down) * sin(turn), cos(down)};
    const double radius = 1 + 0.1 * sin(5 * turn) * sin(down);
    for (size_t k = 0; k < 3; k++) {
      b.positions[3 * i + k] = (float)(radius * n[k]);
      b.normals[3 * i + k] = (float)n[k];
    }
  }
  uint32_t *t = b.triangles;
  const uint32_t r = (uint32_t)rings, north = r * r, south = north + 1;
  for (uint32_t i = 0; i < r; i++) {
    const uint32_t next = (i + 1) % r;
    const uint32_t caps[6] = {north, i, next, south, (r - 1) * r + next, (r - 1) * r + i};
    memcpy(t, caps, sizeof caps);
    t += 6;
    for (uint32_t row = 0; row + 1 < r; row++) {
      const uint32_t a = row * r + i, c = row * r + next, quad[6] = {a, a + r, c, c, a + r, c + r};
      memcpy(t, quad, sizeof quad);
      t += 6;
    }
  }
  return b;
}

static void free_ball(ball *b) {
  free(b->positions);
  free(b->normals);
  free(b->triangles);
}

static void test_skins_are_packed_tighter_and_say_what_is_decoded(void **state) {
  (void)state;
  qmat_context context = {0};
  ball b = make_ball(60);
  qmat_draco_skin skin;
  assert_int_equal(qmat_draco_encode_mesh(&context, b.positions, b.normals, b.vertex_count, b.triangles,
                                          b.triangle_count, 12, 8, &skin),
                   QMAT_OK);
  assert_int_equal(skin.vertex_count, b.vertex_count);
  assert_int_equal(skin.triangle_count, b.triangle_count);
  /* What the sequential method makes of the same mesh is more than three times as large. */
  const qmat_draco_attribute attributes[2] = {
      {.meaning = QMAT_DRACO_POSITION, .components = 3, .bits = 12, .values = b.positions},
      {.meaning = QMAT_DRACO_NORMAL, .components = 3, .bits = 8, .values = b.normals}};
  uint8_t *bytes;
  size_t size;
  assert_int_equal(
      qmat_draco_encode(&context, attributes, 2, b.vertex_count, b.triangles, b.triangle_count, true, &bytes, &size),
      QMAT_OK);
  print_message("%zu triangles: edgebreaker %zu bytes, sequential %zu\n", b.triangle_count, skin.size, size);
  assert_true(3 * skin.size < size);
  qmat_free(bytes);

  qmat_draco_mesh *mesh;
  assert_int_equal(qmat_draco_mesh_new(&context, skin.bytes, skin.size, &mesh), QMAT_OK);
  double *positions = malloc(3 * b.vertex_count * sizeof *positions);
  assert_non_null(positions);
  assert_int_equal(qmat_draco_mesh_attribute(&context, mesh, skin.position_id, 3, positions), QMAT_OK);
  for (size_t i = 0; i < 3 * b.vertex_count; i++) {
    assert_true(positions[i] >= (double)skin.min[i % 3] && positions[i] <= (double)skin.max[i % 3]);
  }
  assert_int_equal(qmat_draco_mesh_attribute(&context, mesh, skin.position_id, 2, positions), QMAT_ERROR_FORMAT);
  assert_int_equal(qmat_draco_mesh_attribute(&context, mesh, 77, 3, positions), QMAT_ERROR_FORMAT);
  free(positions);
  qmat_draco_mesh_free(mesh);
  qmat_draco_skin_uninit(&skin);
  free_ball(&b);
  qmat_context_uninit(&context);
}

/* Draco itself writes outside its tables for these. */
static void test_ranges_beyond_single_precision_are_refused(void **state) {
  (void)state;
  static const float positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  static const uint32_t faces[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
  static const struct {
    qmat_draco_meaning meaning;
    float low, high;
    qmat_status status;
  } cases[] = {
      {QMAT_DRACO_TEXCOORD, 0, 1, QMAT_OK},
      {QMAT_DRACO_TEXCOORD, -1e38F, 1e38F, QMAT_OK},
      {QMAT_DRACO_TEXCOORD, -3e38F, 3e38F, QMAT_ERROR_DEPENDENCY}, /* the range overflows */
      {QMAT_DRACO_TEXCOORD, 0, 1e-36F, QMAT_ERROR_DEPENDENCY},     /* its inverse overflows */
      {QMAT_DRACO_TEXCOORD, 0, 1e-33F, QMAT_OK},
      {QMAT_DRACO_TEXCOORD, 2, 2, QMAT_OK},
      {QMAT_DRACO_TEXCOORD, NAN, 0, QMAT_ERROR_DEPENDENCY},
      {QMAT_DRACO_GENERIC, 0, INFINITY, QMAT_ERROR_DEPENDENCY},
      {QMAT_DRACO_GENERIC, -3e38F, 3e38F, QMAT_ERROR_DEPENDENCY},
      {QMAT_DRACO_NORMAL, -3e38F, 3e38F, QMAT_OK}, /* directions have no range */
      {QMAT_DRACO_NORMAL, 0, NAN, QMAT_ERROR_DEPENDENCY},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    for (int keep_order = 0; keep_order < 2; keep_order++) {
      qmat_context context = {0};
      const int components = cases[i].meaning == QMAT_DRACO_NORMAL ? 3 : 2;
      float values[12];
      for (size_t k = 0; k < 12; k++) values[k] = k % 3 == 0 ? cases[i].low : cases[i].high;
      const qmat_draco_attribute attributes[2] = {
          {.meaning = QMAT_DRACO_POSITION, .components = 3, .bits = 14, .values = positions},
          {.meaning = cases[i].meaning, .components = components, .bits = 12, .values = values}};
      uint8_t *bytes;
      size_t size;
      assert_int_equal(qmat_draco_encode(&context, attributes, 2, 4, faces, 4, keep_order, &bytes, &size),
                       cases[i].status);
      assert_true((bytes != NULL) == (cases[i].status == QMAT_OK));
      if (!bytes) assert_non_null(strstr(context.error.message, "attribute 1"));
      qmat_free(bytes);
      qmat_context_uninit(&context);
    }
  }
}

static void test_a_skin_is_no_medial_mesh(void **state) {
  (void)state;
  qmat_context context = {0};
  ball b = make_ball(5);
  qmat_draco_skin skin;
  assert_int_equal(qmat_draco_encode_mesh(&context, b.positions, b.normals, b.vertex_count, b.triangles,
                                          b.triangle_count, 12, 8, &skin),
                   QMAT_OK);
  qmat_medial *medial;
  assert_int_equal(qmat_draco_decode_medial(&context, skin.bytes, skin.size, NULL, &medial), QMAT_ERROR_FORMAT);
  assert_null(medial);
  assert_non_null(strstr(context.error.message, "not a medial mesh"));
  qmat_draco_skin_uninit(&skin);
  free_ball(&b);
  qmat_context_uninit(&context);
}

/* Decodes a copy of the very size, so that a read past the end of it is seen. */
static qmat_status decode_copy(const uint8_t *bytes, size_t size) {
  qmat_context context = {0};
  qmat_medial *medial = NULL;
  uint8_t *copy = malloc(size > 0 ? size : 1);
  assert_non_null(copy);
  if (size > 0) memcpy(copy, bytes, size);
  const qmat_status status = qmat_draco_decode_medial(&context, copy, size, NULL, &medial);
  assert_true((status == QMAT_OK) == (medial != NULL));
  if (medial) qmat_value_release(&medial->base);
  free(copy);
  qmat_context_uninit(&context);
  return status;
}

static void test_truncated_and_noisy_data_fail_cleanly(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_medial *medial = example_medial(60);
  uint8_t *bytes;
  size_t size;
  assert_int_equal(qmat_draco_encode_medial(&context, medial, NULL, 12, 10, &bytes, &size), QMAT_OK);
  for (size_t length = 0; length < size; length++) assert_int_not_equal(decode_copy(bytes, length), QMAT_OK);
  uint64_t random = 42;
  for (int round = 0; round < 4000; round++) {
    uint8_t *noisy = malloc(size);
    assert_non_null(noisy);
    memcpy(noisy, bytes, size);
    for (int changes = 1 + round % 3; changes > 0; changes--) {
      random = random * 6364136223846793005u + 1442695040888963407u;
      noisy[(size_t)(random >> 20) % size] = (uint8_t)(random >> 56);
    }
    const qmat_status status = decode_copy(noisy, size);
    assert_true(status == QMAT_OK || status == QMAT_ERROR_FORMAT || status == QMAT_ERROR_GEOMETRY);
    free(noisy);
  }
  qmat_free(bytes);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

static void test_noise_in_skins_fails_cleanly(void **state) {
  (void)state;
  qmat_context context = {0};
  ball b = make_ball(8);
  qmat_draco_skin skin;
  assert_int_equal(qmat_draco_encode_mesh(&context, b.positions, b.normals, b.vertex_count, b.triangles,
                                          b.triangle_count, 11, 8, &skin),
                   QMAT_OK);
  uint64_t random = 7;
  for (int round = 0; round < 4000; round++) {
    uint8_t *noisy = malloc(skin.size);
    assert_non_null(noisy);
    memcpy(noisy, skin.bytes, skin.size);
    random = random * 6364136223846793005u + 1442695040888963407u;
    noisy[(size_t)(random >> 20) % skin.size] = (uint8_t)(random >> 56);
    qmat_draco_mesh *mesh;
    const qmat_status status = qmat_draco_mesh_new(&context, noisy, skin.size, &mesh);
    assert_true(status == QMAT_OK || status == QMAT_ERROR_FORMAT);
    qmat_draco_mesh_free(mesh);
    free(noisy);
  }
  qmat_draco_skin_uninit(&skin);
  free_ball(&b);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_medial_meshes_come_back_in_order_within_the_bound),
      cmocka_unit_test(test_equal_spheres_stay_apart),
      cmocka_unit_test(test_far_and_tiny_models_keep_what_single_precision_holds),
      cmocka_unit_test(test_the_same_medial_mesh_gives_the_same_bytes),
      cmocka_unit_test(test_faces_are_triangles_then_edges_then_spheres),
      cmocka_unit_test(test_bits_are_the_fewest_that_hold_the_error),
      cmocka_unit_test(test_bad_bits_and_empty_medial_meshes_are_refused),
      cmocka_unit_test(test_skins_are_packed_tighter_and_say_what_is_decoded),
      cmocka_unit_test(test_ranges_beyond_single_precision_are_refused),
      cmocka_unit_test(test_a_skin_is_no_medial_mesh),
      cmocka_unit_test(test_truncated_and_noisy_data_fail_cleanly),
      cmocka_unit_test(test_noise_in_skins_fails_cleanly),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
