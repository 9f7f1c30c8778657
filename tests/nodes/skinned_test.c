/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A skinned model through the shipped nodes: joints of a glTF file to the joints of its spheres. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "examples/readers/qmat_reader.h"
#include "io/gltf/gltf_asset.h"
#include "tests/io/files.h"
#include "tests/io/gltf/gltf_assets.h"
#include "tests/nodes/pipeline.h"

static const double pi = 3.14159265358979323846;
enum { RINGS = 41, AROUND = 20 };
static const float joint_x = 0.25F, joint_y = -0.5F; /* of joint 1, where the arm is bound */

/* An arm of two tubes with a ball at the elbow: along x from -2 to 2, of radius 0.3, at the elbow 0.6. */
static double radius_at(double x) {
  const double ball = 0.36 - x * x, tip = 2 - fabs(x);
  const double tube = tip < 0.3 ? sqrt(fmax(0.09 - (0.3 - tip) * (0.3 - tip), 0)) : 0.3;
  return ball > 0.09 ? sqrt(ball) : tube;
}

/* Positions as floats, corners as u16, joints as u8, weights as floats, two inverse bind matrices. `sizes` are theirs.
 */
static qmat_writer arm_data(size_t sizes[5], uint32_t *triangle_count) {
  qmat_writer data = {0};
  size_t start = 0;
  const uint32_t vertices = RINGS * AROUND + 2;
  const uint32_t ends[] = {RINGS * AROUND, RINGS * AROUND + 1};
  float x_of[RINGS * AROUND + 2];
  for (uint32_t v = 0; v < vertices; v++) {
    const uint32_t ring = v / AROUND;
    /* Rings are denser at the tips. */
    const double x = v == ends[0] ? -2 : v == ends[1] ? 2 : -2 * cos(pi * (ring + 1) / (RINGS + 1));
    const double r = v >= ends[0] ? 0 : radius_at(x), a = 2 * pi * (v % AROUND) / AROUND;
    x_of[v] = (float)x;
    qmat_put_f32(&data, x_of[v]);
    qmat_put_f32(&data, (float)(r * cos(a)));
    qmat_put_f32(&data, (float)(r * sin(a)));
  }
  sizes[0] = data.size, start = data.size;
  for (uint32_t i = 0; i + 1 < RINGS; i++)
    for (uint32_t k = 0; k < AROUND; k++) {
      const uint32_t a = i * AROUND + k, b = i * AROUND + (k + 1) % AROUND, c = a + AROUND, d = b + AROUND;
      const uint32_t corners[] = {a, c, b, b, c, d};
      for (int n = 0; n < 6; n++) qmat_put_u16(&data, (uint16_t)corners[n]);
    }
  for (uint32_t k = 0; k < AROUND; k++) {
    const uint32_t next = (k + 1) % AROUND, last = (RINGS - 1) * AROUND;
    const uint32_t corners[] = {ends[0], k, next, ends[1], last + next, last + k};
    for (int n = 0; n < 6; n++) qmat_put_u16(&data, (uint16_t)corners[n]);
  }
  sizes[1] = data.size - start, start = data.size;
  *triangle_count = (uint32_t)(sizes[1] / 6);
  assert_true(data.size % 4 == 0);
  for (uint32_t v = 0; v < vertices; v++)
    for (int k = 0; k < 4; k++) qmat_put_u8(&data, k == 0 ? x_of[v] > 0 : k == 1 ? x_of[v] <= 0 : 0);
  sizes[2] = data.size - start, start = data.size;
  for (uint32_t v = 0; v < vertices; v++) {
    const float own = fabsf(x_of[v]) < 0.1f ? 0.5f : 1.0f;
    const float weights[] = {own, 1 - own, 0, 0};
    for (int k = 0; k < 4; k++) qmat_put_f32(&data, weights[k]);
  }
  sizes[3] = data.size - start, start = data.size;
  for (int i = 0; i < 32; i++) { /* joint 1 is bound where its node is */
    const float moved = i == 28 ? -joint_x : i == 29 ? -joint_y : 0;
    qmat_put_f32(&data, moved + (float)(i % 16 % 5 == 0));
  }
  sizes[4] = data.size - start;
  return data;
}

