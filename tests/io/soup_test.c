/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/triangle.h"
#include "tests/io/files.h"

/* Facets are lists of vertex numbers, each ended by -1. */
static qmat_soup make_soup(const double *positions, size_t vertices, const int *facets, size_t facet_count) {
  qmat_context context = {0};
  qmat_soup soup = {0};
  assert_int_equal(qmat_soup_add_vertices(&context, &soup, positions, vertices), QMAT_OK);
  for (size_t f = 0; f < facet_count; f++) {
    uint32_t corners[16];
    size_t count = 0;
    while (*facets >= 0) corners[count++] = (uint32_t)*facets++;
    facets++;
    assert_int_equal(qmat_soup_add_facet(&context, &soup, corners, count, (uint32_t)f, (int)f + 10), QMAT_OK);
  }
  return soup;
}

/* Makes a mesh of the soup, which is freed. */
static qmat_mesh *convert(qmat_soup soup, qmat_defects defects, json_t **report) {
  qmat_context context = {0};
  const qmat_read_options options = {.defects = defects};
  qmat_mesh *mesh = NULL;
  *report = json_object();
  if (qmat_soup_to_mesh(&context, &soup, "file", &options, &mesh, *report) != QMAT_OK) {
    fail_msg("%s", context.error.message);
  }
  assert_true(mesh->base.sealed);
  assert_int_equal(json_integer_value(json_object_get(*report, "triangles")), mesh->triangle_count);
  assert_int_equal(json_integer_value(json_object_get(*report, "vertices")), mesh->vertex_count);
  assert_true(json_is_true(json_object_get(*report, "closed")) == mesh->closed);
  assert_true(json_is_true(json_object_get(*report, "oriented")) == mesh->oriented);
  qmat_soup_uninit(&soup);
  qmat_context_uninit(&context);
  return mesh;
}

static void assert_count(const json_t *report, const char *key, json_int_t expected) {
  const json_t *number = json_object_get(report, key);
  if (!json_is_integer(number) || json_integer_value(number) != expected) {
    fail_msg("%s is %lld, not %lld", key, (long long)json_integer_value(number), (long long)expected);
  }
}

static void done(qmat_mesh *mesh, json_t *report) {
  qmat_value_release(&mesh->base);
  json_decref(report);
}

static void assert_soup_refused(qmat_soup soup, qmat_defects defects, qmat_status status, const char *expected) {
  qmat_context context = {0};
  const qmat_read_options options = {.defects = defects};
  qmat_mesh *mesh = (qmat_mesh *)&soup;
  char text[1024];
  assert_int_equal(qmat_soup_to_mesh(&context, &soup, "file", &options, &mesh, NULL), status);
  assert_null(mesh);
  qmat_error_format(&context.error, text, sizeof text);
  assert_string_equal(text, expected);
  qmat_soup_uninit(&soup);
  qmat_context_uninit(&context);
}

static const double cube[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1};
static const int cube_facets[] = {0, 3, 2, 1, -1, 4, 5, 6, 7, -1, 0, 1, 5, 4, -1,
                                  1, 2, 6, 5, -1, 2, 3, 7, 6, -1, 3, 0, 4, 7, -1};

static double volume(const qmat_mesh *mesh) {
  double sum = 0;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const double *a = mesh->positions + 3 * mesh->triangles[3 * t],
                 *b = mesh->positions + 3 * mesh->triangles[3 * t + 1],
                 *c = mesh->positions + 3 * mesh->triangles[3 * t + 2];
    sum += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  return sum / 6;
}

static void test_a_cube_of_squares_becomes_twelve_outward_triangles(void **state) {
  (void)state;
  json_t *report;
  qmat_mesh *mesh = convert(make_soup(cube, 8, cube_facets, 6), QMAT_DEFECTS_REFUSE, &report);
  assert_int_equal(mesh->vertex_count, 8);
  assert_int_equal(mesh->triangle_count, 12);
  assert_true(mesh->closed && mesh->oriented);
  assert_true(fabs(volume(mesh) - 1) < 1e-15);
  assert_positions(mesh->positions, cube, 24);
  assert_count(report, "vertices_read", 8);
  assert_count(report, "facets_read", 6);
  assert_count(report, "polygons_triangulated", 6);
  assert_count(report, "components", 1);
  assert_count(report, "euler_characteristic", 2);
  assert_count(report, "border_edges", 0);
  assert_count(report, "flipped", 0);
  done(mesh, report);
}

