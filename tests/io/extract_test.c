/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/extract.h"

#include <math.h>

#include "core/json_text.h"
#include "io/gltf/gltf_write.h"
#include "io/mesh/ma.h"
#include "io/usd/usd_write.h"
#include "tests/io/files.h"
#include "tests/io/medial_examples.h"

static char folder[64];

static int set_up(void **state) {
  (void)state;
  make_folder(folder);
  return 0;
}

static int tear_down(void **state) {
  (void)state;
  return rmdir(folder);
}

static qmat_status extract_from(qmat_context *context, const char *file, const void *content, size_t size,
                                const char *name, qmat_medial **medial, json_t *facts) {
  char path[128];
  snprintf(path, sizeof path, "%s/%s", folder, file);
  write_file(path, content, size);
  qmat_status status = qmat_medial_extract(context, path, name, medial, facts);
  unlink(path);
  return status;
}

/* A .gltf of one node, as JSON. */
static json_t *write_gltf(const qmat_medial *medial) {
  qmat_context context = {0};
  qmat_file *file;
  const qmat_gltf_options options = {.quantisation = 1e-4, .name = "first", .errors.epsilon = 0.01};
  assert_int_equal(qmat_gltf_write(&context, medial, NULL, &options, &file), QMAT_OK);
  json_t *root = json_loadb((const char *)file->parts[0].bytes, file->parts[0].size, 0, NULL);
  assert_non_null(root);
  qmat_value_release(&file->base);
  qmat_context_uninit(&context);
  return root;
}

static qmat_status extract_json(qmat_context *context, const json_t *root, const char *name, qmat_medial **medial,
                                json_t *facts) {
  size_t size;
  char *text = qmat_json_text(root, 0, &size);
  assert_non_null(text);
  qmat_status status = extract_from(context, "a.gltf", text, size, name, medial, facts);
  qmat_free(text);
  return status;
}

static json_t *extras_of(json_t *root, size_t node) {
  return json_object_get(json_array_get(json_object_get(root, "nodes"), node), "extras");
}

