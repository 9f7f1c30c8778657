/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/value.h"

#include <math.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "core/hash.h"
#include "core/value_form.h"
#include "tests/core/value_examples.h"

/* What the items of the lists among the examples are found as. */
static qmat_value *known[2];
static uint64_t known_sizes[2];

static int make_known_items(void **state) {
  (void)state;
  qmat_context context = {0};
  known[0] = &field_example()->base;
  known[1] = &failure_example()->base;
  for (size_t i = 0; i < 2; i++) {
    uint8_t *bytes;
    size_t size;
    assert_int_equal(qmat_value_seal(&context, known[i]), QMAT_OK);
    assert_int_equal(qmat_value_serialize(&context, known[i], &bytes, &size), QMAT_OK);
    qmat_free(bytes);
    known_sizes[i] = size;
  }
  return 0;
}

static int release_known_items(void **state) {
  (void)state;
  for (size_t i = 0; i < 2; i++) qmat_value_release(known[i]);
  return 0;
}

static qmat_value *find_known_item(void *user, const qmat_digest *digest, uint64_t size) {
  (void)user;
  for (size_t i = 0; i < 2; i++)
    if (size == known_sizes[i] && qmat_digest_equal(digest, &known[i]->digest)) return qmat_value_retain(known[i]);
  return NULL;
}

static const qmat_value_source known_items = {find_known_item, NULL};

static void assert_sealed(qmat_context *context, qmat_value *value) {
  const qmat_status status = qmat_value_seal(context, value);
  if (status != QMAT_OK) print_error("%s\n", context->error.message);
  assert_int_equal(status, QMAT_OK);
  assert_true(value->sealed);
}

/* Sealing fails with this line; the value stays open and is released. */
static void assert_not_sealed(qmat_value *value, qmat_status expected, const char *expected_line) {
  qmat_context context = {0};
  char line[1024];
  assert_int_equal(qmat_value_seal(&context, value), expected);
  qmat_error_format(&context.error, line, sizeof line);
  assert_string_equal(line, expected_line);
  assert_false(value->sealed);
  qmat_value_release(value);
}

static void test_colliders_without_radius_or_with_another_hulls_points_or_joints_are_refused(void **state) {
  (void)state;
  qmat_colliders *colliders = colliders_example();
  colliders->spheres[7] = 0;
  assert_not_sealed(&colliders->base, QMAT_ERROR_GEOMETRY, "sphere 1: its radius is 0");
  colliders = colliders_example();
  colliders->shapes[2] = 2;
  qmat_context context = {0};
  assert_int_equal(qmat_value_seal(&context, &colliders->base), QMAT_ERROR_GEOMETRY);
  qmat_value_release(&colliders->base);
  colliders = colliders_example();
  colliders->triangles[5] = 4;
  assert_not_sealed(&colliders->base, QMAT_ERROR_GEOMETRY, "shape 0: its hull is not within its points and triangles");
  colliders = colliders_example();
  colliders->hull_ends[1] = 3;
  assert_not_sealed(&colliders->base, QMAT_ERROR_GEOMETRY, "points or triangles follow the last hull");
  colliders = colliders_example();
  qmat_free(colliders->joints);
  ASSIGN(colliders->joints, (uint32_t[]){3, 4});
  colliders->joint_count = 2;
  assert_not_sealed(&colliders->base, QMAT_ERROR_GEOMETRY, "2 joints for 1 shapes");
}

static void test_types_have_names(void **state) {
  (void)state;
  assert_string_equal(qmat_value_type_name(QMAT_SCENE), "scene");
  assert_string_equal(qmat_value_type_name(QMAT_MEDIAL), "medial");
  assert_string_equal(qmat_value_type_name(QMAT_CHAIN), "chain");
  assert_string_equal(qmat_value_type_name(QMAT_FILE), "file");
  assert_string_equal(qmat_value_type_name(QMAT_VALUE_TYPE_COUNT), "unknown");
  assert_string_equal(qmat_value_type_name((qmat_value_type)-1), "unknown");
}

static void test_new_values_are_empty_and_can_be_released_at_once(void **state) {
  (void)state;
  qmat_value *values[] = {&qmat_scene_new()->base,     &qmat_mesh_new()->base,   &qmat_field_new()->base,
                          &qmat_samples_new()->base,   &qmat_medial_new()->base, &qmat_chain_new()->base,
                          &qmat_report_new()->base,    &qmat_file_new()->base,   &qmat_failure_new()->base,
                          &qmat_colliders_new()->base, &qmat_list_new(0)->base};
  for (int type = 0; type < QMAT_VALUE_TYPE_COUNT; type++) {
    assert_non_null(values[type]);
    assert_int_equal(values[type]->type, type);
    assert_int_equal(values[type]->references, 1);
    assert_false(values[type]->sealed);
    assert_int_equal(qmat_value_bytes(values[type]), type == QMAT_REPORT ? 2 : 0);
    qmat_value_release(values[type]);
  }
  qmat_value_release(NULL);
  assert_null(qmat_value_retain(NULL));
}

static void test_half_filled_values_are_released_whole(void **state) {
  (void)state;
  qmat_file *file = qmat_file_new();
  file->part_count = 2;
  file->parts = qmat_calloc(2, sizeof *file->parts);
  file->parts[1].name = qmat_strdup("a.bin");
  qmat_value_release(&file->base);
  qmat_medial *medial = qmat_medial_new();
  medial->spheres = qmat_alloc(4, sizeof(double));
  qmat_value_release(&medial->base);
  qmat_report *report = qmat_report_new();
  json_decref(report->root);
  report->root = NULL;
  assert_int_equal(qmat_value_bytes(&report->base), 0);
  qmat_value_release(&report->base);
}

