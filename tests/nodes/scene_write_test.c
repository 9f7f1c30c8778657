/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "io/base64.h"
#include "io/draco.h"
#include "io/mesh/ma.h"
#include "nodes/nodes.h"
#include "tests/hull_colliders.h"
#include "tests/io/gltf/gltf_assets.h"
#include "tests/medial_meshes.h"
#include "tests/shapes.h"

/* The parameters as the node lays them out. */
static void *make_params(const qmat_node *node, const char *const settings[][2]) {
  qmat_context context = {0};
  void *params = calloc(1, node->params_size);
  assert_non_null(params);
  qmat_params_default(node, params);
  for (size_t i = 0; settings && settings[i][0]; i++) {
    const qmat_param *param = qmat_param_find(node, settings[i][0]);
    assert_non_null(param);
    assert_int_equal(qmat_param_parse(&context, param, settings[i][1], params), QMAT_OK);
  }
  qmat_context_uninit(&context);
  return params;
}

/* A cone of two spheres (box of the spheres: 6 by 2 by 2, diagonal sqrt(44)) and a sphere alone inside that box. */
static qmat_medial *make_medial(void) {
  const double spheres[12] = {0, 0, 0, 1, 4, 0, 0, 1, 2.1, 0.1, 0.3, 0.5};
  return sealed_medial_mesh(spheres, 3, (const uint32_t[]){0, 1}, 1, NULL, 0);
}

static qmat_report *make_report(json_t *root) {
  qmat_context context = {0};
  qmat_report *report = qmat_report_new();
  assert_true(report && root);
  assert_int_equal(json_object_update(report->root, root), 0);
  json_decref(root);
  assert_int_equal(qmat_value_seal(&context, &report->base), QMAT_OK);
  qmat_context_uninit(&context);
  return report;
}

typedef struct wiring {
  const qmat_scene *scene;
  const qmat_mesh *skin;
  const qmat_report *report;
  const qmat_colliders *colliders;
} wiring;

/* `report`: gets the report, which the caller releases; NULL: nobody wants it. */
static qmat_file *must_write_with_report(const qmat_medial *medial, wiring with, const char *const settings[][2],
                                         qmat_report **report) {
  const qmat_node *node = qmat_node_find("scene.write");
  assert_non_null(node);
  const qmat_value *inputs[5] = {NULL};
  inputs[qmat_input_find(node, "medial")] = &medial->base;
  inputs[qmat_input_find(node, "scene")] = with.scene ? &with.scene->base : NULL;
  inputs[qmat_input_find(node, "skin")] = with.skin ? &with.skin->base : NULL;
  inputs[qmat_input_find(node, "report")] = with.report ? &with.report->base : NULL;
  inputs[qmat_input_find(node, "colliders")] = with.colliders ? &with.colliders->base : NULL;
  qmat_value *outputs[2] = {NULL};
  void *params = make_params(node, settings);
  qmat_context context = {0};
  assert_int_equal(qmat_params_check(&context, node, params), QMAT_OK);
  if (node->run(&context, params, inputs, outputs) != QMAT_OK) fail_msg("%s", context.error.message);
  assert_int_equal(outputs[0]->type, QMAT_FILE);
  assert_true(outputs[0]->sealed);
  assert_int_equal(outputs[1]->type, QMAT_REPORT);
  if (report)
    *report = (qmat_report *)outputs[1];
  else
    qmat_value_release(outputs[1]);
  free(params);
  qmat_context_uninit(&context);
  return (qmat_file *)outputs[0];
}

static qmat_file *must_write(const qmat_medial *medial, wiring with, const char *const settings[][2]) {
  return must_write_with_report(medial, with, settings, NULL);
}

/* The JSON of a .glb. */
static json_t *glb_root(const qmat_file *file) {
  const uint8_t *bytes = file->parts[0].bytes;
  assert_string_equal(file->format, "glb");
  assert_memory_equal(bytes, "glTF", 4);
  const size_t size = (size_t)bytes[12] | (size_t)bytes[13] << 8 | (size_t)bytes[14] << 16 | (size_t)bytes[15] << 24;
  json_t *root = json_loadb((const char *)bytes + 20, size, 0, NULL);
  assert_non_null(root);
  return root;
}

static json_t *node_of(json_t *root) {
  return json_array_get(json_object_get(root, "nodes"), 0);
}

static json_t *extra(json_t *root, const char *key) {
  return json_object_get(json_object_get(node_of(root), "extras"), key);
}