static void test_an_inside_out_cube_is_turned_over(void **state) {
  (void)state;
  int facets[30];
  for (int f = 0; f < 6; f++) {
    for (int k = 0; k < 4; k++) facets[5 * f + k] = cube_facets[5 * f + 3 - k];
    facets[5 * f + 4] = -1;
  }
  json_t *report;
  qmat_mesh *mesh = convert(make_soup(cube, 8, facets, 6), QMAT_DEFECTS_REFUSE, &report);
  assert_true(fabs(volume(mesh) - 1) < 1e-15);
  assert_count(report, "flipped", 12);
  assert_count(report, "inward_components", 0);
  done(mesh, report);
}

static void test_facets_that_disagree_are_made_to_face_outward(void **state) {
  (void)state;
  for (unsigned turned = 1; turned < 63; turned++) {
    int facets[30], count = 0;
    for (int f = 0; f < 6; f++) {
      const bool turn = turned >> f & 1;
      count += turn;
      for (int k = 0; k < 4; k++) facets[5 * f + k] = cube_facets[5 * f + (turn ? 3 - k : k)];
      facets[5 * f + 4] = -1;
    }
    json_t *report;
    qmat_mesh *mesh = convert(make_soup(cube, 8, facets, 6), QMAT_DEFECTS_REFUSE, &report);
    assert_true(mesh->oriented);
    assert_true(fabs(volume(mesh) - 1) < 1e-15);
    assert_count(report, "flipped", 2 * count);
    done(mesh, report);
  }
}

/* Two cubes, the second scaled and moved, with or without its facets turned over. */
static qmat_soup two_cubes(double scale, double shift, bool turn) {
  double positions[48];
  int facets[60];
  for (int i = 0; i < 24; i++) {
    positions[i] = cube[i];
    positions[24 + i] = cube[i] * scale + shift;
  }
  for (int f = 0; f < 12; f++) {
    for (int k = 0; k < 4; k++) {
      facets[5 * f + k] = cube_facets[5 * (f % 6) + (f >= 6 && turn ? 3 - k : k)] + (f >= 6 ? 8 : 0);
    }
    facets[5 * f + 4] = -1;
  }
  return make_soup(positions, 16, facets, 12);
}

static void test_a_cavity_keeps_facing_into_the_hole(void **state) {
  (void)state;
  json_t *report;
  qmat_mesh *mesh = convert(two_cubes(0.5, 0.25, true), QMAT_DEFECTS_REFUSE, &report);
  assert_true(fabs(volume(mesh) - 0.875) < 1e-15);
  assert_count(report, "components", 2);
  assert_count(report, "inward_components", 1);
  assert_count(report, "flipped", 0);
  assert_count(report, "euler_characteristic", 4);
  done(mesh, report);
}

static void test_cubes_that_share_an_edge_after_welding_are_closed_and_not_manifold(void **state) {
  (void)state;
  /* Shifted along x and y: the edge from (1,1,0) to (1,1,1) is common. */
  double positions[48];
  int facets[60];
  for (int i = 0; i < 24; i++) {
    positions[i] = cube[i];
    positions[24 + i] = cube[i] + (i % 3 < 2 ? 1 : 0);
  }
  for (int f = 0; f < 12; f++) {
    for (int k = 0; k < 4; k++) facets[5 * f + k] = cube_facets[5 * (f % 6) + k] + (f >= 6 ? 8 : 0);
    facets[5 * f + 4] = -1;
  }
  json_t *report;
  qmat_mesh *mesh = convert(make_soup(positions, 16, facets, 12), QMAT_DEFECTS_REFUSE, &report);
  assert_true(mesh->closed && mesh->oriented);
  assert_int_equal(mesh->vertex_count, 14);
  assert_count(report, "vertices_welded", 2);
  assert_count(report, "nonmanifold_edges", 1);
  assert_count(report, "components", 1);
  done(mesh, report);
}