static void test_bytes_count_what_the_arrays_hold(void **state) {
  (void)state;
  const size_t expected[] = {
      [QMAT_SCENE] = 6 + 3,
      [QMAT_MESH] = 12 * 8 + 12 * 4 + 16 * 4 + 16 * 8,
      [QMAT_FIELD] = 3 * 8 + 10,
      [QMAT_SAMPLES] = 6 * 8 + 2 * 4 + 6 * 8,
      [QMAT_MEDIAL] = 16 * 8 + 8 * 4 + 3 * 4 + 5 * 4 + 6 * 4 + 16 * 4 + 16 * 8,
      [QMAT_CHAIN] = 16 * 8 + 8 * 4 + 3 * 4 + 3 * 4 + 4 * 4 + 8 * 8 + 2 * 8,
      [QMAT_REPORT] = strlen("{\"error\":0.10000000000000001,\"spheres\":100,"
                             "\"steps\":[1,2.0,\"a\\\"b\"]}"),
      [QMAT_FILE] = 4 + 8,
      [QMAT_FAILURE] = 10,
      [QMAT_COLLIDERS] = 8 * 8 + 3 * 4 + 12 * 8 + 12 * 4 + 2 * 4 + 10 * 8 + 4,
      [QMAT_LIST] = 2 * (3 * 8 + 10),
      [EXAMPLE_WHOLE_SCENE] = 6 + 3 + 8 + 2 * 4 + 4 + 4 + 16 * 8 + 32 * 8 + 2 * 4 + 2 * 4 + 20 * 8 + 2 * 4 + 2 * 4 +
                              3 * 4 + 48 * 8 + 4 + 6 * 4 + 3 * 8 + 2 * 4 + 10 * 8,
      [EXAMPLE_CAGE] = 12 * 8 + 12 * 4 + 16 * 4 + 16 * 8 + 3 * 2 * 4 + 21 * 8 + 2 * 4 + 7 * 4 + 4 + 2 * 4 + 8 + 4 + 8,
      [EXAMPLE_SHEETS] = 12 * 8 + 12 * 4,
      [EXAMPLE_FACET_FIELD] = 3 * 8,
      [EXAMPLE_BARE_MEDIAL] = 16 * 8 + 12 * 4 + 3 * 4,
      [EXAMPLE_BOUNDED_CHAIN] = 16 * 8 + 12 * 4 + 3 * 4 + 3 * 4 + 4 * 4 + 8 * 8 + 2 * 8 + 2 * 4 + 4 * 8,
      [EXAMPLE_COLLIDERS_WITHOUT_BODY] = 8 * 8 + 6 * 4 + 15 * 8 + 12 * 4 + 4 * 4,
      [EXAMPLE_LIST_WITH_FAILURE] = 10 + 3 * 8 + 10};
  assert_int_equal(sizeof expected / sizeof *expected, EXAMPLE_COUNT);
  for (int example = 0; example < EXAMPLE_COUNT; example++) {
    qmat_value *value = example_of(example);
    assert_int_equal(qmat_value_bytes(value), expected[example]);
    qmat_value_release(value);
  }
}

static void test_every_value_is_read_back_to_the_same_bytes_and_digest(void **state) {
  (void)state;
  qmat_context context = {0};
  for (int example = 0; example < EXAMPLE_COUNT; example++) {
    qmat_value *value = example_of(example), *again = NULL;
    uint8_t *bytes, *bytes_again;
    size_t size, size_again;
    assert_sealed(&context, value);
    assert_int_equal(qmat_value_serialize(&context, value, &bytes, &size), QMAT_OK);
    assert_int_equal(qmat_value_deserialize(&context, bytes, size, &known_items, &again), QMAT_OK);
    assert_int_equal(again->type, value->type);
    assert_int_equal(again->references, 1);
    assert_true(again->sealed);
    assert_memory_equal(&again->digest, &value->digest, sizeof value->digest);
    assert_int_equal(qmat_value_serialize(&context, again, &bytes_again, &size_again), QMAT_OK);
    assert_int_equal(size_again, size);
    assert_memory_equal(bytes_again, bytes, size);
    qmat_free(bytes);
    qmat_free(bytes_again);
    qmat_value_release(value);
    qmat_value_release(again);
  }
}

static void test_a_rig_comes_back_with_all_names(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_scene *scene = rigged_scene_example();
  uint8_t *bytes;
  size_t size;
  qmat_value *value;
  assert_sealed(&context, &scene->base);
  assert_int_equal(qmat_value_serialize(&context, &scene->base, &bytes, &size), QMAT_OK);
  assert_int_equal(qmat_value_deserialize(&context, bytes, size, &known_items, &value), QMAT_OK);
  const qmat_scene *again = (const qmat_scene *)value;
  assert_memory_equal(&value->digest, &scene->base.digest, sizeof value->digest);
  assert_string_equal(again->placement_paths[0], "/Root/Mesh");
  assert_int_equal(again->rig.skeleton_count, 1);
  assert_string_equal(again->rig.skeleton_paths[0], "/Root/Skeleton");
  assert_int_equal(again->rig.joint_count, 2);
  assert_string_equal(again->rig.joint_names[0], "hip");
  assert_string_equal(again->rig.joint_names[1], "");
  qmat_value_release(value);
  /* Names that are not as many as what they name. */
  for (size_t i = 0; i + 3 < size; i++)
    if (memcmp(&bytes[i], "hip", 3) == 0) bytes[i - 4] = 7; /* reaches to the end */
  assert_int_equal(qmat_value_deserialize(&context, bytes, size, &known_items, &value), QMAT_ERROR_FORMAT);
  assert_string_equal(context.error.message, "this is not a serialised value: there are not as many names as items");
  qmat_free(bytes);
  qmat_value_release(&scene->base);
  qmat_context_uninit(&context);
}

static void test_the_content_comes_back_field_by_field(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_medial *medial = medial_example();
  uint8_t *bytes;
  size_t size;
  qmat_value *value;
  assert_sealed(&context, &medial->base);
  assert_int_equal(qmat_value_serialize(&context, &medial->base, &bytes, &size), QMAT_OK);
  assert_int_equal(qmat_value_deserialize(&context, bytes, size, &known_items, &value), QMAT_OK);
  const qmat_medial *again = (const qmat_medial *)value;
  assert_int_equal(again->sphere_count, 4);
  assert_int_equal(again->edge_count, 4);
  assert_int_equal(again->triangle_count, 1);
  assert_int_equal(again->region_offset_count, 5);
  assert_int_equal(again->region_sample_count, 6);
  assert_memory_equal(again->spheres, medial->spheres, 16 * sizeof(double));
  assert_memory_equal(again->edges, medial->edges, 8 * sizeof(uint32_t));
  assert_memory_equal(again->triangles, medial->triangles, 3 * sizeof(uint32_t));
  assert_memory_equal(again->region_offsets, medial->region_offsets, 5 * sizeof(uint32_t));
  assert_memory_equal(again->region_samples, medial->region_samples, 6 * sizeof(uint32_t));
  assert_int_equal(again->skinned_count, 4);
  assert_memory_equal(again->joints, medial->joints, 16 * sizeof(uint32_t));
  assert_memory_equal(again->weights, medial->weights, 16 * sizeof(double));
  assert_int_equal((uintptr_t)again->spheres % 64, 0);
  qmat_free(bytes);
  qmat_value_release(value);
  qmat_value_release(&medial->base);

  qmat_file *file = file_example();
  assert_sealed(&context, &file->base);
  assert_int_equal(qmat_value_serialize(&context, &file->base, &bytes, &size), QMAT_OK);
  assert_int_equal(qmat_value_deserialize(&context, bytes, size, &known_items, &value), QMAT_OK);
  const qmat_file *file_again = (const qmat_file *)value;
  assert_string_equal(file_again->format, "gltf");
  assert_int_equal(file_again->part_count, 3);
  assert_string_equal(file_again->parts[1].name, "medial.bin");
  assert_int_equal(file_again->parts[1].size, 3);
  assert_memory_equal(file_again->parts[1].bytes, "\0\1\2", 3);
  qmat_free(bytes);
  qmat_value_release(value);
  qmat_value_release(&file->base);
}

