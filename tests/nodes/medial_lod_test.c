/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "nodes/simplify/collapse_chain.h"
#include "tests/nodes/pipeline.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))
#define ASSIGN(pointer, ...) pointer = memcpy(qmat_alloc(1, sizeof(__VA_ARGS__)), __VA_ARGS__, sizeof(__VA_ARGS__))

static qmat_chain *seal_chain(qmat_chain *chain) {
  qmat_context context = {0};
  if (qmat_value_seal(&context, &chain->base) != QMAT_OK) fail_msg("%s", context.error.message);
  qmat_context_uninit(&context);
  return chain;
}

/* A slab 0 1 2 and a cone 2 3. First 3 goes into 2, then 1 into 0, then 2 into 0. */
static qmat_chain *chain_by_hand(void) {
  qmat_chain *chain = qmat_chain_new();
  chain->sphere_count = chain->edge_count = 4;
  chain->triangle_count = 1;
  chain->sample_count = 5;
  chain->collapse_count = 3;
  ASSIGN(chain->spheres, (double[]){0, 0, 0, 1, 1, 0, 0, 2, 0, 1, 0, 3, 0, 2, 0, 4});
  ASSIGN(chain->edges, (uint32_t[]){0, 1, 0, 2, 1, 2, 2, 3});
  ASSIGN(chain->triangles, (uint32_t[]){0, 1, 2});
  ASSIGN(chain->owners, (uint32_t[]){3, 0, UINT32_MAX, 1, 3});
  ASSIGN(chain->ends, (uint32_t[]){2, 3, 0, 1, 0, 2});
  ASSIGN(chain->merged, (double[]){0, 1.5, 0, 3.5, 0.5, 0, 0, 1.5, 0.25, 0.75, 0, 2.5});
  ASSIGN(chain->errors, (double[]){0.0039, 0.0039, 0.0195});
  return seal_chain(chain);
}

static qmat_medial *take(const qmat_chain *chain, const char *params, int threads, qmat_report **report) {
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  pipeline_must_run(threads, "medial.lod", params, (const qmat_value *[]){&chain->base}, outputs);
  if (report)
    *report = (qmat_report *)outputs[1];
  else
    qmat_value_release(outputs[1]);
  return (qmat_medial *)outputs[0];
}

static void test_a_chain_by_hand_at_every_level(void **state) {
  (void)state;
  qmat_chain *chain = chain_by_hand();
  qmat_report *report;
  qmat_medial *m = take(chain, "epsilon=0 vertices=4", 1, NULL);
  assert_int_equal(m->sphere_count, 4);
  assert_memory_equal(m->spheres, chain->spheres, 16 * sizeof(double));
  assert_memory_equal(m->edges, chain->edges, 8 * sizeof(uint32_t));
  assert_memory_equal(m->region_offsets, ((uint32_t[]){0, 1, 2, 2, 4}), 5 * sizeof(uint32_t));
  assert_memory_equal(m->region_samples, ((uint32_t[]){1, 3, 0, 4}), 4 * sizeof(uint32_t));
  qmat_value_release(&m->base);

  m = take(chain, "epsilon=0.4% vertices=1", 1, &report); /* 2.5 % below lies the second error, not the third */
  assert_int_equal(m->sphere_count, 2);
  assert_int_equal(m->edge_count, 1);
  assert_int_equal(m->triangle_count, 0);
  assert_memory_equal(m->spheres, ((double[]){0.5, 0, 0, 1.5, 0, 1.5, 0, 3.5}), 8 * sizeof(double));
  assert_memory_equal(m->edges, ((uint32_t[]){0, 1}), 2 * sizeof(uint32_t));
  assert_memory_equal(m->region_samples, ((uint32_t[]){1, 3, 0, 4}), 4 * sizeof(uint32_t));
  assert_int_equal(pipeline_count(report, "collapses"), 2);
  assert_near(pipeline_number(report, "threshold"), 0.0039, 0);
  qmat_value_release(&m->base);
  qmat_value_release(&report->base);

  m = take(chain, "epsilon=0.39%", 1, &report); /* so close below an error that the rest is not left */
  assert_int_equal(m->sphere_count, 4);
  assert_near(pipeline_number(report, "threshold"), 0, 0);
  qmat_value_release(&m->base);
  qmat_value_release(&report->base);

  m = take(chain, "epsilon=0 vertices=3", 1, NULL);
  assert_int_equal(m->sphere_count, 3);
  assert_memory_equal(m->triangles, ((uint32_t[]){0, 1, 2}), 3 * sizeof(uint32_t));
  assert_near(m->spheres[11], 3.5, 0);
  qmat_value_release(&m->base);

  m = take(chain, "epsilon=0", 1, NULL);
  assert_int_equal(m->sphere_count, 1);
  assert_int_equal(m->edge_count, 0);
  assert_memory_equal(m->spheres, ((double[]){0.25, 0.75, 0, 2.5}), 4 * sizeof(double));
  assert_int_equal(m->region_sample_count, 4); /* nobody answers for sample 2 */
  qmat_value_release(&m->base);
  qmat_value_release(&chain->base);
}

