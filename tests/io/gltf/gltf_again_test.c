/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A run on what an earlier one wrote: it replaces what that one added, and adds nothing to the asset that stays. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <string.h>

#include "io/gltf/gltf_asset.h"
#include "io/gltf/gltf_colliders.h"
#include "io/gltf/gltf_write.h"
#include "tests/hull_colliders.h"
#include "tests/io/gltf/gltf_assets.h"
#include "tests/medial_meshes.h"
#include "tests/shapes.h"

/* Two meshes of one name, each on a node, the second one with a member of the user's own; the asset has a hull of it
 * and a shape already. */
static const char boxes[] =
    "{'asset':{'version':'2.0'},'scenes':[{'nodes':[0,1,2]}],'extensionsUsed':['KHR_implicit_shapes'],"
    "'extensions':{'KHR_implicit_shapes':{'shapes':[{'type':'sphere','sphere':{'radius':1}}]}},"
    "'nodes':[{'mesh':0,'name':'a'},{'mesh':1,'name':'b','extras':{'qmat_note':'mine'}},{'mesh':2,'name':'UCX_Box_01'}]"
    ","
    "'meshes':[{'name':'Box','primitives':[{'attributes':{'POSITION':0},'indices':1}]},"
    "{'name':'Box','primitives':[{'attributes':{'POSITION':0},'indices':1}]},"
    "{'name':'UCX_Box_01','primitives':[{'attributes':{'POSITION':0},'indices':1}]}],"
    "'accessors':[{'bufferView':0,'componentType':5126,'count':8,'type':'VEC3','min':[0,0,0],'max':[1,1,1]},"
    "{'bufferView':1,'componentType':5123,'count':36,'type':'SCALAR'}],"
    "'bufferViews':[{'buffer':0,'byteLength':96},{'buffer':0,'byteOffset':96,'byteLength':72}],"
    "'buffers':[{'byteLength':168}]}";

