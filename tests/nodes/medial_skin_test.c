/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/envelope.h"
#include "core/geometry/surface.h"
#include "core/hash.h"
#include "core/node.h"
#include "nodes/measure/boundary_features.h"
#include "nodes/skin/flat_primitives.h"
#include "tests/medial_meshes.h"
#include "tests/nodes/pipeline.h"
#include "tests/shapes.h"

extern const qmat_node qmat_node_medial_skin;

static const double PI = 3.14159265358979323846;

typedef struct skin_result {
  qmat_mesh *mesh;
  qmat_report *report;
} skin_result;

/* Runs the node with the parameters of `settings`: "name=value name=value", without decimation where it does not set
 * the error. Releases the medial mesh. */
static qmat_status try_skin(qmat_context *context, qmat_medial *medial, const char *settings, skin_result *result) {
  const qmat_node *node = &qmat_node_medial_skin;
  double params[16];
  assert_true(node->params_size <= sizeof params);
  qmat_params_default(node, params);
  char text[256];
  snprintf(text, sizeof text, "%s%s", strstr(settings, "error=") ? "" : "error=0 ", settings);
  char *rest = text;
  for (char *word; (word = strtok_r(rest, " ", &rest)) != NULL;) {
    char *value = strchr(word, '=');
    assert_non_null(value);
    *value++ = 0;
    const qmat_param *param = qmat_param_find(node, word);
    assert_non_null(param);
    assert_int_equal(qmat_param_parse(context, param, value, params), QMAT_OK);
  }
  const qmat_value *inputs[2] = {&medial->base};
  qmat_value *outputs[2] = {NULL, NULL};
  qmat_status status = qmat_params_check(context, node, params);
  if (status == QMAT_OK) status = node->run(context, params, inputs, outputs);
  if (status != QMAT_OK) {
    assert_null(outputs[0]);
    assert_null(outputs[1]);
  }
  *result = (skin_result){(qmat_mesh *)outputs[0], (qmat_report *)outputs[1]};
  qmat_value_release(&medial->base);
  return status;
}

static skin_result skin(qmat_medial *medial, const char *settings) {
  qmat_context context = {0};
  skin_result result;
  if (try_skin(&context, medial, settings, &result) != QMAT_OK) fail_msg("%s", context.error.message);
  assert_true(result.mesh->base.sealed && result.report->base.sealed);
  assert_true(result.mesh->closed && result.mesh->oriented);
  qmat_context_uninit(&context);
  return result;
}

static void release(skin_result result) {
  qmat_value_release(&result.mesh->base);
  qmat_value_release(&result.report->base);
}

static double number_of(skin_result result, const char *key) {
  const json_t *value = json_object_get(result.report->root, key);
  if (!json_is_number(value)) fail_msg("the report has no number %s", key);
  return json_number_value(value);
}

typedef struct directed_edge {
  uint32_t from, to, triangle;
} directed_edge;

static int by_ends(const void *left, const void *right) {
  const directed_edge *a = left, *b = right;
  if (a->from != b->from) return a->from < b->from ? -1 : 1;
  return (a->to > b->to) - (a->to < b->to);
}

/* Every edge lies on two triangles that disagree on its direction, the triangles at each vertex form one ring, and
 * every vertex is used. */
static void assert_manifold(const qmat_mesh *mesh) {
  const size_t count = 3 * mesh->triangle_count;
  directed_edge *edges = calloc(count + 1, sizeof *edges);
  uint32_t *valence = calloc(mesh->vertex_count, sizeof *valence);
  for (size_t i = 0; i < count; i++) {
    const uint32_t a = mesh->triangles[i], b = mesh->triangles[i % 3 == 2 ? i - 2 : i + 1];
    edges[i] = (directed_edge){a, b, (uint32_t)(i / 3)};
    valence[a]++;
  }
  qsort(edges, count, sizeof *edges, by_ends);
  for (size_t i = 1; i < count; i++) assert_true(by_ends(edges + i - 1, edges + i) < 0);
  size_t at = 0;
  for (uint32_t v = 0; v < mesh->vertex_count; v++) {
    assert_true(valence[v] >= 3);
    assert_int_equal(edges[at].from, v);
    /* From an edge v->w in a triangle (v, w, x) on to v->x. */
    uint32_t steps = 0;
    const directed_edge *edge = edges + at;
    do {
      const uint32_t *t = mesh->triangles + 3 * (size_t)edge->triangle;
      const uint32_t next = t[0] == v ? t[2] : t[1] == v ? t[0] : t[1];
      const directed_edge key = {v, next, 0};
      edge = bsearch(&key, edges, count, sizeof *edges, by_ends);
      assert_non_null(edge);
      steps++;
    } while (edge != edges + at && steps <= valence[v]);
    assert_int_equal(steps, valence[v]);
    at += valence[v];
  }
  free(valence);
  free(edges);
}

static void assert_no_triangle_is_degenerate(const qmat_mesh *mesh) {
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const double *p[3];
    for (size_t k = 0; k < 3; k++) p[k] = mesh->positions + 3 * (size_t)mesh->triangles[3 * t + k];
    double n[3], longest = 0, size = 0;
    for (int k = 0; k < 3; k++) {
      const int l = (k + 1) % 3, m = (k + 2) % 3;
      n[k] = (p[1][l] - p[0][l]) * (p[2][m] - p[0][m]) - (p[1][m] - p[0][m]) * (p[2][l] - p[0][l]);
      size += n[k] * n[k];
    }
    for (int e = 0; e < 3; e++) {
      double side = 0;
      for (int k = 0; k < 3; k++) side += (p[e][k] - p[(e + 1) % 3][k]) * (p[e][k] - p[(e + 1) % 3][k]);
      longest = fmax(longest, side);
    }
    if (!(sqrt(size) > 1e-7 * longest)) fail_msg("triangle %zu is degenerate", t);
  }
}

static double area_of(const qmat_mesh *mesh) {
  double area = 0;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const double *a = mesh->positions + 3 * (size_t)mesh->triangles[3 * t];
    const double *b = mesh->positions + 3 * (size_t)mesh->triangles[3 * t + 1];
    const double *c = mesh->positions + 3 * (size_t)mesh->triangles[3 * t + 2];
    double n2 = 0;
    for (int k = 0; k < 3; k++) {
      const int l = (k + 1) % 3, m = (k + 2) % 3;
      const double n = (b[l] - a[l]) * (c[m] - a[m]) - (b[m] - a[m]) * (c[l] - a[l]);
      n2 += n * n;
    }
    area += 0.5 * sqrt(n2);
  }
  return area;
}

