/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <png.h>

#include "nodes/page/look.h"
#include "tests/medial_meshes.h"
#include "tests/nodes/pipeline.h"

enum { SIZE = 65 }; /* odd: one pixel is in the middle */

typedef struct image {
  unsigned width, height;
  uint8_t *pixels; /* red, green, blue, opacity */
} image;

static qmat_file *draw(int threads, const char *params, const qmat_mesh *mesh, const qmat_medial *medial) {
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  pipeline_must_run(threads, "report.picture", params, (const qmat_value *[]){NULL, &mesh->base, &medial->base, NULL},
                    outputs);
  return (qmat_file *)outputs[0];
}

static image decode(const qmat_file *file) {
  png_image png = {.version = PNG_IMAGE_VERSION};
  assert_true(png_image_begin_read_from_memory(&png, file->parts[0].bytes, file->parts[0].size));
  png.format = PNG_FORMAT_RGBA;
  image made = {png.width, png.height, malloc(PNG_IMAGE_SIZE(png))};
  assert_non_null(made.pixels);
  assert_true(png_image_finish_read(&png, NULL, made.pixels, 0, NULL));
  return made;
}

/* The picture of one view from the front, SIZE pixels square. */
static image picture_of(const char *view, const qmat_mesh *mesh, const qmat_medial *medial) {
  char params[128];
  snprintf(params, sizeof params, "view=%s width=%d height=%d turn=0 tilt=0", view, SIZE, SIZE);
  qmat_file *file = draw(1, params, mesh, medial);
  const image made = decode(file);
  assert_int_equal(made.width, SIZE);
  assert_int_equal(made.height, SIZE);
  qmat_value_release(&file->base);
  return made;
}

static const uint8_t *pixel_of(const image *of, unsigned x, unsigned y) {
  return &of->pixels[4 * (y * of->width + x)];
}

/* Whether a pixel has this colour where the surface faces the camera. */
static void check_middle(const image *of, const double colour[3]) {
  double lit[3] = {colour[0], colour[1], colour[2]};
  qmat_look_shade((const double[]){0, 0, 1}, lit);
  const uint8_t *pixel = pixel_of(of, SIZE / 2, SIZE / 2);
  for (int k = 0; k < 3; k++) assert_near(pixel[k], 255 * lit[k], 8);
  assert_int_equal(pixel[3], 255);
}

static qmat_medial *ball(double radius) {
  return sealed_medial_mesh((const double[]){0, 0, 0, radius}, 1, NULL, 0, NULL, 0);
}

static void test_a_sphere_fills_its_share_of_the_picture(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_seal(shape_sphere(1, 24));
  qmat_medial *medial = ball(1);
  image made = picture_of("medial", mesh, medial);
  double orange[3];
  qmat_look_of_kind(QMAT_LOOK_SPHERE, orange);
  check_middle(&made, orange);
  assert_int_equal(pixel_of(&made, 0, 0)[3], 0);
  unsigned filled = 0;
  for (unsigned y = 0; y < SIZE; y++) filled += pixel_of(&made, SIZE / 2, y)[3] > 127;
  assert_near(filled, 0.92 * SIZE, 1.5);
  free(made.pixels);
  qmat_value_release(&medial->base);
  qmat_value_release(&mesh->base);
}

static void test_the_surface_has_the_colour_of_its_signed_error(void **state) {
  (void)state;
  static const struct {
    double radius, error; /* of the medial sphere; the error as a share of the largest */
  } cases[] = {{0.9, 1}, {1.1, -1}};
  qmat_mesh *mesh = shape_seal(shape_sphere(1, 24));
  for (size_t i = 0; i < 2; i++) {
    qmat_medial *medial = ball(cases[i].radius);
    image made = picture_of("surface", mesh, medial);
    double colour[3];
    qmat_look_of_error(cases[i].error, 1, colour);
    check_middle(&made, colour);
    free(made.pixels);
    qmat_value_release(&medial->base);
  }
  qmat_value_release(&mesh->base);
}