/* Written out by hand from the description at the head of value.c. */
static void test_the_serialised_form_is_as_described(void **state) {
  (void)state;
  static const uint8_t expected[] =
      "QMAT\1\0\0\0"
      "\5\0\0\0"
      "field"
      "\6\0\0\0"
      "values"
      "\3"
      "\x18\0\0\0\0\0\0\0"
      "\0\0\0\0\0\0\xe0\x3f"
      "\0\0\0\0\0\0\0\x80"
      "\x9c\x75\0\x88\x3c\xe4\x37\x7e"
      "\6\0\0\0"
      "domain"
      "\7"
      "\4\0\0\0\0\0\0\0"
      "\1\0\0\0"
      "\4\0\0\0"
      "unit"
      "\4"
      "\x0a\0\0\0\0\0\0\0"
      "model unit";
  qmat_context context = {0};
  qmat_field *field = field_example();
  uint8_t *bytes;
  size_t size;
  assert_sealed(&context, &field->base);
  assert_int_equal(qmat_value_serialize(&context, &field->base, &bytes, &size), QMAT_OK);
  assert_int_equal(size, sizeof expected - 1);
  assert_memory_equal(bytes, expected, size);
  qmat_hasher hasher;
  qmat_digest digest;
  assert_int_equal(qmat_hasher_init(&hasher), QMAT_OK);
  qmat_hasher_add(&hasher, expected, sizeof expected - 1);
  assert_int_equal(qmat_hasher_finish(&hasher, &digest), QMAT_OK);
  assert_memory_equal(&field->base.digest, &digest, sizeof digest);
  qmat_free(bytes);
  qmat_value_release(&field->base);
}

/* Every array that is longer than the encoder's chunk. */
static void test_long_arrays_come_back_whole(void **state) {
  (void)state;
  enum { COUNT = 12345 };
  qmat_context context = {0};
  qmat_mesh *mesh = qmat_mesh_new();
  mesh->vertex_count = mesh->triangle_count = COUNT;
  mesh->positions = qmat_alloc(3 * COUNT, sizeof(double));
  mesh->triangles = qmat_alloc(3 * COUNT, sizeof(uint32_t));
  for (size_t i = 0; i < 3 * COUNT; i++) {
    mesh->positions[i] = qmat_hash_unit(qmat_hash3(1, i, 0)) - 0.5;
    mesh->triangles[i] = (uint32_t)(qmat_hash3(2, i, 0) % COUNT);
  }
  assert_sealed(&context, &mesh->base);
  uint8_t *bytes;
  size_t size;
  qmat_value *value;
  assert_int_equal(qmat_value_serialize(&context, &mesh->base, &bytes, &size), QMAT_OK);
  assert_int_equal(qmat_value_deserialize(&context, bytes, size, &known_items, &value), QMAT_OK);
  const qmat_mesh *again = (const qmat_mesh *)value;
  assert_memory_equal(again->positions, mesh->positions, 3 * COUNT * sizeof(double));
  assert_memory_equal(again->triangles, mesh->triangles, 3 * COUNT * sizeof(uint32_t));
  qmat_free(bytes);
  qmat_value_release(value);
  qmat_value_release(&mesh->base);
}

static void test_empty_values_are_valid(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_field *field = qmat_field_new();
  field->unit = qmat_strdup("");
  qmat_value *values[] = {&qmat_mesh_new()->base,    &field->base,
                          &qmat_samples_new()->base, &qmat_medial_new()->base,
                          &qmat_chain_new()->base,   &qmat_report_new()->base};
  enum { COUNT = sizeof values / sizeof *values };
  for (size_t i = 0; i < COUNT; i++) {
    assert_sealed(&context, values[i]);
    uint8_t *bytes;
    size_t size;
    qmat_value *again;
    assert_int_equal(qmat_value_serialize(&context, values[i], &bytes, &size), QMAT_OK);
    assert_int_equal(qmat_value_deserialize(&context, bytes, size, &known_items, &again), QMAT_OK);
    assert_memory_equal(&again->digest, &values[i]->digest, sizeof again->digest);
    if (again->type == QMAT_MEDIAL) assert_null(((const qmat_medial *)again)->region_offsets);
    for (size_t k = 0; k < i; k++) {
      assert_memory_not_equal(&values[i]->digest, &values[k]->digest, sizeof values[i]->digest);
    }
    qmat_free(bytes);
    qmat_value_release(again);
  }
  for (size_t i = 0; i < COUNT; i++) qmat_value_release(values[i]);
}

static void test_every_bit_of_content_moves_the_digest(void **state) {
  (void)state;
  qmat_context context = {0};
  enum { CHANGES = 9 };
  qmat_digest digests[CHANGES];
  for (int change = 0; change < CHANGES; change++) {
    qmat_mesh *mesh = mesh_example();
    if (change == 1) mesh->closed = false;
    if (change == 2) mesh->oriented = false;
    if (change == 3) mesh->positions[0] = -0.0;
    if (change == 4) mesh->triangles[11] = 0;
    if (change == 5) mesh->triangle_count = 3;
    if (change == 6) mesh->sheet_triangle_count = 1;
    if (change == 7) mesh->sheet_thickness = 1;
    if (change == 8) mesh->sheet_triangle_count = mesh->flap_triangle_count = 1;
    assert_sealed(&context, &mesh->base);
    digests[change] = mesh->base.digest;
    qmat_value_release(&mesh->base);
    for (int k = 0; k < change; k++) assert_memory_not_equal(&digests[change], &digests[k], sizeof(qmat_digest));
  }
}

static void test_a_report_has_one_digest_for_any_order_of_its_keys(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_report *a = qmat_report_new(), *b = qmat_report_new();
  for (int i = 0; i < 50; i++) {
    char first[16], second[16];
    snprintf(first, sizeof first, "key%d", i);
    snprintf(second, sizeof second, "key%d", 49 - i);
    json_object_set_new(a->root, first, json_integer(i));
    json_object_set_new(b->root, second, json_integer(49 - i));
  }
  assert_sealed(&context, &a->base);
  assert_sealed(&context, &b->base);
  assert_memory_equal(&a->base.digest, &b->base.digest, sizeof(qmat_digest));
  qmat_value_release(&a->base);
  qmat_value_release(&b->base);
}

static void test_sealing_twice_is_an_internal_error(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_mesh *mesh = mesh_example();
  assert_sealed(&context, &mesh->base);
  assert_int_equal(qmat_value_seal(&context, &mesh->base), QMAT_ERROR_INTERNAL);
  assert_string_equal(context.error.message, "a mesh was sealed twice");
  qmat_value_release(&mesh->base);
}

static void test_an_open_value_cannot_be_serialized(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_mesh *mesh = mesh_example();
  uint8_t *bytes = (uint8_t *)1;
  size_t size = 1;
  assert_int_equal(qmat_value_serialize(&context, &mesh->base, &bytes, &size), QMAT_ERROR_INTERNAL);
  assert_null(bytes);
  assert_int_equal(size, 0);
  qmat_value_release(&mesh->base);
}