static void test_the_report_goes_into_the_extras_with_what_quantisation_adds(void **state) {
  (void)state;
  qmat_medial *medial = make_medial();
  qmat_report *report =
      make_report(json_pack("{s:f, s:f, s:f, s:b, s:i, s:f}", "epsilon", 0.02, "surface_to_envelope", 0.011,
                            "envelope_to_surface", 0.013, "certified", 1, "spheres", 3, "diagonal", 8.0));
  qmat_file *file = must_write(medial, (wiring){.report = report}, NULL);
  json_t *root = glb_root(file);
  assert_near(json_real_value(extra(root, "qmat_epsilon")), 0.02, 0);
  const double moved = json_real_value(extra(root, "qmat_quantisation")) / 8;
  assert_true(moved > 0);
  assert_near(json_real_value(extra(root, "qmat_error_out")), 0.011 + moved, 1e-15);
  assert_near(json_real_value(extra(root, "qmat_error_in")), 0.013 + moved, 1e-15);
  assert_true(json_real_value(extra(root, "qmat_error_in")) >= 0.013 + moved);
  assert_true(json_is_true(extra(root, "qmat_certified")));
  assert_int_equal(json_integer_value(extra(root, "qmat_vertices")), 3);
  assert_null(extra(root, "spheres"));
  json_decref(root);
  qmat_value_release(&file->base);
  qmat_value_release(&report->base);

  report = make_report(json_pack("{s:s, s:f}", "epsilon", "small", "surface_to_envelope", 0.011));
  file = must_write(medial, (wiring){.report = report}, NULL);
  root = glb_root(file);
  assert_null(extra(root, "qmat_epsilon"));
  assert_null(extra(root, "qmat_error_in"));
  assert_null(extra(root, "qmat_certified"));
  assert_true(json_real_value(extra(root, "qmat_error_out")) > 0.011); /* the spheres' diagonal stands in */
  json_decref(root);
  qmat_value_release(&file->base);
  qmat_value_release(&report->base);
  qmat_value_release(&medial->base);
}

/* The errors in qmat_flat, in model units. */
static void flat_errors(json_t *root, bool has_any, double errors[3]) {
  qmat_context context = {0};
  const json_t *text = extra(root, "qmat_flat");
  uint8_t *bytes;
  size_t size;
  assert_int_equal(qmat_base64_decode(&context, json_string_value(text), json_string_length(text), &bytes, &size),
                   QMAT_OK);
  assert_int_equal(bytes[6] & 1, 0);
  assert_int_equal(bytes[6] >> 2 & 1, has_any);
  float scale;
  memcpy(&scale, bytes + 56, sizeof scale);
  for (size_t i = 0; i < 3 && has_any; i++) {
    const uint8_t *stored = bytes + 64 + 3 * 8 + 2 * i;
    errors[i] = (double)scale * (stored[0] | stored[1] << 8);
  }
  qmat_free(bytes);
}

static void test_the_errors_of_spheres_go_into_the_plain_form(void **state) {
  (void)state;
  static const char *const settings[][2] = {{"flat", "short"}, {NULL, NULL}};
  static const double expected[] = {0.011, 0.002, 0};
  qmat_medial *medial = make_medial();
  assert_int_equal(medial->sphere_count, 3);
  qmat_report *report = make_report(
      json_pack("{s:f, s:[f, f, f], s:f}", "epsilon", 0.02, "sphere_errors", 0.011, 0.002, 0.0, "diagonal", 8.0));
  qmat_file *file = must_write(medial, (wiring){.report = report}, settings);
  json_t *root = glb_root(file);
  double errors[3];
  flat_errors(root, true, errors);
  const double moved = json_real_value(extra(root, "qmat_flat_quantisation"));
  for (size_t i = 0; i < 3; i++) {
    assert_true(errors[i] >= 8 * expected[i] + moved);
    assert_near(errors[i], 8 * expected[i] + moved, 2e-6);
  }
  json_decref(root);
  qmat_value_release(&file->base);
  qmat_value_release(&report->base);
  /* A list of another length, or of something else, is none. */
  json_t *const others[] = {json_pack("{s:[f, f]}", "sphere_errors", 0.011, 0.002),
                            json_pack("{s:[f, f, f]}", "sphere_errors", 0.011, -0.002, 0.0),
                            json_pack("{s:s}", "sphere_errors", "small"), json_object()};
  for (size_t i = 0; i < 4; i++) {
    report = make_report(others[i]);
    file = must_write(medial, (wiring){.report = report}, settings);
    root = glb_root(file);
    flat_errors(root, false, errors);
    json_decref(root);
    qmat_value_release(&file->base);
    qmat_value_release(&report->base);
  }
  qmat_value_release(&medial->base);
}

static void test_what_is_certified_stays_so_where_quantisation_can_be_fine_enough(void **state) {
  (void)state;
  static const struct {
    double error; /* of epsilon 0.02 */
    bool stays;
    const char *position_bits;
  } cases[] = {{0.01, true, "0"}, {0.01999, true, "0"}, {0.02 - 1e-12, false, "0"}, {0.0199, false, "6"}};
  qmat_medial *medial = make_medial();
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    qmat_report *report =
        make_report(json_pack("{s:f, s:f, s:f, s:b, s:f}", "epsilon", 0.02, "surface_to_envelope", 0.001,
                              "envelope_to_surface", cases[i].error, "certified", 1, "diagonal", 6.7));
    const char *const settings[][2] = {{"position_bits", cases[i].position_bits}, {NULL, NULL}};
    qmat_file *file = must_write(medial, (wiring){.report = report}, settings);
    json_t *root = glb_root(file);
    assert_true(json_is_true(extra(root, "qmat_certified")) == cases[i].stays);
    assert_true((json_real_value(extra(root, "qmat_error_in")) <= 0.02) == cases[i].stays);
    json_decref(root);
    qmat_value_release(&file->base);
    qmat_value_release(&report->base);
  }
  qmat_value_release(&medial->base);
}