static void write_arm(const char *path) {
  size_t sizes[5], offsets[6] = {0};
  uint32_t triangles;
  qmat_writer data = arm_data(sizes, &triangles);
  for (int i = 0; i < 5; i++) offsets[i + 1] = offsets[i] + sizes[i];
  const uint32_t vertices = RINGS * AROUND + 2;
  char json[2048];
  const int length = snprintf(
      json, sizeof json,
      "{'asset':{'version':'2.0'},'buffers':[{'byteLength':%zu}],'bufferViews':[{'buffer':0,'byteLength':%zu},{'buffer'"
      ":0,'byteOffset':%zu,'byteLength':%zu},{'buffer':0,'byteOffset':%zu,'byteLength':%zu},{'buffer':0,'byteOffset':"
      "%zu,'byteLength':%zu},{'buffer':0,'byteOffset':%zu,'byteLength':%zu}],'accessors':[{'bufferView':0,"
      "'componentType':5126,'count':%u,'type':'VEC3','min':[-2,-1,-1],'max':[2,1,1]},{'bufferView':1,'componentType':"
      "5123,'count':%u,'type':'SCALAR'},{'bufferView':2,'componentType':5121,'count':%u,'type':'VEC4'},{'bufferView':3,"
      "'componentType':5126,'count':%u,'type':'VEC4'},{'bufferView':4,'componentType':5126,'count':2,'type':'MAT4'}],"
      "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'JOINTS_0':2,'WEIGHTS_0':3},'indices':1}]}],'skins':[{"
      "'joints':[1,2],'inverseBindMatrices':4}],'nodes':[{'mesh':0,'skin':0},{'children':[2]},{'translation':[0.25,-0."
      "5,0]}],'scene':0,'scenes':"
      "[{'nodes':[0,1]}]}",
      data.size, sizes[0], offsets[1], sizes[1], offsets[2], sizes[2], offsets[3], sizes[3], offsets[4], sizes[4],
      vertices, 3 * triangles, vertices, vertices);
  assert_true(length > 0 && (size_t)length < sizeof json);
  qmat_writer glb = asset_glb(json, data.bytes, data.size);
  write_file(path, (const char *)glb.bytes, glb.size);
  qmat_writer_uninit(&glb);
  qmat_writer_uninit(&data);
}

/* Describes the arm at 2 % and writes it, with colliders where their parameters are given; `*colliders` gets them.
 * `swapped`: they say that they are those of the other joint. */
static qmat_value *write_described(const char *params, const char *write_params, bool swapped, qmat_value **colliders) {
  char folder[64], path[96], setting[128];
  make_folder(folder);
  snprintf(path, sizeof path, "%s/arm.glb", folder);
  write_arm(path);
  snprintf(setting, sizeof setting, "path=%s", path);
  qmat_value *read[PIPELINE_MOST_PORTS], *solid[PIPELINE_MOST_PORTS], *simple[PIPELINE_MOST_PORTS],
      *written[PIPELINE_MOST_PORTS];
  pipeline_must_run(1, "scene.read", setting, NULL, read);
  unlink(path);
  rmdir(folder);
  assert_int_equal(((const qmat_mesh *)read[1])->skinned_count, RINGS * AROUND + 2);
  pipeline_must_run(1, "mesh.solid", "", (const qmat_value *[]){read[1]}, solid);
  pipeline p;
  pipeline_make(&p, (qmat_mesh *)qmat_value_retain(solid[0]), "", "");
  pipeline_must_run(1, "medial.simplify", "epsilon=0.02",
                    (const qmat_value *[]){solid[0], &p.thickness->base, &p.samples->base, &p.medial->base}, simple);
  const qmat_node *write = qmat_node_find("scene.write");
  const qmat_value *inputs[PIPELINE_MOST_PORTS] = {NULL};
  inputs[qmat_input_find(write, "medial")] = simple[0];
  inputs[qmat_input_find(write, "scene")] = read[0];
  inputs[qmat_input_find(write, "skin")] = solid[0]; /* any surface; only skin_beside shows it */
  qmat_value *shapes[PIPELINE_MOST_PORTS] = {NULL};
  if (params) {
    pipeline_must_run(1, "medial.colliders", params, (const qmat_value *[]){solid[0], simple[0]}, shapes);
    inputs[qmat_input_find(write, "colliders")] = *colliders = shapes[0];
    qmat_value_release(shapes[1]);
    qmat_colliders *made = (qmat_colliders *)shapes[0];
    for (size_t i = 0; i < made->joint_count && swapped; i++) made->joints[i] = 1 - made->joints[i];
  }
  pipeline_must_run(1, "scene.write", write_params, inputs, written);
  qmat_value_release(written[1]);
  for (int i = 0; i < 2; i++) qmat_value_release(simple[i]);
  for (int i = 0; i < 2; i++) qmat_value_release(solid[i]);
  for (int i = 0; i < 3; i++) qmat_value_release(read[i]);
  pipeline_free(&p);
  return written[0];
}

