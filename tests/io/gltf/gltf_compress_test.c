/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_compress.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>

#include "core/json_text.h"
#include "io/draco_draco.h"
#include "io/gltf/gltf_asset.h"
#include "tests/io/gltf/gltf_assets.h"

/* Two meshes of one box with numbers for its corners, a third of a longer box with a morph target, and a picture behind
 * them. */
static const char asset_text[] =
    "{'asset':{'version':'2.0'},'scenes':[{'nodes':[0,1,2]}],'nodes':[{'mesh':0},{'mesh':1},{'mesh':2}],"
    "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'_CORNER':2},'indices':1,'extras':{'kept':1}}]},"
    "{'primitives':[{'attributes':{'POSITION':0,'_CORNER':2},'indices':1}]},"
    "{'primitives':[{'attributes':{'POSITION':3},'indices':4,'targets':[{'POSITION':3}]}]}],"
    "'images':[{'bufferView':4,'mimeType':'image/png'}],"
    "'accessors':[{'bufferView':0,'componentType':5126,'count':8,'type':'VEC3','min':[0,0,0],'max':[1,1,1]},"
    "{'bufferView':1,'componentType':5123,'count':36,'type':'SCALAR'},"
    "{'bufferView':2,'byteOffset':4,'componentType':5121,'count':8,'type':'VEC4'},"
    "{'bufferView':3,'componentType':5126,'count':8,'type':'VEC3','min':[0,0,0],'max':[4,1,1]},"
    "{'bufferView':1,'componentType':5123,'count':36,'type':'SCALAR'}],"
    "'bufferViews':[{'buffer':0,'byteLength':96},{'buffer':0,'byteOffset':96,'byteLength':72},"
    "{'buffer':0,'byteOffset':168,'byteLength':68,'byteStride':8},{'buffer':0,'byteOffset':236,'byteLength':96},"
    "{'buffer':0,'byteOffset':332,'byteLength':9}],'buffers':[{'byteLength':341}]}";

static qmat_writer asset_data(void) {
  qmat_writer data = {0};
  put_box_corners(&data, 1);
  put_box_triangles(&data);
  for (int i = 0; i < 17; i++) /* interleaved with what nothing uses; the last names the corner */
    for (int k = 0; k < 4; k++) qmat_put_u8(&data, (uint8_t)(i % 2 == 1 && k == 3 ? i / 2 : 9 + k));
  put_box_corners(&data, 4);
  qmat_put_bytes(&data, "a picture", 9);
  assert_int_equal(data.size, 341);
  return data;
}

typedef struct outcome {
  json_t *root, *notes;
  qmat_writer data;
  qmat_gltf_compressed compressed;
  qmat_context context;
} outcome;

static void compress(outcome *o, const char *text) {
  char *json = asset_json(text);
  *o = (outcome){.root = json_loads(json, 0, NULL), .notes = json_array(), .data = asset_data()};
  free(json);
  assert_non_null(o->root);
  assert_int_equal(
      qmat_gltf_compress(&o->context, o->root, o->data.bytes, o->data.size, 1e-3, o->notes, &o->compressed), QMAT_OK);
}

static void uninit(outcome *o) {
  json_decref(o->root);
  json_decref(o->notes);
  qmat_writer_uninit(&o->data);
  qmat_gltf_compressed_uninit(&o->compressed);
  qmat_context_uninit(&o->context);
}

static json_t *at(json_t *root, const char *list, size_t i) {
  return json_array_get(json_object_get(root, list), i);
}

static json_t *primitive_of(json_t *root, size_t mesh) {
  return json_array_get(json_object_get(at(root, "meshes", mesh), "primitives"), 0);
}

static json_t *draco_of(json_t *root, size_t mesh) {
  return json_object_get(json_object_get(primitive_of(root, mesh), "extensions"), QMAT_GLTF_DRACO);
}

static json_int_t number(const json_t *object, const char *key) {
  assert_true(json_is_integer(json_object_get(object, key)));
  return json_integer_value(json_object_get(object, key));
}

static const uint8_t *bytes_of(const outcome *o, size_t view, size_t *size) {
  const json_t *of = at(o->root, "bufferViews", view);
  const size_t offset = (size_t)json_integer_value(json_object_get(of, "byteOffset"));
  *size = (size_t)number(of, "byteLength");
  assert_int_equal(offset % 4, 0);
  assert_true(offset + *size <= o->compressed.chunk_size);
  return o->compressed.chunk + offset;
}