/* Positive when triangles look outwards. */
static double volume_of(const qmat_mesh *mesh) {
  const double *o = mesh->positions;
  double volume = 0;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    double p[3][3];
    for (size_t c = 0; c < 3; c++) {
      for (size_t k = 0; k < 3; k++) p[c][k] = mesh->positions[3 * (size_t)mesh->triangles[3 * t + c] + k] - o[k];
    }
    volume += p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) + p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) +
              p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
  }
  return volume / 6;
}

static void check_shape(skin_result result, int euler, int components, double area, double volume, double tolerance) {
  assert_manifold(result.mesh);
  if (strcmp(json_string_value(json_object_get(result.report->root, "method")), "envelope") == 0) {
    assert_no_triangle_is_degenerate(result.mesh);
  }
  assert_near(number_of(result, "euler_characteristic"), euler, 0);
  assert_near(number_of(result, "components"), components, 0);
  assert_near(number_of(result, "vertices"), (double)result.mesh->vertex_count, 0);
  assert_near(number_of(result, "triangles"), (double)result.mesh->triangle_count, 0);
  assert_near(area_of(result.mesh) / area, 1, tolerance);
  assert_near(volume_of(result.mesh) / volume, 1, tolerance);
}

static qmat_medial *ball(void) {
  return sealed_medial_mesh((double[]){3, -2, 5, 2}, 1, NULL, 0, NULL, 0);
}

static qmat_medial *capsule(double growth) {
  const double spheres[] = {0, 0, 0, 1, 3, 4, 0, 1 + growth};
  return sealed_medial_mesh(spheres, 2, (uint32_t[]){0, 1}, 1, NULL, 0);
}

static qmat_medial *ring(void) {
  enum { COUNT = 24 };
  double spheres[4 * COUNT];
  uint32_t edges[2 * COUNT];
  for (uint32_t i = 0; i < COUNT; i++) {
    const double sphere[4] = {cos(2 * PI * i / COUNT), sin(2 * PI * i / COUNT), 0.3 * sin(4 * PI * i / COUNT), 0.12};
    memcpy(spheres + 4 * i, sphere, sizeof sphere);
    edges[2 * i] = i;
    edges[2 * i + 1] = (i + 1) % COUNT;
  }
  return sealed_medial_mesh(spheres, COUNT, edges, COUNT, NULL, 0);
}

static qmat_medial *soup(uint64_t seed) {
  enum { COUNT = 60 };
  double spheres[4 * COUNT];
  uint32_t edges[2 * 40], triangles[3 * 25];
  for (size_t i = 0; i < COUNT; i++) {
    for (size_t k = 0; k < 3; k++) spheres[4 * i + k] = qmat_hash_unit(qmat_hash3(seed, i, k));
    const double r = qmat_hash_unit(qmat_hash3(seed, i, 3));
    spheres[4 * i + 3] = i % 10 == 0 && i < 20 ? 0 : 0.15 * r * r * r; /* no primitive has only these */
  }
  for (size_t i = 0; i < 40; i++) {
    edges[2 * i] = (uint32_t)(qmat_hash3(seed + 50, i, 0) % 59);
    edges[2 * i + 1] = edges[2 * i] + 1;
  }
  for (size_t i = 0; i < 25; i++) {
    triangles[3 * i] = (uint32_t)(qmat_hash3(seed + 60, i, 0) % 20);
    triangles[3 * i + 1] = 20 + (uint32_t)(qmat_hash3(seed + 60, i, 1) % 20);
    triangles[3 * i + 2] = 40 + (uint32_t)(qmat_hash3(seed + 60, i, 2) % 20);
  }
  return sealed_medial_mesh(spheres, COUNT, edges, 40, triangles, 25);
}

static void test_a_sphere_has_its_area_and_volume(void **unused) {
  (void)unused;
  skin_result result = skin(ball(), "resolution=128 detail=3");
  check_shape(result, 2, 1, 4 * PI * 4, 4.0 / 3 * PI * 8, 4e-4);
  const double diagonal = 4 * sqrt(3);
  assert_near(number_of(result, "diagonal"), diagonal, 1e-12);
  assert_near(number_of(result, "cell_size"), 1.0 / 128, 0);
  assert_near(number_of(result, "cell_size_model"), diagonal / 128, 1e-12);
  /* Vertices lie on the sphere but where they would leave their cell; the report says how far off they are. */
  double off = 0;
  for (size_t i = 0; i < result.mesh->vertex_count; i++) {
    const double *p = result.mesh->positions + 3 * i;
    off = fmax(off, fabs(sqrt((p[0] - 3) * (p[0] - 3) + (p[1] + 2) * (p[1] + 2) + (p[2] - 5) * (p[2] - 5)) - 2));
  }
  assert_true(off < 0.02 * diagonal / 128);
  assert_near(number_of(result, "error_at_vertices"), off / diagonal, 1e-12);
  assert_true(number_of(result, "error_at_centroids") < 1e-4);
  assert_near(number_of(result, "raised_radii"), 0, 0);
  release(result);
}

/* The largest |F| at points spread over each triangle, more of them than the node takes. */
static double farthest_from(const qmat_envelope *envelope, const qmat_mesh *mesh) {
  enum { PARTS = 7 };
  double most = 0;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    for (int i = 0; i <= PARTS; i++) {
      for (int j = 0; i + j <= PARTS; j++) {
        const double weights[3] = {(double)i / PARTS, (double)j / PARTS, (double)(PARTS - i - j) / PARTS};
        double point[3] = {0, 0, 0};
        for (size_t k = 0; k < 9; k++)
          point[k % 3] += weights[k / 3] * mesh->positions[3 * (size_t)mesh->triangles[3 * t + k / 3] + k % 3];
        most = fmax(most, fabs(qmat_envelope_distance(envelope, point, NULL)));
      }
    }
  }
  return most;
}

