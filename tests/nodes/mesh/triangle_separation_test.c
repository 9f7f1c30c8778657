/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Which triangles are found to be separate: none that meet, and all of a plane that is divided into triangles. */
#include "nodes/mesh/triangle_separation.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "tests/random.h"

typedef struct triangle {
  double corners[3][3];
} triangle;

static bool are_separate(const triangle *a, const triangle *b, int shared) {
  return qmat_triangles_are_separate((const double *const[]){a->corners[0], a->corners[1], a->corners[2]},
                                     (const double *const[]){b->corners[0], b->corners[1], b->corners[2]}, shared);
}

static void by_hand(void **state) {
  (void)state;
  const triangle a = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
  /* no shared corner: beside it, above it, through it */
  assert_true(are_separate(&a, &(triangle){{{1, 1, 0}, {0.1, 1, 0}, {1, 0.1, 0}}}, 0));
  assert_true(are_separate(&a, &(triangle){{{0, 0, 0.1}, {1, 0, 0.1}, {0, 1, 0.1}}}, 0));
  assert_false(are_separate(&a, &(triangle){{{0.2, 0.2, -1}, {0.2, 0.2, 1}, {5, 5, 0}}}, 0));
  /* a corner that touches an edge */
  assert_false(are_separate(&a, &(triangle){{{0.5, 0.5, 0}, {1, 1, 0}, {0.6, 1, 0}}}, 0));
  /* one shared corner: the quadrant across, the next quadrant, and a triangle that crosses the other */
  assert_true(are_separate(&a, &(triangle){{{0, 0, 0}, {-1, 0, 0}, {0, -1, 0}}}, 1));
  assert_true(are_separate(&a, &(triangle){{{0, 0, 0}, {-0.1, 1, 0}, {-1, 0, 0}}}, 1));
  assert_false(are_separate(&a, &(triangle){{{0, 0, 0}, {0.5, 0.5, 1}, {0.5, 0.5, -1}}}, 1));
  /* an edge of both along a line, as two triangles at a T-junction have it */
  assert_false(are_separate(&a, &(triangle){{{0, 0, 0}, {0.5, 0, 0}, {0, -1, 0}}}, 1));
  /* two shared corners: the other side, a fold onto the same side, a sharp fold that does not lie on it */
  assert_true(are_separate(&a, &(triangle){{{0, 0, 0}, {1, 0, 0}, {0.3, -1, 0}}}, 2));
  assert_false(are_separate(&a, &(triangle){{{0, 0, 0}, {1, 0, 0}, {0.3, 2, 0}}}, 2));
  assert_false(are_separate(&a, &(triangle){{{0, 0, 0}, {1, 0, 0}, {0.3, 2, 0.1}}}, 2));
  assert_false(are_separate(&a, &(triangle){{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}}, 2));
}

static void degenerate_triangles_are_not_separate(void **state) {
  (void)state;
  const triangle point = {{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}}, line = {{{1, 1, 1}, {2, 2, 2}, {1, 1, 1}}};
  for (int shared = 0; shared < 3; shared++) {
    assert_false(are_separate(&point, &point, shared));
    assert_false(are_separate(&line, &line, shared));
    assert_false(are_separate(&point, &line, shared));
  }
}

static double whole(random_numbers *random) {
  return (double)random_index(random, 1 << 21) - (1 << 20);
}

/* Triangles of whole numbers that meet, of many sizes, some far from zero. Heights are rounded, corners are not. */
static void triangles_that_meet_are_never_separate(void **state) {
  (void)state;
  random_numbers random = {.seed = 7};
  for (int i = 0; i < 20000; i++) {
    const double unit = ldexp(1, (int)random_index(&random, 101) - 50), far = i % 7 == 0 ? 0x1p30 : 0;
    double v[4][3];
    for (int j = 0; j < 4; j++)
      for (int k = 0; k < 3; k++) v[j][k] = whole(&random);
    triangle a, b;
    for (int k = 0; k < 3; k++) {
      const double corners[4][2][3] = {
          /* the same centre */
          {{v[0][k], v[1][k], -v[0][k] - v[1][k]}, {v[2][k], v[3][k], -v[2][k] - v[3][k]}},
          /* a corner, and the point in the middle of the edges across from it */
          {{0, v[0][k], v[1][k]}, {0, v[2][k], v[0][k] + v[1][k] - v[2][k]}},
          /* an edge, and the same side of it */
          {{0, v[0][k], v[1][k]}, {0, v[0][k], 3 * v[1][k] + (i % 5 - 2) * v[0][k]}},
          /* a corner of one in the middle of an edge of the other, in a plane */
          {{0, 2 * v[0][k], 2 * v[1][k]}, {v[0][k] + v[1][k], 3 * v[0][k] + v[1][k], v[0][k] + 3 * v[1][k]}},
      };
      for (int j = 0; j < 3; j++) {
        a.corners[j][k] = unit * (far + corners[i % 4][0][j]);
        b.corners[j][k] = unit * (far + corners[i % 4][1][j]);
      }
    }
    assert_false(are_separate(&a, &b, i % 4 % 3));
  }
}

enum { SIDE = 12 };

static void place(int i, int j, double bend, double out[3]) {
  const double u = i + 0.3 * j, w = j - 0.1 * i;
  out[0] = 100 + 0.6 * u - 0.48 * w;
  out[1] = 0.8 * u + 0.36 * w;
  out[2] = 0.8 * w + bend * u * u;
}

/* All pairs of triangles of a turned grid that have two corners in common at most. */
static void all_triangles_of_a_divided_plane_are_separate(void **state) {
  (void)state;
  enum { COUNT = 2 * SIDE * SIDE };
  static int corners[COUNT][3];
  for (int i = 0; i < SIDE; i++)
    for (int j = 0; j < SIDE; j++) {
      const int at = i * (SIDE + 1) + j, t = 2 * (i * SIDE + j);
      memcpy(corners[t], (int[]){at, at + SIDE + 1, at + 1}, sizeof corners[t]);
      memcpy(corners[t + 1], (int[]){at + 1, at + SIDE + 1, at + SIDE + 2}, sizeof corners[t]);
    }
  for (int bent = 0; bent < 2; bent++)
    for (int s = 0; s < COUNT; s++)
      for (int t = s + 1; t < COUNT; t++) {
        int a[3], b[3], shared = 0;
        memcpy(a, corners[s], sizeof a);
        memcpy(b, corners[t], sizeof b);
        for (int i = 0; i < 3; i++)
          for (int j = shared; j < 3; j++)
            if (a[i] == b[j]) {
              const int same = a[i];
              a[i] = a[shared];
              b[j] = b[shared];
              a[shared] = b[shared] = same;
              shared++;
              break;
            }
        triangle first, second;
        for (int k = 0; k < 3; k++) {
          place(a[k] / (SIDE + 1), a[k] % (SIDE + 1), 0.01 * bent, first.corners[k]);
          place(b[k] / (SIDE + 1), b[k] % (SIDE + 1), 0.01 * bent, second.corners[k]);
        }
        assert_true(are_separate(&first, &second, shared));
        assert_true(are_separate(&second, &first, shared));
      }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(by_hand),
      cmocka_unit_test(degenerate_triangles_are_not_separate),
      cmocka_unit_test(triangles_that_meet_are_never_separate),
      cmocka_unit_test(all_triangles_of_a_divided_plane_are_separate),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