static void test_a_mesh_is_compressed_and_its_data_leave_the_chunk(void **state) {
  (void)state;
  outcome o;
  compress(&o, asset_text);
  assert_int_equal(o.compressed.primitives, 2);
  assert_int_equal(o.compressed.left, 1);
  assert_int_equal(json_array_size(o.notes), 1);
  assert_string_equal(json_string_value(json_array_get(o.notes, 0)), "1 primitive is unchanged: morph targets");
  assert_true(json_equal(draco_of(o.root, 0), draco_of(o.root, 1)));
  assert_null(draco_of(o.root, 2));
  assert_int_equal(number(json_object_get(primitive_of(o.root, 0), "extras"), "kept"), 1);

  /* Positions and corners went; the triangles stay, since the third mesh has them, too. */
  assert_int_equal(json_array_size(json_object_get(o.root, "bufferViews")), 4);
  assert_int_equal(number(at(o.root, "buffers", 0), "byteLength"), o.compressed.chunk_size);
  size_t size;
  const uint8_t *bytes = bytes_of(&o, (size_t)number(at(o.root, "images", 0), "bufferView"), &size);
  assert_int_equal(size, 9);
  assert_memory_equal(bytes, "a picture", 9);
  bytes = bytes_of(&o, (size_t)number(at(o.root, "accessors", 3), "bufferView"), &size);
  assert_memory_equal(bytes, o.data.bytes + 236, 96);
  bytes = bytes_of(&o, (size_t)number(at(o.root, "accessors", 4), "bufferView"), &size);
  assert_memory_equal(bytes, o.data.bytes + 96, 72);

  static const char *const keys[] = {"extensionsUsed", "extensionsRequired"};
  for (size_t i = 0; i < 2; i++)
    assert_string_equal(json_string_value(json_array_get(json_object_get(o.root, keys[i]), 0)), QMAT_GLTF_DRACO);
  uninit(&o);
}

static void test_what_is_decoded_is_what_was_given(void **state) {
  (void)state;
  outcome o;
  compress(&o, asset_text);
  const json_t *draco = draco_of(o.root, 0), *ids = json_object_get(draco, "attributes");
  size_t size;
  const uint8_t *bytes = bytes_of(&o, (size_t)number(draco, "bufferView"), &size);
  qmat_draco_mesh *mesh;
  assert_int_equal(qmat_draco_mesh_new(&o.context, bytes, size, &mesh), QMAT_OK);
  const size_t points = qmat_draco_mesh_point_count(mesh), faces = qmat_draco_mesh_face_count(mesh);
  assert_int_equal(faces, 12);
  double positions[3 * 64], corners[4 * 64], low[3] = {9, 9, 9}, high[3] = {-9, -9, -9};
  assert_in_range(points, 8, 64);
  assert_int_equal(qmat_draco_mesh_attribute(&o.context, mesh, (uint32_t)number(ids, "POSITION"), 3, positions),
                   QMAT_OK);
  assert_int_equal(qmat_draco_mesh_attribute(&o.context, mesh, (uint32_t)number(ids, "_CORNER"), 4, corners), QMAT_OK);
  assert_true(o.compressed.moved[0] > 0 && o.compressed.moved[0] < 1e-3);
  assert_true(o.compressed.moved[0] == o.compressed.moved[1] && o.compressed.moved[2] == 0);
  for (size_t i = 0; i < points; i++) {
    const double *p = positions + 3 * i;
    double square = 0;
    for (size_t k = 0; k < 3; k++) {
      square += (p[k] - round(p[k])) * (p[k] - round(p[k]));
      low[k] = fmin(low[k], p[k]);
      high[k] = fmax(high[k], p[k]);
    }
    assert_true(sqrt(square) <= o.compressed.moved[0]);
    const double corner = 4 * round(p[0]) + 2 * round(p[1]) + round(p[2]);
    assert_true(corners[4 * i + 3] == corner && corners[4 * i] == 9);
  }
  const json_t *position = at(o.root, "accessors", 0), *indices = at(o.root, "accessors", 1);
  assert_int_equal(number(position, "count"), points);
  assert_int_equal(number(at(o.root, "accessors", 2), "count"), points);
  assert_int_equal(number(indices, "count"), 3 * faces);
  for (size_t k = 0; k < 3; k++) {
    assert_true(json_number_value(json_array_get(json_object_get(position, "min"), k)) == low[k]);
    assert_true(json_number_value(json_array_get(json_object_get(position, "max"), k)) == high[k]);
  }
  for (size_t i = 0; i < 3; i++) assert_null(json_object_get(at(o.root, "accessors", i), "bufferView"));
  qmat_draco_mesh_free(mesh);
  uninit(&o);
}