static void test_an_open_box_has_border_edges(void **state) {
  (void)state;
  json_t *report;
  qmat_mesh *mesh = convert(make_soup(cube, 8, cube_facets, 5), QMAT_DEFECTS_REFUSE, &report);
  assert_false(mesh->closed);
  assert_true(mesh->oriented);
  assert_count(report, "border_edges", 4);
  assert_count(report, "euler_characteristic", 1);
  done(mesh, report);
}

static void test_an_open_box_that_disagrees_is_made_to_face_outward(void **state) {
  (void)state;
  int facets[25];
  memcpy(facets, cube_facets, sizeof facets);
  for (int k = 0; k < 4; k++) facets[k] = cube_facets[3 - k];
  json_t *report;
  qmat_mesh *mesh = convert(make_soup(cube, 8, facets, 5), QMAT_DEFECTS_REFUSE, &report);
  assert_true(mesh->oriented);
  assert_count(report, "flipped", 2);
  done(mesh, report);
}

static void test_a_moebius_strip_is_left_as_it_is(void **state) {
  (void)state;
  enum { STEPS = 7 };
  double positions[6 * STEPS];
  int facets[5 * STEPS];
  for (int i = 0; i < STEPS; i++) {
    const double angle = 2 * 3.141592653589793 * i / STEPS;
    for (int side = 0; side < 2; side++) {
      const double offset = side ? 0.3 : -0.3, radius = 1 + offset * cos(angle / 2);
      double *p = positions + 3 * (2 * i + side);
      p[0] = radius * cos(angle);
      p[1] = radius * sin(angle);
      p[2] = offset * sin(angle / 2);
    }
    const int next = (i + 1) % STEPS, cross = i + 1 == STEPS;
    const int quad[5] = {2 * i, 2 * i + 1, 2 * next + !cross, 2 * next + cross, -1};
    memcpy(facets + 5 * i, quad, sizeof quad);
  }
  json_t *report;
  qmat_mesh *mesh = convert(make_soup(positions, 2 * STEPS, facets, STEPS), QMAT_DEFECTS_REFUSE, &report);
  assert_false(mesh->oriented);
  assert_false(mesh->closed);
  assert_count(report, "flipped", 0);
  assert_count(report, "euler_characteristic", 0);
  assert_count(report, "border_edges", 2 * STEPS);
  done(mesh, report);
}

static void test_vertices_at_one_place_become_the_first_of_them(void **state) {
  (void)state;
  const double positions[] = {9, 9, 9, 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, -0.0, 0, -0.0, 1, -0.0, 1, 1, 0};
  const int facets[] = {1, 2, 3, -1, 4, 6, 5, -1};
  json_t *report;
  qmat_mesh *mesh = convert(make_soup(positions, 7, facets, 2), QMAT_DEFECTS_REFUSE, &report);
  const double expected[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
  const uint32_t triangles[] = {0, 1, 2, 1, 3, 2};
  assert_int_equal(mesh->vertex_count, 4);
  assert_positions(mesh->positions, expected, 12);
  assert_memory_equal(mesh->triangles, triangles, sizeof triangles);
  assert_count(report, "vertices_welded", 2);
  assert_count(report, "vertices_unreferenced", 1);
  assert_count(report, "border_edges", 4);
  done(mesh, report);
}

static void test_what_welding_collapses_repeats_or_turns_back_to_back_is_counted(void **state) {
  (void)state;
  const double positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0};
  const int facets[] = {0, 1, 2, -1, 0, 1, 4, -1, 4, 5, 3, -1, 3, 5, 4, -1};
  /* The third says the first again; the fourth, with the same vertices as the third, must not be a repeat in the file.
   */
  const int changed[] = {0, 1, 2, -1, 0, 1, 4, -1, 4, 5, 3, -1, 0, 5, 4, -1};
  json_t *report;
  assert_soup_refused(make_soup(positions, 6, facets, 4), QMAT_DEFECTS_REFUSE, QMAT_ERROR_GEOMETRY,
                      "file:13: facet 3: the facet repeats facet 2 (set 'defects: drop' "
                      "to drop such facets; qmat mat: --set model.defects=drop)");
  qmat_mesh *mesh = convert(make_soup(positions, 6, changed, 4), QMAT_DEFECTS_REFUSE, &report);
  assert_int_equal(mesh->vertex_count, 3);
  assert_int_equal(mesh->triangle_count, 2);
  assert_count(report, "facets_collapsed_by_welding", 1);
  assert_count(report, "triangles_repeated_by_welding", 1);
  assert_count(report, "opposite_facets", 1);
  assert_true(mesh->closed);
  done(mesh, report);
}

