/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/node.h"
#include "tests/nodes/pipeline.h"
#include "tests/shapes.h"

extern const qmat_node qmat_node_mesh_subdivide;

/* ---- cages ---- */

typedef struct cage_spec {
  qmat_scheme scheme;
  qmat_boundary boundary;
  size_t vertex_count, face_count, hole_count, crease_count, sharp_count;
  const double *positions;
  const uint32_t *sizes, *corners, *holes, *creases, *sharp;
  const double *crease_sharpness, *vertex_sharpness;
} cage_spec;

static void append(void **array, size_t had, const void *more, size_t count, size_t size) {
  char *grown = qmat_alloc(had + count, size);
  assert_non_null(grown);
  if (had > 0) memcpy(grown, *array, had * size);
  if (count > 0) memcpy(grown + had * size, more, count * size);
  qmat_free(*array);
  *array = grown;
}

static void append_ids(uint32_t **array, size_t had, const uint32_t *more, size_t count, size_t shift) {
  append((void **)array, had, more, count, sizeof **array);
  for (size_t i = had; i < had + count; i++) (*array)[i] += (uint32_t)shift;
}

/* Adds a surface to the cage of an unsealed mesh, whose triangles are fans of the faces that are no holes. */
static void add_surface(qmat_mesh *mesh, const cage_spec *spec) {
  qmat_cage *cage = &mesh->cage;
  const uint32_t scheme = spec->scheme, boundary = spec->boundary, faces = (uint32_t)spec->face_count;
  size_t corner_count = 0;
  for (size_t f = 0; f < spec->face_count; f++) {
    bool is_hole = false;
    for (size_t i = 0; i < spec->hole_count; i++) is_hole = is_hole || spec->holes[i] == f;
    const uint32_t *corners = spec->corners + corner_count, first = (uint32_t)mesh->vertex_count;
    for (uint32_t k = 2; k < spec->sizes[f] && !is_hole; k++)
      shape_triangle(mesh, first + corners[0], first + corners[k - 1], first + corners[k]);
    corner_count += spec->sizes[f];
  }
  for (size_t i = 0; i < spec->vertex_count; i++) {
    const double *p = spec->positions + 3 * i;
    shape_vertex(mesh, p[0], p[1], p[2]);
  }
  append((void **)&cage->surface_faces, cage->surface_count, &faces, 1, sizeof faces);
  append((void **)&cage->schemes, cage->surface_count, &scheme, 1, sizeof scheme);
  append((void **)&cage->boundaries, cage->surface_count, &boundary, 1, sizeof boundary);
  append((void **)&cage->positions, cage->vertex_count, spec->positions, spec->vertex_count, 3 * sizeof(double));
  append((void **)&cage->face_sizes, cage->face_count, spec->sizes, spec->face_count, sizeof(uint32_t));
  append_ids(&cage->corners, cage->corner_count, spec->corners, corner_count, cage->vertex_count);
  append_ids(&cage->holes, cage->hole_count, spec->holes, spec->hole_count, cage->face_count);
  append_ids(&cage->creases, 2 * cage->crease_count, spec->creases, 2 * spec->crease_count, cage->vertex_count);
  append((void **)&cage->crease_sharpness, cage->crease_count, spec->crease_sharpness, spec->crease_count,
         sizeof(double));
  append_ids(&cage->sharp_vertices, cage->sharp_count, spec->sharp, spec->sharp_count, cage->vertex_count);
  append((void **)&cage->vertex_sharpness, cage->sharp_count, spec->vertex_sharpness, spec->sharp_count,
         sizeof(double));
  cage->surface_count++;
  cage->vertex_count += spec->vertex_count;
  cage->face_count += spec->face_count;
  cage->corner_count += corner_count;
  cage->hole_count += spec->hole_count;
  cage->crease_count += spec->crease_count;
  cage->sharp_count += spec->sharp_count;
}

static qmat_mesh *mesh_of(const cage_spec *spec) {
  qmat_mesh *mesh = shape_new();
  add_surface(mesh, spec);
  return shape_seal(mesh);
}

/* The cube of corners (+-1, +-1, +-1); vertex i has x by bit 0, y by bit 1, z by bit 2. */
static const double cube_positions[] = {-1, -1, -1, 1, -1, -1, -1, 1, -1, 1, 1, -1,
                                        -1, -1, 1,  1, -1, 1,  -1, 1, 1,  1, 1, 1};
static const uint32_t cube_sizes[] = {4, 4, 4, 4, 4, 4};
static const uint32_t cube_corners[] = {0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5};
static const cage_spec cube = {.scheme = QMAT_SCHEME_CATMULL_CLARK,
                               .boundary = QMAT_BOUNDARY_EDGE_AND_CORNER,
                               .vertex_count = 8,
                               .face_count = 6,
                               .positions = cube_positions,
                               .sizes = cube_sizes,
                               .corners = cube_corners};

/* Three by three quads in the plane z = 0. */
enum { GRID = 4 };
static double grid_positions[3 * GRID * GRID];
static uint32_t grid_sizes[(GRID - 1) * (GRID - 1)], grid_corners[4 * (GRID - 1) * (GRID - 1)];