static void test_each_kind_of_primitive_has_its_colour(void **state) {
  (void)state;
  static const double spheres[] = {-1, -1, 0, 0.2, 2, -1, 0, 0.2, 0.5, 2.5, 0, 0.2};
  qmat_mesh *mesh = shape_seal(shape_box(1, 1, 1));
  qmat_medial *medials[2] = {sealed_medial_mesh((const double[]){-0.5, 0.5, 0.5, 0.2, 1.5, 0.5, 0.5, 0.2}, 2,
                                                (const uint32_t[]){0, 1}, 1, NULL, 0),
                             sealed_medial_mesh(spheres, 3, NULL, 0, (const uint32_t[]){0, 1, 2}, 1)};
  for (size_t i = 0; i < 2; i++) {
    image made = picture_of("medial", mesh, medials[i]);
    double colour[3];
    qmat_look_of_kind(i == 0 ? QMAT_LOOK_CONE : QMAT_LOOK_SLAB, colour);
    check_middle(&made, colour);
    free(made.pixels);
    qmat_value_release(&medials[i]->base);
  }
  qmat_value_release(&mesh->base);
}

/* The glass is over the medial mesh: what is seen of it is between both colours. */
static void test_an_overlay_shows_the_medial_mesh_through_the_surface(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_seal(shape_sphere(1, 24));
  qmat_medial *medial = ball(0.5);
  image made = picture_of("overlay", mesh, medial);
  double under[3], over[3], mixed[3];
  qmat_look_of_kind(QMAT_LOOK_SPHERE, under);
  qmat_look_of_surface(over);
  qmat_look_shade((const double[]){0, 0, 1}, under);
  qmat_look_shade((const double[]){0, 0, 1}, over);
  for (int k = 0; k < 3; k++) mixed[k] = 0.8 * under[k] + 0.2 * over[k];
  const uint8_t *pixel = pixel_of(&made, SIZE / 2, SIZE / 2);
  for (int k = 0; k < 3; k++) assert_near(pixel[k], 255 * mixed[k], 6);
  free(made.pixels);
  qmat_value_release(&medial->base);
  qmat_value_release(&mesh->base);
}

static void test_the_same_bytes_for_any_number_of_threads(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_seal(shape_torus(2, 0.6, 32, 16));
  static const double ring[] = {2, 0, 0, 0.5, -1, 1.7, 0, 0.6, -1, -1.7, 0, 0.7};
  qmat_medial *medial = sealed_medial_mesh(ring, 3, NULL, 0, (const uint32_t[]){0, 1, 2}, 1);
  static const char *const params[] = {"width=160 height=80", "view=overlay format=svg width=80 height=80"};
  for (size_t i = 0; i < 2; i++) {
    qmat_file *first = draw(1, params[i], mesh, medial);
    for (int threads = 2; threads <= 8; threads *= 4) {
      qmat_file *other = draw(threads, params[i], mesh, medial);
      assert_true(qmat_digest_equal(&first->base.digest, &other->base.digest));
      qmat_value_release(&other->base);
    }
    qmat_value_release(&first->base);
  }
  qmat_value_release(&medial->base);
  qmat_value_release(&mesh->base);
}

static void test_a_flat_surface_and_a_sphere_of_no_radius_make_a_picture(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_new();
  for (int i = 0; i < 3; i++) shape_vertex(mesh, i == 1, i == 2, 0);
  shape_triangle(mesh, 0, 1, 2);
  shape_seal(mesh);
  qmat_medial *medial = ball(0);
  image made = picture_of("medial", mesh, medial);
  for (unsigned i = 0; i < SIZE * SIZE; i++) assert_int_equal(made.pixels[4 * i + 3], 0);
  free(made.pixels);
  made = picture_of("surface", mesh, medial);
  assert_int_equal(pixel_of(&made, SIZE / 2 - 4, SIZE / 2 + 4)[3], 255);
  free(made.pixels);
  qmat_value_release(&medial->base);
  qmat_value_release(&mesh->base);
}