static void test_missing_arrays_and_texts_are_internal_errors(void **state) {
  (void)state;
  qmat_scene *scene = scene_example();
  qmat_free(scene->format);
  scene->format = NULL;
  assert_not_sealed(&scene->base, QMAT_ERROR_INTERNAL, "format: the format of a scene is not set");
  qmat_mesh *mesh = qmat_mesh_new();
  mesh->vertex_count = 3;
  assert_not_sealed(&mesh->base, QMAT_ERROR_INTERNAL, "positions: a mesh counts 3 positions but holds none");
  qmat_field *field = field_example();
  field->count = SIZE_MAX;
  char line[128];
  snprintf(line, sizeof line, "values: a field counts %zu values but holds none", SIZE_MAX);
  assert_not_sealed(&field->base, QMAT_ERROR_INTERNAL, line);
  qmat_report *report = qmat_report_new();
  json_decref(report->root);
  report->root = json_array();
  assert_not_sealed(&report->base, QMAT_ERROR_INTERNAL, "the root of a report is not a JSON object");
}

static void test_bad_meshes_name_the_first_bad_element(void **state) {
  (void)state;
  qmat_mesh *mesh = mesh_example();
  mesh->positions[3 * 2 + 1] = (double)INFINITY;
  mesh->positions[3 * 3] = (double)NAN;
  assert_not_sealed(&mesh->base, QMAT_ERROR_GEOMETRY, "vertex 2: the position is not finite");
  mesh = mesh_example();
  mesh->triangles[3 * 1 + 2] = 4;
  mesh->triangles[3 * 3] = UINT32_MAX;
  assert_not_sealed(&mesh->base, QMAT_ERROR_GEOMETRY, "facet 1: corner 2 names vertex 4 of 4");
  mesh = mesh_example();
  mesh->vertex_count = 0;
  assert_not_sealed(&mesh->base, QMAT_ERROR_GEOMETRY, "facet 0: corner 0 names vertex 0 of 0");
  const double no_lengths[] = {-1e-300, (double)NAN, (double)INFINITY};
  for (size_t i = 0; i < sizeof no_lengths / sizeof *no_lengths; i++) {
    mesh = mesh_example();
    mesh->deviation = no_lengths[i];
    assert_not_sealed(&mesh->base, QMAT_ERROR_GEOMETRY, "deviation: it is negative or not finite");
    mesh = mesh_example();
    mesh->sheet_thickness = no_lengths[i];
    assert_not_sealed(&mesh->base, QMAT_ERROR_GEOMETRY, "sheet_thickness: it is negative or not finite");
  }
}

static void test_sheets_come_back_and_are_no_more_than_the_triangles_and_not_of_a_cage(void **state) {
  (void)state;
  qmat_context context = {0};
  uint8_t *bytes;
  size_t size;
  qmat_value *read;
  qmat_mesh *mesh = mesh_example();
  mesh->sheet_triangle_count = 4;
  mesh->flap_triangle_count = 3;
  mesh->sheet_thickness = 0.125;
  assert_sealed(&context, &mesh->base);
  assert_int_equal(qmat_value_serialize(&context, &mesh->base, &bytes, &size), QMAT_OK);
  assert_int_equal(qmat_value_deserialize(&context, bytes, size, &known_items, &read), QMAT_OK);
  assert_int_equal(((qmat_mesh *)read)->sheet_triangle_count, 4);
  assert_int_equal(((qmat_mesh *)read)->flap_triangle_count, 3);
  assert_true(((qmat_mesh *)read)->sheet_thickness == 0.125);
  qmat_free(bytes);
  qmat_value_release(read);
  qmat_value_release(&mesh->base);
  mesh = mesh_example();
  mesh->sheet_triangle_count = 5;
  assert_not_sealed(&mesh->base, QMAT_ERROR_GEOMETRY, "sheet_triangle_count: 5 of 4 triangles");
  mesh = mesh_example();
  mesh->sheet_triangle_count = 2;
  mesh->flap_triangle_count = 3;
  assert_not_sealed(&mesh->base, QMAT_ERROR_GEOMETRY, "flap_triangle_count: 3 of 2 triangles of sheets");
  mesh = cage_example();
  mesh->sheet_triangle_count = 1;
  assert_not_sealed(&mesh->base, QMAT_ERROR_GEOMETRY,
                    "sheet_triangle_count: 1 of 4 triangles of a mesh that is to be subdivided");
  qmat_context_uninit(&context);
}

static void test_cages_come_back_and_bad_ones_name_the_first_bad_element(void **state) {
  (void)state;
  qmat_context context = {0};
  uint8_t *bytes;
  size_t size;
  qmat_value *read;
  qmat_mesh *mesh = cage_example();
  assert_int_equal(qmat_value_seal(&context, &mesh->base), QMAT_OK);
  assert_int_equal(qmat_value_serialize(&context, &mesh->base, &bytes, &size), QMAT_OK);
  assert_int_equal(qmat_value_deserialize(&context, bytes, size, &known_items, &read), QMAT_OK);
  assert_memory_equal(&read->digest, &mesh->base.digest, sizeof read->digest);
  const qmat_cage *cage = &((qmat_mesh *)read)->cage;
  assert_int_equal(cage->surface_count, 2);
  assert_int_equal(cage->creases[1], 1);
  assert_true(cage->crease_sharpness[0] == 2.5 && cage->vertex_sharpness[0] == 10);
  qmat_free(bytes);
  qmat_value_release(read);
  qmat_value_release(&mesh->base);
  for (int i = 0; i < 8; i++) {
    static const char *const kinds[] = {"surface", "surface",      "cage corner", "hole",
                                        "crease",  "sharp vertex", "crease",      ""};
    static const int64_t elements[] = {1, 0, 6, 0, 0, 0, 0, -1};
    mesh = cage_example();
    if (i == 0) mesh->cage.schemes[1] = QMAT_SCHEME_COUNT;
    if (i == 1) mesh->cage.boundaries[0] = QMAT_BOUNDARY_COUNT;
    if (i == 2) mesh->cage.corners[6] = 7;
    if (i == 3) mesh->cage.holes[0] = 2;
    if (i == 4) mesh->cage.creases[1] = 7;
    if (i == 5) mesh->cage.sharp_vertices[0] = 7;
    if (i == 6) mesh->cage.crease_sharpness[0] = -1;
    if (i == 7) mesh->cage.face_sizes[0] = 3;
    assert_int_equal(qmat_value_seal(&context, &mesh->base), QMAT_ERROR_GEOMETRY);
    assert_string_equal(context.error.element_kind, kinds[i]);
    assert_int_equal(context.error.element, elements[i]);
    qmat_value_release(&mesh->base);
  }
  qmat_context_uninit(&context);
}

static void test_bad_scenes_and_fields_are_refused(void **state) {
  (void)state;
  qmat_scene *scene = scene_example();
  scene->name[2] = (char)0xFF;
  assert_not_sealed(&scene->base, QMAT_ERROR_FORMAT, "the name of the scene is not valid UTF-8");
  qmat_field *field = field_example();
  field->values[1] = (double)INFINITY;
  assert_not_sealed(&field->base, QMAT_ERROR_GEOMETRY, "vertex 1: the value is not finite");
  field = field_example();
  field->domain = QMAT_PER_FACET;
  field->values[2] = (double)NAN;
  assert_not_sealed(&field->base, QMAT_ERROR_GEOMETRY, "facet 2: the value is not finite");
  field = field_example();
  memset(&field->domain, 7, sizeof field->domain);
  assert_not_sealed(&field->base, QMAT_ERROR_GEOMETRY, "domain: the domain of a field is neither facets nor vertices");
}