static cage_spec grid_of(qmat_scheme scheme, qmat_boundary boundary) {
  for (uint32_t y = 0; y < GRID; y++) {
    for (uint32_t x = 0; x < GRID; x++) {
      double *p = grid_positions + 3 * (y * GRID + x);
      p[0] = x, p[1] = y, p[2] = 0;
      if (x == GRID - 1 || y == GRID - 1) continue;
      const uint32_t face = y * (GRID - 1) + x, v = y * GRID + x;
      const uint32_t corners[] = {v, v + 1, v + 1 + GRID, v + GRID};
      memcpy(grid_corners + 4 * face, corners, sizeof corners);
      grid_sizes[face] = 4;
    }
  }
  return (cage_spec){.scheme = scheme,
                     .boundary = boundary,
                     .vertex_count = GRID * GRID,
                     .face_count = (GRID - 1) * (GRID - 1),
                     .positions = grid_positions,
                     .sizes = grid_sizes,
                     .corners = grid_corners};
}

/* ---- runs ---- */

typedef struct result {
  qmat_status status;
  qmat_error error;
  qmat_mesh *mesh;
  qmat_report *report;
} result;

/* `settings`: NAME VALUE ... NULL. Releases the input. */
static result run_on(qmat_mesh *mesh, const char *const *settings, int threads) {
  const qmat_node *node = &qmat_node_mesh_subdivide;
  double params[16];
  qmat_context context = {.threads = threads};
  assert_true(node->params_size <= sizeof params);
  qmat_params_default(node, params);
  for (; *settings; settings += 2)
    assert_int_equal(qmat_param_parse(&context, qmat_param_find(node, settings[0]), settings[1], params), QMAT_OK);
  const qmat_value *inputs[] = {&mesh->base};
  qmat_value *outputs[2] = {NULL, NULL};
  result r = {.status = qmat_node_run(&context, node, params, inputs, outputs)};
  r.error = context.error;
  r.mesh = (qmat_mesh *)outputs[0];
  r.report = (qmat_report *)outputs[1];
  qmat_value_release(&mesh->base);
  qmat_context_uninit(&context);
  return r;
}
#define RUN(mesh, ...) run_on(mesh, (const char *const[]){__VA_ARGS__, NULL}, 2)

static void release(result *r) {
  qmat_value_release(&r->mesh->base);
  qmat_value_release(&r->report->base);
}

static result good(result r) {
  if (r.status != QMAT_OK) fail_msg("%s", r.error.message);
  return r;
}

static double number(const result *r, const char *key) {
  const json_t *value = json_object_get(r->report->root, key);
  if (!value) fail_msg("the report has no '%s'", key);
  return json_number_value(value);
}

/* The distance from a point to the mesh's nearest vertex. */
static double nearest(const qmat_mesh *mesh, double x, double y, double z) {
  double least = INFINITY;
  for (size_t i = 0; i < mesh->vertex_count; i++) {
    const double *p = mesh->positions + 3 * i;
    least = fmin(least, hypot(hypot(p[0] - x, p[1] - y), p[2] - z));
  }
  return least;
}
#define assert_vertex(mesh, x, y, z) assert_near(nearest(mesh, x, y, z), 0, 1e-14)

/* ---- Catmull-Clark by hand ---- */

/* Smooth, the limit of a vertex of valence 3 is (9 v + 4 (sum of e) + (sum of f)) / 24 with its neighbours e and the
 * opposite corners f of its faces. At (1, 1, 1) each coordinate is (9 + 4 (1 + 1 - 1) + (-1 - 1 + 1)) / 24 = 1/2. A
 * face centre of level 1 stays where it is, (0, 0, 1), and is of valence 4: its neighbours are the edge points, which
 * lie at (1 + 1 + 1/2 + 1/2) / 4 ... = ((0, 3/4, 3/4) and alike), and the opposite corners are the vertex points of
 * valence 3, (f + 2 r) / 4 with f = (1/3, 1/3, 1/3), the mean of face points, r = (2/3, 2/3, 2/3), that of edge
 * middles, and v itself with weight 0: (1/3 + 4/3) / 3 = 5/9. The limit is (16 v + 4 (sum of e) + (sum of f)) / 36, of
 * z: (16 + 4 * 4 * 3/4 + 4 * 5/9) / 36 = (28 + 20/9) / 36 = 68/81. */
static void test_a_cube_goes_to_the_limit_points_of_catmull_clark(void **state) {
  (void)state;
  result r = good(RUN(mesh_of(&cube), "level", "1"));
  assert_int_equal(r.mesh->vertex_count, 26);
  assert_int_equal(r.mesh->triangle_count, 48);
  assert_true(r.mesh->closed && r.mesh->oriented);
  assert_int_equal(r.mesh->cage.surface_count, 0);
  for (int i = 0; i < 8; i++) assert_vertex(r.mesh, i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5);
  assert_vertex(r.mesh, 0, 0, 68.0 / 81);
  assert_vertex(r.mesh, -68.0 / 81, 0, 0);
  release(&r);
}

/* The top's four edges are a crease: its vertices go to (e1 + 4 v + e2) / 6 along it. At (1, 1, 1) the neighbours on
 * the ring are (-1, 1, 1) and (1, -1, 1): x = (1 + 4 - 1) / 6 = 2/3, and z stays 1. The ring is a plane curve, its
 * level-1 edge points (0, 1, 1) have the neighbours (6 * 1 + 1 - 1) / 8 = 3/4: their limit is y = (3/4 + 4 + 3/4) / 6 =
 * 11/12. (1, 1, -1) is smooth, and the rules of its neighbours do not matter to its own limit: 1/2. The sharp corner
 * (-1, -1, -1) stays. */