static void test_a_chain_without_collapses_is_its_medial_mesh(void **state) {
  (void)state;
  qmat_chain *chain = qmat_chain_new();
  chain->sphere_count = 1;
  ASSIGN(chain->spheres, (double[]){1, 2, 3, 4});
  seal_chain(chain);
  qmat_medial *m = take(chain, "", 1, NULL);
  assert_int_equal(m->sphere_count, 1);
  assert_memory_equal(m->spheres, chain->spheres, 4 * sizeof(double));
  qmat_value_release(&m->base);
  qmat_value_release(&chain->base);
}

static void test_an_empty_chain_is_refused_by_name(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_chain *chain = seal_chain(qmat_chain_new());
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  assert_int_equal(pipeline_run(&context, "medial.lod", "", (const qmat_value *[]){&chain->base}, outputs),
                   QMAT_ERROR_GEOMETRY);
  assert_string_equal(context.error.field, "chain");
  qmat_value_release(&chain->base);
  qmat_context_uninit(&context);
}

/* What is left of an edge or triangle after a chain, found by walking from sphere to sphere. */
static void test_roots_are_where_a_walk_ends(void **state) {
  (void)state;
  enum { SPHERES = 200, COLLAPSES = 150 };
  uint32_t ends[2 * COLLAPSES], roots[SPHERES], went_into[SPHERES];
  uint64_t random = 7;
  for (uint32_t v = 0; v < SPHERES; v++) went_into[v] = v;
  for (size_t i = 0; i < COLLAPSES; i++)
    for (;;) {
      random = random * 6364136223846793005u + 1442695040888963407u;
      const uint32_t a = (uint32_t)(random >> 33) % SPHERES, b = (uint32_t)(random >> 45) % SPHERES;
      if (a == b || went_into[a] != a || went_into[b] != b) continue;
      ends[2 * i] = a;
      ends[2 * i + 1] = b;
      went_into[b] = a;
      break;
    }
  qmat_collapse_roots(ends, COLLAPSES, SPHERES, roots);
  for (uint32_t v = 0; v < SPHERES; v++) {
    uint32_t end = v;
    while (went_into[end] != end) end = went_into[end];
    assert_int_equal(roots[v], end);
  }
}

typedef struct setting {
  const char *model;
  int resolution;
  const char *chain, *simplify; /* the same run, for both nodes */
  bool sharp;                   /* with medial.features */
} setting;