/* What the written file says of the arm's spheres. */
static void describe_arm(qmr_medial *medial) {
  qmat_value *written = write_described(NULL, "format=glb", false, NULL);
  const qmat_file *file = (const qmat_file *)written;
  size_t length = 0;
  const char *text = qmr_find(file->parts[0].bytes, file->parts[0].size, NULL, &length);
  assert_non_null(text);
  assert_int_equal(qmr_decode_base64(text, length, medial), 0);
  qmat_value_release(written);
}

static void test_spheres_of_a_skinned_model_follow_its_joints(void **state) {
  (void)state;
  qmr_medial medial;
  describe_arm(&medial);
  assert_true(medial.sphere_count >= 3);
  assert_non_null(medial.joints);
  size_t left = 0, right = 0, middle = 0;
  for (uint32_t i = 0; i < medial.sphere_count; i++) {
    /* Joint 1 turns by 90 degrees about z, joint 0 stays. */
    const double *s = medial.spheres + 4 * (size_t)i;
    double x = 0, y = 0, sum = 0;
    for (size_t k = 4 * (size_t)i; k < 4 * (size_t)i + 4; k++) {
      assert_true(medial.joints[k] < 2);
      x += medial.weights[k] * (medial.joints[k] == 1 ? -s[1] : s[0]);
      y += medial.weights[k] * (medial.joints[k] == 1 ? s[0] : s[1]);
      sum += medial.weights[k];
    }
    assert_near(sum, 1, 1e-12);
    if (s[0] < -1) {
      left++;
      assert_true(fabs(x - s[0]) < 1e-9 && fabs(y - s[1]) < 1e-9);
    } else if (s[0] > 1) {
      right++;
      assert_true(fabs(x + s[1]) < 1e-9 && fabs(y - s[0]) < 1e-9);
    } else if (fabs(s[0]) < 0.3) {
      middle++; /* the ball at the elbow is near the axis of the turn and stays there */
      assert_true(fabs(x) < 0.3 && fabs(y) < 0.3);
    }
  }
  assert_true(left > 0 && right > 0 && middle > 0);
  qmr_free(&medial);
}

static double number_at(const json_t *array, size_t i) {
  return json_number_value(json_array_get(array, i));
}

/* Each collider is below the joint that moves its part of the arm: when joint 1 turns by 90 degrees about its own z
 * axis, the matrices of the file take the colliders of the lower arm with it, and those of the upper arm stay. */
static void colliders_must_follow(const char *write_params, bool swapped) {
  qmat_value *colliders, *written = write_described("fit=contain kind=capsules", write_params, swapped, &colliders);
  const qmat_file *file = (const qmat_file *)written;
  qmat_context context = {0};
  qmat_gltf_asset asset;
  assert_int_equal(qmat_gltf_asset_init(&context, file->parts[0].bytes, file->parts[0].size, "arm", &asset), QMAT_OK);
  const json_t *nodes = json_object_get(asset.root, "nodes");
  const qmat_colliders *made = (const qmat_colliders *)colliders;
  size_t count = 0, left = 0, right = 0;
  assert_int_equal(made->joint_count, made->shape_count);
  for (size_t joint = 0; joint < 2; joint++) {
    size_t of_joint = 0, before = count;
    for (size_t i = 0; i < made->joint_count; i++) of_joint += made->joints[i] == joint;
    const json_t *children = json_object_get(json_array_get(nodes, joint + 1), "children");
    for (size_t c = 0; c < json_array_size(children); c++) {
      const json_t *bound = json_array_get(nodes, (size_t)number_at(children, c));
      if (!json_object_get(json_object_get(bound, "extras"), "qmat_collider")) continue;
      const json_t *matrix = json_object_get(bound, "matrix"), *shapes = json_object_get(bound, "children");
      const json_t *body = json_object_get(json_object_get(bound, "extensions"), "KHR_physics_rigid_bodies");
      assert_true(json_is_true(json_object_get(json_object_get(body, "motion"), "isKinematic")));
      for (size_t i = 0; i < json_array_size(shapes); i++, count++) {
        const json_t *at = json_object_get(json_array_get(nodes, (size_t)number_at(shapes, i)), "translation");
        const double x = number_at(at, 0), y = number_at(at, 1);
        double u = x, v = y; /* in the joint's space */
        for (size_t k = 0; k < 2 && matrix; k++)
          *(k == 0 ? &u : &v) = number_at(matrix, k) * x + number_at(matrix, 4 + k) * y + number_at(matrix, 12 + k);
        /* Joint 1 is moved to its place and turned: (u, v) goes to (-v, u). */
        const double px = joint == 1 ? joint_x - v : u, py = joint == 1 ? joint_y + u : v;
        if (swapped) {
          assert_true(joint == 0 ? x > -0.7 : x < 0.7);
          left += x<-0.7, right += x> 0.7;
        } else if (x < -0.7) {
          left++;
          assert_true(fabs(px - x) < 1e-9 && fabs(py - y) < 1e-9);
        } else if (x > 0.7) {
          right++;
          assert_true(fabs(px - (joint_x - (y - joint_y))) < 1e-6 && fabs(py - (joint_y + x - joint_x)) < 1e-6);
        }
      }
    }
    assert_int_equal(count - before, of_joint);
  }
  assert_int_equal(count, made->shape_count);
  assert_true(left > 0 && right > 0);
  const json_t *own = json_object_get(json_array_get(nodes, 0), "children"); /* the mesh's node has none */
  assert_int_equal(json_array_size(own), 0);
  qmat_gltf_asset_uninit(&asset);
  qmat_context_uninit(&context);
  qmat_value_release(written);
  qmat_value_release(colliders);
}