static void test_defects_are_refused_with_facet_and_line_or_dropped_and_counted(void **state) {
  (void)state;
  const int twice[] = {0, 3, 2, 1, -1, 4, 5, 4, -1, 4, 5, 6, 7, -1};
  assert_soup_refused(make_soup(cube, 8, twice, 3), QMAT_DEFECTS_REFUSE, QMAT_ERROR_GEOMETRY,
                      "file:11: facet 1: the facet uses vertex 4 twice (counted from 0) (set 'defects: drop' "
                      "to drop such facets; qmat mat: --set model.defects=drop)");
  const int repeated[] = {0, 3, 2, 1, -1, 4, 5, 6, 7, -1, 1, 2, 0, 3, -1, 0, 3, 2, -1};
  assert_soup_refused(make_soup(cube, 8, repeated, 4), QMAT_DEFECTS_REFUSE, QMAT_ERROR_GEOMETRY,
                      "file:12: facet 2: the facet repeats facet 0 (set 'defects: drop' "
                      "to drop such facets; qmat mat: --set model.defects=drop)");
  json_t *report;
  qmat_mesh *mesh = convert(make_soup(cube, 8, twice, 3), QMAT_DEFECTS_DROP, &report);
  assert_int_equal(mesh->triangle_count, 4);
  assert_count(report, "facets_dropped_as_defects", 1);
  done(mesh, report);
  mesh = convert(make_soup(cube, 8, repeated, 3), QMAT_DEFECTS_DROP, &report);
  assert_int_equal(mesh->triangle_count, 4);
  assert_count(report, "facets_dropped_as_defects", 1);
  done(mesh, report);
  assert_soup_refused(make_soup(cube, 8, twice + 5, 1), QMAT_DEFECTS_DROP, QMAT_ERROR_GEOMETRY,
                      "file: no facet remains: 0 collapsed when vertices of equal position were welded, 1 "
                      "were dropped as defects");
}

static double area(const qmat_mesh *mesh) {
  double sum = 0, normal[3];
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const uint32_t *ids = &mesh->triangles[3 * t];
    sum += qmat_triangle_area(&mesh->positions[3 * (size_t)ids[0]], &mesh->positions[3 * (size_t)ids[1]],
                              &mesh->positions[3 * (size_t)ids[2]], normal);
  }
  return sum;
}

/* A square with a square hole as one polygon: a bridge leads from corner 0 to corner 4 and back. */
static void test_a_polygon_may_repeat_vertices_at_a_bridge_to_its_hole(void **state) {
  (void)state;
  const double positions[] = {0, 0, 0, 3, 0, 0, 3, 3, 0, 0, 3, 0, 1, 1, 0, 1, 2, 0, 2, 2, 0, 2, 1, 0};
  const int facets[] = {0, 1, 2, 3, 0, 4, 5, 6, 7, 4, -1};
  json_t *report;
  qmat_mesh *mesh = convert(make_soup(positions, 8, facets, 1), QMAT_DEFECTS_REFUSE, &report);
  assert_int_equal(mesh->triangle_count, 8);
  assert_true(fabs(area(mesh) - 8) < 1e-15);
  assert_count(report, "border_edges", 8);
  assert_count(report, "facets_dropped_as_defects", 0);
  done(mesh, report);
}

static void test_a_square_that_repeats_a_vertex_is_a_triangle(void **state) {
  (void)state;
  const int facets[] = {0, 1, 2, 2, -1, 0, 2, 2, 0, -1};
  json_t *report;
  qmat_mesh *mesh = convert(make_soup(cube, 8, facets, 2), QMAT_DEFECTS_DROP, &report);
  assert_int_equal(mesh->triangle_count, 1);
  assert_true(fabs(area(mesh) - 0.5) < 1e-15);
  assert_count(report, "facets_dropped_as_defects", 1);
  done(mesh, report);
}