static void test_a_crease_ring_and_a_sharp_corner_go_to_their_limit_points(void **state) {
  (void)state;
  static const uint32_t ring[] = {4, 5, 5, 7, 7, 6, 6, 4}, corner[] = {0};
  static const double infinite[] = {10, 10, 10, 10}, sharp[] = {12};
  cage_spec spec = cube;
  spec.creases = ring;
  spec.crease_count = 4;
  spec.crease_sharpness = infinite;
  spec.sharp = corner;
  spec.sharp_count = 1;
  spec.vertex_sharpness = sharp;
  for (int level = 1; level <= 4; level += 3) {
    result r = good(RUN(mesh_of(&spec), "level", level == 1 ? "1" : "4"));
    assert_true(r.mesh->closed);
    for (int i = 4; i < 8; i++) assert_vertex(r.mesh, i & 1 ? 2.0 / 3 : -2.0 / 3, i & 2 ? 2.0 / 3 : -2.0 / 3, 1);
    assert_vertex(r.mesh, 0, 11.0 / 12, 1);
    assert_vertex(r.mesh, -11.0 / 12, 0, 1);
    assert_vertex(r.mesh, 0.5, 0.5, -0.5);
    assert_vertex(r.mesh, -1, -1, -1);
    assert_near(number(&r, "deviation_of_sharpness"), 0, 0);
    release(&r);
  }
}

/* A crease of sharpness 3 is sharp for three levels. Whatever level the mesh has, its vertices are on the true limit:
 * the same as after five levels. */
static void test_semi_sharp_creases_are_resolved_below_the_level(void **state) {
  (void)state;
  static const uint32_t ring[] = {4, 5, 5, 7, 7, 6, 6, 4};
  static const double semi[] = {3, 3, 3, 3};
  cage_spec spec = cube;
  spec.creases = ring;
  spec.crease_count = 4;
  spec.crease_sharpness = semi;
  result coarse = good(RUN(mesh_of(&spec), "level", "1")), fine = good(RUN(mesh_of(&spec), "level", "5"));
  assert_near(number(&coarse, "deviation_of_sharpness"), 0, 0);
  assert_true(number(&coarse, "depth") >= 3);
  for (size_t i = 0; i < coarse.mesh->vertex_count; i++) {
    const double *p = coarse.mesh->positions + 3 * i;
    assert_vertex(fine.mesh, p[0], p[1], p[2]);
  }
  assert_true(nearest(coarse.mesh, 2.0 / 3, 2.0 / 3, 1) > 0.01); /* it is not the limit of an infinite one */
  release(&coarse);
  release(&fine);
}

static void test_the_deviation_covers_what_a_far_finer_level_shows(void **state) {
  (void)state;
  result fine = good(RUN(mesh_of(&cube), "level", "6"));
  for (int level = 1; level <= 3; level++) {
    const char text[] = {(char)('0' + level), 0};
    result r = good(RUN(mesh_of(&cube), "level", text));
    /* The cube's limit bulges most at the face centres, where it is farthest from the origin along an axis; take every
     * fine vertex and the nearest of the facets' planes that its ray crosses. */
    double farthest = 0;
    for (size_t i = 0; i < fine.mesh->vertex_count; i++) {
      const double *p = fine.mesh->positions + 3 * i;
      double best = INFINITY;
      for (size_t t = 0; t < r.mesh->triangle_count; t++) {
        const double *c[3];
        for (size_t k = 0; k < 3; k++) c[k] = r.mesh->positions + 3 * (size_t)r.mesh->triangles[3 * t + k];
        double ab[3], ac[3];
        for (int k = 0; k < 3; k++) ab[k] = c[1][k] - c[0][k], ac[k] = c[2][k] - c[0][k];
        const double n[3] = {ab[1] * ac[2] - ab[2] * ac[1], ab[2] * ac[0] - ab[0] * ac[2],
                             ab[0] * ac[1] - ab[1] * ac[0]};
        const double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        /* Convex: the solid is where all planes are positive, so outside it the largest height counts. */
        double height = 0;
        for (int k = 0; k < 3; k++) height += n[k] * (p[k] - c[0][k]) / length;
        best = best == INFINITY ? height : fmax(best, height);
      }
      farthest = fmax(farthest, best);
    }
    assert_true(farthest > 0);
    assert_true(r.mesh->deviation >= farthest);
    assert_true(r.mesh->deviation <= 3 * farthest);
    release(&r);
  }
  release(&fine);
}

static void test_the_level_is_the_first_that_epsilon_allows(void **state) {
  (void)state;
  double before = INFINITY, level_before = 0;
  static const char *const epsilons[] = {"20%", "2%", "0.2%", "0.02%"};
  for (size_t i = 0; i < 4; i++) {
    const double epsilon = 0.2 * pow(10, -(double)i);
    result r = good(RUN(mesh_of(&cube), "epsilon", epsilons[i]));
    const double level = number(&r, "level"), deviation = number(&r, "deviation");
    assert_true(deviation <= 0.1 * epsilon);
    assert_true(level >= level_before && deviation <= before);
    if (level > 1) {
      const char text[] = {(char)('0' + (int)level - 1), 0};
      result coarser = good(RUN(mesh_of(&cube), "level", text));
      assert_true(number(&coarser, "deviation") > 0.1 * epsilon);
      release(&coarser);
    }
    before = deviation;
    level_before = level;
    release(&r);
  }
  assert_true(level_before >= 4);
}

