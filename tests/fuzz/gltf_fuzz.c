/* SPDX-License-Identifier: GPL-3.0-or-later */
/* gltf_fuzz COUNT [SEED]: reads COUNT damaged copies each of .gltf and .glb files, and writes those that can be read
 * with medial meshes in them. A copy is made from its number alone, so that a failure can be found again: the last line
 * names it. Ends with an error where a reader takes more memory at once than the file justifies, or more seconds than
 * any of them needs; crashes are for the sanitizers to find. */
#include "tests/fuzz/fuzz.h"

#include "io/base64.h"
#include "io/extract.h"
#include "io/gltf/gltf_asset.h"
#include "io/gltf/gltf_write.h"
#include "io/model.h"
#include "tests/io/gltf/gltf_assets.h"
#include "tests/io/medial_examples.h"

#define DATA "../shared/data/gltf/"

/* Two nodes with one mesh of a tetrahedron, one with extras that are a text, a skin, a morph target; the buffer is in
 * the file: 4 positions, 12 indices, joints and weights. */
static const char scene_text[] =
    "{'asset':{'version':'2.0'},'scene':0,'scenes':[{'nodes':[0,1,2]}],'extensionsUsed':['ACME_glow'],"
    "'nodes':[{'mesh':0,'skin':0,'name':'A','extras':{'keep':[1,2.5,null]}},{'mesh':0,'scale':[1,2,3],'extras':'text'},"
    "{'children':[3],'matrix':[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]},{'camera':0,'mesh':1}],'skins':[{'joints':[2,3]}],"
    "'cameras':[{'type':'perspective','perspective':{'yfov':0.7,'znear':0.01}}],'images':[{'uri':'gone.png'}],"
    "'meshes':[{'name':'near','weights':[0.5],'primitives':[{'attributes':{'POSITION':0,'JOINTS_0':2,'WEIGHTS_0':3},"
    "'indices':1,'targets':[{'POSITION':0}]}]},{'primitives':[{'attributes':{'POSITION':0},'mode':5}]}],"
    "'accessors':[{'bufferView':0,'componentType':5126,'count':4,'type':'VEC3','min':[0,0,0],'max':[1,1,1]},"
    "{'bufferView':1,'componentType':5121,'count':12,'type':'SCALAR'},"
    "{'bufferView':2,'componentType':5121,'count':4,'type':'VEC4'},"
    "{'bufferView':0,'byteOffset':0,'componentType':5121,'normalized':true,'count':4,'type':'VEC4'}],"
    "'bufferViews':[{'buffer':0,'byteLength':48},{'buffer':0,'byteOffset':48,'byteLength':12},"
    "{'buffer':0,'byteOffset':60,'byteLength':16}],'buffers':[{'byteLength':76URI}]}";