static void test_facets_of_fewer_than_three_corners_are_defects(void **state) {
  (void)state;
  const int facets[] = {0, 1, -1, 0, 1, 2, -1, -1, 3, -1};
  assert_soup_refused(make_soup(cube, 8, facets, 4), QMAT_DEFECTS_REFUSE, QMAT_ERROR_GEOMETRY,
                      "file:10: facet 0: the facet has 2 corners; at least 3 are needed (set 'defects: drop' to drop "
                      "such facets; qmat mat: --set model.defects=drop)");
  json_t *report;
  qmat_mesh *mesh = convert(make_soup(cube, 8, facets, 4), QMAT_DEFECTS_DROP, &report);
  assert_int_equal(mesh->triangle_count, 1);
  assert_count(report, "facets_dropped_as_defects", 3);
  done(mesh, report);
  assert_soup_refused(make_soup(cube, 8, facets, 1), QMAT_DEFECTS_DROP, QMAT_ERROR_GEOMETRY,
                      "file: no facet remains: 0 collapsed when vertices of equal position were welded, 1 were dropped "
                      "as defects");
}

static void test_a_file_without_a_surface_is_refused(void **state) {
  (void)state;
  assert_soup_refused((qmat_soup){0}, QMAT_DEFECTS_DROP, QMAT_ERROR_GEOMETRY, "file: the file has no facets");
  assert_soup_refused(make_soup(cube, 8, NULL, 0), QMAT_DEFECTS_DROP, QMAT_ERROR_GEOMETRY,
                      "file: the file has vertices but no facets");
  const int far[] = {0, 1, 8, -1};
  assert_soup_refused(make_soup(cube, 8, far, 1), QMAT_DEFECTS_DROP, QMAT_ERROR_FORMAT,
                      "file:10: facet 0: the facet uses vertex 8, but there are only 8 (counted from 0)");
  double bad[24];
  for (int k = 0; k < 3; k++) {
    memcpy(bad, cube, sizeof bad);
    bad[3 * 7 + k] = k == 0 ? NAN : k == 1 ? INFINITY : -INFINITY;
    assert_soup_refused(make_soup(bad, 8, cube_facets, 6), QMAT_DEFECTS_DROP, QMAT_ERROR_GEOMETRY,
                        "file: vertex 7: the vertex has a coordinate that is not finite");
  }
}

static void test_coordinates_near_the_largest_double_do_no_harm(void **state) {
  (void)state;
  double huge[24];
  for (int i = 0; i < 24; i++) huge[i] = cube[i] != 0 ? 1.7e308 : -1.7e308;
  int facets[30];
  memcpy(facets, cube_facets, sizeof facets);
  for (int k = 0; k < 4; k++) facets[k] = cube_facets[3 - k];
  json_t *report;
  qmat_mesh *mesh = convert(make_soup(huge, 8, facets, 6), QMAT_DEFECTS_REFUSE, &report);
  assert_true(mesh->oriented && mesh->closed);
  assert_count(report, "flipped", 2);
  done(mesh, report);
}