/* ---- other schemes ---- */

/* By Loop's scheme the limit of a vertex of valence n is (1 - n b) v + b (sum of e) with b = 1 / (n + 3 / (8 a)),
 * a = (5/8 - (3/8 + cos(2 pi / n) / 4)^2) / n. For n = 4: a = (5/8 - 9/64) / 4 = 31/256, 3 / (8 a) = 96/31, and
 * b = 1 / (4 + 96/31) = 31/220. The neighbours of (1, 0, 0) add up to 0, so it goes to 1 - 124/220 = 24/55. */
static void test_an_octahedron_goes_to_the_limit_points_of_loop(void **state) {
  (void)state;
  static const double positions[] = {1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1};
  static const uint32_t sizes[] = {3, 3, 3, 3, 3, 3, 3, 3},
                        corners[] = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
  const cage_spec spec = {.scheme = QMAT_SCHEME_LOOP,
                          .boundary = QMAT_BOUNDARY_EDGE_AND_CORNER,
                          .vertex_count = 6,
                          .face_count = 8,
                          .positions = positions,
                          .sizes = sizes,
                          .corners = corners};
  result r = good(RUN(mesh_of(&spec), "level", "2"));
  assert_int_equal(r.mesh->triangle_count, 8 * 16);
  assert_true(r.mesh->closed && r.mesh->oriented);
  for (int axis = 0; axis < 3; axis++)
    for (int sign = -1; sign <= 1; sign += 2) {
      double p[3] = {0, 0, 0};
      p[axis] = sign * 24.0 / 55;
      assert_vertex(r.mesh, p[0], p[1], p[2]);
    }
  release(&r);
  /* The same for a mesh without a cage. */
  qmat_mesh *plain = shape_new();
  for (size_t i = 0; i < 6; i++) shape_vertex(plain, positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]);
  for (size_t i = 0; i < 8; i++) shape_triangle(plain, corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]);
  r = good(RUN(shape_seal(plain), "level", "2", "scheme", "loop"));
  assert_vertex(r.mesh, 24.0 / 55, 0, 0);
  assert_true(number(&r, "surfaces") == 1);
  release(&r);
}

static void test_the_limit_of_a_bilinear_cage_is_the_cage(void **state) {
  (void)state;
  cage_spec spec = cube;
  spec.scheme = QMAT_SCHEME_BILINEAR;
  result r = good(RUN(mesh_of(&spec), "level", "0"));
  assert_true(number(&r, "level") == 0);
  assert_near(r.mesh->deviation, 0, 1e-15);
  assert_int_equal(r.mesh->vertex_count, 8);
  assert_int_equal(r.mesh->triangle_count, 12);
  release(&r);
  r = good(RUN(mesh_of(&spec), "level", "1"));
  assert_true(number(&r, "level") == 1);
  assert_near(r.mesh->deviation, 0, 1e-15);
  assert_int_equal(r.mesh->vertex_count, 26);
  for (size_t i = 0; i < 8; i++)
    assert_vertex(r.mesh, cube_positions[3 * i], cube_positions[3 * i + 1], cube_positions[3 * i + 2]);
  assert_vertex(r.mesh, 0, 0, 1);
  assert_vertex(r.mesh, 0, 1, 1);
  release(&r);
}

/* The prism over the triangle (0, 0), (6, 0), (0, 3): its ends become fans about their centres, (2, 1). */
static void test_a_cage_that_is_fine_enough_is_not_subdivided(void **state) {
  (void)state;
  static const double positions[] = {0, 0, 0, 6, 0, 0, 0, 3, 0, 0, 0, 1, 6, 0, 1, 0, 3, 1};
  static const uint32_t sizes[] = {3, 3, 4, 4, 4}, corners[] = {2, 1, 0, 3, 4, 5, 0, 1, 4, 3, 1, 2, 5, 4, 2, 0, 3, 5};
  const cage_spec spec = {.scheme = QMAT_SCHEME_BILINEAR,
                          .boundary = QMAT_BOUNDARY_EDGE_AND_CORNER,
                          .vertex_count = 6,
                          .face_count = 5,
                          .positions = positions,
                          .sizes = sizes,
                          .corners = corners};
  result r = good(RUN(mesh_of(&spec), "level", "0"));
  assert_true(number(&r, "level") == 0);
  assert_near(r.mesh->deviation, 0, 1e-15);
  assert_int_equal(r.mesh->vertex_count, 8);
  assert_int_equal(r.mesh->triangle_count, 12);
  assert_true(r.mesh->closed && r.mesh->oriented);
  assert_vertex(r.mesh, 2, 1, 0);
  assert_vertex(r.mesh, 2, 1, 1);
  release(&r);
  /* The vertices of a cage that is taken as it is are on the limit surface, which for a cube is far away. */
  r = good(RUN(mesh_of(&cube), "level", "0", "epsilon", "1", "tolerance", "1"));
  assert_true(number(&r, "level") == 0);
  assert_int_equal(r.mesh->triangle_count, 12);
  /* The corners' limits are half-way to the centre, as above. */
  for (size_t i = 0; i < 24; i++) assert_near(fabs(r.mesh->positions[i]), 0.5, 1e-12);
  assert_true(r.mesh->deviation > 0.1);
  release(&r);
}