static void test_decimation_leaves_few_triangles_within_its_error(void **unused) {
  (void)unused;
  static const char *const settings[] = {"resolution=128 detail=3 error=0.1%", "resolution=128 detail=3 error=0.2%",
                                         "resolution=128 detail=3 error=1%"};
  qmat_context context = {0};
  size_t last = SIZE_MAX / 2;
  for (int i = 0; i < 3; i++) {
    qmat_medial *medial = ball();
    qmat_envelope *envelope;
    assert_int_equal(qmat_envelope_of_medial(&context, medial, &envelope), QMAT_OK);
    skin_result result = skin(medial, settings[i]);
    const double error = (double[]){1e-3, 2e-3, 1e-2}[i], diagonal = number_of(result, "diagonal");
    check_shape(result, 2, 1, 4 * PI * 4, 4.0 / 3 * PI * 8, 12 * error);
    assert_true(number_of(result, "contour_triangles") > 50000);
    assert_true(3 * result.mesh->triangle_count < 2 * last);
    last = result.mesh->triangle_count;
    if (i == 1) assert_true(last < 2000);
    /* The cells' own error is the share beyond what decimation may add. */
    const double farthest = farthest_from(envelope, result.mesh) / diagonal;
    assert_true(farthest <= error + 1.2e-4);
    assert_near(number_of(result, "error_at_samples"), farthest, 0.15 * error);
    assert_true(number_of(result, "error_from_contour") <= error &&
                number_of(result, "error_from_contour") > error / 4);
    qmat_envelope_free(envelope);
    release(result);
  }
  qmat_context_uninit(&context);
}

/* The largest distance from points of the envelope's boundary to the mesh: F is 0 there. */
static double farthest_from_mesh(qmat_context *context, const qmat_medial *medial, const qmat_mesh *mesh) {
  enum { STEPS = 60, TURNS = 120 };
  qmat_envelope *envelope;
  qmat_surface *surface;
  assert_int_equal(qmat_envelope_of_medial(context, medial, &envelope), QMAT_OK);
  assert_int_equal(qmat_surface_new(context, mesh, &surface), QMAT_OK);
  double most = 0;
  for (size_t e = 0; e < medial->edge_count; e++) {
    const double *a = medial->spheres + 4 * (size_t)medial->edges[2 * e];
    const double *b = medial->spheres + 4 * (size_t)medial->edges[2 * e + 1];
    const double axis[3] = {b[0] - a[0], b[1] - a[1], 0}, length = hypot(axis[0], axis[1]);
    for (int i = 0; i <= STEPS; i++) {
      for (int j = 0; j < TURNS; j++) {
        const double t = (double)i / STEPS, turn = 2 * PI * j / TURNS;
        double point[3] = {a[0] + t * axis[0] - a[3] * cos(turn) * axis[1] / length,
                           a[1] + t * axis[1] + a[3] * cos(turn) * axis[0] / length, a[2] + a[3] * sin(turn)};
        if (qmat_envelope_distance(envelope, point, NULL) < -1e-9) continue;
        qmat_frame_to_unit(qmat_surface_frame(surface), point, 1, point);
        most = fmax(most, qmat_surface_distance(surface, point, INFINITY, NULL, NULL));
      }
    }
  }
  most *= qmat_surface_frame(surface)->diagonal;
  qmat_surface_free(surface);
  qmat_envelope_free(envelope);
  return most;
}

/* Two cylinders of one end, at a small angle: the crevice between them narrows down to nothing. */
static qmat_medial *vee(void) {
  const double spheres[] = {0, 0, 0, 0.3, 3, 0.5, 0, 0.3, 3, -0.5, 0, 0.3};
  return medial_mesh(spheres, 3, (uint32_t[]){0, 1, 0, 2}, 2, NULL, 0);
}

