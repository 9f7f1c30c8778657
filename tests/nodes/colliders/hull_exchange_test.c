/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/surface.h"
#include "core/hash.h"
#include "nodes/colliders/convex_hull_cgal.h"
#include "nodes/colliders/hull_columns.h"
#include "nodes/colliders/hull_exchange.h"
#include "tests/shapes.h"

enum { MOST_CELLS = 4096, MOST_HULLS = 8 };
static const double cell_volume = 1.0 / (QMAT_SOLID_CELLS * QMAT_SOLID_CELLS * QMAT_SOLID_CELLS);

typedef struct solid {
  qmat_solid_part parts[MOST_HULLS];
  qmat_hull_pieces hulls[MOST_HULLS];
  size_t count; /* of parts, each with a hull at first */
} solid;

/* Adds the corners of a box of cells to a part; a box of height 0 is flat. */
static void add_cells(solid *s, size_t part, const int low[3], const int end[3]) {
  qmat_solid_part *p = &s->parts[part];
  if (!p->cells) {
    p->cells = qmat_calloc(MOST_CELLS, sizeof *p->cells);
    p->cell_points = qmat_calloc(MOST_CELLS, 24 * sizeof *p->cell_points);
    p->points = qmat_calloc(MOST_CELLS, 24 * sizeof *p->points);
    s->hulls[part] = (qmat_hull_pieces){1, qmat_calloc(1, sizeof *s->hulls[part].pieces), (uint32_t)part};
    s->hulls[part].pieces[0] = qmat_part_whole((uint32_t)part);
    s->count++;
  }
  const int height = end[2] > low[2];
  for (int x = low[0]; x < end[0]; x++)
    for (int y = low[1]; y < end[1]; y++)
      for (int z = low[2]; z < end[2] + !height; z++) {
        const int at[3] = {x, y, z};
        qmat_solid_cell *cell = &p->cells[p->cell_count];
        *cell = (qmat_solid_cell){{(uint8_t)x, (uint8_t)y, (uint8_t)z}, 8, 8};
        for (int i = 0; i < 24; i++) {
          const int up = i % 3 == 2 && !height ? 0 : i / 3 >> i % 3 & 1;
          p->cell_points[24 * p->cell_count + (size_t)i] = (double)(at[i % 3] + up) / QMAT_SOLID_CELLS - 0.5;
        }
        p->cell_count++;
      }
  p->count = 8 * p->cell_count;
  memcpy(p->points, p->cell_points, 3 * p->count * sizeof *p->points);
}

static void free_solid(solid *s) {
  qmat_solid_parts_free(s->parts, s->count);
  for (size_t i = 0; i < s->count; i++) qmat_free(s->hulls[i].pieces);
}

/* The volume of the union of the hulls, in cells, by lines; a cell is in one hull. */
static double volume_of(const solid *s) {
  double volume = 0;
  for (size_t p = 0; p < s->count; p++)
    for (size_t c = 0; c < s->parts[p].cell_count; c++) {
      int found = 0;
      for (size_t h = 0; h < s->count; h++)
        for (size_t i = 0; i < s->hulls[h].count; i++)
          found +=
              s->hulls[h].pieces[i].part == p && qmat_part_piece_has(&s->hulls[h].pieces[i], &s->parts[p].cells[c]);
      assert_int_equal(found, 1);
    }
  qmat_hull_columns columns[MOST_HULLS] = {0};
  const qmat_hull_columns *others[MOST_HULLS];
  for (size_t h = 0; h < s->count; h++) {
    double *points;
    size_t count, triangle_count;
    assert_int_equal(qmat_hull_pieces_points(s->parts, &s->hulls[h], false, &points, &count), QMAT_OK);
    uint32_t *triangles = qmat_calloc(count, 6 * sizeof *triangles);
    if (qmat_convex_hull(points, count, triangles, &triangle_count) == QMAT_OK)
      assert_int_equal(qmat_hull_columns_make(points, triangles, triangle_count, &columns[h]), QMAT_OK);
    volume += qmat_hull_columns_beyond(&columns[h], others, h) / cell_volume;
    others[h] = &columns[h];
    qmat_free(triangles);
    qmat_free(points);
  }
  for (size_t h = 0; h < s->count; h++) qmat_hull_columns_free(&columns[h]);
  return volume;
}

/* Takes the mesh over: what joint hulls leave by at most twice the limit. */
static void exchange_within(solid *s, qmat_mesh *mesh, double limit, int threads) {
  qmat_context context = {.threads = threads};
  qmat_surface *surface;
  shape_seal(mesh);
  assert_int_equal(qmat_surface_new(&context, mesh, &surface), QMAT_OK);
  assert_int_equal(qmat_hulls_exchange(&context, surface, limit, s->parts, s->hulls, s->count), QMAT_OK);
  qmat_surface_free(surface);
  qmat_value_release(&mesh->base);
  qmat_context_uninit(&context);
}

static void exchange(solid *s, int threads) {
  exchange_within(s, shape_box(1, 1, 1), INFINITY, threads);
}

/* An L has one hull, a bar has two. Then the L has two, which are its arms, and the bar has one. */
static void test_an_l_takes_the_hull_that_a_bar_does_not_need(void **state) {
  (void)state;
  solid s = {0};
  add_cells(&s, 0, (int[]){10, 10, 10}, (int[]){30, 14, 14});
  add_cells(&s, 0, (int[]){10, 14, 10}, (int[]){14, 30, 14});
  add_cells(&s, 1, (int[]){10, 40, 10}, (int[]){20, 44, 14});
  add_cells(&s, 2, (int[]){20, 40, 10}, (int[]){30, 44, 14});
  assert_near(volume_of(&s), 20 * 20 * 4 - 16 * 16 / 2 * 4 + 20 * 4 * 4, 20);
  exchange(&s, 1);
  assert_near(volume_of(&s), 20 * 4 * 4 + 16 * 4 * 4 + 20 * 4 * 4, 1e-3);
  free_solid(&s);
}