/* What is not subdivided keeps its own deviation. */
static void test_the_deviation_of_other_surfaces_is_kept(void **state) {
  (void)state;
  cage_spec spec = cube;
  spec.scheme = QMAT_SCHEME_BILINEAR;
  qmat_mesh *mesh = shape_new();
  add_surface(mesh, &spec);
  mesh->deviation = 0.25;
  result r = good(RUN(shape_seal(mesh), "level", "0"));
  assert_near(r.mesh->deviation, 0.25, 0);
  release(&r);
}

/* ---- borders and holes ---- */

/* Without a rule the border's faces are left out, so that of nine quads the middle one is left. A smooth border pulls
 * its corners in: (0, 0) to ((1, 0) + 4 (0, 0) + (0, 1)) / 6 = (1/6, 1/6). With corners they stay. */
static void test_borders_follow_their_rule(void **state) {
  (void)state;
  cage_spec spec = grid_of(QMAT_SCHEME_CATMULL_CLARK, QMAT_BOUNDARY_NONE);
  result r = good(RUN(mesh_of(&spec), "level", "1"));
  assert_int_equal(r.mesh->triangle_count, 8);
  for (int i = 0; i < 4; i++) assert_vertex(r.mesh, i & 1 ? 1 : 2, i & 2 ? 1 : 2, 0);
  release(&r);
  spec = grid_of(QMAT_SCHEME_CATMULL_CLARK, QMAT_BOUNDARY_EDGE);
  r = good(RUN(mesh_of(&spec), "level", "1"));
  assert_int_equal(r.mesh->triangle_count, 72);
  assert_false(r.mesh->closed);
  assert_vertex(r.mesh, 1.0 / 6, 1.0 / 6, 0);
  release(&r);
  /* The parameter overrides the rule of the model. */
  r = good(RUN(mesh_of(&spec), "level", "1", "boundary", "edge_and_corner"));
  assert_vertex(r.mesh, 0, 0, 0);
  assert_vertex(r.mesh, 3, 0, 0);
  assert_near(r.mesh->deviation, 0, 1e-15); /* a plane, whatever slides within it */
  release(&r);
}

static void test_holes_shape_the_surface_and_are_left_out(void **state) {
  (void)state;
  static const uint32_t top[] = {1};
  cage_spec spec = cube;
  spec.holes = top;
  spec.hole_count = 1;
  result r = good(RUN(mesh_of(&spec), "level", "1"));
  assert_int_equal(r.mesh->triangle_count, 40);
  assert_false(r.mesh->closed);
  assert_vertex(r.mesh, 0.5, 0.5, 0.5); /* as if the top were there */
  assert_true(nearest(r.mesh, 0, 0, 68.0 / 81) > 0.1);
  release(&r);
}

static void test_surfaces_of_other_schemes_stay_beside_those_that_are_subdivided(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_new();
  cage_spec plain = cube, loop_like = cube;
  double shifted[24], farther[24];
  for (int i = 0; i < 24; i++) shifted[i] = cube_positions[i] + 3, farther[i] = cube_positions[i] - 3;
  plain.scheme = QMAT_SCHEME_NONE;
  plain.positions = shifted;
  loop_like.scheme = QMAT_SCHEME_BILINEAR;
  loop_like.positions = farther;
  add_surface(mesh, &plain);
  add_surface(mesh, &cube);
  add_surface(mesh, &loop_like);
  result r = good(RUN(shape_seal(mesh), "level", "1"));
  assert_int_equal(r.mesh->triangle_count, 12 + 48 + 48);
  assert_true(r.mesh->closed);
  assert_true(number(&r, "surfaces") == 2 && number(&r, "components") == 3);
  assert_vertex(r.mesh, 4, 4, 4);
  assert_vertex(r.mesh, 0.5, 0.5, 0.5);
  assert_vertex(r.mesh, -4, -4, -4);
  release(&r);
}

static void test_surfaces_that_share_a_border_are_welded(void **state) {
  (void)state;
  static const uint32_t sizes[] = {4, 4, 4, 4, 4},
                        sides[] = {0, 2, 3, 1, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5};
  static const uint32_t one[] = {4}, lid[] = {0, 1, 2, 3};
  static const double lid_positions[] = {-1, -1, 1, 1, -1, 1, 1, 1, 1, -1, 1, 1};
  cage_spec box = cube, cover = cube;
  box.sizes = sizes;
  box.corners = sides;
  box.face_count = 5;
  cover.sizes = one;
  cover.corners = lid;
  cover.positions = lid_positions;
  cover.vertex_count = 4;
  cover.face_count = 1;
  box.boundary = cover.boundary = QMAT_BOUNDARY_EDGE;
  qmat_mesh *mesh = shape_new();
  add_surface(mesh, &box);
  add_surface(mesh, &cover);
  result r = good(RUN(shape_seal(mesh), "level", "3"));
  assert_true(r.mesh->closed);
  assert_true(number(&r, "components") == 1);
  release(&r);
}

/* ---- what passes through ---- */

static void test_a_mesh_without_subdivision_surfaces_is_the_same_value(void **state) {
  (void)state;
  qmat_mesh *box = shape_seal(shape_box(1, 2, 3));
  result r = good(RUN((qmat_mesh *)qmat_value_retain(&box->base), "level", "3"));
  assert_ptr_equal(r.mesh, box);
  assert_true(number(&r, "surfaces") == 0 && number(&r, "deviation") == 0);
  assert_near(box->deviation, 0, 0);
  release(&r);
  qmat_value_release(&box->base);
}