static qmat_writer tetrahedron(void) {
  static const float positions[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  static const uint8_t triangles[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  qmat_writer data = {0};
  for (int i = 0; i < 12; i++) qmat_put_f32(&data, positions[i]);
  qmat_put_bytes(&data, triangles, sizeof triangles);
  for (int i = 0; i < 16; i++) qmat_put_u8(&data, (uint8_t)(i % 4 == 0 ? i / 8 : 0));
  return data;
}

/* The scene that was read, with a medial mesh for each of its meshes. */
static void write_again(qmat_context *context, const qmat_scene *scene) {
  const size_t count = scene->mesh_count > 0 ? scene->mesh_count : 1;
  qmat_medial *medial = example_medial(3);
  qmat_gltf_addition *additions = qmat_calloc(count, sizeof *additions);
  assert_non_null(additions);
  for (size_t i = 0; i < count; i++) {
    additions[i] = (qmat_gltf_addition){
        .medial = medial, .options = {.binary = true, .position_bits = 8, .radius_bits = 8, .name = scene->name}};
  }
  for (int draco_meshes = 0; draco_meshes < 2; draco_meshes++) {
    qmat_file *file = NULL;
    if (qmat_gltf_enrich(context, scene, additions, count, draco_meshes, NULL, &file) == QMAT_OK) {
      qmat_gltf_asset asset;
      assert_int_equal(qmat_gltf_asset_init(context, file->parts[0].bytes, file->parts[0].size, "written", &asset),
                       QMAT_OK);
      qmat_gltf_asset_uninit(&asset);
      qmat_value_release(&file->base);
    } else {
      assert_true(context->error.status != QMAT_ERROR_INTERNAL);
    }
  }
  qmat_free(additions);
  qmat_value_release(&medial->base);
}

static char folder[64];

static bool read_file_as(const char *ending, const uint8_t *content, size_t size) {
  static const char *const choices[] = {"all", "merged", "0"};
  char path[96];
  snprintf(path, sizeof path, "%s/file.%s", folder, ending);
  write_file(path, content, size);
  bool any = false;
  for (size_t i = 0; i < 3; i++) {
    qmat_context context = {0};
    const qmat_read_options options = {.defects = QMAT_DEFECTS_DROP};
    qmat_scene *scene;
    qmat_value *mesh;
    qmat_report *report;
    const qmat_status status = qmat_model_read_meshes(&context, path, &options, choices[i], &scene, &mesh, &report);
    if (status == QMAT_OK) {
      any = true;
      write_again(&context, scene);
      qmat_value_release(&scene->base);
      qmat_value_release(mesh);
      qmat_value_release(&report->base);
    } else {
      assert_true(context.error.message[0] != '\0' && context.error.status != QMAT_ERROR_INTERNAL);
    }
    qmat_context_uninit(&context);
  }
  qmat_context context = {0};
  qmat_medial *medial;
  if (qmat_medial_extract(&context, path, NULL, &medial, NULL) == QMAT_OK) qmat_value_release(&medial->base);
  json_decref(qmat_medial_carriers(&context, path));
  qmat_context_uninit(&context);
  unlink(path);
  return any;
}

static bool read_text(const uint8_t *content, size_t size) {
  return read_file_as("gltf", content, size);
}

static bool read_binary(const uint8_t *content, size_t size) {
  return read_file_as("glb", content, size);
}

static void test_damaged_texts(void **state) {
  (void)state;
  sample samples[4];
  size_t count = 0;
  qmat_writer data = tetrahedron();
  char *base64 = qmat_base64_encode(data.bytes, data.size), uri[256];
  snprintf(uri, sizeof uri, ",'uri':'data:application/octet-stream;base64,%s'", base64);
  char *text = asset_replace(scene_text, "URI", uri), *json = asset_json(text);
  add_sample(samples, &count, "a scene's text", json, strlen(json));
  free(json);
  free(text);
  qmat_free(base64);
  qmat_writer_uninit(&data);
  assert_true(read_text(samples[0].bytes, samples[0].size));
  try_damaged_copies(samples, count, read_text);
  free_samples(samples, count);
}

static void test_damaged_binaries(void **state) {
  (void)state;
  sample samples[4];
  size_t count = 0;
  qmat_writer data = tetrahedron();
  char *text = asset_replace(scene_text, "URI", "");
  qmat_writer glb = asset_glb(text, data.bytes, data.size);
  add_sample(samples, &count, "a scene's binary", glb.bytes, glb.size);
  qmat_writer_uninit(&glb);
  qmat_writer_uninit(&data);
  free(text);
  add_file(samples, &count, DATA "Box_Draco.glb");
  assert_true(read_binary(samples[0].bytes, samples[0].size));
  try_damaged_copies(samples, count, read_binary);
  free_samples(samples, count);
}

int main(int argc, char **argv) {
  if (argc > 1) mutation_count = strtoull(argv[1], NULL, 10);
  if (argc > 2) mutation_seed = strtoull(argv[2], NULL, 10);
  make_folder(folder);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_damaged_texts),
      cmocka_unit_test(test_damaged_binaries),
  };
  const int failed = cmocka_run_group_tests(tests, NULL, NULL);
  rmdir(folder);
  return failed;
}
