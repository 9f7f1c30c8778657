/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "tests/medial_meshes.h"
#include "tests/nodes/pipeline.h"

/* The mesh is a box with a diagonal of 10: its size is all that counts. */
static qmat_mesh *box_of_ten(void) {
  return shape_seal(shape_box(6, 8, 0));
}

typedef struct burnt {
  qmat_medial *medial;
  qmat_field *thickness;
  qmat_report *report;
} burnt;

static burnt burn(const qmat_mesh *mesh, const qmat_medial *medial, int threads, const char *params) {
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  pipeline_must_run(threads, "medial.erosion_thickness", params, (const qmat_value *[]){&mesh->base, &medial->base},
                    outputs);
  return (burnt){(qmat_medial *)outputs[0], (qmat_field *)outputs[1], (qmat_report *)outputs[2]};
}

static void free_burnt(burnt *b) {
  qmat_value_release(&b->medial->base);
  qmat_value_release(&b->thickness->base);
  qmat_value_release(&b->report->base);
}

/* Triangles of a grid of nx by ny spheres that starts at sphere `first`; returns how many. */
static size_t grid(uint32_t first, uint32_t nx, uint32_t ny, uint32_t *triangles) {
  size_t count = 0;
  for (uint32_t y = 0; y + 1 < ny; y++) {
    for (uint32_t x = 0; x + 1 < nx; x++) {
      const uint32_t a = first + y * nx + x, b = a + 1, c = a + nx, d = c + 1;
      const uint32_t two[6] = {a, b, d, a, d, c};
      memcpy(&triangles[3 * count], two, sizeof two);
      count += 2;
    }
  }
  return count;
}

/* --- by hand ----------------------------------------------------------------------------------------------------- */

/* A sheet of 8 by 4 of constant radius: the thickness is the distance to its border. */
static void test_thickness_of_a_rectangle_is_the_distance_to_its_border(void **state) {
  (void)state;
  enum { NX = 33, NY = 17 };
  static uint32_t triangles[6 * NX * NY];
  qmat_mesh *mesh = box_of_ten();
  double spheres[4 * NX * NY] = {0};
  for (uint32_t i = 0; i < NX * NY; i++) {
    const double sphere[4] = {i % NX * 0.25, i / NX * 0.25, 0, 0.3};
    memcpy(&spheres[4 * i], sphere, sizeof sphere);
  }
  qmat_medial *m = sealed_medial_mesh(spheres, NX * NY, NULL, 0, triangles, grid(0, NX, NY, triangles));
  burnt b = burn(mesh, m, 0, "");
  assert_int_equal(b.thickness->count, NX * NY);
  for (uint32_t i = 0; i < NX * NY; i++) {
    const double *s = &m->spheres[4 * i];
    const double expected = fmin(fmin(s[0], 8 - s[0]), fmin(s[1], 4 - s[1]));
    assert_near(b.thickness->values[i], expected, 1e-9);
  }
  assert_near(pipeline_number(b.report, "largest"), 0.2, 1e-9);
  assert_int_equal(pipeline_count(b.report, "spheres_that_never_burn"), 0);
  assert_memory_equal(&b.medial->base.digest, &m->base.digest, sizeof(qmat_digest)); /* nothing is pruned */
  free_burnt(&b);
  /* What has a corner at 1 or farther inside stays: 0.75 .. 7.25 by 0.75 .. 3.25. */
  b = burn(mesh, m, 0, "prune=9.9%");
  double low = INFINITY, high = 0;
  for (size_t i = 0; i < b.medial->sphere_count; i++) {
    low = fmin(low, b.medial->spheres[4 * i]);
    high = fmax(high, b.medial->spheres[4 * i]);
  }
  assert_near(low, 0.75, 1e-12);
  assert_near(high, 7.25, 1e-12);
  assert_int_equal(pipeline_euler(b.medial), 1);
  free_burnt(&b);
  qmat_value_release(&m->base);
  qmat_value_release(&mesh->base);
}