static const setting settings[] = {
    {"octopus", 6, "finest=3%", "finest=3% on_exceed=raise", false},
    {"torus", 6, "finest=3% topology=free", "finest=3% on_exceed=raise topology=free", false},
    {"capsule", 8, "finest=3% on_exceed=stop", "finest=3% on_exceed=stop", false},
    {"octopus", 6, "finest=3% error=one_sided on_exceed=stop protect=late",
     "finest=3% error=one_sided on_exceed=stop protect=late", false},
    {"torus", 6, "finest=3% error=one_sided", "finest=3% error=one_sided on_exceed=raise", false},
    {"capsule", 4, "finest=3% cost=hausdorff", "finest=3% cost=hausdorff on_exceed=raise", false},
    {"torus", 6, "finest=3% cost=pmat on_exceed=stop", "finest=3% cost=pmat on_exceed=stop", false},
    {"torus", 6, "finest=3% compat=qmat", "finest=3% compat=qmat", false},
    {"box", 4, "finest=3%", "finest=3% on_exceed=raise", true},
    {"l-bracket", 4, "finest=3% crease=1 on_exceed=stop", "finest=3% crease=1 on_exceed=stop", true},
};

static const char *const bounds[] = {"epsilon=0 vertices=1",  "epsilon=0 vertices=60",  "epsilon=2% vertices=0",
                                     "epsilon=3% vertices=0", "epsilon=7% vertices=40", "epsilon=100% vertices=0"};

/* The medial mesh with features in place of the initial one. */
static void add_features(pipeline *p) {
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  pipeline_must_run(0, "medial.features", "features=sharp", (const qmat_value *[]){&p->mesh->base, &p->medial->base},
                    outputs);
  qmat_value_release(&p->medial->base);
  p->medial = (qmat_medial *)outputs[0];
  assert_true(pipeline_count((const qmat_report *)outputs[1], "spheres") > 0);
  qmat_value_release(outputs[1]);
}

static void test_every_level_is_what_a_run_of_its_own_makes(void **state) {
  (void)state;
  size_t levels = 0;
  for (size_t i = 0; i < COUNT(settings); i++) {
    const setting *s = &settings[i];
    pipeline p = {0};
    pipeline_make(&p, pipeline_model(s->model, s->resolution), "spacing=8% n_f=0", "");
    if (s->sharp) add_features(&p);
    const qmat_value *inputs[] = {&p.mesh->base, &p.thickness->base, &p.samples->base, &p.medial->base};
    qmat_value *outputs[PIPELINE_MOST_PORTS], *direct[PIPELINE_MOST_PORTS];
    pipeline_must_run(0, "medial.chain", s->chain, inputs, outputs);
    const qmat_chain *chain = (const qmat_chain *)outputs[0];
    assert_true(chain->collapse_count > 0);
    size_t before = 0;
    for (size_t k = 0; k < COUNT(bounds); k++) {
      static const int threads[] = {1, 2, 8};
      char params[256];
      if (strstr(s->chain, "compat=qmat") && strncmp(bounds[k], "epsilon=0 ", 10) != 0) continue; /* no bound there */
      snprintf(params, sizeof params, "%s %s", s->simplify, bounds[k]);
      pipeline_must_run(threads[k % 3], "medial.simplify", params, inputs, direct);
      qmat_medial *m = take(chain, bounds[k], threads[(k + 1) % 3], NULL);
      if (memcmp(&m->base.digest, &direct[0]->digest, sizeof m->base.digest) != 0)
        fail_msg("%s %s: %zu spheres of the chain, %zu of the run", s->model, params, m->sphere_count,
                 ((const qmat_medial *)direct[0])->sphere_count);
      assert_true((pipeline_features(m) > 0) == s->sharp);
      levels += m->sphere_count != before;
      before = m->sphere_count;
      qmat_value_release(&m->base);
      qmat_value_release(direct[0]);
      qmat_value_release(direct[1]);
    }
    qmat_value_release(outputs[0]);
    qmat_value_release(outputs[1]);
    pipeline_free(&p);
  }
  assert_true(levels > 2 * COUNT(settings));
}