static void test_quantisation_takes_half_of_the_share_of_storage_at_most(void **state) {
  (void)state;
  qmat_medial *medial = make_medial();
  /* Centres span 4, so b bits are good for sqrt(3) / 2 * 4 / (2^b - 1); radii span 0.5: 0.25 / (2^b - 1). Each gets
   * half of epsilon * diagonal / 400. For 0.02 * sqrt(44) / 800 = 1.658e-4: 20890 steps, 15 bits, and 1507.6 steps, 11
   * bits. For 1e-3: 417791 steps, 19 bits, and 30151 steps, 15 bits. */
  static const struct {
    double epsilon;
    int position_bits, radius_bits;
  } cases[] = {{0.02, 15, 11}, {0, 19, 15}};
  for (size_t i = 0; i < 2; i++) {
    qmat_report *report = cases[i].epsilon > 0 ? make_report(json_pack("{s:f}", "epsilon", cases[i].epsilon)) : NULL;
    qmat_file *file = must_write(medial, (wiring){.report = report}, NULL);
    json_t *root = glb_root(file);
    assert_int_equal(json_integer_value(extra(root, "qmat_position_bits")), cases[i].position_bits);
    assert_int_equal(json_integer_value(extra(root, "qmat_radius_bits")), cases[i].radius_bits);
    const double epsilon = report ? cases[i].epsilon : 1e-3;
    assert_true(json_real_value(extra(root, "qmat_quantisation")) <= epsilon * sqrt(44) / 400);
    json_decref(root);
    qmat_value_release(&file->base);
    if (report) qmat_value_release(&report->base);
  }
  const char *const settings[][2] = {{"position_bits", "9"}, {"radius_bits", "5"}, {NULL, NULL}};
  qmat_file *file = must_write(medial, (wiring){0}, settings);
  json_t *root = glb_root(file);
  assert_int_equal(json_integer_value(extra(root, "qmat_position_bits")), 9);
  assert_int_equal(json_integer_value(extra(root, "qmat_radius_bits")), 5);
  json_decref(root);
  qmat_value_release(&file->base);
  qmat_value_release(&medial->base);
}