static void test_colliders_of_a_skinned_model_follow_its_joints(void **state) {
  (void)state;
  colliders_must_follow("format=glb", false);
  colliders_must_follow("format=gltf", false);
  colliders_must_follow("format=glb", true); /* the joints that the colliders say, and no others */
}

static void test_a_skin_beside_a_skinned_mesh_moves_with_it(void **state) {
  (void)state;
  qmat_value *colliders, *written = write_described("fit=contain kind=capsules", "skin_beside=true", false, &colliders);
  const qmat_file *file = (const qmat_file *)written;
  qmat_context context = {0};
  qmat_gltf_asset asset;
  assert_int_equal(qmat_gltf_asset_init(&context, file->parts[0].bytes, file->parts[0].size, "arm", &asset), QMAT_OK);
  const json_t *nodes = json_object_get(asset.root, "nodes"), *node;
  size_t i, count = 0;
  json_array_foreach(nodes, i, node) {
    const int64_t mesh = qmat_gltf_mesh_of(node);
    if (i == 0 || mesh < 0) continue;
    count++;
    assert_true(qmat_gltf_is_skin(asset.root, (size_t)mesh));
    assert_true(json_is_integer(json_object_get(node, "skin")));
    assert_int_equal(json_integer_value(json_object_get(node, "skin")), 0);
    assert_null(json_object_get(node, "translation"));
    const json_t *object = json_array_get(json_object_get(asset.root, "meshes"), (size_t)mesh);
    const json_t *attributes = json_object_get(json_array_get(json_object_get(object, "primitives"), 0), "attributes");
    assert_non_null(json_object_get(attributes, "JOINTS_0"));
    assert_non_null(json_object_get(attributes, "WEIGHTS_0"));
  }
  assert_int_equal(count, 1);
  qmat_gltf_asset_uninit(&asset);
  qmat_context_uninit(&context);
  qmat_value_release(written);
  qmat_value_release(colliders);
}

/* ---- USD ---- */

