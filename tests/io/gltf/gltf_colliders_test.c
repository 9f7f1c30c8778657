/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Colliders as glTF, USD and robot simulators have them. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "io/collider_frames.h"
#include "io/gltf/gltf_colliders.h"
#include "io/gltf/gltf_motion.h"
#include "io/robot_write.h"
#include "io/usd/usd_colliders.h"
#include "tests/hull_colliders.h"
#include "tests/io/gltf/gltf_assets.h"
#include "tests/shapes.h"

/* A sphere, a capsule of two radii, one of one radius that points down, and a slab; each with a tetrahedron for a hull.
 */
static qmat_colliders *example(void) {
  static const double spheres[] = {1, 2, 3, 0.5, 4, 2, 3, 0.25, 1, 0, 3, 0.5, 1, 2, 6, 0.5};
  static const uint32_t shapes[] = {0, 2, 3, 0, 1, 1, 0, 2, 2, 0, 0, 0};
  static const double tetrahedron[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  static const double body[] = {2, 1, 2, 3, 5, 6, 7, 0.5, -0.25, 0.125};
  return hull_colliders(spheres, 4, shapes, 4, body, tetrahedron, 10);
}

/* v turned by the quaternion q. */
static void turn(const double q[4], const double v[3], double out[3]) {
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  const double m[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                          {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                          {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
  for (int i = 0; i < 3; i++) out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
}

static void test_a_capsules_frame_turns_y_to_its_axis(void **state) {
  (void)state;
  static const double ends[][3] = {{1, 0, 0}, {0, 3, 0}, {0, -2, 0}, {1, 2, -3}, {1e-9, -1, 1e-9}};
  for (size_t i = 0; i < sizeof ends / sizeof *ends; i++) {
    const double first[4] = {4, 5, 6, 1}, second[4] = {4 + ends[i][0], 5 + ends[i][1], 6 + ends[i][2], 1};
    double middle[3], length, q[4], axis[3];
    qmat_capsule_frame(first, second, middle, &length, q);
    turn(q, (const double[]){0, 1, 0}, axis);
    assert_near(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], 1, 1e-12);
    for (int k = 0; k < 3; k++) {
      assert_near(middle[k] - 0.5 * length * axis[k], first[k], 1e-6);
      assert_near(middle[k] + 0.5 * length * axis[k], second[k], 1e-6);
    }
  }
}

static void test_principal_moments_and_axes_make_the_tensor(void **state) {
  (void)state;
  static const double bodies[][10] = {{1, 0, 0, 0, 5, 6, 7, 0.5, -0.25, 0.125},
                                      {1, 0, 0, 0, 5, 5, 5, 0, 0, 0},
                                      {1, 0, 0, 0, 1, 2, 3, 0.9, 0.3, -0.2},
                                      {1, 0, 0, 0, 3, 2, 1, -0.5, 0.5, 0.5}};
  for (size_t b = 0; b < sizeof bodies / sizeof *bodies; b++) {
    double moments[3], q[4], tensor[3][3] = {{0}};
    qmat_principal_inertia(bodies[b], moments, q);
    for (int k = 0; k < 3; k++) {
      double axis[3];
      turn(q, (const double[]){k == 0, k == 1, k == 2}, axis);
      for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) tensor[i][j] += moments[k] * axis[i] * axis[j];
    }
    const double *in = &bodies[b][4];
    const double expected[3][3] = {{in[0], in[3], in[4]}, {in[3], in[1], in[5]}, {in[4], in[5], in[2]}};
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) assert_near(tensor[i][j], expected[i][j], 1e-12);
  }
}

static double at(const json_t *value, const char *key) {
  assert_true(json_is_number(json_object_get(value, key)));
  return json_number_value(json_object_get(value, key));
}

/* An asset of one node that carries the colliders, whose mass takes `meters` per unit. */
static json_t *write_in(double meters, unsigned forms, bool dynamic, json_t *root, qmat_writer *data) {
  qmat_context context = {0};
  qmat_colliders *c = example();
  static const double none[3] = {0, 0, 0};
  qmat_gltf_colliders added = {.colliders = c, .forms = forms, .name = "Mesh", .dynamic = dynamic, .meters = meters};
  if (!root) root = json_pack("{s:[{}]}", "nodes");
  added.nodes_given = json_array_size(json_object_get(root, "nodes"));
  assert_int_equal(qmat_gltf_colliders_init(&context, root, 0, 0, data, &added), QMAT_OK);
  assert_true(qmat_gltf_colliders_attach(root, 0, &added, none));
  qmat_gltf_colliders_uninit(&added);
  qmat_value_release(&c->base);
  qmat_context_uninit(&context);
  return root;
}

static json_t *write(unsigned forms, bool dynamic, json_t *root, qmat_writer *data) {
  return write_in(0, forms, dynamic, root, data);
}

/* The motion of node 0, or NULL. */
static const json_t *motion_of(const json_t *root, int form) {
  const json_t *node = json_array_get(json_object_get(root, "nodes"), 0);
  return json_object_get(json_object_get(json_object_get(node, "extensions"), qmat_gltf_body_extensions[form]),
                         "motion");
}

/* The children of node 0 that have the extension, or of which the name contains `name`. */
static size_t children_with(const json_t *root, const char *extension, const char *name) {
  const json_t *nodes = json_object_get(root, "nodes");
  const json_t *children = json_object_get(json_array_get(nodes, 0), "children");
  size_t count = 0;
  for (size_t i = 0; i < json_array_size(children); i++) {
    const json_t *node = json_array_get(nodes, (size_t)json_integer_value(json_array_get(children, i)));
    const char *own = json_string_value(json_object_get(node, "name"));
    count += extension ? json_object_get(json_object_get(node, "extensions"), extension) != NULL
                       : own && strstr(own, name) != NULL;
  }
  return count;
}

static void test_khronos_shapes_have_all_members_and_slabs_are_hulls_of_hidden_nodes(void **state) {
  (void)state;
  qmat_writer data = {0};
  json_t *root = write(QMAT_GLTF_KHR, true, NULL, &data);
  const json_t *shapes =
      json_object_get(json_object_get(json_object_get(root, "extensions"), "KHR_implicit_shapes"), "shapes");
  assert_int_equal(json_array_size(shapes), 3);
  const json_t *tapered = json_object_get(json_array_get(shapes, 0), "capsule");
  assert_near(at(tapered, "height"), 3, 0);
  assert_near(at(tapered, "radiusBottom"), 0.5, 0);
  assert_near(at(tapered, "radiusTop"), 0.25, 0);
  assert_near(at(json_object_get(json_array_get(shapes, 2), "sphere"), "radius"), 0.5, 0);
  assert_int_equal(children_with(root, "KHR_physics_rigid_bodies", NULL), 4);
  const json_t *nodes = json_object_get(root, "nodes"), *hull = NULL;
  for (size_t i = 0; i < json_array_size(nodes); i++) {
    const json_t *geometry = json_object_get(
        json_object_get(
            json_object_get(json_object_get(json_array_get(nodes, i), "extensions"), "KHR_physics_rigid_bodies"),
            "collider"),
        "geometry");
    if (json_object_get(geometry, "node")) hull = geometry;
  }
  assert_true(json_is_true(json_object_get(hull, "convexHull")));
  const json_t *hidden = json_array_get(nodes, (size_t)at(hull, "node"));
  assert_near(at(hidden, "mesh"), 0, 0);
  assert_int_equal(json_array_size(json_object_get(root, "meshes")), 1);
  assert_int_equal(data.size, 4 * 12 + 12 * 2);
  const json_t *motion = motion_of(root, 0);
  assert_near(at(motion, "mass"), 2, 0);
  assert_int_equal(json_array_size(json_object_get(motion, "inertiaOrientation")), 4);
  assert_int_equal(json_array_size(json_object_get(root, "extensionsUsed")), 2);
  assert_null(json_object_get(root, "extensionsRequired"));
  json_decref(root);
  qmat_writer_uninit(&data);
}

/* The transforms above a body scale its mass and its second moments in each direction. Here they are a scale of 6, 6
 * and -0.75 in all, and turns, one of them by a quaternion of length 2. */
static void test_a_body_follows_the_scales_above_it(void **state) {
  (void)state;
  static const double stretch[3] = {6, 6, -0.75};
  qmat_colliders *c = example();
  const double *in = &c->body[4], half = 0.5 * (in[0] + in[1] + in[2]);
  const double spread[6] = {half - in[0], half - in[1], half - in[2], -in[3], -in[4], -in[5]};
  for (int with_meters = 0; with_meters < 2; with_meters++) {
    qmat_writer data = {0};
    const double meters = with_meters ? 6 : 0, share = with_meters ? 27.0 / 216 : 1;
    json_t *root = json_loads(
        "{\"nodes\": [{\"scale\": [3, 3, 3]}, {\"children\": [0], \"scale\": [1, 1, -0.125]},"
        " {\"children\": [1], \"matrix\": [0, 2, 0, 0, -2, 0, 0, 0, 0, 0, 2, 0, 1, 1, 1, 1]},"
        " {\"children\": [2], \"rotation\": [0, 0, 2, 0]}]}",
        0, NULL);
    write_in(meters, QMAT_GLTF_KHR | QMAT_GLTF_OMI, true, root, &data);
    for (int form = 0; form < 2; form++) {
      const json_t *motion = motion_of(root, form);
      double q[4], tensor[3][3] = {{0}};
      assert_near(at(motion, "mass"), 2 * share, 1e-12);
      for (size_t k = 0; k < 4; k++)
        q[k] = json_number_value(json_array_get(json_object_get(motion, "inertiaOrientation"), k));
      for (size_t k = 0; k < 3; k++) {
        const double moment = json_number_value(json_array_get(json_object_get(motion, "inertiaDiagonal"), k));
        double axis[3];
        turn(q, (const double[]){k == 0, k == 1, k == 2}, axis);
        for (int i = 0; i < 3; i++)
          for (int j = 0; j < 3; j++) tensor[i][j] += moment * axis[i] * axis[j];
      }
      static const int pairs[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
      double trace = 0;
      for (int k = 0; k < 3; k++) trace += share * spread[k] * stretch[k] * stretch[k];
      for (int m = 0; m < 6; m++) {
        const int i = pairs[m][0], j = pairs[m][1];
        assert_near(tensor[i][j], (m < 3 ? trace : 0) - share * spread[m] * stretch[i] * stretch[j], 1e-9);
      }
    }
    json_decref(root);
    qmat_writer_uninit(&data);
  }
  qmat_value_release(&c->base);
}

/* A matrix that shears, of determinant 1, and one that mirrors: the mass stays, and so does the trace of the moments of
 * the sheared body, which no rotation changes. */
static void test_a_body_follows_matrices_that_are_no_scale(void **state) {
  (void)state;
  qmat_colliders *c = example();
  const double *in = &c->body[4], half = 0.5 * (in[0] + in[1] + in[2]);
  const double xx = half - in[0], yy = half - in[1], zz = half - in[2], xy = -in[3];
  static const char *const matrices[] = {"[1, 0, 0, 0, 0.5, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]",
                                         "[-1, 0, 0, 0, 0.5, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]"};
  for (int i = 0; i < 2; i++) {
    char text[160];
    snprintf(text, sizeof text, "{\"nodes\": [{\"matrix\": %s}]}", matrices[i]);
    json_t *root = json_loads(text, 0, NULL);
    qmat_writer data = {0};
    write_in(1, QMAT_GLTF_KHR, true, root, &data);
    const json_t *motion = motion_of(root, 0);
    double sum = 0;
    for (size_t k = 0; k < 3; k++)
      sum += json_number_value(json_array_get(json_object_get(motion, "inertiaDiagonal"), k));
    assert_near(at(motion, "mass"), 2, 1e-12);
    assert_near(sum, 2 * (xx + (i == 0 ? 1 : -1) * xy + 0.25 * yy + yy + zz), 1e-12);
    json_decref(root);
    qmat_writer_uninit(&data);
  }
  qmat_value_release(&c->base);
}

/* What an animation moves, itself or by a node above it, is no toy of gravity; what has no size has no mass. */
static void test_animated_bodies_are_kinematic(void **state) {
  (void)state;
  static const struct {
    const char *asset;
    bool kinematic, massless;
  } cases[] = {
      {"{'nodes':[{},{'children':[0]}],'animations':[{'channels':[{'target':{'node':1,'path':'scale'}}]}]}", true,
       false},
      {"{'nodes':[{}],'animations':[{'channels':[]},{'channels':[{'target':{'node':0,'path':'rotation'}}]}]}", true,
       false},
      {"{'nodes':[{}],'animations':[{'channels':[{'target':{'node':0,'path':'weights'}},{'target':{}}]}]}", false,
       false},
      {"{'nodes':[{},{}],'animations':[{'channels':[{'target':{'node':1,'path':'translation'}}]}]}", false, false},
      {"{'nodes':[{'scale':[0,0,0]}]}", false, true}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char *text = asset_json(cases[i].asset);
    json_t *root = json_loads(text, 0, NULL);
    qmat_writer data = {0};
    write_in(1, QMAT_GLTF_KHR | QMAT_GLTF_OMI, true, root, &data);
    const json_t *khr = motion_of(root, 0), *omi = motion_of(root, 1);
    assert_int_equal(json_is_true(json_object_get(khr, "isKinematic")), cases[i].kinematic);
    assert_string_equal(json_string_value(json_object_get(omi, "type")), cases[i].kinematic ? "kinematic" : "dynamic");
    assert_int_equal(json_object_get(khr, "mass") == NULL, cases[i].massless);
    json_decref(root);
    free(text);
    qmat_writer_uninit(&data);
  }
}

/* A motion of the asset, on the node or above it, a wall that stands still, and a trigger. */
static void test_the_motion_that_the_asset_states_stays(void **state) {
  (void)state;
  static const char *const assets[] = {
      "{'nodes':[{'extensions':{'KHR_physics_rigid_bodies':{'motion':{'isKinematic':true}}}}]}",
      "{'nodes':[{'extensions':{'OMI_physics_body':{'motion':{'type':'kinematic'}}}}]}",
      "{'nodes':[{},{'children':[0],'extensions':{'KHR_physics_rigid_bodies':{'motion':{'mass':5}}}}]}",
      "{'nodes':[{'extensions':{'KHR_physics_rigid_bodies':{'collider':{'geometry':{'node':0}}}}}]}",
      "{'nodes':[{'extensions':{'OMI_physics_body':{'trigger':{}}}}]}",
  };
  for (size_t i = 0; i < sizeof assets / sizeof *assets; i++) {
    char *text = asset_json(assets[i]);
    json_t *root = json_loads(text, 0, NULL), *before = json_deep_copy(json_object_get(root, "nodes"));
    qmat_writer data = {0};
    for (int run = 0; run < 2; run++) {
      write(QMAT_GLTF_KHR | QMAT_GLTF_OMI, true, root, &data);
      for (size_t n = 0; n < json_array_size(before); n++) {
        json_t *was = json_object_get(json_array_get(before, n), "extensions");
        json_t *is = json_object_get(json_array_get(json_object_get(root, "nodes"), n), "extensions");
        assert_true(was ? json_equal(was, is) : !is);
      }
      assert_true(children_with(root, "KHR_physics_rigid_bodies", NULL) >= 4);
    }
    json_decref(before);
    json_decref(root);
    free(text);
    qmat_writer_uninit(&data);
  }
}

static void test_omi_has_convex_meshes_where_radii_differ(void **state) {
  (void)state;
  qmat_writer data = {0};
  json_t *root = write(QMAT_GLTF_OMI, true, NULL, &data);
  const json_t *shapes =
      json_object_get(json_object_get(json_object_get(root, "extensions"), "OMI_physics_shape"), "shapes");
  static const char *const types[] = {"convex", "convex", "capsule", "sphere"};
  assert_int_equal(json_array_size(shapes), 4);
  for (size_t i = 0; i < 4; i++)
    assert_string_equal(json_string_value(json_object_get(json_array_get(shapes, i), "type")), types[i]);
  const json_t *body = json_object_get(json_object_get(json_array_get(json_object_get(root, "nodes"), 0), "extensions"),
                                       "OMI_physics_body");
  assert_string_equal(json_string_value(json_object_get(json_object_get(body, "motion"), "type")), "dynamic");
  json_decref(root);
  qmat_writer_uninit(&data);
}

static void test_names_of_hulls_and_a_second_run_replaces_the_first(void **state) {
  (void)state;
  qmat_writer data = {0};
  const unsigned all = QMAT_GLTF_KHR | QMAT_GLTF_OMI | QMAT_GLTF_UNREAL | QMAT_GLTF_GODOT;
  json_t *root = write(all, false, NULL, &data);
  assert_int_equal(children_with(root, NULL, "UCX_Mesh_0"), 4);
  assert_int_equal(children_with(root, NULL, "-convcolonly"), 4);
  assert_null(json_object_get(json_object_get(json_array_get(json_object_get(root, "nodes"), 0), "extensions"),
                              "KHR_physics_rigid_bodies"));
  write(all, false, root, &data);
  assert_int_equal(children_with(root, NULL, "UCX_Mesh_0"), 4);
  assert_int_equal(children_with(root, "OMI_physics_body", NULL), 4);
  assert_int_equal(json_array_size(json_object_get(root, "extensionsUsed")), 4);
  json_decref(root);
  qmat_writer_uninit(&data);
}

/* What the asset says of its body stays; how an earlier run let it move goes with the next one that does not. */
static void test_the_motion_of_a_body_is_that_of_the_last_run(void **state) {
  (void)state;
  qmat_writer data = {0};
  json_t *root = json_pack("{s:[{s:{s:{s:{}}}}]}", "nodes", "extensions", qmat_gltf_body_extensions[0], "extras");
  for (int run = 0; run < 3; run++) {
    const bool moves = run != 1;
    write(QMAT_GLTF_KHR | QMAT_GLTF_OMI, moves, root, &data);
    const json_t *own = json_object_get(json_array_get(json_object_get(root, "nodes"), 0), "extensions");
    assert_non_null(json_object_get(json_object_get(own, qmat_gltf_body_extensions[0]), "extras"));
    for (int form = 0; form < 2; form++) assert_true(moves == (motion_of(root, form) != NULL));
  }
  json_decref(root);
  qmat_writer_uninit(&data);
}

static bool says(const qmat_file *file, const char *text) {
  return memmem(file->parts[0].bytes, file->parts[0].size, text, strlen(text)) != NULL;
}

static void test_robot_files_have_shapes_in_metres_and_mass(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_colliders *c = example();
  qmat_file *file;
  assert_int_equal(qmat_robot_write(&context, c, QMAT_ROBOT_URDF, "my arm", 0.5, &file), QMAT_OK);
  assert_string_equal(file->format, "urdf");
  assert_int_equal(file->part_count, 4); /* three hulls */
  assert_int_equal(file->parts[1].size, 84 + 4 * 50);
  assert_string_equal(file->parts[1].name, "my_arm_hull_01.stl");
  assert_true(says(file, "<sphere radius=\"0.25\"/>") && says(file, "<mass value=\"2\"/>"));
  assert_true(says(file, "ixx=\"1.25\" iyy=\"1.5\" izz=\"1.75\" ixy=\"0.125\" ixz=\"-0.0625\" iyz=\"0.03125\""));
  qmat_value_release(&file->base);
  assert_int_equal(qmat_robot_write(&context, c, QMAT_ROBOT_MJCF, NULL, 0, &file), QMAT_OK);
  assert_true(says(file, "type=\"capsule\" size=\"0.5\" fromto=\"1 2 3 1 0 3\"") && says(file, "type=\"sphere\""));
  assert_true(says(file, "<mesh name=\"model_hull_02\" vertex=\"10 10 10 11 10 10"));
  assert_true(says(file, "fullinertia=\"5 6 7 0.5 -0.25 0.125\""));
  qmat_value_release(&file->base);
  assert_int_equal(qmat_robot_write(&context, c, QMAT_ROBOT_YAML, NULL, 0, &file), QMAT_ERROR_USAGE);
  assert_null(file);
  qmat_colliders *sphere = qmat_colliders_new();
  sphere->sphere_count = sphere->shape_count = 1;
  sphere->spheres = qmat_alloc(4, sizeof(double));
  sphere->shapes = qmat_calloc(3, sizeof(uint32_t));
  sphere->hull_ends = qmat_calloc(2, sizeof(uint32_t));
  memcpy(sphere->spheres, (double[]){1, 2, 3, 0.5}, 4 * sizeof(double));
  assert_int_equal(qmat_value_seal(&context, &sphere->base), QMAT_OK);
  assert_int_equal(qmat_robot_write(&context, sphere, QMAT_ROBOT_YAML, "link", 0, &file), QMAT_OK);
  assert_true(says(file, "collision_spheres:\n  \"link\":\n    - \"center\": [1, 2, 3]\n      \"radius\": 0.5\n"));
  qmat_value_release(&file->base);
  qmat_value_release(&sphere->base);
  qmat_value_release(&c->base);
  qmat_context_uninit(&context);
}

/* STL is single precision, which has steps of half a unit there. */
static void test_hulls_of_urdf_far_from_zero_have_an_origin(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_colliders *c = example();
  for (size_t i = 0; i < c->point_count; i++) c->points[3 * i + 1] += 5400000.1;
  qmat_file *file;
  assert_int_equal(qmat_robot_write(&context, c, QMAT_ROBOT_URDF, "arm", 0.5, &file), QMAT_OK);
  double first, second, third;
  const char *at = strstr((const char *)file->parts[0].bytes, "_01\">\n      <origin xyz=\"");
  assert_non_null(at);
  assert_int_equal(sscanf(strstr(at, "xyz"), "xyz=\"%lf %lf %lf", &first, &second, &third), 3);
  assert_near(first, 0.5 * c->points[0], 1e-9);
  assert_near(second, 0.5 * c->points[1], 1e-9);
  assert_near(third, 0.5 * c->points[2], 1e-9);
  float corner[3];
  const uint8_t *triangle = file->parts[1].bytes + 84 + 12;
  memcpy(corner, triangle, sizeof corner);
  for (size_t k = 0; k < 3; k++)
    assert_near((double)corner[k], 0.5 * (c->points[3 * (size_t)c->triangles[0] + k] - c->points[k]), 1e-6);
  qmat_value_release(&file->base);
  qmat_value_release(&c->base);
  qmat_context_uninit(&context);
}

static void test_usd_has_a_capsule_of_two_radii_and_convex_hulls(void **state) {
  (void)state;
  qmat_colliders *c = example();
  qmat_writer writer = {0};
  qmat_usd_put_body(&writer, 1, c->body, (const double[]){1, 0, 0}, 1, true);
  qmat_usd_put_colliders(&writer, c, (const double[]){1, 0, 0});
  qmat_put_u8(&writer, 0);
  const char *text = (const char *)writer.bytes;
  assert_non_null(strstr(text, "physics:centerOfMass = (0, 2, 3)"));
  assert_non_null(strstr(text, "bool physics:kinematicEnabled = true"));
  assert_non_null(strstr(text, "double radiusBottom = 0.5\n            double radiusTop = 0.25"));
  assert_non_null(strstr(text, "double3 xformOp:translate = (1.5, 2, 3)"));
  assert_non_null(strstr(text, "physics:approximation = \"convexHull\""));
  assert_non_null(strstr(text, "def Sphere \"shape_04\""));
  qmat_writer_uninit(&writer);
  qmat_value_release(&c->base);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_capsules_frame_turns_y_to_its_axis),
      cmocka_unit_test(test_principal_moments_and_axes_make_the_tensor),
      cmocka_unit_test(test_khronos_shapes_have_all_members_and_slabs_are_hulls_of_hidden_nodes),
      cmocka_unit_test(test_a_body_follows_the_scales_above_it),
      cmocka_unit_test(test_a_body_follows_matrices_that_are_no_scale),
      cmocka_unit_test(test_animated_bodies_are_kinematic),
      cmocka_unit_test(test_the_motion_that_the_asset_states_stays),
      cmocka_unit_test(test_omi_has_convex_meshes_where_radii_differ),
      cmocka_unit_test(test_names_of_hulls_and_a_second_run_replaces_the_first),
      cmocka_unit_test(test_the_motion_of_a_body_is_that_of_the_last_run),
      cmocka_unit_test(test_robot_files_have_shapes_in_metres_and_mass),
      cmocka_unit_test(test_hulls_of_urdf_far_from_zero_have_an_origin),
      cmocka_unit_test(test_usd_has_a_capsule_of_two_radii_and_convex_hulls),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