static void test_both_errors_of_a_level_are_within_its_epsilon(void **state) {
  (void)state;
  static const char *const names[] = {"octopus", "torus"};
  static const double wanted[] = {0.04, 0.08, 0.16};
  for (size_t i = 0; i < COUNT(names); i++) {
    pipeline p = {0};
    pipeline_make(&p, pipeline_model(names[i], 6), "spacing=8% n_f=0", "");
    const qmat_value *inputs[] = {&p.mesh->base, &p.thickness->base, &p.samples->base, &p.medial->base};
    qmat_value *outputs[PIPELINE_MOST_PORTS], *evaluated[PIPELINE_MOST_PORTS];
    pipeline_must_run(0, "medial.chain", "finest=4%", inputs, outputs);
    size_t before = SIZE_MAX;
    for (size_t k = 0; k < COUNT(wanted); k++) {
      char params[64];
      snprintf(params, sizeof params, "epsilon=%g", wanted[k]);
      qmat_medial *m = take((const qmat_chain *)outputs[0], params, 0, NULL);
      assert_true(m->sphere_count <= before);
      before = m->sphere_count;
      pipeline_must_run(0, "medial.evaluate", params, (const qmat_value *[]){&p.mesh->base, &m->base}, evaluated);
      const qmat_report *report = (const qmat_report *)evaluated[0];
      assert_true(pipeline_number(report, "surface_to_envelope_at_least") <= wanted[k]);
      assert_true(pipeline_number(report, "envelope_out_of_solid_at_least") <= wanted[k]);
      qmat_value_release(evaluated[0]);
      qmat_value_release(&m->base);
    }
    qmat_value_release(outputs[0]);
    qmat_value_release(outputs[1]);
    pipeline_free(&p);
  }
}

/* A chain by hand whose levels of 3 spheres and 1 sphere have bounds. */
static qmat_chain *bounded_chain(const uint32_t collapses[2], double least) {
  qmat_chain *chain = qmat_chain_new();
  chain->sphere_count = 3;
  chain->collapse_count = chain->bounded_count = 2;
  ASSIGN(chain->spheres, (double[]){0, 0, 0, 1, 1, 0, 0, 2, 0, 1, 0, 3});
  ASSIGN(chain->ends, (uint32_t[]){0, 1, 0, 2});
  ASSIGN(chain->merged, (double[]){0, 1.5, 0, 3.5, 0.5, 0, 0, 1.5});
  ASSIGN(chain->errors, (double[]){0.01, 0.02});
  chain->bounded = memcpy(qmat_alloc(2, sizeof(uint32_t)), collapses, 2 * sizeof(uint32_t));
  ASSIGN(chain->bounds, (double[]){0.001, 0.002, 0.03, least});
  return chain;
}

static void test_bounds_are_reported_where_the_chain_has_them(void **state) {
  (void)state;
  qmat_chain *chain = seal_chain(bounded_chain((const uint32_t[]){0, 2}, 0.04));
  static const double expected[] = {0.001, NAN, 0.03};
  for (int spheres = 3; spheres >= 1; spheres--) {
    char params[64];
    qmat_report *report;
    snprintf(params, sizeof params, "epsilon=0 vertices=%d", spheres);
    qmat_value_release(&take(chain, params, 1, &report)->base);
    const json_t *bound = json_object_get(report->root, "surface_to_envelope");
    assert_true(bound ? json_number_value(bound) == expected[3 - spheres] : isnan(expected[3 - spheres]));
    qmat_value_release(&report->base);
  }
  qmat_value_release(&chain->base);
}

static void test_bounds_out_of_order_or_negative_are_refused(void **state) {
  (void)state;
  static const struct {
    uint32_t collapses[2];
    double least;
  } cases[] = {{{1, 1}, 0.04}, {{2, 1}, 0.04}, {{0, 3}, 0.04}, {{0, 2}, -0.04}, {{0, 2}, INFINITY}};
  for (size_t i = 0; i < COUNT(cases); i++) {
    qmat_context context = {0};
    qmat_chain *chain = bounded_chain(cases[i].collapses, cases[i].least);
    assert_int_equal(qmat_value_seal(&context, &chain->base), QMAT_ERROR_GEOMETRY);
    assert_string_equal(context.error.element_kind, "bounded level");
    qmat_value_release(&chain->base);
    qmat_context_uninit(&context);
  }
}

