/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <locale.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "io/base64.h"
#include "io/draco.h"
#include "io/draco_draco.h"
#include "io/flat_medial.h"
#include "io/gltf/gltf.h"
#include "io/gltf/gltf_write.h"
#include "io/stored_medial.h"
#include "tests/io/medial_examples.h"
#include "tests/shapes.h"

/* ---- what a file says ---- */

/* A written file, taken apart. */
typedef struct written {
  qmat_file *file;
  json_t *root;
  const uint8_t *chunk;
  size_t chunk_size;
  uint8_t *owned;
} written;

static uint32_t u32_at(const uint8_t *bytes) {
  return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

static float f32_at(const uint8_t *bytes) {
  float number;
  memcpy(&number, bytes, sizeof number);
  return number;
}

static qmat_gltf_options usual_options(void) {
  return (qmat_gltf_options){.binary = true,
                             .quantisation = 1e-3,
                             .name = "thing",
                             .errors.epsilon = 0.01,
                             .errors.error_out = 0.007,
                             .errors.error_in = 0.009,
                             .errors.certified = QMAT_CERTIFICATE_YES};
}

static void open_glb(written *w) {
  const uint8_t *bytes = w->file->parts[0].bytes;
  const size_t size = w->file->parts[0].size;
  assert_true(size >= 20);
  assert_memory_equal(bytes, "glTF", 4);
  assert_int_equal(u32_at(bytes + 4), 2);
  assert_int_equal(u32_at(bytes + 8), size);
  const size_t json_size = u32_at(bytes + 12);
  assert_int_equal(json_size % 4, 0);
  assert_memory_equal(bytes + 16, "JSON", 4);
  w->root = json_loadb((const char *)bytes + 20, json_size, JSON_REJECT_DUPLICATES, NULL);
  assert_non_null(w->root);
  if (20 + json_size == size) return;
  w->chunk_size = u32_at(bytes + 20 + json_size);
  assert_int_equal(w->chunk_size % 4, 0);
  assert_int_equal(28 + json_size + w->chunk_size, size);
  assert_memory_equal(bytes + 24 + json_size, "BIN", 4);
  w->chunk = bytes + 28 + json_size;
}

static void open_gltf(written *w) {
  const char *head = "data:application/octet-stream;base64,";
  w->root = json_loadb((const char *)w->file->parts[0].bytes, w->file->parts[0].size, JSON_REJECT_DUPLICATES, NULL);
  assert_non_null(w->root);
  json_t *uri = json_object_get(json_array_get(json_object_get(w->root, "buffers"), 0), "uri");
  if (!uri) return;
  const char *text = json_string_value(uri);
  assert_memory_equal(text, head, strlen(head));
  qmat_context context = {0};
  text += strlen(head);
  assert_int_equal(qmat_base64_decode(&context, text, strlen(text), &w->owned, &w->chunk_size), QMAT_OK);
  w->chunk = w->owned;
  qmat_context_uninit(&context);
}

static written write_file(const qmat_medial *medial, const qmat_mesh *skin, const qmat_gltf_options *options) {
  qmat_context context = {0};
  written w = {0};
  const qmat_status status = qmat_gltf_write(&context, medial, skin, options, &w.file);
  if (status != QMAT_OK) fail_msg("%s", context.error.message);
  assert_true(w.file->base.sealed);
  assert_int_equal(w.file->part_count, 1);
  assert_string_equal(w.file->parts[0].name, "");
  assert_string_equal(w.file->format, options->binary ? "glb" : "gltf");
  if (options->binary) {
    open_glb(&w);
  } else {
    open_gltf(&w);
  }
  qmat_context_uninit(&context);
  return w;
}

static void close_file(written *w) {
  json_decref(w->root);
  qmat_free(w->owned);
  qmat_value_release(&w->file->base);
}

static json_t *node_of(const written *w) {
  return json_array_get(json_object_get(w->root, "nodes"), 0);
}

static json_t *extra(const written *w, const char *key) {
  return json_object_get(json_object_get(node_of(w), "extras"), key);
}

static json_t *accessor_of(const written *w, size_t id) {
  return json_array_get(json_object_get(w->root, "accessors"), id);
}

static json_t *primitive_of(const written *w) {
  json_t *mesh = json_array_get(json_object_get(w->root, "meshes"), 0);
  return json_array_get(json_object_get(mesh, "primitives"), 0);
}

static size_t count_of(json_t *object, const char *key) {
  json_t *value = json_object_get(object, key);
  assert_true(json_is_integer(value));
  return (size_t)json_integer_value(value);
}

/* The bytes that an accessor's view starts with. */
static const uint8_t *accessor_bytes(const written *w, size_t id) {
  json_t *view = json_array_get(json_object_get(w->root, "bufferViews"), count_of(accessor_of(w, id), "bufferView"));
  json_t *offset = json_object_get(view, "byteOffset");
  return w->chunk + (offset ? json_integer_value(offset) : 0);
}

static qmat_medial *decode_extras(const written *w) {
  qmat_context context = {0};
  const char *text = json_string_value(extra(w, "qmat_data"));
  assert_non_null(text);
  uint8_t *bytes;
  size_t size;
  qmat_medial *medial;
  assert_int_equal(qmat_base64_decode(&context, text, strlen(text), &bytes, &size), QMAT_OK);
  assert_int_equal(qmat_draco_decode_medial(&context, bytes, size, NULL, &medial), QMAT_OK);
  qmat_free(bytes);
  qmat_context_uninit(&context);
  return medial;
}

static qmat_mesh *make_box(void) {
  qmat_mesh *mesh = shape_new();
  shape_add_box(mesh, -1, 0, 2, 1, 4, 3, false);
  shape_seal(mesh);
  return mesh;
}

/* ---- the medial mesh ---- */

static void test_the_medial_mesh_comes_back_within_the_stated_quantisation(void **state) {
  (void)state;
  static const size_t counts[] = {1, 3, 200};
  for (size_t c = 0; c < sizeof counts / sizeof *counts; c++) {
    for (int allowed = 1; allowed <= 5; allowed++) {
      qmat_medial *medial = example_medial(counts[c]);
      qmat_gltf_options options = usual_options();
      options.quantisation = pow(10, -allowed);
      written w = write_file(medial, NULL, &options);
      qmat_medial *decoded = decode_extras(&w);
      assert_int_equal(decoded->sphere_count, medial->sphere_count);
      assert_int_equal(decoded->edge_count, medial->edge_count);
      assert_int_equal(decoded->triangle_count, medial->triangle_count);
      if (medial->edge_count > 0) {
        assert_memory_equal(decoded->edges, medial->edges, 2 * medial->edge_count * sizeof *medial->edges);
      }
      if (medial->triangle_count > 0) {
        assert_memory_equal(decoded->triangles, medial->triangles, 3 * medial->triangle_count * sizeof(uint32_t));
      }
      const double stated = json_real_value(extra(&w, "qmat_quantisation"));
      assert_near(stated, qmat_medial_move(medial, decoded), 0);
      assert_true(stated <= options.quantisation);
      assert_int_equal(count_of(json_object_get(node_of(&w), "extras"), "qmat_vertices"), medial->sphere_count);
      assert_int_equal(count_of(json_object_get(node_of(&w), "extras"), "qmat_edges"), medial->edge_count);
      assert_int_equal(count_of(json_object_get(node_of(&w), "extras"), "qmat_triangles"), medial->triangle_count);
      qmat_value_release(&decoded->base);
      close_file(&w);
      qmat_value_release(&medial->base);
    }
  }
}

static void test_given_bits_are_taken_and_chosen_ones_are_no_waste(void **state) {
  (void)state;
  qmat_medial *medial = example_medial(200);
  qmat_gltf_options options = usual_options();
  written w = write_file(medial, NULL, &options);
  double position_range, radius_range;
  qmat_draco_medial_ranges(medial, &position_range, &radius_range);
  assert_int_equal(json_integer_value(extra(&w, "qmat_position_bits")), qmat_draco_bits_for(3, position_range, 5e-4));
  assert_int_equal(json_integer_value(extra(&w, "qmat_radius_bits")), qmat_draco_bits_for(1, radius_range, 5e-4));
  close_file(&w);
  options.position_bits = 7;
  options.radius_bits = 30;
  w = write_file(medial, NULL, &options);
  assert_int_equal(json_integer_value(extra(&w, "qmat_position_bits")), 7);
  assert_int_equal(json_integer_value(extra(&w, "qmat_radius_bits")), 30);
  close_file(&w);
  qmat_value_release(&medial->base);
}

static void test_extras_are_flat_and_leave_out_what_is_not_known(void **state) {
  (void)state;
  qmat_medial *medial = example_medial(3);
  qmat_gltf_options options = usual_options();
  written w = write_file(medial, NULL, &options);
  const char *key;
  json_t *value;
  json_object_foreach(json_object_get(node_of(&w), "extras"), key, value) {
    assert_memory_equal(key, "qmat_", 5);
    assert_true(json_is_string(value) || json_is_number(value) || json_is_boolean(value));
  }
  assert_near(json_real_value(extra(&w, "qmat_epsilon")), 0.01, 0);
  assert_near(json_real_value(extra(&w, "qmat_error_out")), 0.007, 0);
  assert_near(json_real_value(extra(&w, "qmat_error_in")), 0.009, 0);
  assert_true(json_is_true(extra(&w, "qmat_certified")));
  assert_string_equal(json_string_value(extra(&w, "qmat_version")), QMAT_VERSION);
  assert_string_equal(json_string_value(extra(&w, "qmat_frame")), "node");
  assert_string_equal(json_string_value(extra(&w, "qmat_error_unit")), "diagonal");
  close_file(&w);
  options.errors.epsilon = options.errors.error_out = options.errors.error_in = NAN;
  options.errors.certified = QMAT_CERTIFICATE_UNKNOWN;
  w = write_file(medial, NULL, &options);
  static const char *const unknown[] = {"qmat_epsilon", "qmat_error_out", "qmat_error_in", "qmat_error_unit",
                                        "qmat_certified"};
  for (size_t i = 0; i < sizeof unknown / sizeof *unknown; i++) assert_null(extra(&w, unknown[i]));
  close_file(&w);
  options.errors.certified = QMAT_CERTIFICATE_NO;
  w = write_file(medial, NULL, &options);
  assert_true(json_is_false(extra(&w, "qmat_certified")));
  close_file(&w);
  qmat_value_release(&medial->base);
}

/* The medial mesh in qmat_flat, which `w` has. */
static qmat_medial *decode_flat(const written *w) {
  qmat_context context = {0};
  const char *text = json_string_value(extra(w, "qmat_flat"));
  assert_non_null(text);
  uint8_t *bytes;
  size_t size;
  qmat_medial *medial;
  assert_int_equal(qmat_base64_decode(&context, text, strlen(text), &bytes, &size), QMAT_OK);
  assert_int_equal(qmat_flat_decode(&context, bytes, size, NULL, &medial), QMAT_OK);
  qmat_free(bytes);
  qmat_context_uninit(&context);
  return medial;
}

static void test_the_plain_form_has_the_numbers_that_were_asked_for_and_counts_in_the_errors(void **state) {
  (void)state;
  static const qmat_flat_form forms[] = {QMAT_FLAT_AUTO, QMAT_FLAT_AUTO, QMAT_FLAT_SHORT, QMAT_FLAT_FLOAT};
  static const double allowed[] = {1e-3, 1e-5, 1e-5, 1e-3};
  static const char *const named[] = {"u16", "f32", "u16", "f32"};
  qmat_medial *medial = example_medial(200);
  qmat_gltf_options options = usual_options();
  options.errors.diagonal = 20;
  for (size_t i = 0; i < 4; i++) {
    options.flat = forms[i];
    options.quantisation = allowed[i];
    written w = write_file(medial, NULL, &options);
    qmat_medial *flat = decode_flat(&w);
    assert_string_equal(json_string_value(extra(&w, "qmat_flat_format")), named[i]);
    const double stated = json_real_value(extra(&w, "qmat_flat_quantisation")),
                 draco = json_real_value(extra(&w, "qmat_quantisation"));
    assert_near(stated, qmat_medial_move(medial, flat), 0);
    if (forms[i] == QMAT_FLAT_AUTO) assert_true(stated <= allowed[i]);
    /* Both forms are within the errors that the file states. */
    assert_near(json_real_value(extra(&w, "qmat_error_out")), 0.007 + fmax(stated, draco) / 20, 1e-15);
    assert_near(json_real_value(extra(&w, "qmat_error_in")), 0.009 + fmax(stated, draco) / 20, 1e-15);
    if (forms[i] == QMAT_FLAT_SHORT) assert_true(stated > draco);
    qmat_value_release(&flat->base);
    close_file(&w);
  }
  options.flat = QMAT_FLAT_NONE;
  written w = write_file(medial, NULL, &options);
  static const char *const absent[] = {"qmat_flat", "qmat_flat_format", "qmat_flat_quantisation"};
  for (size_t i = 0; i < 3; i++) assert_null(extra(&w, absent[i]));
  close_file(&w);
  qmat_value_release(&medial->base);
}

static void test_without_a_skin_there_is_a_node_and_no_empty_array(void **state) {
  (void)state;
  qmat_medial *medial = example_medial(3);
  qmat_mesh *empty = shape_new();
  qmat_context context = {0};
  assert_int_equal(qmat_value_seal(&context, &empty->base), QMAT_OK);
  qmat_gltf_options options = usual_options();
  for (int form = 0; form < 2; form++) {
    options.binary = form == 0;
    written w = write_file(medial, form ? empty : NULL, &options);
    static const char *const absent[] = {"meshes",    "buffers",   "bufferViews",
                                         "accessors", "materials", "extensionsUsed"};
    for (size_t i = 0; i < sizeof absent / sizeof *absent; i++) assert_null(json_object_get(w.root, absent[i]));
    assert_null(json_object_get(node_of(&w), "mesh"));
    assert_non_null(extra(&w, "qmat_data"));
    assert_null(w.chunk);
    close_file(&w);
  }
  qmat_value_release(&empty->base);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

/* ---- the skin ---- */

static void test_the_skin_is_a_plain_mesh_with_exact_bounds(void **state) {
  (void)state;
  qmat_medial *medial = example_medial(3);
  qmat_mesh *box = make_box();
  box->deviation = 0.03125;
  qmat_gltf_options options = usual_options();
  written w = write_file(medial, box, &options);
  json_t *primitive = primitive_of(&w), *attributes = json_object_get(primitive, "attributes");
  assert_int_equal(json_integer_value(json_object_get(node_of(&w), "mesh")), 0);
  assert_null(json_object_get(w.root, "extensionsUsed"));
  const json_t *mesh = json_array_get(json_object_get(w.root, "meshes"), 0), *extras = json_object_get(mesh, "extras");
  assert_near(json_number_value(json_object_get(extras, "qmat_skin_error")), 0.03125, 0);
  assert_string_equal(json_string_value(json_object_get(extras, "qmat_skin_error_unit")), "model");
  json_t *position = accessor_of(&w, count_of(attributes, "POSITION"));
  const double low[3] = {-1, 0, 2}, high[3] = {1, 4, 3};
  for (size_t k = 0; k < 3; k++) {
    assert_near(json_number_value(json_array_get(json_object_get(position, "min"), k)), low[k], 0);
    assert_near(json_number_value(json_array_get(json_object_get(position, "max"), k)), high[k], 0);
  }
  assert_int_equal(count_of(position, "count"), box->vertex_count);
  json_t *indices = accessor_of(&w, count_of(primitive, "indices"));
  assert_int_equal(count_of(indices, "componentType"), 5123);
  assert_int_equal(count_of(indices, "count"), 3 * box->triangle_count);
  const uint8_t *bytes = accessor_bytes(&w, count_of(primitive, "indices"));
  for (size_t i = 0; i < 3 * box->triangle_count; i++) {
    assert_int_equal(bytes[2 * i] | bytes[2 * i + 1] << 8, box->triangles[i]);
  }
  const uint8_t *floats = accessor_bytes(&w, count_of(attributes, "POSITION"));
  for (size_t i = 0; i < 3 * box->vertex_count; i++) assert_near((double)f32_at(floats + 4 * i), box->positions[i], 0);
  /* The buffer is the chunk, and its views fill it without a gap wider than padding. */
  json_t *buffer = json_array_get(json_object_get(w.root, "buffers"), 0);
  assert_int_equal(count_of(buffer, "byteLength"), w.chunk_size);
  assert_int_equal(w.chunk_size, (24 * box->vertex_count + 6 * box->triangle_count + 3) / 4 * 4);
  close_file(&w);
  qmat_value_release(&box->base);
  qmat_value_release(&medial->base);
}

/* The skin in the space of the file, as a viewer places it. */
static void test_other_units_and_z_up_become_metres_and_y_up(void **state) {
  (void)state;
  static const struct {
    double unit;
    bool is_z_up;
    size_t nodes;
    double low[3], high[3];
  } cases[] = {{0.01, true, 2, {-0.01, 0.02, -0.04}, {0.01, 0.03, 0}},
               {1, true, 2, {-1, 2, -4}, {1, 3, 0}},
               {0.0254, false, 2, {-0.0254, 0, 0.0508}, {0.0254, 0.1016, 0.0762}},
               {1, false, 1, {-1, 0, 2}, {1, 4, 3}},
               {0, false, 1, {-1, 0, 2}, {1, 4, 3}}};
  qmat_medial *medial = example_medial(3);
  qmat_mesh *box = make_box();
  for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
    qmat_context context = {0};
    qmat_soup soup = {0};
    qmat_gltf_options options = usual_options();
    options.meters_per_unit = cases[c].unit;
    options.is_z_up = cases[c].is_z_up;
    written w = write_file(medial, box, &options);
    assert_int_equal(json_array_size(json_object_get(w.root, "nodes")), cases[c].nodes);
    const qmat_file_part *part = &w.file->parts[0];
    assert_int_equal(qmat_gltf_parse(&context, part->bytes, part->size, "file", &soup, NULL), QMAT_OK);
    for (size_t k = 0; k < 3; k++) {
      double low = INFINITY, high = -INFINITY;
      for (size_t i = 0; i < soup.vertex_count; i++) {
        low = fmin(low, soup.positions[3 * i + k]);
        high = fmax(high, soup.positions[3 * i + k]);
      }
      assert_near(low, cases[c].low[k], 1e-6 * fmax(1, cases[c].unit));
      assert_near(high, cases[c].high[k], 1e-6 * fmax(1, cases[c].unit));
    }
    qmat_soup_uninit(&soup);
    close_file(&w);
    qmat_context_uninit(&context);
  }
  qmat_value_release(&box->base);
  qmat_value_release(&medial->base);
}

static void test_normals_weigh_facets_by_area(void **state) {
  (void)state;
  qmat_medial *medial = example_medial(3);
  /* Two triangles share vertex 0: one of area 3 facing z, one of area 4 facing x. Vertex 5 is on none. */
  qmat_mesh *mesh = shape_new();
  shape_vertex(mesh, 0, 0, 0);
  shape_vertex(mesh, 3, 0, 0);
  shape_vertex(mesh, 0, 2, 0);
  shape_vertex(mesh, 0, 4, 0);
  shape_vertex(mesh, 0, 0, 2);
  shape_vertex(mesh, 9, 9, 9);
  shape_triangle(mesh, 0, 1, 2);
  shape_triangle(mesh, 0, 3, 4);
  qmat_context context = {0};
  assert_int_equal(qmat_value_seal(&context, &mesh->base), QMAT_OK);
  qmat_gltf_options options = usual_options();
  written w = write_file(medial, mesh, &options);
  const uint8_t *normals = accessor_bytes(&w, count_of(json_object_get(primitive_of(&w), "attributes"), "NORMAL"));
  const double expected[18] = {0.8, 0, 0.6, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 0, 1};
  for (size_t i = 0; i < 18; i++) assert_near((double)f32_at(normals + 4 * i), expected[i], 1e-7);
  close_file(&w);
  qmat_value_release(&mesh->base);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

static void test_indices_widen_where_16_bits_end(void **state) {
  (void)state;
  qmat_medial *medial = example_medial(1);
  for (size_t count = 65535; count <= 65536; count++) {
    qmat_mesh *mesh = qmat_mesh_new();
    mesh->positions = qmat_calloc(3 * count, sizeof *mesh->positions);
    mesh->triangles = qmat_alloc(3, sizeof *mesh->triangles);
    assert_true(mesh->positions && mesh->triangles);
    mesh->vertex_count = count;
    mesh->triangle_count = 1;
    const uint32_t last = (uint32_t)count - 1, triangle[3] = {0, 1, last};
    memcpy(mesh->triangles, triangle, sizeof triangle);
    mesh->positions[3] = 1;
    mesh->positions[3 * (size_t)last + 1] = 1;
    qmat_context context = {0};
    assert_int_equal(qmat_value_seal(&context, &mesh->base), QMAT_OK);
    qmat_gltf_options options = usual_options();
    written w = write_file(medial, mesh, &options);
    const size_t id = count_of(primitive_of(&w), "indices");
    assert_int_equal(count_of(accessor_of(&w, id), "componentType"), count == 65535 ? 5123 : 5125);
    const uint8_t *bytes = accessor_bytes(&w, id);
    assert_int_equal(count == 65535 ? (uint32_t)(bytes[4] | bytes[5] << 8) : u32_at(bytes + 8), last);
    close_file(&w);
    qmat_value_release(&mesh->base);
    qmat_context_uninit(&context);
  }
  qmat_value_release(&medial->base);
}

static void test_a_compressed_skin_states_what_is_decoded(void **state) {
  (void)state;
  qmat_medial *medial = example_medial(3);
  qmat_mesh *box = make_box();
  qmat_gltf_options options = usual_options();
  options.compress_skin = true;
  written w = write_file(medial, box, &options);
  assert_string_equal(json_string_value(json_array_get(json_object_get(w.root, "extensionsRequired"), 0)),
                      "KHR_draco_mesh_compression");
  json_t *extension = json_object_get(json_object_get(primitive_of(&w), "extensions"), "KHR_draco_mesh_compression");
  json_t *ids = json_object_get(extension, "attributes");
  json_t *view = json_array_get(json_object_get(w.root, "bufferViews"), count_of(extension, "bufferView"));
  for (size_t i = 0; i < 3; i++) assert_null(json_object_get(accessor_of(&w, i), "bufferView"));

  qmat_context context = {0};
  qmat_draco_mesh *mesh;
  assert_int_equal(qmat_draco_mesh_new(&context, w.chunk, count_of(view, "byteLength"), &mesh), QMAT_OK);
  json_t *position = accessor_of(&w, 0);
  const size_t count = qmat_draco_mesh_point_count(mesh);
  assert_int_equal(count_of(position, "count"), count);
  assert_int_equal(count_of(accessor_of(&w, 2), "count"), 3 * qmat_draco_mesh_face_count(mesh));
  double *positions = malloc(3 * count * sizeof *positions);
  assert_non_null(positions);
  assert_int_equal(qmat_draco_mesh_attribute(&context, mesh, (uint32_t)count_of(ids, "POSITION"), 3, positions),
                   QMAT_OK);
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t i = 0; i < 3 * count; i++) {
    low[i % 3] = fmin(low[i % 3], positions[i]);
    high[i % 3] = fmax(high[i % 3], positions[i]);
  }
  for (size_t k = 0; k < 3; k++) {
    assert_near(json_number_value(json_array_get(json_object_get(position, "min"), k)), low[k], 0);
    assert_near(json_number_value(json_array_get(json_object_get(position, "max"), k)), high[k], 0);
    assert_near(low[k], ((const double[]){-1, 0, 2})[k], options.quantisation);
    assert_near(high[k], ((const double[]){1, 4, 3})[k], options.quantisation);
  }
  free(positions);
  qmat_draco_mesh_free(mesh);
  qmat_context_uninit(&context);
  close_file(&w);
  qmat_value_release(&box->base);
  qmat_value_release(&medial->base);
}

static void test_every_form_is_read_back_as_the_skin(void **state) {
  (void)state;
  qmat_medial *medial = example_medial(200);
  qmat_mesh *box = make_box();
  for (int form = 0; form < 4; form++) {
    qmat_gltf_options options = usual_options();
    options.binary = form % 2;
    options.compress_skin = form / 2;
    written w = write_file(medial, box, &options);
    qmat_context context = {0};
    qmat_soup soup = {0};
    assert_int_equal(qmat_gltf_parse(&context, w.file->parts[0].bytes, w.file->parts[0].size, "written", &soup, NULL),
                     QMAT_OK);
    assert_int_equal(soup.facet_count, box->triangle_count);
    assert_int_equal(soup.vertex_count, box->vertex_count);
    double volume = 0; /* of the tetrahedra to the origin: right only if every triangle is there and faces outwards */
    for (size_t t = 0; t < soup.facet_count; t++) {
      const double *a = soup.positions + 3 * (size_t)soup.corners[3 * t];
      const double *b = soup.positions + 3 * (size_t)soup.corners[3 * t + 1];
      const double *c = soup.positions + 3 * (size_t)soup.corners[3 * t + 2];
      volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                 a[2] * (b[0] * c[1] - b[1] * c[0])) /
                6;
    }
    assert_near(volume, 8, options.compress_skin ? 0.05 : 0);
    qmat_soup_uninit(&soup);
    qmat_context_uninit(&context);
    close_file(&w);
  }
  qmat_value_release(&box->base);
  qmat_value_release(&medial->base);
}