/* The fires of a regular hexagon's sides reach its centre at their distance, which no edge has. */
static void test_front_is_straight_within_a_triangle(void **state) {
  (void)state;
  qmat_mesh *mesh = box_of_ten();
  double spheres[4 * 7] = {0};
  uint32_t triangles[18];
  for (uint32_t i = 0; i < 6; i++) {
    spheres[4 * i] = cos(acos(-1) / 3 * i);
    spheres[4 * i + 1] = sin(acos(-1) / 3 * i);
    const uint32_t triangle[3] = {i, (i + 1) % 6, 6};
    memcpy(&triangles[3 * i], triangle, sizeof triangle);
  }
  for (uint32_t i = 0; i < 7; i++) spheres[4 * i + 3] = 0.2;
  qmat_medial *m = sealed_medial_mesh(spheres, 7, NULL, 0, triangles, 6);
  burnt b = burn(mesh, m, 0, "");
  for (int i = 0; i < 6; i++) assert_near(b.thickness->values[i], 0, 1e-12);
  assert_near(b.thickness->values[6], sqrt(0.75), 1e-12);
  free_burnt(&b);
  qmat_value_release(&m->base);
  qmat_value_release(&mesh->base);
}

/* The ends burn at their radius, the middle of a curve when both fires meet. */
static void test_curve_burns_from_its_ends(void **state) {
  (void)state;
  qmat_mesh *mesh = box_of_ten();
  double spheres[4 * 6] = {0};
  for (int i = 0; i < 5; i++) {
    spheres[4 * i] = i;
    spheres[4 * i + 3] = i == 0 ? 0.5 : 1;
  }
  spheres[4 * 5 + 1] = 9; /* a sphere alone */
  spheres[4 * 5 + 3] = 2;
  qmat_medial *m = sealed_medial_mesh(spheres, 6, (const uint32_t[]){0, 1, 1, 2, 2, 3, 3, 4}, 4, NULL, 0);
  burnt b = burn(mesh, m, 0, "");
  const double expected[6] = {0, 0.5, 1.5, 1, 0, 0};
  for (int i = 0; i < 6; i++) assert_near(b.thickness->values[i], expected[i], 1e-12);
  free_burnt(&b);
  b = burn(mesh, m, 0, "prune=12%"); /* the edges at the ends have 0.5 and 1, the others 1.5 */
  assert_int_equal(b.medial->sphere_count, 4);
  assert_int_equal(b.medial->edge_count, 2);
  free_burnt(&b);
  qmat_value_release(&m->base);
  qmat_value_release(&mesh->base);
}

/* A fin of height 1 or 3 on the middle line of a sheet of width 4. A low fin burns down first and the seam burns when
 * the sheet does; a high one is burnt from the seam, too. */