/* The arm as a USD mesh with `binding` in place of its joints and weights; "" for those of arm_data. */
static void write_usd_arm(const char *path, const char *scheme, const char *binding) {
  size_t sizes[5];
  uint32_t triangles;
  qmat_writer data = arm_data(sizes, &triangles);
  const uint32_t vertices = RINGS * AROUND + 2;
  const float *points = (const float *)(const void *)data.bytes,
              *weights = (const float *)(const void *)(data.bytes + sizes[0] + sizes[1] + sizes[2]);
  const uint16_t *corners = (const uint16_t *)(const void *)(data.bytes + sizes[0]);
  const uint8_t *joints = data.bytes + sizes[0] + sizes[1];
  FILE *file = fopen(path, "w");
  assert_non_null(file);
  fprintf(file,
          "#usda 1.0\n(metersPerUnit = 1)\ndef SkelRoot \"r\" {\ndef Mesh \"arm\" {\nrel skel:skeleton = </s>\n"
          "uniform token subdivisionScheme = \"%s\"\npoint3f[] points = [",
          scheme);
  for (uint32_t v = 0; v < vertices; v++)
    fprintf(file, "%s(%.9g, %.9g, %.9g)", v ? ", " : "", points[3 * v], points[3 * v + 1], points[3 * v + 2]);
  fputs("]\nint[] faceVertexCounts = [", file);
  for (uint32_t t = 0; t < triangles; t++) fputs(t ? ", 3" : "3", file);
  fputs("]\nint[] faceVertexIndices = [", file);
  for (uint32_t i = 0; i < 3 * triangles; i++) fprintf(file, "%s%u", i ? ", " : "", corners[i]);
  fprintf(file, "]\n%s", binding);
  for (int part = 0; part < 2 && !*binding; part++) {
    fputs(part ? "float[] primvars:skel:jointWeights = [" : "int[] primvars:skel:jointIndices = [", file);
    for (uint32_t v = 0; v < vertices; v++)
      for (uint32_t k = 0; k < 2; k++)
        fprintf(file, "%s%g", v + k ? ", " : "", part ? (double)weights[4 * v + k] : (double)joints[4 * v + k]);
    fputs("] (elementSize = 2\ninterpolation = \"vertex\")\n", file);
  }
  fputs("}\n}\n", file);
  /* Joint 1 turns by 90 degrees about z within a second. */
  fputs(
      "def Skeleton \"s\" {\nrel skel:animationSource = </turn>\nuniform token[] joints = [\"arm\", \"arm/fore\"]\n"
      "uniform matrix4d[] bindTransforms = [((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1)), ((1,0,0,0),(0,1,0,0),(0,0,1,0),"
      "(0.25,-0.5,0,1))]\nuniform matrix4d[] restTransforms = [((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1)), ((1,0,0,0),"
      "(0,1,0,0),(0,0,1,0),(0.25,-0.5,0,1))]\n}\ndef SkelAnimation \"turn\" {\nuniform token[] joints = "
      "[\"arm/fore\"]\nquatf[] rotations.timeSamples = {0: [(1,0,0,0)], 24: [(1,0,0,1)]}\n}\n",
      file);
  assert_int_equal(fclose(file), 0);
  qmat_writer_uninit(&data);
}

/* Reads the arm as scene.read does: outputs scene, mesh and report. */
static void read_usd_arm(const char *scheme, const char *binding, qmat_value **read) {
  char folder[64], path[96], setting[128];
  make_folder(folder);
  snprintf(path, sizeof path, "%s/arm.usda", folder);
  write_usd_arm(path, scheme, binding);
  snprintf(setting, sizeof setting, "path=%s", path);
  pipeline_must_run(1, "scene.read", setting, NULL, read);
  unlink(path);
  rmdir(folder);
}

/* Vertices beyond the elbow belong to joint 1, those before it to joint 0. */
static void assert_joints_follow(const double *places, size_t stride, const uint32_t *joints, const double *weights,
                                 size_t count) {
  for (size_t i = 0; i < count; i++) {
    const double x = places[stride * i];
    if (fabs(x) < 1) continue;
    assert_int_equal(joints[4 * i], x > 0);
    assert_near(weights[4 * i], 1, 1e-6);
  }
}