/* ---- bytes ---- */

static void test_the_bytes_do_not_depend_on_run_or_locale(void **state) {
  (void)state;
  qmat_medial *medial = example_medial(200);
  qmat_mesh *box = make_box();
  for (int form = 0; form < 4; form++) {
    qmat_gltf_options options = usual_options();
    options.binary = form % 2;
    options.compress_skin = form / 2;
    written a = write_file(medial, box, &options);
    if (!setlocale(LC_ALL, "de_DE.UTF-8")) print_message("de_DE.UTF-8 is not installed: compared in one locale\n");
    written b = write_file(medial, box, &options);
    setlocale(LC_ALL, "C");
    assert_memory_equal(&a.file->base.digest, &b.file->base.digest, sizeof a.file->base.digest);
    close_file(&a);
    close_file(&b);
  }
  qmat_value_release(&box->base);
  qmat_value_release(&medial->base);
}

static void test_names_that_are_not_utf8_are_left_out(void **state) {
  (void)state;
  qmat_medial *medial = example_medial(1);
  qmat_mesh *box = make_box();
  qmat_gltf_options options = usual_options();
  written w = write_file(medial, box, &options);
  assert_string_equal(json_string_value(json_object_get(node_of(&w), "name")), "thing");
  close_file(&w);
  static const char *const nameless[] = {"", "\xff\xfe", NULL};
  for (size_t i = 0; i < 3; i++) {
    options.name = nameless[i];
    w = write_file(medial, box, &options);
    assert_null(json_object_get(node_of(&w), "name"));
    close_file(&w);
  }
  qmat_value_release(&box->base);
  qmat_value_release(&medial->base);
}