static void test_fire_waits_at_a_seam_until_one_sheet_is_left(void **state) {
  (void)state;
  enum { N = 41, ACROSS = 9, SPHERES = N * (ACROSS + 12) };
  for (int high = 0; high < 2; high++) {
    const uint32_t up = high ? 12 : 4;
    static uint32_t triangles[6 * SPHERES];
    qmat_mesh *mesh = box_of_ten();
    double spheres[4 * N * (ACROSS + 12)] = {0};
    size_t count = 0;
    for (uint32_t i = 0; i < N * ACROSS; i++) {
      const double sphere[4] = {i % N * 0.5, i / N * 0.5 - 2, 0, 0.1};
      memcpy(&spheres[4 * i], sphere, sizeof sphere);
    }
    for (uint32_t i = 0; i < N * up; i++) {
      const double sphere[4] = {i % N * 0.5, 0, (i / N + 1) * 0.25, 0.1};
      memcpy(&spheres[4 * (N * ACROSS + i)], sphere, sizeof sphere);
    }
    count = grid(0, N, ACROSS, triangles);
    count += grid(N * ACROSS, N, up, &triangles[3 * count]);
    for (uint32_t x = 0; x + 1 < N; x++) { /* the foot */
      const uint32_t a = N * (ACROSS / 2) + x, c = N * ACROSS + x;
      const uint32_t two[6] = {a, a + 1, c + 1, a, c + 1, c};
      memcpy(&triangles[3 * count], two, sizeof two);
      count += 2;
    }
    qmat_medial *m = sealed_medial_mesh(spheres, N * (ACROSS + up), NULL, 0, triangles, count);
    burnt b = burn(mesh, m, 0, "");
    const uint32_t middle = N / 2;
    assert_near(b.thickness->values[N * (ACROSS / 2) + middle], 2, 1e-9); /* the seam */
    assert_near(b.thickness->values[N * (ACROSS / 2 - 2) + middle], 1, 1e-9);
    for (uint32_t z = 0; z < up; z++) {
      const double height = (z + 1) * 0.25;
      const double expected = fmin(up * 0.25 - height, 2 + height);
      assert_near(b.thickness->values[N * (ACROSS + z) + middle], expected, 1e-9);
    }
    free_burnt(&b);
    if (!high) { /* the fin goes down to its foot, the sheet stays around it */
      b = burn(mesh, m, 0, "prune=12%");
      double top = 0;
      for (size_t i = 0; i < b.medial->sphere_count; i++) top = fmax(top, b.medial->spheres[4 * i + 2]);
      assert_near(top, 0, 0);
      assert_true(b.medial->sphere_count > N);
      assert_int_equal(pipeline_euler(b.medial), 1);
      free_burnt(&b);
    }
    qmat_value_release(&m->base);
    qmat_value_release(&mesh->base);
  }
}

static void test_closed_pocket_and_loop_never_burn(void **state) {
  (void)state;
  qmat_mesh *mesh = box_of_ten();
  double spheres[4 * 8] = {0};
  for (int i = 0; i < 8; i++) {
    spheres[4 * i] = i % 2;
    spheres[4 * i + 1] = i / 2 % 2;
    spheres[4 * i + 2] = i / 4;
    spheres[4 * i + 3] = 0.1;
  }
  /* A tetrahedron's surface, a ring of three, and a tail on the pocket. */
  qmat_medial *m = sealed_medial_mesh(spheres, 8, (const uint32_t[]){4, 5, 5, 6, 4, 6, 0, 7}, 4,
                                      (const uint32_t[]){0, 1, 2, 0, 1, 3, 0, 2, 3, 1, 2, 3}, 4);
  burnt b = burn(mesh, m, 0, "");
  assert_int_equal(pipeline_count(b.report, "spheres_that_never_burn"), 7);
  for (int i = 0; i < 7; i++) assert_near(b.thickness->values[i], 10, 1e-12);
  assert_near(b.thickness->values[7], 0, 1e-12);
  free_burnt(&b);
  b = burn(mesh, m, 0, "prune=100%");
  assert_int_equal(b.medial->sphere_count, 7); /* only the tail went */
  assert_int_equal(b.medial->triangle_count, 4);
  free_burnt(&b);
  qmat_value_release(&m->base);
  qmat_value_release(&mesh->base);
}

/* The medial mesh of a box, exactly: twelve sheets, each between an edge of the box, where the radius is 0, and the
 * rectangle in the middle. */
typedef struct box_sheets {
  double sizes[3]; /* the last is the smallest and has 2 steps at least */
  double step;
  double spheres[4 * 2048];
  uint32_t triangles[3 * 4096];
  size_t sphere_count, triangle_count;
} box_sheets;

static uint32_t box_sphere(box_sheets *box, const double at[3]) {
  double radius = INFINITY;
  for (int k = 0; k < 3; k++) radius = fmin(radius, fmin(at[k], box->sizes[k] - at[k]));
  for (size_t i = 0; i < box->sphere_count; i++)
    if (memcmp(&box->spheres[4 * i], at, 3 * sizeof *at) == 0) return (uint32_t)i;
  assert_true(box->sphere_count < 2048);
  memcpy(&box->spheres[4 * box->sphere_count], at, 3 * sizeof *at);
  box->spheres[4 * box->sphere_count + 3] = radius;
  return (uint32_t)box->sphere_count++;
}