static void test_svg_has_the_pixels_a_caption_and_counts(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_seal(shape_sphere(1, 8));
  qmat_medial *medial = ball(1);
  qmat_scene *scene = qmat_scene_new();
  scene->name = qmat_strdup("a<b & 'c'");
  scene->format = qmat_strdup("off");
  qmat_context context = {0};
  assert_int_equal(qmat_value_seal(&context, &scene->base), QMAT_OK);
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  pipeline_must_run(1, "report.picture", "format=svg width=64 height=64",
                    (const qmat_value *[]){&scene->base, &mesh->base, &medial->base, NULL}, outputs);
  const qmat_file *file = (const qmat_file *)outputs[0];
  char *text = calloc(file->parts[0].size + 1, 1);
  assert_non_null(text);
  memcpy(text, file->parts[0].bytes, file->parts[0].size);
  assert_string_equal(file->format, "svg");
  assert_non_null(strstr(text, "data:image/png;base64,iVBOR"));
  assert_non_null(strstr(text, ">a&lt;b &amp; &#39;c&#39;<"));
  assert_non_null(strstr(text, ">1 sphere<"));
  assert_non_null(strstr(text, ">0 cones<"));
  free(text);
  qmat_value_release(outputs[0]);
  qmat_value_release(&scene->base);
  qmat_value_release(&medial->base);
  qmat_value_release(&mesh->base);
  qmat_context_uninit(&context);
}

static qmat_value *list_of_two(const qmat_value *first, const qmat_value *second) {
  qmat_context context = {0};
  qmat_list *list = qmat_list_new(2);
  assert_non_null(list);
  const qmat_value *items[] = {first, second};
  for (size_t i = 0; i < 2; i++) {
    list->items[i] = qmat_value_retain(items[i]);
    list->names[i] = qmat_strdup("one");
  }
  assert_int_equal(qmat_value_seal(&context, &list->base), QMAT_OK);
  qmat_context_uninit(&context);
  return &list->base;
}

static void test_several_meshes_have_cells_of_their_own(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_seal(shape_sphere(1, 16));
  qmat_medial *medial = ball(1), *none = ball(0);
  qmat_value *meshes = list_of_two(&mesh->base, &mesh->base), *medials = list_of_two(&medial->base, &none->base);
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  pipeline_must_run(1, "report.picture", "view=medial width=128 height=64",
                    (const qmat_value *[]){NULL, meshes, medials, NULL}, outputs);
  image made = decode((const qmat_file *)outputs[0]);
  assert_int_equal(pixel_of(&made, 32, 32)[3], 255);
  assert_int_equal(pixel_of(&made, 96, 32)[3], 0);
  free(made.pixels);
  qmat_value_release(outputs[0]);
  qmat_context context = {0};
  assert_int_equal(
      pipeline_run(&context, "report.picture", "", (const qmat_value *[]){NULL, &mesh->base, medials, NULL}, outputs),
      QMAT_ERROR_USAGE);
  assert_string_equal(context.error.field, "mesh");
  qmat_context_uninit(&context);
  qmat_value_release(meshes);
  qmat_value_release(medials);
  qmat_value_release(&medial->base);
  qmat_value_release(&none->base);
  qmat_value_release(&mesh->base);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_sphere_fills_its_share_of_the_picture),
      cmocka_unit_test(test_the_surface_has_the_colour_of_its_signed_error),
      cmocka_unit_test(test_each_kind_of_primitive_has_its_colour),
      cmocka_unit_test(test_an_overlay_shows_the_medial_mesh_through_the_surface),
      cmocka_unit_test(test_the_same_bytes_for_any_number_of_threads),
      cmocka_unit_test(test_a_flat_surface_and_a_sphere_of_no_radius_make_a_picture),
      cmocka_unit_test(test_svg_has_the_pixels_a_caption_and_counts),
      cmocka_unit_test(test_several_meshes_have_cells_of_their_own),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