static void test_the_readers_find_the_same_meshes(void **state) {
  (void)state;
  outcome o;
  compress(&o, asset_text);
  char *text = qmat_json_text(o.root, JSON_COMPACT | JSON_REAL_PRECISION(17), NULL);
  qmat_writer glb = asset_glb(text, o.compressed.chunk, o.compressed.chunk_size);
  qmat_gltf_meshes meshes;
  if (qmat_gltf_parse_meshes(&o.context, glb.bytes, glb.size, "a.glb", o.root, "all", &meshes, NULL) != QMAT_OK)
    fail_msg("%s", o.context.error.message);
  assert_int_equal(meshes.count, 3);
  for (size_t i = 0; i < 3; i++) assert_int_equal(meshes.soups[i].facet_count, 12);
  qmat_gltf_meshes_uninit(&meshes);
  qmat_writer_uninit(&glb);
  qmat_free(text);
  uninit(&o);
}

/* With one thing replaced, so many primitives are compressed. */
static void test_what_cannot_be_taken_stays_as_it_is(void **state) {
  (void)state;
  static const struct {
    const char *from, *to, *note;
    size_t primitives;
  } cases[] = {
      {"'indices':4", "'indices':1", "used by something else", 0},
      {"'indices':1,'extras'", "'mode':5,'indices':1,'extras'", "no indexed triangles", 0},
      {"'_CORNER':2},'indices':1}]}", "'_CORNER':0},'indices':1}]}", "used by something else", 0},
      {"'count':36", "'count':35", "invalid or unsupported", 0},
      {"'componentType':5126", "'componentType':5122", "already quantised (KHR_mesh_quantization)", 0},
      {"'count':36", "'count':37", "invalid or unsupported", 0},
      {"'bufferView':1,'componentType':5123,'count':36", "'bufferView':0,'componentType':5121,'count':12",
       "Draco cannot encode the data", 0}, /* corner 0 again and again */
      {"'byteOffset':4,", "'byteOffset':9,", "invalid or unsupported", 0},
      {"'componentType':5121", "'componentType':5125", "invalid or unsupported", 0},
      {"'buffer':0,'byteLength':96", "'buffer':1,'byteLength':96", "the data are outside the binary chunk", 0},
      {"'count':36", "'sparse':{},'count':36", "the data are sparse", 0},
      {"'buffer':0,'byteLength':96", "'buffer':0,'byteLength':95", "invalid or unsupported", 0},
      {"'buffer':0,'byteLength':96", "'buffer':0,'byteOffset':1e30,'byteLength':96", "invalid or unsupported", 0},
      {"'asset'", "'extensionsUsed':['ACME_more'],'asset'", "ACME_more", 0},
      {"'asset'", "'extensionsUsed':['KHR_materials_unlit'],'asset'", "morph targets", 2},
      {"'asset'", "'extensionsUsed':['KHR_mesh_quantization','OMI_physics_body'],'asset'", "morph targets", 2},
      {"'asset'", "'skins':[{'inverseBindMatrices':0}],'asset'", "used by something else", 0},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    outcome o;
    char *text = asset_replace(asset_text, cases[i].from, cases[i].to), *json = asset_json(text);
    json_t *before = json_loads(json, 0, NULL);
    compress(&o, text);
    assert_int_equal(o.compressed.primitives, cases[i].primitives);
    bool told = false;
    for (size_t k = 0; k < json_array_size(o.notes); k++)
      told = told || strstr(json_string_value(json_array_get(o.notes, k)), cases[i].note);
    if (!told) fail_msg("case %zu: nothing is told of '%s'", i, cases[i].note);
    if (cases[i].primitives == 0) {
      assert_null(o.compressed.chunk);
      assert_true(json_equal(before, o.root));
    }
    json_decref(before);
    free(json);
    free(text);
    uninit(&o);
  }
}

