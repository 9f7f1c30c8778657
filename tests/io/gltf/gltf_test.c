/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include <math.h>
#include <sys/stat.h>
#include <unistd.h>

#include "io/base64.h"
#include "io/draco_draco.h"
#include "io/gltf/gltf_check.h"
#include "tests/io/gltf/gltf_assets.h"

#define DATA "../shared/data/gltf/"

/* ---- reading and looking ---- */

typedef struct reading {
  qmat_context context;
  qmat_soup soup;
  json_t *report;
} reading;

static qmat_status read_asset(reading *r, const char *json, const void *chunk, size_t size) {
  *r = (reading){.report = json_object()};
  qmat_writer glb = asset_glb(json, chunk, size);
  qmat_status status = qmat_gltf_parse(&r->context, glb.bytes, glb.size, "test.glb", &r->soup, r->report);
  qmat_writer_uninit(&glb);
  return status;
}

static void done(reading *r) {
  qmat_soup_uninit(&r->soup);
  json_decref(r->report);
  qmat_context_uninit(&r->context);
}

static void must_read(reading *r, const char *json, const void *chunk, size_t size) {
  if (read_asset(r, json, chunk, size) == QMAT_OK) return;
  char text[1024];
  qmat_error_format(&r->context.error, text, sizeof text);
  fail_msg("%s", text);
}

static int64_t reported(const reading *r, const char *key) {
  json_t *value = json_object_get(r->report, key);
  assert_true(json_is_integer(value));
  return json_integer_value(value);
}

static void assert_positions(const qmat_soup *soup, const double *expected, size_t count, double tolerance) {
  assert_int_equal(soup->vertex_count, count);
  for (size_t i = 0; i < 3 * count; i++) {
    if (fabs(soup->positions[i] - expected[i]) > tolerance) {
      fail_msg("vertex %zu: %.17g is not %.17g", i / 3, soup->positions[i], expected[i]);
    }
  }
}

static void assert_corners(const qmat_soup *soup, const uint32_t *expected, size_t triangles) {
  assert_int_equal(soup->facet_count, triangles);
  assert_int_equal(soup->corner_count, 3 * triangles);
  for (size_t i = 0; i < 3 * triangles; i++) assert_int_equal(soup->corners[i], expected[i]);
}

/* ---- the assets ---- */

