/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/boundary_pieces.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/geometry/medial_build.h"
#include "core/geometry/medial_distance.h"
#include "core/geometry/vector.h"
#include "tests/medial_distances.h"
#include "tests/random.h"

#define ROUNDING 1e-12

enum { MESHES = 60, DEPTH = 5, POINTS = 20 };

/* Three spheres joined by a slab, and a fourth by a cone. */
static qmat_medial *random_medial(qmat_context *context, random_numbers *random) {
  static const uint32_t edges[] = {2, 3}, triangle[] = {0, 1, 2};
  qmat_medial *medial = qmat_medial_new();
  assert_non_null(medial);
  medial->sphere_count = 4;
  medial->spheres = qmat_alloc(4, 4 * sizeof *medial->spheres);
  assert_non_null(medial->spheres);
  for (int i = 0; i < 16; i++)
    medial->spheres[i] = i % 4 == 3 ? random_between(random, 0, 0.2) : random_between(random, -0.5, 0.5);
  assert_int_equal(qmat_medial_set_simplices(context, medial, edges, 1, triangle, 1), QMAT_OK);
  assert_int_equal(qmat_value_seal(context, &medial->base), QMAT_OK);
  return medial;
}

/* A random point of a piece. */
static void point_of_piece(const qmat_boundary_features *f, const qmat_boundary_piece *p, random_numbers *random,
                           double point[3]) {
  if (p->feature == QMAT_CELL) {
    for (int k = 0; k < 3; k++) point[k] = p->at[k] + random_between(random, -1, 1) * p->at[3];
    return;
  }
  size_t row;
  double weights[3], sum = 0, direction[3], sphere[4];
  qmat_cone_side side;
  switch (qmat_boundary_feature_kind(f, p->feature, &row)) {
    case QMAT_FEATURE_CONE_SIDE:
      assert_true(qmat_cone_side_of_edge(f, row, &side));
      qmat_cone_side_sphere(&side, random_between(random, p->at[0], p->at[1]), sphere);
      qmat_cone_side_normal(&side, random_between(random, p->at[2], p->at[3]), direction);
      for (int k = 0; k < 3; k++) point[k] = sphere[k] + sphere[3] * direction[k];
      return;
    default:
      for (int i = 0; i < 3; i++) sum += weights[i] = random_between(random, 0, 1);
      for (int k = 0; k < 3; k++)
        point[k] = (weights[0] * p->at[k] + weights[1] * p->at[3 + k] + weights[2] * p->at[6 + k]) / sum;
  }
  if (p->feature >= f->sphere_count) return;
  qmat_normalize(point);
  for (int k = 0; k < 3; k++) point[k] = f->spheres[4 * row + (size_t)k] + f->spheres[4 * row + 3] * point[k];
}

/* How deep the point lies in the envelope. */
static double depth_of(const qmat_medial *medial, const double point[3]) {
  const double *s = medial->spheres;
  qmat_slab slab;
  double depth = -INFINITY;
  for (size_t e = 0; e < medial->edge_count; e++)
    depth = fmax(depth,
                 -cone_distance(&s[4 * (size_t)medial->edges[2 * e]], &s[4 * (size_t)medial->edges[2 * e + 1]], point));
  qmat_slab_prepare(&slab, &s[4 * (size_t)medial->triangles[0]], &s[4 * (size_t)medial->triangles[1]],
                    &s[4 * (size_t)medial->triangles[2]]);
  return fmax(depth, -qmat_slab_prepared_distance(&slab, point));
}

/* A point within `bulge` of a hull is at most that farther in any direction than the farthest corner. */
static void check_hull(double points[4][3], int count, double bulge, const double point[3], random_numbers *random) {
  double direction[3], farthest = -INFINITY;
  for (int k = 0; k < 3; k++) direction[k] = random_between(random, -1, 1);
  qmat_normalize(direction);
  for (int i = 0; i < count; i++) farthest = fmax(farthest, qmat_dot(direction, points[i]));
  assert_true(qmat_dot(direction, point) <= farthest + bulge + ROUNDING);
}

/* The ball of the piece, and those of a random line of descendants, hold what they should. */
static void check_piece(const qmat_medial *medial, const qmat_boundary_features *f, qmat_boundary_piece piece,
                        random_numbers *random, size_t *buried) {
  for (int level = 0; level < DEPTH; level++) {
    double middle[3], reach, point[3], hull[4][3], bulge;
    const int corners = qmat_boundary_piece_hull(f, &piece, hull, &bulge);
    assert_int_equal(corners > 0, piece.feature != QMAT_CELL);
    const bool exposed = qmat_boundary_piece_ball(f, &piece, middle, &reach);
    *buried += !exposed;
    for (int i = 0; i < POINTS; i++) {
      point_of_piece(f, &piece, random, point);
      assert_true(qmat_point_distance(middle, point) <= reach + ROUNDING);
      if (corners > 0) check_hull(hull, corners, bulge, point, random);
      if (!exposed) assert_true(depth_of(medial, point) >= QMAT_BOUNDARY_SKIN - ROUNDING);
    }
    qmat_boundary_piece children[QMAT_MOST_PIECES];
    qmat_boundary_piece_split(f, &piece, children);
    piece = children[random_index(random, (size_t)qmat_boundary_piece_child_count(f, &piece))];
  }
}

static void test_balls_and_hulls_hold_random_pieces_and_only_buried_ones_are_left_out(void **state) {
  (void)state;
  random_numbers random = {.seed = 11};
  size_t checked[3] = {0, 0, 0}, buried = 0;
  for (int mesh = 0; mesh < MESHES; mesh++) {
    qmat_context context = {0};
    qmat_medial *medial = random_medial(&context, &random);
    qmat_boundary_features f;
    assert_int_equal(qmat_boundary_features_init(&context, medial, &f), QMAT_OK);
    for (size_t feature = 0; feature < qmat_boundary_features_count(&f); feature++) {
      qmat_boundary_piece pieces[QMAT_MOST_PIECES];
      size_t row;
      const size_t count = qmat_boundary_pieces_of_feature(&f, feature, 1, pieces);
      checked[qmat_boundary_feature_kind(&f, feature, &row)] += count;
      for (size_t i = 0; i < count; i++) check_piece(medial, &f, pieces[i], &random, &buried);
    }
    check_piece(medial, &f, qmat_boundary_piece_of_space(&f, 1), &random, &buried);
    qmat_value_release(&medial->base);
    qmat_context_uninit(&context);
  }
  assert_true(checked[QMAT_FEATURE_SPHERE] > 0 && checked[QMAT_FEATURE_CONE_SIDE] > 0);
  assert_true(checked[QMAT_FEATURE_SLAB_FACE] > 0 && buried > 0);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_balls_and_hulls_hold_random_pieces_and_only_buried_ones_are_left_out),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