static void test_scene_and_skin_name_and_show_the_node(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_medial *medial = make_medial();
  qmat_mesh *box = shape_new();
  shape_add_box(box, 0, 0, 0, 1, 1, 1, false);
  shape_seal(box);
  qmat_scene *scene = qmat_scene_new();
  assert_non_null(scene);
  scene->name = qmat_strdup("octopus");
  scene->format = qmat_strdup("off");
  assert_int_equal(qmat_value_seal(&context, &scene->base), QMAT_OK);
  for (int draco = 0; draco < 2; draco++) {
    const char *const settings[][2] = {{"draco", draco ? "true" : "false"}, {NULL, NULL}};
    qmat_file *file = must_write(medial, (wiring){.scene = scene, .skin = box}, settings);
    json_t *root = glb_root(file);
    assert_string_equal(json_string_value(json_object_get(node_of(root), "name")), "octopus");
    assert_int_equal(json_integer_value(json_object_get(node_of(root), "mesh")), 0);
    assert_true((json_object_get(root, "extensionsRequired") != NULL) == (draco == 1));
    json_decref(root);
    qmat_value_release(&file->base);
  }
  qmat_value_release(&scene->base);
  qmat_value_release(&box->base);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

/* A slab of three spheres of radius 1, and a triangle with a vertex on its face, on its rim and on a corner. The
 * colours are Okabe and Ito's green, blue and orange, without the curve of sRGB. */
static void test_a_skins_vertices_have_the_colour_of_their_kind(void **state) {
  (void)state;
  static const uint8_t expected[12] = {0, 87, 44, 255, 24, 116, 208, 255, 202, 88, 0, 255};
  const double spheres[12] = {0, 0, 0, 1, 4, 0, 0, 1, 0, 4, 0, 1};
  qmat_context context = {0};
  qmat_medial *medial = sealed_medial_mesh(spheres, 3, NULL, 0, (const uint32_t[]){0, 1, 2}, 1);
  qmat_mesh *skin = shape_new();
  shape_vertex(skin, 1, 1, 1);
  shape_vertex(skin, 2, -1, 0);
  shape_vertex(skin, -0.6, -0.8, 0);
  shape_triangle(skin, 0, 1, 2);
  shape_seal(skin);

  const char *const settings[][2] = {{"skin_colours", "true"}, {NULL, NULL}};
  qmat_file *file = must_write(medial, (wiring){.skin = skin}, settings);
  json_t *root = glb_root(file),
         *primitive =
             json_array_get(json_object_get(json_array_get(json_object_get(root, "meshes"), 0), "primitives"), 0);
  const json_t *id = json_object_get(json_object_get(primitive, "attributes"), "COLOR_0");
  const json_t *accessor = json_array_get(json_object_get(root, "accessors"), (size_t)json_integer_value(id));
  const json_t *view = json_array_get(json_object_get(root, "bufferViews"),
                                      (size_t)json_integer_value(json_object_get(accessor, "bufferView")));
  assert_int_equal(json_integer_value(json_object_get(accessor, "componentType")), 5121);
  assert_true(json_is_true(json_object_get(accessor, "normalized")));
  assert_int_equal(json_integer_value(json_object_get(accessor, "count")), 3);
  uint32_t text;
  memcpy(&text, file->parts[0].bytes + 12, sizeof text);
  const uint8_t *data = (const uint8_t *)file->parts[0].bytes + 28 + text;
  assert_memory_equal(data + json_integer_value(json_object_get(view, "byteOffset")), expected, sizeof expected);
  json_decref(root);
  qmat_value_release(&file->base);

  const qmat_node *node = qmat_node_find("scene.write");
  const char *const both[][2] = {{"skin_colours", "true"}, {"draco", "true"}, {NULL, NULL}};
  void *params = make_params(node, both);
  const qmat_value *inputs[5] = {NULL};
  inputs[qmat_input_find(node, "medial")] = &medial->base;
  inputs[qmat_input_find(node, "skin")] = &skin->base;
  qmat_value *outputs[2] = {NULL};
  assert_int_equal(node->run(&context, params, inputs, outputs), QMAT_ERROR_USAGE);
  assert_string_equal(context.error.field, "skin_colours");
  free(params);
  qmat_value_release(&skin->base);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

static void test_each_format_is_made(void **state) {
  (void)state;
  qmat_medial *medial = make_medial();
  static const char *const formats[][2] = {{"glb", "glTF"},   {"gltf", "{"},           {"ma", "3 1 0"},
                                           {"ply", "ply"},    {"usda", "#usda 1.0\n"}, {"usdc", "PXR-USDC"},
                                           {"usdz", "PK\3\4"}};
  for (size_t i = 0; i < 7; i++) {
    const char *const settings[][2] = {{"format", formats[i][0]}, {NULL, NULL}};
    qmat_file *file = must_write(medial, (wiring){0}, settings);
    assert_string_equal(file->format, formats[i][0]);
    assert_true(file->parts[0].size > strlen(formats[i][1]));
    assert_memory_equal(file->parts[0].bytes, formats[i][1], strlen(formats[i][1]));
    qmat_value_release(&file->base);
  }
  qmat_value_release(&medial->base);
}

static void test_ma_keeps_every_number(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_medial *medial = make_medial(), *read = NULL;
  const char *const settings[][2] = {{"format", "ma"}, {NULL, NULL}};
  qmat_file *file = must_write(medial, (wiring){0}, settings);
  /* qmat_bytes promises 16 readable bytes after the last. */
  qmat_bytes bytes = {.size = file->parts[0].size, .data = qmat_calloc(file->parts[0].size + 16, 1)};
  assert_non_null(bytes.data);
  memcpy(bytes.data, file->parts[0].bytes, bytes.size);
  assert_int_equal(qmat_ma_read(&context, &bytes, "written.ma", &read), QMAT_OK);
  assert_memory_equal(&read->base.digest, &medial->base.digest, sizeof read->base.digest);
  qmat_bytes_uninit(&bytes);
  qmat_value_release(&read->base);
  qmat_value_release(&file->base);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

/* A centimetre mesh of a metre scene that was read mesh by mesh. */
static void test_a_file_in_the_units_of_a_mesh_says_so(void **state) {
  (void)state;
  static const struct {
    const char *format;
    size_t mesh_count;
    double meters_per_unit;
    bool warns;
  } cases[] = {{"ma", 1, 0.01, true},   {"ply", 1, 0.01, true}, {"usda", 1, 0.01, true},
               {"glb", 1, 0.01, false}, {"ma", 0, 0.01, false}, {"ma", 1, 1, false}};
  qmat_medial *medial = make_medial();
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    qmat_context context = {0};
    qmat_scene *scene = qmat_scene_new();
    assert_non_null(scene);
    scene->name = qmat_strdup("duck");
    scene->format = qmat_strdup("glb");
    scene->meters_per_unit = 1;
    scene->mesh_count = cases[i].mesh_count;
    if (scene->mesh_count > 0) scene->meshes = qmat_calloc(1, sizeof *scene->meshes);
    assert_int_equal(qmat_value_seal(&context, &scene->base), QMAT_OK);
    qmat_report *given = make_report(json_pack("{s:f}", "meters_per_unit", cases[i].meters_per_unit)), *report;
    const char *const settings[][2] = {{"format", cases[i].format}, {NULL, NULL}};
    qmat_file *file = must_write_with_report(medial, (wiring){.scene = scene, .report = given}, settings, &report);
    assert_int_equal(json_array_size(json_object_get(report->root, "warnings")), cases[i].warns);
    qmat_value_release(&file->base);
    qmat_value_release(&report->base);
    qmat_value_release(&given->base);
    qmat_value_release(&scene->base);
    qmat_context_uninit(&context);
  }
  qmat_value_release(&medial->base);
}

/* A glTF scene of one mesh; `glb` (NULL: the file was not kept) is copied. */
static qmat_scene *make_gltf_scene(const char *name, const qmat_writer *glb) {
  qmat_context context = {0};
  qmat_scene *scene = qmat_scene_new();
  assert_non_null(scene);
  scene->name = qmat_strdup(name);
  scene->format = qmat_strdup("glb");
  scene->meters_per_unit = 1;
  scene->mesh_count = 1;
  scene->meshes = qmat_calloc(1, sizeof *scene->meshes);
  if (glb) {
    scene->part_count = 1;
    scene->parts = qmat_calloc(1, sizeof *scene->parts);
    scene->parts[0] = (qmat_file_part){qmat_strdup(""), glb->size, qmat_alloc(glb->size, 1)};
    memcpy(scene->parts[0].bytes, glb->bytes, glb->size);
  }
  assert_int_equal(qmat_value_seal(&context, &scene->base), QMAT_OK);
  qmat_context_uninit(&context);
  return scene;
}

/* A sphere of radius 2 with a tetrahedron for a hull, and its mass properties. */
static qmat_colliders *make_colliders(void) {
  static const double sphere[] = {0, 0, 0, 2}, body[] = {7, 0, 0, 0, 1, 1, 1, 0, 0, 0};
  static const double tetrahedron[] = {-2, -2, -2, 2, 2, -2, -2, 2, 2, 2, -2, 2};
  return hull_colliders(sphere, 1, (const uint32_t[]){0, 0, 0}, 1, body, tetrahedron, 0);
}

/* Colliders of a centimetre mesh of a metre scene, beside a glTF file: a sphere of radius 2. */
static void test_files_for_robots_are_in_metres(void **state) {
  (void)state;
  qmat_scene *scene = make_gltf_scene("ball", NULL);
  qmat_colliders *c = make_colliders();
  qmat_medial *medial = make_medial();
  qmat_report *given = make_report(json_pack("{s:f}", "meters_per_unit", 0.01)), *report;
  const char *const settings[][2] = {{"format", "urdf"}, {NULL, NULL}};
  qmat_file *file =
      must_write_with_report(medial, (wiring){.scene = scene, .report = given, .colliders = c}, settings, &report);
  assert_non_null(memmem(file->parts[0].bytes, file->parts[0].size, "radius=\"0.02\"", 13));
  assert_int_equal(json_array_size(json_object_get(report->root, "warnings")), 0);
  qmat_value_release(&file->base);
  qmat_value_release(&report->base);
  qmat_value_release(&given->base);
  qmat_value_release(&medial->base);
  qmat_value_release(&scene->base);
  qmat_value_release(&c->base);
}

/* Nodes with the name that show a mesh. */
static size_t shown_as(json_t *root, const char *name) {
  size_t count = 0, i;
  json_t *node;
  json_array_foreach(json_object_get(root, "nodes"), i, node) {
    const char *own = json_string_value(json_object_get(node, "name"));
    count += own && strcmp(own, name) == 0 && json_is_integer(json_object_get(node, "mesh"));
  }
  return count;
}

/* Nodes with the extension, whose object has the key. */
static size_t extended_by(json_t *root, const char *extension, const char *key) {
  size_t count = 0, i;
  json_t *node;
  json_array_foreach(json_object_get(root, "nodes"), i, node) count +=
      json_object_get(json_object_get(json_object_get(node, "extensions"), extension), key) != NULL;
  return count;
}

static void test_each_form_of_colliders_is_written_where_it_is_chosen(void **state) {
  (void)state;
  static const struct {
    const char *chosen[2];
    size_t unreal, godot, khronos, omi;
  } cases[] = {{{NULL, NULL}, 0, 0, 1, 0},
               {{"khr_physics", NULL}, 0, 0, 1, 0},
               {{"omi_physics", NULL}, 0, 0, 0, 1},
               {{"unreal_hulls", NULL}, 1, 0, 0, 0},
               {{"godot_hulls", NULL}, 0, 1, 0, 0},
               {{"unreal_hulls", "khr_physics"}, 1, 0, 1, 0},
               {{"unreal_hulls", "godot_hulls"}, 1, 1, 0, 0}};
  qmat_medial *medial = make_medial();
  qmat_scene *scene = make_gltf_scene("ball", NULL);
  qmat_colliders *c = make_colliders();
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    const char *const settings[][2] = {{cases[i].chosen[0], "true"}, {cases[i].chosen[1], "true"}, {NULL, NULL}};
    qmat_file *file = must_write(medial, (wiring){.scene = scene, .colliders = c}, settings);
    json_t *root = glb_root(file);
    assert_int_equal(shown_as(root, "UCX_ball_01"), cases[i].unreal);
    assert_int_equal(shown_as(root, "ball_01-convcolonly"), cases[i].godot);
    assert_int_equal(extended_by(root, "KHR_physics_rigid_bodies", "collider"), cases[i].khronos);
    assert_int_equal(extended_by(root, "OMI_physics_body", "collider"), cases[i].omi);
    json_decref(root);
    qmat_value_release(&file->base);
  }
  qmat_value_release(&c->base);
  qmat_value_release(&scene->base);
  qmat_value_release(&medial->base);
}

static bool has_text(const qmat_file *file, const char *text) {
  return memmem(file->parts[0].bytes, file->parts[0].size, text, strlen(text)) != NULL;
}

static void test_bodies_that_are_fixed_have_colliders_and_no_mass(void **state) {
  (void)state;
  static const char *const extensions[] = {"KHR_physics_rigid_bodies", "OMI_physics_body"};
  qmat_medial *medial = make_medial();
  qmat_colliders *c = make_colliders();
  for (int fixed = 0; fixed < 2; fixed++) {
    const char *const settings[][2] = {
        {"khr_physics", "true"}, {"omi_physics", "true"}, {"fixed", fixed ? "true" : "false"}, {NULL, NULL}};
    qmat_file *file = must_write(medial, (wiring){.colliders = c}, settings);
    json_t *root = glb_root(file);
    for (size_t k = 0; k < 2; k++) {
      assert_int_equal(extended_by(root, extensions[k], "collider"), 1);
      assert_int_equal(extended_by(root, extensions[k], "motion"), !fixed);
    }
    char *text = json_dumps(root, JSON_COMPACT);
    assert_non_null(text);
    assert_int_equal(strstr(text, "\"mass\":7") != NULL, !fixed);
    free(text);
    json_decref(root);
    qmat_value_release(&file->base);
    const char *const usd[][2] = {{"format", "usda"}, {"fixed", fixed ? "true" : "false"}, {NULL, NULL}};
    file = must_write(medial, (wiring){.colliders = c}, usd);
    assert_int_equal(has_text(file, "physics:mass = 7"), !fixed);
    assert_int_equal(has_text(file, "PhysicsRigidBodyAPI"), !fixed);
    assert_true(has_text(file, "PhysicsCollisionAPI"));
    qmat_value_release(&file->base);
  }
  qmat_value_release(&c->base);
  qmat_value_release(&medial->base);
}

/* Unreal finds hulls by the name of their mesh, which the file's name is not. */
static void test_hulls_have_the_name_of_their_mesh_and_instances_share_a_body(void **state) {
  (void)state;
  static const char asset[] =
      "{'asset':{'version':'2.0'},'scenes':[{'nodes':[0]}],'extensionsUsed':['EXT_mesh_gpu_instancing'],"
      "'nodes':[{'mesh':0,'extensions':{'EXT_mesh_gpu_instancing':{'attributes':{'TRANSLATION':0}}}}],"
      "'meshes':[{'name':'Crate','primitives':[{'attributes':{'POSITION':0}}]}],"
      "'accessors':[{'bufferView':0,'componentType':5126,'count':8,'type':'VEC3','min':[0,0,0],'max':[1,1,1]}],"
      "'bufferViews':[{'buffer':0,'byteLength':96}],'buffers':[{'byteLength':96}]}";
  qmat_writer data = {0};
  put_box_corners(&data, 1);
  qmat_writer glb = asset_glb(asset, data.bytes, data.size);
  qmat_scene *scene = make_gltf_scene("file", &glb);
  qmat_medial *medial = make_medial();
  qmat_colliders *c = make_colliders();
  const char *const settings[][2] = {{"unreal_hulls", "true"}, {"godot_hulls", "true"}, {NULL, NULL}};
  qmat_report *report;
  qmat_file *file = must_write_with_report(medial, (wiring){.scene = scene, .colliders = c}, settings, &report);
  json_t *root = glb_root(file);
  assert_int_equal(shown_as(root, "UCX_Crate_01"), 1);
  assert_int_equal(shown_as(root, "Crate_01-convcolonly"), 1);
  const json_t *warnings = json_object_get(report->root, "warnings");
  assert_int_equal(json_array_size(warnings), 1);
  assert_non_null(strstr(json_string_value(json_array_get(warnings, 0)), ": 1 node with instances has one body"));
  assert_non_null(strstr(json_string_value(json_array_get(warnings, 0)), "EXT_mesh_gpu_instancing"));
  json_decref(root);
  qmat_value_release(&file->base);
  qmat_value_release(&report->base);
  file = must_write_with_report(medial, (wiring){.scene = scene}, NULL, &report);
  assert_int_equal(json_array_size(json_object_get(report->root, "warnings")), 0);
  qmat_value_release(&file->base);
  qmat_value_release(&report->base);
  qmat_value_release(&c->base);
  qmat_value_release(&medial->base);
  qmat_value_release(&scene->base);
  qmat_writer_uninit(&glb);
  qmat_writer_uninit(&data);
}

/* Writes with one setting, and returns the only warning, or "" for none; valid until the next call. */
static const char *warning_of(const qmat_medial *medial, wiring from, const char *name, const char *value) {
  static char text[400];
  qmat_report *report;
  qmat_file *file =
      must_write_with_report(medial, from, (const char *const[][2]){{name, value}, {NULL, NULL}}, &report);
  const json_t *warnings = json_object_get(report->root, "warnings");
  assert_true(json_array_size(warnings) <= 1);
  const char *warning = json_string_value(json_array_get(warnings, 0));
  snprintf(text, sizeof text, "%s", warning ? warning : "");
  qmat_value_release(&file->base);
  qmat_value_release(&report->base);
  return text;
}

static void test_bodies_that_nothing_follows_and_idle_settings_are_told(void **state) {
  (void)state;
  static const char asset[] =
      "{'asset':{'version':'2.0'},'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0}],"
      "'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}],"
      "'accessors':[{'bufferView':0,'componentType':5126,'count':8,'type':'VEC3','min':[0,0,0],'max':[1,1,1]}],"
      "'bufferViews':[{'buffer':0,'byteLength':96}],'buffers':[{'byteLength':96}]}";
  qmat_writer data = {0};
  put_box_corners(&data, 1);
  qmat_writer glb = asset_glb(asset, data.bytes, data.size);
  qmat_scene *each = make_gltf_scene("box", &glb), *merged = make_gltf_scene("box", &glb);
  merged->mesh_count = 0; /* one medial mesh for all of the scene */
  qmat_medial *medial = make_medial();
  qmat_colliders *c = make_colliders();
  assert_string_equal(warning_of(medial, (wiring){.scene = each, .colliders = c}, "khr_physics", "true"), "");
  assert_non_null(strstr(warning_of(medial, (wiring){.scene = merged, .colliders = c}, "khr_physics", "true"),
                         "the body of all meshes together moves alone"));
  assert_string_equal(warning_of(medial, (wiring){.scene = merged, .colliders = c}, "fixed", "true"), "");
  static const char *const idle[] = {"khr_physics", "omi_physics", "unreal_hulls", "godot_hulls", "fixed"};
  for (size_t i = 0; i < sizeof idle / sizeof *idle; i++) {
    const char *warning = warning_of(medial, (wiring){.scene = each}, idle[i], "true");
    assert_memory_equal(warning, idle[i], strlen(idle[i]));
    assert_non_null(strstr(warning, " has no effect without colliders"));
  }
  qmat_value_release(&c->base);
  qmat_value_release(&medial->base);
  merged->mesh_count = 1;
  qmat_value_release(&merged->base);
  qmat_value_release(&each->base);
  qmat_writer_uninit(&glb);
  qmat_writer_uninit(&data);
}

/* `draco` is about the skin, `draco_meshes` about the triangles of the scene. */
static void test_triangles_of_a_scene_are_compressed_where_that_is_chosen(void **state) {
  (void)state;
  static const char box[] =
      "{'asset':{'version':'2.0'},'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0}],"
      "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'indices':1}]}],"
      "'accessors':[{'bufferView':0,'componentType':5126,'count':8,'type':'VEC3','min':[0,0,0],'max':[1,1,1]},"
      "{'bufferView':1,'componentType':5123,'count':36,'type':'SCALAR'}],"
      "'bufferViews':[{'buffer':0,'byteLength':96},{'buffer':0,'byteOffset':96,'byteLength':72}],"
      "'buffers':[{'byteLength':168}]}";
  static const char *const chosen[] = {"side_files", "draco", "draco_meshes"};
  static const char *const extension = "KHR_draco_mesh_compression";
  qmat_writer data = {0};
  put_box_corners(&data, 1);
  put_box_triangles(&data);
  qmat_writer glb = asset_glb(box, data.bytes, data.size);
  qmat_scene *scene = make_gltf_scene("box", &glb);
  qmat_medial *medial = make_medial();
  for (int i = 0; i < 3; i++) {
    qmat_file *file =
        must_write(medial, (wiring){.scene = scene}, (const char *const[][2]){{chosen[i], "true"}, {NULL, NULL}});
    json_t *root = glb_root(file);
    const json_t *mesh = json_array_get(json_object_get(root, "meshes"), 0);
    const json_t *primitive = json_array_get(json_object_get(mesh, "primitives"), 0);
    const json_t *required = json_array_get(json_object_get(root, "extensionsRequired"), 0);
    assert_int_equal(json_object_get(json_object_get(primitive, "extensions"), extension) != NULL, i == 2);
    assert_int_equal(json_is_string(required) && strcmp(json_string_value(required), extension) == 0, i == 2);
    json_decref(root);
    qmat_value_release(&file->base);
  }
  qmat_value_release(&medial->base);
  qmat_value_release(&scene->base);
  qmat_writer_uninit(&glb);
  qmat_writer_uninit(&data);
}

/* `mat -o x.glb -o x.ma --set asset.draco=true` makes both files with the same parameters. */
static void test_compression_does_not_apply_to_formats_that_have_none(void **state) {
  (void)state;
  static const char *const fields[][2] = {{"draco", "true"}, {"position_bits", "8"}, {"radius_bits", "8"}};
  static const char *const formats[] = {"ma", "ply", "usda", "usdc", "usdz"};
  qmat_medial *medial = make_medial();
  for (size_t i = 0; i < 15; i++) {
    const char *const *field = fields[i / 5], *format = formats[i % 5];
    qmat_file *with = must_write(medial, (wiring){0},
                                 (const char *const[][2]){{"format", format}, {field[0], field[1]}, {NULL, NULL}});
    qmat_file *without = must_write(medial, (wiring){0}, (const char *const[][2]){{"format", format}, {NULL, NULL}});
    assert_memory_equal(&with->base.digest, &without->base.digest, sizeof with->base.digest);
    qmat_value_release(&with->base);
    qmat_value_release(&without->base);
  }
  qmat_value_release(&medial->base);
}

static void test_a_medial_mesh_without_spheres_is_refused(void **state) {
  (void)state;
  const qmat_node *node = qmat_node_find("scene.write");
  qmat_context context = {0};
  qmat_medial *none = qmat_medial_new();
  assert_non_null(none);
  assert_int_equal(qmat_value_seal(&context, &none->base), QMAT_OK);
  const qmat_value *inputs[5] = {NULL};
  inputs[qmat_input_find(node, "medial")] = &none->base;
  qmat_value *outputs[2] = {NULL};
  void *params = make_params(node, NULL);
  assert_int_equal(node->run(&context, params, inputs, outputs), QMAT_ERROR_GEOMETRY);
  assert_null(outputs[0]);
  free(params);
  qmat_value_release(&none->base);
  qmat_context_uninit(&context);
}

static void test_what_is_not_certified_fails_where_that_is_required(void **state) {
  (void)state;
  static const char *const settings[][2] = {{"require", "certified"}, {NULL, NULL}};
  const qmat_node *node = qmat_node_find("scene.write");
  qmat_medial *medial = make_medial();
  const struct {
    double error;
    int certified, status;
    const char *why;
  } cases[] = {
      {0.01, 1, QMAT_OK, NULL},
      {0.01, 0, QMAT_ERROR_GEOMETRY, "not certified: the errors are estimates, since the surface is not closed"},
      {0.03, 0, QMAT_ERROR_GEOMETRY, "not certified: the errors are 3.1 % and 1.1 % of the diagonal, and epsilon 2 %"},
      {0.01, -1, QMAT_ERROR_GEOMETRY, "not certified: no report says how large the errors are"}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    json_t *root = json_pack("{s:f, s:f, s:f, s:f}", "epsilon", 0.02, "surface_to_envelope", cases[i].error,
                             "envelope_to_surface", 0.01, "diagonal", 8.0);
    if (cases[i].certified >= 0) json_object_set_new(root, "certified", json_boolean(cases[i].certified));
    qmat_report *report = make_report(root);
    const qmat_value *inputs[5] = {NULL};
    inputs[qmat_input_find(node, "medial")] = &medial->base;
    inputs[qmat_input_find(node, "report")] = &report->base;
    qmat_value *outputs[2] = {NULL};
    void *params = make_params(node, settings);
    qmat_context context = {0};
    assert_int_equal(node->run(&context, params, inputs, outputs), cases[i].status);
    if (cases[i].why) {
      assert_string_equal(context.error.message, cases[i].why);
      assert_string_equal(context.error.field, "require");
      assert_null(outputs[0]);
    }
    qmat_value_release(outputs[0]);
    qmat_value_release(outputs[1]);
    qmat_value_release(&report->base);
    free(params);
    qmat_context_uninit(&context);
  }
  qmat_value_release(&medial->base);
}

static void test_the_same_inputs_give_the_same_bytes(void **state) {
  (void)state;
  qmat_medial *medial = make_medial();
  qmat_mesh *box = shape_new();
  shape_add_box(box, 0, 0, 0, 1, 1, 1, false);
  shape_seal(box);
  const char *const settings[][2] = {{"draco", "true"}, {NULL, NULL}};
  qmat_file *a = must_write(medial, (wiring){.skin = box}, settings);
  qmat_file *b = must_write(medial, (wiring){.skin = box}, settings);
  assert_memory_equal(&a->base.digest, &b->base.digest, sizeof a->base.digest);
  qmat_value_release(&a->base);
  qmat_value_release(&b->base);
  qmat_value_release(&box->base);
  qmat_value_release(&medial->base);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_the_report_goes_into_the_extras_with_what_quantisation_adds),
      cmocka_unit_test(test_the_errors_of_spheres_go_into_the_plain_form),
      cmocka_unit_test(test_what_is_certified_stays_so_where_quantisation_can_be_fine_enough),
      cmocka_unit_test(test_quantisation_takes_half_of_the_share_of_storage_at_most),
      cmocka_unit_test(test_scene_and_skin_name_and_show_the_node),
      cmocka_unit_test(test_a_skins_vertices_have_the_colour_of_their_kind),
      cmocka_unit_test(test_each_format_is_made),
      cmocka_unit_test(test_ma_keeps_every_number),
      cmocka_unit_test(test_a_file_in_the_units_of_a_mesh_says_so),
      cmocka_unit_test(test_files_for_robots_are_in_metres),
      cmocka_unit_test(test_each_form_of_colliders_is_written_where_it_is_chosen),
      cmocka_unit_test(test_bodies_that_are_fixed_have_colliders_and_no_mass),
      cmocka_unit_test(test_bodies_that_nothing_follows_and_idle_settings_are_told),
      cmocka_unit_test(test_hulls_have_the_name_of_their_mesh_and_instances_share_a_body),
      cmocka_unit_test(test_triangles_of_a_scene_are_compressed_where_that_is_chosen),
      cmocka_unit_test(test_compression_does_not_apply_to_formats_that_have_none),
      cmocka_unit_test(test_a_medial_mesh_without_spheres_is_refused),
      cmocka_unit_test(test_what_is_not_certified_fails_where_that_is_required),
      cmocka_unit_test(test_the_same_inputs_give_the_same_bytes),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