static void test_bad_samples_name_the_first_bad_element(void **state) {
  (void)state;
  qmat_samples *samples = samples_example();
  samples->positions[4] = (double)NAN;
  assert_not_sealed(&samples->base, QMAT_ERROR_GEOMETRY, "sample 1: the position is not finite");
  samples = samples_example();
  samples->barycentrics[0] = -(double)INFINITY;
  assert_not_sealed(&samples->base, QMAT_ERROR_GEOMETRY, "sample 0: the barycentric coordinate is not finite");
  samples = samples_example();
  samples->barycentrics[5] = 0.25;
  assert_not_sealed(&samples->base, QMAT_ERROR_GEOMETRY, "sample 1: the barycentric coordinates sum to 0.75, not 1");
  samples = samples_example();
  samples->vertex_count = 3;
  assert_not_sealed(&samples->base, QMAT_ERROR_GEOMETRY, "vertex_count: there are 3 vertices among 2 samples");
}

static void test_barycentrics_may_be_off_by_rounding(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_samples *samples = samples_example();
  samples->barycentrics[5] += 9e-10;
  assert_sealed(&context, &samples->base);
  qmat_value_release(&samples->base);
}

static void test_bad_medial_meshes_name_the_first_bad_element(void **state) {
  (void)state;
  qmat_medial *medial = medial_example();
  medial->spheres[4 * 3 + 3] = (double)NAN;
  assert_not_sealed(&medial->base, QMAT_ERROR_GEOMETRY, "sphere 3: the centre or radius is not finite");
  medial = medial_example();
  medial->spheres[4 * 1 + 3] = -0.5;
  assert_not_sealed(&medial->base, QMAT_ERROR_GEOMETRY, "sphere 1: the radius -0.5 is negative");
  medial = medial_example();
  medial->edges[7] = 4;
  assert_not_sealed(&medial->base, QMAT_ERROR_GEOMETRY, "edge 3: it names sphere 4 of 4");
  medial = medial_example();
  medial->edges[0] = 1;
  assert_not_sealed(&medial->base, QMAT_ERROR_GEOMETRY, "edge 0: its spheres 1 and 1 are not in ascending order");
  medial = medial_example();
  medial->edges[3] = 1;
  assert_not_sealed(&medial->base, QMAT_ERROR_GEOMETRY, "edge 1: it repeats the previous edge");
  medial = medial_example();
  medial->edges[4] = 0;
  medial->edges[5] = 1;
  assert_not_sealed(&medial->base, QMAT_ERROR_GEOMETRY, "edge 2: it sorts before the previous edge");
  medial = medial_example();
  medial->triangles[1] = 2;
  medial->triangles[2] = 1;
  assert_not_sealed(&medial->base, QMAT_ERROR_GEOMETRY, "triangle 0: its spheres 2 and 1 are not in ascending order");
  medial = medial_example();
  medial->triangles[2] = 3;
  assert_not_sealed(&medial->base, QMAT_ERROR_GEOMETRY, "triangle 0: its side (0, 3) is not among the edges");
  medial = medial_example();
  medial->edge_count = 2;
  assert_not_sealed(&medial->base, QMAT_ERROR_GEOMETRY, "triangle 0: its side (1, 2) is not among the edges");
}

static void test_bad_skins_and_units_are_refused(void **state) {
  (void)state;
  qmat_medial *medial = medial_example();
  medial->skinned_count = 3;
  assert_not_sealed(&medial->base, QMAT_ERROR_GEOMETRY, "joints: 3 of 4 elements have joints and weights");
  medial = medial_example();
  medial->joints[9] = 65536;
  assert_not_sealed(&medial->base, QMAT_ERROR_GEOMETRY, "sphere 2: it names joint 65536 of 65536");
  medial = medial_example();
  medial->weights[15] = (double)NAN;
  assert_not_sealed(&medial->base, QMAT_ERROR_GEOMETRY, "sphere 3: the weight is not finite");
  medial = medial_example();
  medial->weights[4] = 0.5;
  assert_not_sealed(&medial->base, QMAT_ERROR_GEOMETRY, "sphere 1: its weights are negative or do not sum to 1");
  qmat_mesh *mesh = mesh_example();
  mesh->weights[2] = -0.5;
  mesh->weights[3] = 0.5;
  assert_not_sealed(&mesh->base, QMAT_ERROR_GEOMETRY, "vertex 0: its weights are negative or do not sum to 1");
  mesh = mesh_example();
  mesh->meters_per_unit = (double)INFINITY;
  assert_not_sealed(&mesh->base, QMAT_ERROR_GEOMETRY, "meters_per_unit: it is negative or not finite");
  qmat_chain *chain = chain_example();
  chain->meters_per_diagonal = -1;
  assert_not_sealed(&chain->base, QMAT_ERROR_GEOMETRY, "meters_per_diagonal: it is negative or not finite");
}

static void test_bad_regions_are_refused(void **state) {
  (void)state;
  qmat_medial *medial = medial_example();
  medial->region_offset_count = 4;
  assert_not_sealed(&medial->base, QMAT_ERROR_GEOMETRY, "region_offsets: 4 spheres need 5 region offsets, not 4");
  medial = medial_example();
  medial->region_offsets[0] = 1;
  assert_not_sealed(&medial->base, QMAT_ERROR_GEOMETRY, "region 0: the first region starts at 1, not 0");
  medial = medial_example();
  medial->region_offsets[2] = 1;
  assert_not_sealed(&medial->base, QMAT_ERROR_GEOMETRY, "region 1: it ends at 1, before its start at 2");
  medial = medial_example();
  medial->region_sample_count = 5;
  assert_not_sealed(&medial->base, QMAT_ERROR_GEOMETRY, "region_offsets: the regions end at 6 of 5 samples");
  medial = medial_example();
  medial->region_offset_count = 0;
  assert_not_sealed(&medial->base, QMAT_ERROR_INTERNAL, "a medial mesh without region rows holds region data");
}

static void set_part_name(qmat_file *file, size_t part, const char *name) {
  qmat_free(file->parts[part].name);
  file->parts[part].name = qmat_strdup(name);
}

static void test_bad_chains_name_the_first_bad_element(void **state) {
  (void)state;
  qmat_chain *chain = chain_example();
  chain->edges[7] = 4;
  assert_not_sealed(&chain->base, QMAT_ERROR_GEOMETRY, "edge 3: it names sphere 4 of 4");
  chain = chain_example();
  chain->owners[1] = 4;
  assert_not_sealed(&chain->base, QMAT_ERROR_GEOMETRY, "sample 1: its owner is sphere 4 of 4");
  chain = chain_example();
  chain->ends[2] = 4;
  assert_not_sealed(&chain->base, QMAT_ERROR_GEOMETRY, "collapse 1: it names a sphere that does not exist");
  chain = chain_example();
  chain->ends[1] = 1;
  assert_not_sealed(&chain->base, QMAT_ERROR_GEOMETRY, "collapse 0: it joins a sphere to itself");
  chain = chain_example();
  chain->ends[3] = 3;
  assert_not_sealed(&chain->base, QMAT_ERROR_GEOMETRY,
                    "collapse 1: it names a sphere that an earlier collapse removed");
  chain = chain_example();
  chain->merged[7] = -1;
  assert_not_sealed(&chain->base, QMAT_ERROR_GEOMETRY, "collapse 1: the radius -1 is negative");
  chain = chain_example();
  chain->errors[1] = (double)INFINITY;
  assert_not_sealed(&chain->base, QMAT_ERROR_GEOMETRY, "collapse 1: the error is not finite");
  chain = chain_example();
  chain->errors[0] = -0.5;
  assert_not_sealed(&chain->base, QMAT_ERROR_GEOMETRY,
                    "collapse 0: the error is below that of the previous collapse, or negative");
  chain = chain_example();
  chain->errors[1] = 0.125;
  assert_not_sealed(&chain->base, QMAT_ERROR_GEOMETRY,
                    "collapse 1: the error is below that of the previous collapse, or negative");
}