static void test_joints_of_usd_meshes_reach_their_spheres_and_the_layer(void **state) {
  (void)state;
  qmat_value *read[PIPELINE_MOST_PORTS], *simple[PIPELINE_MOST_PORTS], *written[PIPELINE_MOST_PORTS];
  qmat_value *shapes[PIPELINE_MOST_PORTS];
  read_usd_arm("none", "", read);
  const qmat_mesh *mesh = (const qmat_mesh *)read[1];
  assert_int_equal(mesh->skinned_count, RINGS * AROUND + 2);
  assert_joints_follow(mesh->positions, 3, mesh->joints, mesh->weights, mesh->vertex_count);
  pipeline p;
  pipeline_make(&p, (qmat_mesh *)qmat_value_retain(read[1]), "", "");
  pipeline_must_run(1, "medial.simplify", "epsilon=0.02",
                    (const qmat_value *[]){read[1], &p.thickness->base, &p.samples->base, &p.medial->base}, simple);
  const qmat_medial *medial = (const qmat_medial *)simple[0];
  assert_int_equal(medial->skinned_count, medial->sphere_count);
  assert_joints_follow(medial->spheres, 4, medial->joints, medial->weights, medial->sphere_count);
  const qmat_node *write = qmat_node_find("scene.write");
  const qmat_value *inputs[PIPELINE_MOST_PORTS] = {NULL};
  inputs[qmat_input_find(write, "medial")] = simple[0];
  inputs[qmat_input_find(write, "scene")] = read[0];
  pipeline_must_run(1, "medial.colliders", "kind=spheres", (const qmat_value *[]){read[1], simple[0]}, shapes);
  inputs[qmat_input_find(write, "colliders")] = shapes[0];
  pipeline_must_run(1, "scene.write", "format=usda", inputs, written);
  const json_t *warnings = json_object_get(((const qmat_report *)written[1])->root, "warnings");
  assert_int_equal(json_array_size(warnings), 1);
  assert_non_null(strstr(json_string_value(json_array_get(warnings, 0)), "no colliders of 1 meshes that move with"));
  const qmat_file *file = (const qmat_file *)written[0];
  char *text = calloc(file->parts[0].size + 1, 1);
  assert_non_null(text);
  memcpy(text, file->parts[0].bytes, file->parts[0].size);
  assert_non_null(
      strstr(text, "def Points \"spheres\" (\n        prepend apiSchemas = [\"SkelBindingAPI\"]\n    )\n    {\n"));
  const char *at = strstr(text, "int[] primvars:skel:jointIndices = [");
  assert_non_null(at);
  at = strchr(at, '[') + 2;
  at = strchr(at, '[') + 1;
  for (size_t i = 0; i < 4 * medial->sphere_count; i++) {
    char *end;
    assert_int_equal(strtoul(at, &end, 10), medial->joints[i]);
    at = end + (*end == ',');
  }
  assert_int_equal(strncmp(at, "] (\n            elementSize = 4\n", 20), 0);
  assert_non_null(strstr(at, "float[] primvars:skel:jointWeights = ["));
  assert_null(strstr(text, "Physics"));
  free(text);
  for (int i = 0; i < 2; i++)
    qmat_value_release(simple[i]), qmat_value_release(written[i]), qmat_value_release(shapes[i]);
  for (int i = 0; i < 3; i++) qmat_value_release(read[i]);
  pipeline_free(&p);
}

/* `count` numbers of an accessor in the chunk of an asset, of `bytes` bytes each: floats or short integers. */
static void read_numbers(const qmat_gltf_asset *asset, const json_t *number, size_t bytes, size_t count, double *to) {
  const json_t *accessor = json_array_get(json_object_get(asset->root, "accessors"), (size_t)json_number_value(number));
  const json_t *view = json_array_get(json_object_get(asset->root, "bufferViews"),
                                      (size_t)json_number_value(json_object_get(accessor, "bufferView")));
  size_t at = (size_t)json_number_value(json_object_get(accessor, "byteOffset")) +
              (size_t)json_number_value(json_object_get(view, "byteOffset"));
  assert_true(at + bytes * count <= asset->chunk_size);
  for (size_t i = 0; i < count; i++, at += bytes) {
    float single = 0;
    uint16_t whole = 0;
    memcpy(&single, asset->chunk + at, bytes == 4 ? sizeof single : 0);
    memcpy(&whole, asset->chunk + at, bytes == 2 ? sizeof whole : 0);
    to[i] = bytes == 4 ? (double)single : (double)whole;
  }
}

/* Where the file's matrices take a point of the arm with this joint at the end of the motion. */
static void pose_at_end(const qmat_gltf_asset *asset, size_t joint, const double p[2], double posed[2]) {
  const json_t *skin = json_array_get(json_object_get(asset->root, "skins"), 0);
  const json_t *animation = json_array_get(json_object_get(asset->root, "animations"), 0);
  const json_t *sampler = json_array_get(json_object_get(animation, "samplers"), 0);
  const size_t id = (size_t)number_at(json_object_get(skin, "joints"), joint);
  const json_t *place = json_object_get(json_array_get(json_object_get(asset->root, "nodes"), id), "translation");
  double binds[32], turns[8] = {0, 0, 0, 1};
  read_numbers(asset, json_object_get(skin, "inverseBindMatrices"), 4, 32, binds);
  if (joint == 1) read_numbers(asset, json_object_get(sampler, "output"), 4, 8, turns);
  const double *q = joint == 1 ? turns + 4 : turns, *m = binds + 16 * joint;
  const double x = m[0] * p[0] + m[4] * p[1] + m[12], y = m[1] * p[0] + m[5] * p[1] + m[13];
  const double c = 1 - 2 * q[2] * q[2], s = 2 * q[2] * q[3];
  posed[0] = c * x - s * y + number_at(place, 0);
  posed[1] = s * x + c * y + number_at(place, 1);
}