/* A slab and a sphere, each with a tetrahedron for a hull. */
static qmat_colliders *make_colliders(void) {
  static const double spheres[] = {0, 0, 0, 1, 1, 0, 0, 1, 0, 1, 0, 1}, body[] = {2, 0, 0, 0, 1, 1, 1, 0, 0, 0};
  static const uint32_t shapes[] = {0, 1, 2, 0, 0, 0};
  static const double tetrahedron[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  return hull_colliders(spheres, 3, shapes, 2, body, tetrahedron, 0);
}

/* Adds a medial mesh to each of both boxes of an asset, or to both together, with skins, and with colliders of the
 * forms (0: without). */
static qmat_file *run_as(const uint8_t *bytes, size_t size, unsigned forms, bool has_skin, bool is_merged) {
  static const uint32_t numbers[] = {0, 1};
  qmat_context context = {0};
  qmat_scene *scene = qmat_scene_new();
  scene->name = qmat_strdup("boxes");
  scene->format = qmat_strdup("glb");
  scene->parts = qmat_calloc(1, sizeof *scene->parts);
  scene->part_count = 1;
  scene->parts[0] = (qmat_file_part){.name = qmat_strdup(""), .bytes = qmat_alloc(size, 1), .size = size};
  memcpy(scene->parts[0].bytes, bytes, size);
  if (!is_merged) {
    scene->mesh_count = 2;
    scene->meshes = qmat_calloc(2, sizeof *scene->meshes);
    memcpy(scene->meshes, numbers, sizeof numbers);
  }
  assert_int_equal(qmat_value_seal(&context, &scene->base), QMAT_OK);
  qmat_medial *medial =
      sealed_medial_mesh((const double[]){0, 0, 0, 1, 1, 0, 0, 1}, 2, (const uint32_t[]){0, 1}, 1, NULL, 0);
  qmat_mesh *skin = shape_seal(shape_box(1, 1, 1));
  qmat_colliders *c = make_colliders();
  qmat_gltf_addition additions[2];
  for (size_t i = 0; i < 2; i++)
    additions[i] = (qmat_gltf_addition){.medial = medial,
                                        .skin = has_skin ? skin : NULL,
                                        .options = {.binary = true,
                                                    .quantisation = 1e-3,
                                                    .errors.epsilon = (double)NAN,
                                                    .errors.error_out = (double)NAN,
                                                    .errors.error_in = (double)NAN,
                                                    .name = "boxes"},
                                        .colliders = forms ? c : NULL,
                                        .collider_forms = forms,
                                        .dynamic = true};
  qmat_file *file = NULL;
  if (qmat_gltf_enrich(&context, scene, additions, is_merged ? 1 : 2, false, NULL, &file) != QMAT_OK)
    fail_msg("%s", context.error.message);
  qmat_value_release(&c->base);
  qmat_value_release(&skin->base);
  qmat_value_release(&medial->base);
  qmat_value_release(&scene->base);
  qmat_context_uninit(&context);
  return file;
}

static qmat_file *run_on(const uint8_t *bytes, size_t size, unsigned forms, bool has_skin) {
  return run_as(bytes, size, forms, has_skin, false);
}

static qmat_writer make_boxes(void) {
  qmat_writer data = {0};
  put_box_corners(&data, 1);
  put_box_triangles(&data);
  qmat_writer glb = asset_glb(boxes, data.bytes, data.size);
  qmat_writer_uninit(&data);
  return glb;
}

static void assert_same_file(const qmat_file *a, const qmat_file *b) {
  assert_int_equal(a->parts[0].size, b->parts[0].size);
  assert_memory_equal(a->parts[0].bytes, b->parts[0].bytes, a->parts[0].size);
}

static void test_what_an_earlier_run_added_is_replaced_or_goes(void **state) {
  (void)state;
  static const unsigned all = QMAT_GLTF_KHR | QMAT_GLTF_OMI | QMAT_GLTF_UNREAL | QMAT_GLTF_GODOT;
  static const unsigned forms[] = {QMAT_GLTF_KHR, QMAT_GLTF_OMI, QMAT_GLTF_UNREAL, QMAT_GLTF_GODOT, all};
  qmat_writer glb = make_boxes();
  for (size_t i = 0; i < 10; i++) {
    const unsigned chosen = forms[i % 5];
    const bool has_skin = i >= 5;
    qmat_file *plain = run_on(glb.bytes, glb.size, 0, false), *first = run_on(glb.bytes, glb.size, chosen, has_skin);
    assert_true(first->parts[0].size > plain->parts[0].size);
    assert_non_null(memmem(plain->parts[0].bytes, plain->parts[0].size, "\"radius\":1", 10)); /* the asset's shape */
    qmat_file *second = run_on(first->parts[0].bytes, first->parts[0].size, chosen, has_skin);
    assert_same_file(second, first);
    qmat_file *without = run_on(second->parts[0].bytes, second->parts[0].size, 0, false);
    assert_same_file(without, plain);
    qmat_value_release(&without->base);
    qmat_value_release(&second->base);
    qmat_value_release(&first->base);
    qmat_value_release(&plain->base);
  }
  qmat_writer_uninit(&glb);
}

/* All four orders of a run for each mesh and one for both together: nothing of the first one is left. */
static void test_what_belongs_to_all_meshes_is_replaced_too(void **state) {
  (void)state;
  qmat_writer glb = make_boxes();
  for (size_t i = 0; i < 16; i++) {
    const unsigned forms = i & 4 ? QMAT_GLTF_KHR | QMAT_GLTF_OMI : 0;
    const bool before = i & 1, after = i & 2, has_skin = i & 8;
    qmat_file *alone = run_as(glb.bytes, glb.size, forms, has_skin, after),
              *first = run_as(glb.bytes, glb.size, forms, has_skin, before),
              *second = run_as(first->parts[0].bytes, first->parts[0].size, forms, has_skin, after);
    assert_same_file(second, alone);
    assert_non_null(memmem(second->parts[0].bytes, second->parts[0].size, "\"qmat_note\":\"mine\"", 18));
    qmat_value_release(&second->base);
    qmat_value_release(&first->base);
    qmat_value_release(&alone->base);
  }
  qmat_writer_uninit(&glb);
}

/* How many nodes of the name show a mesh of the name `mesh`. */
static size_t shown_as(const json_t *root, const char *name, const char *mesh) {
  size_t count = 0, i;
  json_t *node;
  json_array_foreach(json_object_get(root, "nodes"), i, node) {
    const json_t *shown = json_array_get(json_object_get(root, "meshes"), (size_t)qmat_gltf_mesh_of(node));
    const char *own = json_string_value(json_object_get(node, "name"));
    const char *of_mesh = json_string_value(json_object_get(shown, "name"));
    count += own && of_mesh && strcmp(own, name) == 0 && strcmp(of_mesh, mesh) == 0;
  }
  return count;
}

/* The asset has UCX_Box_01, so that the hulls of the first box are 02 and 03, and those of the second 04 and 05. */
static void test_hulls_of_meshes_of_one_name_have_numbers_of_their_own(void **state) {
  (void)state;
  static const char *const numbers[] = {"02", "03", "04", "05"};
  qmat_context context = {0};
  qmat_gltf_asset asset;
  qmat_writer glb = make_boxes();
  qmat_file *file = run_on(glb.bytes, glb.size, QMAT_GLTF_UNREAL | QMAT_GLTF_GODOT, false);
  assert_int_equal(qmat_gltf_asset_init(&context, file->parts[0].bytes, file->parts[0].size, "boxes", &asset), QMAT_OK);
  assert_int_equal(shown_as(asset.root, "UCX_Box_01", "UCX_Box_01"), 1);
  for (size_t i = 0; i < 4; i++) {
    char unreal[32], godot[32];
    snprintf(unreal, sizeof unreal, "UCX_Box_%s", numbers[i]);
    snprintf(godot, sizeof godot, "Box_%s-convcolonly", numbers[i]);
    assert_int_equal(shown_as(asset.root, unreal, unreal), 1);
    assert_int_equal(shown_as(asset.root, godot, unreal), 1);
  }
  qmat_gltf_asset_uninit(&asset);
  qmat_value_release(&file->base);
  qmat_writer_uninit(&glb);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_what_an_earlier_run_added_is_replaced_or_goes),
      cmocka_unit_test(test_what_belongs_to_all_meshes_is_replaced_too),
      cmocka_unit_test(test_hulls_of_meshes_of_one_name_have_numbers_of_their_own),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