static void test_what_was_compressed_before_keeps_its_data_and_all_that_it_says(void **state) {
  (void)state;
  outcome o;
  char *text = asset_replace(asset_text, "'targets':[{'POSITION':3}]",
                             "'extensions':{'KHR_draco_mesh_compression':{'bufferView':4,'attributes':{'POSITION':0},"
                             "'qmat new':7}}");
  compress(&o, text);
  assert_int_equal(o.compressed.primitives, 2);
  assert_int_equal(o.compressed.left, 1);
  const json_t *draco = draco_of(o.root, 2);
  assert_int_equal(number(draco, "qmat new"), 7);
  size_t size;
  const uint8_t *bytes = bytes_of(&o, (size_t)number(draco, "bufferView"), &size);
  assert_int_equal(size, 9);
  assert_memory_equal(bytes, "a picture", 9);
  free(text);
  uninit(&o);
}

/* 127 triangles that share one of 255 corners: Draco splits it, and then there are too many points for bytes. */
static void test_indices_get_wider_where_corners_are_split(void **state) {
  (void)state;
  enum { TRIANGLES = 127, CORNERS = 2 * TRIANGLES + 1 };
  static const char text[] =
      "{'asset':{'version':'2.0'},'meshes':[{'primitives':[{'attributes':{'POSITION':0},'indices':1}]}],"
      "'accessors':[{'bufferView':0,'componentType':5126,'count':255,'type':'VEC3','min':[0,0,0],'max':[1,1,1]},"
      "{'bufferView':1,'componentType':5121,'count':381,'type':'SCALAR'}],"
      "'bufferViews':[{'buffer':0,'byteLength':3060},{'buffer':0,'byteOffset':3060,'byteLength':381}],"
      "'buffers':[{'byteLength':3441}]}";
  char *json = asset_json(text);
  outcome o = {.root = json_loads(json, 0, NULL), .notes = json_array()};
  for (int i = 0; i < CORNERS; i++) {
    qmat_put_f32(&o.data, (float)cos(i));
    qmat_put_f32(&o.data, (float)sin(i));
    qmat_put_f32(&o.data, (float)i / CORNERS);
  }
  for (int i = 0; i < TRIANGLES; i++) {
    const uint8_t triangle[] = {0, (uint8_t)(2 * i + 1), (uint8_t)(2 * i + 2)};
    qmat_put_bytes(&o.data, triangle, sizeof triangle);
  }
  assert_int_equal(qmat_gltf_compress(&o.context, o.root, o.data.bytes, o.data.size, 1e-3, o.notes, &o.compressed),
                   QMAT_OK);
  assert_int_equal(o.compressed.primitives, 1);
  assert_true(number(at(o.root, "accessors", 0), "count") > 255);
  assert_int_equal(number(at(o.root, "accessors", 1), "componentType"), QMAT_GLTF_UNSIGNED_SHORT);
  assert_int_equal(number(at(o.root, "accessors", 1), "count"), 3 * TRIANGLES);
  free(json);
  uninit(&o);
}

static void test_the_same_asset_gives_the_same_bytes(void **state) {
  (void)state;
  outcome first, second;
  compress(&first, asset_text);
  compress(&second, asset_text);
  assert_int_equal(first.compressed.chunk_size, second.compressed.chunk_size);
  assert_memory_equal(first.compressed.chunk, second.compressed.chunk, first.compressed.chunk_size);
  assert_true(json_equal(first.root, second.root));
  uninit(&first);
  uninit(&second);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_mesh_is_compressed_and_its_data_leave_the_chunk),
      cmocka_unit_test(test_what_is_decoded_is_what_was_given),
      cmocka_unit_test(test_the_readers_find_the_same_meshes),
      cmocka_unit_test(test_what_cannot_be_taken_stays_as_it_is),
      cmocka_unit_test(test_what_was_compressed_before_keeps_its_data_and_all_that_it_says),
      cmocka_unit_test(test_indices_get_wider_where_corners_are_split),
      cmocka_unit_test(test_the_same_asset_gives_the_same_bytes),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