/* Every level up to 32 spheres, above four in each doubling, and none finer than the first one within `finest`. Each
 * bound is medial.evaluate's to within the five tolerances that boundary_distance.h promises. */
static void test_bounds_are_those_of_an_evaluation(void **state) {
  (void)state;
  pipeline p = {0};
  pipeline_make(&p, pipeline_model("octopus", 6), "spacing=8% n_f=0", "");
  const qmat_value *inputs[] = {&p.mesh->base, &p.thickness->base, &p.samples->base, &p.medial->base};
  qmat_value *outputs[PIPELINE_MOST_PORTS], *again[PIPELINE_MOST_PORTS], *evaluated[PIPELINE_MOST_PORTS];
  pipeline_must_run(2, "medial.chain", "finest=3% bounds=64", inputs, outputs);
  pipeline_must_run(8, "medial.chain", "finest=3% bounds=64", inputs, again);
  const qmat_chain *chain = (const qmat_chain *)outputs[0];
  assert_true(qmat_digest_equal(&chain->base.digest, &again[0]->digest));
  const size_t least = chain->sphere_count - chain->collapse_count;
  assert_int_equal(chain->sphere_count - chain->bounded[chain->bounded_count - 1], least);
  assert_true(chain->errors[chain->bounded[0] - 1] <= 0.03);
  for (size_t i = 1; i < chain->bounded_count; i++) {
    const size_t spheres = chain->sphere_count - chain->bounded[i], finer = chain->sphere_count - chain->bounded[i - 1];
    assert_true(chain->errors[chain->bounded[i] - 1] > 0.03);
    assert_int_equal(
        finer, spheres < 32 ? (long)spheres + 1 : lround(32 * pow(2, 0.25 * (double)(chain->bounded_count - 32))));
  }
  for (size_t i = 0; i < chain->bounded_count; i += 5) {
    char params[64];
    qmat_report *own;
    const size_t spheres = chain->sphere_count - chain->bounded[i];
    snprintf(params, sizeof params, "epsilon=0 vertices=%zu", spheres);
    qmat_medial *m = take(chain, params, 0, &own);
    assert_int_equal(m->sphere_count, spheres);
    pipeline_must_run(0, "medial.evaluate", "epsilon=3%", (const qmat_value *[]){&p.mesh->base, &m->base}, evaluated);
    const double tolerance = 0.05 * fmax(pipeline_number(own, "threshold"), 0.03);
    static const char *const keys[][2] = {{"surface_to_envelope", "surface_to_envelope_at_least"},
                                          {"envelope_to_surface", "envelope_to_surface_at_least"}};
    for (size_t k = 0; k < 2; k++) {
      const double bound = pipeline_number(own, keys[k][0]);
      const double lo = pipeline_number((const qmat_report *)evaluated[0], keys[k][1]);
      const double hi = pipeline_number((const qmat_report *)evaluated[0], keys[k][0]);
      if (!(bound >= lo && bound <= hi + 5 * tolerance))
        fail_msg("%zu spheres: %g of [%g, %g]", spheres, bound, lo, hi);
    }
    qmat_value_release(evaluated[0]);
    qmat_value_release(&own->base);
    qmat_value_release(&m->base);
  }
  for (size_t i = 0; i < 2; i++) {
    qmat_value_release(outputs[i]);
    qmat_value_release(again[i]);
  }
  pipeline_free(&p);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_chain_by_hand_at_every_level),
      cmocka_unit_test(test_a_chain_without_collapses_is_its_medial_mesh),
      cmocka_unit_test(test_an_empty_chain_is_refused_by_name),
      cmocka_unit_test(test_roots_are_where_a_walk_ends),
      cmocka_unit_test(test_every_level_is_what_a_run_of_its_own_makes),
      cmocka_unit_test(test_both_errors_of_a_level_are_within_its_epsilon),
      cmocka_unit_test(test_bounds_are_reported_where_the_chain_has_them),
      cmocka_unit_test(test_bounds_out_of_order_or_negative_are_refused),
      cmocka_unit_test(test_bounds_are_those_of_an_evaluation),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