/* `with_model`: the visible mesh knows the model, and bends as that does; else the spheres move it. */
static void usd_model_must_move_as_gltf(bool with_model) {
  const double blended = with_model ? 0.3 : 1; /* from the elbow */
  qmat_value *read[PIPELINE_MOST_PORTS], *simple[PIPELINE_MOST_PORTS], *skin[PIPELINE_MOST_PORTS],
      *written[PIPELINE_MOST_PORTS];
  read_usd_arm("none", "", read);
  pipeline p;
  pipeline_make(&p, (qmat_mesh *)qmat_value_retain(read[1]), "", "");
  pipeline_must_run(1, "medial.simplify", "epsilon=0.02",
                    (const qmat_value *[]){read[1], &p.thickness->base, &p.samples->base, &p.medial->base}, simple);
  pipeline_must_run(1, "medial.skin", "", (const qmat_value *[]){simple[0], with_model ? read[1] : NULL}, skin);
  const qmat_node *write = qmat_node_find("scene.write");
  const qmat_value *inputs[PIPELINE_MOST_PORTS] = {NULL};
  inputs[qmat_input_find(write, "medial")] = simple[0];
  inputs[qmat_input_find(write, "scene")] = read[0];
  inputs[qmat_input_find(write, "skin")] = skin[0];
  pipeline_must_run(1, "scene.write", "format=glb", inputs, written);
  const qmat_file *file = (const qmat_file *)written[0];
  qmat_context context = {0};
  qmat_gltf_asset asset;
  assert_int_equal(qmat_gltf_asset_init(&context, file->parts[0].bytes, file->parts[0].size, "arm", &asset), QMAT_OK);
  /* The vertices of the visible mesh follow the joints as the spheres do. */
  const json_t *mesh = json_array_get(json_object_get(asset.root, "meshes"), 0);
  const json_t *attributes = json_object_get(json_array_get(json_object_get(mesh, "primitives"), 0), "attributes");
  const size_t count = ((const qmat_mesh *)skin[0])->vertex_count;
  double *places = calloc(count, 11 * sizeof *places), *joints = places + 3 * count, *weights = joints + 4 * count;
  assert_non_null(places);
  read_numbers(&asset, json_object_get(attributes, "POSITION"), 4, 3 * count, places);
  read_numbers(&asset, json_object_get(attributes, "JOINTS_0"), 2, 4 * count, joints);
  read_numbers(&asset, json_object_get(attributes, "WEIGHTS_0"), 4, 4 * count, weights);
  size_t turned = 0;
  for (size_t v = 0; v < count; v++) {
    const double *at = places + 3 * v;
    double sum = 0, posed[2];
    for (size_t k = 4 * v; k < 4 * v + 4; k++) sum += weights[k];
    assert_near(sum, 1, 2e-7);
    if (fabs(at[0]) < blended) continue;
    assert_near(joints[4 * v], at[0] > 0, 0);
    assert_near(weights[4 * v], 1, 1e-6);
    pose_at_end(&asset, at[0] > 0, at, posed);
    const bool is_lower = at[0] > 0;
    turned += is_lower;
    assert_near(posed[0], is_lower ? joint_x - (at[1] - joint_y) : at[0], 1e-6);
    assert_near(posed[1], is_lower ? joint_y + (at[0] - joint_x) : at[1], 1e-6);
  }
  assert_true(turned > 0 && turned < count);
  size_t length = 0;
  qmr_medial medial;
  const char *text = qmr_find(file->parts[0].bytes, file->parts[0].size, NULL, &length);
  assert_non_null(text);
  assert_int_equal(qmr_decode_base64(text, length, &medial), 0);
  assert_non_null(medial.joints);
  for (uint32_t i = 0; i < medial.sphere_count; i++) {
    const double x = medial.spheres[4 * (size_t)i];
    if (fabs(x) > 1) assert_int_equal(medial.joints[4 * (size_t)i], x > 0);
  }
  qmr_free(&medial);
  free(places);
  qmat_gltf_asset_uninit(&asset);
  qmat_context_uninit(&context);
  for (int i = 0; i < 2; i++) qmat_value_release(simple[i]), qmat_value_release(written[i]);
  for (int i = 0; i < 3; i++) qmat_value_release(read[i]);
  for (int i = 0; i < 2; i++) qmat_value_release(skin[i]);
  pipeline_free(&p);
}