static void test_part_names_stay_below_the_folder_and_are_unique(void **state) {
  (void)state;
  const char *const bad[] = {"/etc", "..", ".", "a\\b", "../x", "a/../../b", "a//b", "a/", "./a"};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    qmat_file *file = file_example();
    set_part_name(file, 2, bad[i]);
    char line[128];
    snprintf(line, sizeof line, "part 2: its name '%s' is not a path below the main part's folder", bad[i]);
    assert_not_sealed(&file->base, QMAT_ERROR_FORMAT, line);
  }
  qmat_file *file = file_example();
  set_part_name(file, 1, "../x");
  assert_not_sealed(&file->base, QMAT_ERROR_FORMAT,
                    "part 1: its name '../x' is not a path below the main part's folder");
  file = file_example();
  set_part_name(file, 2, "medial.bin");
  assert_not_sealed(&file->base, QMAT_ERROR_FORMAT, "part 2: the name 'medial.bin' is used twice");
  file = file_example();
  set_part_name(file, 1, "");
  assert_not_sealed(&file->base, QMAT_ERROR_FORMAT, "part 1: it has no name");
  file = file_example();
  set_part_name(file, 0, "main.gltf");
  assert_not_sealed(&file->base, QMAT_ERROR_FORMAT, "part 0: the main part has a name of its own");
  file = file_example();
  set_part_name(file, 1, "\xc3");
  assert_not_sealed(&file->base, QMAT_ERROR_FORMAT, "part 1: the name is not valid UTF-8");
  file = file_example();
  qmat_free(file->parts[1].bytes);
  file->parts[1].bytes = NULL;
  assert_not_sealed(&file->base, QMAT_ERROR_INTERNAL, "part 1: a part of a file has no name or no bytes");
  file = qmat_file_new();
  file->format = qmat_strdup("ply");
  assert_not_sealed(&file->base, QMAT_ERROR_INTERNAL, "a file has no main part");
}

/* The bytes are a copy of just their size, so that the sanitizer sees a read beyond them. */
static qmat_status read_exactly(qmat_context *context, const uint8_t *bytes, size_t size, qmat_value **value) {
  uint8_t *exact = test_malloc(size + (size == 0));
  if (size > 0) memcpy(exact, bytes, size);
  const qmat_status status = qmat_value_deserialize(context, exact, size, &known_items, value);
  test_free(exact);
  return status;
}

static void test_cut_bytes_are_refused_at_every_length(void **state) {
  (void)state;
  qmat_context context = {0};
  for (int example = 0; example < EXAMPLE_COUNT; example++) {
    qmat_value *value = example_of(example), *again;
    uint8_t *bytes;
    size_t size;
    assert_sealed(&context, value);
    assert_int_equal(qmat_value_serialize(&context, value, &bytes, &size), QMAT_OK);
    for (size_t cut = 0; cut < size; cut++) {
      again = value;
      assert_int_equal(read_exactly(&context, bytes, cut, &again), QMAT_ERROR_FORMAT);
      assert_null(again);
      assert_string_equal(context.error.element_kind, "byte");
      assert_in_range(context.error.element, 0, cut);
    }
    qmat_free(bytes);
    qmat_value_release(value);
  }
}

static void test_bytes_after_the_last_row_are_refused(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_mesh *mesh = mesh_example();
  uint8_t *bytes, longer[4096];
  size_t size;
  qmat_value *again;
  assert_sealed(&context, &mesh->base);
  assert_int_equal(qmat_value_serialize(&context, &mesh->base, &bytes, &size), QMAT_OK);
  memcpy(longer, bytes, size);
  longer[size] = 0;
  assert_int_equal(read_exactly(&context, longer, size + 1, &again), QMAT_ERROR_FORMAT);
  qmat_free(bytes);
  qmat_value_release(&mesh->base);
}

/* Every bit of every byte flipped, and every byte set to its extremes: either an error, or a valid value whose bytes
 * are those that were read. */
static void test_spoilt_bytes_give_an_error_or_what_they_say(void **state) {
  (void)state;
  qmat_context context = {0};
  size_t refused = 0, accepted = 0;
  for (int example = 0; example < EXAMPLE_COUNT; example++) {
    qmat_value *value = example_of(example), *again;
    uint8_t *bytes, *written;
    size_t size, written_size;
    assert_sealed(&context, value);
    assert_int_equal(qmat_value_serialize(&context, value, &bytes, &size), QMAT_OK);
    for (size_t i = 0; i < size; i++) {
      const uint8_t before = bytes[i];
      for (int change = 0; change < 10; change++) {
        bytes[i] = (uint8_t)(change < 8 ? before ^ (1 << change) : change == 8 ? 0xFF : 0x7F);
        if (bytes[i] == before) continue;
        const qmat_status status = read_exactly(&context, bytes, size, &again);
        if (status != QMAT_OK) {
          assert_int_equal(status, QMAT_ERROR_FORMAT);
          assert_null(again);
          refused++;
          continue;
        }
        accepted++;
        if (value->type != QMAT_REPORT) { /* JSON has many spellings of one value */
          assert_int_equal(qmat_value_serialize(&context, again, &written, &written_size), QMAT_OK);
          assert_int_equal(written_size, size);
          assert_memory_equal(written, bytes, size);
          qmat_free(written);
        }
        qmat_value_release(again);
      }
      bytes[i] = before;
    }
    qmat_free(bytes);
    qmat_value_release(value);
  }
  assert_true(refused > 1000 && accepted > 1000);
}