/* Adds a box of cells to a part and to the surface. */
static void add_box(solid *s, size_t part, qmat_mesh *mesh, const int low[3], const int end[3]) {
  double corner[6];
  for (int k = 0; k < 6; k++) corner[k] = (double)(k < 3 ? low[k] : end[k - 3]) / QMAT_SOLID_CELLS - 0.5;
  add_cells(s, part, low, end);
  shape_add_box(mesh, corner[0], corner[1], corner[2], corner[3], corner[4], corner[5], false);
}

/* An L has one hull, and each arm of a flatter L has one. The joint hull of these arms adds 256 cells and leaves the
 * solid by 8 of 64; the first L saves 512. That is an exchange where twice the limit is more than 1/8. */
static void test_joint_hulls_stay_near_the_solid(void **state) {
  (void)state;
  const double limits[] = {0.03, 0.1}, after[] = {1088 + 66, 576 + 66 + 256};
  for (int i = 0; i < 2; i++) {
    solid s = {0};
    qmat_mesh *mesh = shape_new();
    add_box(&s, 0, mesh, (int[]){14, 14, 14}, (int[]){34, 18, 18});
    add_box(&s, 0, mesh, (int[]){14, 18, 14}, (int[]){18, 34, 18});
    add_box(&s, 1, mesh, (int[]){14, 14, 30}, (int[]){31, 15, 32});
    add_box(&s, 2, mesh, (int[]){14, 15, 30}, (int[]){15, 31, 32});
    /* So that the unit frame is that of the cells. */
    const double far = 0.5 / sqrt(3), near = far - 1e-3;
    shape_add_box(mesh, -far, -far, -far, -near, -near, -near, false);
    shape_add_box(mesh, near, near, near, far, far, far, false);
    assert_near(volume_of(&s), 1088 + 66, 20);
    exchange_within(&s, mesh, limits[i], 1);
    assert_near(volume_of(&s), after[i], 20);
    free_solid(&s);
  }
}

/* No division gains where all hulls are boxes, and all stay. */
static void test_boxes_stay(void **state) {
  (void)state;
  solid s = {0};
  add_cells(&s, 0, (int[]){10, 10, 10}, (int[]){20, 20, 14});
  add_cells(&s, 1, (int[]){20, 10, 10}, (int[]){30, 15, 14});
  exchange(&s, 1);
  for (uint32_t i = 0; i < 2; i++) {
    const qmat_part_piece whole = qmat_part_whole(i);
    assert_int_equal(s.hulls[i].count, 1);
    assert_memory_equal(s.hulls[i].pieces, &whole, sizeof whole);
  }
  free_solid(&s);
}

/* Points in a plane have no hull. One hull has none to exchange with. */
static void test_flat_hulls_and_a_single_one_stay(void **state) {
  (void)state;
  solid s = {0};
  add_cells(&s, 0, (int[]){10, 10, 10}, (int[]){20, 11, 10});
  add_cells(&s, 0, (int[]){10, 11, 10}, (int[]){11, 20, 10});
  exchange(&s, 1);
  assert_int_equal(s.hulls[0].count, 1);
  add_cells(&s, 1, (int[]){30, 10, 10}, (int[]){40, 11, 10});
  exchange(&s, 1);
  assert_near(volume_of(&s), 0, 0);
  free_solid(&s);
}

/* Of random boxes beside a bar of two hulls, the hulls have less volume after than before, and the same pieces for any
 * number of threads. */
static void test_random_solids_lose_volume(void **state) {
  (void)state;
  for (uint64_t round = 0; round < 4; round++) {
    const int threads[] = {1, 2, 8};
    solid s[3] = {0};
    double before = 0;
    for (int t = 0; t < 3; t++) {
      for (uint64_t box = 0; box < 18; box++) {
        int low[3], end[3];
        for (int k = 0; k < 3; k++) { /* apart from each other: each has its own cells of 8 x 8 x 8 */
          const uint64_t place = qmat_hash3(round, box % 6, 7) % 8;
          low[k] = (int)(8 * (k == 0 ? box % 6 : k == 1 ? (box / 6 + place) % 6 : place % 3));
          end[k] = low[k] + 1 + (int)(qmat_hash3(round, box, (uint64_t)k) % 8);
        }
        add_cells(&s[t], box % 6, low, end);
      }
      add_cells(&s[t], 6, (int[]){56, 40, 40}, (int[]){60, 50, 44});
      add_cells(&s[t], 7, (int[]){56, 50, 40}, (int[]){60, 60, 44});
      before = volume_of(&s[t]);
      exchange(&s[t], threads[t]);
    }
    assert_true(volume_of(&s[0]) < before);
    for (int t = 1; t < 3; t++)
      for (size_t h = 0; h < s[0].count; h++) {
        assert_int_equal(s[t].hulls[h].count, s[0].hulls[h].count);
        assert_memory_equal(s[t].hulls[h].pieces, s[0].hulls[h].pieces, s[0].hulls[h].count * sizeof(qmat_part_piece));
      }
    for (int t = 0; t < 3; t++) free_solid(&s[t]);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_an_l_takes_the_hull_that_a_bar_does_not_need),
      cmocka_unit_test(test_joint_hulls_stay_near_the_solid),
      cmocka_unit_test(test_boxes_stay),
      cmocka_unit_test(test_flat_hulls_and_a_single_one_stay),
      cmocka_unit_test(test_random_solids_lose_volume),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