static void test_a_skinned_usd_model_moves_as_gltf(void **state) {
  (void)state;
  usd_model_must_move_as_gltf(false);
  usd_model_must_move_as_gltf(true);
}

static void test_a_subdivided_cage_keeps_its_joints(void **state) {
  (void)state;
  qmat_value *read[PIPELINE_MOST_PORTS], *fine[PIPELINE_MOST_PORTS];
  read_usd_arm("catmullClark", "", read);
  pipeline_must_run(1, "mesh.subdivide", "level=1", (const qmat_value *[]){read[1]}, fine);
  const qmat_mesh *mesh = (const qmat_mesh *)fine[0];
  assert_true(mesh->vertex_count > RINGS * AROUND + 2);
  assert_int_equal(mesh->skinned_count, mesh->vertex_count);
  assert_joints_follow(mesh->positions, 3, mesh->joints, mesh->weights, mesh->vertex_count);
  for (int i = 0; i < 2; i++) qmat_value_release(fine[i]);
  for (int i = 0; i < 3; i++) qmat_value_release(read[i]);
}

static void test_a_rigid_binding_is_of_all_points_and_a_bad_one_is_left_out_aloud(void **state) {
  (void)state;
  static const struct {
    const char *binding;
    size_t joint; /* 0: none is read */
  } cases[] = {
      {"int[] primvars:skel:jointIndices = [7] (interpolation = \"constant\")\n"
       "float[] primvars:skel:jointWeights = [1]\n",
       7},
      {"int[] primvars:skel:jointIndices = [2, 9, 4] (interpolation = \"constant\" elementSize = 3)\n"
       "float[] primvars:skel:jointWeights = [0.2, 0.7, 0.1]\n",
       9},
      {"int[] primvars:skel:jointIndices = [7, 7, 7] (elementSize = 2)\n"
       "float[] primvars:skel:jointWeights = [1, 1, 1]\n",
       0},
      {"int[] primvars:skel:jointIndices = [7, 7]\nfloat[] primvars:skel:jointWeights = [1]\n", 0},
      {"float[] primvars:skel:jointIndices = [7]\nfloat[] primvars:skel:jointWeights = [1]\n", 0},
      {"int[] primvars:skel:jointIndices = [-3] (interpolation = \"constant\" elementSize = -2)\n"
       "float[] primvars:skel:jointWeights = [nan]\n",
       0},
  };
  bool counted = false;
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    qmat_value *read[PIPELINE_MOST_PORTS];
    read_usd_arm("none", cases[i].binding, read);
    const qmat_mesh *mesh = (const qmat_mesh *)read[1];
    const json_t *warnings = json_object_get(((const qmat_report *)read[2])->root, "warnings");
    bool warned = false;
    for (size_t k = 0; k < json_array_size(warnings); k++)
      warned = warned || strstr(json_string_value(json_array_get(warnings, k)), "/r/arm: its joints are left out: ");
    if (i < 5) assert_int_equal(warned, cases[i].joint == 0);
    for (size_t k = 0; i == 2 && k < json_array_size(warnings); k++)
      counted = counted ||
                strstr(json_string_value(json_array_get(warnings, k)), "left out: 3 values do not make 2 for each of ");
    if (i < 5) assert_int_equal(mesh->skinned_count, cases[i].joint ? mesh->vertex_count : 0);
    for (size_t v = 0; v < mesh->skinned_count; v++) assert_int_equal(mesh->joints[4 * v], cases[i].joint);
    for (int k = 0; k < 3; k++) qmat_value_release(read[k]);
  }
  assert_true(counted);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_spheres_of_a_skinned_model_follow_its_joints),
      cmocka_unit_test(test_colliders_of_a_skinned_model_follow_its_joints),
      cmocka_unit_test(test_a_skin_beside_a_skinned_mesh_moves_with_it),
      cmocka_unit_test(test_joints_of_usd_meshes_reach_their_spheres_and_the_layer),
      cmocka_unit_test(test_a_skinned_usd_model_moves_as_gltf),
      cmocka_unit_test(test_a_subdivided_cage_keeps_its_joints),
      cmocka_unit_test(test_a_rigid_binding_is_of_all_points_and_a_bad_one_is_left_out_aloud),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
