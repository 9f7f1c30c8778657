/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <zlib.h>

#include "core/geometry/vector.h"
#include "io/base64.h"
#include "io/flat_medial.h"
#include "io/page/page_array.h"
#include "nodes/page/display_mesh.h"
#include "tests/medial_meshes.h"
#include "tests/nodes/pipeline.h"

#define ASSIGN(pointer, ...) pointer = memcpy(qmat_alloc(1, sizeof(__VA_ARGS__)), __VA_ARGS__, sizeof(__VA_ARGS__))

static qmat_file *make_page(int threads, const char *params, const qmat_value *const inputs[5]) {
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  pipeline_must_run(threads, "report.page", params, inputs, outputs);
  return (qmat_file *)outputs[0];
}

static char *text_of(const qmat_file *file) {
  char *text = calloc(file->parts[0].size + 1, 1);
  assert_non_null(text);
  memcpy(text, file->parts[0].bytes, file->parts[0].size);
  return text;
}

/* The data that the page's script reads. */
static json_t *data_of(const qmat_file *file) {
  static const char opening[] = "<script type=\"application/json\" id=\"data\">";
  char *text = text_of(file), *start = strstr(text, opening);
  assert_non_null(start);
  start += strlen(opening);
  *strstr(start, "</script>") = 0;
  json_t *data = json_loads(start, 0, NULL);
  assert_non_null(data);
  free(text);
  return data;
}

static const json_t *mesh_of(const json_t *data, size_t index) {
  return json_array_get(json_object_get(data, "meshes"), index);
}

/* The array of a page: numbers of `width` bytes, differences to the one `row` places before where row > 0. */
static uint8_t *decode_array(const char *text, size_t width, size_t row, size_t *size) {
  qmat_context context = {0};
  uint8_t *packed, *planes = calloc(1 << 20, 1), *bytes = calloc(1 << 20, 1);
  size_t packed_size;
  assert_non_null(text);
  assert_int_equal(qmat_base64_decode(&context, text, strlen(text), &packed, &packed_size), QMAT_OK);
  z_stream stream = {.next_in = packed, .avail_in = (uInt)packed_size, .next_out = planes, .avail_out = 1 << 20};
  assert_int_equal(inflateInit2(&stream, -MAX_WBITS), Z_OK);
  assert_int_equal(inflate(&stream, Z_FINISH), Z_STREAM_END);
  *size = stream.total_out;
  inflateEnd(&stream);
  const uint64_t modulus = (uint64_t)1 << (8 * width);
  uint64_t *numbers = calloc(*size + 1, sizeof *numbers);
  const size_t count = *size / width;
  for (size_t i = 0; i < count; i++) {
    for (size_t k = 0; k < width; k++) numbers[i] |= (uint64_t)planes[k * count + i] << (8 * k);
    if (row > 0) {
      const uint64_t half = numbers[i] / 2, step = numbers[i] % 2 ? modulus - 1 - half : half;
      numbers[i] = (step + (i < row ? 0 : numbers[i - row])) % modulus;
    }
    for (size_t k = 0; k < width; k++) bytes[width * i + k] = (uint8_t)(numbers[i] >> (8 * k));
  }
  free(numbers);
  free(planes);
  qmat_free(packed);
  qmat_context_uninit(&context);
  return bytes;
}

static uint8_t *bytes_of(const json_t *object, const char *key, size_t width, size_t row, size_t expected) {
  size_t size;
  uint8_t *bytes = decode_array(json_string_value(json_object_get(object, key)), width, row, &size);
  assert_int_equal(size, expected);
  return bytes;
}

/* Numbers that rise, fall, wrap and stay come back, whatever their width and rows. */
static void test_arrays_come_back(void **state) {
  (void)state;
  uint8_t given[1200];
  for (size_t i = 0; i < sizeof given; i++) given[i] = (uint8_t)(i % 7 == 0 ? 255 - i / 5 : i * i / 11);
  for (size_t width = 1; width <= 4; width *= 2)
    for (size_t row = 0; row <= 4; row++)
      for (size_t count = 0; count <= sizeof given / width; count += 100) {
        size_t size;
        char *text = qmat_page_array_encode(given, count, width, row);
        uint8_t *bytes = decode_array(text, width, row, &size);
        assert_int_equal(size, width * count);
        assert_memory_equal(bytes, given, size);
        free(bytes);
        qmat_free(text);
      }
}

/* A ball of radius 1 with one vertex pulled out to 1.2: the mesh of a sphere of radius 1. */
static qmat_mesh *ball_with_a_spike(void) {
  qmat_mesh *mesh = shape_sphere(1, 24);
  mesh->positions[5] = 1.2; /* the north pole */
  return shape_seal(mesh);
}