static void test_the_error_holds_in_a_crevice_narrower_than_a_cell(void **unused) {
  (void)unused;
  qmat_context context = {0};
  qmat_medial *medial = vee();
  skin_result result = skin(vee(), "error=0.2%"), coarse = skin(vee(), "error=0.2% detail=0");
  const double diagonal = number_of(result, "diagonal");
  const double found = farthest_from_mesh(&context, medial, result.mesh) / diagonal;
  assert_true(number_of(result, "refined_cells") > 0);
  assert_manifold(result.mesh);
  assert_near(number_of(result, "euler_characteristic"), 2, 0);
  assert_true(found <= 2e-3 && number_of(result, "envelope_to_mesh") >= found);
  assert_true(number_of(result, "envelope_to_mesh") <= 2e-3 && number_of(result, "mesh_to_envelope") <= 2e-3);
  assert_null(json_object_get(result.report->root, "warnings"));
  assert_near(result.mesh->deviation,
              diagonal * fmax(number_of(result, "envelope_to_mesh"), number_of(result, "mesh_to_envelope")), 1e-12);
  /* Cells that cannot be halved miss the error, and the mesh says so. */
  const double missed = farthest_from_mesh(&context, medial, coarse.mesh) / diagonal;
  assert_true(missed > 2e-3 && coarse.mesh->deviation >= missed * diagonal);
  assert_int_equal(json_array_size(json_object_get(coarse.report->root, "warnings")), 1);
  release(coarse);
  release(result);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

/* No cell is small enough for the gap between two bars, so the mesh fills it, and says how far it is then. */
static void test_a_gap_narrower_than_all_cells_is_filled_and_stated(void **unused) {
  (void)unused;
  const double spheres[] = {0, 0, 0, 0.5, 4, 0, 0, 0.5, 0, 1.002, 0, 0.5, 4, 1.002, 0, 0.5};
  const uint32_t edges[] = {0, 1, 2, 3};
  qmat_context context = {0};
  qmat_medial *medial = medial_mesh(spheres, 4, edges, 2, NULL, 0);
  skin_result result = skin(medial_mesh(spheres, 4, edges, 2, NULL, 0), "resolution=128 detail=3 error=0.2%");
  assert_manifold(result.mesh);
  const double found = farthest_from_mesh(&context, medial, result.mesh) / number_of(result, "diagonal");
  assert_true(found > 2e-3 && number_of(result, "envelope_to_mesh") >= found);
  assert_true(number_of(result, "mesh_to_envelope") <= 2e-3);
  assert_true((double)result.mesh->triangle_count < 0.1 * number_of(result, "contour_triangles"));
  const char *const settings[] = {"resolution=128 detail=3 error=0.2%", "resolution=16 detail=5 error=0.2%",
                                  "resolution=16 detail=6 error=0.2%"};
  const char *const advice[] = {"--set skin.detail=5", "--set skin.detail=6", NULL}; /* 6 is the most */
  assert_int_equal(json_array_size(json_object_get(result.report->root, "warnings")), 1);
  for (size_t i = 0; i < 3; i++) {
    skin_result other = skin(medial_mesh(spheres, 4, edges, 2, NULL, 0), settings[i]);
    const json_t *warnings = json_object_get(other.report->root, "warnings");
    assert_int_equal(json_array_size(warnings), 1);
    const char *option = strstr(json_string_value(json_array_get(warnings, 0)), "--set");
    if (advice[i]) assert_string_equal(option, advice[i]);
    if (!advice[i]) assert_null(option);
    release(other);
  }
  release(result);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

static void test_a_number_of_triangles_comes_before_the_error(void **unused) {
  (void)unused;
  skin_result free_of_it = skin(ring(), "error=0.2%"), enough = skin(ring(), "error=0.2% triangles=1000000");
  assert_memory_equal(&free_of_it.mesh->base.digest, &enough.mesh->base.digest, sizeof enough.mesh->base.digest);
  char settings[64];
  snprintf(settings, sizeof settings, "error=0.2%% triangles=%zu", free_of_it.mesh->triangle_count / 2);
  skin_result few = skin(ring(), settings);
  assert_manifold(few.mesh);
  assert_true(few.mesh->triangle_count <= free_of_it.mesh->triangle_count / 2);
  assert_near(number_of(few, "euler_characteristic"), 0, 0);
  assert_true(number_of(few, "error_at_samples") > 2e-3);
  assert_true(number_of(few, "mesh_to_envelope") > 2e-3 || number_of(few, "envelope_to_mesh") > 2e-3);
  assert_null(json_object_get(few.report->root, "warnings"));
  release(few);
  release(enough);
  release(free_of_it);
}

static void test_decimation_keeps_every_soup_of_primitives_a_closed_manifold_of_its_topology(void **unused) {
  (void)unused;
  static const char *const plain[] = {"resolution=8 detail=0", "resolution=16 detail=2", "resolution=28 detail=0"};
  static const char *const lean[] = {"resolution=8 detail=0 error=2%", "resolution=16 detail=2 error=1%",
                                     "resolution=28 detail=0 error=0.4%"};
  size_t fewer = 0;
  for (uint64_t seed = 0; seed < 12; seed++) {
    skin_result before = skin(soup(seed), plain[seed % 3]), after = skin(soup(seed), lean[seed % 3]);
    assert_manifold(after.mesh);
    assert_no_triangle_is_degenerate(after.mesh);
    /* Where cells are halved for the error, crevices open, and the topology may be another. */
    const bool is_same = number_of(after, "contour_triangles") == number_of(before, "triangles");
    assert_true(is_same || seed % 3 == 1);
    if (is_same) {
      assert_near(number_of(after, "components"), number_of(before, "components"), 0);
      assert_near(number_of(after, "euler_characteristic"), number_of(before, "euler_characteristic"), 0);
    }
    assert_true(after.mesh->triangle_count <= before.mesh->triangle_count);
    fewer += 5 * after.mesh->triangle_count < 4 * before.mesh->triangle_count;
    release(before);
    release(after);
  }
  assert_true(fewer >= 10);
}

/* The medial mesh of a box of 1 x 2 x 3: its corners, and the sheet in the middle. */
static qmat_medial *box(void) {
  double spheres[4 * 12];
  for (size_t i = 0; i < 8; i++) {
    const double corner[4] = {(double)(i & 1), (double)(2 * (i >> 1 & 1)), (double)(3 * (i >> 2)), 0};
    memcpy(spheres + 4 * i, corner, sizeof corner);
  }
  for (size_t i = 0; i < 4; i++) {
    const double inner[4] = {0.5, i & 1 ? 1.5 : 0.5, i & 2 ? 2.5 : 0.5, 0.5};
    memcpy(spheres + 4 * (8 + i), inner, sizeof inner);
  }
  uint32_t triangles[3 * 22] = {8, 9, 10, 9, 11, 10};
  size_t count = 2;
  for (uint32_t axis = 0; axis < 3; axis++)
    for (uint32_t a = 0; a < 8; a++) {
      const uint32_t b = a | 1u << axis;
      if (b == a) continue;
      const uint32_t rows[2][3] = {{a, b, 8 + a / 2}, {b, 8 + b / 2, 8 + a / 2}};
      const size_t made = axis == 0 ? 1 : 2;
      memcpy(triangles + 3 * count, rows, made * sizeof rows[0]);
      count += made;
    }
  assert_int_equal(count, 22);
  return sealed_medial_mesh(spheres, 12, NULL, 0, triangles, count);
}

/* Its edges take the finest cells: nearly all of the contour is there, and has to be thinned out. Thinning makes
 * slivers along them, which keep edges from collapsing. */
static void test_decimation_leaves_few_triangles_of_a_box(void **unused) {
  (void)unused;
  skin_result result = skin(box(), "error=0.2%");
  assert_true(number_of(result, "contour_triangles") > 100000);
  assert_true(result.mesh->triangle_count < 40);
  check_shape(result, 2, 1, 22, 6, 0.01);
  release(result);
}

/* The medial mesh of a cube of side 1: its corners, the ball inside, and a slab to each edge. */
static qmat_medial *cube(void) {
  double spheres[4 * 9] = {0.5, 0.5, 0.5, 0.5};
  uint32_t triangles[3 * 12];
  size_t count = 0;
  for (uint32_t a = 0; a < 8; a++) {
    const double corner[4] = {(double)(a & 1), (double)(a >> 1 & 1), (double)(a >> 2), 0};
    memcpy(spheres + 4 * (size_t)(a + 1), corner, sizeof corner);
    for (uint32_t axis = 0; axis < 3; axis++) {
      if (a >> axis & 1) continue;
      const uint32_t row[3] = {0, a + 1, (a | 1u << axis) + 1};
      memcpy(triangles + 3 * count++, row, sizeof row);
    }
  }
  return sealed_medial_mesh(spheres, 9, NULL, 0, triangles, count);
}

/* Its faces are flat: no collapse of their edges has a best place. */
static void test_a_cube_takes_any_number_of_triangles(void **unused) {
  (void)unused;
  static const size_t numbers[] = {60, 20, 12};
  for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
    char settings[64];
    snprintf(settings, sizeof settings, "error=0.2%% triangles=%zu", numbers[i]);
    skin_result result = skin(cube(), settings);
    assert_true(result.mesh->triangle_count <= numbers[i]);
    assert_true(number_of(result, "envelope_to_mesh") < 2e-3 && number_of(result, "mesh_to_envelope") < 2e-3);
    check_shape(result, 2, 1, 6, 1, 0.02);
    assert_null(json_object_get(result.report->root, "warnings"));
    release(result);
  }
}

static void test_a_number_of_triangles_that_is_too_small_is_told(void **unused) {
  (void)unused;
  skin_result result = skin(ring(), "error=0.2% triangles=5");
  assert_manifold(result.mesh);
  assert_true(result.mesh->triangle_count > 5);
  assert_near(number_of(result, "euler_characteristic"), 0, 0);
  assert_int_equal(json_array_size(json_object_get(result.report->root, "warnings")), 1);
  release(result);
}

/* A plate that is thin everywhere would take twenty million of the finest cells. */
static void test_a_thin_plate_takes_larger_cells(void **unused) {
  (void)unused;
  const double spheres[] = {0, 0, 0, 1e-3, 1, 0, 0, 1e-3, 0, 1, 0, 1e-3};
  const uint32_t slab[] = {0, 1, 2};
  skin_result result = skin(sealed_medial_mesh(spheres, 3, NULL, 0, slab, 1), "resolution=256 error=0.1%");
  assert_true(number_of(result, "cells") < 300000 && number_of(result, "cells") > 75000);
  assert_near(number_of(result, "components"), 1, 0);
  release(result);
}

static void test_decimation_does_not_shorten_a_hair(void **unused) {
  (void)unused;
  /* A hair that is thinner than the error: all of it is near the envelope, its tip is not near the rest. */
  const double spheres[] = {0, 0, 0, 1, 6, 0, 0, 0.03};
  skin_result result = skin(medial_mesh(spheres, 2, (uint32_t[]){0, 1}, 1, NULL, 0), "error=1%");
  double furthest = -INFINITY;
  for (size_t v = 0; v < result.mesh->vertex_count; v++) furthest = fmax(furthest, result.mesh->positions[3 * v]);
  assert_near(furthest, 6.03, 0.01 * number_of(result, "diagonal") * 1.05);
  assert_true((double)result.mesh->triangle_count < 0.2 * number_of(result, "contour_triangles"));
  release(result);
}

static void test_finer_cells_come_closer(void **unused) {
  (void)unused;
  double coarse = 0;
  for (int resolution = 16; resolution <= 256; resolution *= 4) {
    char settings[32];
    snprintf(settings, sizeof settings, "resolution=%d", resolution);
    skin_result result = skin(ball(), settings);
    const double off = 1 - volume_of(result.mesh) / (4.0 / 3 * PI * 8);
    assert_true(off > 0);
    /* Second order: a quarter of the cell size, a sixteenth of the error. */
    if (coarse > 0) assert_near(coarse / off, 16, 3);
    coarse = off;
    release(result);
  }
}

static void test_a_capsule_has_its_area_and_volume(void **unused) {
  (void)unused;
  skin_result result = skin(capsule(0), "resolution=128 detail=3");
  check_shape(result, 2, 1, 4 * PI + 2 * PI * 5, 4.0 / 3 * PI + PI * 5, 1e-3);
  release(result);
}

static void test_a_cone_has_its_area_and_volume(void **unused) {
  (void)unused;
  /* Radii 1 and 2 at distance 5: the tangent circles sit r d before the centres, with radius r s. */
  const double d = 0.2, s = sqrt(1 - d * d), h = 5 - (2 - 1) * d, r1 = s, r2 = 2 * s;
  const double caps = 2 * PI * (1 - d) + 2 * PI * 4 * (1 + d), side = PI * (r1 + r2) * hypot(h, r2 - r1);
  const double small = PI / 3 * pow(1 - d, 2) * (3 - (1 - d)), large = PI / 3 * pow(2 * (1 + d), 2) * (6 - 2 * (1 + d));
  skin_result result = skin(capsule(1), "");
  check_shape(result, 2, 1, caps + side, small + large + PI / 3 * h * (r1 * r1 + r1 * r2 + r2 * r2), 1e-3);
  release(result);
}

static void test_a_slab_has_its_area_and_volume(void **unused) {
  (void)unused;
  const double spheres[] = {0, 0, 0, 0.2, 3, 0, 0, 0.2, 0, 4, 0, 0.2};
  skin_result result = skin(sealed_medial_mesh(spheres, 3, NULL, 0, (uint32_t[]){0, 1, 2}, 1), "resolution=200");
  const double r = 0.2, flat = 6, rim = 12;
  check_shape(result, 2, 1, 2 * flat + PI * r * rim + 4 * PI * r * r,
              2 * r * flat + PI / 2 * r * r * rim + 4.0 / 3 * PI * r * r * r, 2e-3);
  release(result);
}

static void test_a_ring_of_cones_is_a_torus(void **unused) {
  (void)unused;
  skin_result result = skin(ring(), "");
  assert_manifold(result.mesh);
  assert_near(number_of(result, "euler_characteristic"), 0, 0);
  assert_near(number_of(result, "components"), 1, 0);
  release(result);
}

static void test_separate_spheres_are_separate_components(void **unused) {
  (void)unused;
  const double spheres[] = {0, 0, 0, 1, 3, 0, 0, 1.5, 0, 9, 0, 0.5};
  skin_result result = skin(sealed_medial_mesh(spheres, 3, NULL, 0, NULL, 0), "");
  const double cubes = 1 + 1.5 * 1.5 * 1.5 + 0.125, squares = 1 + 2.25 + 0.25;
  check_shape(result, 6, 3, 4 * PI * squares, 4.0 / 3 * PI * cubes, 5e-3);
  release(result);
}

static void test_every_soup_of_primitives_is_a_closed_manifold(void **unused) {
  (void)unused;
  qmat_context context = {0};
  /* Coarse cells: many sheets to a cell, and jumps in cell size. */
  static const char *const settings[] = {"resolution=8 detail=0",  "resolution=16 detail=2", "resolution=12 detail=4",
                                         "resolution=40 detail=1", "resolution=33 detail=3", "resolution=64 detail=0"};
  for (uint64_t seed = 0; seed < 24; seed++) {
    qmat_medial *medial = soup(seed);
    qmat_envelope *envelope;
    assert_int_equal(qmat_envelope_of_medial(&context, medial, &envelope), QMAT_OK);
    skin_result result = skin(medial, settings[seed % 6]);
    assert_manifold(result.mesh);
    assert_no_triangle_is_degenerate(result.mesh);
    assert_true(volume_of(result.mesh) > 0);
    double diagonal = number_of(result, "diagonal"), vertices = 0;
    for (size_t i = 0; i < result.mesh->vertex_count; i++) {
      vertices = fmax(vertices, fabs(qmat_envelope_distance(envelope, result.mesh->positions + 3 * i, NULL)));
    }
    assert_near(number_of(result, "error_at_vertices"), vertices / diagonal, 1e-9);
    /* Nothing is farther off than the raised radii and the cells explain. */
    const double finest = number_of(result, "finest_cell_size");
    assert_true(vertices / diagonal < number_of(result, "cell_size") + finest);
    release(result);
    qmat_envelope_free(envelope);
  }
  qmat_context_uninit(&context);
}

static void test_thin_parts_stay_connected(void **unused) {
  (void)unused;
  /* A ball with a hair of a tenth of a cell's width that ends in a point, and a sheet of paper on it. */
  const double spheres[] = {0, 0, 0, 1, 4, 0.7, 0.3, 1e-3, 7, -1, 2, 0, -3, 2, 1, 1e-3, -2, 3, 0, 0};
  const uint32_t edges[] = {0, 1, 1, 2}, triangles[] = {0, 3, 4};
  static const char *const settings[] = {"resolution=16 detail=0", "resolution=50 detail=2", "resolution=128 detail=3",
                                         "resolution=32 detail=6"};
  double last = INFINITY;
  for (int i = 0; i < 4; i++) {
    skin_result result = skin(sealed_medial_mesh(spheres, 5, edges, 2, triangles, 1), settings[i]);
    assert_manifold(result.mesh);
    assert_near(number_of(result, "components"), 1, 0);
    assert_near(number_of(result, "euler_characteristic"), 2, 0);
    assert_near(number_of(result, "raised_radii"), 4, 0);
    /* It reaches the tip of the hair. */
    double furthest = -INFINITY;
    for (size_t v = 0; v < result.mesh->vertex_count; v++) furthest = fmax(furthest, result.mesh->positions[3 * v]);
    assert_near(furthest, 7, number_of(result, "cell_size_model"));
    assert_true(number_of(result, "error_at_vertices") < last);
    last = number_of(result, "error_at_vertices");
    release(result);
  }
}

static void test_cells_are_finer_where_radii_are_small(void **unused) {
  (void)unused;
  const double spheres[] = {0, 0, 0, 1, 4, 0, 0, 0.02};
  const uint32_t edge[] = {0, 1};
  skin_result coarse = skin(sealed_medial_mesh(spheres, 2, edge, 1, NULL, 0), "resolution=32 detail=0");
  skin_result fine = skin(sealed_medial_mesh(spheres, 2, edge, 1, NULL, 0), "resolution=32 detail=3");
  assert_near(number_of(coarse, "refined_cells"), 0, 0);
  assert_true(number_of(fine, "refined_cells") > 0);
  assert_true(number_of(fine, "cells") < 3 * number_of(coarse, "cells"));
  assert_near(number_of(fine, "finest_cell_size"), 1.0 / 256, 0);
  release(coarse);
  release(fine);
}

static void test_spheres_inside_others_change_nothing(void **unused) {
  (void)unused;
  const double spheres[] = {3, -2, 5, 2, 3.5, -2, 5, 1, 3, -2, 5, 0.5, 3, -2, 5, 2};
  const uint32_t triangles[] = {0, 1, 2};
  skin_result alone = skin(ball(), "resolution=48");
  skin_result full = skin(sealed_medial_mesh(spheres, 4, NULL, 0, triangles, 1), "resolution=48");
  assert_int_equal(alone.mesh->vertex_count, full.mesh->vertex_count);
  for (size_t i = 0; i < 3 * alone.mesh->vertex_count; i++) {
    assert_near(alone.mesh->positions[i], full.mesh->positions[i], 1e-9);
  }
  release(alone);
  release(full);
}

static void test_isolated_spheres_without_radius_are_left_out(void **unused) {
  (void)unused;
  const double spheres[] = {3, -2, 5, 2, 100, 0, 0, 0};
  skin_result alone = skin(ball(), "resolution=32");
  skin_result both = skin(sealed_medial_mesh(spheres, 2, NULL, 0, NULL, 0), "resolution=32");
  assert_memory_equal(&alone.mesh->base.digest, &both.mesh->base.digest, sizeof alone.mesh->base.digest);
  release(alone);
  release(both);
}

static void test_size_and_place_do_not_matter(void **unused) {
  (void)unused;
  static const double scales[] = {1e-9, 1, 1e12};
  size_t vertices = 0;
  for (int i = 0; i < 3; i++) {
    const double k = scales[i];
    const double spheres[] = {5 * k, 0, 0, k, 9 * k, k, 0, 0.5 * k};
    skin_result result = skin(sealed_medial_mesh(spheres, 2, (uint32_t[]){0, 1}, 1, NULL, 0), "resolution=64");
    assert_manifold(result.mesh);
    assert_near(number_of(result, "euler_characteristic"), 2, 0);
    if (i > 0) assert_near((double)result.mesh->vertex_count / (double)vertices, 1, 0.01);
    vertices = result.mesh->vertex_count;
    release(result);
  }
}

static void test_the_bytes_do_not_depend_on_threads(void **unused) {
  (void)unused;
  static const char *const settings[] = {"resolution=40 detail=3", "method=skin_surface spacing=1.5 subdivisions=0"};
  for (int method = 0; method < 2; method++) {
    qmat_digest mesh, report;
    for (int i = 0; i < 4; i++) {
      static const int threads[] = {1, 2, 8, 1};
      qmat_context context = {.threads = threads[i]};
      skin_result result;
      assert_int_equal(try_skin(&context, method == 0 ? soup(3) : ring(), settings[method], &result), QMAT_OK);
      if (i == 0) mesh = result.mesh->base.digest, report = result.report->base.digest;
      assert_memory_equal(&result.mesh->base.digest, &mesh, sizeof mesh);
      assert_memory_equal(&result.report->base.digest, &report, sizeof report);
      release(result);
      qmat_context_uninit(&context);
    }
  }
}

static void test_a_skin_surface_keeps_a_balls_radius(void **unused) {
  (void)unused;
  skin_result result = skin(ball(), "method=skin_surface subdivisions=3");
  check_shape(result, 2, 1, 4 * PI * 4, 4.0 / 3 * PI * 8, 0.01);
  assert_near(number_of(result, "balls"), 1, 0);
  assert_true(number_of(result, "error_at_vertices") < 1e-6);
  release(result);
}

static void test_a_skin_surface_fills_cones_and_slabs_with_balls(void **unused) {
  (void)unused;
  skin_result result = skin(capsule(0), "method=skin_surface spacing=0.3 subdivisions=2");
  check_shape(result, 2, 1, 4 * PI + 2 * PI * 5, 4.0 / 3 * PI + PI * 5, 0.02);
  /* Not a string of beads: it stays within shrink * spacing^2 / 8 of the radius inside the capsule, never outside. */
  assert_true(number_of(result, "error_at_vertices") * number_of(result, "diagonal") < 0.5 * 0.09 / 8 + 1e-5);
  release(result);
  const double spheres[] = {0, 0, 0, 0.5, 3, 0, 0, 0.5, 0, 3, 0, 0.5};
  result =
      skin(sealed_medial_mesh(spheres, 3, NULL, 0, (uint32_t[]){0, 1, 2}, 1), "method=skin_surface subdivisions=0");
  assert_manifold(result.mesh);
  assert_near(number_of(result, "euler_characteristic"), 2, 0);
  assert_true(number_of(result, "balls") > 50);
  release(result);
}

static void test_a_skin_surface_does_without_hidden_balls(void **unused) {
  (void)unused;
  const double spheres[] = {0, 0, 0, 1, 0, 0, 0, 1, 0.2, 0, 0, 0.5, 0, 0, 0, 0.3, 0.5, 0, 0, 0, 3, 0, 0, 0};
  const uint32_t edges[] = {0, 1, 0, 2, 0, 4, 2, 3};
  skin_result result = skin(sealed_medial_mesh(spheres, 6, edges, 4, NULL, 0), "method=skin_surface");
  assert_near(number_of(result, "balls"), 1, 0);
  assert_manifold(result.mesh);
  release(result);
}

static void expect_error(qmat_medial *medial, const char *settings, qmat_status wanted, const char *field) {
  qmat_context context = {0};
  skin_result result;
  assert_int_equal(try_skin(&context, medial, settings, &result), wanted);
  assert_string_equal(context.error.field, field);
  assert_true(context.error.message[0] != 0);
  qmat_context_uninit(&context);
}

static void test_errors_name_the_input_or_the_parameter(void **unused) {
  (void)unused;
  static const char *const methods[] = {"method=envelope", "method=skin_surface"};
  for (int i = 0; i < 2; i++) {
    expect_error(sealed_medial_mesh(NULL, 0, NULL, 0, NULL, 0), methods[i], QMAT_ERROR_GEOMETRY, "medial");
    const double zero[] = {0, 0, 0, 0, 1, 0, 0, 0};
    expect_error(sealed_medial_mesh(zero, 2, NULL, 0, NULL, 0), methods[i], QMAT_ERROR_GEOMETRY, "medial");
    const double huge[] = {-1e308, 0, 0, 1e308, 1e308, 0, 0, 1e308};
    expect_error(sealed_medial_mesh(huge, 2, NULL, 0, NULL, 0), methods[i], QMAT_ERROR_GEOMETRY, "medial");
  }
  /* A large thin sheet. */
  const double sheet[] = {0, 0, 0, 1e-3, 10, 0, 0, 1e-3, 0, 10, 0, 1e-3};
  const uint32_t triangle[] = {0, 1, 2};
  expect_error(sealed_medial_mesh(sheet, 3, NULL, 0, triangle, 1), "method=skin_surface", QMAT_ERROR_GEOMETRY,
               "spacing");
  expect_error(sealed_medial_mesh(sheet, 3, NULL, 0, triangle, 1), "resolution=2048 detail=6", QMAT_ERROR_GEOMETRY,
               "resolution");
}

/* Two corners of a slab have no radius, as on creases: the line between them is a side of a slab with volume, and of no
 * flat one. */
static void test_all_sides_of_slabs_with_volume_stay_with_them(void **unused) {
  (void)unused;
  const double spheres[] = {0, 0, 0, 0, 3, 0, 0, 0, 0, 4, 0, 0.5, 0, 0, 5, 0.5, -3, 0, 0, 0};
  const uint32_t cones[] = {0, 2}, slabs[] = {0, 1, 3, 0, 1, 4};
  qmat_medial *medial = sealed_medial_mesh(spheres, 5, cones, 1, slabs, 2);
  qmat_context context = {0};
  qmat_medial solid, flat;
  assert_int_equal(qmat_flat_primitives_separate(&context, medial, &solid, &flat), QMAT_OK);
  static const uint32_t expected[] = {0, 1, 0, 2, 0, 3, 1, 3};
  assert_int_equal(solid.triangle_count, 1);
  assert_int_equal(solid.edge_count, 4);
  assert_memory_equal(solid.edges, expected, sizeof expected);
  assert_int_equal(flat.triangle_count, 1);
  assert_int_equal(flat.edge_count, 0); /* its slab has its sides */
  qmat_boundary_features features;
  assert_int_equal(qmat_boundary_features_init(&context, &solid, &features), QMAT_OK);
  assert_int_equal(qmat_boundary_features_init(&context, &flat, &features), QMAT_ERROR_INTERNAL);
  qmat_context_uninit(&context);
  qmat_value_release(&medial->base);
}

static void test_flat_slabs_have_two_sides_and_flat_cones_are_prisms(void **unused) {
  (void)unused;
  const double spheres[] = {0, 0, 0, 0, 3, 0, 0, 0, 0, 4, 0, 0, 0, 4, 5, 0, 9, 9, 9, 1};
  qmat_context context = {0};
  skin_result result;
  const uint32_t cone[] = {2, 3}, slab[] = {0, 1, 2};
  assert_int_equal(try_skin(&context, sealed_medial_mesh(spheres, 4, cone, 1, slab, 1), "", &result), QMAT_OK);
  assert_int_equal(result.mesh->triangle_count, 2 + 8);
  assert_near(number_of(result, "flat_slabs"), 1, 0);
  assert_near(number_of(result, "flat_cones"), 1, 0);
  assert_near(number_of(result, "triangles"), 0, 0);
  assert_true(result.mesh->oriented && !result.mesh->closed);
  /* Both sides of the slab cancel; the prism is six times its third and turned outwards. */
  const double side = sqrt(3) * number_of(result, "diagonal") / (96 << 4), prism = sqrt(3) / 4 * side * side * 5;
  assert_near(volume_of(result.mesh), prism, 1e-9 * prism);
  release(result);
  assert_int_equal(try_skin(&context, sealed_medial_mesh(spheres, 5, cone, 1, slab, 1), "resolution=32", &result),
                   QMAT_OK);
  assert_int_equal(result.mesh->triangle_count, 10 + (size_t)number_of(result, "triangles"));
  assert_near(number_of(result, "components"), 1, 0);
  release(result);
  qmat_context_uninit(&context);
}

/* Two spheres in one place have no line between them, so no prism; in the frame, two places may become one. */
static void test_flat_cones_without_length_are_left_out(void **unused) {
  (void)unused;
  qmat_context context = {0};
  skin_result result;
  const uint32_t cone[] = {1, 2};
  const double in_one_place[] = {0, 0, 0, 1, 5, 0, 0, 0, 5, 0, 0, 0};
  assert_int_equal(try_skin(&context, sealed_medial_mesh(in_one_place, 3, cone, 1, NULL, 0), "resolution=16", &result),
                   QMAT_OK);
  assert_near(number_of(result, "flat_cones"), 0, 0);
  assert_int_equal(result.mesh->triangle_count, (size_t)number_of(result, "triangles"));
  release(result);
  const double lengths[] = {1e-200, 5e-324};
  for (int i = 0; i < 2; i++) {
    const double near[] = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, lengths[i], 0};
    assert_int_equal(try_skin(&context, sealed_medial_mesh(near, 3, cone, 1, NULL, 0), "resolution=16", &result),
                     QMAT_OK);
    assert_near(number_of(result, "flat_cones"), 1, 0);
    assert_int_equal(result.mesh->triangle_count, 8 + (size_t)number_of(result, "triangles"));
    release(result);
  }
  expect_error(sealed_medial_mesh(in_one_place + 4, 2, (const uint32_t[]){0, 1}, 1, NULL, 0), "", QMAT_ERROR_GEOMETRY,
               "medial");
  qmat_context_uninit(&context);
}