static void box_triangle(box_sheets *box, uint32_t a, uint32_t b, uint32_t c) {
  assert_true(box->triangle_count < 4096);
  memcpy(&box->triangles[3 * box->triangle_count++], (const uint32_t[3]){a, b, c}, 3 * sizeof(uint32_t));
}

/* Sphere `i` of the row at `depth` from an edge along `axis`; the bits of `sides` choose one of the four edges. */
static uint32_t row_sphere(box_sheets *box, int axis, int sides, double depth, size_t i) {
  double at[3];
  at[axis] = depth + (double)i * box->step;
  for (int k = 1; k < 3; k++) {
    const int other = (axis + k) % 3;
    at[other] = sides & k ? box->sizes[other] - depth : depth;
  }
  return box_sphere(box, at);
}

static void add_box_sheet(box_sheets *box, int axis, int sides) {
  const double h = box->step;
  for (double depth = 0; depth < box->sizes[2] / 2; depth += h) {
    const size_t count = (size_t)lround((box->sizes[axis] - 2 * depth) / h); /* intervals of the outer row */
    for (size_t i = 0; i < count; i++) { /* the inner row starts above sphere 1 and ends above sphere count - 1 */
      const uint32_t a = row_sphere(box, axis, sides, depth, i), b = row_sphere(box, axis, sides, depth, i + 1);
      if (i + 1 < count) box_triangle(box, a, b, row_sphere(box, axis, sides, depth + h, i));
      if (i > 0)
        box_triangle(box, a, i + 1 < count ? row_sphere(box, axis, sides, depth + h, i) : b,
                     row_sphere(box, axis, sides, depth + h, i - 1));
    }
  }
}

static void add_box_middle(box_sheets *box) {
  const double h = box->step, low = box->sizes[2] / 2;
  for (double x = low; x < box->sizes[0] - low; x += h) {
    for (double y = low; y < box->sizes[1] - low; y += h) {
      uint32_t corners[4];
      for (int k = 0; k < 4; k++)
        corners[k] = box_sphere(box, (const double[3]){x + (k & 1) * h, y + (k >> 1) * h, low});
      box_triangle(box, corners[0], corners[1], corners[3]);
      box_triangle(box, corners[0], corners[3], corners[2]);
    }
  }
}

/* A sheet at an edge has its sphere of radius r at sqrt(2) r from the edge. Two of them reach the middle at once, and
 * the fire goes on there. */
static void test_thickness_of_a_box_is_that_of_its_edges_and_then_the_distance_to_the_seam(void **state) {
  (void)state;
  static box_sheets box = {.sizes = {6, 4, 2}, .step = 0.5};
  for (int axis = 0; axis < 3; axis++)
    for (int sides = 0; sides < 4; sides++) add_box_sheet(&box, axis, sides);
  add_box_middle(&box);
  qmat_mesh *mesh = shape_seal(shape_box(6, 4, 2));
  qmat_medial *m = sealed_medial_mesh(box.spheres, box.sphere_count, NULL, 0, box.triangles, box.triangle_count);
  assert_int_equal(pipeline_euler(m), 1);
  burnt b = burn(mesh, m, 0, "");
  size_t middle = 0;
  for (size_t i = 0; i < m->sphere_count; i++) {
    const double *s = &m->spheres[4 * i];
    const double from_seam = s[3] < 1 ? 0 : fmin(fmin(s[0] - 1, 5 - s[0]), fmin(s[1] - 1, 3 - s[1]));
    assert_near(b.thickness->values[i], (sqrt(2) - 1) * s[3] + from_seam, 1e-9);
    middle += s[3] == 1;
  }
  assert_int_equal(middle, 9 * 5);
  free_burnt(&b);
  b = burn(mesh, m, 0, "prune=6%"); /* the sheets at the edges have 5.5 % of the diagonal at most */
  /* At two corners of the rectangle a triangle has all its corners on the seam. */
  assert_int_equal(b.medial->sphere_count, middle - 2);
  assert_int_equal(b.medial->triangle_count, 2 * 8 * 4 - 2);
  for (size_t i = 0; i < b.medial->sphere_count; i++) assert_near(b.medial->spheres[4 * i + 3], 1, 0);
  free_burnt(&b);
  qmat_value_release(&m->base);
  qmat_value_release(&mesh->base);
}