static void test_what_was_written_comes_back_with_its_facts(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_medial *medial = example_medial(200), *read;
  json_t *root = write_gltf(medial), *facts = json_object();
  assert_int_equal(extract_json(&context, root, NULL, &read, facts), QMAT_OK);
  assert_int_equal(read->sphere_count, medial->sphere_count);
  assert_int_equal(read->edge_count, medial->edge_count);
  assert_memory_equal(read->edges, medial->edges, 2 * medial->edge_count * sizeof(uint32_t));
  assert_int_equal(read->triangle_count, medial->triangle_count);
  assert_true(json_real_value(json_object_get(facts, "qmat_epsilon")) == 0.01);
  assert_null(json_object_get(facts, "qmat_data"));
  qmat_value_release(&read->base);
  json_decref(facts);
  json_decref(root);

  qmat_file *file;
  assert_int_equal(qmat_ma_write(&context, medial, &file), QMAT_OK);
  assert_int_equal(extract_from(&context, "a.ma", file->parts[0].bytes, file->parts[0].size, NULL, &read, NULL),
                   QMAT_OK);
  assert_memory_equal(&read->base.digest, &medial->base.digest, sizeof read->base.digest);
  qmat_value_release(&read->base);
  qmat_value_release(&file->base);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

/* How many spheres lie on no edge, and edges on no triangle. */
static void count_loose(const qmat_medial *medial, size_t *spheres, size_t *edges) {
  *spheres = *edges = 0;
  for (uint32_t i = 0; i < medial->sphere_count; i++) {
    bool used = false;
    for (size_t k = 0; k < 2 * medial->edge_count; k++) used = used || medial->edges[k] == i;
    *spheres += !used;
  }
  for (size_t e = 0; e < medial->edge_count; e++) {
    bool used = false;
    for (size_t t = 0; t < medial->triangle_count; t++) {
      int ends = 0;
      for (size_t k = 0; k < 6; k++) ends += medial->triangles[3 * t + k / 2] == medial->edges[2 * e + k % 2];
      used = used || ends == 2;
    }
    *edges += !used;
  }
}

/* The largest move of a centre and its radius together, in long double: what qmat_quantisation states. */
static double largest_move(const qmat_medial *a, const qmat_medial *b) {
  long double largest = 0;
  for (size_t i = 0; i < a->sphere_count; i++) {
    const double *p = a->spheres + 4 * i, *q = b->spheres + 4 * i;
    const long double x = (long double)p[0] - q[0], y = (long double)p[1] - q[1], z = (long double)p[2] - q[2];
    largest = fmaxl(largest, sqrtl(x * x + y * y + z * z) + fabsl((long double)p[3] - q[3]));
  }
  return (double)largest;
}

static void test_every_form_gives_back_what_was_written_within_what_it_states(void **state) {
  (void)state;
  static const char *const names[] = {"a.glb", "a.gltf", "a.usda", "a.usdc", "a.usdz"};
  static const size_t counts[] = {1, 3, 200};
  for (size_t c = 0; c < sizeof counts / sizeof *counts; c++) {
    qmat_medial *medial = example_medial(counts[c]);
    size_t loose_spheres, loose_edges;
    count_loose(medial, &loose_spheres, &loose_edges);
    if (counts[c] == 200) assert_true(loose_spheres > 0 && loose_edges > 0 && medial->triangle_count > 0);
    for (size_t form = 0; form < 5; form++) {
      qmat_context context = {0};
      const qmat_gltf_options gltf = {.binary = form == 0, .quantisation = 1e-4, .errors.epsilon = 0.01};
      const qmat_usd_options usd = {.form = form < 2 ? QMAT_USD_TEXT : (qmat_usd_form)(form - 2),
                                    .errors.epsilon = 0.01};
      qmat_file *file;
      qmat_medial *read;
      json_t *facts = json_object();
      assert_int_equal(form < 2 ? qmat_gltf_write(&context, medial, NULL, &gltf, &file)
                                : qmat_usd_write(&context, medial, NULL, &usd, &file),
                       QMAT_OK);
      const qmat_file_part *part = file->parts;
      if (extract_from(&context, names[form], part->bytes, part->size, NULL, &read, facts) != QMAT_OK)
        fail_msg("%s: %s", names[form], context.error.message);
      assert_int_equal(read->sphere_count, medial->sphere_count);
      assert_int_equal(read->edge_count, medial->edge_count);
      assert_int_equal(read->triangle_count, medial->triangle_count);
      if (medial->edge_count > 0)
        assert_memory_equal(read->edges, medial->edges, 2 * medial->edge_count * sizeof(uint32_t));
      if (medial->triangle_count > 0)
        assert_memory_equal(read->triangles, medial->triangles, 3 * medial->triangle_count * sizeof(uint32_t));
      const double stated = json_number_value(json_object_get(facts, "qmat_quantisation"));
      assert_true(stated > 0 && stated <= 1e-4);
      assert_true(largest_move(medial, read) <= stated * (1 + 1e-12));
      qmat_value_release(&read->base);
      qmat_value_release(&file->base);
      json_decref(facts);
      qmat_context_uninit(&context);
    }
    qmat_value_release(&medial->base);
  }
}

static void assert_fails(const json_t *root, const char *name, qmat_status expected, const char *message) {
  qmat_context context = {0};
  qmat_medial *read;
  assert_int_equal(extract_json(&context, root, name, &read, NULL), expected);
  assert_null(read);
  assert_string_equal(context.error.message, message);
  assert_non_null(strstr(context.error.file, "a.gltf"));
  qmat_context_uninit(&context);
}

static void test_of_several_one_has_to_be_named(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_medial *medial = example_medial(20), *read;
  json_t *root = write_gltf(medial), *nodes = json_object_get(root, "nodes");
  json_t *second = json_deep_copy(json_array_get(nodes, 0));
  json_object_set_new(second, "name", json_string("second"));
  json_array_append_new(nodes, second);
  assert_int_equal(extract_json(&context, root, NULL, &read, NULL), QMAT_OK); /* both carry the same one */
  qmat_value_release(&read->base);
  qmat_medial *other = example_medial(3);
  json_t *other_root = write_gltf(other);
  json_object_set(second, "extras", extras_of(other_root, 0));
  assert_int_equal(extract_json(&context, root, "1", &read, NULL), QMAT_OK); /* by its number */
  assert_int_equal(read->sphere_count, 3);
  qmat_value_release(&read->base);
  json_decref(other_root);
  qmat_value_release(&other->base);
  assert_fails(root, NULL, QMAT_ERROR_USAGE, "2 nodes have a medial mesh; choose one");
  assert_fails(root, "third", QMAT_ERROR_GEOMETRY, "no node of this name has a medial mesh");
  assert_fails(root, "7", QMAT_ERROR_GEOMETRY, "node 7 has no medial mesh");
  assert_int_equal(extract_json(&context, root, "7", &read, NULL), QMAT_ERROR_GEOMETRY);
  assert_string_equal(context.error.hint, "these have one: first, second");
  assert_int_equal(extract_json(&context, root, "second", &read, NULL), QMAT_OK);
  qmat_value_release(&read->base);
  json_decref(root);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

/* Far from zero the medial mesh is on a child of the node with the mesh. */
static void test_the_node_with_the_mesh_stands_for_its_child(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_medial *medial = example_medial(20), *read;
  json_t *root = write_gltf(medial), *nodes = json_object_get(root, "nodes");
  json_array_append_new(nodes, json_pack("{s:s, s:i, s:[i]}", "name", "body", "mesh", 0, "children", 0));
  json_array_append_new(nodes, json_pack("{s:s, s:[i]}", "name", "group", "children", 1));
  static const char *const called[] = {"first", "0", "body", "1"};
  for (size_t i = 0; i < 4; i++) {
    assert_int_equal(extract_json(&context, root, called[i], &read, NULL), QMAT_OK);
    assert_int_equal(read->sphere_count, medial->sphere_count);
    qmat_value_release(&read->base);
  }
  assert_fails(root, "group", QMAT_ERROR_GEOMETRY, "no node of this name has a medial mesh");
  json_decref(root);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

static void test_broken_data_and_wrong_counts_are_errors(void **state) {
  (void)state;
  qmat_medial *medial = example_medial(20);
  json_t *root = write_gltf(medial);
  char message[128];
  snprintf(message, sizeof message, "qmat_edges differs from the actual count, %zu", medial->edge_count);
  json_object_set_new(extras_of(root, 0), "qmat_edges", json_integer(77));
  assert_fails(root, NULL, QMAT_ERROR_FORMAT, message);
  json_object_set_new(extras_of(root, 0), "qmat_data", json_string("AAAA"));
  qmat_context context = {0};
  qmat_medial *read;
  assert_int_equal(extract_json(&context, root, NULL, &read, NULL), QMAT_ERROR_FORMAT);
  assert_null(read);
  assert_int_equal(context.error.element, 0);
  json_object_del(extras_of(root, 0), "qmat_data");
  json_object_del(extras_of(root, 0), "qmat_flat");
  assert_fails(root, NULL, QMAT_ERROR_GEOMETRY, "no node has a medial mesh");
  static const char off[] = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  assert_int_equal(extract_from(&context, "a.off", off, sizeof off - 1, NULL, &read, NULL), QMAT_ERROR_GEOMETRY);
  assert_string_equal(context.error.message, "OFF does not carry medial meshes");
  json_decref(root);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

static void test_the_plain_form_is_read_alone_and_compared_beside_draco(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_medial *medial = example_medial(200), *other = example_medial(20), *read;
  json_t *root = write_gltf(medial), *other_root = write_gltf(other), *extras = extras_of(root, 0);
  json_t *draco = json_incref(json_object_get(extras, "qmat_data")), *facts = json_object();
  json_object_del(extras, "qmat_data");
  assert_int_equal(extract_json(&context, root, NULL, &read, facts), QMAT_OK);
  assert_int_equal(read->sphere_count, medial->sphere_count);
  assert_memory_equal(read->edges, medial->edges, 2 * medial->edge_count * sizeof(uint32_t));
  assert_memory_equal(read->triangles, medial->triangles, 3 * medial->triangle_count * sizeof(uint32_t));
  const double stated = json_number_value(json_object_get(facts, "qmat_flat_quantisation"));
  assert_true(stated > 0 && stated <= 1e-4);
  assert_true(largest_move(medial, read) <= stated * (1 + 1e-12));
  assert_null(json_object_get(facts, "qmat_flat"));
  qmat_value_release(&read->base);
  /* Draco data of the same mesh, whose radii the plain form does not have. */
  json_object_set_new(extras, "qmat_data", draco);
  json_object_set_new(extras, "qmat_quantisation", json_real(1e-9));
  json_object_set_new(extras, "qmat_flat_quantisation", json_real(1e-9));
  static const char different[] = "qmat_data and qmat_flat are different medial meshes";
  assert_fails(root, NULL, QMAT_ERROR_FORMAT, different);
  json_object_set(extras, "qmat_flat", json_object_get(extras_of(other_root, 0), "qmat_flat"));
  assert_fails(root, NULL, QMAT_ERROR_FORMAT, different);
  json_decref(facts);
  json_decref(other_root);
  json_decref(root);
  qmat_value_release(&other->base);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

static void test_carriers_are_told_apart_by_what_names_them(void **state) {
  (void)state;
  qmat_context context = {0};
  /* The two named A differ; B has what the first A has; the fourth has no name and the last no medial mesh. */
  json_t *root =
      json_pack("{s:{s:s}, s:[{}], s:[{s:s, s:i, s:{s:s}}, {s:s, s:{s:s}}, {s:s, s:{s:s}}, {s:{s:s}}, {s:s, s:{s:i}}]}",
                "asset", "version", "2.0", "meshes", "nodes", "name", "A", "mesh", 0, "extras", "qmat_data", "QUJD",
                "name", "A", "extras", "qmat_data", "QUJE", "name", "B", "extras", "qmat_data", "QUJD", "extras",
                "qmat_data", "QUJF", "name", "C", "extras", "qmat_data", 7);
  assert_non_null(root);
  size_t size;
  char *text = qmat_json_text(root, 0, &size), path[128];
  assert_non_null(text);
  snprintf(path, sizeof path, "%s/a.gltf", folder);
  write_file(path, text, size);
  json_t *carriers = qmat_medial_carriers(&context, path);
  assert_non_null(carriers);
  static const char *const expected[] = {"0", "1", "3"};
  assert_int_equal(json_array_size(carriers), 3);
  for (size_t i = 0; i < 3; i++) {
    const json_t *carrier = json_array_get(carriers, i), *mesh = json_object_get(carrier, "mesh");
    assert_string_equal(json_string_value(json_object_get(carrier, "node")), expected[i]);
    assert_true(json_is_integer(mesh) == (i == 0));
  }
  json_decref(carriers);
  /* Without the second A, the first is known by its name. */
  json_array_remove(json_object_get(root, "nodes"), 1);
  qmat_free(text);
  text = qmat_json_text(root, 0, &size);
  write_file(path, text, size);
  carriers = qmat_medial_carriers(&context, path);
  assert_int_equal(json_array_size(carriers), 2);
  assert_string_equal(json_string_value(json_object_get(json_array_get(carriers, 0), "node")), "A");
  assert_string_equal(json_string_value(json_object_get(json_array_get(carriers, 1), "node")), "2");
  json_decref(carriers);
  json_decref(root);
  qmat_free(text);
  unlink(path);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_what_was_written_comes_back_with_its_facts),
      cmocka_unit_test(test_every_form_gives_back_what_was_written_within_what_it_states),
      cmocka_unit_test(test_of_several_one_has_to_be_named),
      cmocka_unit_test(test_the_node_with_the_mesh_stands_for_its_child),
      cmocka_unit_test(test_the_plain_form_is_read_alone_and_compared_beside_draco),
      cmocka_unit_test(test_carriers_are_told_apart_by_what_names_them),
      cmocka_unit_test(test_broken_data_and_wrong_counts_are_errors),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