/* Meshes are what the error leaves of a contour, a contour itself, and CGAL's. */
static void test_every_mesh_states_how_far_it_may_be_from_the_envelope(void **unused) {
  (void)unused;
  static const char *const settings[] = {"resolution=32 error=0.5%", "resolution=32 error=0", "method=skin_surface"};
  qmat_context context = {0};
  for (int i = 0; i < 3; i++) {
    qmat_medial *medial = capsule(0.5);
    qmat_envelope *envelope;
    assert_int_equal(qmat_envelope_of_medial(&context, medial, &envelope), QMAT_OK);
    skin_result result = skin(medial, settings[i]);
    const double farthest = farthest_from(envelope, result.mesh), diagonal = number_of(result, "diagonal");
    assert_true(farthest > 0 && result.mesh->deviation >= farthest);
    assert_true(result.mesh->deviation < 2 * farthest + 1e-4 * diagonal);
    assert_near(result.mesh->deviation,
                diagonal * fmax(number_of(result, "mesh_to_envelope"), number_of(result, "envelope_to_mesh")), 0);
    qmat_envelope_free(envelope);
    release(result);
  }
  qmat_context_uninit(&context);
}

static void test_a_number_of_triangles_needs_an_error(void **unused) {
  (void)unused;
  expect_error(ball(), "error=0 triangles=500", QMAT_ERROR_USAGE, "triangles");
  release(skin(ball(), "method=skin_surface error=0 triangles=500"));
}