/* Every number of a random soup of small numbers is what a slow count says. */
static void test_counts_agree_with_a_slow_count_on_random_soups(void **state) {
  (void)state;
  for (uint64_t round = 0; round < 400; round++) {
    enum { FACETS = 24, POINTS = 10 };
    qmat_context context = {0};
    qmat_soup soup = {0};
    for (uint64_t v = 0; v < POINTS; v++) {
      double point[3];
      for (uint64_t k = 0; k < 3; k++) point[k] = (double)(qmat_hash3(11, round, 3 * v + k) % 2);
      assert_int_equal(qmat_soup_add_vertices(&context, &soup, point, 1), QMAT_OK);
    }
    for (uint64_t f = 0; f < FACETS; f++) {
      uint32_t corners[3];
      for (uint64_t k = 0; k < 3; k++) corners[k] = (uint32_t)(qmat_hash3(12, round, 3 * f + k) % POINTS);
      assert_int_equal(qmat_soup_add_facet(&context, &soup, corners, 3, (uint32_t)f, 0), QMAT_OK);
    }
    const qmat_read_options options = {.defects = QMAT_DEFECTS_DROP};
    qmat_mesh *mesh;
    json_t *report = json_object();
    qmat_status status = qmat_soup_to_mesh(&context, &soup, "file", &options, &mesh, report);
    if (status == QMAT_OK) {
      int sides[8][8] = {{0}}, border = 0, nonmanifold = 0, edges = 0;
      bool closed = true, oriented = true;
      for (size_t t = 0; t < mesh->triangle_count; t++) {
        for (size_t k = 0; k < 3; k++) {
          const uint32_t a = mesh->triangles[3 * t + k], b = mesh->triangles[3 * t + (k + 1) % 3];
          assert_true(a != b);
          sides[a][b]++;
        }
        for (size_t other = 0; other < t; other++) {
          for (size_t k = 0; k < 3; k++) {
            assert_false(mesh->triangles[3 * t] == mesh->triangles[3 * other + k] &&
                         mesh->triangles[3 * t + 1] == mesh->triangles[3 * other + (k + 1) % 3] &&
                         mesh->triangles[3 * t + 2] == mesh->triangles[3 * other + (k + 2) % 3] &&
                         json_integer_value(json_object_get(report, "flipped")) == 0);
          }
        }
      }
      for (int a = 0; a < 8; a++) {
        for (int b = a + 1; b < 8; b++) {
          const int up = sides[a][b], down = sides[b][a];
          if (up + down == 0) continue;
          edges++;
          border += up + down == 1;
          nonmanifold += up + down > 2;
          closed = closed && (up + down) % 2 == 0;
          oriented = oriented && abs(up - down) == (up + down) % 2;
        }
      }
      assert_count(report, "border_edges", border);
      assert_count(report, "nonmanifold_edges", nonmanifold);
      assert_count(report, "euler_characteristic",
                   (json_int_t)mesh->vertex_count - edges + (json_int_t)mesh->triangle_count);
      assert_true(mesh->closed == closed);
      assert_true(mesh->oriented == oriented);
      const json_int_t dropped = json_integer_value(json_object_get(report, "facets_dropped_as_defects")) +
                                 json_integer_value(json_object_get(report, "facets_collapsed_by_welding")) +
                                 json_integer_value(json_object_get(report, "triangles_repeated_by_welding"));
      assert_int_equal(mesh->triangle_count + (size_t)dropped, FACETS);
      const json_int_t gone = json_integer_value(json_object_get(report, "vertices_welded")) +
                              json_integer_value(json_object_get(report, "vertices_unreferenced"));
      assert_int_equal(mesh->vertex_count + (size_t)gone, POINTS);
      qmat_value_release(&mesh->base);
    }
    json_decref(report);
    qmat_soup_uninit(&soup);
    qmat_context_uninit(&context);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_cube_of_squares_becomes_twelve_outward_triangles),
      cmocka_unit_test(test_an_inside_out_cube_is_turned_over),
      cmocka_unit_test(test_facets_that_disagree_are_made_to_face_outward),
      cmocka_unit_test(test_a_cavity_keeps_facing_into_the_hole),
      cmocka_unit_test(test_cubes_that_share_an_edge_after_welding_are_closed_and_not_manifold),
      cmocka_unit_test(test_an_open_box_has_border_edges),
      cmocka_unit_test(test_an_open_box_that_disagrees_is_made_to_face_outward),
      cmocka_unit_test(test_a_moebius_strip_is_left_as_it_is),
      cmocka_unit_test(test_vertices_at_one_place_become_the_first_of_them),
      cmocka_unit_test(test_what_welding_collapses_repeats_or_turns_back_to_back_is_counted),
      cmocka_unit_test(test_defects_are_refused_with_facet_and_line_or_dropped_and_counted),
      cmocka_unit_test(test_a_polygon_may_repeat_vertices_at_a_bridge_to_its_hole),
      cmocka_unit_test(test_a_square_that_repeats_a_vertex_is_a_triangle),
      cmocka_unit_test(test_facets_of_fewer_than_three_corners_are_defects),
      cmocka_unit_test(test_a_file_without_a_surface_is_refused),
      cmocka_unit_test(test_coordinates_near_the_largest_double_do_no_harm),
      cmocka_unit_test(test_counts_agree_with_a_slow_count_on_random_soups),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