/* A sphere's medial mesh is its centre: a border of its own, and all that there is. */
static void test_sphere_burns_at_once_and_stays(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_seal(shape_sphere(2, 8));
  qmat_medial *m = sealed_medial_mesh((const double[]){0, 0, 0, 2}, 1, NULL, 0, NULL, 0);
  burnt b = burn(mesh, m, 0, "prune=100%");
  assert_near(b.thickness->values[0], 0, 1e-12);
  assert_int_equal(b.medial->sphere_count, 1);
  free_burnt(&b);
  qmat_value_release(&m->base);
  qmat_value_release(&mesh->base);
}

/* The core circle of a torus never burns. A spike from it into the tube does, at once: its tip is a sphere that touches
 * the surface from within. */
static void test_torus_keeps_its_core_circle_and_loses_a_spike(void **state) {
  (void)state;
  enum { RING = 24 };
  double spheres[4 * (RING + 1)];
  uint32_t edges[2 * (RING + 1)];
  for (uint32_t i = 0; i < RING; i++) {
    const double angle = 2 * acos(-1) * i / RING, sphere[4] = {3 * cos(angle), 3 * sin(angle), 0, 1};
    memcpy(&spheres[4 * i], sphere, sizeof sphere);
    edges[2 * i] = i;
    edges[2 * i + 1] = (i + 1) % RING;
  }
  memcpy(&spheres[4 * RING], (const double[4]){3.5, 0, 0, 0.5}, 4 * sizeof(double));
  memcpy(&edges[2 * RING], (const uint32_t[2]){0, RING}, 2 * sizeof(uint32_t));
  qmat_mesh *mesh = shape_seal(pipeline_model("torus", 8));
  qmat_medial *m = sealed_medial_mesh(spheres, RING + 1, edges, RING + 1, NULL, 0);
  burnt b = burn(mesh, m, 0, "prune=1%");
  assert_int_equal(pipeline_count(b.report, "spheres_that_never_burn"), RING);
  assert_near(b.thickness->values[RING], 0, 1e-12);
  assert_int_equal(b.medial->sphere_count, RING);
  assert_int_equal(b.medial->edge_count, RING);
  free_burnt(&b);
  qmat_value_release(&m->base);
  qmat_value_release(&mesh->base);
}

/* --- models ------------------------------------------------------------------------------------------------------ */

/* Spikes of the initial medial mesh go, its topology stays, and what is left has its samples. */
static void test_pruning_keeps_topology_and_regions(void **state) {
  (void)state;
  static const char *const params[] = {"prune=0.1%", "prune=0.5%", "prune=3%"};
  pipeline p;
  pipeline_make(&p, pipeline_model("torus", 16), "spacing=4%", "");
  size_t before = p.medial->sphere_count;
  for (int i = 0; i < 3; i++) {
    burnt b = burn(p.mesh, p.medial, 0, params[i]);
    assert_int_equal(pipeline_euler(b.medial), pipeline_euler(p.medial));
    assert_int_equal(pipeline_components(b.medial), pipeline_components(p.medial));
    assert_true(b.medial->sphere_count < before);
    before = b.medial->sphere_count;
    assert_int_equal(b.medial->region_offset_count, b.medial->sphere_count + 1);
    for (size_t k = 0, old = 0; k < b.medial->sphere_count; k++) { /* the order is kept */
      while (memcmp(&p.medial->spheres[4 * old], &b.medial->spheres[4 * k], 4 * sizeof(double)) != 0) old++;
      assert_true(old < p.medial->sphere_count);
      const uint32_t length = b.medial->region_offsets[k + 1] - b.medial->region_offsets[k];
      assert_int_equal(length, p.medial->region_offsets[old + 1] - p.medial->region_offsets[old]);
      assert_memory_equal(&b.medial->region_samples[b.medial->region_offsets[k]],
                          &p.medial->region_samples[p.medial->region_offsets[old]], length * sizeof(uint32_t));
      old++;
    }
    free_burnt(&b);
  }
  pipeline_free(&p);
}