/* Four corners of a unit square and a list of indices: two triangles. */
typedef struct square_data {
  float positions[12];
  uint16_t indices[6];
} square_data;
static const square_data square = {{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, {0, 1, 2, 0, 2, 3}};

#define SQUARE_PARTS                                                                           \
  "'asset':{'version':'2.0'},'buffers':[{'byteLength':60}],"                                   \
  "'bufferViews':[{'buffer':0,'byteLength':48},{'buffer':0,'byteOffset':48,'byteLength':12}]," \
  "'accessors':[{'bufferView':0,'componentType':5126,'count':4,'type':'VEC3'},"                \
  "{'bufferView':1,'componentType':5123,'count':6,'type':'SCALAR'}],"
#define SQUARE_MESH "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'indices':1}]}],"
#define SQUARE "{" SQUARE_PARTS SQUARE_MESH "'scene':0,'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0}]}"

static const uint32_t square_corners[6] = {0, 1, 2, 0, 2, 3};

static void test_a_mesh_is_read_as_it_stands(void **state) {
  (void)state;
  reading r;
  must_read(&r, SQUARE, &square, sizeof square);
  const double expected[12] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
  assert_positions(&r.soup, expected, 4, 0);
  assert_corners(&r.soup, square_corners, 2);
  assert_int_equal(reported(&r, "primitives_read"), 1);
  assert_int_equal(reported(&r, "primitives_skipped"), 0);
  assert_int_equal(reported(&r, "meshes_placed"), 1);
  assert_int_equal(reported(&r, "meshes_skinned"), 0);
  assert_int_equal(json_array_size(json_object_get(r.report, "extensions_ignored")), 0);
  assert_null(json_object_get(r.report, "warnings"));
  assert_int_equal(r.soup.facet_ordinals[1], 1);
  done(&r);
}

static void test_transforms_multiply_from_the_root_down(void **state) {
  (void)state;
  reading r;
  /* World = translate(10, 0, 0) * [quarter turn about z * scale(2, 3, 4)]: (x, y) -> (10 - 3y, 2x). */
  must_read(&r,
            "{" SQUARE_PARTS SQUARE_MESH
            "'scenes':[{'nodes':[1]}],'nodes':[{'mesh':0,'rotation':[0,0,0.70710678118654752,0.70710678118654752],"
            "'scale':[2,3,4]},{'children':[0],'translation':[10,0,0]}]}",
            &square, sizeof square);
  const double expected[12] = {10, 0, 0, 10, 2, 0, 7, 2, 0, 7, 0, 0};
  assert_positions(&r.soup, expected, 4, 1e-14);
  assert_corners(&r.soup, square_corners, 2);
  done(&r);
}

static void test_a_matrix_is_read_by_columns(void **state) {
  (void)state;
  reading r;
  must_read(&r, "{" SQUARE_PARTS SQUARE_MESH "'nodes':[{'mesh':0,'matrix':[1,2,3,0, 4,5,6,0, 7,8,10,0, 11,12,13,1]}]}",
            &square, sizeof square);
  const double expected[12] = {11, 12, 13, 12, 14, 16, 16, 19, 22, 15, 17, 19};
  assert_positions(&r.soup, expected, 4, 0);
  done(&r);
}

static void test_a_mirroring_node_turns_its_triangles_round(void **state) {
  (void)state;
  reading r;
  must_read(&r, "{" SQUARE_PARTS SQUARE_MESH "'nodes':[{'mesh':0,'scale':[-1,1,1]}]}", &square, sizeof square);
  const uint32_t turned[6] = {0, 2, 1, 0, 3, 2};
  assert_corners(&r.soup, turned, 2);
  assert_true(r.soup.positions[3] == -1);
  done(&r);
}

static void test_a_mesh_appears_once_for_each_node(void **state) {
  (void)state;
  reading r;
  must_read(&r, "{" SQUARE_PARTS SQUARE_MESH "'nodes':[{'mesh':0},{'mesh':0,'translation':[0,0,5]}]}", &square,
            sizeof square);
  assert_int_equal(r.soup.vertex_count, 8);
  assert_int_equal(r.soup.facet_count, 4);
  assert_true(r.soup.positions[12 + 2] == 5);
  assert_int_equal(r.soup.corners[6], 4);
  assert_int_equal(reported(&r, "meshes_placed"), 2);
  done(&r);
}

static void test_only_the_default_scene_is_read(void **state) {
  (void)state;
  const char *nodes = "'nodes':[{'mesh':0},{'mesh':0,'translation':[0,0,5]}]}";
  char json[2048];
  reading r;
  snprintf(json, sizeof json, "{%s'scene':1,'scenes':[{'nodes':[0]},{'nodes':[1]}],%s", SQUARE_PARTS SQUARE_MESH,
           nodes);
  must_read(&r, json, &square, sizeof square);
  assert_int_equal(r.soup.vertex_count, 4);
  assert_true(r.soup.positions[2] == 5);
  done(&r);
  snprintf(json, sizeof json, "{%s'scenes':[{'nodes':[0]},{'nodes':[1]}],%s", SQUARE_PARTS SQUARE_MESH, nodes);
  must_read(&r, json, &square, sizeof square);
  assert_int_equal(r.soup.vertex_count, 4);
  assert_true(r.soup.positions[2] == 0);
  done(&r);
}

static void test_strips_and_fans_become_triangles_without_stitches(void **state) {
  (void)state;
  reading r;
  const struct {
    float positions[18];
    uint8_t strip[8], fan[5];
  } data = {{0, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 0, 2, 0, 0, 2, 1, 0}, {0, 1, 2, 3, 3, 4, 4, 5}, {0, 2, 4, 5, 1}};
  must_read(
      &r,
      "{'asset':{'version':'2.0'},'buffers':[{'byteLength':85}],'bufferViews':[{'buffer':0,'byteLength':72},"
      "{'buffer':0,'byteOffset':72,'byteLength':8},{'buffer':0,'byteOffset':80,'byteLength':5}],'accessors':["
      "{'bufferView':0,'componentType':5126,'count':6,'type':'VEC3'},{'bufferView':1,'componentType':5121,'count':"
      "8,'type':'SCALAR'},{'bufferView':2,'componentType':5121,'count':5,'type':'SCALAR'}],'meshes':[{'primitives'"
      ":[{'attributes':{'POSITION':0},'indices':1,'mode':5},{'attributes':{'POSITION':0},'indices':2,'mode':6}]}],"
      "'nodes':[{'mesh':0}]}",
      &data, 85);
  /* 0 1 2 3 3 4 4 5: of its six triangles those with a repeated vertex stitch. */
  const uint32_t expected[15] = {0, 1, 2, 1, 3, 2, 8, 10, 6, 10, 11, 6, 11, 7, 6};
  assert_corners(&r.soup, expected, 5);
  done(&r);
}

static void assert_only_warning(const reading *r, const char *text) {
  const json_t *warnings = json_object_get(r->report, "warnings");
  assert_int_equal(json_array_size(warnings), 1);
  assert_string_equal(json_string_value(json_array_get(warnings, 0)), text);
}

/* Node 0 moves its child; as a root the child stands where its own transform places it, also for its children. */
static void test_a_root_that_is_also_a_child_is_read_once_as_a_root(void **state) {
  (void)state;
  static const char *const roots[] = {"[1]", "[0,1]", "[1,0]"};
  for (size_t i = 0; i < 3; i++) {
    reading r;
    char json[1024];
    snprintf(json, sizeof json,
             "{" SQUARE_PARTS SQUARE_MESH
             "'scenes':[{'nodes':%s}],'nodes':[{'children':[1],'translation':[100,0,0]},"
             "{'children':[2],'translation':[10,0,0]},{'mesh':0,'translation':[0,5,0]}]}",
             roots[i]);
    must_read(&r, json, &square, sizeof square);
    const double expected[12] = {10, 5, 0, 11, 5, 0, 11, 6, 0, 10, 6, 0};
    assert_positions(&r.soup, expected, 4, 0);
    assert_int_equal(reported(&r, "meshes_placed"), 1);
    assert_only_warning(&r, "node 1 is a root of the scene and a child of node 0: it is read as a root");
    done(&r);
  }
}

static void test_points_lines_and_placeless_primitives_are_counted(void **state) {
  (void)state;
  reading r;
  must_read(&r,
            "{" SQUARE_PARTS
            "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'mode':0},{'attributes':{'POSITION':0},'mode':3},"
            "{'attributes':{'NORMAL':0}},{'attributes':{'POSITION':0},'indices':1}]}],'nodes':[{'mesh':0}]}",
            &square, sizeof square);
  assert_int_equal(r.soup.facet_count, 2);
  assert_int_equal(reported(&r, "primitives_skipped"), 3);
  assert_int_equal(reported(&r, "primitives_read"), 1);
  assert_only_warning(&r, "3 of 4 primitives are passed over: points, lines, or without positions");
  done(&r);
}

static void test_without_indices_every_three_vertices_are_a_triangle(void **state) {
  (void)state;
  reading r;
  must_read(&r, "{" SQUARE_PARTS "'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}],'nodes':[{'mesh':0}]}",
            &square, sizeof square);
  const uint32_t expected[3] = {0, 1, 2}; /* the fourth vertex starts no triangle */
  assert_corners(&r.soup, expected, 1);
  done(&r);
}

static void test_sparse_values_replace_dense_ones_and_zeros(void **state) {
  (void)state;
  const struct {
    float positions[12];
    uint16_t indices[6];
    uint8_t sparse_indices[4];
    float sparse_values[6];
  } data = {{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, {0, 1, 2, 0, 2, 3}, {1, 3, 0, 0}, {7, 8, 9, -1, -2, -3}};
  const char *json =
      "{'asset':{'version':'2.0'},'buffers':[{'byteLength':88}],'bufferViews':[{'buffer':0,'byteLength':48},"
      "{'buffer':0,'byteOffset':48,'byteLength':12},{'buffer':0,'byteOffset':60,'byteLength':4},"
      "{'buffer':0,'byteOffset':64,'byteLength':24}],'accessors':[{'bufferView':0,'componentType':5126,'count':4,"
      "'type':'VEC3','sparse':{'count':2,'indices':{'bufferView':2,'componentType':5121},'values':{'bufferView':3}}},"
      "{'bufferView':1,'componentType':5123,'count':6,'type':'SCALAR'}]," SQUARE_MESH "'nodes':[{'mesh':0}]}";
  reading r;
  must_read(&r, json, &data, sizeof data);
  const double replaced[12] = {0, 0, 0, 7, 8, 9, 1, 1, 0, -1, -2, -3};
  assert_positions(&r.soup, replaced, 4, 0);
  done(&r);
  char *bare = asset_replace(json, "{'bufferView':0,'componentType':5126,", "{'componentType':5126,");
  must_read(&r, bare, &data, sizeof data);
  const double on_zeros[12] = {0, 0, 0, 7, 8, 9, 0, 0, 0, -1, -2, -3};
  assert_positions(&r.soup, on_zeros, 4, 0);
  done(&r);
  free(bare);
}

static void test_quantised_positions_are_normalised_and_strided(void **state) {
  (void)state;
  reading r;
  const struct {
    int16_t wide[12];
    uint8_t narrow[12];
  } data = {{32767, 0, -32767, 0, -32768, 16384, 0, 0, 0, 32767, 0, 0}, {255, 0, 51, 0, 0, 0, 255, 0, 1, 2, 3, 0}};
  const char *json =
      "{'asset':{'version':'2.0'},'extensionsUsed':['KHR_mesh_quantization'],'extensionsRequired':["
      "'KHR_mesh_quantization'],'buffers':[{'byteLength':36}],'bufferViews':[{'buffer':0,'byteLength':24,'byteStride':"
      "8}"
      ",{'buffer':0,'byteOffset':24,'byteLength':12,'byteStride':4}],'accessors':[{'bufferView':0,'componentType':5122,"
      "'normalized':true,'count':3,'type':'VEC3'},{'bufferView':1,'componentType':5121,'count':3,'type':'VEC3'}],"
      "'meshes':[{'primitives':[{'attributes':{'POSITION':0}},{'attributes':{'POSITION':1}}]}],'nodes':[{'mesh':0}]}";
  must_read(&r, json, &data, sizeof data);
  const double expected[18] = {1, 0, -1, -1, 16384.0 / 32767, 0, 0, 32767.0 / 32767, 0, 255, 0, 51, 0, 0, 255, 1, 2, 3};
  /* The third vertex of the first accessor starts at byte 16: 0, 32767, 0. */
  assert_positions(&r.soup, expected, 6, 1e-15);
  done(&r);
}

static void test_morph_targets_stand_at_their_default_weights(void **state) {
  (void)state;
  reading r;
  const struct {
    float positions[9], first[9], second[9];
  } data = {{0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 0, 4, 0, 0, 0, 0, 0, 0}, {8, 0, 0, 0, 0, 0, 0, 0, 8}};
  const char *json =
      "{'asset':{'version':'2.0'},'buffers':[{'byteLength':108}],'bufferViews':[{'buffer':0,'byteLength':36},"
      "{'buffer':0,'byteOffset':36,'byteLength':36},{'buffer':0,'byteOffset':72,'byteLength':36}],'accessors':["
      "{'bufferView':0,'componentType':5126,'count':3,'type':'VEC3'},{'bufferView':1,'componentType':5126,'count':3,"
      "'type':'VEC3'},{'bufferView':2,'componentType':5126,'count':3,'type':'VEC3'}],'meshes':[{'weights':[0.5,0.25],"
      "'primitives':[{'attributes':{'POSITION':0},'targets':[{'POSITION':1},{'POSITION':2}]}]}],"
      "'nodes':[{'mesh':0},{'mesh':0,'weights':[1,0]}]}";
  must_read(&r, json, &data, sizeof data);
  const double expected[18] = {2, 0, 2, 1, 0, 0, 0, 1, 2, 0, 0, 4, 1, 0, 0, 0, 1, 0};
  assert_positions(&r.soup, expected, 6, 0);
  done(&r);
}

/* A triangle bound to two joints: its first vertex to joint 0, its second to joint 1, its third to both by half. */
typedef struct skinned_data {
  float positions[9];
  float inverse[32];
  uint8_t joints[12];
  uint8_t weights[12];
} skinned_data;
static const skinned_data skinned = {
    {1, 0, 0, 1, 0, 0, 1, 0, 0},
    {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -1, 1},
    {0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0},
    {255, 0, 0, 0, 255, 0, 0, 0, 127, 127, 0, 0}};
#define SKINNED                                                                                                        \
  "{'asset':{'version':'2.0'},'buffers':[{'byteLength':188}],'bufferViews':[{'buffer':0,'byteLength':36},"             \
  "{'buffer':0,'byteOffset':36,'byteLength':128},{'buffer':0,'byteOffset':164,'byteLength':12},"                       \
  "{'buffer':0,'byteOffset':176,'byteLength':12}],'accessors':[{'bufferView':0,'componentType':5126,'count':3,"        \
  "'type':'VEC3'},{'bufferView':1,'componentType':5126,'count':2,'type':'MAT4'},{'bufferView':2,'componentType':5121," \
  "'count':3,'type':'VEC4'},{'bufferView':3,'componentType':5121,'normalized':true,'count':3,'type':'VEC4'}],"         \
  "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'JOINTS_0':2,'WEIGHTS_0':3}}]}],"                              \
  "'skins':[{'joints':[1,2],'inverseBindMatrices':1}],'nodes':[{'mesh':0,'skin':0,'translation':[100,100,100]},"       \
  "{'translation':[0,10,0],'children':[2]},{'translation':[0,0,20],'scale':[2,1,1]}],'scenes':[{'nodes':[0,1]}]}"

static void test_skinned_meshes_follow_their_joints_and_not_their_node(void **state) {
  (void)state;
  reading r;
  must_read(&r, SKINNED, &skinned, sizeof skinned);
  /* Joint 0 adds (0, 10, 0). Joint 1 takes (1, 0, 0) by its inverse bind to (1, 0, -1), then to (2, 10, 19). */
  const double expected[9] = {1, 10, 0, 2, 10, 19, 1.5, 10, 9.5};
  assert_positions(&r.soup, expected, 3, 1e-14);
  assert_int_equal(reported(&r, "meshes_skinned"), 1);
  done(&r);
}

/* ---- Draco ---- */

/* A tetrahedron, compressed without loss that matters, as the only primitive of an asset. */
static qmat_writer draco_chunk(qmat_context *context) {
  const float positions[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const uint32_t faces[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  const qmat_draco_attribute attribute = {
      .meaning = QMAT_DRACO_POSITION, .components = 3, .bits = 14, .values = positions};
  uint8_t *bytes;
  size_t size;
  assert_int_equal(qmat_draco_encode(context, &attribute, 1, 4, faces, 4, true, &bytes, &size), QMAT_OK);
  qmat_writer chunk = {0};
  qmat_put_bytes(&chunk, bytes, size);
  qmat_free(bytes);
  return chunk;
}

static void draco_json(char *json, size_t room, size_t size) {
  snprintf(json, room,
           "{'asset':{'version':'2.0'},'extensionsUsed':['KHR_draco_mesh_compression'],'extensionsRequired':["
           "'KHR_draco_mesh_compression'],'buffers':[{'byteLength':%zu}],'bufferViews':[{'buffer':0,'byteLength':%zu}],"
           "'accessors':[{'componentType':5126,'count':4,'type':'VEC3'},{'componentType':5121,'count':12,'type':"
           "'SCALAR'}],'meshes':[{'primitives':[{'attributes':{'POSITION':0},'indices':1,'extensions':{"
           "'KHR_draco_mesh_compression':{'bufferView':0,'attributes':{'POSITION':0}}}}]}],'nodes':[{'mesh':0}]}",
           size, size);
}

static void test_draco_data_are_read(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_writer chunk = draco_chunk(&context);
  char json[2048];
  draco_json(json, sizeof json, chunk.size);
  reading r;
  must_read(&r, json, chunk.bytes, chunk.size);
  const double expected[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const uint32_t corners[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  assert_positions(&r.soup, expected, 4, 1e-4);
  assert_corners(&r.soup, corners, 4);
  done(&r);

  /* Two primitives may share the data under accessors of their own. */
  char *twice = asset_replace(json, "'POSITION':0}}}}]}]",
                              "'POSITION':0}}}},{'attributes':{'POSITION':2},'extensions':{"
                              "'KHR_draco_mesh_compression':{'bufferView':0,'attributes':"
                              "{'POSITION':0}}}}]}]");
  char *shared = asset_replace(twice, "'accessors':[", "'accessors':[{'componentType':5126,'count':4,'type':'VEC3'},");
  char *moved = asset_replace(shared, "{'componentType':5121,'count':12,'type':'SCALAR'}",
                              "{'componentType':5126,'count':4,'type':'VEC3'}");
  char *final = asset_replace(moved, "'indices':1,", "");
  must_read(&r, final, chunk.bytes, chunk.size);
  assert_int_equal(r.soup.facet_count, 8);
  assert_positions(&r.soup, (const double[24]){0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1},
                   8, 1e-4);
  done(&r);
  free(final);
  free(moved);
  free(shared);
  free(twice);
  qmat_writer_uninit(&chunk);
  qmat_context_uninit(&context);
}

/* ---- what is refused ---- */

typedef struct mutation {
  const char *from, *to;
  const char *kind; /* of the element that the error names; NULL: none */
  int64_t element;
  const char *text; /* in the message */
} mutation;

static void assert_refused(const char *json, const void *chunk, size_t size, const mutation *m) {
  char *mutated = asset_replace(json, m->from, m->to);
  reading r;
  qmat_status status = read_asset(&r, mutated, chunk, size);
  if (status != QMAT_ERROR_FORMAT) fail_msg("%s -> %s: status %s", m->from, m->to, qmat_status_name(status));
  const qmat_error *e = &r.context.error;
  if (strcmp(e->element_kind, m->kind ? m->kind : "") != 0 || (m->kind && e->element != m->element) ||
      !strstr(e->message, m->text)) {
    fail_msg("%s -> %s: %s %lld: %s", m->from, m->to, e->element_kind, (long long)e->element, e->message);
  }
  assert_string_equal(e->file, "test.glb");
  done(&r);
  free(mutated);
}

static void test_hostile_fields_are_refused_by_name(void **state) {
  (void)state;
  static const mutation mutations[] = {
      {"'version':'2.0'", "'version':'1.0'", NULL, 0, "glTF version 1.0"},
      {"'version':'2.0'", "'version':2", NULL, 0, "asset.version"},
      {"'version':'2.0'", "'version':'2.0','minVersion':'2.1'", NULL, 0, "2.1"},
      {"'buffers':[{", "'buffers':[7,{", "buffer", 0, "object"},
      {"'buffers':[{'byteLength':60}]", "'buffers':{}", NULL, 0, "buffers"},
      {"'byteLength':60", "'byteLength':61", "buffer", 0, "byteLength is 61"},
      {"'byteLength':60", "'byteLength':-60", "buffer", 0, "byteLength"},
      {"'byteLength':60", "'byteLength':60.5", "buffer", 0, "byteLength"},
      {"'byteLength':60", "'byteLength':'60'", "buffer", 0, "byteLength"},
      {"'byteLength':60", "'length':60", "buffer", 0, "byteLength is missing"},
      {"[{'byteLength':60}],'bufferViews':[{'buffer':0,",
       "[{'byteLength':60},{'byteLength':48}],'bufferViews':[{'buffer':1,", "bufferView", 0, "buffer 1 has no uri"},
      {"{'buffer':0,'byteLength':48}", "{'buffer':1,'byteLength':48}", "bufferView", 0, "buffer is 1"},
      {"{'buffer':0,'byteLength':48}", "{'buffer':-1,'byteLength':48}", "bufferView", 0, "buffer"},
      {"{'buffer':0,'byteLength':48}", "{'buffer':4294967296,'byteLength':48}", "bufferView", 0, "buffer"},
      {"{'buffer':0,'byteLength':48}", "{'buffer':0,'byteLength':61}", "bufferView", 0, "outside buffer 0"},
      {"{'buffer':0,'byteLength':48}", "{'buffer':0,'byteLength':0}", "bufferView", 0, "byteLength"},
      {"'byteOffset':48", "'byteOffset':49", "bufferView", 1, "outside buffer 0"},
      {"'byteOffset':48", "'byteOffset':4294967295", "bufferView", 1, "outside buffer 0"},
      {"'byteOffset':48", "'byteOffset':-4", "bufferView", 1, "byteOffset"},
      {"{'buffer':0,'byteLength':48}", "{'buffer':0,'byteLength':48,'byteStride':3}", "bufferView", 0, "byteStride"},
      {"{'buffer':0,'byteLength':48}", "{'buffer':0,'byteLength':48,'byteStride':6}", "bufferView", 0, "byteStride"},
      {"{'buffer':0,'byteLength':48}", "{'buffer':0,'byteLength':48,'byteStride':8}", "accessor", 0, "overlap"},
      {"{'buffer':0,'byteLength':48}", "{'buffer':0,'byteLength':48,'byteStride':16}", "accessor", 0, "need 60 bytes"},
      {"'accessors':[{'bufferView':0", "'accessors':[{'bufferView':2", "accessor", 0, "bufferView is 2"},
      {"'accessors':[{'bufferView':0", "'accessors':[{'bufferView':-1", "accessor", 0, "bufferView"},
      {"'componentType':5126", "'componentType':5124", "accessor", 0, "5124"},
      {"'componentType':5126", "'componentType':5127", "accessor", 0, "componentType"},
      {"'componentType':5126", "'componentType':5125", "accessor", 0, "POSITION"},
      {"'count':4", "'count':5", "accessor", 0, "need 60 bytes"},
      {"'count':4", "'count':0", "accessor", 0, "count"},
      {"'count':4", "'count':4294967295", "accessor", 0, "need"},
      {"'count':4", "'count':4294967296", "accessor", 0, "count"},
      {"'count':4", "'byteOffset':4,'count':4", "accessor", 0, "need 52 bytes"},
      {"'count':4", "'byteOffset':-1,'count':4", "accessor", 0, "byteOffset"},
      {"'count':4", "'normalized':1,'count':4", "accessor", 0, "normalized"},
      {"'type':'VEC3'", "'type':'VEC5'", "accessor", 0, "VEC5"},
      {"'type':'VEC3'", "'type':'VEC2'", "accessor", 0, "POSITION"},
      {"'type':'VEC3'", "'kind':'VEC3'", "accessor", 0, "type"},
      {"{'bufferView':0,'componentType':5126,'count':4,", "{'componentType':5126,'count':4000000000,", "accessor", 0,
       "without data"},
      {"'POSITION':0", "'POSITION':2", "mesh", 0, "POSITION is 2"},
      {"'POSITION':0", "'POSITION':-1", "mesh", 0, "POSITION"},
      {"'POSITION':0", "'POSITION':0,'NORMAL':9", "mesh", 0, "NORMAL is 9"},
      {"'POSITION':0", "'POSITION':0,'JOINTS_0':0", "accessor", 0, "JOINTS"},
      {"'attributes':{'POSITION':0}", "'attributes':[0]", "mesh", 0, "attributes"},
      {"'attributes':{'POSITION':0},", "", "mesh", 0, "attributes"},
      {"'indices':1", "'indices':2", "mesh", 0, "indices is 2"},
      {"'indices':1", "'indices':-1", "mesh", 0, "indices"},
      {"'indices':1", "'indices':0", "accessor", 0, "indices"},
      {"'indices':1", "'indices':1,'mode':7", "mesh", 0, "mode"},
      {"'indices':1", "'indices':1,'targets':[{'POSITION':1}]", "accessor", 1, "morph target"},
      {"'indices':1", "'indices':1,'targets':[{'POSITION':5}]", "mesh", 0, "POSITION is 5"},
      {"'indices':1", "'indices':1,'targets':[3]", "mesh", 0, "morph target 0"},
      {"{'bufferView':1,'componentType':5123", "{'componentType':5123", "accessor", 1, "no bufferView"},
      {"[{'primitives':[{", "[{'primitives':[0,{", "mesh", 0, "primitive 0"},
      {"'primitives':[", "'weights':['a'],'primitives':[", "mesh", 0, "weights"},
      {"{'primitives':[{'attributes':{'POSITION':0},'indices':1}]}", "{}", "mesh", 0, "no primitives"},
      {"'nodes':[{'mesh':0}]", "'nodes':[{'mesh':1}]", "node", 0, "mesh is 1"},
      {"'nodes':[{'mesh':0}]", "'nodes':[{'mesh':0,'skin':0}]", "node", 0, "skin is 0"},
      {"'nodes':[{'mesh':0}]", "'nodes':[{'children':[1]}]", "node", 0, "children names node 1"},
      {"'nodes':[{'mesh':0}]", "'nodes':[{'children':['0']}]", "node", 0, "children"},
      {"'nodes':[{'mesh':0}]", "'nodes':[{'children':[0]}]", "node", 0, "ancestor"},
      {"'nodes':[{'mesh':0}]", "'nodes':[{},{'children':[2]},{'children':[1]}]", "node", 1, "ancestor"},
      {"'nodes':[{'mesh':0}]", "'nodes':[{'children':[1]},{},{'children':[1]}]", "node", 1, "child more than once"},
      {"'nodes':[{'mesh':0}]", "'nodes':[{'matrix':[1,2,3]}]", "node", 0, "matrix"},
      {"'nodes':[{'mesh':0}]", "'nodes':[{'translation':[1,2,'3']}]", "node", 0, "translation"},
      {"'nodes':[{'mesh':0}]", "'nodes':[{'rotation':[0,0,0,0]}]", "node", 0, "quaternion"},
      {"'nodes':[{'mesh':0}]", "'nodes':[{'scale':2}]", "node", 0, "scale"},
      {"'nodes':[{'mesh':0}]", "'nodes':[null]", "node", 0, "object"},
      {"'scene':0", "'scene':1", NULL, 0, "scene is 1"},
      {"'nodes':[0]", "'nodes':[1]", "scene", 0, "names node 1"},
      {"'nodes':[0]", "'nodes':[0,0]", "scene", 0, "twice"},
      {"'scene':0", "'extensionsRequired':['EXT_mesh_gpu_instancing'],'scene':0", NULL, 0, "EXT_mesh_gpu_instancing"},
      {"'scene':0", "'extensionsRequired':[1],'scene':0", NULL, 0, "extensionsRequired"},
      {"'scene':0", "'scene':0,'scene':0", NULL, 0, "duplicate"},
      {"'scene':0", "'scene':1e999", NULL, 0, "JSON"},
  };
  for (size_t i = 0; i < sizeof mutations / sizeof *mutations; i++) {
    assert_refused(SQUARE, &square, sizeof square, &mutations[i]);
  }
}

static void test_hostile_skins_are_refused_by_name(void **state) {
  (void)state;
  static const mutation mutations[] = {
      {"'joints':[1,2]", "'joints':[1,3]", "skin", 0, "node 3"},
      {"'joints':[1,2]", "'joints':[]", "skin", 0, "no joints"},
      {"'joints':[1,2]", "'joints':[1,2,0]", "skin", 0, "3 joints but 2"},
      {"'joints':[1,2]", "'joints':[1]", "skin", 0, "joint 1, but the joint count is 1"},
      {"'inverseBindMatrices':1", "'inverseBindMatrices':4", "skin", 0, "is 4"},
      {"'inverseBindMatrices':1", "'inverseBindMatrices':0", "accessor", 0, "inverse bind"},
      {"'count':3,'type':'VEC4'}]", "'count':2,'type':'VEC4'}]", "accessor", 3, "2 elements, POSITION has 3"},
      {",'WEIGHTS_0':3", "", "mesh", 0, "without WEIGHTS_0"},
      {",'JOINTS_0':2", "", "mesh", 0, "without JOINTS_0"},
  };
  for (size_t i = 0; i < sizeof mutations / sizeof *mutations; i++) {
    assert_refused(SKINNED, &skinned, sizeof skinned, &mutations[i]);
  }
}

static void test_hostile_draco_ids_are_refused_by_name(void **state) {
  (void)state;
  static const mutation mutations[] = {
      {"{'bufferView':0,'attributes'", "{'bufferView':1,'attributes'", "mesh", 0, "bufferView is 1"},
      {"{'bufferView':0,'attributes'", "{'bufferView':-1,'attributes'", "mesh", 0, "bufferView"},
      {"{'bufferView':0,'attributes'", "{'attributes'", "mesh", 0, "bufferView is missing"},
      {"'bufferView':0,'attributes':{'POSITION':0}", "'bufferView':0", "mesh", 0, "no attributes"},
      {"'bufferView':0,'attributes':{'POSITION':0}", "'bufferView':0,'attributes':{'POSITION':1}", "accessor", 0,
       "no attribute with id 1"},
      {"'bufferView':0,'attributes':{'POSITION':0}", "'bufferView':0,'attributes':{'POSITION':-1}", "mesh", 0,
       "Draco id of POSITION"},
      {"'bufferView':0,'attributes':{'POSITION':0}", "'bufferView':0,'attributes':{'POSITION':0,'NORMAL':0}", "mesh", 0,
       "NORMAL"},
      {"'count':4", "'count':5", "accessor", 0, "Draco data have 4"},
      {"'count':4", "'count':4294967295", "accessor", 0, "Draco data have 4"},
      {"'indices':1", "'indices':2", "mesh", 0, "indices is 2"},
  };
  qmat_context context = {0};
  qmat_writer chunk = draco_chunk(&context);
  char json[2048];
  draco_json(json, sizeof json, chunk.size);
  for (size_t i = 0; i < sizeof mutations / sizeof *mutations; i++) {
    assert_refused(json, chunk.bytes, chunk.size, &mutations[i]);
  }
  qmat_writer_uninit(&chunk);
  qmat_context_uninit(&context);
}

static void test_indices_beyond_the_vertices_are_refused(void **state) {
  (void)state;
  square_data data = square;
  data.indices[4] = 4;
  reading r;
  assert_int_equal(read_asset(&r, SQUARE, &data, sizeof data), QMAT_ERROR_FORMAT);
  assert_string_equal(r.context.error.element_kind, "accessor");
  assert_int_equal(r.context.error.element, 1);
  assert_string_equal(r.context.error.message, "index 4 is 4, but the vertex count is 4");
  done(&r);
}

static void test_instances_that_no_bytes_justify_are_refused(void **state) {
  (void)state;
  /* 400 primitives, each over the same 65536 zeros, under 1 node: 26 million vertices out of 60 bytes. */
  qmat_writer json = {0};
  qmat_put_text(&json, "{" SQUARE_PARTS);
  json.size--; /* the comma, and then the bracket, reopen the array of accessors */
  json.size--;
  qmat_put_text(&json, ",{'componentType':5126,'count':65536,'type':'VEC3'}],'meshes':[{'primitives':[");
  for (int i = 0; i < 400; i++)
    qmat_put_text(&json, i ? ",{'attributes':{'POSITION':2}}" : "{'attributes':{'POSITION':2}}");
  qmat_put_text(&json, "]}],'nodes':[{'mesh':0}]}");
  qmat_put_u8(&json, 0);
  reading r;
  assert_int_equal(read_asset(&r, (const char *)json.bytes, &square, sizeof square), QMAT_ERROR_GEOMETRY);
  assert_non_null(strstr(r.context.error.message, "size of the asset"));
  done(&r);
  qmat_writer_uninit(&json);
}

static void test_deep_nodes_are_read_without_recursion(void **state) {
  (void)state;
  enum { DEPTH = 100000 };
  qmat_writer json = {0};
  qmat_put_text(&json, "{" SQUARE_PARTS SQUARE_MESH "'scenes':[{'nodes':[0]}],'nodes':[");
  for (int i = 0; i + 1 < DEPTH; i++) {
    char node[80];
    snprintf(node, sizeof node, "{'children':[%d],'translation':[1,0,0]},", i + 1);
    qmat_put_text(&json, node);
  }
  qmat_put_text(&json, "{'mesh':0}]}");
  qmat_put_u8(&json, 0);
  reading r;
  must_read(&r, (const char *)json.bytes, &square, sizeof square);
  assert_true(r.soup.positions[0] == DEPTH - 1);
  done(&r);
  qmat_writer_uninit(&json);
}

static void test_unknown_extensions_that_are_not_required_are_reported(void **state) {
  (void)state;
  char *json = asset_replace(SQUARE, "'scene':0",
                             "'extensionsUsed':['KHR_materials_unlit','EXT_mesh_gpu_instancing'],"
                             "'extensionsRequired':['KHR_materials_unlit'],'scene':0");
  reading r;
  must_read(&r, json, &square, sizeof square);
  json_t *ignored = json_object_get(r.report, "extensions_ignored");
  assert_int_equal(json_array_size(ignored), 1);
  assert_string_equal(json_string_value(json_array_get(ignored, 0)), "EXT_mesh_gpu_instancing");
  const json_t *warnings = json_object_get(r.report, "warnings");
  assert_int_equal(json_array_size(warnings), 1);
  assert_string_equal(json_string_value(json_array_get(warnings, 0)),
                      "EXT_mesh_gpu_instancing is not read: each of its meshes is in one place");
  done(&r);
  free(json);
}

/* ---- .gltf, external and embedded data ---- */

static void write_bytes(const char *folder, const char *name, const void *bytes, size_t size) {
  char path[512];
  snprintf(path, sizeof path, "%s/%s", folder, name);
  FILE *file = fopen(path, "wb");
  assert_non_null(file);
  assert_int_equal(fwrite(bytes, 1, size, file), size);
  assert_int_equal(fclose(file), 0);
}

static void read_with_uri(reading *r, const char *folder, const char *uri, qmat_status expected) {
  char buffer[1024], path[512];
  snprintf(buffer, sizeof buffer, "{'uri':'%s','byteLength':60}", uri);
  char *json = asset_replace(SQUARE, "{'byteLength':60}", buffer), *text = asset_json(json);
  write_bytes(folder, "asset.gltf", text, strlen(text));
  snprintf(path, sizeof path, "%s/asset.gltf", folder);
  *r = (reading){.report = json_object()};
  qmat_status status = qmat_gltf_read(&r->context, path, &r->soup, r->report);
  if (status != expected) fail_msg("%s: %s: %s", uri, qmat_status_name(status), r->context.error.message);
  free(text);
  free(json);
}

static void test_external_data_stay_inside_the_folder(void **state) {
  (void)state;
  char folder[] = "/tmp/qmat-gltf-XXXXXX", inner[64];
  assert_non_null(mkdtemp(folder));
  snprintf(inner, sizeof inner, "%s/inner", folder);
  assert_int_equal(mkdir(inner, 0700), 0);
  write_bytes(folder, "outside.bin", &square, sizeof square);
  write_bytes(inner, "a b.bin", &square, sizeof square);
  write_bytes(inner, "short.bin", &square, 59);
  reading r;
  read_with_uri(&r, inner, "a%20b.bin", QMAT_OK);
  assert_int_equal(r.soup.facet_count, 2);
  done(&r);
  read_with_uri(&r, inner, "./a b.bin", QMAT_OK);
  done(&r);
  static const char *const outside[] = {"../outside.bin",
                                        "%2e%2e/outside.bin",
                                        "x/../../outside.bin",
                                        "/etc/passwd",
                                        "file:///etc/passwd",
                                        "http://a/b.bin",
                                        "..%2Foutside.bin",
                                        "a%00b.bin",
                                        "a%2.bin",
                                        "",
                                        "x/",
                                        "..\\\\outside.bin"};
  for (size_t i = 0; i < sizeof outside / sizeof *outside; i++) {
    read_with_uri(&r, inner, outside[i], QMAT_ERROR_FORMAT);
    assert_string_equal(r.context.error.element_kind, "buffer");
    assert_non_null(strstr(r.context.error.message, "relative path"));
    done(&r);
  }
  read_with_uri(&r, inner, "gone.bin", QMAT_ERROR_IO);
  assert_non_null(strstr(r.context.error.file, "inner/gone.bin"));
  done(&r);
  read_with_uri(&r, inner, "short.bin", QMAT_ERROR_FORMAT);
  assert_non_null(strstr(r.context.error.message, "there are 59 bytes"));
  done(&r);
  char path[512];
  const char *const made[] = {"inner/asset.gltf", "inner/a b.bin", "inner/short.bin", "outside.bin"};
  for (size_t i = 0; i < 4; i++) {
    snprintf(path, sizeof path, "%s/%s", folder, made[i]);
    assert_int_equal(unlink(path), 0);
  }
  assert_int_equal(rmdir(inner), 0);
  assert_int_equal(rmdir(folder), 0);
}

static void test_data_uris_are_read(void **state) {
  (void)state;
  char *base64 = qmat_base64_encode((const uint8_t *)&square, sizeof square);
  char buffer[512];
  static const char *const heads[] = {"data:application/octet-stream;base64,", "data:application/gltf-buffer;base64,",
                                      "data:;base64,"};
  for (size_t i = 0; i < 3; i++) {
    snprintf(buffer, sizeof buffer, "{'uri':'%s%s','byteLength':60}", heads[i], base64);
    char *json = asset_replace(SQUARE, "{'byteLength':60}", buffer);
    reading r;
    must_read(&r, json, NULL, 0);
    assert_corners(&r.soup, square_corners, 2);
    done(&r);
    free(json);
  }
  static const mutation bad[] = {
      {"{'byteLength':60}", "{'uri':'data:text/plain,abc','byteLength':60}", "buffer", 0, "not base64"},
      {"{'byteLength':60}", "{'uri':'data:;base64,AAA','byteLength':1}", "buffer", 0, "multiple of 4"},
      {"{'byteLength':60}", "{'uri':'data:;base64,AA A','byteLength':1}", "buffer", 0, "alphabet"},
      {"{'byteLength':60}", "{'uri':'data:;base64,AAAA','byteLength':4}", "buffer", 0, "there are 3 bytes"},
  };
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) assert_refused(SQUARE, NULL, 0, &bad[i]);
  qmat_free(base64);
}

static void test_damaged_json_is_placed_by_line(void **state) {
  (void)state;
  const char *text = "{\n  \"asset\": {\"version\": \"2.0\"},\n  \"nodes\": [}\n}\n";
  reading r = {.report = json_object()};
  assert_int_equal(qmat_gltf_parse(&r.context, (const uint8_t *)text, strlen(text), "test.gltf", &r.soup, r.report),
                   QMAT_ERROR_FORMAT);
  assert_int_equal(r.context.error.line, 3);
  assert_string_equal(r.context.error.file, "test.gltf");
  done(&r);
  const char *marked = "\xEF\xBB\xBF{}"; /* a byte order mark is no damage */
  r = (reading){.report = json_object()};
  assert_int_equal(qmat_gltf_parse(&r.context, (const uint8_t *)marked, strlen(marked), "test.gltf", &r.soup, r.report),
                   QMAT_ERROR_FORMAT);
  assert_non_null(strstr(r.context.error.message, "asset"));
  done(&r);
}

/* ---- truncation and noise ---- */

static qmat_status parse_copy(const uint8_t *bytes, size_t size) {
  qmat_context context = {0};
  qmat_soup soup = {0};
  /* A copy of the very size, so that a read past the end is seen. */
  uint8_t *copy = malloc(size > 0 ? size : 1);
  assert_non_null(copy);
  if (size > 0) memcpy(copy, bytes, size);
  qmat_status status = qmat_gltf_parse(&context, copy, size, "test.glb", &soup, NULL);
  if (status != QMAT_OK) assert_true(context.error.message[0] != '\0');
  free(copy);
  qmat_soup_uninit(&soup);
  qmat_context_uninit(&context);
  return status;
}

static void assert_survives(const uint8_t *bytes, size_t size, int rounds) {
  assert_int_equal(parse_copy(bytes, size), QMAT_OK);
  size_t step = size > 4096 ? size / 1024 : 1;
  for (size_t length = 0; length < size; length += step) {
    assert_int_not_equal(parse_copy(bytes, length), QMAT_OK);
  }
  uint8_t *noisy = malloc(size);
  assert_non_null(noisy);
  uint64_t random = 0x9E3779B97F4A7C15;
  for (int round = 0; round < rounds; round++) {
    memcpy(noisy, bytes, size);
    for (int changes = 1 + round % 4; changes > 0; changes--) {
      random = random * 6364136223846793005u + 1442695040888963407u;
      noisy[(size_t)(random >> 20) % size] = (uint8_t)(random >> 56);
    }
    qmat_status status = parse_copy(noisy, size);
    assert_true(status == QMAT_OK || status == QMAT_ERROR_FORMAT || status == QMAT_ERROR_IO ||
                status == QMAT_ERROR_GEOMETRY);
  }
  free(noisy);
}

static void test_truncated_and_noisy_assets_fail_cleanly(void **state) {
  (void)state;
  qmat_writer glb = asset_glb(SQUARE, &square, sizeof square);
  assert_survives(glb.bytes, glb.size, 3000);
  qmat_writer_uninit(&glb);
  glb = asset_glb(SKINNED, &skinned, sizeof skinned);
  assert_survives(glb.bytes, glb.size, 3000);
  qmat_writer_uninit(&glb);
}

static void test_truncated_and_noisy_draco_fails_cleanly(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_writer chunk = draco_chunk(&context);
  char json[2048];
  draco_json(json, sizeof json, chunk.size);
  qmat_writer glb = asset_glb(json, chunk.bytes, chunk.size);
  assert_survives(glb.bytes, glb.size, 2000);
  /* Noise in the Draco data alone. */
  uint64_t random = 1;
  for (int round = 0; round < 3000; round++) {
    qmat_writer noisy = asset_glb(json, chunk.bytes, chunk.size);
    random = random * 6364136223846793005u + 1442695040888963407u;
    noisy.bytes[noisy.size - 1 - (size_t)(random >> 20) % chunk.size] = (uint8_t)(random >> 56);
    parse_copy(noisy.bytes, noisy.size);
    qmat_writer_uninit(&noisy);
  }
  qmat_writer_uninit(&glb);
  qmat_writer_uninit(&chunk);
  qmat_context_uninit(&context);
}

static void test_a_few_bytes_of_draco_cannot_ask_for_gigabytes(void **state) {
  (void)state;
  qmat_context context = {0};
  /* Sequential: 1 face, 2^31 points. Edgebreaker: 2^31 points, 2^30 faces. */
  const uint8_t sequential[] = "DRACO\x02\x02\x01\x00\x00\x00\x01\x80\x80\x80\x80\x08";
  const uint8_t edgebreaker[] = "DRACO\x02\x02\x01\x01\x00\x00\x00\x80\x80\x80\x80\x08\x80\x80\x80\x80\x04";
  qmat_draco_mesh *mesh;
  assert_int_equal(qmat_draco_mesh_new(&context, sequential, sizeof sequential, &mesh), QMAT_ERROR_FORMAT);
  assert_non_null(strstr(context.error.message, "2147483648 points"));
  assert_int_equal(qmat_draco_mesh_new(&context, edgebreaker, sizeof edgebreaker, &mesh), QMAT_ERROR_FORMAT);
  assert_non_null(strstr(context.error.message, "2147483648 points and 1073741824 faces"));
  qmat_context_uninit(&context);
}

/* ---- real files ---- */

static bool real_file(reading *r, const char *path) {
  if (access(path, R_OK) != 0) {
    print_message("skipped: %s is not here\n", path);
    return false;
  }
  *r = (reading){.report = json_object()};
  qmat_status status = qmat_gltf_read(&r->context, path, &r->soup, r->report);
  if (status != QMAT_OK) fail_msg("%s: %s", path, r->context.error.message);
  return true;
}

static void assert_box(const qmat_soup *soup, const double *low, const double *high, double tolerance) {
  double box[6] = {INFINITY, INFINITY, INFINITY, -INFINITY, -INFINITY, -INFINITY};
  for (size_t i = 0; i < 3 * soup->vertex_count; i++) {
    box[i % 3] = fmin(box[i % 3], soup->positions[i]);
    box[3 + i % 3] = fmax(box[3 + i % 3], soup->positions[i]);
  }
  for (int k = 0; k < 3; k++) {
    if (fabs(box[k] - low[k]) > tolerance || fabs(box[3 + k] - high[k]) > tolerance) {
      fail_msg("axis %d: [%g, %g] is not [%g, %g]", k, box[k], box[3 + k], low[k], high[k]);
    }
  }
}

static void test_duck_is_scaled_by_its_root(void **state) {
  (void)state;
  reading r;
  if (!real_file(&r, DATA "Duck.glb")) skip();
  assert_int_equal(r.soup.vertex_count, 2399);
  assert_int_equal(r.soup.facet_count, 4212);
  assert_box(&r.soup, (const double[]){-0.692985, 0.0992937, -0.613282}, (const double[]){0.961799, 1.6397, 0.539252},
             1e-5);
  done(&r);
}

static void test_cesium_man_stands_in_his_rest_pose(void **state) {
  (void)state;
  reading r;
  if (!real_file(&r, DATA "CesiumMan.glb")) skip();
  assert_int_equal(r.soup.vertex_count, 3273);
  assert_int_equal(r.soup.facet_count, 4672);
  assert_int_equal(reported(&r, "meshes_skinned"), 1);
  /* Upright along y: feet on the ground, about a metre and a half tall. */
  assert_box(&r.soup, (const double[]){-0.13, 0.0, -0.57}, (const double[]){0.18, 1.51, 0.57}, 0.03);
  done(&r);
}

static void test_compressed_boxes_are_read(void **state) {
  (void)state;
  reading r;
  if (!real_file(&r, DATA "Box_Draco.glb")) skip();
  assert_int_equal(r.soup.vertex_count, 24);
  assert_int_equal(r.soup.facet_count, 12);
  assert_box(&r.soup, (const double[]){-0.5, -0.5, -0.5}, (const double[]){0.5, 0.5, 0.5}, 1e-3);
  done(&r);
  if (!real_file(&r, DATA "BoxMetaDraco/BoxMetaDraco.gltf")) skip();
  assert_int_equal(r.soup.facet_count, 12);
  assert_box(&r.soup, (const double[]){-0.5, -0.5, 1.5}, (const double[]){0.5, 0.5, 2.5}, 1e-3);
  done(&r);
}

static void test_real_files_survive_noise(void **state) {
  (void)state;
  static const char *const names[] = {DATA "Box_Draco.glb", DATA "Duck.glb", DATA "CesiumMan.glb"};
  for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
    qmat_context context = {0};
    qmat_bytes file = {0};
    if (access(names[i], R_OK) != 0) {
      print_message("skipped: %s is not here\n", names[i]);
      skip();
    }
    assert_int_equal(qmat_bytes_read_file(&context, names[i], &file), QMAT_OK);
    assert_survives(file.data, file.size, i == 0 ? 2000 : 60);
    qmat_bytes_uninit(&file);
    qmat_context_uninit(&context);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_mesh_is_read_as_it_stands),
      cmocka_unit_test(test_transforms_multiply_from_the_root_down),
      cmocka_unit_test(test_a_matrix_is_read_by_columns),
      cmocka_unit_test(test_a_mirroring_node_turns_its_triangles_round),
      cmocka_unit_test(test_a_mesh_appears_once_for_each_node),
      cmocka_unit_test(test_only_the_default_scene_is_read),
      cmocka_unit_test(test_strips_and_fans_become_triangles_without_stitches),
      cmocka_unit_test(test_a_root_that_is_also_a_child_is_read_once_as_a_root),
      cmocka_unit_test(test_points_lines_and_placeless_primitives_are_counted),
      cmocka_unit_test(test_without_indices_every_three_vertices_are_a_triangle),
      cmocka_unit_test(test_sparse_values_replace_dense_ones_and_zeros),
      cmocka_unit_test(test_quantised_positions_are_normalised_and_strided),
      cmocka_unit_test(test_morph_targets_stand_at_their_default_weights),
      cmocka_unit_test(test_skinned_meshes_follow_their_joints_and_not_their_node),
      cmocka_unit_test(test_draco_data_are_read),
      cmocka_unit_test(test_hostile_fields_are_refused_by_name),
      cmocka_unit_test(test_hostile_skins_are_refused_by_name),
      cmocka_unit_test(test_hostile_draco_ids_are_refused_by_name),
      cmocka_unit_test(test_indices_beyond_the_vertices_are_refused),
      cmocka_unit_test(test_instances_that_no_bytes_justify_are_refused),
      cmocka_unit_test(test_deep_nodes_are_read_without_recursion),
      cmocka_unit_test(test_unknown_extensions_that_are_not_required_are_reported),
      cmocka_unit_test(test_external_data_stay_inside_the_folder),
      cmocka_unit_test(test_data_uris_are_read),
      cmocka_unit_test(test_damaged_json_is_placed_by_line),
      cmocka_unit_test(test_truncated_and_noisy_assets_fail_cleanly),
      cmocka_unit_test(test_truncated_and_noisy_draco_fails_cleanly),
      cmocka_unit_test(test_a_few_bytes_of_draco_cannot_ask_for_gigabytes),
      cmocka_unit_test(test_duck_is_scaled_by_its_root),
      cmocka_unit_test(test_cesium_man_stands_in_his_rest_pose),
      cmocka_unit_test(test_compressed_boxes_are_read),
      cmocka_unit_test(test_real_files_survive_noise),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