static void test_a_run_can_be_cancelled(void **unused) {
  (void)unused;
  static const char *const settings[] = {"resolution=16 detail=1", "resolution=16 detail=1 error=0",
                                         "method=skin_surface"};
  for (int i = 0; i < 3; i++) {
    qmat_medial *medial = i < 2 ? soup(1) : capsule(0);
    pipeline_must_be_cancelled("medial.skin", settings[i], (const qmat_value *[]){&medial->base, NULL});
    qmat_value_release(&medial->base);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_sphere_has_its_area_and_volume),
      cmocka_unit_test(test_decimation_leaves_few_triangles_within_its_error),
      cmocka_unit_test(test_the_error_holds_in_a_crevice_narrower_than_a_cell),
      cmocka_unit_test(test_a_gap_narrower_than_all_cells_is_filled_and_stated),
      cmocka_unit_test(test_a_number_of_triangles_comes_before_the_error),
      cmocka_unit_test(test_decimation_keeps_every_soup_of_primitives_a_closed_manifold_of_its_topology),
      cmocka_unit_test(test_decimation_leaves_few_triangles_of_a_box),
      cmocka_unit_test(test_a_cube_takes_any_number_of_triangles),
      cmocka_unit_test(test_a_number_of_triangles_that_is_too_small_is_told),
      cmocka_unit_test(test_a_thin_plate_takes_larger_cells),
      cmocka_unit_test(test_decimation_does_not_shorten_a_hair),
      cmocka_unit_test(test_finer_cells_come_closer),
      cmocka_unit_test(test_a_capsule_has_its_area_and_volume),
      cmocka_unit_test(test_a_cone_has_its_area_and_volume),
      cmocka_unit_test(test_a_slab_has_its_area_and_volume),
      cmocka_unit_test(test_a_ring_of_cones_is_a_torus),
      cmocka_unit_test(test_separate_spheres_are_separate_components),
      cmocka_unit_test(test_every_soup_of_primitives_is_a_closed_manifold),
      cmocka_unit_test(test_all_sides_of_slabs_with_volume_stay_with_them),
      cmocka_unit_test(test_flat_slabs_have_two_sides_and_flat_cones_are_prisms),
      cmocka_unit_test(test_flat_cones_without_length_are_left_out),
      cmocka_unit_test(test_every_mesh_states_how_far_it_may_be_from_the_envelope),
      cmocka_unit_test(test_a_number_of_triangles_needs_an_error),
      cmocka_unit_test(test_thin_parts_stay_connected),
      cmocka_unit_test(test_cells_are_finer_where_radii_are_small),
      cmocka_unit_test(test_spheres_inside_others_change_nothing),
      cmocka_unit_test(test_isolated_spheres_without_radius_are_left_out),
      cmocka_unit_test(test_size_and_place_do_not_matter),
      cmocka_unit_test(test_the_bytes_do_not_depend_on_threads),
      cmocka_unit_test(test_a_skin_surface_keeps_a_balls_radius),
      cmocka_unit_test(test_a_skin_surface_fills_cones_and_slabs_with_balls),
      cmocka_unit_test(test_a_skin_surface_does_without_hidden_balls),
      cmocka_unit_test(test_errors_name_the_input_or_the_parameter),
      cmocka_unit_test(test_a_run_can_be_cancelled),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