/* ---- symmetries ---- */

static void test_a_turned_cage_gives_the_turned_limit(void **state) {
  (void)state;
  result straight = good(RUN(mesh_of(&cube), "level", "2"));
  qmat_mesh *limit = shape_new();
  for (size_t i = 0; i < straight.mesh->vertex_count; i++) {
    const double *p = straight.mesh->positions + 3 * i;
    shape_vertex(limit, p[0], p[1], p[2]);
  }
  shape_rotate(limit);
  qmat_mesh *corners = shape_new();
  for (size_t i = 0; i < 8; i++)
    shape_vertex(corners, cube_positions[3 * i], cube_positions[3 * i + 1], cube_positions[3 * i + 2]);
  shape_rotate(corners);
  cage_spec spec = cube;
  spec.positions = corners->positions;
  result turned = good(RUN(mesh_of(&spec), "level", "2"));
  assert_int_equal(turned.mesh->vertex_count, limit->vertex_count);
  for (size_t i = 0; i < limit->vertex_count; i++) {
    const double *p = limit->positions + 3 * i;
    assert_vertex(turned.mesh, p[0], p[1], p[2]);
  }
  assert_near(turned.mesh->deviation, straight.mesh->deviation, 1e-6); /* the search is in single precision */
  release(&straight);
  release(&turned);
  qmat_value_release(&limit->base);
  qmat_value_release(&corners->base);
}

static void test_the_order_of_faces_does_not_matter(void **state) {
  (void)state;
  static const uint32_t other[] = {5, 1, 3, 7, 6, 2, 0, 4, 7, 3, 2, 6, 4, 0, 1, 5, 6, 4, 5, 7, 1, 0, 2, 3};
  cage_spec spec = cube;
  spec.corners = other;
  result one = good(RUN(mesh_of(&cube), "level", "2")), two = good(RUN(mesh_of(&spec), "level", "2"));
  assert_int_equal(one.mesh->vertex_count, two.mesh->vertex_count);
  for (size_t i = 0; i < one.mesh->vertex_count; i++) {
    const double *p = one.mesh->positions + 3 * i;
    assert_vertex(two.mesh, p[0], p[1], p[2]);
  }
  release(&one);
  release(&two);
}

static void test_any_number_of_threads_gives_the_same_bytes(void **state) {
  (void)state;
  static const char *const settings[] = {"level", "3", NULL};
  result first = good(run_on(mesh_of(&cube), settings, 1));
  for (int threads = 2; threads <= 8; threads *= 2) {
    result r = good(run_on(mesh_of(&cube), settings, threads));
    assert_memory_equal(&r.mesh->base.digest, &first.mesh->base.digest, sizeof(qmat_digest));
    assert_memory_equal(&r.report->base.digest, &first.report->base.digest, sizeof(qmat_digest));
    release(&r);
  }
  release(&first);
}

/* ---- errors ---- */

static void check_error(result r, const char *field, const char *message) {
  assert_int_equal(r.status, QMAT_ERROR_GEOMETRY);
  assert_string_equal(r.error.field, field);
  if (!strstr(r.error.message, message)) fail_msg("'%s' does not say '%s'", r.error.message, message);
}

static void test_loop_on_quads_is_an_error_that_names_the_face(void **state) {
  (void)state;
  cage_spec spec = cube;
  spec.scheme = QMAT_SCHEME_LOOP;
  const result r = RUN(mesh_of(&spec), "level", "1");
  check_error(r, "mesh", "4 corners");
  assert_string_equal(r.error.element_kind, "face");
  assert_int_equal(r.error.element, 0);
}

static void test_broken_faces_are_errors_that_name_them(void **state) {
  (void)state;
  uint32_t corners[24];
  memcpy(corners, cube_corners, sizeof corners);
  corners[5] = corners[4];
  cage_spec spec = cube;
  spec.corners = corners;
  result r = RUN(mesh_of(&spec), "level", "1");
  check_error(r, "mesh", "twice");
  assert_int_equal(r.error.element, 1);
  static const uint32_t sizes[] = {4, 4, 4, 4, 4, 2, 2};
  spec = cube;
  spec.sizes = sizes;
  spec.face_count = 7;
  r = RUN(mesh_of(&spec), "level", "1");
  check_error(r, "mesh", "2 corners");
  assert_int_equal(r.error.element, 5);
}

static void test_nothing_left_is_an_error(void **state) {
  (void)state;
  static const uint32_t all[] = {0, 1, 2, 3, 4, 5};
  qmat_mesh *mesh = shape_new();
  cage_spec spec = cube;
  spec.holes = all;
  spec.hole_count = 6;
  add_surface(mesh, &spec);
  shape_triangle(mesh, 0, 1, 2); /* so that the mesh itself is no error */
  check_error(RUN(shape_seal(mesh), "level", "1"), "mesh", "no face is left");
  check_error(RUN(shape_seal(shape_new()), "level", "1"), "mesh", "no triangles");
}