static void test_a_huge_length_is_refused_before_it_is_allocated(void **state) {
  (void)state;
  static const uint8_t mesh[] =
      "QMAT\1\0\0\0"
      "\4\0\0\0"
      "mesh"
      "\x09\0\0\0"
      "positions"
      "\3"
      "\0\0\0\0\0\0\0\x80";
  static const uint8_t file[] =
      "QMAT\1\0\0\0"
      "\4\0\0\0"
      "file"
      "\6\0\0\0"
      "format"
      "\4"
      "\3\0\0\0\0\0\0\0"
      "glb"
      "\5\0\0\0"
      "parts"
      "\x09"
      "\x08\0\0\0\0\0\0\0"
      "\xff\xff\xff\xff\xff\xff\xff\x0f";
  qmat_context context = {0};
  qmat_value *value;
  assert_int_equal(read_exactly(&context, mesh, sizeof mesh - 1, &value), QMAT_ERROR_FORMAT);
  uint8_t wrapping[sizeof mesh]; /* 2^64 - 16 bytes, whole elements: what was read and that wrap around zero */
  memcpy(wrapping, mesh, sizeof mesh);
  memcpy(wrapping + sizeof mesh - 9, "\xf0\xff\xff\xff\xff\xff\xff\xff", 8);
  assert_int_equal(read_exactly(&context, wrapping, sizeof mesh - 1, &value), QMAT_ERROR_FORMAT);
  assert_int_equal(read_exactly(&context, file, sizeof file - 1, &value), QMAT_ERROR_FORMAT);
  assert_string_equal(context.error.message, "this is not a serialised value: there are fewer parts than it states");
  assert_string_equal(context.error.field, "parts");
}

static void test_an_array_that_ends_within_an_element_is_refused(void **state) {
  (void)state;
  static const uint8_t mesh[] =
      "QMAT\1\0\0\0"
      "\4\0\0\0"
      "mesh"
      "\x09\0\0\0"
      "positions"
      "\3"
      "\x08\0\0\0\0\0\0\0"
      "\0\0\0\0\0\0\0\0";
  qmat_context context = {0};
  qmat_value *value;
  assert_int_equal(read_exactly(&context, mesh, sizeof mesh - 1, &value), QMAT_ERROR_FORMAT);
  assert_string_equal(context.error.message, "this is not a serialised value: an array ends within an element");
}

static void test_another_version_is_refused_by_number(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_value *value;
  assert_int_equal(read_exactly(&context, (const uint8_t *)"QMAT\2\0\0\0", 8, &value), QMAT_ERROR_FORMAT);
  assert_string_equal(context.error.message, "the serialised form has version 2; this qmat reads version 1");
}

static void test_content_that_breaks_a_rule_is_a_format_error_when_read(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_mesh *mesh = mesh_example();
  uint8_t *bytes;
  size_t size;
  qmat_value *value;
  assert_sealed(&context, &mesh->base);
  assert_int_equal(qmat_value_serialize(&context, &mesh->base, &bytes, &size), QMAT_OK);
  const uint8_t corner[] = {0, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0};
  uint8_t *found = memmem(bytes, size, corner, sizeof corner);
  assert_non_null(found);
  found[4] = 200;
  assert_int_equal(read_exactly(&context, bytes, size, &value), QMAT_ERROR_FORMAT);
  assert_int_equal(context.error.status, QMAT_ERROR_FORMAT);
  assert_string_equal(context.error.message, "corner 1 names vertex 200 of 4");
  qmat_free(bytes);
  qmat_value_release(&mesh->base);
}

static void *retain_and_release(void *value) {
  for (int i = 0; i < 20000; i++) {
    const qmat_mesh *mesh = (const qmat_mesh *)qmat_value_retain(value);
    if (mesh->triangles[0] != 0) return value;
    qmat_value_release((qmat_value *)mesh);
  }
  qmat_value_release(value); /* the reference that this thread was given */
  return NULL;
}

static void test_references_are_counted_across_threads(void **state) {
  (void)state;
  enum { THREADS = 4 };
  qmat_context context = {0};
  qmat_mesh *mesh = mesh_example();
  assert_sealed(&context, &mesh->base);
  pthread_t threads[THREADS];
  for (int i = 0; i < THREADS; i++) {
    assert_ptr_equal(qmat_value_retain(&mesh->base), &mesh->base);
    assert_int_equal(pthread_create(&threads[i], NULL, retain_and_release, mesh), 0);
  }
  for (int i = 0; i < THREADS; i++) {
    void *result;
    assert_int_equal(pthread_join(threads[i], &result), 0);
    assert_null(result);
  }
  assert_int_equal(mesh->base.references, 1);
  qmat_value_release(&mesh->base);
}

static void test_counts_beyond_32_bits_are_refused_before_the_arrays_are_read(void **state) {
  (void)state;
  qmat_mesh *mesh = mesh_example();
  mesh->vertex_count = (size_t)UINT32_MAX + 1;
  assert_not_sealed(&mesh->base, QMAT_ERROR_MEMORY, "4294967296 vertices are more than 32-bit indices can address");
  qmat_medial *medial = medial_example();
  medial->triangle_count = (size_t)1 << 33;
  assert_not_sealed(&medial->base, QMAT_ERROR_MEMORY, "8589934592 triangles are more than 32-bit indices can address");
}

/* The linker sends every aligned_alloc of the program here (tests/core/CMakeLists.txt). */
void *__real_aligned_alloc(size_t alignment, size_t size);
void *__wrap_aligned_alloc(size_t alignment, size_t size);
static size_t allocations_left = SIZE_MAX;

void *__wrap_aligned_alloc(size_t alignment, size_t size) {
  if (allocations_left == 0) return NULL;
  if (allocations_left != SIZE_MAX) --allocations_left;
  return __real_aligned_alloc(alignment, size);
}

static void test_a_shortage_of_memory_at_any_point_is_reported_and_leaks_nothing(void **state) {
  (void)state;
  qmat_context context = {0};
  for (int example = 0; example < EXAMPLE_COUNT; example++) {
    qmat_value *value = example_of(example), *again = value;
    uint8_t *bytes, *none;
    size_t size, none_size;
    assert_sealed(&context, value);
    assert_int_equal(qmat_value_serialize(&context, value, &bytes, &size), QMAT_OK);
    allocations_left = 0;
    assert_int_equal(qmat_value_serialize(&context, value, &none, &none_size), QMAT_ERROR_MEMORY);
    assert_null(none);
    size_t granted = 0;
    for (qmat_status status = QMAT_ERROR_MEMORY; status != QMAT_OK; granted++) {
      allocations_left = granted;
      status = qmat_value_deserialize(&context, bytes, size, &known_items, &again);
      if (status == QMAT_OK) break;
      assert_int_equal(status, QMAT_ERROR_MEMORY);
      assert_int_equal(context.error.status, QMAT_ERROR_MEMORY);
      assert_null(again);
    }
    allocations_left = SIZE_MAX;
    assert_true(granted >= 1);
    qmat_value_release(again);
    qmat_value_release(value);
    qmat_free(bytes);
  }
  allocations_left = 0;
  qmat_report *report = qmat_report_new();
  char *copy = qmat_strdup("text");
  allocations_left = SIZE_MAX;
  assert_null(report);
  assert_null(copy);
}