static void test_what_cannot_be_written_is_refused(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_gltf_options options = usual_options();
  qmat_file *file;
  qmat_medial *none = qmat_medial_new();
  assert_int_equal(qmat_value_seal(&context, &none->base), QMAT_OK);
  assert_int_equal(qmat_gltf_write(&context, none, NULL, &options, &file), QMAT_ERROR_GEOMETRY);
  assert_null(file);
  qmat_value_release(&none->base);

  qmat_medial *medial = example_medial(3);
  options.position_bits = 31;
  assert_int_equal(qmat_gltf_write(&context, medial, NULL, &options, &file), QMAT_ERROR_USAGE);
  options.position_bits = 0;
  qmat_mesh *far = shape_new();
  shape_add_box(far, 0, 0, 0, 1, 1, 1e40, false);
  shape_seal(far);
  assert_int_equal(qmat_gltf_write(&context, medial, far, &options, &file), QMAT_ERROR_GEOMETRY);
  assert_string_equal(context.error.field, "skin");
  assert_string_equal(context.error.element_kind, "vertex");
  assert_null(file);
  qmat_value_release(&far->base);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

static void test_base64_follows_the_rfc(void **state) {
  (void)state;
  /* RFC 4648, section 10. */
  static const char *const vectors[][2] = {{"", ""},
                                           {"f", "Zg=="},
                                           {"fo", "Zm8="},
                                           {"foo", "Zm9v"},
                                           {"foob", "Zm9vYg=="},
                                           {"fooba", "Zm9vYmE="},
                                           {"foobar", "Zm9vYmFy"}};
  qmat_context context = {0};
  uint8_t *bytes;
  size_t size;
  for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++) {
    char *text = qmat_base64_encode((const uint8_t *)vectors[i][0], strlen(vectors[i][0]));
    assert_string_equal(text, vectors[i][1]);
    assert_int_equal(qmat_base64_decode(&context, text, strlen(text), &bytes, &size), QMAT_OK);
    assert_int_equal(size, strlen(vectors[i][0]));
    if (size > 0) assert_memory_equal(bytes, vectors[i][0], size);
    qmat_free(bytes);
    qmat_free(text);
  }
  /* Longer than one of OpenSSL's calls. */
  const size_t large = ((size_t)3 << 20) * 2 + 1;
  uint8_t *data = malloc(large);
  assert_non_null(data);
  for (size_t i = 0; i < large; i++) data[i] = (uint8_t)(i * 2654435761u >> 13);
  char *text = qmat_base64_encode(data, large);
  assert_int_equal(strlen(text), (large + 2) / 3 * 4);
  assert_int_equal(qmat_base64_decode(&context, text, strlen(text), &bytes, &size), QMAT_OK);
  assert_int_equal(size, large);
  assert_memory_equal(bytes, data, large);
  qmat_free(bytes);
  qmat_free(text);
  free(data);
  static const char *const bad[] = {"Zg=", "Z===", "Zg==Zg==", " Zg=", "Zm9v\n", "Zm9-", "===="};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    assert_int_equal(qmat_base64_decode(&context, bad[i], strlen(bad[i]), &bytes, &size), QMAT_ERROR_FORMAT);
    assert_null(bytes);
  }
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_the_medial_mesh_comes_back_within_the_stated_quantisation),
      cmocka_unit_test(test_given_bits_are_taken_and_chosen_ones_are_no_waste),
      cmocka_unit_test(test_extras_are_flat_and_leave_out_what_is_not_known),
      cmocka_unit_test(test_the_plain_form_has_the_numbers_that_were_asked_for_and_counts_in_the_errors),
      cmocka_unit_test(test_without_a_skin_there_is_a_node_and_no_empty_array),
      cmocka_unit_test(test_the_skin_is_a_plain_mesh_with_exact_bounds),
      cmocka_unit_test(test_other_units_and_z_up_become_metres_and_y_up),
      cmocka_unit_test(test_normals_weigh_facets_by_area),
      cmocka_unit_test(test_indices_widen_where_16_bits_end),
      cmocka_unit_test(test_a_compressed_skin_states_what_is_decoded),
      cmocka_unit_test(test_every_form_is_read_back_as_the_skin),
      cmocka_unit_test(test_the_bytes_do_not_depend_on_run_or_locale),
      cmocka_unit_test(test_names_that_are_not_utf8_are_left_out),
      cmocka_unit_test(test_what_cannot_be_written_is_refused),
      cmocka_unit_test(test_base64_follows_the_rfc),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