/* A bumpy sheet of 2 * n * n triangles. */
static qmat_mesh *sheet_of(uint32_t n) {
  qmat_mesh *mesh = shape_new();
  mesh->vertex_count = (size_t)(n + 1) * (n + 1);
  mesh->triangle_count = 2 * (size_t)n * n;
  mesh->positions = qmat_alloc(mesh->vertex_count, 3 * sizeof(double));
  mesh->triangles = qmat_alloc(mesh->triangle_count, 3 * sizeof(uint32_t));
  uint32_t *next = mesh->triangles;
  for (uint32_t v = 0; v < (n + 1) * (n + 1); v++) {
    const uint32_t x = v % (n + 1), y = v / (n + 1);
    double *p = mesh->positions + 3 * (size_t)v;
    p[0] = x, p[1] = y, p[2] = x * y % 7;
    if (x == n || y == n) continue;
    const uint32_t two[] = {v, v + 1, v + n + 2, v, v + n + 2, v + n + 1};
    memcpy(next, two, sizeof two);
    next += 6;
  }
  qmat_context context = {0};
  assert_int_equal(qmat_value_seal(&context, &mesh->base), QMAT_OK);
  return mesh;
}

/* Measuring a level takes four times its faces: 66248 * 4^2 are within the limit, 66248 * 4^3 are not. */
static void test_levels_that_take_too_much_are_errors(void **state) {
  (void)state;
  check_error(RUN(sheet_of(182), "level", "2", "scheme", "loop"), "level", "at most 4194304");
  check_error(RUN(sheet_of(182), "level", "8", "scheme", "catmull_clark"), "level", "at most 4194304");
  check_error(RUN(sheet_of(182), "epsilon", "1e-9", "scheme", "loop"), "epsilon", "at most 4194304");
}

/* Three faces at an edge, and one that runs the other way round. OpenSubdiv makes such edges sharp. */
static void test_edges_of_three_faces_do_not_crash(void **state) {
  (void)state;
  static const double positions[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 1, 0, 1, 0, 0, 1, 1, -1, 0, 0, -1, 0};
  static const uint32_t sizes[] = {4, 4, 4}, corners[] = {0, 1, 2, 3, 0, 1, 4, 5, 1, 0, 7, 6};
  const cage_spec spec = {.scheme = QMAT_SCHEME_CATMULL_CLARK,
                          .boundary = QMAT_BOUNDARY_EDGE_AND_CORNER,
                          .vertex_count = 8,
                          .face_count = 3,
                          .positions = positions,
                          .sizes = sizes,
                          .corners = corners};
  result r = RUN(mesh_of(&spec), "level", "2");
  if (r.status != QMAT_OK) {
    check_error(r, "mesh", "OpenSubdiv");
    return;
  }
  assert_false(r.mesh->closed);
  assert_vertex(r.mesh, 0.5, 0, 0); /* the middle of the sharp edge */
  release(&r);
}

static void test_creases_along_no_edge_are_told(void **state) {
  (void)state;
  static const uint32_t diagonal[] = {0, 7};
  static const double sharp[] = {10};
  cage_spec spec = cube;
  spec.creases = diagonal;
  spec.crease_count = 1;
  spec.crease_sharpness = sharp;
  result r = good(RUN(mesh_of(&spec), "level", "1"));
  assert_true(number(&r, "creases_without_edge") == 1);
  assert_int_equal(json_array_size(json_object_get(r.report->root, "warnings")), 1);
  assert_vertex(r.mesh, 0.5, 0.5, 0.5);
  release(&r);
}

/* ---- what the mesh carries along ---- */

/* A box of diagonal 3 that stands for a surface as far away as that share of it. */
static qmat_mesh *box_with_deviation(double share) {
  qmat_mesh *box = shape_box(1, 2, 2);
  box->deviation = 3 * share;
  return shape_seal(box);
}

/* The bounds of medial.evaluate grow by the deviation on both sides, and what was certified no longer is. */
static void test_bounds_are_towards_the_surface_that_the_mesh_stands_for(void **state) {
  (void)state;
  qmat_mesh *plain = box_with_deviation(0), *deviating = box_with_deviation(0.125);
  qmat_medial *ball = qmat_medial_new();
  ball->sphere_count = 1;
  ball->spheres = qmat_alloc(4, sizeof *ball->spheres);
  memcpy(ball->spheres, (const double[]){0.5, 1, 1, 0.5}, 4 * sizeof(double));
  qmat_context context = {0};
  assert_int_equal(qmat_value_seal(&context, &ball->base), QMAT_OK);
  qmat_value *outputs[2];
  pipeline_must_run(0, "medial.evaluate", "epsilon=40% tolerance=0.01",
                    (const qmat_value *[]){&plain->base, &ball->base}, &outputs[0]);
  pipeline_must_run(0, "medial.evaluate", "epsilon=40% tolerance=0.01",
                    (const qmat_value *[]){&deviating->base, &ball->base}, &outputs[1]);
  const qmat_report *without = (const qmat_report *)outputs[0], *with = (const qmat_report *)outputs[1];
  /* From a corner to the ball: sqrt(0.25 + 1 + 1) - 0.5 = 1, a third of the diagonal. */
  assert_near(pipeline_number(without, "surface_to_envelope"), 1.0 / 3, 0.005);
  assert_near(pipeline_number(with, "surface_to_envelope"), 1.0 / 3 + 0.125, 0.005);
  assert_near(pipeline_number(with, "surface_to_envelope_at_least"), 1.0 / 3 - 0.125, 0.005);
  assert_near(pipeline_number(with, "envelope_to_surface"), pipeline_number(without, "envelope_to_surface") + 0.125,
              0.005);
  assert_near(pipeline_number(with, "deviation"), 0.125, 0);
  assert_true(json_is_true(json_object_get(without->root, "certified")));
  assert_true(json_is_false(json_object_get(with->root, "certified")));
  assert_null(json_object_get(without->root, "deviation"));
  for (int i = 0; i < 2; i++) qmat_value_release(outputs[i]);
  qmat_value_release(&ball->base);
  qmat_value_release(&plain->base);
  qmat_value_release(&deviating->base);
}