static void test_the_data_of_a_ball_with_a_spike(void **state) {
  (void)state;
  qmat_mesh *mesh = ball_with_a_spike();
  qmat_medial *medial = sealed_medial_mesh((const double[]){0, 0, 0, 1}, 1, NULL, 0, NULL, 0);
  qmat_file *file = make_page(1, "", (const qmat_value *[]){NULL, &mesh->base, &medial->base, NULL, NULL});
  json_t *data = data_of(file);
  const json_t *own = mesh_of(data, 0), *surface = json_object_get(own, "surface");
  assert_int_equal(json_integer_value(json_object_get(surface, "triangles")), mesh->triangle_count);
  assert_int_equal(json_integer_value(json_object_get(surface, "vertices")), mesh->vertex_count);
  assert_int_equal(json_integer_value(json_object_get(own, "spheres")), 1);
  assert_true(json_is_null(json_object_get(own, "chain")));
  assert_true(json_is_null(json_object_get(own, "report")));
  const double diagonal = pipeline_diagonal(mesh);
  assert_near(json_number_value(json_object_get(own, "diagonal")), diagonal, 1e-12);
  /* the spike is the worst place; the bounding box is from -1 to 1.2, so its centre is at 0.1 */
  const json_t *worst = json_object_get(json_object_get(own, "worst"), "surface");
  assert_near(json_number_value(json_array_get(worst, 0)), 0, 1e-9);
  assert_near(json_number_value(json_array_get(worst, 2)), 1.1 / diagonal, 1e-9);
  assert_near(json_number_value(json_array_get(worst, 3)), 0.2 / diagonal, 1e-9);
  assert_near(json_number_value(json_object_get(own, "range")), 0.2 / diagonal, 1e-9);
  /* the envelope's pole is farthest from the surface: below the spike, but not 0.2 */
  const json_t *under = json_object_get(json_object_get(own, "worst"), "envelope");
  const double farthest = json_number_value(json_array_get(under, 3));
  assert_true(farthest > 0.01 / diagonal && farthest < 0.2 / diagonal);
  assert_true(json_number_value(json_array_get(under, 2)) > 0.8 / diagonal);
  qmat_context context = {0};
  const char *flat = json_string_value(json_object_get(own, "medial"));
  uint8_t *bytes;
  size_t size;
  qmat_medial *decoded;
  bytes = decode_array(flat, 4, 0, &size);
  assert_int_equal(qmat_flat_decode(&context, bytes, size, NULL, &decoded), QMAT_OK);
  assert_near(decoded->spheres[3], 1 / diagonal, 1e-6);
  assert_near(decoded->spheres[2], -0.1 / diagonal, 1e-6);
  free(bytes);
  qmat_value_release(&decoded->base);
  qmat_context_uninit(&context);
  json_decref(data);
  qmat_value_release(&file->base);
  qmat_value_release(&medial->base);
  qmat_value_release(&mesh->base);
}

/* A box has three normals at each corner; all of a smooth sphere are shared. */
static void test_vertices_on_creases_have_a_normal_for_each_side(void **state) {
  (void)state;
  qmat_mesh *meshes[] = {shape_seal(shape_box(1, 1, 1)), shape_seal(shape_sphere(1, 24))};
  const size_t expected[] = {24, meshes[1]->vertex_count};
  for (size_t i = 0; i < 2; i++) {
    qmat_context context = {0};
    qmat_frame frame;
    qmat_display_mesh display;
    assert_int_equal(qmat_frame_of_mesh(&context, meshes[i], &frame), QMAT_OK);
    assert_int_equal(qmat_display_mesh_make(&context, meshes[i], &frame, NULL, &display), QMAT_OK);
    assert_int_equal(display.vertex_count, expected[i]);
    for (size_t v = 0; v < display.vertex_count; v++)
      assert_near(qmat_dot(&display.normals[3 * v], &display.normals[3 * v]), 1, 1e-12);
    qmat_context_uninit(&context);
    qmat_value_release(&meshes[i]->base);
  }
}

/* Four spheres in a row on the diagonal of a box; they collapse into the first, one after the other. */
static qmat_chain *chain_by_hand(void) {
  qmat_context context = {0};
  qmat_chain *chain = qmat_chain_new();
  chain->sphere_count = 4;
  chain->edge_count = 3;
  chain->collapse_count = 3;
  ASSIGN(chain->spheres, (double[]){0, 0, 0, .1, .3, .3, .3, .1, .6, .6, .6, .1, 1, 1, 1, .1});
  ASSIGN(chain->edges, (uint32_t[]){0, 1, 1, 2, 2, 3});
  ASSIGN(chain->ends, (uint32_t[]){2, 3, 1, 2, 0, 1});
  ASSIGN(chain->merged, (double[]){.8, .8, .8, .2, .5, .5, .5, .4, .5, .5, .5, .5});
  ASSIGN(chain->errors, (double[]){0.01, 0.02, 0.04});
  assert_int_equal(qmat_value_seal(&context, &chain->base), QMAT_OK);
  qmat_context_uninit(&context);
  return chain;
}