static void test_threads_do_not_change_a_byte(void **state) {
  (void)state;
  static const int threads[] = {1, 2, 8};
  pipeline p;
  pipeline_make(&p, pipeline_model("octopus", 8), "spacing=4%", "");
  qmat_digest first[2] = {{{0}}, {{0}}};
  for (int i = 0; i < 3; i++) {
    burnt b = burn(p.mesh, p.medial, threads[i], "prune=1%");
    if (i == 0) first[0] = b.medial->base.digest, first[1] = b.thickness->base.digest;
    assert_memory_equal(&b.medial->base.digest, &first[0], sizeof *first);
    assert_memory_equal(&b.thickness->base.digest, &first[1], sizeof *first);
    free_burnt(&b);
  }
  pipeline_free(&p);
}

static void test_sheets_of_the_model_stay(void **state) {
  (void)state;
  qmat_mesh *mesh = box_of_ten();
  double spheres[4 * 6] = {0};
  for (int i = 0; i < 6; i++) spheres[4 * i] = i % 2, spheres[4 * i + 1] = i / 2;
  qmat_medial *m = medial_mesh(spheres, 6, (const uint32_t[]){4, 5}, 1, (const uint32_t[]){0, 1, 2, 1, 2, 3}, 2);
  m->sheet_sphere_count = 4;
  qmat_context context = {0};
  assert_int_equal(qmat_value_seal(&context, &m->base), QMAT_OK);
  qmat_context_uninit(&context);
  burnt b = burn(mesh, m, 0, "prune=100%");
  assert_int_equal(b.medial->triangle_count, 2);
  assert_int_equal(b.medial->sheet_sphere_count, 4);
  assert_int_equal(b.medial->sphere_count, 5);
  assert_int_equal(b.medial->edge_count, 5);
  free_burnt(&b);
  qmat_value_release(&m->base);
  qmat_value_release(&mesh->base);
}

static void test_progress_function_cancels(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, pipeline_model("torus", 8), "spacing=0", "");
  pipeline_must_be_cancelled("medial.erosion_thickness", "", (const qmat_value *[]){&p.mesh->base, &p.medial->base});
  pipeline_free(&p);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_thickness_of_a_rectangle_is_the_distance_to_its_border),
      cmocka_unit_test(test_front_is_straight_within_a_triangle),
      cmocka_unit_test(test_curve_burns_from_its_ends),
      cmocka_unit_test(test_fire_waits_at_a_seam_until_one_sheet_is_left),
      cmocka_unit_test(test_closed_pocket_and_loop_never_burn),
      cmocka_unit_test(test_thickness_of_a_box_is_that_of_its_edges_and_then_the_distance_to_the_seam),
      cmocka_unit_test(test_sphere_burns_at_once_and_stays),
      cmocka_unit_test(test_torus_keeps_its_core_circle_and_loses_a_spike),
      cmocka_unit_test(test_pruning_keeps_topology_and_regions),
      cmocka_unit_test(test_threads_do_not_change_a_byte),
      cmocka_unit_test(test_sheets_of_the_model_stay),
      cmocka_unit_test(test_progress_function_cancels),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