/* With a deviation of 1/128 and an epsilon of 4/128, collapses are those of 3/128, and errors are 1/128 more. */
static void test_collapses_leave_the_deviation_of_epsilon(void **state) {
  (void)state;
  pipeline plain = {0}, deviating = {0};
  pipeline_make(&plain, box_with_deviation(0), "spacing=20% n_f=0", "");
  pipeline_make(&deviating, box_with_deviation(0.0078125), "spacing=20% n_f=0", "");
  static const char *const rules[] = {"skip", "raise"};
  const qmat_value *in_plain[] = {&plain.mesh->base, &plain.thickness->base, &plain.samples->base, &plain.medial->base};
  const qmat_value *in_deviating[] = {&deviating.mesh->base, &deviating.thickness->base, &deviating.samples->base,
                                      &deviating.medial->base};
  qmat_value *made[2], *expected[2];
  for (int i = 0; i < 2; i++) {
    char params[64];
    snprintf(params, sizeof params, "on_exceed=%s finest=0.01 epsilon=0.0234375", rules[i]);
    pipeline_must_run(0, "medial.simplify", params, in_plain, expected);
    snprintf(params, sizeof params, "on_exceed=%s finest=0.01 epsilon=0.03125", rules[i]);
    pipeline_must_run(0, "medial.simplify", params, in_deviating, made);
    assert_memory_equal(&made[0]->digest, &expected[0]->digest, sizeof(qmat_digest));
    const qmat_report *with = (const qmat_report *)made[1], *without = (const qmat_report *)expected[1];
    assert_near(pipeline_number(with, "epsilon"), 0.03125, 0);
    static const char *const errors[] = {"surface_to_envelope", "envelope_to_surface"};
    for (int k = 0; k < 2; k++)
      assert_near(pipeline_number(with, errors[k]), pipeline_number(without, errors[k]) + 0.0078125, 1e-15);
    if (i == 1) { /* the same out of a chain */
      qmat_value *chain[2], *level[2];
      pipeline_must_run(0, "medial.chain", "on_exceed=raise finest=0.01", in_deviating, chain);
      pipeline_must_run(0, "medial.lod", "epsilon=0.03125", (const qmat_value *[]){chain[0]}, level);
      assert_memory_equal(&level[0]->digest, &made[0]->digest, sizeof(qmat_digest));
      for (int k = 0; k < 2; k++) qmat_value_release(chain[k]), qmat_value_release(level[k]);
    }
    for (int k = 0; k < 2; k++) qmat_value_release(made[k]), qmat_value_release(expected[k]);
  }
  qmat_context context = {0};
  assert_int_equal(pipeline_run(&context, "medial.simplify", "epsilon=0.0078125", in_deviating, made),
                   QMAT_ERROR_GEOMETRY);
  assert_string_equal(context.error.field, "epsilon");
  pipeline_free(&plain);
  pipeline_free(&deviating);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_cube_goes_to_the_limit_points_of_catmull_clark),
      cmocka_unit_test(test_a_crease_ring_and_a_sharp_corner_go_to_their_limit_points),
      cmocka_unit_test(test_semi_sharp_creases_are_resolved_below_the_level),
      cmocka_unit_test(test_the_deviation_covers_what_a_far_finer_level_shows),
      cmocka_unit_test(test_the_level_is_the_first_that_epsilon_allows),
      cmocka_unit_test(test_an_octahedron_goes_to_the_limit_points_of_loop),
      cmocka_unit_test(test_the_limit_of_a_bilinear_cage_is_the_cage),
      cmocka_unit_test(test_a_cage_that_is_fine_enough_is_not_subdivided),
      cmocka_unit_test(test_the_deviation_of_other_surfaces_is_kept),
      cmocka_unit_test(test_borders_follow_their_rule),
      cmocka_unit_test(test_holes_shape_the_surface_and_are_left_out),
      cmocka_unit_test(test_surfaces_of_other_schemes_stay_beside_those_that_are_subdivided),
      cmocka_unit_test(test_surfaces_that_share_a_border_are_welded),
      cmocka_unit_test(test_a_mesh_without_subdivision_surfaces_is_the_same_value),
      cmocka_unit_test(test_a_turned_cage_gives_the_turned_limit),
      cmocka_unit_test(test_the_order_of_faces_does_not_matter),
      cmocka_unit_test(test_any_number_of_threads_gives_the_same_bytes),
      cmocka_unit_test(test_loop_on_quads_is_an_error_that_names_the_face),
      cmocka_unit_test(test_broken_faces_are_errors_that_name_them),
      cmocka_unit_test(test_nothing_left_is_an_error),
      cmocka_unit_test(test_levels_that_take_too_much_are_errors),
      cmocka_unit_test(test_edges_of_three_faces_do_not_crash),
      cmocka_unit_test(test_creases_along_no_edge_are_told),
      cmocka_unit_test(test_bounds_are_towards_the_surface_that_the_mesh_stands_for),
      cmocka_unit_test(test_collapses_leave_the_deviation_of_epsilon),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