static void test_the_slider_starts_at_the_finest_level_that_is_wanted(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_seal(shape_box(1, 1, 1));
  qmat_chain *chain = chain_by_hand();
  qmat_medial *medial = sealed_medial_mesh((const double[]){0.5, 0.5, 0.5, 0.5}, 1, NULL, 0, NULL, 0);
  static const struct {
    const char *params;
    size_t spheres;
    float first;
    uint32_t ends[6];
  } cases[] = {{"", 4, 0, {2, 3, 1, 2, 0, 1}}, {"levels=3", 3, 0.01F, {1, 2, 0, 1}}, {"levels=1", 1, 0.04F, {0}}};
  for (size_t i = 0; i < 3; i++) {
    qmat_file *file =
        make_page(1, cases[i].params, (const qmat_value *[]){NULL, &mesh->base, &medial->base, NULL, &chain->base});
    json_t *data = data_of(file);
    const json_t *own = json_object_get(mesh_of(data, 0), "chain");
    const size_t left = cases[i].spheres - 1;
    assert_int_equal(json_integer_value(json_object_get(own, "spheres")), cases[i].spheres);
    assert_int_equal(json_integer_value(json_object_get(own, "cones")), left);
    if (left > 0) {
      uint8_t *ends = bytes_of(own, "ends", 4, 0, 8 * left);
      assert_memory_equal(ends, cases[i].ends, 8 * left);
      free(ends);
      float last[4]; /* a ball in the middle of the box, whose diagonal is sqrt(3) */
      uint8_t *merged = bytes_of(own, "merged", 4, 0, 16 * left);
      memcpy(last, merged + 16 * (left - 1), sizeof last);
      assert_near(last[0], 0, 4e-6);
      assert_near(last[3], 0.5 / sqrt(3), 4e-6);
      free(merged);
    }
    float first;
    uint8_t *errors = bytes_of(own, "errors", 4, 1, 4 * (left + 1));
    memcpy(&first, errors, sizeof first);
    assert_near(first, cases[i].first, 0);
    free(errors);
    json_decref(data);
    qmat_value_release(&file->base);
  }
  qmat_value_release(&medial->base);
  qmat_value_release(&chain->base);
  qmat_value_release(&mesh->base);
}

static void test_no_name_leaves_its_place_in_the_page(void **state) {
  (void)state;
  static const char name[] = "</script><script>alert(\"&'\")</script><b>{{js}}";
  qmat_context context = {0};
  qmat_mesh *mesh = shape_seal(shape_box(1, 1, 1));
  qmat_medial *medial = sealed_medial_mesh((const double[]){0.5, 0.5, 0.5, 0.5}, 1, NULL, 0, NULL, 0);
  qmat_scene *scene = qmat_scene_new();
  scene->name = qmat_strdup(name);
  scene->format = qmat_strdup("off");
  assert_int_equal(qmat_value_seal(&context, &scene->base), QMAT_OK);
  qmat_file *file = make_page(1, "", (const qmat_value *[]){&scene->base, &mesh->base, &medial->base, NULL, NULL});
  char *text = text_of(file);
  assert_null(strstr(text, "<script>alert"));
  assert_null(strstr(text, "<b>{{"));
  size_t scripts = 0;
  for (const char *at = text; (at = strstr(at, "</script>")) != NULL; at++) scripts++;
  assert_int_equal(scripts, 2);
  json_t *data = data_of(file);
  assert_string_equal(json_string_value(json_object_get(data, "title")), name);
  assert_string_equal(json_string_value(json_object_get(mesh_of(data, 0), "name")), name);
  /* nothing is fetched: the only addresses are those of data */
  assert_null(strstr(text, "src=\"http"));
  assert_null(strstr(text, "import "));
  json_decref(data);
  free(text);
  qmat_value_release(&file->base);
  qmat_value_release(&scene->base);
  qmat_value_release(&medial->base);
  qmat_value_release(&mesh->base);
  qmat_context_uninit(&context);
}