static void test_a_list_has_items_of_one_type(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_list *list = list_example();
  assert_sealed(&context, &list->base);
  assert_int_equal(qmat_value_count(&list->base), 2);
  assert_ptr_equal(qmat_value_at(&list->base, 1), list->items[1]);
  assert_int_equal(qmat_value_item_type(&list->base), QMAT_FIELD);
  assert_int_equal(qmat_value_count(list->items[0]), 1);
  assert_ptr_equal(qmat_value_at(list->items[0], 0), list->items[0]);
  assert_int_equal(qmat_value_count(NULL), 0);

  uint8_t *bytes;
  size_t size;
  qmat_value *value;
  assert_int_equal(qmat_value_serialize(&context, &list->base, &bytes, &size), QMAT_OK);
  assert_int_equal(qmat_value_deserialize(&context, bytes, size, NULL, &value), QMAT_ERROR_FORMAT);
  assert_non_null(strstr(context.error.message, "an item of the list is missing"));
  assert_null(value);
  for (size_t cut = 0; cut < size; cut++) {
    uint8_t *part = shape_copy(bytes, cut); /* to the byte, so that reading beyond is noticed */
    assert_int_equal(qmat_value_deserialize(&context, part, cut, &known_items, &value), QMAT_ERROR_FORMAT);
    qmat_free(part);
  }
  qmat_free(bytes);

  qmat_list *lists = qmat_list_new(2);
  lists->items[0] = qmat_value_retain(&list->base);
  lists->items[1] = qmat_value_retain(&list->base);
  lists->names[0] = qmat_strdup("a");
  lists->names[1] = qmat_strdup("b");
  assert_not_sealed(&lists->base, QMAT_ERROR_INTERNAL,
                    "item 0: it is a list, is not sealed, or differs in type from the other items");
  qmat_list *mixed = qmat_list_new(2);
  mixed->items[0] = qmat_value_retain(list->items[0]);
  mixed->items[1] = &mesh_example()->base;
  mixed->names[0] = qmat_strdup("a");
  mixed->names[1] = qmat_strdup("b");
  assert_sealed(&context, mixed->items[1]);
  assert_not_sealed(&mixed->base, QMAT_ERROR_INTERNAL,
                    "item 1: it is a list, is not sealed, or differs in type from the other items");
  qmat_list *one = qmat_list_new(1);
  one->items[0] = qmat_value_retain(list->items[0]);
  one->names[0] = qmat_strdup("a");
  assert_not_sealed(&one->base, QMAT_ERROR_INTERNAL, "a list has 1 items; it needs at least two");
  qmat_list *holes = qmat_list_new(2);
  assert_not_sealed(&holes->base, QMAT_ERROR_INTERNAL, "item 0: an item of a list is missing or has no name");
  qmat_value_release(&list->base);
}

static void test_some_items_of_a_list_may_be_failures_but_not_all(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_list *list = list_example();
  qmat_value_release(list->items[0]);
  list->items[0] = &failure_example()->base;
  assert_sealed(&context, list->items[0]);
  assert_sealed(&context, &list->base);
  assert_int_equal(qmat_value_item_type(&list->base), QMAT_FIELD);
  assert_string_equal(qmat_value_failure(qmat_value_at(&list->base, 0)), "it is flat");
  assert_null(qmat_value_failure(qmat_value_at(&list->base, 1)));
  qmat_list *failures = qmat_list_new(2);
  for (size_t i = 0; i < 2; i++) {
    failures->items[i] = qmat_value_retain(list->items[0]);
    failures->names[i] = qmat_strdup("a");
  }
  assert_not_sealed(&failures->base, QMAT_ERROR_INTERNAL, "a list holds only failures");
  qmat_value_release(&list->base);
}

static void test_a_failure_has_the_error_without_its_place(void **state) {
  (void)state;
  qmat_context context = {.node_id = "mine", .node_type = "mesh.sdf"};
  qmat_fail(&context, QMAT_ERROR_GEOMETRY, "it is called \xff\xc3\xa9");
  qmat_fail_at(&context, "/home/me/a.glb", 3, 1);
  qmat_fail_element(&context, "facet", 7);
  qmat_value *failure = qmat_failure_of_error(&context);
  assert_non_null(failure);
  assert_true(failure->sealed);
  assert_string_equal(qmat_value_failure(failure), "mesh.sdf: facet 7: it is called ?\xc3\xa9");
  qmat_value_release(failure);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_types_have_names),
      cmocka_unit_test(test_colliders_without_radius_or_with_another_hulls_points_or_joints_are_refused),
      cmocka_unit_test(test_new_values_are_empty_and_can_be_released_at_once),
      cmocka_unit_test(test_half_filled_values_are_released_whole),
      cmocka_unit_test(test_bytes_count_what_the_arrays_hold),
      cmocka_unit_test(test_every_value_is_read_back_to_the_same_bytes_and_digest),
      cmocka_unit_test(test_a_rig_comes_back_with_all_names),
      cmocka_unit_test(test_the_content_comes_back_field_by_field),
      cmocka_unit_test(test_the_serialised_form_is_as_described),
      cmocka_unit_test(test_long_arrays_come_back_whole),
      cmocka_unit_test(test_empty_values_are_valid),
      cmocka_unit_test(test_every_bit_of_content_moves_the_digest),
      cmocka_unit_test(test_a_report_has_one_digest_for_any_order_of_its_keys),
      cmocka_unit_test(test_sealing_twice_is_an_internal_error),
      cmocka_unit_test(test_an_open_value_cannot_be_serialized),
      cmocka_unit_test(test_missing_arrays_and_texts_are_internal_errors),
      cmocka_unit_test(test_bad_meshes_name_the_first_bad_element),
      cmocka_unit_test(test_sheets_come_back_and_are_no_more_than_the_triangles_and_not_of_a_cage),
      cmocka_unit_test(test_cages_come_back_and_bad_ones_name_the_first_bad_element),
      cmocka_unit_test(test_bad_scenes_and_fields_are_refused),
      cmocka_unit_test(test_bad_samples_name_the_first_bad_element),
      cmocka_unit_test(test_barycentrics_may_be_off_by_rounding),
      cmocka_unit_test(test_bad_medial_meshes_name_the_first_bad_element),
      cmocka_unit_test(test_bad_skins_and_units_are_refused),
      cmocka_unit_test(test_bad_regions_are_refused),
      cmocka_unit_test(test_bad_chains_name_the_first_bad_element),
      cmocka_unit_test(test_part_names_stay_below_the_folder_and_are_unique),
      cmocka_unit_test(test_cut_bytes_are_refused_at_every_length),
      cmocka_unit_test(test_bytes_after_the_last_row_are_refused),
      cmocka_unit_test(test_spoilt_bytes_give_an_error_or_what_they_say),
      cmocka_unit_test(test_a_huge_length_is_refused_before_it_is_allocated),
      cmocka_unit_test(test_an_array_that_ends_within_an_element_is_refused),
      cmocka_unit_test(test_another_version_is_refused_by_number),
      cmocka_unit_test(test_content_that_breaks_a_rule_is_a_format_error_when_read),
      cmocka_unit_test(test_references_are_counted_across_threads),
      cmocka_unit_test(test_counts_beyond_32_bits_are_refused_before_the_arrays_are_read),
      cmocka_unit_test(test_a_shortage_of_memory_at_any_point_is_reported_and_leaks_nothing),
      cmocka_unit_test(test_a_list_has_items_of_one_type),
      cmocka_unit_test(test_some_items_of_a_list_may_be_failures_but_not_all),
      cmocka_unit_test(test_a_failure_has_the_error_without_its_place),
  };
  return cmocka_run_group_tests(tests, make_known_items, release_known_items);
}