static void test_a_mesh_that_failed_is_named_with_its_reason(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_mesh *mesh = shape_seal(shape_box(1, 1, 1));
  qmat_medial *medial = sealed_medial_mesh((const double[]){0.5, 0.5, 0.5, 0.5}, 1, NULL, 0, NULL, 0);
  qmat_failure *failure = qmat_failure_new();
  failure->reason = qmat_strdup("it is flat");
  assert_int_equal(qmat_value_seal(&context, &failure->base), QMAT_OK);
  const qmat_value *items[2][2] = {{&mesh->base, &mesh->base}, {&failure->base, &medial->base}};
  qmat_list *lists[2];
  for (size_t i = 0; i < 2; i++) {
    lists[i] = qmat_list_new(2);
    for (size_t k = 0; k < 2; k++) {
      lists[i]->items[k] = qmat_value_retain(items[i][k]);
      lists[i]->names[k] = qmat_strdup(k ? "box" : "leaf");
    }
    assert_int_equal(qmat_value_seal(&context, &lists[i]->base), QMAT_OK);
  }
  qmat_file *file = make_page(1, "", (const qmat_value *[]){NULL, &lists[0]->base, &lists[1]->base, NULL, NULL});
  json_t *data = data_of(file);
  assert_int_equal(json_array_size(json_object_get(data, "meshes")), 2);
  assert_string_equal(json_string_value(json_object_get(mesh_of(data, 0), "failure")), "it is flat");
  assert_string_equal(json_string_value(json_object_get(mesh_of(data, 0), "name")), "leaf");
  assert_int_equal(json_integer_value(json_object_get(mesh_of(data, 1), "spheres")), 1);
  json_decref(data);
  qmat_value_release(&file->base);
  for (size_t i = 0; i < 2; i++) qmat_value_release(&lists[i]->base);
  qmat_value_release(&failure->base);
  qmat_value_release(&medial->base);
  qmat_value_release(&mesh->base);
  qmat_context_uninit(&context);
}

/* Equal meshes of a scene are stored once. */
static void test_equal_meshes_are_shared(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_mesh *box = shape_seal(shape_box(1, 1, 1)), *other = shape_seal(shape_box(1, 1, 2));
  qmat_medial *medial = sealed_medial_mesh((const double[]){0.5, 0.5, 0.5, 0.5}, 1, NULL, 0, NULL, 0);
  const qmat_value *meshes[] = {&other->base, &box->base, &box->base};
  static const char *const names[] = {"tower", "box", "box again"};
  qmat_list *lists[] = {qmat_list_new(3), qmat_list_new(3)};
  for (size_t k = 0; k < 3; k++)
    for (size_t i = 0; i < 2; i++) {
      lists[i]->items[k] = qmat_value_retain(i ? &medial->base : meshes[k]);
      lists[i]->names[k] = qmat_strdup(names[k]);
    }
  for (size_t i = 0; i < 2; i++) assert_int_equal(qmat_value_seal(&context, &lists[i]->base), QMAT_OK);
  qmat_file *file = make_page(1, "", (const qmat_value *[]){NULL, &lists[0]->base, &lists[1]->base, NULL, NULL});
  json_t *data = data_of(file);
  assert_null(json_object_get(mesh_of(data, 0), "same"));
  assert_null(json_object_get(mesh_of(data, 1), "same"));
  assert_int_equal(json_integer_value(json_object_get(mesh_of(data, 2), "same")), 1);
  assert_string_equal(json_string_value(json_object_get(mesh_of(data, 2), "name")), "box again");
  json_decref(data);
  qmat_value_release(&file->base);
  for (size_t i = 0; i < 2; i++) qmat_value_release(&lists[i]->base);
  qmat_value_release(&medial->base);
  qmat_value_release(&box->base);
  qmat_value_release(&other->base);
  qmat_context_uninit(&context);
}

static void test_the_same_bytes_for_any_number_of_threads(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_seal(shape_torus(2, 0.6, 32, 16));
  static const double ring[] = {2, 0, 0, 0.5, -1, 1.7, 0, 0.6, -1, -1.7, 0, 0.7};
  qmat_medial *medial = sealed_medial_mesh(ring, 3, (const uint32_t[]){0, 1, 0, 2, 1, 2}, 3, NULL, 0);
  qmat_chain *chain = chain_by_hand();
  const qmat_value *inputs[] = {NULL, &mesh->base, &medial->base, NULL, &chain->base};
  qmat_file *first = make_page(1, "", inputs);
  for (int threads = 2; threads <= 8; threads *= 4) {
    qmat_file *other = make_page(threads, "", inputs);
    assert_true(qmat_digest_equal(&first->base.digest, &other->base.digest));
    qmat_value_release(&other->base);
  }
  qmat_value_release(&first->base);
  qmat_value_release(&chain->base);
  qmat_value_release(&medial->base);
  qmat_value_release(&mesh->base);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_arrays_come_back),
      cmocka_unit_test(test_the_data_of_a_ball_with_a_spike),
      cmocka_unit_test(test_vertices_on_creases_have_a_normal_for_each_side),
      cmocka_unit_test(test_the_slider_starts_at_the_finest_level_that_is_wanted),
      cmocka_unit_test(test_no_name_leaves_its_place_in_the_page),
      cmocka_unit_test(test_a_mesh_that_failed_is_named_with_its_reason),
      cmocka_unit_test(test_equal_meshes_are_shared),
      cmocka_unit_test(test_the_same_bytes_for_any_number_of_threads),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
